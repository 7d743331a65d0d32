"""Distributions whose log density is quadratic on the support, such as the truncated normal."""

from __future__ import annotations

import math
from functools import cached_property

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
        self._parent = mean, std = parent_mean, parent_std
        start, stop = (low - mean) / std, (high - mean) / std
        self._ends = float(ndtr(start)), float(ndtr(-stop))
        # in the tail that holds both ends, if there is one, to avoid cancellation
        upper = float(ndtr(-start)) - float(ndtr(-stop))
        self._mass = upper if start > 0.0 else float(ndtr(stop)) - float(ndtr(start))
        density = [
            math.exp(-0.5 * end * end) / math.sqrt(2.0 * math.pi) / self._mass
            for end in (start, stop)
        ]
        arms = [
            end * part if part > 0.0 else 0.0
            for end, part in zip((start, stop), density, strict=True)
        ]
        shift = density[0] - density[1]
        self.mean = mean + std * shift
        self.std = std * math.sqrt(1.0 + arms[0] - arms[1] - shift * shift)
        log_mass = math.log(self._mass * std * math.sqrt(2.0 * math.pi))
        l2 = 0.5 / (std * std)
        self._log_top = -log_mass
        self.multipliers = (l2 * mean * mean + log_mass, -2.0 * l2 * mean, l2)

    @property
    def parent(self) -> tuple[float, float]:
        """Mean and standard deviation of the normal distribution before truncation."""
        return self._parent

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        lower = self._ends[0] + below * self._mass
        upper = self._ends[1] + above * self._mass
        score = ndtri(np.minimum(lower, upper))  # of the smaller tail, to avoid cancellation
        mean, std = self._parent
        return mean + std * np.where(lower < upper, score, -score)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the logarithm of the density at `x`, which must be within the support."""
        mean, std = self._parent
        return self._log_top - 0.5 * ((x - mean) / std) ** 2


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
    from_above : float, optional
        The coefficient a for distances from the upper end; it cannot be computed from large a and b
        without cancellation.
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
        from_above: float | None = None,
        top: float = 0.0,
    ) -> None:
        self.family = "truncated normal" if bend > 0.0 else "exponential of a quadratic"
        self.support, self._scale = (low, high), scale
        self._fall, self._bend, self._from_above, self._top = fall, bend, from_above, top
        self.mean, self.std = self._table.mean, self._table.std
        l2 = bend / scale**2
        slope = fall / scale
        l0 = math.log(scale) + self._table.log_total
        self.multipliers = (l0 - slope * low + l2 * low * low, slope - 2.0 * l2 * low, l2)

    @property
    def parent(self) -> tuple[float, float] | None:
        """Mean and standard deviation of the normal distribution before truncation, or None."""
        if self._bend <= 0.0:
            return None
        std = self._scale / math.sqrt(2.0 * self._bend)
        return self.support[0] - self._scale * self._fall / (2.0 * self._bend), std

    @property
    def antimode(self) -> tuple[float, float] | None:
        """Interior minimum of the density, and the probability above it; or None."""
        if not self._has_two_peaks:
            return None
        least = self.support[0] - 0.5 * self._scale * self._fall / self._bend
        return least, float(self._table.above_pieces[0])

    @property
    def _has_two_peaks(self) -> bool:
        """Whether the density also decreases from the upper end down."""
        return self._from_above is not None and self._from_above > 0.0

    @cached_property
    def _table(self) -> InverseTable:
        """Quantiles of u, piecewise from both ends if the density has two peaks."""
        low, high = self.support
        fall, bend, width = self._fall, self._bend, (high - low) / self._scale
        above, top = self._from_above, self._top

        def edges(slope: float, stop: float) -> FloatArray:
            return panel_edges(
                slope=lambda u: slope + 2.0 * bend * u,
                curvature=lambda u: 2.0 * bend,
                drop=lambda u: (slope + bend * u) * u,
                stop=stop,
            )

        stop = -0.5 * fall / bend if self._has_two_peaks else width
        pieces = [Piece(low, self._scale, edges(fall, stop), lambda u: -(fall + bend * u) * u)]
        if above is not None and self._has_two_peaks:
            # offsets below zero, from the upper end down
            offsets = -edges(above, -0.5 * above / bend)[::-1]
            log_density = lambda v: -top + (above - bend * v) * v  # noqa: E731
            pieces.append(Piece(high, self._scale, offsets, log_density))
        return InverseTable(pieces)

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        return self._table.values(below, above)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the logarithm of the density at `x`, which must be within the support."""
        low, high = self.support
        u = (x - low) / self._scale
        logs = -(self._fall + self._bend * u) * u
        if self._from_above is not None:
            v = (high - x) / self._scale
            logs = np.where(u <= v, logs, -self._top - (self._from_above + self._bend * v) * v)
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
