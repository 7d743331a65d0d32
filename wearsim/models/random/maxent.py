"""The random input `maxent`, and maximum-entropy distributions as plugins."""

from __future__ import annotations

from functools import cached_property

from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from wearsim.plugins import Distribution, Options
from wearsim.quantities import Limit, PositiveValue, Quantity, Value
from wearsim.types import FloatArray
from wearsim.units import QuantityError
from wearsim.uq.distributions.base import MaxentDistribution
from wearsim.uq.distributions.maxent import Infeasible, maximum_entropy


class LawDistribution(Distribution):
    """A distribution that a law gives."""

    def __init__(self, law: MaxentDistribution) -> None:
        self.law = law

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the values below which a draw falls with these probabilities, same shape."""
        return self.law.quantile(probability)

    @cached_property
    def support(self) -> tuple[float, float]:
        """Least and greatest value."""
        return self.law.support

    @cached_property
    def mean(self) -> float:
        """Exact mean."""
        return self.law.mean

    @cached_property
    def std(self) -> float:
        """Exact standard deviation."""
        return self.law.std

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before trusting it."""
        return self.law.warnings


class MaxentOptions(Options):
    """Options of the distribution `maxent`."""

    support: tuple[Limit, Limit] = Field(
        description="least and greatest value possible, e.g. ['0 N', 'inf']"
    )
    mean: Value | None = Field(None, description="mean, e.g. '307 N'")
    std: PositiveValue | None = Field(None, description="standard deviation, e.g. '32 N'")
    mean_log: float | None = Field(
        None, description="mean of the logarithm of the SI value, in place of std: a gamma law"
    )
    _law: MaxentDistribution = PrivateAttr()

    @model_validator(mode="after")
    def _find_law(self, info: ValidationInfo) -> MaxentOptions:
        try:
            self._law = maximum_entropy(self.support, self.mean, self.std, self.mean_log)
        except Infeasible as error:
            raise QuantityError(f"{error}{in_unit(info)}") from error
        return self

    @property
    def law(self) -> MaxentDistribution:
        """The law of maximum entropy."""
        return self._law


def in_unit(info: ValidationInfo) -> str:
    """Return a remark on the unit of a message's numbers, where they have one."""
    host: Quantity | None = (info.context or {}).get("quantity")
    return "" if host is None else f" (numbers in {host.kind.unit})"


def maxent(options: MaxentOptions) -> LawDistribution:
    """Build the distribution `maxent`."""
    return LawDistribution(options.law)
