"""Small random inputs, so that the parsing tests depend only on the scenario package."""

from __future__ import annotations

from types import ModuleType
from typing import Self

import numpy as np
from pydantic import Field, model_validator
from scipy.special import ndtri

from wearsim.csv_tables import read_columns
from wearsim.plugins import (
    Distribution,
    FrictionField,
    JointDistribution,
    Options,
    Process,
    RandomInputSpec,
    hookimpl,
)
from wearsim.quantities import (
    InputFile,
    Limit,
    PositiveDuration,
    PositiveLength,
    PositiveValue,
    Value,
)
from wearsim.units import QuantityError


class FlatOptions(Options):
    low: Value = Field(description="Least value.")
    high: Value = Field(description="Greatest value.")


class Flat(Distribution):
    """Uniform between two values."""

    def __init__(self, options: FlatOptions) -> None:
        self.low, self.high = options.low, options.high

    def quantile(self, probability):
        return self.low + (self.high - self.low) * probability

    @property
    def warnings(self) -> tuple[str, ...]:
        return ("has a constant value",) if self.low == self.high else ()


class BellOptions(Options):
    mean: Value = Field(description="Mean.")
    std: PositiveValue = Field(description="Standard deviation.")
    support: tuple[Limit, Limit] = Field(default=(-np.inf, np.inf), description="Ends.")

    @model_validator(mode="after")
    def _feasible(self) -> Self:
        if not self.support[0] <= self.mean <= self.support[1]:
            raise QuantityError("the mean is outside the support", f"{self.mean:g}", "one inside")
        return self


class Bell(Distribution):
    """Normal, clipped at the ends of a wide support, which leaves its moments unchanged."""

    def __init__(self, options: BellOptions) -> None:
        self.options = options

    def quantile(self, probability):
        low, high = self.options.support
        return np.clip(self.options.mean + self.options.std * ndtri(probability), low, high)

    mean = property(lambda self: self.options.mean)
    std = property(lambda self: self.options.std)


class LogOptions(Options):
    file: InputFile = Field(description="Samples.")


class Logged(Distribution):
    """Sorted samples of a file."""

    def __init__(self, options: LogOptions) -> None:
        file = options.file
        self.samples = np.sort(read_columns(file.text, file.path, {"value": "N"})["value"])

    def quantile(self, probability):
        return np.quantile(self.samples, probability)

    mean = property(lambda self: float(self.samples.mean()))
    std = property(lambda self: float(self.samples.std()))


class SquareOptions(Options):
    side: PositiveValue = Field(description="Side of the square.")


class Square(JointDistribution):
    """Two independent uniform angles."""

    components = ("yaw", "tilt")
    dimension = 2

    def __init__(self, options: SquareOptions) -> None:
        self.side = options.side

    def values(self, uniform):
        return self.side * (uniform - 0.5)

    mean = property(lambda self: (0, 0))  # integers, as a plugin may have them
    reach = property(lambda self: (0.5 * self.side, 0.5 * self.side))


class Pair(Square):
    components = ("left", "right")


class PatchesOptions(Options):
    length: PositiveLength = Field(description="Size of a patch.")


class Patches(FrictionField):
    """The same friction at all points."""

    def __init__(self, options: PatchesOptions, marginal: Distribution) -> None:
        self.marginal = marginal

    def values(self, x, y, uniforms):
        return np.full_like(x, self.marginal.quantile(uniforms(0, 1))[0])


class WanderOptions(Options):
    time: PositiveDuration = Field(description="Time of one value.")


class Wander(Process):
    """Independent values at each step."""

    def __init__(self, options: WanderOptions, marginal: Distribution) -> None:
        self.marginal, self.spacing = marginal, options.time

    def path(self, points, uniforms):
        return self.marginal.quantile(uniforms(0, points))


def _plugins() -> ModuleType:
    module = ModuleType("small_random_inputs")

    @hookimpl
    def wearsim_random_inputs():
        yield RandomInputSpec("flat", FlatOptions, "even", factory=Flat, protocol=2)
        yield RandomInputSpec("bell", BellOptions, "normal", factory=Bell, protocol=2)
        yield RandomInputSpec("logged", LogOptions, "samples", factory=Logged, protocol=2)
        yield RandomInputSpec(
            "square", SquareOptions, "both", factory=Square, role="joint", protocol=2
        )
        yield RandomInputSpec(
            "pair", SquareOptions, "others", factory=Pair, role="joint", protocol=2
        )
        yield RandomInputSpec(
            "patches", PatchesOptions, "field", factory=Patches, role="field", protocol=2
        )
        yield RandomInputSpec(
            "wander", WanderOptions, "process", factory=Wander, role="process", protocol=2
        )

    module.wearsim_random_inputs = wearsim_random_inputs
    return module


class SmallRandomInputs:
    name, value, dist = "small-random", "small_random_inputs", None

    def load(self) -> ModuleType:
        return _plugins()
