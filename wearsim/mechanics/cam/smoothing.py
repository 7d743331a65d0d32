"""Smoothing of a measured curve over a turn, such as a lift, by a periodic spline.

A quintic spline s is fitted by least squares with a penalty on its fourth derivative,
sum (y_i - s(theta_i))^2 + lambda int s''''^2, Eilers, Marx, Statistical Science 11 (1996),
DOI 10.1214/ss/1038425655. Lambda is that of the greatest restricted likelihood, in which the fourth
derivative is white noise and polynomials have no prior (Wahba, Annals of Statistics 13 (1985),
DOI 10.1214/aos/1176349743). On dwells the spline is constant; only its third and higher
derivatives jump at their ends.

The noise of a table is that of its differences: the divided differences of order 4, 6 and 8 of a
smooth curve vanish, while those of independent errors do not. Their median leaves out jumps of
derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wearsim.types import FloatArray

DEGREE = 5
_PENALTY = 4  # derivative that is small
_ORDERS = (4, 6, 8)  # of the differences that show noise
_MOST_KNOTS = 360
_FEWEST_KNOTS = 24
_LN_LAMBDA = np.linspace(-37.0, 19.0, 141)  # relative to the sizes of data and penalty
_SURE = 3.5  # standard errors of a derivative that is not zero
_SHRINKAGE = 0.5  # of a dwell at either end, in lengths that the spline resolves
_SHORTEST = 2.0  # dwell, in these lengths
_MIDDLE = 0.6745  # median of |x| of a standard normal x
_THROUGH = math.pi**2 / math.sqrt(5.0)  # scatter of s'' times spacing^2 over the noise of points
_QUADRATURE = np.polynomial.legendre.leggauss(DEGREE)
_SAMPLES = 1440  # of a turn


def estimated_noise(angle: FloatArray, values: FloatArray) -> float:
    """Return the standard deviation of the independent errors of a closed table.

    Parameters
    ----------
    angle, values : ndarray, shape (points,)
        Rising angles within a turn [rad], and values.
    """
    estimates = []
    for order in _ORDERS:
        around = np.append(angle, angle[:order] + math.tau)
        windows = np.lib.stride_tricks.sliding_window_view(around, order + 1)
        apart = (windows[:, :, None] - windows[:, None, :]) / np.ptp(windows, axis=1)[:, None, None]
        weight = 1.0 / np.where(np.eye(order + 1, dtype=bool), 1.0, apart).prod(axis=2)
        weight /= np.sqrt((weight**2).sum(axis=1, keepdims=True))
        near = np.lib.stride_tricks.sliding_window_view(
            np.append(values, values[:order]), order + 1
        )
        difference = np.abs((weight * (near - near[:, :1])).sum(axis=1))
        known = difference[difference > 0.0]  # rounded tables do not move on their dwells
        estimates.append(float(np.median(known)) / _MIDDLE if len(known) else 0.0)
    return min(estimates)


def scatter_through_points(angle: FloatArray, noise: float) -> float:
    """Return the scatter of the second derivative of a spline through points with errors.

    Parameters
    ----------
    angle : ndarray, shape (points,)
        Within a turn [rad].
    noise : float
        Standard deviation of the errors; the result is in its unit per rad^2.
    """
    return _THROUGH * noise * (len(angle) / math.tau) ** 2


@dataclass(frozen=True, eq=False)
class SmoothedCurve:
    """Closed smoothing spline of a table over a turn.

    Parameters
    ----------
    knots : ndarray, shape (coefficients,)
        Of one period, rising; the ends of dwells are triple [rad].
    coefficients : ndarray, shape (coefficients,)
    noise : float
        Standard deviation of the errors of the table.
    angle, residual : ndarray, shape (points,)
        Points of the table, and its values less those of the spline.
    second_error : float
        Root mean square over the turn of the standard error of the second derivative.
    dwells : tuple of tuple of float
        Start and end of each dwell [rad], the start within a turn.
    factor : ndarray, shape (coefficients, free coefficients)
        Of the covariance of the coefficients.
    """

    knots: FloatArray
    coefficients: FloatArray
    noise: float
    angle: FloatArray
    residual: FloatArray
    second_error: float
    dwells: tuple[tuple[float, float], ...]
    factor: FloatArray

    def __call__(self, angle: FloatArray, coefficients: FloatArray | None = None) -> FloatArray:
        """Return values and two derivatives at angles [rad], shape (3, points)."""
        from scipy.interpolate import BSpline  # noqa: PLC0415  (slow to import)

        chosen = self.coefficients if coefficients is None else coefficients
        knots = _extended(self.knots)
        spline = BSpline(
            knots, np.take(chosen, range(len(knots) - DEGREE - 1), mode="wrap"), DEGREE
        )
        place = _within(self.knots, np.asarray(angle))
        return np.stack([spline(place, nu=order) for order in range(3)])

    def drawn(self, seed: int) -> FloatArray:
        """Return coefficients that the errors of the table allow, drawn at random."""
        normal = np.random.default_rng(seed).standard_normal(self.factor.shape[1])
        return self.coefficients + self.factor @ normal

    @property
    def arcs(self) -> list[tuple[float, float]]:
        """Start and end of each part between two dwells; the whole turn without any."""
        return _between(self.dwells) if self.dwells else []


def smoothed(
    angle: FloatArray, values: FloatArray, noise: float | None = None, *, dwells: bool = True
) -> SmoothedCurve:
    """Return the smoothing spline of a closed table.

    Parameters
    ----------
    angle, values : ndarray, shape (points,)
        Angles within a turn [rad], and values.
    noise : float, optional
        Standard deviation of the errors, estimated by default.
    dwells : bool
        Whether to look for dwells, on which the spline is constant.
    """
    count = min(int(np.clip(len(angle) // 2, _FEWEST_KNOTS, _MOST_KNOTS)), len(angle))
    spacing = math.tau / count
    first, freedom = _fitted(angle, values, angle[0] + spacing * np.arange(count), (), noise)
    found = _dwells(first, freedom, values) if dwells else ()
    return _fitted(angle, values, _knots(found, spacing), found, noise)[0] if found else first


def _around() -> FloatArray:
    """Return equally spaced angles of a turn [rad]."""
    return np.linspace(0.0, math.tau, _SAMPLES, endpoint=False)


def _extended(knots: FloatArray) -> FloatArray:
    """Return the knots of a period with those of its neighbours that it needs."""
    after = np.concatenate([knots, knots + math.tau])[: len(knots) + DEGREE + 1]
    return np.concatenate([knots[-DEGREE:] - math.tau, after])


def _within(knots: FloatArray, angle: FloatArray) -> FloatArray:
    return np.asarray(np.mod(angle - knots[0], math.tau) + knots[0])


def _basis(knots: FloatArray, angle: FloatArray, order: int) -> FloatArray:
    """Return a derivative of the periodic B-splines at angles, shape (angles, knots)."""
    from scipy.interpolate import BSpline  # noqa: PLC0415  (slow to import)

    unit_vectors = np.eye(len(knots))[np.arange(len(knots) + DEGREE) % len(knots)]
    spline = BSpline(_extended(knots), unit_vectors, DEGREE)
    return np.asarray(spline(_within(knots, angle), nu=order))


def _between(dwells: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return start and end of the parts between dwells."""
    following = [*dwells[1:], (dwells[0][0] + math.tau, 0.0)]
    return [(before[1], after[0]) for before, after in zip(dwells, following, strict=True)]


