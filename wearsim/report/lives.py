"""Lives, small probabilities and remarks of a design in words, and the variable of a sweep."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from wearsim.report.summary import limits_in_si
from wearsim.report.text import NOTHING, count, part_with_interval, shown
from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.life_settings import DesignVariable
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.sensitivity.effects import SignedEffect
from wearsim.uq.survival.lives import fewest_lives
from wearsim.uq.survival.rare_events import RareProbability

RARE_TESTS = 200  # that are proposed for a probability that is not stated
_SMALL = 0.01  # probability below which more digits are shown


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
        fewest = fewest_lives(0.01 * share)
        if result.count < fewest and not result.is_exact:
            return f"takes {fewest} lives", ""
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


def study_options(result: LifeResult) -> list[str]:
    """Return the options of a study of lives without those of its precision and rare events."""
    shares = ",".join(f"{share:g}" for share in result.settings.shares)
    options = ["-n", str(result.settings.plain), "--seed", str(result.raw.seed), "--b", shares]
    options += ["--max", f"{result.most:.17g}"]
    if result.target is not None:
        options += ["--target", f"{result.target:.17g}"]
    return options


def rare_command(result: LifeResult) -> str:
    """Return the command for a small probability of a life before the target."""
    given = limits_in_si(result.scenario.limit.given)
    limits = [text for limit in given for text in ("--limit", limit)]
    options = [*study_options(result), *limits, "--rare", str(RARE_TESTS)]
    stem = Path(result.raw.scenario_file).stem.removesuffix("-life")
    output = ["-o", f"{stem}-rare-life.h5"]
    return shlex.join(["wearsim", "life", result.raw.scenario_file, *options, *output])


def target_text(result: LifeResult) -> str:
    """Return the probability of a life before the target, or why it is not stated."""
    assert result.target is not None
    if obstacle := result.probability_obstacle(result.target):
        return f"not stated: {obstacle}"
    found = result.probability_before(result.target)
    if not 0.0 < found.value < _SMALL:
        return part_with_interval(found)
    interval = f" [{found.low:.2g}, {found.high:.2g}]" if found.low < found.high else ""
    return f"{found.value:.3g}{interval}"


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


def remarks(result: LifeResult) -> list[str]:
    """Return what a user should know of the lives."""
    remarks = []
    if result.count and result.at_once == result.count:
        remarks.append("a limit is exceeded before any wear in all realisations: every life is 0")
    elif result.at_once:
        remarks.append(f"{result.at_once} of {result.count} realisations exceed a limit when fresh")
    if result.count and not result.observed.any():
        greatest, known = [], result.known_lives[np.isfinite(result.known_lives)]
        # tests with an exact wear factor are run up to its greatest value, and further than `most`
        if result.is_exact and len(known):
            greatest.append(f"the shortest drawn life is {rounded_lives(known.min())[0]}")
        elif result.is_exact:
            greatest.append("with the greatest wear factor")
        for name, limit in () if len(known) else result.scenario.limit.given.items():
            stored = {"volume": "worn_volume"}.get(name, name)
            if stored in result.observables:
                part = float(result.at_end(stored).max()) / limit
                greatest.append(f"{name.replace('_', ' ')} up to {100.0 * part:.3g} % of its limit")
        reached = f" ({', '.join(greatest)})" if greatest else ""
        remarks.append(
            f"no realisation reaches a limit within {result.most:,.0f} {result.unit}{reached};"
            " give a greater --max or other limits"
        )
    return remarks
