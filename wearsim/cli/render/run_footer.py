"""Last line of the output of a study: method, error estimate and wall time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from wearsim.report.text.units import NOTHING, brief, count, lapse, shown

if TYPE_CHECKING:
    from wearsim.results import DissipationResult, EnsembleResult, Result
    from wearsim.studies.contact.single import ContactStudy

NINETY_FIVE = 1.96  # standard errors of the half-width of a normal 95 % interval


def run_line(result: Result) -> str:
    """Return the footer of a run, with the estimated errors of its stepping."""
    used = [result.described_model, f"{len(result.y)} strips", result.stepper]
    error = "no stepping error"
    if result.stepper != "per-pass":
        used.append(f"tolerance {result.raw.tolerance:g}")
        depth = max(np.max(result.depth[-1]), np.max(result.roller_depth[-1]))
        volume = np.max(result.worn_volume[-1])
        depth = _within("depth", np.max(result.depth_error[-1]), depth)
        volume = _within("worn volume", np.max(result.volume_error[-1]), volume)
        error = f"{depth}, {volume} (estimated stepping error)"
    return _line(used, error, lapse(result.raw.wall_seconds))


def contact_line(study: ContactStudy) -> str:
    """Return the footer of one contact, with the error estimated from half as many strips."""
    error = ""
    if study.grid_error is not None:
        error = f"dissipated power within {_percent(study.grid_error)} (estimated strip error)"
    time = NOTHING if study.seconds is None else brief(study.seconds)
    return _line([study.described_model, f"{study.grid.strips} strips"], error, time)


def dissipation_line(result: DissipationResult) -> str:
    """Return the footer of a dissipation study, with its sampling error."""
    power = result.summaries["power"]
    used = [result.described_model, f"{len(result.y)} strips", result.raw.plan]
    used.append(f"{count(result.count)} realisations")
    error = _within("mean dissipated power", NINETY_FIVE * power.mean_error, power.mean)
    return _line(used, f"{error} (95 % interval)", lapse(result.raw.wall_seconds))


def ensemble_line(result: EnsembleResult) -> str:
    """Return the footer of an ensemble, with its sampling errors."""
    raw, error = result.raw, ""
    used = [result.described_model, raw.stepper, f"tolerance {raw.tolerance:g}", raw.plan]
    used.append(f"{count(result.count)} realisations")
    if result.count:
        found = result.estimate("depth", -1, (0.95,))
        items = ("mean depth", found.mean), ("its 95 % quantile", found.quantiles[0][1])
        errors = [_within(name, item.half_width, item.value) for name, item in items]
        error = f"{', '.join(errors)} (95 % intervals)"
    return _line(used, error, lapse(raw.wall_seconds))


def _line(used: list[str], error: str, time: str) -> str:
    return "; ".join([", ".join(used), *([error] if error else []), time])


def _within(name: str, error: float, value: float) -> str:
    """Return the relative error of a value as text."""
    if value == error == 0.0:
        return f"{name} is 0"
    if value == 0.0 or not math.isfinite(error):
        return f"{name} of unknown error"
    return f"{name} within {_percent(abs(error / value))}"


def _percent(part: float) -> str:
    return shown(float(part), "%", 2) if part else "rounding"
