"""Tabulated quantile functions, and distributions whose log density is quadratic."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import MaxentDistribution, Mirrored, quadratic

_MAX_LOG_DROP = 745.0  # exp(-745) is the smallest positive float
_MAX_PANEL_DROP = 2.0  # change of the log density over a panel
_MAX_PANEL_BEND = 0.2  # panel width times the square root of the log density's curvature
_NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)  # nodes of a panel, from 0 to 1
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_POINTS = _NODES[:-1, None] + np.diff(_NODES)[:, None] * 0.5 * (1.0 + _GAUSS)
_CHUNK = 1 << 15  # draws per block; the panel data of a block fit into the processor's cache


#: Log density at offsets, up to a constant, and its first and second derivative.
LogDensity: TypeAlias = Callable[[Any], tuple[Any, Any, Any]]
_DEEPEST = 5.0  # greatest distance of the support from the parent's mean, in parent stds
_NARROWEST = 0.03  # least width of the support, in parent stds


class Piece:
    """A part of the support, divided into panels in which the log density is nearly linear.

    It reaches from offset 0 to `stop`, or to where the density underflows.

    Parameters
    ----------
    origin : float
        Origin of the offsets; at an end of the support, values near it keep full precision.
    scale : float
        Value per unit of offset.
    log_density : callable
        Log density at offsets, up to a constant common to all pieces, with two derivatives.
    stop : float
        Last offset; may be negative or infinite.
    widest : callable, optional
        Greatest width of a panel that starts at an offset.

    Attributes
    ----------
    edges : ndarray, shape (panels + 1,)
        Offsets of the panel edges, increasing.
    """

    def __init__(
        self,
        origin: float,
        scale: float,
        log_density: LogDensity,
        stop: float,
        widest: Callable[[float], float] = lambda offset: math.inf,
    ) -> None:
        self.origin, self.scale, self.log_density = origin, scale, log_density
        last, edges, drop = abs(stop), [0.0], 0.0
        while abs(edges[-1]) < last and drop < _MAX_LOG_DROP:
            _, slope, curvature = log_density(edges[-1])
            rate = abs(slope) / _MAX_PANEL_DROP + abs(curvature) ** 0.5 / _MAX_PANEL_BEND
            width = min(widest(edges[-1]), 1.0 / max(rate, 1e-300))
            edges.append(max(-last, min(edges[-1] + math.copysign(width, stop), last)))
            drop = log_density(0.0)[0] - log_density(edges[-1])[0]
        self.edges = np.sort(edges)


class InverseTable:
    """Quantile function of a piecewise density.

    The distance from the lower end of the support has a relative error below 1e-12 for gamma
    distributions and below 1e-10 for quadratic exponents, measured for probabilities from 1e-12 to
    1 - 1e-9. Within a panel the cumulative distribution is inverted as that of an exponential
    density which agrees with the density at the panel's edges, and then corrected by a polynomial.

    Parameters
    ----------
    pieces : sequence of Piece
        In increasing order; together they cover the support.

    Attributes
    ----------
    log_total : float
        Logarithm of the integral of the density over all pieces, in units of offset.
    mean, std : float
        Mean and standard deviation.
    above_pieces : ndarray, shape (pieces,)
        Probability above the upper end of each piece.
    """

    def __init__(self, pieces: list[Piece]) -> None:
        counts = [len(piece.edges) - 1 for piece in pieces]
        self._origin = np.repeat([piece.origin for piece in pieces], counts)
        self._scale = np.repeat([piece.scale for piece in pieces], counts)
        self._start = np.concatenate([piece.edges[:-1] for piece in pieces])
        self._width = np.concatenate([np.diff(piece.edges) for piece in pieces])
        logs = zip(*(_node_logs(piece) for piece in pieces), strict=True)
        at_nodes, within = (np.concatenate(parts) for parts in logs)
        top = float(within.max())
        peak = within.max(axis=(1, 2))
        local = np.exp(within - peak[:, None, None]) * (0.5 * _WEIGHTS) * np.diff(_NODES)[:, None]
        parts = local.sum(axis=2)
        masses = np.exp(peak - top) * parts.sum(axis=1) * self._width
        total = masses.sum()
        self.log_total = top + float(np.log(total))
        self._mass = masses / total
        self._below = np.concatenate([[0.0], np.cumsum(self._mass)])
        self._above = np.concatenate([np.cumsum(self._mass[::-1])[::-1], [0.0]])
        self.above_pieces = self._above[np.cumsum(counts)]
        self._rise = at_nodes[:, -1] - at_nodes[:, 0]
        self._rise[np.abs(self._rise) < 1e-8] = 1e-8  # a panel with constant density
        self._growth, self._decay = np.expm1(self._rise), np.expm1(-self._rise)
        self._coefficients = self._fit(parts)
        self.mean, self.std = self._moments(local, masses / total / parts.sum(axis=1))

    def _fit(self, parts: FloatArray) -> FloatArray:
        """Return the coefficients of the polynomial correction, shape (order, panels)."""
        share = np.cumsum(parts, axis=1)[:, :-1] / parts.sum(axis=1)[:, None]
        rest = np.cumsum(parts[:, ::-1], axis=1)[:, -2::-1] / parts.sum(axis=1)[:, None]
        place = _exponential_quantile(
            share, rest, self._rise[:, None], self._growth[:, None], self._decay[:, None]
        )
        correction: FloatArray = (_NODES[1:-1] - place) / (place * (1.0 - place))
        powers = (2.0 * place - 1.0)[:, :, None] ** np.arange(place.shape[1])
        solved = np.linalg.solve(powers, correction[:, :, None])[:, :, 0]
        return np.ascontiguousarray(solved.T, dtype=np.float64)

    def _moments(self, local: FloatArray, mass_per_part: FloatArray) -> tuple[float, float]:
        offsets = self._start[:, None, None] + self._width[:, None, None] * _POINTS
        weights = local * mass_per_part[:, None, None]
        first = self._origin[0]
        values = (self._origin - first)[:, None, None] + self._scale[:, None, None] * offsets
        mean = float((weights * values).sum())
        return first + mean, float(np.sqrt((weights * (values - mean) ** 2).sum()))

    def values(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        result = np.empty_like(below)
        for first in range(0, len(below), _CHUNK):
            part = slice(first, first + _CHUNK)
            result[part] = self._invert(below[part], above[part])
        return result

    def _invert(self, below: FloatArray, above: FloatArray) -> FloatArray:
        last = len(self._mass) - 1
        panel = np.searchsorted(self._below[1:-1], below, side="right")
        upper = below > 0.5
        # near the upper end, only the probability above has sufficient relative precision
        panel[upper] = last - np.searchsorted(self._above[-2:0:-1], above[upper], side="right")
        mass = np.maximum(self._mass[panel], 1e-300)
        part = np.where(upper, above - self._above[panel + 1], below - self._below[panel])
        part = np.clip(part / mass, 0.0, 1.0)
        share, rest = np.where(upper, 1.0 - part, part), np.where(upper, part, 1.0 - part)
        place = _exponential_quantile(
            share, rest, self._rise[panel], self._growth[panel], self._decay[panel]
        )
        centred = 2.0 * place - 1.0
        correction: FloatArray = self._coefficients[-1][panel]
        for coefficient in self._coefficients[-2::-1]:
            correction = correction * centred + coefficient[panel]
        place = place + place * (1.0 - place) * correction
        offset = self._start[panel] + self._width[panel] * place
        return np.asarray(self._origin[panel] + self._scale[panel] * offset)


def _exponential_quantile(
    below: FloatArray, above: FloatArray, rise: FloatArray, growth: FloatArray, decay: FloatArray
) -> FloatArray:
    """Return quantiles of densities proportional to exp(rise u) for u between 0 and 1.

    Parameters
    ----------
    below, above : ndarray
        Probabilities below and above the quantiles; their sum is 1.
    rise : ndarray
        Increase of the logarithm of the density from u = 0 to u = 1.
    growth, decay : ndarray
        ``expm1(rise)`` and ``expm1(-rise)``, which are the same for many quantiles.
    """
    lower = below < 0.5  # distances from the nearer end avoid cancellation
    distance: FloatArray = np.log1p(np.where(lower, below * growth, above * decay)) / rise
    return np.where(lower, distance, 1.0 + distance)


def _node_logs(piece: Piece) -> tuple[FloatArray, FloatArray]:
    """Return the log density at the panel nodes, and at Gauss points between adjacent nodes."""
    start, width = piece.edges[:-1, None], np.diff(piece.edges)[:, None]
    between = piece.log_density(start + width * _POINTS.ravel())[0]
    return piece.log_density(start + width * _NODES)[0], between.reshape(-1, *_POINTS.shape)


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
        above = exponent(-from_above, top)
        self._table = table = InverseTable(
            [
                Piece(low, scale, exponent(fall, 0.0), stop),
                *([Piece(high, scale, above, 0.5 * from_above / bend)] if from_above > 0.0 else []),
            ]
        )
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
    return QuadraticExponent(low, high, parent_std, (low - parent_mean) / parent_std, 0.5)


def has_parent(low: float, high: float, parent_mean: float, parent_std: float) -> bool:
    """Return whether closed forms are accurate on a support nearer above the parent's mean."""
    return low - parent_mean <= _DEEPEST * parent_std and high - low > _NARROWEST * parent_std
