"""Likelihood of the wear factor by one trace, for each draw of the other inputs.

A trace is z(y) = c0 + c1 y + c2 y^2 + h(y - s) - u(y - s; ln K) + noise, where u is the worn depth
and h the height before wear. Offset c0, inclination c1 and, if it is asked for, curvature c2 have
flat priors and are integrated in closed form, as is the variance of the noise; its correlation
length and white part are integrated on a grid. ln K and the lateral shift s are integrated on a
lattice, which is centred and scaled by the moments of the integrand itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wearsim.mechanics.numerics.gaussian_processes import squared_residuals
from wearsim.studies.identify.trajectories import Grown
from wearsim.types import FloatArray, IntArray
from wearsim.uq.hierarchy.noise import Noise, NoiseModels, noise_models

_STARTS = 9  # values of ln K from which the maximum is sought
_ITERATIONS = 8
# in standard deviations; the trapezoidal rule on a normal density errs by less than 1e-3
_LATTICE = np.array([[1.2 * a, 1.6 * b] for a in range(-3, 4) for b in range(-2, 3)])
_ROUNDS = 8  # of centring the lattice
_FIRST = 4.0  # variance of the first lattice over the one at the maximum, which has kinks beside it
_COARSE = 0.05  # part of its variance by which a lattice is wider than the moments on it
_UNFIT, _OFF = 0.35, 0.3  # of ln variance and of the mean, in standard deviations
_VALUES = 3_000_000  # of an array
_DROPPED = 80.0  # of chi2 above the best draw
_REACH = 4.0  # standard deviations of a measured depth that are integrated to either side
_DEPTHS = 161
_LONGEST = np.array([0.4, 1e-3])  # greatest change of ln K and shift in one iteration


@dataclass(frozen=True)
class TraceLikelihood:
    """Likelihood of a trace.

    Parameters
    ----------
    y, height : ndarray, shape (points,)
        Rising positions and heights, positive up [m].
    noise : Noise
    grown : Grown
        Worn profiles at the passes of the trace.
    body : str
        "cylinder" or "roller".
    lateral : bool
        Whether the lateral position of the trace is unknown.
    start : bool
        Whether the model includes the height of the cylinder before wear; false for a difference
        of traces.
    curvature : bool
        Whether a curvature of the trace is unknown, as offset and inclination are.
    least : float
        Least standard deviation of the noise, known from elsewhere [m].
    """

    y: FloatArray
    height: FloatArray
    noise: Noise
    grown: Grown
    body: str = "cylinder"
    lateral: bool = True
    start: bool = True
    curvature: bool = False
    least: float = 0.0

    @cached_property
    def _centroid(self) -> FloatArray:
        """Centroid of each worn profile, shape (draws, records) [m]."""
        depth = np.maximum(self.grown.depth[self.body], 0.0)
        return np.asarray(
            (depth * self.grown.y).sum(axis=2) / np.maximum(depth.sum(axis=2), 1e-300)
        )

    @cached_property
    def forms(self) -> FloatArray:
        """Offset, inclination and perhaps curvature of the trace, shape (points, forms)."""
        return np.vander(
            2.0 * (self.y - self.y.mean()) / np.ptp(self.y), 3 if self.curvature else 2, True
        )

    @cached_property
    def _lines(self) -> FloatArray:
        """Orthonormal whitened forms, shape (points, forms)."""
        return np.linalg.qr(self.noise.whitened(self.y, self.forms))[0]

    def records(self, draw: IntArray, ln_k: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the number of the record below each ln K, and the part of the way to the next."""
        known = self.grown.ln_k[draw]
        last = known.shape[1] - 1
        record = np.clip((known <= ln_k[:, None]).sum(axis=1) - 1, 0, max(last - 1, 0))
        columns = np.arange(len(draw))
        low = known[columns, record]
        high = known[columns, np.minimum(record + 1, last)]
        return record, np.clip((ln_k - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)

    def worn(self, draw: IntArray, ln_k: FloatArray, shift: FloatArray) -> FloatArray:
        """Return worn depth less start height, shape (points, columns) [m].

        Between two records each is scaled as a groove of constant curvature: K/H times s^3 makes it
        s times wider and s^2 times deeper, which is exact for rigid bodies in full slip.

        Parameters
        ----------
        draw : ndarray of int, shape (columns,)
        ln_k, shift : ndarray, shape (columns,)
        """
        grown = self.grown
        record, part = self.records(draw, ln_k)
        total, last = np.zeros((len(self.y), len(draw))), grown.ln_k.shape[1] - 1
        for step, weight in ((0, 1.0 - part), (1, part)):
            place = np.minimum(record + step, last)
            stretch = np.exp((ln_k - grown.ln_k[draw, place]) / 3.0)
            centre = self._centroid[draw, place]
            position = (self.y[:, None] - shift - centre) / stretch + centre
            total += (weight * stretch**2) * _interpolated(
                position, grown.y, self.grown.depth[self.body][draw, place]
            )
        if self.start and grown.start.any():
            total -= np.interp(self.y[:, None] - shift, grown.y, grown.start)
        return total

    def residual(self, draw: IntArray, ln_k: FloatArray, shift: FloatArray) -> FloatArray:
        """Return whitened residuals without offset and inclination, shape (points, columns)."""
        white = self.noise.whitened(self.y, self.height[:, None] + self.worn(draw, ln_k, shift))
        return np.asarray(white - self._lines @ (self._lines.T @ white))

    def chi2(self, draw: IntArray, ln_k: FloatArray, shift: FloatArray) -> FloatArray:
        """Return the sum of squared residuals, shape (columns,)."""

        def squares(some: slice) -> FloatArray:
            return np.asarray((self.residual(draw[some], ln_k[some], shift[some]) ** 2).sum(axis=0))

        return self._by_blocks(len(draw), squares)

    def _by_blocks(self, count: int, values: Callable[[slice], FloatArray]) -> FloatArray:
        """Return the values of columns, computed for as many at once as memory is meant to hold."""
        block = max(_VALUES // len(self.y), 1)
        return np.concatenate(
            [values(slice(start, start + block)) for start in range(0, count, block)]
        )

    def deviance(
        self, models: NoiseModels, draw: IntArray, ln_k: FloatArray, shift: FloatArray
    ) -> FloatArray:
        """Return -2 times the log likelihood, the noise integrated, shape (columns,)."""
        filters = models.decay, models.gain, models.scale, models.lines

        def deviances(some: slice) -> FloatArray:
            sum_ = self.height[:, None] + self.worn(draw[some], ln_k[some], shift[some])
            squares = squared_residuals(np.ascontiguousarray(sum_.T), *filters)
            score = models.log_weight[:, None] - models.exponent[:, None] * np.log(squares)
            top = score.max(axis=0)
            return np.asarray(-2.0 * (top + np.log(np.exp(score - top).sum(axis=0))))

        return self._by_blocks(len(draw), deviances)

    def _start(self) -> tuple[FloatArray, FloatArray]:
        """Return ln K and shift from which the maximum is sought, for each draw."""
        draws = np.arange(len(self.grown.ln_k))
        ends = self.grown.ln_k[:, [0, -1]]
        below = self.height.max() - self.height
        weight = np.maximum(below - 0.5 * below.max(), 0.0)
        centre = float((weight * self.y).sum() / weight.sum())
        shift = centre - self._centroid.mean(axis=1) if self.lateral else np.zeros(len(draws))
        tried = np.linspace(ends[:, 0], ends[:, 1], _STARTS, axis=1)
        owner = np.repeat(draws, _STARTS)
        values = self.chi2(owner, tried.ravel(), shift[owner]).reshape(tried.shape)
        return tried[draws, values.argmin(axis=1)], shift

    def maximum(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the maximum for each draw by the Gauss-Newton method.

        Returns
        -------
        position : ndarray, shape (draws, 2)
            ln K and shift.
        covariance : ndarray, shape (draws, 2, 2)
        chi2 : ndarray, shape (draws,)
        """
        ln_k, shift = self._start()
        position = np.column_stack([ln_k, shift])
        draws, count = np.arange(len(ln_k)), len(self.y)
        small = np.array([1e-2, 1e-5])
        damping = np.full(len(draws), 1e-3)
        chi2 = self.chi2(draws, *position.T)
        normal = np.zeros((len(draws), 2, 2))
        block = max(_VALUES // (3 * count), 1)
        for _ in range(_ITERATIONS):
            gradient = np.zeros((len(draws), 2))
            for start in range(0, len(draws), block):
                some = draws[start : start + block]
                moves = np.array([[0.0, 0.0], [small[0], 0.0], [0.0, small[1]]])
                tried = (moves[:, None] + position[some]).reshape(-1, 2)
                residuals = self.residual(np.tile(some, 3), *tried.T).reshape(count, 3, -1)
                base = residuals[:, 0]
                # derivatives, shape (2, points, columns)
                slope = (residuals[:, 1:] - base[:, None]).transpose(1, 0, 2) / small[:, None, None]
                normal[some] = np.einsum("apc,bpc->cab", slope, slope)
                gradient[some] = np.einsum("apc,pc->ca", slope, base)
            if not self.lateral:
                normal[:, 0, 1] = normal[:, 1, 0] = gradient[:, 1] = 0.0
                normal[:, 1, 1] = 1.0
            diagonal = np.einsum("caa->ca", normal)
            damped = normal + (damping[:, None] * diagonal)[:, :, None] * np.eye(2)
            step = -np.linalg.solve(damped, gradient[..., None])[..., 0]
            step = np.clip(step, -_LONGEST, _LONGEST)
            new = self.chi2(draws, *(position + step).T)
            better = new <= chi2
            change = np.where(better, chi2 - new, 0.0)
            position[better] += step[better]
            chi2 = np.where(better, new, chi2)
            damping = np.where(better, 0.2 * damping, 10.0 * damping)
            if (better & (change < 1e-2)).all():
                break
        return position, np.asarray(np.linalg.inv(normal)), chi2

    def integrated(self) -> DrawLikelihood:
        """Return evidence, mean and standard deviation of ln K for each draw."""
        centre, covariance, chi2 = self.maximum()
        first = np.array([int(chi2.argmin())])
        residual = self.height + self.worn(first, *centre[first].T)[:, 0]
        models = noise_models(self.y, residual, self.forms, self.least)
        best = float(self.deviance(models, first, *centre[first].T)[0])
        lattice = _LATTICE if self.lateral else _LATTICE[np.abs(_LATTICE[:, 1]) < 0.1]
        log_evidence = np.full(len(centre), -np.inf)
        place, spread = centre.copy(), np.sqrt(covariance[:, 0, 0])
        covariance *= _FIRST
        pending = np.flatnonzero(chi2 < chi2.min() + _DROPPED)
        for _ in range(_ROUNDS):
            root = np.linalg.cholesky(covariance[pending])
            if not self.lateral:
                root[:, 1] = 0.0
            points = centre[pending][:, None] + lattice @ root.transpose(0, 2, 1)
            owner = np.repeat(pending, len(lattice))
            values = self.deviance(models, owner, *points.reshape(-1, 2).T).reshape(
                len(pending), -1
            )
            least = values.min(axis=1)
            weight = np.exp(-0.5 * (values - least[:, None]))
            total = weight.sum(axis=1)
            mean = np.einsum("cp,cpa->ca", weight, points) / total[:, None]
            away = points - mean[:, None]
            second = np.einsum("cp,cpa,cpb->cab", weight, away, away) / total[:, None, None]
            if not self.lateral:
                second[:, 1, 1] = 1.0
            area = root[:, 0, 0] * (root[:, 1, 1] if self.lateral else 1.0)
            log_evidence[pending] = np.log(total * area) - 0.5 * (least - best)
            place[pending], spread[pending] = mean, np.sqrt(second[:, 0, 0])
            unfit = np.abs(np.log(second[:, 0, 0] / covariance[pending, 0, 0]))
            off = np.abs(mean[:, 0] - centre[pending, 0]) / np.sqrt(covariance[pending, 0, 0])
            # few points of a lattice that is too coarse have weight
            centre[pending] = mean
            covariance[pending] = second + _COARSE * covariance[pending]
            pending = pending[(unfit > _UNFIT) | (off > _OFF)]
            if not len(pending):
                break
        return DrawLikelihood(log_evidence, place[:, 0], spread, place[:, 1], chi2)


@dataclass(frozen=True)
class DrawLikelihood:
    """Likelihood of ln K for each draw, as a normal density times an evidence; shape (draws,).

    Parameters
    ----------
    log_evidence : ndarray
        Minus infinity where the draw is far from the trace.
    mean, std : ndarray
        Of ln K.
    shift : ndarray
        Lateral shift [m]; zeros for a measured depth.
    chi2 : ndarray
        Least sum of squares.
    """

    log_evidence: FloatArray
    mean: FloatArray
    std: FloatArray
    shift: FloatArray
    chi2: FloatArray

    def times(self, other: DrawLikelihood) -> DrawLikelihood:
        """Return the product with the likelihood of another trace of the same test."""
        variance = self.std**2 + other.std**2
        evidence = -0.5 * (self.mean - other.mean) ** 2 / variance - 0.5 * np.log(variance)
        precision = self.std**-2 + other.std**-2
        mean = (self.mean * self.std**-2 + other.mean * other.std**-2) / precision
        return DrawLikelihood(
            self.log_evidence + other.log_evidence + evidence,
            mean,
            precision**-0.5,
            other.shift,
            self.chi2 + other.chi2,
        )


def depth_range(depth: float, std: float) -> tuple[float, float]:
    """Return the least and the greatest depth that a measured depth leaves possible [m]."""
    return max(depth - _REACH * std, 0.1 * depth), depth + _REACH * std


def depth_likelihood(depth: float, std: float, grown: Grown, body: str) -> DrawLikelihood:
    """Return the likelihood of a measured depth for each draw.

    The error of the depth is normal, which ln K is not where the error is a large part of the
    depth: its mean and standard deviation are those of the likelihood.

    Parameters
    ----------
    depth, std : float
        Greatest depth, and its standard deviation [m].
    grown : Grown
    body : str
        "cylinder" or "roller".
    """
    greatest = np.log(np.maximum(grown.depth[body].max(axis=2), 1e-12))
    away = np.linspace(-_REACH, _REACH, _DEPTHS)
    tried = np.log(np.maximum(depth + std * away, 1e-12))
    evidence, mean, spread = np.empty((3, len(greatest)))
    for draw, (ln_depth, ln_k) in enumerate(zip(greatest, grown.ln_k, strict=True)):
        values = np.interp(tried, ln_depth, ln_k)
        # equal steps of depth, and a flat prior of ln K
        weight = np.exp(-0.5 * away**2) * np.gradient(values, away)
        evidence[draw] = weight.sum()
        if not evidence[draw] > 0.0:  # no K/H wears to this depth
            evidence[draw], mean[draw], spread[draw] = 0.0, ln_k[-1], 1.0
            continue
        mean[draw] = np.average(values, weights=weight)
        spread[draw] = np.sqrt(np.average((values - mean[draw]) ** 2, weights=weight))
    zero = np.zeros_like(mean)
    with np.errstate(divide="ignore"):
        return DrawLikelihood(np.log(evidence), mean, spread, zero, zero)


def _interpolated(position: FloatArray, y: FloatArray, rows: FloatArray) -> FloatArray:
    """Return rows on equally spaced strips at positions, shape (points, rows); 0 outside."""
    count = len(y)
    place = (position - y[0]) * ((count - 1) / (y[-1] - y[0]))
    inside = (place >= 0.0) & (place <= count - 1)
    first = np.clip(place, 0.0, count - 1.001).astype(np.int64)
    part = place - first
    flat, offset = np.ascontiguousarray(rows).ravel(), count * np.arange(len(rows))
    index = first + offset
    value = flat[index]
    return np.asarray(np.where(inside, value + part * (flat[index + 1] - value), 0.0))
