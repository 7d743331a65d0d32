"""Text of figures and tables: units, labels, estimates and comparisons."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wearsim.types import FloatArray
from wearsim.units import LONG

if TYPE_CHECKING:
    from wearsim.uq.estimation.estimates import Target
    from wearsim.uq.estimation.intervals import Interval

# One SI unit in each engineering unit.
PER_SI = {
    **dict.fromkeys(("1", "turns", "m/s", "m/s^2", "m/s^3", "s", "N", "N m", "W", "J"), 1.0),
    "1/Pa": 1.0,
    "%": 1e2,
    "um": 1e6,
    "mm": 1e3,
    "mm^3": 1e9,
    "min": 1.0 / 60.0,
    "h": 1.0 / 3600.0,
    "N mm": 1e3,
    "N/mm": 1e-3,
    "MPa": 1e-6,
    "W/mm": 1e-3,
    "W/mm^2": 1e-6,
    "deg": math.degrees(1.0),
    "mrad": 1e3,
    "rpm": 30.0 / math.pi,
}
NOTHING = "-"
#: SI units in names of JSON by the unit shown
_SI = {"um": "m", "mm": "m", "mm^3": "m3", "MPa": "Pa", "deg": "rad", "J": "J", "W": "W", "N": "N"}
TOO_FEW = "too few"
TOO_FEW_REALISATIONS = "too few realisations"
NINETY_PERCENT = (0.05, 0.95)
QUANTILES = (0.05, 0.5, 0.95)  # that tables show
_HALF_WIDTH_DIGITS = 2  # significant digits of the half-width, which set the decimals
_MIN_DIGITS, _MAX_DIGITS = 3, 8  # significant digits of an estimate
_WITHOUT_EXPONENT = (1e-4, 1e7)
_ONE = 1.0 - 1e-9  # with a margin for rounding: 1 - 0.95 is slightly more than 0.05
ROUNDING = 1e-9  # relative error that is not printed


def shown(value: float | None, unit: str, digits: int = 4) -> str:
    """Return an SI value in an engineering unit, with that unit; parameters as of `in_unit`."""
    return with_unit(in_unit(value, unit, digits), unit)


def with_unit(text: str, unit: str) -> str:
    """Return a number in an engineering unit with that unit, which plain numbers do not have."""
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


def count_of(number: int, noun: str, none: str = "") -> str:
    """Return a number of things, "1 unit" or "1,000 units"; of zero another text if it is given."""
    return none if none and not number else f"{count(number)} {noun}{'' if number == 1 else 's'}"


def number_of_realisations(number: int) -> str:
    """Return "1 realisation" or "1,000 realisations"."""
    return count_of(number, "realisation")


def pass_unit(greatest: float) -> tuple[float, str]:
    """Return the unit of an axis of roller passes, and its label.

    Parameters
    ----------
    greatest : float
        Number of passes at the end of the axis.
    """
    if greatest >= 1e6:
        return 1e6, "million roller passes"
    return (1e3, "thousand roller passes") if greatest >= 1e4 else (1.0, "roller passes")


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


def simulated(seconds: float) -> str:
    """Return a time of the test as text: "450.0 min", "740.7 h"."""
    return shown(seconds, "min" if seconds < LONG else "h")


def brief(seconds: float) -> str:
    """Return a short time with three digits: "2.5 us", "84 s"."""
    if not math.isfinite(seconds):
        return NOTHING
    larger = ((unit, scale) for unit, scale in (("s", 1.0), ("ms", 1e3)) if seconds * scale >= 1.0)
    unit, scale = next(larger, ("us", 1e6))
    return f"{seconds * scale:.3g} {unit}"


class Named(NamedTuple):
    """Label of an observable.

    Parameters
    ----------
    words : str
        Name of the quantity.
    unit : str
        A key of `PER_SI`.
    """

    words: str
    unit: str

    @property
    def label(self) -> str:
        """Name with the unit, for an axis or a table."""
        return self.words if self.unit == "1" else f"{self.words} [{self.unit}]"


#: observables of an ensemble by name; the last ones are of cams and of fatigue
OBSERVABLES: Mapping[str, Named] = {
    "depth": Named("depth", "um"),
    "width": Named("width", "mm"),
    "worn_volume": Named("worn volume", "mm^3"),
    "roller_depth": Named("roller depth", "um"),
    "total_roller_worn_volume": Named("total roller worn volume", "mm^3"),
    "dissipated_energy": Named("dissipated energy", "J"),
    "mean_power": Named("mean power", "W"),
    "power": Named("dissipated power", "W"),
    "normal_force": Named("normal force", "N"),
    "peak_pressure": Named("peak pressure", "MPa"),
    "lift_error": Named("lift error, peak to peak", "um"),
    "lift_error_angle": Named("angle of the lift error", "deg"),
    "depth_angle": Named("angle of the depth", "deg"),
    "peak_pressure_angle": Named("angle of the peak pressure", "deg"),
    "damage": Named("effective damage", "1"),
    "pitting": Named("probability of pitting", "1"),
    "cylinder_damage": Named("damage of the cylinder", "1"),
    "roller_damage": Named("damage of the rollers", "1"),
}


def limit_unit(name: str) -> str:
    """Return the unit in which a limit of wear is shown, a key of `PER_SI`."""
    return OBSERVABLES[{"volume": "worn_volume", "clearance": "depth"}.get(name, name)].unit


def si_unit(name: str) -> str:
    """Return the SI unit of an observable, "m3" for a volume."""
    unit = OBSERVABLES[name].unit
    return _SI.get(unit, unit)


def si_key(name: str) -> str:
    """Return the name of an observable with its SI unit, for JSON: "worn_volume_m3"."""
    unit = si_unit(name)
    return name if unit == "1" else f"{name}_{unit}"


def statistic_in_words(target: Target) -> str:
    """Return the statistic of a target, "mean of depth" or "95 % quantile of width"."""
    statistic = "median" if target.statistic == 0.5 else target.statistic
    words = statistic if isinstance(statistic, str) else f"{100.0 * statistic:g} % quantile"
    return f"{words} of {OBSERVABLES[target.observable].words}"


def cells(estimate: Interval, unit: str) -> tuple[str, str]:
    """Return an estimate and its interval without the unit, for a table.

    Parameters
    ----------
    estimate : Interval
        In SI units.
    unit : str
        A key of `PER_SI`.

    Returns
    -------
    estimate, interval : str
        The interval is empty if it has no width.
    """
    if not math.isfinite(estimate.value):
        return NOTHING, TOO_FEW
    if estimate.low == estimate.high:
        return in_unit(estimate.value, unit), ""
    if not math.isfinite(estimate.half_width):
        return in_unit(estimate.value, unit), TOO_FEW
    value, low, high = (end * PER_SI[unit] for end in (estimate.value, estimate.low, estimate.high))
    sizes = [abs(end) for end in (value, low, high) if end]
    if min(sizes) < _WITHOUT_EXPONENT[0] or max(sizes) >= _WITHOUT_EXPONENT[1]:
        return in_unit(estimate.value, unit), "..".join(
            in_unit(end, unit) for end in (estimate.low, estimate.high)
        )
    place = math.floor(math.log10(abs(value))) if value else 0
    decimals = _HALF_WIDTH_DIGITS - 1 - math.floor(math.log10(0.5 * (high - low)))
    decimals = max(min(max(decimals, _MIN_DIGITS - 1 - place), _MAX_DIGITS - 1 - place), 0)
    return f"{value:.{decimals}f}", f"{low:.{decimals}f}..{high:.{decimals}f}"


def with_interval(estimate: Interval, unit: str) -> str:
    """Return "22.10 um [21.90, 22.31]"; parameters as of `cells`."""
    value, interval = cells(estimate, unit)
    named = with_unit(value, unit)
    if interval in {"", TOO_FEW}:
        return named + (interval and f" ({interval} for an interval)")
    return f"{named} [{interval.replace('..', ', ')}]"


def with_ends(estimate: Interval, write: Callable[[float], str], unit: str = "") -> str:
    """Return a value with the ends of its interval, "3.1 [2.9, 3.3]", each as `write` has it.

    An interval without width is left out.
    """
    value, low, high = map(write, (estimate.value, estimate.low, estimate.high))
    return f"{value}{unit}" + (f" [{low}, {high}]" if estimate.low != estimate.high else "")


def part_with_interval(part: Interval) -> str:
    """Return a fraction in per cent, "57.1 % [54.0, 60.2]"."""
    if not math.isfinite(part.value):
        return NOTHING
    if math.isinf(part.half_width):
        return f"{100.0 * part.value:.1f} % {TOO_FEW}"
    return with_ends(part, lambda end: f"{100.0 * end:.1f}", " %")


def too_few(sufficient: int) -> str:
    """Return a message with the number of realisations that is sufficient."""
    return f"{TOO_FEW_REALISATIONS}, {count(sufficient)} are sufficient"


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


def with_range(value: float, ends: Sequence[float], scale: float) -> str:
    """Return a value with its 95 % interval, with the digits that the interval leaves."""
    low, high = ends
    digits = 3 if (high - low) > 0.02 * value else 4
    return "{} ({} to {})".format(
        *(in_unit(scale * end, "1", digits) for end in (value, low, high))
    )


def within(name: str, error: float, value: float) -> str:
    """Return the relative error of a value as text."""
    if value == error == 0.0:
        return f"{name} is 0"
    if value == 0.0 or not math.isfinite(error):
        return f"{name} of unknown error"
    return f"{name} within {percent(abs(error / value))}"


def percent(part: float) -> str:
    """Return a relative error in per cent, or a word where it is only round-off."""
    return "rounding" if part < ROUNDING else shown(float(part), "%", 2)


def footer(used: list[str], error: str, time: str) -> str:
    """Return method, error and time of a computation on one line."""
    return "; ".join([", ".join(used), *([error] if error else []), time])


def plain(value: Any) -> Any:
    """Convert a value to JSON types: arrays to lists, paths to text, NaN to null."""
    match value:
        case Mapping():
            return {str(key): plain(item) for key, item in value.items()}
        case _ if hasattr(value, "tolist"):  # arrays and scalars of numpy
            return plain(value.tolist())
        case list() | tuple():
            return [plain(item) for item in value]
        case Path():
            return str(value)
        case float() if not math.isfinite(value):
            return None
    return value


def by_roller(values: Any, unit: str) -> str:
    """Return one value per roller, or one value if all are equal."""
    texts = [in_unit(float(value), unit) for value in np.ravel(values)]
    return with_unit(" / ".join(texts if len(set(texts)) > 1 else texts[:1]), unit)


def with_error(values: FloatArray, error: float | None, unit: str) -> str:
    """Return one value per roller with their error, with the digits that it leaves, "262 ± 4 MPa".

    Parameters
    ----------
    values : ndarray
        In SI.
    error : float, optional
        In SI; None and values that are not finite are left out.
    unit : str
        A key of `PER_SI`.
    """
    size = float(np.abs(values).max())
    if error is None or not math.isfinite(error) or error <= ROUNDING * size:
        return by_roller(values, unit)
    # the last digit is that below the first digit of the error
    digits = min(max(2 + math.floor(math.log10(size / error)), 1), 4) if size > 0.0 else 1
    last = 10.0 ** (math.floor(math.log10(error)) - 1)  # second digit of the error
    # smaller values than the error are rounded to that digit
    known = (
        value if abs(value) > error else last * round(value / last)
        for value in np.ravel(values).tolist()
    )
    texts = [in_unit(value, unit, digits) for value in known]
    text = texts[0] if len(set(texts)) == 1 else " / ".join(texts)
    return f"{text} ± {shown(error, unit, 2)}"


def rounded_lives(*lives: float) -> list[str]:
    """Return lives with the digits that the range between them supports: its first two.

    Lives have six digits at most.
    """
    known = [abs(life) for life in lives if math.isfinite(life)]
    least = max(known, default=0.0) * 1e-4
    width = max(max(known) - min(known), least) if len(known) > 1 else least
    unit = 10.0 ** max(math.floor(math.log10(width)) - 1, 0) if width > 0.0 else 1.0
    return [count(round(life / unit) * unit) if math.isfinite(life) else NOTHING for life in lives]
