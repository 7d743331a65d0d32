"""Targets of random inputs: a field with one number, or several fields set together."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, core_schema

from wearsim.quantities import Quantity
from wearsim.scenario.parse.field_wording import alternatives
from wearsim.units import QuantityError, shown

_INFINITE = math.inf


@dataclass(frozen=True)
class RandomTarget:
    """A field that holds one number, and the range of its values.

    Parameters
    ----------
    quantity : Quantity, optional
        Its quantity; None for a plain number.
    low, high : float
        Bounds of its values in SI.
    above, below : bool
        Whether the lower and the upper bound are themselves excluded.
    """

    quantity: Quantity | None
    low: float = -_INFINITE
    high: float = _INFINITE
    above: bool = False
    below: bool = False

    @property
    def components(self) -> tuple[str, ...]:
        """Keys set together; none, since the number is that of the field."""
        return ()

    @property
    def allowed(self) -> str:
        """Range of the values, in words."""
        words = []
        if self.low > -_INFINITE:
            words.append(f"above {self.low:g}" if self.above else f"at least {self.low:g}")
        if self.high < _INFINITE:
            words.append(f"below {self.high:g}" if self.below else f"at most {self.high:g}")
        return " and ".join(words)

    @property
    def support(self) -> str:
        """Widest allowed support of a random input, as a scenario holds it."""
        ends: list[object] = [end if end else 0 for end in (self.low, self.high)]
        for k, end in enumerate((self.low, self.high)):
            if math.isinf(end):
                ends[k] = str(end)
            elif self.quantity:
                ends[k] = self.quantity.write(end)
        return shown(ends)


@dataclass(frozen=True)
class JointTarget:
    """Annotation of a key for a joint random input: ``Annotated[None, JointTarget(...)]``.

    Parameters
    ----------
    components : tuple of str
        The keys of the same table that the input sets together.
    quantity : Quantity
        Quantity of the components.
    example : str
        A random input as it is written in a scenario.
    """

    components: tuple[str, ...]
    quantity: Quantity
    example: str

    def parse(self, value: object) -> None:
        """Reject `value`: a random input is read before the validation."""
        raise QuantityError(
            "is not a random input", shown(value), f"a table such as {self.example}"
        )

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.parse)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"type": "object"}


def target_of(field: FieldInfo) -> RandomTarget | JointTarget | None:
    """Return what a random input in a field sets, or None for a field without numbers."""
    for mark in field.metadata:
        if isinstance(mark, JointTarget):
            return mark
    for part in alternatives(field):
        annotated = get_origin(part) is Annotated
        if (get_args(part)[0] if annotated else part) is float:
            return _random_target([*field.metadata, *(part.__metadata__ if annotated else ())])
    return None


def _random_target(marks: list[Any]) -> RandomTarget:
    quantity, low, high, above, below = None, -_INFINITE, _INFINITE, False, False
    for mark in marks:
        if isinstance(mark, Quantity):
            quantity = mark
            if mark.bound != "any":
                low, above = 0.0, mark.bound == "positive"
        elif isinstance(mark, Gt):
            low, above = float(mark.gt), True  # type: ignore[arg-type]
        elif isinstance(mark, Ge):
            low = float(mark.ge)  # type: ignore[arg-type]
        elif isinstance(mark, Lt):
            high, below = float(mark.lt), True  # type: ignore[arg-type]
        elif isinstance(mark, Le):
            high = float(mark.le)  # type: ignore[arg-type]
    return RandomTarget(quantity, low, high, above, below)
