"""Quantities with units, such as "20 mm", read as SI floats: types for options models."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, get_args

from pydantic_core import CoreSchema, SchemaValidator, core_schema

from wearsim.errors import ScenarioError
from wearsim.units import (
    ANGLE,
    DENSITY,
    DURATION,
    FORCE,
    LENGTH,
    MASS_PER_ENERGY,
    MAX_CHARACTERS,
    PER_POWER,
    PRESSURE,
    ROTATION_SPEED,
    SPEED,
    STIFFNESS,
    TORQUE,
    WEAR_FACTOR,
    Bound,
    Kind,
    QuantityError,
    as_written,
    conversion,
    kind_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo


NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")

NOT_FINITE = re.compile(r"[+-]?(?:nan|inf(?:inity)?)(?![a-z])", re.IGNORECASE)

DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")

_PATTERN = r"^\s*[+-]?[0-9.]+([eE][+-]?[0-9]+)?\s*(?![eE][+-]?[0-9])([A-Za-zµμ°(/]|1\s*/).*$"
V = TypeVar("V")


def _split(value: object, expected: str) -> tuple[str, str]:
    """Split a quantity into its number and its unit."""
    text = value.strip() if isinstance(value, str) and len(value) <= MAX_CHARACTERS else ""
    number = NUMBER.match(text)
    unit = text[number.end() :].strip() if number else ""
    is_number = number or (isinstance(value, int | float) and not isinstance(value, bool))
    reasons = {
        "must be finite": NOT_FINITE.match(text),
        "needs a decimal point": DECIMAL_COMMA.match(text),
        "needs a unit": is_number and not unit,
        "is not a quantity": not is_number,
    }
    for what, holds in reasons.items():
        if holds:
            raise QuantityError(what, as_written(value), expected)
    assert number
    return number[0], unit


def _si(number: str, factor: Fraction) -> float:
    """Return the float nearest to `number` times `factor`; infinity if it is too large."""
    rough = float(number)
    if rough in {0.0, float("inf"), -float("inf")}:  # 1e999999999 takes too long as a fraction
        return rough
    try:
        return float(Fraction(number) * factor)
    except OverflowError:
        return float("inf")


@dataclass(frozen=True)
class Quantity:
    """Marker of a float field as a quantity of `kind`: ``Annotated[float, Quantity(LENGTH)]``.

    Parameters
    ----------
    kind : Kind
        Kind of quantity.
    bound : {"any", "positive", "not negative"}
        Allowed values.
    """

    kind: Kind
    bound: Bound = "any"

    @property
    def expected(self) -> str:
        """Description of the expected form, for messages."""
        return self.kind.expected(self.bound)

    def parse(self, value: object) -> float:
        """Return `value` in SI.

        Raises
        ------
        QuantityError
            If it is not a quantity of this kind within the bound.
        """
        number, unit = _split(value, self.expected)
        factor = conversion(unit, self.kind.unit, as_written(value), self.expected)
        return _within(self.bound, _si(number, factor), lambda _: value, self.expected)

    def _read(self, value: Any, info: ValidationInfo) -> float:
        """Return a value in SI.

        The validation context has the type in which a number in SI is accepted: ``{"numbers":
        float}``, or ``{"numbers": dict}`` for ``{"si": 3.0}``, where a bare number lacks its unit.
        """
        numbers = (info.context or {}).get("numbers")
        if numbers is not None and isinstance(value, numbers):
            number = value.get("si") if isinstance(value, dict) else value
            if isinstance(number, float):
                return _within(self.bound, number, self.write, self.expected)
        return self.parse(value)

    def write(self, value: float | None) -> str | None:
        """Return an SI value with its unit, as written in a scenario."""
        return None if value is None else f"{str(value).removesuffix('.0')} {self.kind.unit}"

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(
            self._read,
            serialization=core_schema.plain_serializer_function_ser_schema(
                self.write, when_used="json"
            ),
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {
            "type": "string",
            "pattern": _PATTERN if self.bound == "any" else _PATTERN.replace("[+-]?", "[+]?", 1),
            "examples": [self.kind.example],
        }


def _within(
    bound: Bound, number: float, written: Callable[[float], object], expected: str
) -> float:
    """Return a number if it is finite and within a bound; otherwise raise a QuantityError.

    `written` returns the value as it is written in a scenario.
    """
    reasons = {
        "must be finite": number - number != 0.0,  # infinite or not a number
        "must be above zero": bound == "positive" and number <= 0.0,
        "must not be negative": bound == "not negative" and number < 0.0,
    }
    for what, holds in reasons.items():
        if holds:
            raise QuantityError(what, as_written(written(number)), expected)
    return number


def quantity(text: str, unit: str) -> float:
    """Return a quantity with a unit as a number of `unit`.

    Parameters
    ----------
    text : str
        Quantity, "600 min".
    unit : str
        Unit to convert to, "s".

    Returns
    -------
    float

    Raises
    ------
    QuantityError
        If `text` is not a finite quantity of the same kind as `unit`; it is a ValueError.
    """
    kind = kind_of(unit)
    return Quantity(Kind(kind.name, unit, kind.example)).parse(text)


Length: TypeAlias = Annotated[float, Quantity(LENGTH)]

PositiveLength: TypeAlias = Annotated[float, Quantity(LENGTH, "positive")]

Force: TypeAlias = Annotated[float, Quantity(FORCE)]

PositiveForce: TypeAlias = Annotated[float, Quantity(FORCE, "positive")]

Stiffness: TypeAlias = Annotated[float, Quantity(STIFFNESS)]

PositiveStiffness: TypeAlias = Annotated[float, Quantity(STIFFNESS, "positive")]

NonNegativeStiffness: TypeAlias = Annotated[float, Quantity(STIFFNESS, "not negative")]

Pressure: TypeAlias = Annotated[float, Quantity(PRESSURE)]

PositivePressure: TypeAlias = Annotated[float, Quantity(PRESSURE, "positive")]

WearFactor: TypeAlias = Annotated[float, Quantity(WEAR_FACTOR)]

PositiveWearFactor: TypeAlias = Annotated[float, Quantity(WEAR_FACTOR, "positive")]

NonNegativeWearFactor: TypeAlias = Annotated[float, Quantity(WEAR_FACTOR, "not negative")]

RotationSpeed: TypeAlias = Annotated[float, Quantity(ROTATION_SPEED)]

PositiveRotationSpeed: TypeAlias = Annotated[float, Quantity(ROTATION_SPEED, "positive")]

Duration: TypeAlias = Annotated[float, Quantity(DURATION)]

PositiveDuration: TypeAlias = Annotated[float, Quantity(DURATION, "positive")]

Angle: TypeAlias = Annotated[float, Quantity(ANGLE)]

Torque: TypeAlias = Annotated[float, Quantity(TORQUE)]

NonNegativeTorque: TypeAlias = Annotated[float, Quantity(TORQUE, "not negative")]

Speed: TypeAlias = Annotated[float, Quantity(SPEED)]

PerPower: TypeAlias = Annotated[float, Quantity(PER_POWER)]

PositiveDensity: TypeAlias = Annotated[float, Quantity(DENSITY, "positive")]

PositiveMassPerEnergy: TypeAlias = Annotated[float, Quantity(MASS_PER_ENERGY, "positive")]

NonNegativeMassPerEnergy: TypeAlias = Annotated[float, Quantity(MASS_PER_ENERGY, "not negative")]


@dataclass(frozen=True)
class HostQuantity:
    """Marker of an option of a random input with the unit of the scenario value it replaces.

    The validation context holds the kind of that value, ``{"quantity": Quantity(FORCE)}``, or
    nothing for a plain number.

    Parameters
    ----------
    bound : {"any", "positive", "not negative"}
        Allowed values.
    infinite : bool
        Whether "inf" and "-inf" are allowed.
    """

    bound: Bound = "any"
    infinite: bool = False

    def parse(self, value: object, info: ValidationInfo) -> float:
        """Return `value` in SI; raise QuantityError if it cannot be used."""
        replaced: Quantity | None = (info.context or {}).get("quantity")
        text = value.strip().lower() if isinstance(value, str) else ""
        if self.infinite and text in {"inf", "+inf", "-inf"}:
            return float(text)
        if replaced is not None:
            return Quantity(replaced.kind, self.bound).parse(value)
        expected = {
            "any": "a plain number",
            "positive": "a number above zero",
            "not negative": "a number of zero or more",
        }[self.bound] + (' or "inf"' if self.infinite else "")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise QuantityError("is not a number", as_written(value), expected)
        return _within(self.bound, float(value), lambda _: value, expected)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self.parse)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"type": ["string", "number"], "examples": ["300 N", 0.1]}


Value: TypeAlias = Annotated[float, HostQuantity()]

PositiveValue: TypeAlias = Annotated[float, HostQuantity("positive")]

Limit: TypeAlias = Annotated[float, HostQuantity(infinite=True)]


class _OneOrList:
    """Marker of a field that holds one value or a list of values, see `PerRoller`."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        single = handler.generate_schema(get_args(source)[0])
        several = core_schema.tuple_variable_schema(single)
        read_one, read_list = SchemaValidator(single), SchemaValidator(several)
        write_one: Callable[[Any], Any] = single.get("serialization", {}).get(
            "function", lambda v: v
        )

        def read(value: object, info: ValidationInfo) -> Any:
            if isinstance(value, list | tuple):
                return read_list.validate_python(tuple(value), context=info.context)
            return read_one.validate_python(value, context=info.context)

        def write(value: Any) -> Any:
            return [*map(write_one, value)] if isinstance(value, tuple) else write_one(value)

        return core_schema.with_info_plain_validator_function(
            read,
            json_schema_input_schema=core_schema.union_schema([single, several]),
            serialization=core_schema.plain_serializer_function_ser_schema(write, when_used="json"),
        )


