"""Estimates of a rare, early end of life from the further tests of a study."""

from __future__ import annotations

from typing import Any

import numpy as np

from wearsim.studies.ensemble.file.schema import DONE
from wearsim.studies.life.values import LifeValues
from wearsim.types import FloatArray
from wearsim.uq.survival.rare_events import RareProbability, subset_stages, weighted_probability

IMPORTANCE, SUBSET = "importance sampling", "subset simulation"
_SPAN = 1e-3  # least life over the target that is distinguished


def responses(result: LifeValues) -> FloatArray:
    """Return ln(life/target) of all realisations, nan where they failed."""
    settings = result.settings
    assert settings.target is not None
    span = max(settings.target * _SPAN, 1.0), settings.most
    logs = np.log(np.clip(result.raw.rows("life", 0, None), *span) / settings.target)
    return np.where(result.raw.status == DONE, logs, np.nan)


def rare_estimates(result: LifeValues) -> dict[str, RareProbability]:
    """Return the estimates of the methods that are complete, in the order of their use."""
    importance = by_importance(result)
    needed = needs_subset(result.settings.rare_method, importance)
    found = {IMPORTANCE: importance, SUBSET: by_subset(result) if needed else None}
    return {name: item for name, item in found.items() if isinstance(item, RareProbability)}


def needs_subset(method: str, importance: RareProbability | None) -> bool:
    """Return whether subset simulation is the next method, after an estimate if there is one."""
    failed = importance is not None and not importance.is_reliable
    return method == "subset" or (method == "auto" and failed)


def by_importance(result: LifeValues) -> RareProbability | None:
    """Return the estimate of importance sampling; None while its tests are incomplete."""
    settings = result.settings
    stages = [stage for stage in settings.stages if "parents" not in stage]
    if not stages or sum(stage["count"] for stage in stages) < settings.rare:
        return None
    last = [stage for stage in stages if "mixture" in stage] or stages[-1:]
    first, end = last[0]["first"], last[-1]["first"] + last[-1]["count"]
    done = result.raw.done
    chosen = done[(done >= first) & (done < end)]
    weights = result.raw.rows("log_weight", 0, None)[chosen]
    target = result.target
    assert target is not None
    if result.is_exact:
        event = result.mixture_of(chosen).failed(np.array([target]))[:, 0]
    else:
        event = result.raw.rows("life", 0, None)[chosen] < settings.target
    return weighted_probability(event, weights, settings.rare)


def by_subset(result: LifeValues) -> RareProbability | dict[str, Any]:
    """Return the estimate of subset simulation, or the next tests that it takes.

    The first tests are the realisations without weights, as far as there are sufficient. A test
    that failed has no event.

    Returns
    -------
    RareProbability or dict
        The dict has the number of the first test, their `count`, the `parents` from which their
        draws depart, none for independent ones, and the `scale` of the change.
    """
    settings = result.settings
    stages = [stage for stage in settings.stages if "parents" in stage]
    work, known = subset_stages(settings.rare, settings.plain), responses(result)
    stage = next(work)
    numbers = np.arange(min(settings.plain, stage.count))
    missing = stage.count - len(numbers)
    while True:
        if missing:
            if not stages:
                parents = [] if stage.parents is None else numbers[stage.parents].tolist()
                first = settings.plain + sum(item["count"] for item in settings.stages)
                plan = {"first": first, "count": missing, "shift": {}}
                return {**plan, "parents": parents, "scale": stage.scale}
            first = stages.pop(0)["first"]
            numbers = np.append(numbers, np.arange(first, first + missing))
        values = known[numbers[-stage.count :]]
        try:
            stage = work.send(np.where(np.isnan(values), np.inf, values))
        except StopIteration as end:
            estimate: RareProbability = end.value
            return estimate
        missing = stage.count