def _knots(dwells: Sequence[tuple[float, float]], spacing: float) -> FloatArray:
    """Return knots of the parts between dwells, triple at their ends."""
    knots: list[float] = []
    for start, stop in _between(dwells):
        inner = np.linspace(start, stop, max(2, round((stop - start) / spacing)) + 1)[1:-1]
        knots += [start] * 3 + inner.tolist() + [stop] * 3
    return np.sort(np.mod(knots, math.tau))


def _fitted(
    angle: FloatArray,
    values: FloatArray,
    knots: FloatArray,
    dwells: Sequence[tuple[float, float]],
    noise: float | None,
) -> tuple[SmoothedCurve, float]:
    """Return the spline with the greatest restricted likelihood, and its degrees of freedom."""
    from scipy.interpolate import BSpline  # noqa: PLC0415  (slow to import)
    from scipy.linalg import eigh  # noqa: PLC0415

    count, tied = len(knots), _tied(knots, dwells)
    fold = np.eye(count)[np.arange(count + DEGREE) % count] @ tied
    local = BSpline.design_matrix(_within(knots, angle), _extended(knots), DEGREE)
    design: FloatArray = np.asarray(local @ fold)
    edges = np.unique(np.append(knots, knots[0] + math.tau))
    half = 0.5 * np.diff(edges)[:, None]
    places = (0.5 * (edges[1:] + edges[:-1])[:, None] + half * _QUADRATURE[0]).ravel()
    rough = _basis(knots, places, _PENALTY) @ tied
    penalty = (rough * (half * _QUADRATURE[1]).ravel()[:, None]).T @ rough
    gram = design.T @ design
    penalty *= np.trace(gram) / np.trace(penalty)
    # both matrices are diagonal in the same vectors: part of the penalty, and of the data
    part, vectors = eigh(penalty, gram + penalty)
    part = np.where(part < 1e-12, 0.0, np.minimum(part, 1.0))
    middle = float(values.mean())
    centred = values - middle
    moment = vectors.T @ (design.T @ centred)
    diagonal = (1.0 - part) + np.exp(_LN_LAMBDA)[:, None] * part
    # the sum of squares and the penalty together
    squares = np.maximum(centred @ centred - (moment**2 / diagonal).sum(axis=1), 1e-300)
    curved = np.count_nonzero(part)
    spread = np.log(diagonal).sum(axis=1) - curved * _LN_LAMBDA
    misfit = (
        (len(centred) - len(part) + curved) * np.log(squares)
        if noise is None
        else squares / noise**2
    )
    best = int((misfit + spread).argmin())
    free = moment / diagonal[best]
    freedom = float(((1.0 - part) / diagonal[best]).sum())
    residual = centred - design @ (vectors @ free)
    deviation = float(np.sqrt(residual @ residual / max(len(centred) - freedom, 1.0)))
    factor = deviation * (tied @ (vectors / np.sqrt(diagonal[best])))
    coefficients = tied @ (vectors @ free) + middle
    error = float(np.sqrt(((_basis(knots, _around(), 2) @ factor) ** 2).sum(axis=1).mean()))
    curve = SmoothedCurve(
        knots, coefficients, deviation, angle, residual, error, tuple(dwells), factor
    )
    return curve, freedom


