"""Further tests for rare, early ends of life: shifted draws, and changes of earlier draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.rare import by_importance, by_subset, needs_subset, responses
from wearsim.scenario import Scenario
from wearsim.studies.run.draws import Drawer
from wearsim.types import FloatArray
from wearsim.uq.survival.rare_events import log_weights, next_shift

MOST_INPUTS = 4  # with a shift
LEAST_TESTS = 200
_ADAPTED = 2  # stages that choose the shift, each with a quarter of the tests


def shifted_inputs(scenario: Scenario) -> list[str]:
    """Return the inputs that may be shifted: one number per test, without rank correlation."""
    correlated = {name for *names, _ in scenario.sampling.correlation for name in names}
    return [
        item.name
        for item in scenario.random
        if item.role == "scalar" and item.persistence == "per-test" and item.name not in correlated
    ]


def drawn_scores(drawer: Drawer, names: list[str], first: int, count: int) -> FloatArray:
    """Return the normal scores of inputs in consecutive realisations, (count, inputs)."""
    from scipy.special import ndtri  # noqa: PLC0415  (slow to load)

    uniforms = drawer.uniforms(first, count)
    return np.column_stack([ndtri(uniforms[name][:, 0]) for name in names])


def log_weight(drawer: Drawer, shift: dict[str, float], realisation: int) -> float:
    """Return the logarithm of the weight of a realisation with shifted draws."""
    scores = drawn_scores(drawer, list(shift), realisation, 1)
    return float(log_weights(scores, np.array(list(shift.values())))[0])


def changes_of(stages: Sequence[Mapping[str, Any]]) -> dict[int, tuple[int, float]]:
    """Return from which realisation the draws of others depart, and the scale of the change."""
    return {
        stage["first"] + place: (parent, stage["scale"])
        for stage in stages
        for place, parent in enumerate(stage.get("parents", ()))
    }


def next_stage(result: LifeResult) -> dict[str, Any] | None:
    """Return the first number, the count and the draws of the next tests; None if all are done.

    Parameters
    ----------
    result : LifeResult
        With all tests so far.

    Notes
    -----
    Two stages of a quarter of the tests choose the mean of the draws of the most influential
    inputs; the next stage gives the estimate. If it is not reliable, those of subset simulation
    follow.
    """
    settings = result.settings
    if settings.target is None or not settings.rare:
        return None
    importance = by_importance(result)
    if needs_subset(settings.rare_method, importance):
        found = by_subset(result)
        return found if isinstance(found, dict) else None
    if importance:
        return None
    stages = list(settings.stages)
    done = sum(stage["count"] for stage in stages)
    first = settings.plain + done
    count = settings.rare // 4 if len(stages) < _ADAPTED else settings.rare - done
    last: dict[str, Any] = (
        stages[-1] if stages else {"first": 0, "count": settings.plain, "shift": {}}
    )
    names = list(last["shift"]) or shifted_inputs(result.scenario)
    drawer = Drawer(result.scenario, "monte-carlo", shift=last["shift"])
    scores = drawn_scores(drawer, names, last["first"], last["count"])
    response = responses(result)[last["first"] : last["first"] + last["count"]]
    good = np.isfinite(response)
    if not last["shift"]:
        effect = np.abs(scores[good].T @ (response[good] - response[good].mean()))
        chosen = np.sort(np.argsort(-effect)[:MOST_INPUTS])
        names, scores = [names[place] for place in chosen], scores[:, chosen]
    weights = log_weights(scores, np.array([last["shift"].get(name, 0.0) for name in names]))
    shift = next_shift(scores[good], response[good], weights[good])
    return {
        "first": first,
        "count": count,
        "shift": dict(zip(names, map(float, shift), strict=True)),
    }
