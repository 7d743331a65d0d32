"""Numbers in engineering units: SI floats to text such as "12.34 um"."""

from __future__ import annotations

import math

# One SI unit in each engineering unit.
PER_SI = {
    "1": 1.0,
    "%": 1e2,
    "um": 1e6,
    "mm": 1e3,
    "mm^3": 1e9,
    "m/s": 1.0,
    "s": 1.0,
    "min": 1.0 / 60.0,
    "N": 1.0,
    "N mm": 1e3,
    "N/mm": 1e-3,
    "MPa": 1e-6,
    "W": 1.0,
    "W/mm": 1e-3,
    "W/mm^2": 1e-6,
    "J": 1.0,
}
NOTHING = "-"


def shown(value: float | None, unit: str, digits: int = 4) -> str:
    """Return an SI value in an engineering unit, with that unit; parameters as of `in_unit`."""
    text = in_unit(value, unit, digits)
    return text if unit == "1" or text == NOTHING else f"{text} {unit}"


def in_unit(value: float | None, unit: str, digits: int = 4) -> str:
    """Return an SI value as a number in an engineering unit; very small and large with exponent.

    Parameters
    ----------
    value : float or None
        In SI units; None and values that are not finite become a dash.
    unit : str
        A key of `PER_SI`.
    digits : int
        Significant digits.

    Returns
    -------
    str
    """
    if value is None or not math.isfinite(value):
        return NOTHING
    text = f"{value * PER_SI[unit]:.{digits - 1}e}"
    rounded = float(text)
    if rounded == 0.0:
        return "0"
    if not 1e-4 <= abs(value * PER_SI[unit]) < 1e7:
        return text
    return f"{rounded:.{max(digits - 1 - math.floor(math.log10(abs(rounded))), 0)}f}"


def count(value: float) -> str:
    """Return a number of passes or steps with separated thousands, "1,350,000"."""
    return f"{value:,.0f}"


def number_of_realisations(number: int) -> str:
    """Return "1 realisation" or "1,000 realisations"."""
    return f"{count(number)} realisation{'' if number == 1 else 's'}"


def pass_unit(greatest: float) -> tuple[float, str]:
    """Return the unit of an axis of roller passes, and its label.

    Parameters
    ----------
    greatest : float
        Number of passes at the end of the axis.
    """
    if greatest >= 1e6:
        return 1e6, "million roller passes"
    if greatest >= 1e4:
        return 1e3, "thousand roller passes"
    return 1.0, "roller passes"


def lapse(seconds: float) -> str:
    """Return a wall time as text: "0.05 s", "12 s", "3 min 20 s", "2 h 5 min"."""
    if not math.isfinite(seconds):
        return NOTHING
    if seconds < 9.95:
        return f"{seconds:.2g} s" if seconds < 0.995 else f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def brief(seconds: float) -> str:
    """Return a short time with three digits: "2.5 us", "84 s"."""
    if not math.isfinite(seconds):
        return NOTHING
    for unit, scale in (("s", 1.0), ("ms", 1e3)):
        if seconds * scale >= 1.0:
            return f"{seconds * scale:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"
