"""Built-in distributions of random inputs, among them tables of measured samples or quantiles."""

from __future__ import annotations

import math
from copy import copy
from functools import cached_property, lru_cache
from typing import Annotated, Any, Self, TypeAlias

import numpy as np
from pydantic import Field, PlainValidator, PrivateAttr, ValidationInfo, model_validator

from wearsim.csv_tables import column_names, read_columns
from wearsim.errors import Mistake, ScenarioError
from wearsim.plugins import Distribution, JointDistribution, Options, RandomInputSpec
from wearsim.quantities import InputFile, Limit, PositiveValue, Quantity, Value
from wearsim.types import FloatArray
from wearsim.units import QuantityError, as_written
from wearsim.uq.distributions.base import MaxentDistribution, Uniform
from wearsim.uq.distributions.maxent import Infeasible, maximum_entropy
from wearsim.uq.distributions.mixture import Mixture
from wearsim.uq.distributions.truncated_normal import TruncatedNormal, cut_normal

_maximum_entropy = lru_cache(maximum_entropy)  # a scenario is read several times
_LARGEST_SCORE = 40.0  # above the normal score of any floating-point number below 1
_ENTROPY = (
    "Jaynes, Physical Review 106 (1957), DOI 10.1103/PhysRev.106.620",
    "Chevalier, Cloupet, Soize, Wear 258 (2005), DOI 10.1016/j.wear.2004.11.012",
)


class TableOptions(Options):
    """Options of the distribution `table`."""

    file: InputFile = Field(
        description="CSV with the samples in a column 'value [N]', or quantiles with 'probability'"
    )
    _quantiles: tuple[FloatArray, FloatArray] = PrivateAttr()

    @model_validator(mode="after")
    def _read(self, info: ValidationInfo) -> Self:
        # the unit is that of the value that the distribution replaces
        replaced: Quantity | None = (info.context or {}).get("quantity")
        self._quantiles = _read_quantiles(self.file, replaced.kind.unit if replaced else "1")
        return self

    @property
    def quantiles(self) -> tuple[FloatArray, FloatArray]:
        """Probabilities from 0 to 1, and the quantiles [SI]."""
        return self._quantiles


def _read_quantiles(file: InputFile, unit: str) -> tuple[FloatArray, FloatArray]:
    """Return the probabilities and quantiles of a file; raise a ScenarioError for mistakes."""
    if "probability" not in column_names(file.text):
        samples = np.sort(read_columns(file.text, file.path, {"value": unit})["value"])
        # Sample i of n has the probability (i - 1/2)/n, with constant ends beyond the first and
        # the last, so that the mean is that of the samples. With equal steps from 0 to 1 the two
        # extremes would have half the weight of the others.
        places = (np.arange(len(samples)) + 0.5) / len(samples)
        values = np.concatenate([samples[:1], samples, samples[-1:]])
        return np.concatenate([[0.0], places, [1.0]]), values
    read = read_columns(
        file.text, file.path, {"probability": "1", "value": unit}, rising="probability"
    )
    probability, value = read["probability"], read["value"]
    mistakes = []
    if probability[0] != 0.0 or probability[-1] != 1.0:
        got = f"{probability[0]:g} to {probability[-1]:g}"
        mistakes.append(Mistake("", "", "column 'probability' must go from 0 to 1", got))
    if np.any(np.diff(value) < 0.0):
        first = int(np.argmax(np.diff(value) < 0.0))
        got = f"{value[first + 1]:g} after {value[first]:g}"
        mistakes.append(Mistake("", "", "column 'value' must not decrease", got))
    if mistakes:
        raise ScenarioError(file.path, mistakes)
    return probability, value


