"""Distributions whose log density is quadratic on the support, such as the truncated normal."""

from __future__ import annotations

import math

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import MaxentDistribution, Mirrored
from wearsim.uq.distributions.quantile_table import InverseTable, Piece, panel_edges

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
        self._log_mass = math.log(self._mass * std * math.sqrt(2.0 * math.pi))
        l2 = 0.5 / (std * std)
        self.multipliers = (l2 * mean * mean + self._log_mass, -2.0 * l2 * mean, l2)

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        lower = self._ends[0] + below * self._mass
        upper = self._ends[1] + above * self._mass
        score = ndtri(np.minimum(lower, upper))  # of the smaller tail, to avoid cancellation
        return np.asarray(self._mean + self._std * np.where(lower < upper, score, -score))

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the logarithm of the density at `x`, which must be within the support."""
        return -self._log_mass - 0.5 * ((x - self._mean) / self._std) ** 2


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
        self.support, self._scale = (low, high), scale
        self._fall, self._bend, self._from_above, self._top = fall, bend, from_above, top

        def edges(slope: float, stop: float) -> FloatArray:
            return panel_edges(
                slope=lambda u: slope + 2.0 * bend * u,
                curvature=lambda u: 2.0 * bend,
                drop=lambda u: (slope + bend * u) * u,
                stop=stop,
            )

        stop = -0.5 * fall / bend if from_above > 0.0 else (high - low) / scale
        pieces = [Piece(low, scale, edges(fall, stop), self._from_lower)]
        if from_above > 0.0:  # offsets below zero, from the upper end down
            offsets = -edges(from_above, -0.5 * from_above / bend)[::-1]
            pieces.append(Piece(high, scale, offsets, self._from_upper))
        self._table = table = InverseTable(pieces)
        self.mean, self.std = table.mean, table.std
        if from_above > 0.0:
            self.antimode = low + scale * stop, float(table.above_pieces[0])
        l1, l2 = fall / scale, bend / scale**2
        l0 = math.log(scale) + table.log_total
        self.multipliers = (l0 - l1 * low + l2 * low * low, l1 - 2.0 * l2 * low, l2)

    def _from_lower(self, u: FloatArray) -> FloatArray:
        return -(self._fall + self._bend * u) * u

    def _from_upper(self, v: FloatArray) -> FloatArray:
        return -self._top + (self._from_above - self._bend * v) * v

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        return self._table.values(below, above)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the logarithm of the density at `x`, which must be within the support."""
        low, high = self.support
        u, v = (x - low) / self._scale, (x - high) / self._scale
        logs = self._from_lower(u)
        if self._from_above > 0.0:
            logs = np.where(u <= -v, logs, self._from_upper(v))
        return logs - self._table.log_total - math.log(self._scale)


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
