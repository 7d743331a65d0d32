"""Estimates with their intervals as an engineer reads them: "22.10 um [21.90, 22.31]"."""

from __future__ import annotations

import math

from wearsim.report.text.units import NOTHING, PER_SI, shown
from wearsim.uq.estimation.intervals import Interval

TOO_FEW = "too few"
_OF_INTERVAL = 2  # digits of half an interval, which an estimate is told to
_FEWEST, _MOST = 3, 8  # digits of an estimate
_PLAIN = (1e-4, 1e7)  # sizes that are written without an exponent


def cells(found: Interval, unit: str) -> tuple[str, str]:
    """Return an estimate and its interval, both without the unit, for a narrow column.

    Parameters
    ----------
    found : Interval
        In SI.
    unit : str
        A key of `PER_SI`.

    Returns
    -------
    estimate, interval : str
        The interval is empty where nothing is uncertain.
    """
    value, low, high = _told(found, unit)
    return value, f"{low}..{high}" if high else low


def with_interval(found: Interval, unit: str) -> str:
    """Return an estimate with its unit and its interval, parameters as of `cells`."""
    value, low, high = _told(found, unit)
    named = value if unit == "1" or value == NOTHING else f"{value} {unit}"
    return f"{named} [{low}, {high}]" if high else f"{named} {low}".rstrip()


def _told(found: Interval, unit: str) -> tuple[str, str, str]:
    """Return an estimate and both ends; one word for both where too little is known."""
    if not math.isfinite(found.value):
        return NOTHING, TOO_FEW, ""
    value, low, high = (end * PER_SI[unit] for end in (found.value, found.low, found.high))
    if low == high:
        return _bare(found.value, unit), "", ""
    if not (math.isfinite(low) and math.isfinite(high)):
        return _bare(found.value, unit), TOO_FEW, ""
    sizes = [abs(end) for end in (value, low, high) if end]
    if min(sizes) < _PLAIN[0] or max(sizes) >= _PLAIN[1]:
        return _bare(found.value, unit), _bare(found.low, unit), _bare(found.high, unit)
    decimals = _decimals(value, 0.5 * (high - low))
    return f"{value:.{decimals}f}", f"{low:.{decimals}f}", f"{high:.{decimals}f}"


def part_with_interval(found: Interval) -> str:
    """Return a part of a whole in per cent, "57.1 % [54.0, 60.2]"."""
    if not math.isfinite(found.value):
        return NOTHING
    value, low, high = (100.0 * end for end in (found.value, found.low, found.high))
    if low == high:
        return f"{value:.1f} %"
    if not (math.isfinite(low) and math.isfinite(high)):
        return f"{value:.1f} % {TOO_FEW}"
    return f"{value:.1f} % [{low:.1f}, {high:.1f}]"


def _bare(value: float, unit: str) -> str:
    return shown(value, unit).removesuffix(f" {unit}")


def _decimals(value: float, half: float) -> int:
    """Return to how many decimals an estimate is told: as many as its interval gives sense to."""
    place = math.floor(math.log10(abs(value))) if value else 0
    wanted = _OF_INTERVAL - 1 - math.floor(math.log10(half))
    return max(min(max(wanted, _FEWEST - 1 - place), _MOST - 1 - place), 0)
