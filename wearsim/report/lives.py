"""Lives and small probabilities of a design in words, and the design variable of a sweep."""

from __future__ import annotations

import math
from collections.abc import Sequence

from wearsim.report.text import NOTHING, count, shown
from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.life_settings import DesignVariable
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.sensitivity.effects import SignedEffect
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
    low, value, high = rounded_lives(found.low, found.value, found.high)
    if math.isnan(found.value):
        return f"above {most}", f"from {low}" if math.isfinite(found.low) else NOTHING
    if found.low == found.high:
        ends = result.b_error(share)
        return rounded_lives(ends[0], found.value, ends[1])[1], ""
    if math.isfinite(found.low):
        return value, f"{low}..{high}" if math.isfinite(found.high) else f"from {low}"
    bound = result.lower_bound(share)  # of a small sample
    return value, f"from {rounded_lives(bound)[0]} (one-sided)" if math.isfinite(
        bound
    ) else "too few lives"


def rounded_lives(*lives: float) -> list[str]:
    """Return lives with the digits that the range between them supports: its first two.

    Lives have six digits at most.
    """
    known = [abs(life) for life in lives if math.isfinite(life)]
    least = max(known, default=0.0) * 1e-4
    width = max(max(known) - min(known), least) if len(known) > 1 else least
    unit = 10.0 ** max(math.floor(math.log10(width)) - 1, 0) if width > 0.0 else 1.0
    return [count(round(life / unit) * unit) if math.isfinite(life) else NOTHING for life in lives]


def effect_cells(effect: SignedEffect) -> tuple[str, str]:
    """Return the change of life at the 10 % and the 90 % quantile of an input, with intervals."""
    low, high = effect.factors
    return _change(low), _change(high)


def _change(factor: Interval) -> str:
    change = [100.0 * (one - 1.0) for one in (factor.value, factor.low, factor.high)]
    if not math.isfinite(factor.half_width):
        return NOTHING
    if factor.half_width == 0.0:
        return f"{change[0]:+.1f} %"
    return "{:+.1f} % [{:+.1f}, {:+.1f}]".format(*change)


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
