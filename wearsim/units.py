"""Units of measurement: sizes, dimensions, kinds of quantity and engineering units."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Literal, TypeAlias

if TYPE_CHECKING:
    import pint


# Exact fractions, so that a quantity becomes the float nearest to its text. Angle is a separate
# dimension: 1/s is neither rad/s nor turn/s.
_DEFINITIONS = """
m = [length]; km = 1000 * m; cm = 1/100 * m; mm = 1/1000 * m; um = 1/1000 * mm; nm = 1/1000 * um
micrometer = um; micrometre = um
s = [time]; ms = 1/1000 * s; us = 1/1000 * ms; min = 60 * s; h = 60 * min; d = 24 * h
minute = min; minutes = min; hour = h; hours = h; day = d; days = d
rad = [angle]; mrad = 1/1000 * rad; urad = 1/1000 * mrad
turn = 6.283185307179586476925286766559 * rad; turns = turn; rev = turn; deg = 1/360 * turn
Grad = deg
rpm = turn / min
kg = [mass]; g = 1/1000 * kg; mg = 1/1000 * g; ug = 1/1000 * mg
N = kg * m / s**2; mN = 1/1000 * N; kN = 1000 * N; MN = 1000 * kN
Pa = N / m**2; kPa = 1000 * Pa; MPa = 1000 * kPa; GPa = 1000 * MPa
J = N * m; mJ = 1/1000 * J; kJ = 1000 * J; MJ = 1000 * kJ; Nm = N * m; Nmm = N * mm; kNm = kN * m
W = J / s; mW = 1/1000 * W; uW = 1/1000 * mW; kW = 1000 * W
inch = 254/10000 * m; U = turn; Upm = rpm; bar = 100000 * Pa
kgf = 980665/100000 * N; kp = kgf; lbf = 44482216152605/10000000000000 * N; psi = lbf / inch**2
"""

_UNITS = dict(
    definition.strip().split(" = ") for definition in re.split("[;\n]", _DEFINITIONS.strip())
)

_SPELLINGS = str.maketrans(
    {"µ": "u", "μ": "u", "°": "deg", "²": "^2", "³": "^3", "·": "*", "×": "*"}
)

_UNIT_TEXT = re.compile(r"(?:[A-Za-z]+(?:\^[+-]?[0-9])?|1|[*/() ])+")

MAX_CHARACTERS = 100  # of a quantity or unit
_FACTOR = re.compile(
    r"(?P<operator>\s*[*/]\s*|\s+|^)"
    r"(?:(?P<number>[0-9.]+)|\[(?P<base>[a-z]+)\]|(?P<name>[A-Za-z]+)(?:\^(?P<power>[+-]?[0-9]))?)"
)
#: Time from which texts state hours instead of minutes [s].
LONG = 3.6e5
Bound: TypeAlias = Literal["any", "positive", "not negative"]
Dimensions: TypeAlias = frozenset[tuple[str, str]]


class QuantityError(ValueError):
    """A value that cannot be used.

    Parameters
    ----------
    what : str
        Description of the mistake.
    got : str, optional
        Value given.
    expected : str, optional
        Expected form.
    """

    def __init__(self, what: str, got: str | None = None, expected: str | None = None) -> None:
        self.what, self.got, self.expected = what, got, expected
        parts = [what, got and f"got {got}", expected and f"expected {expected}"]
        super().__init__(", ".join(filter(None, parts)))


def as_written(value: object) -> str:
    """Return `value` as written in a TOML file, abbreviated if long."""
    match value:
        case dict():
            return "a table"
        case bool():
            return str(value).lower()
        case list() | tuple():
            text = f"[{', '.join(as_written(item) for item in value)}]"
        case str():
            text = f'"{value}"'
        case _:
            text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


@dataclass(frozen=True)
class Kind:
    """A kind of quantity: name with an article, SI unit and an example."""

    name: str
    unit: str
    example: str

    def expected(self, bound: Bound = "any") -> str:
        """Return a description of the expected form, for messages."""
        limit = {"any": "", "positive": " above zero", "not negative": " of zero or more"}[bound]
        return f'{self.name}{limit} such as "{self.example}"'


LENGTH = Kind("a length", "m", "20 mm")

FORCE = Kind("a force", "N", "300 N")

STIFFNESS = Kind("a stiffness", "N/m", "690 N/mm")

PRESSURE = Kind("a pressure", "Pa", "200 GPa")

WEAR_FACTOR = Kind("a wear factor", "1/Pa", "1.1e-11 1/Pa")

ROTATION_SPEED = Kind("a rotation speed", "rad/s", "1000 rpm")

DURATION = Kind("a time", "s", "450 min")

ANGLE = Kind("an angle", "rad", "1 mrad")

TORQUE = Kind("a torque", "N m", "0.5 N mm")

SPEED = Kind("a speed", "m/s", "2.6 m/s")

PER_POWER = Kind("a force per power", "N/W", "20 N/W")

DENSITY = Kind("a density", "kg/m^3", "7850 kg/m^3")

MASS_PER_ENERGY = Kind("a mass per energy", "kg/J", "5.3 ug/J")

AREA = Kind("an area", "m^2", "10 mm^2")

VOLUME = Kind("a volume", "m^3", "10 mm^3")

MASS = Kind("a mass", "kg", "0.5 kg")

INERTIA = Kind("a moment of inertia", "kg m^2", "2.94e-5 kg m^2")

VISCOSITY = Kind("a viscosity", "Pa s", "0.05 Pa s")

COMPRESSIBILITY = Kind("an exponent of pressure", "1/Pa", "20 1/GPa")

TORSIONAL_STIFFNESS = Kind("a torsional stiffness", "N m/rad", "32 N m/rad")

_KINDS = (
    *(LENGTH, FORCE, STIFFNESS, PRESSURE, WEAR_FACTOR, ROTATION_SPEED, DURATION, ANGLE, TORQUE),
    *(SPEED, PER_POWER, DENSITY, MASS_PER_ENERGY, MASS, INERTIA, TORSIONAL_STIFFNESS, VISCOSITY),
    AREA,
    VOLUME,
    Kind("a power", "W", "0.07 W"),
    Kind("a frequency", "1/s", "16 turn/s"),
    Kind("a curvature", "1/m", "40 1/m"),
)


@cache
def _registry() -> pint.UnitRegistry[Fraction]:
    import pint  # noqa: PLC0415  (0.15 s to import)

    units: pint.UnitRegistry[Fraction] = pint.UnitRegistry(None, non_int_type=Fraction)
    for name, definition in _UNITS.items():
        units.define(f"{name} = {definition}")
    return units


def _normalised(unit: str) -> str:
    unit = " ".join(unit.replace("**", "^").translate(_SPELLINGS).split())
    return f"1{unit}" if unit.startswith("/") else unit


def _unknown_name(name: str) -> str:
    if name.lower().endswith(("hz", "hertz")):
        return f"unknown unit '{name}' (turns or radians? write rpm, turn/s or rad/s)"
    by_lower = {known.lower(): known for known in reversed(_UNITS)}
    # names of one or two letters are all similar to one another
    cutoff = 0.6 if len(name) > 2 else 1.0
    near = difflib.get_close_matches(name.lower(), by_lower, n=1, cutoff=cutoff)
    return f"unknown unit '{name}'" + (f" (did you mean '{by_lower[near[0]]}'?)" if near else "")


@cache
def _product(text: str) -> tuple[Fraction, dict[str, int]] | None:
    """Return the size in SI of a product or quotient of units, and its powers of the dimensions.

    It spares most commands the import of pint. None if the text is anything else.
    """
    size, powers, place = Fraction(1), dict[str, int](), 0
    while place < len(text):
        factor = _FACTOR.match(text, place)
        if factor is None or (place == 0 and factor["operator"]):
            return None
        place, power = factor.end(), int(factor["power"] or 1)
        if "/" in factor["operator"]:
            power = -power
        if factor["number"]:
            size *= Fraction(factor["number"]) ** power
        elif factor["base"]:
            powers[factor["base"]] = powers.get(factor["base"], 0) + power
        else:
            unit = _product(_UNITS[factor["name"]].replace("**", "^"))
            if unit is None:
                return None
            size *= unit[0] ** power
            for base, exponent in unit[1].items():
                powers[base] = powers.get(base, 0) + power * exponent
    return size, powers


@lru_cache(maxsize=1024)
def measure(unit: str) -> tuple[Fraction, Dimensions]:
    """Return the size of `unit` in SI and its dimensions; raise ValueError if it is unknown."""
    text = _normalised(unit)
    if not text or len(text) > MAX_CHARACTERS or not _UNIT_TEXT.fullmatch(text) or ")^" in text:
        raise ValueError(f"'{unit}' is not a unit")
    for name in re.findall(r"[A-Za-z]+", text):
        if name not in _UNITS:
            raise ValueError(_unknown_name(name))
    if product := _product(text):
        size, powers = product
        return size, frozenset((f"[{base}]", str(power)) for base, power in powers.items() if power)
    return _measured_by_pint(unit, text)


def _measured_by_pint(unit: str, text: str) -> tuple[Fraction, Dimensions]:
    """Return size and dimensions of any unit, with brackets; errors as `measure`."""
    units = _registry()
    try:
        unit_quantity = units.Quantity(Fraction(1), units.parse_units(text)).to_root_units()
        dimensions = frozenset(
            (name, str(power)) for name, power in unit_quantity.dimensionality.items()
        )
    except Exception as error:  # the parser raises various exceptions for unbalanced text
        raise ValueError(f"'{unit}' is not a unit") from error
    return Fraction(unit_quantity.magnitude), dimensions


def kind_of(unit: str) -> Kind:
    """Return the kind of quantity of `unit`; one without a name is named by its unit."""
    dimensions = measure(unit)[1]
    name = f"a quantity in {_normalised(unit)}" if dimensions else "a plain number"
    unnamed = Kind(name, unit, f"1 {_normalised(unit)}")
    return next((kind for kind in _KINDS if measure(kind.unit)[1] == dimensions), unnamed)


def conversion(
    unit: str, target: str, written: str | None = None, expected: str | None = None
) -> Fraction:
    """Return the exact factor from `unit` to `target`.

    Parameters
    ----------
    unit : str
        Unit in the spelling of a user, "mm".
    target : str
        Unit to convert to, "m".
    written, expected : str, optional
        Quantity with this unit and expected form, for messages; by default they are on the unit.

    Returns
    -------
    Fraction

    Raises
    ------
    QuantityError
        If `unit` is unknown or has another dimension than `target`.
    """
    if expected is None:
        expected = f"a unit of {kind_of(target).name.split(maxsplit=1)[1]} such as {target}"
    try:
        size, dimensions = measure(unit)
    except ValueError as error:
        raise QuantityError(str(error), written, expected) from error
    if dimensions != measure(target)[1]:
        got = f"{written or unit} ({kind_of(unit).name})"
        raise QuantityError("wrong dimension", got, expected)
    return size / measure(target)[0]


def engineers_unit(unit: str) -> tuple[str, float]:
    """Return the engineering unit for the quantity of an SI unit, and its size in SI.

    Parameters
    ----------
    unit : str
        SI unit; "1" for a plain number.

    Returns
    -------
    (str, float)
        "mm" and 1e-3 for "m"; "1" and 1 for a plain number.
    """
    if unit == "1":
        return unit, 1.0
    engineers = kind_of(unit).example.split(maxsplit=1)[1]
    return engineers, float(conversion(engineers, unit))


def in_engineers_unit(value: float, unit: str, digits: int = 6) -> str:
    """Return an SI value with its engineering unit, as text.

    Parameters
    ----------
    value : float
        Value in SI.
    unit : str
        SI unit; "1" for a plain number.
    digits : int
        Significant digits.

    Returns
    -------
    str
        "12.5 mm" for 0.0125 and "m"; zero and infinity have no unit. Torques of 1 N m or
        more are in N m, and times of 100 h or more in h.
    """
    if unit == "1" or value in {0.0, float("inf"), -float("inf")}:
        return f"{value:.{digits}g}"
    engineers, size = engineers_unit(unit)
    if unit == "N m" and abs(value) >= 1.0:
        engineers, size = unit, 1.0
    if unit == "s" and abs(value) >= LONG:
        engineers, size = "h", 3600.0
    return f"{value / size:.{digits}g} {engineers}"
