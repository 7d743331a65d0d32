"""Further tests for rare, early ends of life, also with an integrated wear factor."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.studies.ensemble.file.schema import DONE
from wearsim.studies.life.rare.draws import MOST_INPUTS, drawn_scores, shifted_inputs
from wearsim.studies.life.rare.estimates import by_importance, by_subset, needs_subset, responses
from wearsim.studies.life.result import LifeResult
from wearsim.studies.run.draws import Drawer
from wearsim.types import FloatArray, IntArray
from wearsim.uq.survival.design_points import (
    DEFENSIVE,
    design_points,
    improved_shifts,
    influence,
    mixture_log_weights,
)
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.rare_events import log_weights, next_shift

_ADAPTED = 2  # stages that choose the shift, each with a quarter of the tests
_IMPROVING = 4  # one test of so many improves the shifts


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
        further = by_subset(result)
        return [further] if isinstance(further, dict) else []
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


def integrated_stages(result: LifeResult) -> list[dict[str, Any]]:
    """Return the next tests of importance sampling of the inputs other than the wear factor.

    The first tests are drawn about the design points of a fit of ln kappa to the realisations. The
    others, which give the estimate, are drawn about the mean scores of the event found so far, and
    a part of them without a shift.

    Parameters
    ----------
    result : LifeResult
        With all tests so far, and none of the last stages.
    """
    settings, stages = result.settings, list(result.settings.stages)
    target = settings.target
    assert target is not None
    names = list(stages[0]["shift"]) if stages else shifted_inputs(result.scenario, settings.factor)
    plain = {"first": 0, "count": settings.plain, "shift": {}}
    drawn = [_stage_scores(result, names, stage) for stage in (plain, *stages)]
    numbers = np.concatenate([places for places, _ in drawn])
    scores = np.concatenate([further for _, further in drawn])
    mixture = result.mixture_of(numbers)
    if not stages:
        names, points = _points(names, scores, mixture, target / settings.per_unit)
        sizes = _parts(settings.rare // _IMPROVING, [1.0] * len(points))
        return _stages(settings.plain, sizes, names, points)
    counts = [len(places) for places, _ in drawn]
    shifts = [
        np.array([stage["shift"].get(name, 0.0) for name in names]) for stage in (plain, *stages)
    ]
    weights = np.exp(mixture_log_weights(scores, [n / sum(counts) for n in counts], shifts))
    event = mixture.failed(np.array([target / settings.per_unit]))[:, 0]
    means, parts = improved_shifts(scores, weights * event, shifts[1:])
    done = sum(stage["count"] for stage in stages)
    sizes = _parts(settings.rare - done, [DEFENSIVE, *((1.0 - DEFENSIVE) * part for part in parts)])
    further = _stages(settings.plain + done, sizes, names, [np.zeros(len(names)), *means])
    mixed = [(stage["count"] / sum(sizes), stage["shift"]) for stage in further]
    return [{**stage, "mixture": mixed} for stage in further]


def _points(
    names: list[str], scores: FloatArray, mixture: FactorMixture, life: float
) -> tuple[list[str], list[FloatArray]]:
    """Return the most influential inputs, and the design points of their scores."""
    log, known = mixture.log_kappa
    if len(log) < 2:
        chosen = np.arange(min(len(names), MOST_INPUTS))
        return [names[place] for place in chosen], [np.zeros(len(chosen))]
    chosen = np.sort(np.argsort(-influence(scores[known], log), kind="stable")[:MOST_INPUTS])
    points = design_points(
        scores[known][:, chosen], log, lambda scores_found: mixture.needed_score(scores_found, life)
    )
    return [names[place] for place in chosen], points


def _stage_scores(
    result: LifeResult, names: list[str], stage: dict[str, Any]
) -> tuple[IntArray, FloatArray]:
    """Return the numbers of the successful tests of a stage, and the scores of their draws."""
    first, count = stage["first"], stage["count"]
    drawer = Drawer(result.scenario, "monte-carlo", shift=stage["shift"])
    good = np.flatnonzero(result.raw.status[first : first + count] == DONE)
    return first + good, drawn_scores(drawer, names, first, count)[good]


def _parts(total: int, shares: Sequence[float]) -> list[int]:
    """Return whole numbers in proportion to shares, with the given sum."""
    ends = np.round(total * np.cumsum(shares) / sum(shares)).astype(int)
    return [int(size) for size in np.diff(ends, prepend=0)]


def _stages(
    first: int, sizes: Sequence[int], names: list[str], shifts: Sequence[FloatArray]
) -> list[dict[str, Any]]:
    starts = itertools.accumulate(sizes[:-1], initial=first)
    moved = [dict(zip(names, map(float, shift), strict=True)) for shift in shifts]
    return [
        {"first": start, "count": size, "shift": shift}
        for start, size, shift in zip(starts, sizes, moved, strict=True)
        if size
    ]
