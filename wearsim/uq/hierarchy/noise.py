"""Noise of measured traces: exponential covariance and white noise, whitened in O(n).

The noise of a trace is the sum of a stationary process with the covariance
sigma^2 exp(-|y - y'|/l) and of independent errors of standard deviation w. The process is a Markov
chain along the trace, so that a Kalman filter turns a trace into independent standard normal
numbers in one sweep, for any spacing of the points (Rybicki and Press, Phys. Rev. Lett. 74 (1995),
DOI 10.1103/PhysRevLett.74.1060; Hartikainen and Sarkka, DOI 10.1109/MLSP.2010.5589113).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wearsim.types import FloatArray

_WHITE = np.array([0.0, 0.01, 0.03, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 0.99])
_LENGTHS = 14
_ROUNDS = 2  # the grid, and a finer one
_MODELS = (8, 5)  # lengths and white parts over which a likelihood is integrated
_NEGLIGIBLE = 6.0  # below the greatest log likelihood
MOST_POINTS = 700  # of a trace; others are left out or averaged


@dataclass(frozen=True)
class Noise:
    """Noise with exponential covariance, and white noise.

    Parameters
    ----------
    sigma : float
        Standard deviation of the correlated part [m].
    length : float
        Its correlation length [m].
    white : float
        Standard deviation of the independent part [m].
    """

    sigma: float
    length: float
    white: float

    @property
    def std(self) -> float:
        """Standard deviation of a point [m]."""
        return float(np.hypot(self.sigma, self.white))

    def filter(self, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the coefficients of the Kalman filter that whitens a trace.

        Parameters
        ----------
        y : ndarray, shape (points,)
            Rising positions [m].

        Returns
        -------
        decay, gain, scale : ndarray, shape (points,)
            Correlation with the next point; share of the error by which the prediction of the
            process is corrected; inverse standard deviation of the error.
        """
        decay = np.exp(-np.diff(y, append=y[-1]) / self.length)
        variance, gains, scales = self.sigma**2, [], []
        for factor in decay.tolist():
            total = variance + self.white**2
            gain = variance / total
            gains.append(gain)
            scales.append(total**-0.5)
            variance = factor**2 * variance * (1.0 - gain) + self.sigma**2 * (1.0 - factor**2)
        return decay, np.array(gains), np.array(scales)

    def whitened(self, y: FloatArray, columns: FloatArray) -> FloatArray:
        """Return columns whose noise is independent with unit variance.

        Parameters
        ----------
        y : ndarray, shape (points,)
            Rising positions [m].
        columns : ndarray, shape (points, columns)
            Heights [m], or anything that adds to them.
        """
        found, mean = np.empty_like(columns), np.zeros(columns.shape[1])
        for j, (factor, gain, scale) in enumerate(zip(*self.filter(y), strict=True)):
            error = columns[j] - mean
            np.multiply(error, scale, out=found[j])
            error *= gain * factor
            mean *= factor
            mean += error
        return found

    def sample(self, y: FloatArray, normal: FloatArray) -> FloatArray:
        """Return noise made from independent standard normal numbers.

        Parameters
        ----------
        y : ndarray, shape (points,)
        normal : ndarray, shape (2, points, ...)

        Returns
        -------
        ndarray, shape (points, ...)
        """
        decay = np.exp(-np.diff(y, prepend=y[0]) / self.length)
        found = np.empty_like(normal[0])
        value = normal[0, 0]
        for j, factor in enumerate(decay):
            if j:
                value = factor * value + np.sqrt(1.0 - factor * factor) * normal[0, j]
            found[j] = value
        return np.asarray(self.sigma * found + self.white * normal[1])


