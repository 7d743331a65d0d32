"""The distribution `mixture`: a value from one of several distributions, such as of batches."""

from __future__ import annotations

from typing import Annotated, Any, Self, TypeAlias

from pydantic import Field, PlainValidator, ValidationInfo, model_validator

from wearsim.plugins import Distribution, Options, RandomInputSpec
from wearsim.units import QuantityError, as_written
from wearsim.uq.distributions.mixture import Mixture

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
        if len(self.of) < 2:
            got = f"{len(self.of)} in 'of'"
            raise QuantityError("needs two distributions or more", got, _TABLE)
        if len(self.weights) != len(self.of):
            got = f"{len(self.weights)} weights for {len(self.of)} distributions"
            raise QuantityError("needs a weight for each distribution", got, f"{len(self.of)}")
        if not all(0.0 < weight < float("inf") for weight in self.weights):
            got = as_written(self.weights)
            raise QuantityError("'weights' must be above 0", got, "shares such as [0.7, 0.3]")
        return self


SPECS = (
    RandomInputSpec(
        name="mixture",
        factory=lambda options: Mixture(options.of, options.weights),
        options=MixtureOptions,
        summary="one of several distributions with given shares, as of batches or suppliers",
        protocol=2,
    ),
)
