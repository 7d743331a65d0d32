"""Distributions whose log density is quadratic on the support, such as the truncated normal."""

from __future__ import annotations

import math

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import MaxentDistribution, Mirrored, quadratic
from wearsim.uq.distributions.quantile_table import InverseTable, LogDensity, Piece

_DEEPEST = 5.0  # greatest distance of the support from the parent's mean, in parent stds
_NARROWEST = 0.03  # least width of the support, in parent stds


class TruncatedNormal(MaxentDistribution):
    """A truncated normal distribution whose support is not far in the tail.

    Parameters
    ----------
    low, high : float
        Support; either end may be infinite.
    parent_mean, parent_std : float
        Mean and standard deviation of the normal distribution before truncation.
    """

    def __init__(self, low: float, high: float, parent_mean: float, parent_std: float) -> None:
        from scipy.special import ndtr  # noqa: PLC0415  (slow to import, and rarely needed)

        self.support = (low, high)
        self.family = "truncated normal" if math.isfinite(low) or math.isfinite(high) else "normal"
        self._mean, self._std = mean, std = parent_mean, parent_std
        # beyond 40 standard deviations the density underflows
        ends = np.clip((np.array([low, high]) - mean) / std, -40.0, 40.0)
        self._ends = ndtr(ends * np.array([1.0, -1.0]))
        # in the tail that holds both ends, if there is one, to avoid cancellation
        self._mass = float(np.ptp(ndtr(math.copysign(1.0, -ends[0]) * ends)))
        density = np.exp(-0.5 * ends**2) / (math.sqrt(2.0 * math.pi) * self._mass)
        shift = float(density[0] - density[1])
        self.mean = mean + std * shift
        self.std = std * math.sqrt(1.0 - float(np.diff(ends * density)[0]) - shift * shift)
        top = -math.log(self._mass * std * math.sqrt(2.0 * math.pi))
        self._set_exponent(mean, top, 0.0, 0.5 / (std * std))

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        lower = self._ends[0] + below * self._mass
        upper = self._ends[1] + above * self._mass
        score = ndtri(np.minimum(lower, upper))  # of the smaller tail, to avoid cancellation
        return np.asarray(self._mean + self._std * np.where(lower < upper, score, -score))


class QuadraticExponent(MaxentDistribution):
    """The density ``exp(-a u - b u^2)``, u being the scaled distance from the lower end.

    For cases without usable closed forms: a nearly exponential or nearly uniform density, or one
    that increases towards an end (b < 0).

    Parameters
    ----------
    low, high : float
        Support; `high` may be infinite if b > 0.
    scale : float
        Value per unit of u.
    fall : float
        a, of either sign.
    bend : float
        b.
    from_above : float
        The coefficient a for distances from the upper end, above zero if the density also increases
        towards that end; it cannot be computed from large a and b without cancellation.
    top : float
        Decrease of the log density from the lower to the upper end; needed with `from_above`.
    """

    def __init__(
        self,
        low: float,
        high: float,
        scale: float,
        fall: float,
        bend: float,
        from_above: float = 0.0,
        top: float = 0.0,
    ) -> None:
        self.family = "truncated normal" if bend > 0.0 else "exponential of a quadratic"
        self.support = (low, high)

        def exponent(slope: float, top: float) -> LogDensity:
            return lambda u: (-top - (slope + bend * u) * u, -slope - 2.0 * bend * u, -2.0 * bend)

        stop = -0.5 * fall / bend if from_above > 0.0 else (high - low) / scale
        pieces = [Piece(low, scale, exponent(fall, 0.0), stop)]
        if from_above > 0.0:
            upper = exponent(-from_above, top)
            pieces.append(Piece(high, scale, upper, 0.5 * from_above / bend))
        self._table = table = InverseTable(pieces)
        self.mean, self.std = table.mean, table.std
        log_total = math.log(scale) + table.log_total
        self._set_exponent(low, -log_total, fall / scale, bend / scale**2)
        if from_above > 0.0:
            self.antimode = low + scale * stop, float(table.above_pieces[0])
            self._upper = high, -top - log_total, -from_above / scale, bend / scale**2

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        return self._table.values(below, above)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the logarithm of the density at `x`, which must be within the support."""
        logs = super().log_density(x)
        if self.antimode is None:
            return logs
        return np.where(x < self.antimode[0], logs, quadratic(x, *self._upper))


def cut_normal(
    low: float, high: float, parent_mean: float, parent_std: float
) -> MaxentDistribution:
    """Return a truncated normal distribution for any support.

    Parameters
    ----------
    low, high : float
        Support; either end may be infinite.
    parent_mean, parent_std : float
        Mean and standard deviation of the normal distribution before truncation.

    Returns
    -------
    MaxentDistribution
    """
    if high - parent_mean < parent_mean - low:
        return Mirrored(cut_normal(-high, -low, -parent_mean, parent_std))
    if has_parent(low, high, parent_mean, parent_std):
        return TruncatedNormal(low, high, parent_mean, parent_std)
    fall = (low - parent_mean) / parent_std
    return QuadraticExponent(low, high, parent_std, fall, 0.5)


def has_parent(low: float, high: float, parent_mean: float, parent_std: float) -> bool:
    """Return whether closed forms are accurate on a support nearer above the parent's mean."""
    near = low - parent_mean <= _DEEPEST * parent_std
    return near and high - low > _NARROWEST * parent_std