#: A value for all rollers, or a list with one value per roller: ``PerRoller[Length]``.
PerRoller: TypeAlias = Annotated[V | tuple[V, ...], _OneOrList()]


@dataclass(frozen=True)
class InputFile:
    """A file named in a scenario, with its content; type of a field in an options model.

    The content is read by a function in the validation context, ``{"read": function}``, so that a
    scenario stored with the content of its files does not need the files.

    Parameters
    ----------
    path : str
        Path as written in the scenario.
    text : str
        Content of the file.
    """

    path: str
    text: str = field(repr=False)

    @classmethod
    def _read(cls, value: object, info: ValidationInfo) -> InputFile:
        if isinstance(value, cls):
            return value
        expected = 'the name of a text file such as "load.csv"'
        if not isinstance(value, str) or not value.strip():
            raise QuantityError("is not a file name", as_written(value), expected)
        read: Callable[[str], str] | None = (info.context or {}).get("read")
        if read is None:
            raise QuantityError("no file can be read here", as_written(value))
        try:
            return cls(value, read(value))
        except ScenarioError as error:  # of a file that is converted to text
            raise QuantityError(str(error.mistakes[0]), as_written(value)) from error
        except (OSError, KeyError, ValueError) as error:
            cause = error.strerror if isinstance(error, OSError) else None
            got = as_written(value) + (f" ({cause})" if cause else "")
            raise QuantityError("the file cannot be read", got) from error

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(
            cls._read,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda file: file.path, when_used="json"
            ),
        )

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"type": "string", "examples": ["load.csv"]}
