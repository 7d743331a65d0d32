"""Lives and small probabilities of a design in words, and the design variable of a sweep."""

from __future__ import annotations

import math
from collections.abc import Sequence

from wearsim.report.text import NOTHING, count, shown
from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.life_settings import DesignVariable
from wearsim.uq.survival.rare_events import RareProbability


def against(results: Sequence[LifeResult]) -> DesignVariable | None:
    """Return the design variable whose value differs between results of a sweep, if there is one.

    Parameters
    ----------
    results : sequence of LifeResult

    Returns
    -------
    DesignVariable or None
        That of the first; None unless all have the same variable with different values.
    """
    found = [one.variable for one in results if one.variable]
    keys, values = {(one.key, one.unit) for one in found}, {one.value for one in found}
    return found[0] if len(keys) == 1 and len(values) == len(results) > 1 else None


def life_cells(result: LifeResult, share: float) -> tuple[str, str]:
    """Return the life that a percentage does not reach, and its interval, which may be empty."""
    found, most = result.b(share), count(result.most)
    low, high = (_life(end) for end in (found.low, found.high))
    if math.isnan(found.value):
        return f"above {most}", f"from {low}" if math.isfinite(found.low) else NOTHING
    value = _life(found.value)
    if found.low == found.high:
        return value, ""
    if math.isfinite(found.low):
        return value, f"{low}..{high}" if math.isfinite(found.high) else f"from {low}"
    bound = result.lower_bound(share)  # of a small sample
    return value, f"from {_life(bound)} (one-sided)" if math.isfinite(bound) else "too few lives"


def _life(value: float) -> str:
    return count(value) if math.isfinite(value) else NOTHING


def rare_text(found: RareProbability) -> str:
    """Return the probability of a rare event, or why there is none."""
    if not found.is_reliable:
        return f"refused, {found.obstacle}"
    chance = found.probability
    text = f"{chance.value:.3g} [{chance.low:.2g}, {chance.high:.2g}], {count(found.tests)} tests"
    text += f", variation {shown(found.variation, '%', 2)}"
    if found.effective_size is not None:
        text += f", effective sample size {found.effective_size:.0f}"
    return text