def _filtered(
    y: FloatArray, columns: FloatArray, power: FloatArray, length: FloatArray, white: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return whitened columns and the log determinants of several noise models.

    Parameters
    ----------
    y : ndarray, shape (points,)
    columns : ndarray, shape (points, 1 or models, columns)
    power, length, white : ndarray, shape (models,)
        Variance of the process, its length, variance of the white noise.
    """
    decay = np.exp(-np.diff(y, append=y[-1])[:, None] / length)
    found = np.empty((len(y), len(power), columns.shape[2]))
    mean, variance = np.zeros_like(found[0]), power.copy()
    log_determinant = np.zeros(len(power))
    for j, factor in enumerate(decay):
        total = variance + white
        error = columns[j] - mean
        found[j] = error * (1.0 / np.sqrt(total))[:, None]
        gain = variance / total
        mean += gain[:, None] * error
        mean *= factor[:, None]
        log_determinant += np.log(total)
        variance = factor**2 * variance * (1.0 - gain) + power * (1.0 - factor**2)
    return found, log_determinant


@dataclass(frozen=True)
class NoiseModels:
    """Noise models of a trace with unit variance, and what they give to its likelihood.

    The variance is unknown, with a prior uniform in its logarithm, and is integrated in closed
    form: of a model with the sum S of squared residuals the likelihood is
    ``exp(log_weight) * S ** (-exponent)``.

    Parameters
    ----------
    length : ndarray, shape (models,)
        Correlation length of the process [m].
    white : ndarray, shape (models,)
        Share of the variance that is independent from point to point.
    decay, gain, scale : ndarray, shape (points, models)
        Coefficients of the filter that whitens a trace.
    lines : ndarray, shape (lines, points, models)
        Orthonormal whitened offset, inclination and other forms of the trace.
    log_weight, exponent : ndarray, shape (models,)
    """

    length: FloatArray
    white: FloatArray
    decay: FloatArray
    gain: FloatArray
    scale: FloatArray
    lines: FloatArray
    log_weight: FloatArray
    exponent: FloatArray

    def noise(self, place: int) -> Noise:
        """Return one of the models, with unit variance."""
        return unit_noise(self.length[place], self.white[place])


def unit_noise(length: float, white: float) -> Noise:
    """Return noise of unit variance, of which a share is white."""
    return Noise(float(np.sqrt(1.0 - white)), float(length), float(np.sqrt(white)))


def noise_models(
    y: FloatArray, residual: FloatArray, forms: FloatArray, least: float = 0.0
) -> NoiseModels:
    """Return noise models over which the likelihood of a trace is integrated.

    The correlation length has a uniform prior up to half of the trace, and the white share too. (A
    prior uniform in the logarithm of the length gives lengths that are a quarter too small on
    average where a trace has 16 of them.) The models form a grid over those that residuals do not
    exclude.

    Parameters
    ----------
    y, residual : ndarray, shape (points,)
        Rising positions, and heights less the best profile [m].
    forms : ndarray, shape (points, forms)
        Offset, inclination and other forms of unknown size.
    least : float
        Least standard deviation of the noise, known from elsewhere [m].
    """
    columns = np.column_stack([residual, forms])[:, None, :]
    lengths, whites = _first_grid(y), _WHITE
    for count in (0, 1):
        length, white = (grid.ravel() for grid in np.meshgrid(lengths, whites))
        score, variance = _restricted(y, columns, length, white)
        if count == 0:
            lengths, whites = _finer(lengths, whites, score, 6.0, _MODELS)
    kept = score > score.max() - _NEGLIGIBLE
    length, white, variance = length[kept], white[kept], variance[kept]
    noises = [unit_noise(*pair) for pair in zip(length, white, strict=True)]
    filters = zip(*(noise.filter(y) for noise in noises), strict=True)
    decay, gain, scale = (np.stack(parts, axis=1) for parts in filters)
    lines, log_weight = np.empty((forms.shape[1], *decay.shape)), np.empty(len(length))
    freedom = len(y) - forms.shape[1]
    for place, noise in enumerate(noises):
        whitened, triangle = np.linalg.qr(noise.whitened(y, forms))
        lines[:, :, place] = whitened.T
        log_weight[place] = -np.log(np.abs(np.diag(triangle))).sum()
    # the grid is one of the logarithm of the length
    log_weight += np.log(scale).sum(axis=0) + np.log(length)
    # a variance that is greater by a factor divides the logarithm of the likelihood by it
    known = np.maximum(1.0, least**2 / variance)
    exponent = 0.5 * freedom / known
    log_weight += (exponent - 0.5 * freedom) * np.log(freedom * variance)
    return NoiseModels(length, white, decay, gain, scale, lines, log_weight, exponent)


def _first_grid(y: FloatArray) -> FloatArray:
    """Return correlation lengths from less than the spacing to half of the longest part."""
    spacing = float(np.median(np.diff(y)))
    parts = np.split(y, np.flatnonzero(np.diff(y) > 20.0 * spacing) + 1)
    span = max(float(np.ptp(part)) for part in parts)
    return np.geomspace(0.3 * spacing, max(0.5 * span, spacing), _LENGTHS)


def _restricted(
    y: FloatArray, columns: FloatArray, length: FloatArray, white: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the restricted log likelihood of noise models, and the variance of each.

    Parameters
    ----------
    y : ndarray, shape (points,)
    columns : ndarray, shape (points, 1, 1 + forms)
        Heights, and forms of unknown size.
    length, white : ndarray, shape (models,)
    """
    whitened, log_determinant = _filtered(y, columns, 1.0 - white, length, white)
    z, lines = whitened[:, :, 0], whitened[:, :, 1:]
    normal = np.einsum("jpa,jpb->pab", lines, lines)
    right = np.einsum("jpa,jp->pa", lines, z)
    explained = np.einsum("pa,pa->p", right, np.linalg.solve(normal, right[..., None])[..., 0])
    squares = np.einsum("jp,jp->p", z, z) - explained
    if squares.max() <= 0.0:
        raise ValueError("the unworn surface is a straight line without any noise")
    freedom = len(y) - lines.shape[2]
    variance = squares / freedom
    score = -0.5 * (freedom * np.log(variance) + log_determinant + np.linalg.slogdet(normal)[1])
    return score, variance


def _finer(
    lengths: FloatArray, whites: FloatArray, score: FloatArray, below: float, sizes: tuple[int, int]
) -> tuple[FloatArray, FloatArray]:
    """Return a grid over the parameters whose log likelihood is less than `below` from the best."""
    length, white = (grid.ravel() for grid in np.meshgrid(lengths, whites))
    likely = score > score.max() - below
    step = lengths[1] / lengths[0]
    low, high = length[likely].min() / step**0.5, length[likely].max() * step**0.5
    less = whites[whites < white[likely].min()].max(initial=0.0)
    more = whites[whites > white[likely].max()].min(initial=0.99)
    return np.geomspace(low, min(high, lengths[-1]), sizes[0]), np.linspace(less, more, sizes[1])


def fit_noise(y: FloatArray, height: FloatArray) -> Noise:
    """Fit the noise of unworn parts of a trace, by their restricted likelihood.

    A straight line is removed from all parts together.

    Parameters
    ----------
    y, height : ndarray, shape (points,)
        Rising positions and heights of the unworn parts [m]; there may be a gap between them.

    Returns
    -------
    Noise
        Geometric means over a grid of correlation length and white part, weighted by the
        likelihood.

    Raises
    ------
    ValueError
        If there are fewer than 8 points, or they lie on a straight line.
    """
    count = len(y)
    if count < 8:
        raise ValueError(f"noise needs 8 points of the unworn surface or more, got {count}")
    scaled = (y - y.mean()) / np.ptp(y)
    columns = np.column_stack([height - height.mean(), np.ones(count), scaled])[:, None, :]
    lengths, whites = _first_grid(y), _WHITE
    for round_ in range(_ROUNDS):
        length, white = (grid.ravel() for grid in np.meshgrid(lengths, whites))
        score, variance = _restricted(y, columns, length, white)
        if round_ < _ROUNDS - 1:
            # the next grid covers the parameters that are not much less likely
            lengths, whites = _finer(lengths, whites, score, 4.0, (_LENGTHS, len(_WHITE)))
    weight = np.exp(score - score.max())
    weight /= weight.sum()
    power = variance * np.maximum(1.0 - white, 1e-6)
    # a groove as wide as many correlation lengths depends on the product of power and length,
    # whose most likely value is too small on average, and whose mean is too great
    mean_power = float(np.exp(weight @ np.log(power)))
    mean_length = float(np.exp(weight @ np.log(length)))
    return Noise(mean_power**0.5, mean_length, float(weight @ (variance * white)) ** 0.5)
