"""The joint random input `disc`: a roller's yaw and tilt, uniform within the slack of its mount."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Self

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from wearsim.models.random.maxent import LawDistribution, MaxentOptions, in_unit, maxent
from wearsim.models.random.table import TableDistribution, TableOptions
from wearsim.plugins import Distribution, JointDistribution, Options, RandomInputSpec
from wearsim.quantities import Limit, PositiveValue, Value
from wearsim.types import FloatArray
from wearsim.units import QuantityError
from wearsim.uq.distributions.base import Uniform
from wearsim.uq.distributions.truncated_normal import TruncatedNormal, cut_normal

_FARTHEST = 40.0  # no uniform number has a normal score beyond it


class DiscOptions(Options):
    """Options of the joint distribution `disc`."""

    radius: PositiveValue = Field(description="greatest size of both together, e.g. '2 mrad'")


class Disc(JointDistribution):
    """Yaw and tilt, uniform on a disc about zero.

    Two normal scores have a direction that is uniform, and a length r that falls below R with
    probability 1 - exp(-R^2/2), which is the part of the disc's area that it is sent to. Turned
    uniforms 1 - u give the negative of both.
    """

    components = ("yaw", "tilt")
    dimension = 2

    def __init__(self, options: DiscOptions) -> None:
        self._radius = options.radius

    def values(self, uniform: FloatArray) -> FloatArray:
        """Return yaw and tilt, shape (draws, 2), from uniforms (draws, 2)."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        scores = np.clip(ndtri(uniform), -_FARTHEST, _FARTHEST)
        # the least number above zero stands for the centre, where the ratio's limit is right
        square = np.maximum((scores**2).sum(axis=-1, keepdims=True), 1e-300)
        values: FloatArray = self._radius * np.sqrt(-np.expm1(-0.5 * square) / square) * scores
        return values

    @property
    def mean(self) -> tuple[float, float]:
        """Mean of both."""
        return 0.0, 0.0

    @property
    def reach(self) -> tuple[float, float]:
        """Greatest size of each."""
        return self._radius, self._radius


class NormalOptions(Options):
    """Options of the distribution `normal`."""

    mean: Value = Field(description="mean, e.g. '300 N'")
    std: PositiveValue = Field(description="standard deviation, e.g. '30 N'")


class LognormalOptions(Options):
    """Options of the distribution `lognormal`: mean and std, or median and factor."""

    mean: PositiveValue | None = Field(None, description="mean of the value itself, e.g. '300 N'")
    std: PositiveValue | None = Field(None, description="standard deviation of the value itself")
    median: PositiveValue | None = Field(None, description="median, e.g. '300 N'")
    factor: float | None = Field(
        None, gt=1.0, description="geometric standard deviation: 1.5 for +50 % and -33 %"
    )

    @model_validator(mode="after")
    def _exactly_one_pair(self) -> Self:
        given = [name for name, value in self if value is not None]
        if given not in (["mean", "std"], ["median", "factor"]):
            expected = "either mean and std, or median and factor"
            raise QuantityError("needs one pair", " and ".join(given) or "none", expected)
        return self


class UniformOptions(Options):
    """Options of the distribution `uniform`."""

    low: Value = Field(description="least value, e.g. '250 N'")
    high: Value = Field(description="greatest value, e.g. '350 N'")

    @model_validator(mode="after")
    def _rising(self, info: ValidationInfo) -> Self:
        check_rising(self.low, self.high, info)
        return self


class TruncatedNormalOptions(Options):
    """Options of the distribution `truncated-normal`."""

    parent_mean: Value = Field(description="mean before truncation; for the mean after it: maxent")
    parent_std: PositiveValue = Field(
        description="standard deviation before truncation; for that after it: maxent"
    )
    support: tuple[Limit, Limit] = Field(
        description="least and greatest value, e.g. ['0 N', 'inf']"
    )

    @model_validator(mode="after")
    def _rising(self, info: ValidationInfo) -> Self:
        check_rising(*self.support, info)
        return self


class ConstantOptions(Options):
    """Options of the distribution `constant`."""

    value: Value = Field(description="the value of every draw, e.g. '300 N'")


