"""Further tests for a small probability whose wear factor is integrated exactly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.schema import DONE
from wearsim.studies.life.draws import MOST_INPUTS, drawn_scores, shifted_inputs
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

_ADAPTED = 4  # one test of so many improves the shifts


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
    scores = np.concatenate([found for _, found in drawn])
    mixture = result.mixture_of(numbers)
    if not stages:
        names, points = _points(names, scores, mixture, target / settings.per_unit)
        sizes = _parts(settings.rare // _ADAPTED, [1.0] * len(points))
        return _stages(settings.plain, sizes, names, points)
    counts = [len(places) for places, _ in drawn]
    shifts = [_shift_of(stage, names) for stage in (plain, *stages)]
    weights = np.exp(mixture_log_weights(scores, [n / sum(counts) for n in counts], shifts))
    event = mixture.failed(np.array([target / settings.per_unit]))[:, 0]
    means, parts = improved_shifts(scores, weights * event, shifts[1:])
    done = sum(stage["count"] for stage in stages)
    parts = [DEFENSIVE, *((1.0 - DEFENSIVE) * part for part in parts)]
    sizes = _parts(settings.rare - done, parts)
    found = _stages(settings.plain + done, sizes, names, [np.zeros(len(names)), *means])
    mixed = [(stage["count"] / sum(sizes), stage["shift"]) for stage in found]
    return [{**stage, "mixture": mixed} for stage in found]


def _points(
    names: list[str], scores: FloatArray, mixture: FactorMixture, life: float
) -> tuple[list[str], list[FloatArray]]:
    """Return the most influential inputs, and the design points of their scores."""
    log, known = mixture.log_kappa
    if len(log) < 2:
        chosen = np.arange(min(len(names), MOST_INPUTS))
        return [names[place] for place in chosen], [np.zeros(len(chosen))]
    effects = influence(scores[known], log)
    chosen = np.sort(np.argsort(-effects, kind="stable")[:MOST_INPUTS])
    points = design_points(
        scores[known][:, chosen], log, lambda found: mixture.needed_score(found, life)
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


def _shift_of(stage: dict[str, Any], names: list[str]) -> FloatArray:
    return np.array([stage["shift"].get(name, 0.0) for name in names])


def _parts(total: int, shares: Sequence[float]) -> list[int]:
    """Return whole numbers in proportion to shares, with the given sum."""
    ends = np.round(total * np.cumsum(shares) / sum(shares)).astype(int)
    return [int(size) for size in np.diff(ends, prepend=0)]


def _stages(
    first: int, sizes: Sequence[int], names: list[str], shifts: Sequence[FloatArray]
) -> list[dict[str, Any]]:
    found = []
    for size, shift in zip(sizes, shifts, strict=True):
        moved = dict(zip(names, map(float, shift), strict=True))
        found.append({"first": first, "count": size, "shift": moved})
        first += size
    return [stage for stage in found if stage["count"]]
