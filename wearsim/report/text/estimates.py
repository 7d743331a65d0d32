"""Estimates with confidence intervals as text, and the sample sizes that they require."""

from __future__ import annotations

import math

import numpy as np

from wearsim.report.text.units import NOTHING, PER_SI, count, in_unit
from wearsim.results import EnsembleResult
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.sensitivity.sobol_indices import FEWEST_BASES, fewest_realisations

TOO_FEW = "too few"
TOO_FEW_REALISATIONS = "too few realisations"
NINETY_PERCENT = (0.05, 0.95)
_HALF_WIDTH_DIGITS = 2  # significant digits of the half-width, which set the decimals
_MIN_DIGITS, _MAX_DIGITS = 3, 8  # significant digits of an estimate
_WITHOUT_EXPONENT = (1e-4, 1e7)
_ONE = 1.0 - 1e-9  # with a margin for rounding: 1 - 0.95 is slightly more than 0.05


def cells(found: Interval, unit: str) -> tuple[str, str]:
    """Return an estimate and its interval without the unit, for a table.

    Parameters
    ----------
    found : Interval
        In SI units.
    unit : str
        A key of `PER_SI`.

    Returns
    -------
    estimate, interval : str
        The interval is empty if it has no width.
    """
    value, low, high = _numbers(found, unit)
    return value, f"{low}..{high}" if high else low


def with_interval(found: Interval, unit: str) -> str:
    """Return "22.10 um [21.90, 22.31]"; parameters as of `cells`."""
    value, low, high = _numbers(found, unit)
    named = value if unit == "1" or value == NOTHING else f"{value} {unit}"
    return f"{named} [{low}, {high}]" if high else f"{named} {low}".rstrip()


def _numbers(found: Interval, unit: str) -> tuple[str, str, str]:
    """Return an estimate and the ends of its interval, or a remark instead of the ends."""
    if not math.isfinite(found.value):
        return NOTHING, TOO_FEW, ""
    if found.low == found.high:
        return in_unit(found.value, unit), "", ""
    if not math.isfinite(found.half_width):
        return in_unit(found.value, unit), TOO_FEW, ""
    value, low, high = (end * PER_SI[unit] for end in (found.value, found.low, found.high))
    sizes = [abs(end) for end in (value, low, high) if end]
    if min(sizes) < _WITHOUT_EXPONENT[0] or max(sizes) >= _WITHOUT_EXPONENT[1]:
        return in_unit(found.value, unit), in_unit(found.low, unit), in_unit(found.high, unit)
    place = math.floor(math.log10(abs(value))) if value else 0
    decimals = _HALF_WIDTH_DIGITS - 1 - math.floor(math.log10(0.5 * (high - low)))
    decimals = max(min(max(decimals, _MIN_DIGITS - 1 - place), _MAX_DIGITS - 1 - place), 0)
    return f"{value:.{decimals}f}", f"{low:.{decimals}f}", f"{high:.{decimals}f}"


def part_with_interval(found: Interval) -> str:
    """Return a fraction in per cent, "57.1 % [54.0, 60.2]"."""
    if not math.isfinite(found.value):
        return NOTHING
    value, low, high = (f"{100.0 * end:.1f}" for end in (found.value, found.low, found.high))
    if found.low == found.high:
        return f"{value} %"
    return f"{value} % " + (f"[{low}, {high}]" if math.isfinite(found.half_width) else TOO_FEW)


def sufficient_for(realisations: int, probability: float) -> bool:
    """Return whether a quantile is drawn: if one realisation is beyond it on average.

    A smaller sample would show its extreme value as the quantile; 5 % takes 20 realisations.

    Parameters
    ----------
    realisations : int
    probability : float
        Of the quantile.
    """
    return realisations * min(probability, 1.0 - probability) >= _ONE


def too_few(result: EnsembleResult, names: list[str] | None = None) -> str:
    """Return a message with the sample size that Sobol indices require.

    Parameters
    ----------
    result : EnsembleResult
    names : list of str, optional
        Random inputs; all by default.
    """
    groups = [item["name"] for item in result.raw.groups]
    if result.plan == "saltelli":
        needed = FEWEST_BASES * (len(groups) + 2)
    else:
        needed = max(_needed(result, name) for name in (groups if names is None else names))
    return f"{TOO_FEW_REALISATIONS}, {count(needed)} are sufficient"


def _needed(result: EnsembleResult, name: str) -> int:
    """Return the sample size that the Sobol index of one input requires."""
    keys = [item["key"] for item in result.raw.inputs if item["input"] == name]
    columns = np.column_stack([result.inputs[key].reshape(result.count, -1) for key in keys])
    # equal columns carry the same information
    return fewest_realisations(np.unique(columns, axis=1).shape[1])
