"""Further tests for rare, early ends of life, stage by stage."""

from __future__ import annotations

from typing import Any

import numpy as np

from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.rare import by_importance, by_subset, needs_subset, responses
from wearsim.studies.life.draws import MOST_INPUTS, drawn_scores, shifted_inputs
from wearsim.studies.life.integrated import integrated_stages
from wearsim.studies.run.draws import Drawer
from wearsim.uq.survival.rare_events import log_weights, next_shift

LEAST_TESTS = 200
_ADAPTED = 2  # stages that choose the shift, each with a quarter of the tests


def next_stages(result: LifeResult) -> list[dict[str, Any]]:
    """Return the first number, the count and the draws of the next tests; none if all are done.

    Parameters
    ----------
    result : LifeResult
        With all tests so far.

    Notes
    -----
    Two stages of a quarter of the tests choose the mean of the draws of the most influential
    inputs; the next stage gives the estimate. Where the wear factor is integrated exactly, see
    `integrated_stages`. If the estimate is not reliable, the tests of subset simulation follow.
    """
    settings = result.settings
    if settings.target is None or not settings.rare:
        return []
    importance = by_importance(result)
    if needs_subset(settings.rare_method, importance):
        found = by_subset(result)
        return [found] if isinstance(found, dict) else []
    if importance:
        return []
    if settings.factor:
        return integrated_stages(result)
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
    moved = dict(zip(names, map(float, shift), strict=True))
    return [{"first": first, "count": count, "shift": moved}]
