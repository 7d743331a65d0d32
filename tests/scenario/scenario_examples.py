"""A valid scenario and small plugins, so that these tests depend only on the scenario package."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from pydantic import Field, model_validator

from wearsim.csv_tables import read_columns
from wearsim.plugins import (
    ContactModelSpec,
    Load,
    LoadSpec,
    LoadTerm,
    Options,
    SingleContactModel,
    WearLaw,
    WearLawSpec,
    hookimpl,
)
from wearsim.quantities import (
    Duration,
    InputFile,
    NonNegativeWearFactor,
    PerPower,
    PositiveForce,
    PositiveStiffness,
)
from wearsim.scenario import Scenario
from wearsim.types import ContactSolution, FloatArray

RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"

GOOD = """\
title = "a rig"
seed = 3

[roller]
radius = "20 mm"
crown_radius = "500 mm"
material = "steel"

[cylinder]
radius = "25 mm"   # not the diameter
material = "steel"

[operation]
speed = "1000 rpm"
duration = "450 min"
rollers = 3

[load]
normal_force = "300 N"

[friction]
coefficient = 0.1

[creepage]
longitudinal = 1e-3

[contact]
model = "slender"

[wear]
law = "archard-dissipation"
cylinder = { k_over_h = "1.1e-11 1/Pa" }
roller = { k_over_h = "0 1/Pa" }
"""

# lines of the scenario, and the same lines with random values
FORCE_LINE = 'normal_force = "300 N"'
MU = "coefficient = 0.1"
XI = "longitudinal = 1e-3"
K = 'k_over_h = "1.1e-11 1/Pa"'

LOAD = (FORCE_LINE, 'normal_force = {distribution = "flat", low = "200 N", high = "0.4 kN"}')
FRICTION = (
    MU,
    (
        'coefficient = {distribution = "patches", length = "50 um", persistence = "per-pass", '
        'marginal = {distribution = "bell", mean = 0.1, std = 0.02, support = [0.01, "inf"]}}'
    ),
)
SLACK = (
    XI,
    (
        f"{XI}\nmisalignment = "
        '{distribution = "square", side = "4 mrad", persistence = "per-roller"}'
    ),
)
WEAR = (K, 'k_over_h = {distribution = "flat", low = "1e-11 1/Pa", high = "3e-11 1/Pa"}')


class SlenderOptions(Options):
    pass


class FastsimOptions(Options):
    mx: int = Field(default=50, ge=2, description="Elements along rolling.")
    my: int = Field(default=50, ge=2, description="Strips.")


class ConstantOptions(Options):
    normal_force: PositiveForce = Field(description="The load.")


class SpringOptions(ConstantOptions):
    stiffness: PositiveStiffness = Field(description="Stiffness of the mounting.")


class RecordedOptions(Options):
    file: InputFile = Field(description="The log.")

    @model_validator(mode="after")
    def readable(self) -> RecordedOptions:
        columns = {"time": "s", "load": "N"}
        read_columns(self.file.text, self.file.path, columns, rising="time")
        return self


class ThermalOptions(Options):
    gain: PerPower = Field(description="Load per power.")
    time_constant: Duration = Field(description="Time constant.")


class Factor(Options):
    k_over_h: NonNegativeWearFactor = Field(description="K/H.")


class ArchardOptions(Options):
    cylinder: Factor = Field(description="The cylinder.")
    roller: Factor = Field(description="The roller.")


class _Model(SingleContactModel):
    """Contact model that is built only."""

    def solve_contact(self, *contact: object) -> ContactSolution:
        raise NotImplementedError


class _Law(WearLaw):
    """Wear law that is built only."""

    def depth_per_pass(self, *contact: object) -> FloatArray:
        raise NotImplementedError


class _Load(Load):
    """Load that is built only."""

    def force(self, time: FloatArray) -> FloatArray:
        raise NotImplementedError

    def mean(self, start: float, stop: float) -> float:
        raise NotImplementedError


class _Term(LoadTerm):
    """Load term that is built only."""

    def advance(self, *state: object) -> FloatArray:
        raise NotImplementedError

    def mean_force(self, *state: object) -> FloatArray:
        raise NotImplementedError


#: options of the plugins that were built
BUILT: list[Options] = []


def _build_model(options: Options, *others: object) -> _Model:
    BUILT.append(options)
    return _Model()


def _build_law(options: Options) -> _Law:
    BUILT.append(options)
    return _Law()


def _build_load(options: Options) -> _Load:
    BUILT.append(options)
    return _Load()


def _build_term(options: Options) -> _Term:
    BUILT.append(options)
    return _Term()


def _plugins() -> ModuleType:
    module = ModuleType("small_plugins")

    @hookimpl
    def wearsim_contact_models():
        yield ContactModelSpec(
            "slender", SlenderOptions, "strips", factory=_build_model, protocol=2
        )
        yield ContactModelSpec(
            "hertz-fastsim", FastsimOptions, "ellipse", factory=_build_model, protocol=2
        )

    @hookimpl
    def wearsim_wear_laws():
        yield WearLawSpec(
            "archard-dissipation", ArchardOptions, "Archard", factory=_build_law, protocol=2
        )

    @hookimpl
    def wearsim_loads():
        yield LoadSpec("constant", ConstantOptions, "constant", factory=_build_load, protocol=2)
        yield LoadSpec("spring", SpringOptions, "spring", factory=_build_load, protocol=2)
        yield LoadSpec("recorded", RecordedOptions, "log", factory=_build_load, protocol=2)
        yield LoadSpec(
            "thermal", ThermalOptions, "thermal", factory=_build_term, role="term", protocol=2
        )

    module.wearsim_contact_models = wearsim_contact_models
    module.wearsim_wear_laws = wearsim_wear_laws
    module.wearsim_loads = wearsim_loads
    return module


class SmallPlugins:
    name, value, dist = "small", "small_plugins", None

    def load(self) -> ModuleType:
        return _plugins()


Parse = Callable[..., Scenario]
