"""One number of the paper beside the one found here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from wearsim_chevalier2005.paper import Printed, PrintedRange

Number: TypeAlias = float | tuple[float, float]


@dataclass(frozen=True)
class Row:
    """One number of the paper beside the one found here.

    Parameters
    ----------
    part : str
        What it belongs to.
    name : str
        What it is, unlike any other of its part.
    unit : str
        Unit in which an engineer reads it.
    paper : float or tuple of float, optional
        As printed, in SI; a range has two ends.
    place : str
        Where it stands in the paper.
    here : float or tuple of float
        As found here, in SI.
    standard_error : float or tuple of float, optional
        Of `here`, where it comes from realisations.
    why : str
        Why the two differ.
    """

    part: str
    name: str
    unit: str
    paper: Number | None
    place: str
    here: Number
    standard_error: Number | None
    why: str


def beside(
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
