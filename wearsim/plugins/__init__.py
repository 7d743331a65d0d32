"""What a plugin's author imports: the hooks, the specs they yield and the protocols they keep."""

from wearsim.plugins.hookspecs import hookimpl
from wearsim.plugins.manager import registry
from wearsim.plugins.protocols import (
    BODIES,
    Body,
    Capabilities,
    ContactModel,
    Load,
    LoadTerm,
    PassLoop,
    WearLaw,
)
from wearsim.plugins.specs import (
    ContactModelSpec,
    LoadSpec,
    Options,
    RandomInputSpec,
    Spec,
    WearLawSpec,
)

__all__ = [
    "BODIES",
    "Body",
    "Capabilities",
    "ContactModel",
    "ContactModelSpec",
    "Load",
    "LoadSpec",
    "LoadTerm",
    "Options",
    "PassLoop",
    "RandomInputSpec",
    "Spec",
    "WearLaw",
    "WearLawSpec",
    "hookimpl",
    "registry",
]
