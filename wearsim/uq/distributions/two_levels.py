"""Log-normal distribution with an uncertain median and scatter, as weights over both."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import Distribution

_POINTS = 1201  # of the tabulated distribution function
_FINEST = 0.02  # distance of its points in the middle, in standard deviations
_NARROWEST = 0.3  # scatter over a step of the grid of its means
_LEAST_WEIGHT = 1e-8  # of a mean and scatter on a grid
_REACH = 9.0  # of its points, in scatters


class TwoLevels(Distribution):
    """Predictive distribution of a value with ln value ~ N(m, t^2) and weights over (m, t).

    The first level is the scatter t between specimens, the second one what is not known of m and t.

    Parameters
    ----------
    m, t : ndarray, shape (rows,)
        Mean and standard deviation of the logarithm; t above zero.
    weight : ndarray, shape (rows,)
        Above zero; they are divided by their sum.
    specimens : int
        Number of specimens from which the weights follow, 0 if it is not known.
    contained : sequence of str
        Dotted keys of inputs whose differences between the specimens are part of t.
    """

    def __init__(
        self,
        m: FloatArray,
        t: FloatArray,
        weight: FloatArray,
        specimens: int = 0,
        contained: Sequence[str] = (),
    ) -> None:
        self.m, self.t, self.weight = m, t, weight / weight.sum()
        self.specimens, self.contained = specimens, tuple(contained)

    @classmethod
    def on_grid(
        cls,
        t: FloatArray,
        m: FloatArray,
        density: FloatArray,
        specimens: int = 0,
        contained: Sequence[str] = (),
    ) -> TwoLevels:
        """Return the distribution of a density on a grid; the other parameters as above.

        Parameters
        ----------
        t : ndarray, shape (t,)
            From 0.
        m, density : ndarray, shape (t, m)
            Equally spaced means for each t, and the density there.
        """
        width, step = np.gradient(t), m[:, 1] - m[:, 0]
        width[[0, -1]] *= 0.5
        weight = density * (width * step)[:, None]
        weight /= weight.sum()
        # smooth where the grid of m is wider than the scatter
        scatter = np.broadcast_to(np.maximum(t, _NARROWEST * step)[:, None], m.shape)
        kept = weight > _LEAST_WEIGHT
        return cls(m[kept], scatter[kept], weight[kept], specimens, contained)

    @property
    def plug_in(self) -> tuple[float, float]:
        """Median of m and median of t, which are taken as known if one level alone is used."""
        half = np.array([0.5])
        return tuple(  # type: ignore[return-value]
            float(weighted_quantiles(values, self.weight, half)[0]) for values in (self.m, self.t)
        )

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles, shape as `probability`."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        probability = np.asarray(probability, dtype=float)
        scores, logs = self._table
        values = np.exp(np.interp(ndtri(probability), scores, logs))
        return np.where(probability <= 0.0, 0.0, np.where(probability >= 1.0, np.inf, values))

    @cached_property
    def _table(self) -> tuple[FloatArray, FloatArray]:
        """Normal scores of the distribution function, and the logarithms of its values."""
        from scipy.special import ndtr, ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        centre = float(self.weight @ self.m)
        spread = float(np.sqrt(self.weight @ ((self.m - centre) ** 2 + self.t**2)))
        low = float((self.m - _REACH * self.t).min()) - centre
        high = float((self.m + _REACH * self.t).max()) - centre
        # equal steps of the inverse hyperbolic sine are fine in the middle, coarse in the tails
        fine = _FINEST * _POINTS * 0.5 * spread
        first, last = np.arcsinh(np.array([low, high]) / fine).tolist()
        logs = centre + fine * np.sinh(np.linspace(first, last, _POINTS))
        below, above = np.zeros(_POINTS), np.zeros(_POINTS)
        for place, log in enumerate(logs):
            score = (log - self.m) / self.t
            tail, is_below = ndtr(-np.abs(score)), score < 0.0
            below[place] = self.weight @ np.where(is_below, tail, 1.0 - tail)
            above[place] = self.weight @ np.where(is_below, 1.0 - tail, tail)
        with np.errstate(divide="ignore"):
            scores = np.where(below < 0.5, ndtri(below), -ndtri(above))
        known = np.isfinite(scores)
        scores, places = np.unique(scores[known], return_index=True)
        return scores, logs[known][places]

    @cached_property
    def support(self) -> tuple[float, float]:
        """Minimum and maximum."""
        return 0.0, float("inf")

    @cached_property
    def mean(self) -> float:
        """Exact mean."""
        return float(self.weight @ np.exp(self.m + 0.5 * self.t**2))

    @cached_property
    def std(self) -> float:
        """Exact standard deviation."""
        square = float(self.weight @ np.exp(2.0 * (self.m + self.t**2)))
        return float(np.sqrt(max(square - self.mean**2, 0.0)))


def weighted_quantiles(
    values: FloatArray, weight: FloatArray, probability: FloatArray
) -> FloatArray:
    """Return quantiles of values with weights, interpolated between their middles.

    Parameters
    ----------
    values, weight : ndarray, shape (n,)
    probability : ndarray, shape (m,)
    """
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weight[order]) - 0.5 * weight[order]
    return np.interp(probability, below / weight.sum(), values[order])
