"""Quantities written with their units, "20 mm", and read as SI floats: types for options models."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, get_args

from pydantic_core import CoreSchema, SchemaValidator, core_schema

from wearsim.units import (
    _LONGEST,
    ANGLE,
    DENSITY,
    DURATION,
    FORCE,
    LENGTH,
    MASS_PER_ENERGY,
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
    _kind_of,
    _measure,
    shown,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo


NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")

NOT_FINITE = re.compile(r"[+-]?(?:nan|inf(?:inity)?)(?![a-z])", re.IGNORECASE)

DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")

_PATTERN = r"^\s*[+-]?[0-9.]+([eE][+-]?[0-9]+)?\s*(?![eE][+-]?[0-9])([A-Za-zµμ°(/]|1\s*/).*$"


def _split(value: object, expected: str) -> tuple[str, str]:
    """Split a quantity into its number and its unit."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise QuantityError("needs a unit", shown(value), expected)
    if not isinstance(value, str) or len(value) > _LONGEST:
        raise QuantityError("is not a quantity", shown(value), expected)
    text = value.strip()
    if NOT_FINITE.match(text):
        raise QuantityError("must be finite", shown(value), expected)
    if DECIMAL_COMMA.match(text):
        raise QuantityError("needs a decimal point", shown(value), expected)
    number = NUMBER.match(text)
    if number is None:
        raise QuantityError("is not a quantity", shown(value), expected)
    unit = text[number.end() :].strip()
    if not unit:
        raise QuantityError("needs a unit", shown(value), expected)
    return number[0], unit


def _si(number: str, factor: Fraction) -> float:
    """Return the float nearest to `number` times `factor`; infinity where there is none."""
    rough = float(number)
    if rough in {0.0, float("inf"), -float("inf")}:  # an exact 1e999999999 would never end
        return rough
    try:
        return float(Fraction(number) * factor)
    except OverflowError:
        return float("inf")


@dataclass(frozen=True)
class Quantity:
    """Marks a float field as a quantity of `kind`: ``Annotated[float, Quantity(LENGTH)]``.

    Parameters
    ----------
    kind : Kind
        What is measured.
    bound : {"any", "positive", "not negative"}
        Which values are allowed.
    """

    kind: Kind
    bound: Bound = "any"

    @property
    def expected(self) -> str:
        """The form that is expected, for messages."""
        return self.kind.expected(self.bound)

    def parse(self, value: object) -> float:
        """Return `value` in SI; raises QuantityError."""
        number, unit = _split(value, self.expected)
        try:
            size, dimensions = _measure(unit)
        except ValueError as error:
            raise QuantityError(str(error), shown(value), self.expected) from error
        wanted, target = _measure(self.kind.unit)
        if dimensions != target:
            got = f"{shown(value)} ({_kind_of(unit).name})"
            raise QuantityError("wrong dimension", got, self.expected)
        result = _si(number, size / wanted)
        if result in {float("inf"), -float("inf")}:
            raise QuantityError("must be finite", shown(value), self.expected)
        return self._within(result, value)

    def _within(self, result: float, value: object) -> float:
        if self.bound == "positive" and result <= 0.0:
            raise QuantityError("must be above zero", shown(value), self.expected)
        if self.bound == "not negative" and result < 0.0:
            raise QuantityError("must not be negative", shown(value), self.expected)
        return result

    def write(self, value: float | None) -> str | None:
        """Return an SI value with its unit, as a scenario would hold it."""
        return None if value is None else f"{str(value).removesuffix('.0')} {self.kind.unit}"

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        write = core_schema.plain_serializer_function_ser_schema(self.write, when_used="json")
        return core_schema.no_info_plain_validator_function(self.parse, serialization=write)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {
            "type": "string",
            "pattern": _PATTERN,
            "examples": [self.kind.example],
        }


def quantity(text: str, unit: str) -> float:
    """Return a quantity written with its unit as a number of `unit`.

    Parameters
    ----------
    text : str
        The quantity, "600 min".
    unit : str
        The unit wanted, "s".

    Returns
    -------
    float

    Raises
    ------
    QuantityError
        A ValueError, if `text` is not a finite quantity of the same kind as `unit`.
    """
    kind = _kind_of(unit)
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

NonNegativeDuration: TypeAlias = Annotated[float, Quantity(DURATION, "not negative")]

Angle: TypeAlias = Annotated[float, Quantity(ANGLE)]

Torque: TypeAlias = Annotated[float, Quantity(TORQUE)]

NonNegativeTorque: TypeAlias = Annotated[float, Quantity(TORQUE, "not negative")]

Speed: TypeAlias = Annotated[float, Quantity(SPEED)]

