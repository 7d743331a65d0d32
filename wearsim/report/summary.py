"""Rows of summaries in engineering units, and their JSON in SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.errors import PluginError, ScenarioError
from wearsim.evolution.limits import Limit
from wearsim.report.text import (
    NINETY_PERCENT,
    NOTHING,
    OBSERVABLES,
    Named,
    brief,
    count,
    in_unit,
    lapse,
    shown,
    simulated,
    with_interval,
)
from wearsim.results import DissipationResult, EnsembleResult, Result
from wearsim.types import FloatArray
from wearsim.units import LONG, engineers_unit, in_engineers_unit, kind_of
from wearsim.uq.estimation.moments import is_constant

if TYPE_CHECKING:
    from wearsim.results.content import StudyData
    from wearsim.studies.contact.single import ContactStudy


Rows = list[tuple[str, str]]
CONSTANT = "constant"
_ROUNDING = 1e-9  # relative error that is not printed


def _by_roller(values: Any, unit: str) -> str:
    """Return one value per roller, or one value if all are equal."""
    texts = [shown(float(value), unit) for value in np.ravel(values)]
    if len(set(texts)) == 1:
        return texts[0]
    return " / ".join(text.removesuffix(f" {unit}") for text in texts) + f" {unit}"


def width_of(result: Result, width: Any) -> str:
    """Return widths of the groove, or the depth that it has not reached."""
    if not np.any(width):
        return f"0 mm, not deeper than {shown(result.raw.width_threshold, 'um')}"
    return _by_roller(width, "mm")


def end_state(result: Result) -> Rows:
    """Return rows on the observables at the end of a run, with their estimated errors."""
    errors = {name: float(np.max(values[-1])) for name, values in result.errors.items()}

    def stated(name: str, unit: str) -> str:
        return with_error(np.asarray(getattr(result, name)[-1]), errors.get(name), unit)

    rows = [("depth", _by_roller(result.depth[-1], "um"))]
    if result.start_height.any():
        below = _by_roller(result.depth_below_nominal[-1], "um")
        rows = [("depth worn since the start", rows[0][1]), ("depth below nominal", below)]
    if np.any(np.asarray(result.roller_depth[-1]) > 0.0):
        rows.insert(1, ("roller depth", stated("roller_depth", "um")))
    width = stated("width", "mm") if np.any(result.width[-1]) else width_of(result, 0.0)
    rows += [
        ("width", width),
        ("worn volume", stated("worn_volume", "mm^3")),
        ("dissipated energy", stated("dissipated_energy", "J")),
        ("dissipated power", stated("power", "W")),
        ("normal force", stated("normal_force", "N")),
        ("peak pressure", stated("peak_pressure", "MPa")),
        ("worn descent", stated("descent", "um")),
        ("elastic approach", stated("elastic_approach", "um")),
        *_of_cam(result),
    ]
    if result.stepper == "per-pass":
        return [*rows, ("error of depth", "no stepping error: every roller pass is solved")]
    error = float(np.max(result.depth_error[-1]))
    # the error refers to the greatest depth on either body
    depth = float(max(np.max(result.depth[-1]), np.max(result.roller_depth[-1])))
    part = f", {shown(error / depth, '%', 2)}" if depth > 0.0 else ""
    return [*rows, ("estimated error of depth", f"{shown(error, 'um', 2)}{part}")]


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
    if error is None or not math.isfinite(error) or error <= _ROUNDING * size:
        return _by_roller(values, unit)
    # the last digit is that below the first digit of the error
    digits = 2 + math.floor(math.log10(size / error)) if size > 0.0 else 1
    texts = [in_unit(float(value), unit, min(max(digits, 1), 4)) for value in np.ravel(values)]
    text = texts[0] if len(set(texts)) == 1 else " / ".join(texts)
    return f"{text} ± {shown(error, unit, 2)}"


def _of_cam(result: Result) -> Rows:
    """Return rows on angles and lift error of a cam; none of a cylinder."""
    final = result.final
    if "turns" not in final:
        return []

    def stated(name: str, unit: str, key: str) -> str:
        error = final[f"{name}_error_{key}"]
        return with_error(np.asarray(final[f"{name}_{key}"]), float(np.max(error)), unit)

    return [
        ("turns of the cam", f"{float(np.max(final['turns'])):,.0f}"),
        ("angle of the depth", stated("depth_angle", "deg", "rad")),
        ("angle of the peak pressure", stated("peak_pressure_angle", "deg", "rad")),
        ("lift error, peak to peak", stated("lift_error", "um", "m")),
        ("least wear of the lift", f"at {stated('least_wear_angle', 'deg', 'rad')}"),
        ("greatest wear of the lift", f"at {stated('greatest_wear_angle', 'deg', 'rad')}"),
    ]


def draws(result: Result) -> Rows:
    """Return rows on the random inputs of a run: drawn values and inputs that vary in time."""
    rows = [("random inputs", "one realisation, not the means")] if result.raw.drawn else []
    for key, drawn in result.raw.drawn.items():
        unit, size = engineers_unit(drawn["unit"])
        text = " / ".join(f"{value / size:.6g}" for value in drawn["values"])
        rows.append((f"drawn {key}", text if unit == "1" else f"{text} {unit}"))
    return [*rows, *_random_rows(result)]


def input_rows(result: DissipationResult | EnsembleResult) -> Rows:
    """Return rows on the random inputs of a study: mean and standard deviation of the draws."""
    rows = []
    for item in result.raw.inputs if result.count else []:
        values, unit = result.inputs[item["key"]], item["unit"]
        mean, std = float(values.mean()), _std(values)
        text = f"mean {in_engineers_unit(mean, unit, 4)}"
        if is_constant(mean, std):
            text = f"{CONSTANT} {in_engineers_unit(mean, unit, 4)}"
        elif math.isfinite(std):
            text += f", std {in_engineers_unit(std, unit, 4)}"
        rows.append((f"drawn {item['key']}", text))
    return [*rows, *_random_rows(result)]


def estimates(result: EnsembleResult) -> Rows:
    """Return the estimates of an ensemble with their intervals, the mean depth first."""
    if result.count == 0:
        return [("depth", "no test is completed")]
    found = result.estimate("depth", -1, (*NINETY_PERCENT, 0.5))
    rows = [("mean depth", with_interval(found.mean, "um"))]
    if result.count > 1 and not result.is_constant("depth"):
        low, high = (found.quantile(p) for p in NINETY_PERCENT)
        rows += [
            ("90 % of the tests", f"{in_unit(low.value, 'um', 3)} to {shown(high.value, 'um', 3)}"),
            ("median", with_interval(found.quantile(0.5), "um")),
            ("95 % of the tests are below", with_interval(high, "um")),
            ("standard deviation", with_interval(found.std, "um")),
        ]
    for name in ("width", "worn_volume", "roller_depth", "dissipated_energy", "peak_pressure"):
        if result.at_end(name).any():
            words, unit = OBSERVABLES[name]
            mean = result.estimate(name, -1, ()).mean
            rows.append((f"mean {words}", with_interval(mean, unit)))
    return rows


def input_data(result: DissipationResult | EnsembleResult) -> dict[str, Any]:
    """Return mean and standard deviation of the draws by key, in SI units."""
    return {
        item["key"]: {
            "unit": item["unit"],
            "mean": result.inputs[item["key"]].mean(),
            "std": _std(result.inputs[item["key"]]),
        }
        for item in (result.raw.inputs if result.count else [])
    }


def _std(values: FloatArray) -> float:
    return float(values.std(ddof=1)) if values.size > 1 else math.nan


def _random_rows(result: Result | DissipationResult | EnsembleResult) -> Rows:
    return [(f"random {name}", text) for name, text in still_random(result).items()]


def still_random(result: Result | DissipationResult | EnsembleResult) -> dict[str, str]:
    """Return descriptions of the random inputs that are not given by one drawn value, by key.

    These are fields, processes and inputs drawn at every pass. They are read from the stored
    scenario; if one of its plugins is not installed, the reason is returned instead.
    """
    try:
        random = result.scenario.random
    except (PluginError, ScenarioError) as error:
        return {"inputs": f"unknown, since the scenario cannot be read here: {error}"}
    if isinstance(result, DissipationResult):
        varying = [item for item in random if item.role in {"field", "process"}]
    else:
        drawn = result.raw.drawn if isinstance(result, Result) else result.inputs
        varying = [item for item in random if not set(item.keys) <= set(drawn)]
    return {item.name: item.describe() for item in varying}


def effort(result: Result) -> Rows:
    """Return rows on the number of steps, the contact solves and the wall time."""
    solves = count(_last(result.solves))
    if result.stepper == "per-pass":
        solves += f", {count(_last(result.full_solves))} roller passes solved in full"
    return [
        ("steps", f"{count(_last(result.steps))}, {count(_last(result.rejected))} rejected"),
        ("contact solves", solves),
        ("wall time", lapse(result.raw.wall_seconds)),
    ]


def standing(result: Result) -> str:
    """Return the passes and the simulated time that a run has reached."""
    passes, total = float(result.passes[-1]), float(result.raw.total_passes)
    time = simulated(float(result.time[-1]))
    if result.until:
        reached, error = count(passes), passes_error(result)
        if error is not None and error > _ROUNDING * passes:
            digits = max(math.floor(math.log10(error)), 0)  # those that the error leaves
            reached = f"{count(round(passes, -digits))} ± {in_unit(error, '1', 2)}"
            seconds, rate = np.array(result.time[-1]), result.raw.kinematics["pass_rate"]
            time = with_error(seconds, error / rate, "min" if seconds < LONG else "h")
        return f"stopped at {result.until}: pass {reached} of {count(total)}, {time}"
    if result.finished:
        return f"finished: {count(passes)} passes, {time}"
    part = f"{100.0 * passes / total:.1f} %"
    word = "failed after" if result.failure else "unfinished:"
    return f"{word} pass {count(passes)} of {count(total)} ({part}), {time}"


def passes_error(result: Result) -> float | None:
    """Return the error of the passes at which a run has reached its limit; None if not known.

    It is the estimated error of the limited quantity, over its growth per pass in the last step.
    """
    if not result.until or len(result.passes) < 2:
        return None
    name = Limit.parse(result.until).variable
    error = result.errors.get(name)
    if error is None:
        return None
    values = np.asarray(getattr(result, name)).reshape(len(result.passes), -1)
    place = int(values[-1].argmax())
    growth = abs(float(values[-1, place] - values[-2, place]))
    step = float(result.passes[-1] - result.passes[-2])
    greatest = float(np.max(error[-1]))
    if not (math.isfinite(greatest) and growth > 0.0):
        return None
    return min(greatest * step / growth, float(result.passes[-1]))


def _last(value: Any) -> int:
    """Return the last value of a history, or the number itself."""
    return int(np.ravel(value)[-1])


_LIMIT_UNITS = {"volume": "mm^3", "peak_pressure": "MPa"}


def limits_of(limits: Mapping[str, float]) -> list[str]:
    """Return limits of a life by name in SI units as texts, "depth 50.00 um"."""
    each = ((name, _LIMIT_UNITS.get(name, "um"), value) for name, value in limits.items())
    return [f"{name.replace('_', ' ')} {shown(value, unit)}" for name, unit, value in each]


def limits_in_si(limits: Mapping[str, float]) -> list[str]:
    """Return limits of a life as arguments of --limit, "depth=5e-05 m"."""
    units = ((name, kind_of(_LIMIT_UNITS.get(name, "um")).unit) for name in limits)
    return [f"{name}={limits[name]:.12g} {unit}" for name, unit in units]


def with_range(value: float, low: float, high: float, scale: float) -> str:
    """Return a value with its 95 % interval, with the digits that the interval leaves."""
    digits = 3 if (high - low) > 0.02 * value else 4
    texts = (in_unit(scale * one, "1", digits) for one in (value, low, high))
    return "{} ({} to {})".format(*texts)


def sources(raw: StudyData) -> list[tuple[str, str]]:
    """Return rows on scenario, input files, plugins and software of a study."""
    plugins = [
        f"{item['kind']} {item['name']} ({item['distribution']} {item['version']})"
        for item in raw.plugins
    ]
    return [
        ("scenario", raw.scenario_file),
        ("input files", ", ".join(raw.files) or "none"),
        ("plugins", "\n".join(plugins)),
        ("software", ", ".join(f"{name} {number}" for name, number in raw.software.items())),
        ("written", raw.created),
    ]


def run_json(result: Result) -> dict[str, Any]:
    """Return the end state and the effort of a run in SI units."""
    return {
        **result.final,
        "title": result.title,
        "model": result.model,
        "stepper": result.stepper,
        "tolerance": result.raw.tolerance,
        "strips": len(result.y),
        "finished": bool(result.finished),
        "until": result.until or None,
        "passes_error": passes_error(result),
        "failure": result.failure or None,
        "failed_at": result.raw.failed_at or None,
        "steps": _last(result.steps),
        "rejected": _last(result.rejected),
        "solves": _last(result.solves),
        "full_solves": _last(result.full_solves),
        "wall_seconds": result.raw.wall_seconds,
        "drawn": result.raw.drawn,
        "random": still_random(result),
        "output": str(result.path) if result.path else None,
        "notes": list(result.notes),
        "warnings": list(result.warnings),
    }


def run_line(result: Result) -> str:
    """Return the footer of a run, with the estimated errors of its stepping."""
    used = [result.described_model, f"{len(result.y)} strips", result.stepper]
    error = "no stepping error"
    known = bool(np.isfinite(result.profile_error_by_strips[-1]).all())
    if result.stepper != "per-pass":
        used.append(f"tolerance {result.raw.tolerance:g}")
    if result.stepper != "per-pass" or known:
        depth = max(np.max(result.depth[-1]), np.max(result.roller_depth[-1]))
        volume = np.max(result.worn_volume[-1])
        text = _within("depth", np.max(result.depth_error[-1]), depth)
        parts = "steps"
        if known:
            parts = "steps and strips"
            by = (
                np.max(part[-1])
                for part in (result.depth_error_by_steps, result.depth_error_by_strips)
            )
            steps, strips = (_percent(part / depth if depth > 0.0 else 0.0) for part in by)
            text += f" (steps {steps}, strips {strips})"
        volume_text = _within("worn volume", np.max(result.volume_error[-1]), volume)
        profile = _within("profile", np.max(result.profile_error[-1]), 1.0)
        error = (
            f"{text}, {profile}, {volume_text} (estimated numerical error of the {parts}, not of"
            " model or inputs)"
        )
    return _line(used, error, lapse(result.raw.wall_seconds))


def contact_line(study: ContactStudy) -> str:
    """Return the footer of one contact, with the error estimated from a grid half as fine."""
    error = ""
    if study.grid_error is not None:
        percent = _percent(study.grid_error)
        error = f"dissipated power within {percent} (estimated numerical error of the grid)"
    time = NOTHING if study.seconds is None else brief(study.seconds)
    return _line([study.described_model, f"{study.grid.strips} strips"], error, time)


def dissipation_line(result: DissipationResult) -> str:
    """Return the footer of a dissipation study, with its sampling error."""
    power = result.summaries["power"]
    used = [result.described_model, f"{len(result.y)} strips", result.raw.plan]
    used.append(f"{count(result.count)} realisations")
    error = _within("mean dissipated power", power.mean_interval.half_width, power.mean)
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


QUANTITIES = {
    "power": Named("dissipated power", "W"),
    "force_x": Named("longitudinal force", "N"),
    "force_y": Named("lateral force", "N"),
    "spin_moment": Named("spin moment", "N mm"),
    "normal_force": Named("normal force", "N"),
    "peak_pressure": Named("peak pressure", "MPa"),
}
_SI = {"W": "W", "N": "N", "N mm": "N_m", "MPa": "Pa"}


def dissipation_json(result: DissipationResult) -> dict[str, Any]:
    """Return the estimates of a study in SI units."""
    raw = result.raw
    return {
        "title": result.title,
        "model": raw.model,
        "plan": raw.plan,
        "seed": raw.seed,
        "realisations": result.count,
        "requested": raw.requested,
        "finished": result.finished,
        "mean_problem_power_W": result.mean_problem_power,
        **{f"{name}_{_SI[named.unit]}": raw.statistics[name] for name, named in QUANTITIES.items()},
        "inputs": input_data(result),
        "random": still_random(result),
        "friction_grid": raw.friction_grid or None,
        "strips": {
            "y_m": result.y,
            "dissipation_mean_W_per_m": result.values("dissipation_mean"),
            "dissipation_std_W_per_m": result.values("dissipation_std"),
            "dissipation_low_W_per_m": result.values("dissipation_low"),
            "dissipation_high_W_per_m": result.values("dissipation_high"),
        },
        "solve_seconds": raw.solve_seconds,
        "wall_seconds": raw.wall_seconds,
        "output": str(result.path) if result.path else None,
        "notes": list(result.notes),
        "warnings": list(result.warnings),
    }
