"""Laws whose log density is a quadratic on the support: normal laws, cut off or turned over."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import MaxentDistribution, Mirrored
from wearsim.uq.distributions.quantile_table import InverseTable, Piece, panel_edges

_DEEPEST = 5.0  # standard deviations of the parent between its mean and a support that is cut off
_NARROWEST = 0.03  # support, in standard deviations of the parent


class TruncatedNormal(MaxentDistribution):
    """A normal law cut off at the ends of a support that is not far out in its tail.

    Parameters
    ----------
    low, high : float
        Support; either end may be infinite.
    parent_mean, parent_std : float
        Mean and standard deviation of the normal law before it is cut.
    """

    def __init__(self, low: float, high: float, parent_mean: float, parent_std: float) -> None:
        from scipy.special import ndtr  # noqa: PLC0415  (slow to import, and rarely needed)

        self.support = (low, high)
        self.family = "truncated normal" if math.isfinite(low) or math.isfinite(high) else "normal"
        self._parent = mean, std = parent_mean, parent_std
        start, stop = (low - mean) / std, (high - mean) / std
        self._ends = float(ndtr(start)), float(ndtr(-stop))
        # from the tail that holds both ends, if one does
        upper = float(ndtr(-start)) - float(ndtr(-stop))
        self._mass = upper if start > 0.0 else float(ndtr(stop)) - float(ndtr(start))
        self.mean, self.std = self._moments(start, stop)
        log_mass = math.log(self._mass * std * math.sqrt(2.0 * math.pi))
        l2 = 0.5 / (std * std)
        self._log_top = -log_mass
        self.multipliers = (l2 * mean * mean + log_mass, -2.0 * l2 * mean, l2)

    def _moments(self, start: float, stop: float) -> tuple[float, float]:
        """Return mean and standard deviation from the parent's density at both ends."""
        at = [
            math.exp(-0.5 * end * end) / math.sqrt(2.0 * math.pi) / self._mass
            for end in (start, stop)
        ]
        arms = [
            end * part if part > 0.0 else 0.0 for end, part in zip((start, stop), at, strict=True)
        ]
        shift = at[0] - at[1]
        mean, std = self._parent
        return mean + std * shift, std * math.sqrt(1.0 + arms[0] - arms[1] - shift * shift)

    @property
    def parent(self) -> tuple[float, float]:
        """Mean and standard deviation of the normal law that it is cut from."""
        return self._parent

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from probabilities below and above them."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        lower = self._ends[0] + below * self._mass
        upper = self._ends[1] + above * self._mass
        score = ndtri(np.minimum(lower, upper))  # of the tail that keeps its digits
        mean, std = self._parent
        return mean + std * np.where(lower < upper, score, -score)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the log of the density at `x` within the support."""
        mean, std = self._parent
        return self._log_top - 0.5 * ((x - mean) / std) ** 2


class QuadraticExponent(MaxentDistribution):
    """The law ``exp(-a u - b u^2)``, u counted from the lower end, where no parent serves.

    It is nearly exponential, nearly uniform, or (b < 0) rises towards an end.

    Parameters
    ----------
    low, high : float
        Support; `high` may be infinite where b > 0.
    scale : float
        Value per unit of u.
    fall : float
        a, of either sign.
    bend : float
        b.
    from_above : float, optional
        The coefficient that takes the place of a when u is counted from the upper end down; it
        cannot be had from a and b where these are great.
    top : float
        Fall of the log density from the lower to the upper end; needed with `from_above`.
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
        # two peaks: the density falls from the upper end down too
        self._two_peaks = from_above is not None and from_above > 0.0
        self.mean, self.std = self._table.mean, self._table.std
        l2 = bend / scale**2
        slope = fall / scale
        l0 = math.log(scale) + self._table.log_total
        self.multipliers = (l0 - slope * low + l2 * low * low, slope - 2.0 * l2 * low, l2)

    @property
    def parent(self) -> tuple[float, float] | None:
        """Mean and standard deviation of the normal law that it is cut from, if there is one."""
        if self._bend <= 0.0:
            return None
        std = self._scale / math.sqrt(2.0 * self._bend)
        return self.support[0] - self._scale * self._fall / (2.0 * self._bend), std

    @property
    def antimode(self) -> tuple[float, float] | None:
        """Where inside the support the density is least, and the probability above; or None."""
        if not self._two_peaks:
            return None
        least = self.support[0] - 0.5 * self._scale * self._fall / self._bend
        return least, self._table.above_piece(0)

    def _pieces(self) -> list[Piece]:
        """Return the density from its lower end, and where it has two peaks from its upper one."""
        low, high = self.support
        width, scale = (high - low) / self._scale, self._scale
        if self._from_above is None or not self._two_peaks:
            return [_rising_from(low, scale, self._fall, self._bend, width)]
        least, rest = (-0.5 * each / self._bend for each in (self._fall, self._from_above))
        upper = _falling_from(high, scale, self._from_above, self._bend, rest, self._top)
        return [_rising_from(low, scale, self._fall, self._bend, least), upper]

    @cached_property
    def _table(self) -> InverseTable:
        return InverseTable(self._pieces())

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from probabilities below and above them."""
        return self._table.values(below, above)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the log of the density at `x` within the support."""
        low, high = self.support
        u = (x - low) / self._scale
        logs = -(self._fall + self._bend * u) * u
        if self._from_above is not None:
            v = (high - x) / self._scale
            logs = np.where(u <= v, logs, -self._top - (self._from_above + self._bend * v) * v)
        return logs - self._table.log_total - math.log(self._scale)


def _edges(fall: float, bend: float, stop: float) -> FloatArray:
    return panel_edges(
        slope=lambda u: fall + 2.0 * bend * u,
        curvature=lambda u: 2.0 * bend,
        drop=lambda u: (fall + bend * u) * u,
        stop=stop,
    )


def _rising_from(low: float, scale: float, fall: float, bend: float, stop: float) -> Piece:
    """Return the piece that counts u from the lower end up."""
    return Piece(low, scale, _edges(fall, bend, stop), lambda u: -(fall + bend * u) * u)


def _falling_from(
    high: float, scale: float, fall: float, bend: float, stop: float, top: float
) -> Piece:
    """Return the piece that counts v from the upper end down, as offsets below zero."""
    edges = -_edges(fall, bend, stop)[::-1]
    return Piece(high, scale, edges, lambda v: -top + (fall - bend * v) * v)


def cut_normal(
    low: float, high: float, parent_mean: float, parent_std: float
) -> MaxentDistribution:
    """Return a normal law cut off at the ends of a support, wherever that lies.

    Parameters
    ----------
    low, high : float
        Support; either end may be infinite.
    parent_mean, parent_std : float
        Mean and standard deviation of the normal law before it is cut.

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
    """Return whether the parent's closed forms keep their digits on a support above its mean."""
    deep = low - parent_mean > _DEEPEST * parent_std
    return not deep and high - low > _NARROWEST * parent_std
