"""Public interface for plugins: hooks, specs, base classes, options and errors."""

from pydantic import Field

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import CapabilityError, ContactError
from wearsim.plugins.capabilities import Capabilities, PassLoop
from wearsim.plugins.contact_model import ContactModel, SingleContactModel, refuse_unclaimed
from wearsim.plugins.hookspecs import hookimpl
from wearsim.plugins.manager import registry
from wearsim.plugins.protocols import (
    BODIES,
    Body,
    Distribution,
    Frame,
    FrictionField,
    JointDistribution,
    Load,
    LoadTerm,
    Process,
    Uniforms,
    WearLaw,
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
from wearsim.quantities import (
    InputFile,
    Limit,
    NonNegativeStiffness,
    NonNegativeWearFactor,
    PositiveDuration,
    PositiveForce,
    PositiveLength,
    PositivePressure,
    PositiveValue,
    PositiveWearFactor,
    Quantity,
    Value,
)
from wearsim.units import Kind, QuantityError

__all__ = [
    "BODIES",
    "Body",
    "Capabilities",
    "CapabilityError",
    "ContactBatch",
    "ContactBatchSolution",
    "ContactError",
    "ContactModel",
    "ContactModelSpec",
    "Distribution",
    "Field",
    "Frame",
    "FrictionField",
    "InputFile",
    "JointDistribution",
    "Kind",
    "Limit",
    "Load",
    "LoadSpec",
    "LoadTerm",
    "NonNegativeStiffness",
    "NonNegativeWearFactor",
    "Options",
    "PassLoop",
    "PositiveDuration",
    "PositiveForce",
    "PositiveLength",
    "PositivePressure",
    "PositiveValue",
    "PositiveWearFactor",
    "Process",
    "Quantity",
    "QuantityError",
    "RandomInputSpec",
    "SharedWear",
    "SingleContactModel",
    "Spec",
    "Uniforms",
    "Value",
    "WearLaw",
    "WearLawSpec",
    "hookimpl",
    "refuse_unclaimed",
    "registry",
]
