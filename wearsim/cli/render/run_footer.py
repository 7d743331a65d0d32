"""One line for each run: what it used, how far off it may be, and how long it took."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from wearsim.report.text.units import NOTHING, brief, count, lapse, shown

if TYPE_CHECKING:
    from wearsim.results import DissipationResult, EnsembleResult, Result
    from wearsim.studies.contact.single import ContactStudy

NINETY_FIVE = 1.96  # standard errors to either side that hold 95 % of a normal law
SURE = " (95 %)"


def run_line(result: Result) -> str:
    """Return the line of a wear test; errors are those of its steps, as the run estimates them."""
    raw = result.raw
    used = [result.described_model, f"{len(result.y)} strips", result.stepper]
    if result.stepper == "per-pass":
        errors = ["every pass by itself"]
    else:
        used.append(f"tolerance {raw.tolerance:g}")
        depth = max(np.max(result.depth[-1]), np.max(result.roller_depth[-1]))
        volume = np.max(result.worn_volume[-1])
        errors = [
            "by its steps " + _within("depth", np.max(result.depth_error[-1]), depth),
            _within("volume", np.max(result.volume_error[-1]), volume, " as estimated"),
        ]
    return _line(used, errors, lapse(raw.wall_seconds))


def contact_line(study: ContactStudy) -> str:
    """Return the line of one contact; its error is that of its strips."""
    used = [study.described_model, f"{study.grid.strips} strips"]
    error = []
    if study.grid_error is not None:
        error.append(f"by its strips power within {_part(study.grid_error)}, from half as many")
    return _line(used, error, NOTHING if study.seconds is None else brief(study.seconds))


def dissipation_line(result: DissipationResult) -> str:
    """Return the line of a study of one contact; its error is that of so many draws."""
    power = result.summaries["power"]
    used = [result.described_model, f"{len(result.y)} strips", result.raw.plan]
    used.append(f"{count(result.count)} realisations")
    error = _within("mean power", NINETY_FIVE * power.mean_error, power.mean, SURE)
    return _line(used, [error], lapse(result.raw.wall_seconds))


def ensemble_line(result: EnsembleResult) -> str:
    """Return the line of an ensemble; its errors are those of so many tests."""
    raw = result.raw
    used = [result.described_model, raw.stepper, f"tolerance {raw.tolerance:g}", raw.plan]
    used.append(f"{count(result.count)} realisations")
    errors = []
    if result.count:
        found = result.estimate("depth", -1, (0.95,))
        errors = [
            _within(name, item.half_width, item.value, SURE)
            for name, item in (("mean depth", found.mean), ("95 % quantile", found.quantiles[0][1]))
        ]
    return _line(used, errors, lapse(raw.wall_seconds))


def _line(used: list[str], errors: list[str], time: str) -> str:
    return "; ".join([", ".join(used), *([", ".join(errors)] if errors else []), time])


def _within(name: str, error: float, value: float, how: str = "") -> str:
    """Return how far off a value may be, as a part of it, and how that is known."""
    if value == error == 0.0:
        return f"{name} is 0"
    if value == 0.0 or not math.isfinite(error):
        return f"{name} of unknown error"
    return f"{name} within {_part(abs(error / value))}{how}"


def _part(value: float) -> str:
    return shown(float(value), "%", 2) if value else "rounding"
