"""The exact theory of elastic half-spaces in steady rolling, as a contact model of wearsim."""

from wearsim_halfspace.model import SPEC, Halfspace, HalfspaceOptions, wearsim_contact_models

__all__ = ["SPEC", "Halfspace", "HalfspaceOptions", "wearsim_contact_models"]
