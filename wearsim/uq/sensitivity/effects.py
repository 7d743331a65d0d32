"""Effects of random inputs on a value, with sign and confidence interval."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import Distribution
from wearsim.uq.estimation.intervals import Interval, t_interval

#: Probability of the quantiles of an input at which its effect is stated, and its complement.
TAIL = 0.1
_SCORES = np.linspace(-5.0, 5.0, 2001)  # at which a quantile function is tabulated
_PER_TERM = 2  # least number of realisations per term of a fit


@dataclass(frozen=True)
class SignedEffect:
    """Change of a value by one input, from its median to quantiles, the other inputs unchanged.

    Parameters
    ----------
    low, high : Interval
        Change at the 10 % and at the 90 % quantile of the input.
    """

    low: Interval
    high: Interval

    @property
    def factors(self) -> tuple[Interval, Interval]:
        """Factors of a value whose logarithm changes, at the 10 % and the 90 % quantile."""
        low, high = (
            Interval(math.exp(change.value), math.exp(change.low), math.exp(change.high))
            for change in (self.low, self.high)
        )
        return low, high

    @property
    def size(self) -> float:
        """Distance between the two changes."""
        return abs(self.high.value - self.low.value)

    @property
    def sign(self) -> int:
        """1 if the value rises with the input, -1 if it falls, 0 if the sign is not significant."""
        if self.low.high < 0.0 < self.high.low or self.high.high < 0.0 < self.low.low:
            return 1 if self.high.value > self.low.value else -1
        return 0


def effects(values: FloatArray, scores: Mapping[str, FloatArray]) -> dict[str, SignedEffect]:
    """Return the effects of inputs on a value, from a quadratic fit to their normal scores.

    All inputs are fitted together, so that the effects of the others do not add to the noise of
    one; each alone where there are fewer than two realisations per term of that fit.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Values of the realisations, finite.
    scores : mapping of str to ndarray, shape (n, m)
        Normal scores of the numbers drawn for each input, by its name; see `normal_scores`. The
        effect of several numbers is that of all at the same quantile.

    Returns
    -------
    dict of str to SignedEffect
        Without inputs for which there are too few realisations. Intervals are those of Student's t
        with standard errors that allow for unequal variances: HC3 of MacKinnon and White, J.
        Econometrics 29 (1985), DOI 10.1016/0304-4076(85)90158-7.
    """
    designs = {name: np.column_stack([score, score**2]) for name, score in scores.items()}
    if len(values) >= _PER_TERM * (1 + sum(design.shape[1] for design in designs.values())):
        return _fitted(values, designs)
    return {
        name: _fitted(values, {name: design})[name]
        for name, design in designs.items()
        if len(values) >= _PER_TERM * (1 + design.shape[1])
    }


def exact_effect(low: float, high: float) -> SignedEffect:
    """Return the effect of an input whose changes are known exactly."""
    return SignedEffect(Interval(low, low, low), Interval(high, high, high))


def normal_scores(numbers: FloatArray, law: Distribution | None) -> FloatArray:
    """Return the normal scores of drawn numbers, shape as `numbers`, (n, m).

    Parameters
    ----------
    numbers : ndarray, shape (n, m)
    law : Distribution, optional
        Their distribution. Without it, and where it has jumps, the scores are those of the ranks,
        which know the quantiles of the input less well.
    """
    if law is not None:
        values = np.asarray(law.quantile(scipy.special.ndtr(_SCORES)))
        if (np.diff(values) > 0.0).all():
            return np.asarray(np.interp(numbers, values, _SCORES))
    return np.asarray(
        scipy.special.ndtri((scipy.stats.rankdata(numbers, axis=0) - 0.5) / len(numbers))
    )


def _fitted(values: FloatArray, designs: Mapping[str, FloatArray]) -> dict[str, SignedEffect]:
    """Return the effects of inputs in one fit."""
    terms = np.column_stack([np.ones(len(values)), *designs.values()])
    inverse = np.linalg.pinv(terms)
    slopes = inverse @ values
    leverage = np.einsum("ij,ji->i", terms, inverse)
    left_out = (values - terms @ slopes) / np.maximum(1.0 - leverage, 1e-9)
    by_input, first = {}, 1
    for name, design in designs.items():
        many, changes = design.shape[1] // 2, []
        for score in (float(scipy.special.ndtri(TAIL)), -float(scipy.special.ndtri(TAIL))):
            at = np.zeros(terms.shape[1])
            at[first : first + many], at[first + many : first + 2 * many] = score, score**2
            error = math.sqrt(float(((at @ inverse * left_out) ** 2).sum()))
            changes.append(t_interval(float(at @ slopes), error, len(values) - terms.shape[1]))
        by_input[name] = SignedEffect(*changes)
        first += design.shape[1]
    return by_input