class TableDistribution(Distribution):
    """Quantile function that interpolates linearly in a table.

    Parameters
    ----------
    probability, value : ndarray, shape (points,)
        Probabilities from 0 to 1, and the quantiles; two equal ones are a constant.
    """

    def __init__(self, probability: FloatArray, value: FloatArray) -> None:
        self._probability, self._value = probability, value

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles, shape as `probability`."""
        return np.interp(probability, self._probability, self._value)

    @cached_property
    def support(self) -> tuple[float, float]:
        """Minimum and maximum of the table."""
        return float(self._value[0]), float(self._value[-1])

    @cached_property
    def mean(self) -> float:
        """Exact mean."""
        return float(np.dot(np.diff(self._probability), 0.5 * (self._value[1:] + self._value[:-1])))

    @cached_property
    def std(self) -> float:
        """Exact standard deviation."""
        low, high = self._value[:-1] - self.mean, self._value[1:] - self.mean
        squares = (low * low + low * high + high * high) / 3.0
        return float(np.sqrt(np.dot(np.diff(self._probability), squares)))


class DiscOptions(Options):
    """Options of the joint distribution `disc`."""

    radius: PositiveValue = Field(description="maximum magnitude of (yaw, tilt), e.g. '2 mrad'")


class Disc(JointDistribution):
    """Joint distribution of yaw and tilt, uniform on a disc about zero.

    Two normal scores have a uniform direction, and a length r that is below R with probability
    1 - exp(-R^2/2). This is the fraction of the area of the disc inside the image of R. Reflected
    uniform numbers 1 - u give the negative of both angles.
    """

    components = ("yaw", "tilt")
    dimension = 2

    def __init__(self, options: DiscOptions) -> None:
        self._radius = options.radius

    def values(self, uniform: FloatArray) -> FloatArray:
        """Return yaw and tilt, shape (draws, 2), from uniform numbers (draws, 2)."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        scores = np.clip(ndtri(uniform), -_LARGEST_SCORE, _LARGEST_SCORE)
        # a tiny positive number replaces zero at the centre, where the limit of the ratio is used
        square = np.maximum((scores**2).sum(axis=-1, keepdims=True), 1e-300)
        return np.asarray(self._radius * np.sqrt(-np.expm1(-0.5 * square) / square) * scores)

    @property
    def mean(self) -> tuple[float, float]:
        """Mean of both angles."""
        return 0.0, 0.0

    @property
    def reach(self) -> tuple[float, float]:
        """Maximum magnitude of each angle."""
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
            raise QuantityError(
                "needs one pair",
                " and ".join(given) or "none",
                "either mean and std, or median and factor",
            )
        return self


class UniformOptions(Options):
    """Options of the distribution `uniform`."""

    low: Value = Field(description="minimum, e.g. '250 N'")
    high: Value = Field(description="maximum, e.g. '350 N'")

    @model_validator(mode="after")
    def _rising(self, info: ValidationInfo) -> Self:
        check_rising(self.low, self.high, info)
        return self


class TruncatedNormalOptions(Options):
    """Options of the distribution `truncated-normal`."""

    parent_mean: Value = Field(description="mean before truncation; maxent takes the mean after it")
    parent_std: PositiveValue = Field(
        description="standard deviation before truncation; maxent takes that after it"
    )
    support: tuple[Limit, Limit] = Field(description="minimum and maximum, e.g. ['0 N', 'inf']")

    @model_validator(mode="after")
    def _rising(self, info: ValidationInfo) -> Self:
        check_rising(*self.support, info)
        return self


class ConstantOptions(Options):
    """Options of the distribution `constant`."""

    value: Value = Field(description="the value, e.g. '300 N'")


class MaxentOptions(Options):
    """Options of the distribution `maxent`."""

    support: tuple[Limit, Limit] = Field(
        description="minimum and maximum possible value, e.g. ['0 N', 'inf']"
    )
    mean: Value | None = Field(None, description="mean, e.g. '307 N'")
    std: PositiveValue | None = Field(None, description="standard deviation, e.g. '32 N'")
    mean_log: float | None = Field(
        None,
        description="mean of the logarithm of the SI value, instead of std: a gamma distribution",
    )

    @model_validator(mode="after")
    def _feasible(self, info: ValidationInfo) -> Self:
        try:
            self.distribution()
        except Infeasible as error:
            raise QuantityError(f"{error}{_in_unit(info)}") from error
        return self

    def distribution(self) -> MaxentDistribution:
        """Return the distribution of maximum entropy."""
        return copy(_maximum_entropy(self.support, self.mean, self.std, self.mean_log))


def check_rising(low: float, high: float, info: ValidationInfo) -> None:
    """Raise a QuantityError unless the limits of a support are in ascending order."""
    if not low < high:
        raise QuantityError(
            f"the upper limit must be above the lower one{_in_unit(info)}", f"{low:g} to {high:g}"
        )


def _in_unit(info: ValidationInfo) -> str:
    """Return a remark on the unit of the numbers in a message, if they have one."""
    replaced: Quantity | None = (info.context or {}).get("quantity")
    return "" if replaced is None else f" (numbers in {replaced.kind.unit})"


