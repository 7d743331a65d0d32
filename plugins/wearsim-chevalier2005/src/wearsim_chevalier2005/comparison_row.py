"""Rows of the comparison with the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from wearsim_chevalier2005.paper import Printed, PrintedRange

Number: TypeAlias = float | tuple[float, float]


@dataclass(frozen=True)
class Row:
    """A printed number and the computed one.

    Parameters
    ----------
    part : str
        Part of the comparison.
    name : str
        Name of the quantity, unique in its part.
    unit : str
        Unit for display.
    paper : float or tuple of float, optional
        Printed value or range, in SI units.
    place : str
        Section or equation of the paper.
    here : float or tuple of float
        Computed value or range, in SI units.
    standard_error : float or tuple of float, optional
        Standard error of `here`, for values from realisations.
    why : str
        Reason of the difference.
    """

    part: str
    name: str
    unit: str
    paper: Number | None
    place: str
    here: Number
    standard_error: Number | None
    why: str


def printed_row(
    part: str,
    name: str,
    unit: str,
    printed: Printed | PrintedRange,
    here: Number,
    why: str,
    error: Number | None = None,
) -> Row:
    """Return a row for a printed number."""
    return Row(part, name, unit, printed.value, printed.place, here, error, why)


def percent(part: float) -> str:
    """Return a fraction in percent, to a tenth."""
    return f"{100.0 * part:.1f} %"
