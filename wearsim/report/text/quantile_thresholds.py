"""From how many realisations on a quantile is drawn or told."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult

NINE_IN_TEN = (0.05, 0.95)
_ONE = 1.0 - 1e-9  # but for rounding: 1 - 0.95 is a little more than 0.05


def enough_for(realisations: int, probability: float) -> bool:
    """Tell whether a quantile is drawn: from as many on as have one beyond it, on average.

    With fewer it would be no more than the outermost realisation under another name: 20 for 5 %.

    Parameters
    ----------
    realisations : int
    probability : float
        Of the quantile.
    """
    return realisations * min(probability, 1.0 - probability) >= _ONE


def known_ends(result: EnsembleResult, name: str) -> tuple[float, float] | None:
    """Return between what nine in ten realisations end, or nothing where that is not known.

    It is known where the intervals of both ends are finite, as the table has them.

    Parameters
    ----------
    result : EnsembleResult
    name : str
        The observable.
    """
    found = result.estimate(name, -1, NINE_IN_TEN)
    ends = [found.quantile(p) for p in NINE_IN_TEN]
    if not all(math.isfinite(end.half_width) for end in ends):
        return None
    return ends[0].value, ends[1].value
