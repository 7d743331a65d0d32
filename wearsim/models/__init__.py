"""The built-in contact models, wear laws and loads, registered through everyone's hooks."""

from __future__ import annotations

from collections.abc import Iterable

from wearsim.models import archard, hertz_fastsim, loads, slender
from wearsim.plugins import ContactModelSpec, LoadSpec, WearLawSpec, hookimpl


@hookimpl
def wearsim_contact_models() -> Iterable[ContactModelSpec]:
    """Yield the built-in contact models."""
    return (hertz_fastsim.SPEC, slender.SPEC)


@hookimpl
def wearsim_wear_laws() -> Iterable[WearLawSpec]:
    """Yield the built-in wear laws."""
    return (archard.SPEC,)


@hookimpl
def wearsim_loads() -> Iterable[LoadSpec]:
    """Yield the built-in loads and load terms."""
    return loads.SPECS