class Lognormal(Distribution):
    """Distribution of a value whose logarithm is normal."""

    def __init__(self, options: LognormalOptions) -> None:
        if options.median is not None and options.factor is not None:
            self._centre, self._spread = math.log(options.median), math.log(options.factor)
        else:
            assert options.mean is not None
            assert options.std is not None
            variance = math.log1p((options.std / options.mean) ** 2)
            self._centre = math.log(options.mean) - 0.5 * variance
            self._spread = math.sqrt(variance)

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles, shape as `probability`."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        return np.exp(self._centre + self._spread * ndtri(probability))

    @cached_property
    def support(self) -> tuple[float, float]:
        """Minimum and maximum."""
        return 0.0, math.inf

    @cached_property
    def mean(self) -> float:
        """Exact mean."""
        return math.exp(self._centre + 0.5 * self._spread**2)

    @cached_property
    def std(self) -> float:
        """Exact standard deviation."""
        return self.mean * math.sqrt(math.expm1(self._spread**2))


_TABLE = "a table with a distribution and its options"


def _read_component(value: object, info: ValidationInfo) -> Distribution | None:
    """Return the distribution of a table by the reader in the validation context.

    The reader reports the mistakes within the table itself, and then returns None.
    """
    if not isinstance(value, dict):
        raise QuantityError("is not a table", as_written(value), _TABLE)
    distribution: Distribution | None = (info.context or {})["component"](value)
    return distribution


#: A distribution within the options of another one.
Component: TypeAlias = Annotated[
    Any, PlainValidator(_read_component, json_schema_input_type=dict[str, object])
]


class MixtureOptions(Options):
    """Options of the distribution `mixture`."""

    of: tuple[Component, ...] = Field(
        description="tables with a distribution and its options each, such as"
        " {distribution = 'lognormal', median = '300 N', factor = 1.2}"
    )
    weights: tuple[float, ...] = Field(
        description="shares of the distributions, [0.7, 0.3]; they are divided by their sum"
    )

    @model_validator(mode="after")
    def _complete(self) -> Self:
        count, weights = len(self.of), len(self.weights)
        positive = all(0.0 < weight < math.inf for weight in self.weights)
        unequal = f"{weights} weights for {count} distributions"
        shares = as_written(self.weights), "shares such as [0.7, 0.3]"
        for fits, what, got, expected in (
            (count > 1, "needs two distributions or more", f"{count} in 'of'", _TABLE),
            (weights == count, "needs a weight for each distribution", unequal, f"{count}"),
            (positive, "'weights' must be above 0", *shares),
        ):
            if not fits:
                raise QuantityError(what, got, expected)
        return self


SPECS = (
    RandomInputSpec(
        name="maxent",
        factory=MaxentOptions.distribution,
        options=MaxentOptions,
        summary="maximum entropy for given support, mean and standard deviation",
        references=_ENTROPY,
        protocol=2,
    ),
    RandomInputSpec(
        name="normal",
        factory=lambda options: TruncatedNormal(-math.inf, math.inf, options.mean, options.std),
        options=NormalOptions,
        summary="normal with given mean and standard deviation",
        protocol=2,
    ),
    RandomInputSpec(
        name="lognormal",
        factory=Lognormal,
        options=LognormalOptions,
        summary="positive value whose logarithm is normal",
        protocol=2,
    ),
    RandomInputSpec(
        name="uniform",
        factory=lambda options: Uniform(options.low, options.high),
        options=UniformOptions,
        summary="uniform between two limits",
        protocol=2,
    ),
    RandomInputSpec(
        name="truncated-normal",
        factory=lambda options: cut_normal(
            *(*options.support, options.parent_mean, options.parent_std)
        ),
        options=TruncatedNormalOptions,
        summary="normal truncated at limits; mean and std are those before (else maxent)",
        protocol=2,
    ),
    RandomInputSpec(
        name="constant",
        factory=lambda options: TableDistribution(np.array([0.0, 1.0]), np.full(2, options.value)),
        options=ConstantOptions,
        summary="a constant value",
        protocol=2,
    ),
    RandomInputSpec(
        name="table",
        factory=lambda options: TableDistribution(*options.quantiles),
        options=TableOptions,
        summary="measured samples, or a table of quantiles, from a CSV file",
        protocol=2,
    ),
    RandomInputSpec(
        name="disc",
        factory=Disc,
        options=DiscOptions,
        role="joint",
        summary="yaw and tilt, uniform on a disc",
        references=_ENTROPY[1:],
        protocol=2,
    ),
    RandomInputSpec(
        name="mixture",
        factory=lambda options: Mixture(options.of, options.weights),
        options=MixtureOptions,
        summary="one of several distributions with given shares, as of batches or suppliers",
        protocol=2,
    ),
)
