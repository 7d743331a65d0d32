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
from wearsim.plugins.random_inputs import (
    Distribution,
    Frame,
    FrictionField,
    JointDistribution,
    Process,
    Uniforms,
)
from wearsim.plugins.shared_wear import SharedWear
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
    "Distribution",
    "Frame",
    "FrictionField",
    "JointDistribution",
    "Load",
    "LoadSpec",
    "LoadTerm",
    "Options",
    "PassLoop",
    "Process",
    "RandomInputSpec",
    "SharedWear",
    "Spec",
    "Uniforms",
    "WearLaw",
    "WearLawSpec",
    "hookimpl",
    "registry",
]