def _tied(knots: FloatArray, dwells: Sequence[tuple[float, float]]) -> FloatArray:
    """Return the coefficients by the free ones: those of a dwell are equal."""
    free = np.eye(len(knots))
    for start, stop in dwells:
        used = _basis(knots, np.array([0.5 * (start + stop)]), 0)[0] > 0.0
        first = int(np.flatnonzero(used)[0])
        free[used] = 0.0
        free[used, first] = 1.0
    return free[:, free.any(axis=0)]


def _dwells(
    curve: SmoothedCurve, freedom: float, values: FloatArray
) -> tuple[tuple[float, float], ...]:
    """Return the dwells: where slope and acceleration are zero within their errors.

    A dwell that is too long would bend the curve beside it, so that its ends are moved inwards.
    """
    along, length = _around(), math.tau / freedom
    derivatives = curve(along)
    still = np.ones(_SAMPLES, dtype=np.bool_)
    for order in (1, 2):
        rows = _basis(curve.knots, along, order) @ curve.factor
        standard_errors = np.sqrt((rows**2).sum(axis=1))
        still &= np.abs(derivatives[order]) < _SURE * standard_errors
    if still.all():
        return ()
    turned = int(np.flatnonzero(~still)[0])  # an angle of motion, from which the runs are counted
    changes = np.flatnonzero(np.diff(np.roll(still, -turned).astype(np.int8), append=0)) + 1
    dwells = []
    for start, stop in changes.reshape(-1, 2).tolist():
        low, high = (along[1] * (turned + place) for place in (start, stop - 1))
        low, high = low + _SHRINKAGE * length, high - _SHRINKAGE * length
        inside = np.mod(curve.angle - low, math.tau) <= high - low
        if high - low < _SHORTEST * length or inside.sum() < DEGREE:
            continue
        scatter = float(values[inside].var(ddof=1))
        if scatter < curve.noise**2 * (1.0 + 4.0 * math.sqrt(2.0 / inside.sum())):
            dwells.append((low % math.tau, low % math.tau + high - low))
    return tuple(sorted(dwells))