def check_rising(low: float, high: float, info: ValidationInfo) -> None:
    """Raise a QuantityError unless a support goes from a lower to a higher value."""
    if not low < high:
        what = f"the upper limit must lie above the lower one{in_unit(info)}"
        raise QuantityError(what, f"{low:g} to {high:g}")


def normal(options: NormalOptions) -> LawDistribution:
    """Build the distribution `normal`."""
    return LawDistribution(TruncatedNormal(-math.inf, math.inf, options.mean, options.std))


def uniform(options: UniformOptions) -> LawDistribution:
    """Build the distribution `uniform`."""
    return LawDistribution(Uniform(options.low, options.high))


def truncated_normal(options: TruncatedNormalOptions) -> LawDistribution:
    """Build the distribution `truncated-normal`."""
    return LawDistribution(cut_normal(*options.support, options.parent_mean, options.parent_std))


class Lognormal(Distribution):
    """A value whose logarithm is normal."""

    def __init__(self, options: LognormalOptions) -> None:
        if options.median is not None and options.factor is not None:
            self._centre, self._spread = math.log(options.median), math.log(options.factor)
        else:
            assert options.mean is not None
            assert options.std is not None
            square = math.log1p((options.std / options.mean) ** 2)
            self._centre = math.log(options.mean) - 0.5 * square
            self._spread = math.sqrt(square)

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the values below which a draw falls with these probabilities, same shape."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        return np.exp(self._centre + self._spread * ndtri(probability))

    @cached_property
    def support(self) -> tuple[float, float]:
        """Least and greatest value."""
        return 0.0, math.inf

    @cached_property
    def mean(self) -> float:
        """Exact mean."""
        return math.exp(self._centre + 0.5 * self._spread**2)

    @cached_property
    def std(self) -> float:
        """Exact standard deviation."""
        return self.mean * math.sqrt(math.expm1(self._spread**2))


class Constant(Distribution):
    """The same value at every draw."""

    def __init__(self, options: ConstantOptions) -> None:
        self._value = options.value

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the value, shape as `probability`."""
        return np.full(np.shape(probability), self._value)

    @cached_property
    def support(self) -> tuple[float, float]:
        """The value, twice."""
        return self._value, self._value

    @cached_property
    def mean(self) -> float:
        """The value."""
        return self._value

    @cached_property
    def std(self) -> float:
        """Zero."""
        return 0.0


_ENTROPY = (
    "Jaynes, Physical Review 106 (1957), DOI 10.1103/PhysRev.106.620",
    "Chevalier, Cloupet, Soize, Wear 258 (2005), DOI 10.1016/j.wear.2004.11.012",
)

SPECS = (
    RandomInputSpec(
        name="maxent",
        factory=maxent,
        options=MaxentOptions,
        summary="the least certain law that has this support, mean and standard deviation",
        references=_ENTROPY,
    ),
    RandomInputSpec(
        name="normal",
        factory=normal,
        options=NormalOptions,
        summary="normal law of given mean and standard deviation",
    ),
    RandomInputSpec(
        name="lognormal",
        factory=Lognormal,
        options=LognormalOptions,
        summary="positive value whose logarithm is normal",
    ),
    RandomInputSpec(
        name="uniform",
        factory=uniform,
        options=UniformOptions,
        summary="uniform between two limits",
    ),
    RandomInputSpec(
        name="truncated-normal",
        factory=truncated_normal,
        options=TruncatedNormalOptions,
        summary="normal law cut off at limits; its mean and std are the parent's (else maxent)",
    ),
    RandomInputSpec(
        name="constant",
        factory=Constant,
        options=ConstantOptions,
        summary="one value, certain",
    ),
    RandomInputSpec(
        name="table",
        factory=TableDistribution,
        options=TableOptions,
        summary="measured samples, or a table of quantiles, from a CSV file",
    ),
    RandomInputSpec(
        name="disc",
        factory=Disc,
        options=DiscOptions,
        role="joint",
        summary="yaw and tilt together, uniform on a disc",
        references=_ENTROPY[1:],
    ),
)