PositiveSpeed: TypeAlias = Annotated[float, Quantity(SPEED, "positive")]

PerPower: TypeAlias = Annotated[float, Quantity(PER_POWER)]

PositiveDensity: TypeAlias = Annotated[float, Quantity(DENSITY, "positive")]

PositiveMassPerEnergy: TypeAlias = Annotated[float, Quantity(MASS_PER_ENERGY, "positive")]

NonNegativeMassPerEnergy: TypeAlias = Annotated[float, Quantity(MASS_PER_ENERGY, "not negative")]


@dataclass(frozen=True)
class HostQuantity:
    """Marks an option that is measured like the value which its random input stands for.

    The validation context says what that is: ``{"quantity": Quantity(FORCE)}``, or nothing for a
    plain number.

    Parameters
    ----------
    bound : {"any", "positive", "not negative"}
        Which values are allowed.
    infinite : bool
        Whether "inf" and "-inf" are values too.
    """

    bound: Bound = "any"
    infinite: bool = False

    def parse(self, value: object, info: ValidationInfo) -> float:
        """Return `value` in SI; raises QuantityError."""
        host: Quantity | None = (info.context or {}).get("quantity")
        endless = {"inf": float("inf"), "+inf": float("inf"), "-inf": -float("inf")}
        if self.infinite and isinstance(value, str) and value.strip().lower() in endless:
            return endless[value.strip().lower()]
        if host is not None:
            return Quantity(host.kind, self.bound).parse(value)
        expected = {"any": "a plain number", "positive": "a number above zero"}.get(
            self.bound, "a number of zero or more"
        )
        expected += ' or "inf"' if self.infinite else ""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise QuantityError("is not a number", shown(value), expected)
        result = float(value)
        if result - result != 0.0:  # infinite or not a number
            raise QuantityError("must be finite", shown(value), expected)
        if (self.bound == "positive" and result <= 0.0) or (
            self.bound == "not negative" and result < 0.0
        ):
            raise QuantityError("is out of range", shown(value), expected)
        return result

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


class _OneOrMany:
    """Lets a field hold one value or a list of values; see `PerRoller`."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        one = handler.generate_schema(get_args(source)[0])
        many = core_schema.tuple_variable_schema(one)
        read_one, read_many = SchemaValidator(one), SchemaValidator(many)
        write_one: Callable[[Any], Any] = one.get("serialization", {}).get("function", _as_it_is)

        def read(value: object) -> Any:
            if isinstance(value, list | tuple):
                return read_many.validate_python(tuple(value))
            return read_one.validate_python(value)

        def write(value: Any) -> Any:
            if isinstance(value, tuple):
                return [write_one(item) for item in value]
            return write_one(value)

        return core_schema.no_info_plain_validator_function(
            read,
            json_schema_input_schema=core_schema.union_schema([one, many]),
            serialization=core_schema.plain_serializer_function_ser_schema(write, when_used="json"),
        )


def _as_it_is(value: Any) -> Any:
    return value


V = TypeVar("V")

PerRoller: TypeAlias = Annotated[V | tuple[V, ...], _OneOrMany()]
"""A value for all rollers, or a list with one value per roller: ``PerRoller[Length]``."""


@dataclass(frozen=True)
class InputFile:
    """A file that a scenario names, with its content; a field's type in an options model.

    The content is read through the validation context, ``{"read": function}``, so that a scenario
    that is stored with the content of its files needs none of them.

    Parameters
    ----------
    path : str
        The path as the scenario writes it.
    text : str
        The file's content.
    """

    path: str
    text: str = field(repr=False)

    @classmethod
    def _read(cls, value: object, info: ValidationInfo) -> InputFile:
        expected = 'the name of a text file such as "load.csv"'
        if not isinstance(value, str) or not value.strip():
            raise QuantityError("is not a file name", shown(value), expected)
        read: Callable[[str], str] | None = (info.context or {}).get("read")
        if read is None:
            raise QuantityError("no file can be read here", shown(value))
        try:
            return cls(value, read(value))
        except UnicodeDecodeError as error:
            raise QuantityError("is not text in UTF-8", shown(value), expected) from error
        except (OSError, KeyError, ValueError) as error:
            cause = error.strerror if isinstance(error, OSError) else None
            got = shown(value) + (f" ({cause})" if cause else "")
            raise QuantityError("the file cannot be read", got) from error

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        write = core_schema.plain_serializer_function_ser_schema(
            lambda file: file.path, when_used="json"
        )
        return core_schema.with_info_plain_validator_function(cls._read, serialization=write)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"type": "string", "examples": ["load.csv"]}
