"""The end state of a run: a table in engineers' units, or a JSON object in SI."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.report.text.units import count, lapse, shown

if TYPE_CHECKING:
    from wearsim.results import DissipationResult, EnsembleResult, Result

Rows = list[tuple[str, str]]


def each(values: Any, unit: str) -> str:
    """Return one value per roller, or the one value they share."""
    texts = [shown(float(value), unit) for value in np.ravel(values)]
    if len(set(texts)) == 1:
        return texts[0]
    return " / ".join(text.removesuffix(f" {unit}") for text in texts) + f" {unit}"


def end_state(result: Result) -> Rows:
    """Return the observables at the end of a run."""
    depth, error = result.depth[-1], result.depth_error[-1]
    rows = [
        ("depth worn since the start", each(depth, "um")),
        ("depth below nominal", each(result.depth_below_nominal[-1], "um")),
        ("width", each(result.width[-1], "mm")),
        ("worn volume", each(result.worn_volume[-1], "mm^3")),
        ("dissipated energy", each(result.dissipated_energy[-1], "J")),
        ("power", each(result.power[-1], "W")),
        ("normal force", each(result.normal_force[-1], "N")),
        ("peak pressure", each(result.peak_pressure[-1], "MPa")),
    ]
    if result.stepper == "per-pass":
        rows.append(("error of stepping", "none: every pass was solved by itself"))
    else:
        rows.append(("estimated error of depth", _with_part(error, _deepest(result))))
    if not result.start_height.any():
        rows[:2] = [("depth", each(depth, "um"))]
    if np.any(np.asarray(result.roller_depth[-1]) > 0.0):
        rows.insert(1, ("depth of roller", each(result.roller_depth[-1], "um")))
    return rows


def _deepest(result: Result) -> float:
    """Return the greatest depth on either body [m], which the error of depth refers to."""
    return float(max(np.max(result.depth[-1]), np.max(result.roller_depth[-1])))


def _with_part(error: Any, depth: Any) -> str:
    worst, whole = float(np.max(error)), float(np.max(depth))
    text = shown(worst, "um", 2)
    return f"{text}, {shown(worst / whole, '%', 2)}" if whole > 0.0 else text


def draws(result: Result) -> Rows:
    """Return what was drawn in the place of random inputs, and what stayed random."""
    from wearsim.units import engineers_unit

    rows = []
    for key, drawn in result.raw.drawn.items():
        unit, size = engineers_unit(drawn["unit"])
        text = " / ".join(f"{value / size:.6g}" for value in drawn["values"])
        rows.append((f"drawn {key}", text if unit == "1" else f"{text} {unit}"))
    return rows + [(f"random {name}", text) for name, text in still_random(result).items()]


def still_random(result: Result | DissipationResult | EnsembleResult) -> dict[str, str]:
    """Return the random inputs that no one drawn value tells, by key and in words.

    They are fields, processes and what is drawn at every pass. The stored scenario tells them;
    where a plugin of theirs is missing, it cannot be read, and that is told instead.
    """
    from wearsim.errors import PluginError, ScenarioError
    from wearsim.results import EnsembleResult, Result

    try:
        random = result.scenario.random
    except (PluginError, ScenarioError) as error:
        return {"inputs": f"not told, since the scenario cannot be read here: {error}"}
    if isinstance(result, Result | EnsembleResult):
        drawn = result.raw.drawn if isinstance(result, Result) else result.inputs
        told = [item for item in random if not set(item.keys) <= set(drawn)]
    else:
        told = [item for item in random if item.role in {"field", "process"}]
    return {item.name: item.describe() for item in told}


def effort(result: Result) -> Rows:
    """Return what the run took."""
    solves = count(_int(result.solves))
    if result.stepper == "per-pass":
        solves += f", {count(_int(result.full_solves))} passes in full"
    return [
        ("steps", f"{count(_int(result.steps))}, {count(_int(result.rejected))} refused"),
        ("contact solves", solves),
        ("wall time", lapse(result.raw.wall_seconds)),
    ]


def standing(result: Result) -> str:
    """Return how far a run has come."""
    passes, total = float(result.passes[-1]), float(result.raw.total_passes)
    time = shown(float(result.time[-1]), "min")
    if result.finished:
        return f"finished: {count(passes)} passes, {time}"
    part = f"{100.0 * passes / total:.1f} %"
    return f"unfinished: pass {count(passes)} of {count(total)} ({part}), {time}"


def _int(value: Any) -> int:
    """Return the last of a history, or the number itself."""
    return int(np.ravel(value)[-1])


def as_json(result: Result) -> dict[str, Any]:
    """Return the end state and how it was reached, in SI."""
    return {
        **result.final,
        "title": result.title,
        "model": result.model,
        "stepper": result.stepper,
        "tolerance": result.raw.tolerance,
        "strips": len(result.y),
        "finished": bool(result.finished),
        "steps": _int(result.steps),
        "rejected": _int(result.rejected),
        "solves": _int(result.solves),
        "full_solves": _int(result.full_solves),
        "wall_seconds": result.raw.wall_seconds,
        "drawn": result.raw.drawn,
        "random": still_random(result),
        "output": str(result.path) if result.path else None,
        "notes": list(result.notes),
        "warnings": list(result.warnings),
    }
