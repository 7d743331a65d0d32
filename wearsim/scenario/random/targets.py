"""What a random input may stand for: a field that holds one number, or several set together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic_core import CoreSchema, core_schema

from wearsim.quantities import Quantity
from wearsim.scenario.parse.field_wording import alternatives
from wearsim.units import QuantityError, shown

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
    from pydantic.fields import FieldInfo

_INFINITE = float("inf")


@dataclass(frozen=True)
class Host:
    """A field that holds one number, and the values it takes.

    Parameters
    ----------
    quantity : Quantity, optional
        What it measures; nothing for a plain number.
    low, high : float
        Bounds of its values in SI.
    above, below : bool
        Whether the values stay clear of the lower, and of the upper bound itself.
    """

    quantity: Quantity | None
    low: float = -_INFINITE
    high: float = _INFINITE
    above: bool = False
    below: bool = False

    def written(self, value: float) -> object:
        """Return an SI value as a scenario would hold it."""
        return self.quantity.write(value) if self.quantity else value

    @property
    def allowed(self) -> str:
        """The values it takes, in words."""
        words = []
        if self.low > -_INFINITE:
            words.append(f"above {self.low:g}" if self.above else f"at least {self.low:g}")
        if self.high < _INFINITE:
            words.append(f"below {self.high:g}" if self.below else f"at most {self.high:g}")
        return " and ".join(words)

    @property
    def support(self) -> str:
        """The widest support of a random input in its place, as a scenario would hold it."""
        ends = {-_INFINITE: "-inf", _INFINITE: "inf"}
        written = [ends.get(end, self.written(end)) for end in (self.low, self.high)]
        return shown([int(end) if end == 0.0 else end for end in written])


@dataclass(frozen=True)
class Joint:
    """Marks a key that only a joint random input can stand for: ``Annotated[None, Joint(...)]``.

    Parameters
    ----------
    components : tuple of str
        The keys of the same table that it sets together.
    quantity : Quantity
        What they measure.
    example : str
        A random input as it would be written.
    """

    components: tuple[str, ...]
    quantity: Quantity
    example: str

    def parse(self, value: object) -> None:
        """Refuse `value`: whatever random input was here has been taken out before."""
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


def joint_of(field: FieldInfo) -> Joint | None:
    """Return the mark of a key that only a joint random input can stand for."""
    return next((item for item in field.metadata if isinstance(item, Joint)), None)


def host_of(field: FieldInfo) -> Host | None:
    """Return what a field asks of a number, or None where it is no number."""
    marks = list(field.metadata)
    for part in alternatives(field):
        annotated = get_origin(part) is Annotated
        if (get_args(part)[0] if annotated else part) is float:
            return _host([*marks, *(part.__metadata__ if annotated else ())])
    return None


def _host(marks: list[Any]) -> Host:
    quantity, low, high, above, below = None, -_INFINITE, _INFINITE, False, False
    for mark in marks:
        if isinstance(mark, Quantity):
            quantity = mark
            if mark.bound != "any":
                low, above = 0.0, mark.bound == "positive"
        elif isinstance(mark, Gt):
            low, above = float(mark.gt), True  # type: ignore[arg-type]
        elif isinstance(mark, Ge):
            low, above = float(mark.ge), False  # type: ignore[arg-type]
        elif isinstance(mark, Lt):
            high, below = float(mark.lt), True  # type: ignore[arg-type]
        elif isinstance(mark, Le):
            high, below = float(mark.le), False  # type: ignore[arg-type]
    return Host(quantity, low, high, above, below)
