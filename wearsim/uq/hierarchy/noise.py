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

_GRIDS = (14, 12), (9, 7)  # correlation lengths and ratios of white noise, and of the finer grid
_RATIOS = 3e-3, 100.0  # of white noise to steps of the process; the last one times the points
_COVERED, _NEGLIGIBLE = 7.0, 6.0  # below the greatest log density: of the finer grid, and of models
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
        white, mean = np.empty_like(columns), np.zeros(columns.shape[1])
        for j, (factor, gain, scale) in enumerate(zip(*self.filter(y), strict=True)):
            error = columns[j] - mean
            np.multiply(error, scale, out=white[j])
            error *= gain * factor
            mean *= factor
            mean += error
        return white

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
        correlated = np.empty_like(normal[0])
        value = normal[0, 0]
        for j, factor in enumerate(decay):
            if j:
                value = factor * value + np.sqrt(1.0 - factor * factor) * normal[0, j]
            correlated[j] = value
        return np.asarray(self.sigma * correlated + self.white * normal[1])


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

    def whitened(self, columns: FloatArray) -> FloatArray:
        """Return columns whose noise is independent, shape (points, models, columns).

        Parameters
        ----------
        columns : ndarray, shape (points, columns)
            Heights [m], or anything that adds to them.
        """
        return _whitened(columns, self.decay, self.gain, self.scale)


def noise_models(
    y: FloatArray, residual: FloatArray, forms: FloatArray, least: float = 0.0
) -> NoiseModels:
    """Return noise models over which the likelihood of a trace is integrated.

    The density of the prior of the correlation length is proportional to it, up to half of the
    trace, and the white share has a uniform prior. (Where a trace has 16 lengths, a prior uniform
    in the logarithm of the length gives lengths that are a quarter too small on average, and a
    uniform one intervals that hold the truth in 93 %.) The models form a grid over those that
    residuals do not exclude.

    Parameters
    ----------
    y, residual : ndarray, shape (points,)
        Rising positions, and heights less the best profile [m].
    forms : ndarray, shape (points, forms)
        Offset, inclination and other forms of unknown size.
    least : float
        Least standard deviation of the noise, known from elsewhere [m].
    """
    models, variance, score = _likely(y, residual, forms)
    kept = score > score.max() - _NEGLIGIBLE
    arrays = models.decay, models.gain, models.scale, models.lines
    decay, gain, scale, lines = (np.ascontiguousarray(values[..., kept]) for values in arrays)
    freedom = len(y) - forms.shape[1]
    # a variance that is greater by a factor divides the logarithm of the likelihood by it
    exponent = 0.5 * freedom / np.maximum(1.0, least**2 / variance[kept])
    added = (exponent - 0.5 * freedom) * np.log(freedom * variance[kept])
    log_weight = models.log_weight[kept] + added
    return NoiseModels(
        models.length[kept], models.white[kept], decay, gain, scale, lines, log_weight, exponent
    )


def _likely(
    y: FloatArray, residual: FloatArray, forms: FloatArray
) -> tuple[NoiseModels, FloatArray, FloatArray]:
    """Return a grid of noise models, the variance of each, and the logarithm of its weight.

    The axes are logarithms: of the correlation length, and of the variance of the white
    noise over that of a step of the process from point to point. Short distances show both parts of
    this ratio, whereas the white share is hardly independent of a correlation length that is long.
    """
    spacing = float(np.median(np.diff(y)))
    parts = np.split(y, np.flatnonzero(np.diff(y) > 20.0 * spacing) + 1)
    span = max(float(np.ptp(part)) for part in parts)
    ends = (0.3 * spacing, max(0.5 * span, spacing)), (_RATIOS[0], _RATIOS[1] * span / spacing)
    freedom = len(y) - forms.shape[1]
    for sizes in _GRIDS:
        axes = [np.geomspace(*pair, size) for pair, size in zip(ends, sizes, strict=True)]
        length, ratio = (grid.ravel() for grid in np.meshgrid(*axes, indexing="ij"))
        white = ratio / (ratio + length / spacing)
        filters = _filters(y, length, white)
        whitened = _whitened(np.column_stack([residual, forms]), *filters)
        lines, triangle = np.linalg.qr(whitened[:, :, 1:].transpose(1, 0, 2))
        z = whitened[:, :, 0].T
        along = np.einsum("mjf,mj->mf", lines, z)
        variance = ((z**2).sum(axis=1) - (along**2).sum(axis=1)) / freedom
        if variance.max() <= 0.0:
            raise ValueError("the unworn surface is a straight line without any noise")
        log_weight = np.log(filters[2]).sum(axis=0)
        log_weight -= np.log(np.abs(np.diagonal(triangle, axis1=1, axis2=2))).sum(axis=1)
        # density of the priors of length and white share on this grid
        log_weight += np.log(length**2 * white * (1.0 - white))
        score = log_weight - 0.5 * freedom * np.log(variance)
        likely = (score > score.max() - _COVERED).reshape(sizes)
        ends = tuple(  # type: ignore[assignment]
            (axis[max(place[0] - 1, 0)], axis[min(place[-1] + 1, len(axis) - 1)])
            for axis, place in zip(
                axes, (np.flatnonzero(likely.any(axis=other)) for other in (1, 0)), strict=True
            )
        )
    exponent = np.full(len(length), 0.5 * freedom)
    models = NoiseModels(length, white, *filters, lines.transpose(2, 1, 0), log_weight, exponent)
    return models, variance, score


def _filters(
    y: FloatArray, length: FloatArray, white: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return decay, gain and scale of noise models with unit variance, see `NoiseModels`."""
    decay = np.exp(-np.diff(y, append=y[-1])[:, None] / length)
    gain, scale = np.empty_like(decay), np.empty_like(decay)
    power = 1.0 - white
    kept, fresh, variance = decay**2, power * (1.0 - decay**2), power
    for j in range(len(y)):
        total = variance + white
        gain[j] = variance / total
        scale[j] = 1.0 / np.sqrt(total)
        variance = kept[j] * variance * (1.0 - gain[j]) + fresh[j]
    return decay, gain, scale


def _whitened(
    columns: FloatArray, decay: FloatArray, gain: FloatArray, scale: FloatArray
) -> FloatArray:
    """Return columns whitened by several models, shape (points, models, columns)."""
    white = np.empty((*decay.shape, columns.shape[1]))
    mean = np.zeros(white.shape[1:])
    corrected = (decay * gain)[:, :, None]
    for j, column in enumerate(columns):
        error = np.subtract(column, mean, out=white[j])
        mean *= decay[j][:, None]
        mean += corrected[j] * error
    white *= scale[:, :, None]
    return white


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
    line = np.column_stack([np.ones(count), (y - y.mean()) / np.ptp(y)])
    models, variance, score = _likely(y, height - height.mean(), line)
    # a groove as wide as many correlation lengths depends on the product of power and length,
    # whose most likely value is too small on average, and whose mean is too great
    score -= 2.0 * np.log(models.length)
    weight = np.exp(score - score.max())
    weight /= weight.sum()
    power = variance * (1.0 - models.white)
    return Noise(
        float(np.exp(weight @ np.log(power))) ** 0.5,
        float(np.exp(weight @ np.log(models.length))),
        float(weight @ (variance * models.white)) ** 0.5,
    )
