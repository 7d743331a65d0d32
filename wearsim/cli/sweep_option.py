"""What `--sweep` says: a key, and the values that it takes one after another."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import NamedTuple

import typer

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_GLUED = re.compile(rf"({_NUMBER})([A-Za-zµμ°].*)")
_QUANTITY = re.compile(rf"({_NUMBER})\s*(\S.*)?")
_OPTION = "--sweep"
_EXAMPLE = "such as load.normal_force=250N,300N,350N"


class Swept(NamedTuple):
    """A key, and its values as a scenario would have them.

    Parameters
    ----------
    key : str
        Dotted.
    values : tuple of str
        Two or more, no two alike.
    """

    key: str
    values: tuple[str, ...]

    def setting(self, value: str) -> str:
        """Return a value as `--set` takes it."""
        return f"{self.key}={value}"


def parse_sweep(text: str) -> Swept:
    """Return the key and the values of a sweep.

    Parameters
    ----------
    text : str
        "load.normal_force=250N,300N"; the space before a unit may be left out.

    Returns
    -------
    Swept

    Raises
    ------
    typer.BadParameter
        If there is no key, or there are not two values, or two are alike.
    """
    key, equals, listed = text.partition("=")
    if not equals or not key.strip():
        raise _wrong(f"'{text}' is not a key with values, expected one {_EXAMPLE}")
    values = tuple(_spaced(value.strip()) for value in listed.split(","))
    if not all(values):
        raise _wrong(f"'{text}' has an empty value, expected values {_EXAMPLE}")
    if len(values) < 2:
        raise _wrong(f"'{text}' has one value, expected two or more {_EXAMPLE}")
    for number, value in enumerate(values):
        for before in values[:number]:
            if _alike(before, value):
                raise _wrong(f"'{before}' and '{value}' are the same value; leave one of them out")
    return Swept(key.strip(), values)


def _spaced(value: str) -> str:
    """Return a quantity with a space before its unit; anything else as it is."""
    glued = _GLUED.fullmatch(value)
    return f"{glued[1]} {glued[2]}" if glued else value


def _alike(one: str, other: str) -> bool:
    """Tell whether two values are the same, whatever their units."""
    found = [_QUANTITY.fullmatch(value) for value in (one, other)]
    if found[0] is None or found[1] is None:
        return one == other
    (first, unit), (second, as_well) = (item.groups() for item in found if item)
    if not (unit and as_well):
        return not (unit or as_well) and float(first) == float(second)
    from wearsim.units import conversion

    try:
        factor = conversion(as_well, unit)
    except ValueError:  # told when the scenario is read
        return one == other
    return Fraction(first) == Fraction(second) * factor


def _wrong(what: str) -> typer.BadParameter:
    return typer.BadParameter(what, param_hint=_OPTION)
