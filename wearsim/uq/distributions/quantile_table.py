"""Quantiles of a law that is known by its density alone: its integral, inverted once and kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wearsim.types import FloatArray, IntArray

NOTHING_LEFT = 745.0  # exp(-745) is the least number there is
_MOST_DROP = 2.0  # of the log density over a panel
_MOST_BEND = 0.2  # panel's width times the root of the log density's curvature
_NODES = 0.5 - 0.5 * np.cos(np.pi * np.arange(9) / 8)  # of a panel, from 0 to 1
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_CHUNK = 1 << 15  # draws whose panels and coefficients stay in the processor's cache


@dataclass(frozen=True)
class Piece:
    """A part of the support, cut into panels over which the log density is nearly a line.

    Parameters
    ----------
    origin : float
        Where its offsets count from: an end of the support keeps every digit of values near it.
    scale : float
        Value per offset.
    edges : ndarray, shape (panels + 1,)
        Offsets of the panels' edges, rising.
    log_density : callable
        Log of the density at offsets, up to a constant that all pieces share.
    """

    origin: float
    scale: float
    edges: FloatArray
    log_density: Callable[[FloatArray], FloatArray]


def panel_edges(
    slope: Callable[[float], float],
    curvature: Callable[[float], float],
    drop: Callable[[float], float],
    stop: float,
    widest: Callable[[float], float] = lambda offset: float("inf"),
) -> FloatArray:
    """Return panel edges from offset 0 to `stop`, or to where nothing is left of the density.

    Parameters
    ----------
    slope, curvature : callable
        First and second derivative of the log density by offset.
    drop : callable
        How far the log density lies below its greatest value.
    stop : float
        Last offset, which may be infinite.
    widest : callable, optional
        Greatest width of a panel that begins at an offset.

    Returns
    -------
    ndarray, shape (panels + 1,)
    """
    edges = [0.0]
    while edges[-1] < stop and drop(edges[-1]) < NOTHING_LEFT:
        here = edges[-1]
        rate = abs(slope(here)) / _MOST_DROP + abs(curvature(here)) ** 0.5 / _MOST_BEND
        width = min(stop - here, widest(here), 1.0 / rate if rate > 0.0 else float("inf"))
        edges.append(stop if here + width >= stop else here + width)
    return np.array(edges)


class InverseTable:
    """The quantile function of a density in pieces, to about 1e-13.

    Within a panel, an exponential law that agrees with the density at the panel's edges inverts
    nearly all of the integral; a polynomial does the rest.

    Parameters
    ----------
    pieces : sequence of Piece
        In rising order, together the whole support.

    Attributes
    ----------
    log_total : float
        Log of the density's integral over all pieces, in offsets.
    mean, std : float
        Mean and standard deviation.
    """

    def __init__(self, pieces: list[Piece]) -> None:
        counts = [len(piece.edges) - 1 for piece in pieces]
        self._ends = np.cumsum(counts)
        self._origin = np.repeat([piece.origin for piece in pieces], counts)
        self._scale = np.repeat([piece.scale for piece in pieces], counts)
        self._start = np.concatenate([piece.edges[:-1] for piece in pieces])
        self._width = np.concatenate([np.diff(piece.edges) for piece in pieces])
        logs = [_node_logs(piece) for piece in pieces]
        top = max(float(log[1].max()) for log in logs)
        at_nodes = np.concatenate([log[0] for log in logs])
        within = np.concatenate([log[1] for log in logs])
        peak = within.max(axis=(1, 2))
        steps = np.diff(_NODES)
        local = np.exp(within - peak[:, None, None]) * (0.5 * _WEIGHTS) * steps[:, None]
        parts = local.sum(axis=2)
        masses = np.exp(peak - top) * parts.sum(axis=1) * self._width
        total = masses.sum()
        self.log_total = top + float(np.log(total))
        self._mass = masses / total
        self._below = np.concatenate([[0.0], np.cumsum(self._mass)])
        self._above = np.concatenate([np.cumsum(self._mass[::-1])[::-1], [0.0]])
        self._rise = at_nodes[:, -1] - at_nodes[:, 0]
        self._rise[np.abs(self._rise) < 1e-8] = 1e-8  # a flat panel
        self._growth, self._decay = np.expm1(self._rise), np.expm1(-self._rise)
        self._coefficients = self._fit(parts)
        self.mean, self.std = self._moments(local, masses / total / parts.sum(axis=1))

    def _fit(self, parts: FloatArray) -> FloatArray:
        """Return what the exponential law lacks: coefficients, shape (order, panels)."""
        share = np.cumsum(parts, axis=1)[:, :-1] / parts.sum(axis=1)[:, None]
        rest = np.cumsum(parts[:, ::-1], axis=1)[:, -2::-1] / parts.sum(axis=1)[:, None]
        place = _exponential_place(
            share, rest, self._rise[:, None], self._growth[:, None], self._decay[:, None]
        )
        lack: FloatArray = (_NODES[1:-1] - place) / (place * (1.0 - place))
        powers = (2.0 * place - 1.0)[:, :, None] ** np.arange(place.shape[1])
        solved = np.linalg.solve(powers, lack[:, :, None])[:, :, 0]
        return np.ascontiguousarray(solved.T, dtype=np.float64)

    def _moments(self, local: FloatArray, mass_per_part: FloatArray) -> tuple[float, float]:
        places = _NODES[:-1, None] + np.diff(_NODES)[:, None] * 0.5 * (1.0 + _GAUSS)
        offsets = self._start[:, None, None] + self._width[:, None, None] * places
        weights = local * mass_per_part[:, None, None]
        first = self._origin[0]
        values = (self._origin - first)[:, None, None] + self._scale[:, None, None] * offsets
        mean = float((weights * values).sum())
        return first + mean, float(np.sqrt((weights * (values - mean) ** 2).sum()))

    def above_piece(self, piece: int) -> float:
        """Return the probability above the upper end of a piece."""
        return float(self._above[self._ends[piece]])

    def values(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from probabilities below and above them."""
        result = np.empty_like(below)
        for first in range(0, len(below), _CHUNK):
            part = slice(first, first + _CHUNK)
            result[part] = self._invert(below[part], above[part])
        return result

    def _invert(self, below: FloatArray, above: FloatArray) -> FloatArray:
        last = len(self._mass) - 1
        panel = np.searchsorted(self._below[1:-1], below, side="right")
        upper = below > 0.5
        # near the upper end only the probability above tells panels and places apart
        panel[upper] = last - np.searchsorted(self._above[-2:0:-1], above[upper], side="right")
        return self._in_panel(panel, below, above)

    def _in_panel(self, panel: IntArray, below: FloatArray, above: FloatArray) -> FloatArray:
        from_below = below <= 0.5
        mass = np.maximum(self._mass[panel], 1e-300)
        part = np.where(from_below, below - self._below[panel], above - self._above[panel + 1])
        part = np.clip(part / mass, 0.0, 1.0)
        share, rest = np.where(from_below, part, 1.0 - part), np.where(from_below, 1.0 - part, part)
        place = _exponential_place(
            share, rest, self._rise[panel], self._growth[panel], self._decay[panel]
        )
        centred = 2.0 * place - 1.0
        lack: FloatArray = self._coefficients[-1][panel]
        for coefficient in self._coefficients[-2::-1]:
            lack = lack * centred + coefficient[panel]
        place = place + place * (1.0 - place) * lack
        offset = self._start[panel] + self._width[panel] * place
        values: FloatArray = self._origin[panel] + self._scale[panel] * offset
        return values


def _exponential_place(
    share: FloatArray, rest: FloatArray, rise: FloatArray, growth: FloatArray, decay: FloatArray
) -> FloatArray:
    """Return where an exponential law on (0, 1) has `share` of its mass below, `rest` above.

    Its log density rises by `rise`; `growth` and `decay` are expm1 of that and of its negative.
    """
    lower = share < 0.5  # each place is counted from the nearer end, which keeps its digits
    counted: FloatArray = np.log1p(np.where(lower, share * growth, rest * decay)) / rise
    return np.where(lower, counted, 1.0 + counted)


def _node_logs(piece: Piece) -> tuple[FloatArray, FloatArray]:
    """Return the log density at the panels' nodes, and at Gauss points between each two."""
    start, width = piece.edges[:-1, None], np.diff(piece.edges)[:, None]
    between = _NODES[:-1, None] + np.diff(_NODES)[:, None] * 0.5 * (1.0 + _GAUSS)
    points = start + width * between.ravel()
    shape = (len(start), *between.shape)
    return piece.log_density(start + width * _NODES), piece.log_density(points).reshape(shape)
