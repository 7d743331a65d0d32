"""Hierarchical model ln K_i ~ N(m, t^2) of several tests, on a grid of m and t."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.hierarchy.kernels import REACH, LikelihoodMixture

PRIOR_SCALE = 0.5  # of the half-normal prior of t
GREATEST = 6.0  # t of the grid
LEVELS = (0.90, 0.95)
_MEANS = 81  # values of m for each t
_MEANS_OF_MANY = 25  # the same for simulated sets of tests
_SPAN = 6.5  # standard errors of m that the grid covers to either side
_VALUES = 12_500  # of an array, so that it remains in the cache of a processor


def scatters(count: int, greatest: float = GREATEST) -> FloatArray:
    """Return a grid of t from 0, finest there."""
    return np.asarray(greatest * (np.arange(count) / (count - 1)) ** 2.0)


def trapezoid_weights(grid: FloatArray) -> FloatArray:
    """Return the weights of the trapezoidal rule."""
    step = np.diff(grid)
    return np.asarray(0.5 * (np.append(step, 0.0) + np.append(0.0, step)))


def half_normal(t: FloatArray, scale: float = PRIOR_SCALE) -> FloatArray:
    """Return the density of a half-normal prior of t."""
    return np.asarray(np.sqrt(2.0 / np.pi) / scale * np.exp(-0.5 * (t / scale) ** 2))


class Hierarchy:
    """Likelihood of m and t for tests of one design.

    Parameters
    ----------
    kernels : sequence of LikelihoodMixture
        Likelihood of each test; of more tests they are repeated in this order.
    t : ndarray, shape (t,)
        Grid of the scatter of ln K.
    tests : int, optional
        Number of tests, by default one for each kernel.
    """

    def __init__(
        self, kernels: Sequence[LikelihoodMixture], t: FloatArray, tests: int | None = None
    ) -> None:
        self.kernels, self.t = list(kernels), t
        tables = [kernel.table(t) for kernel in self.kernels]
        self._scale = np.stack([scale for scale, _ in tables])  # (kernels, t)
        self._table = np.stack([table for _, table in tables])
        self._slope = np.diff(self._table, append=self._table[..., -1:])  # to the next node
        self.owner = np.arange(tests or len(self.kernels)) % len(self.kernels)

    def on_grid(self, centres: FloatArray, row: int, count: int) -> tuple[FloatArray, FloatArray]:
        """Return values of m and the log likelihood for one t.

        Parameters
        ----------
        centres : ndarray, shape (sets, tests)
            Apparent ln K of each test.
        row : int
            Place of t in the grid.
        count : int
            Number of values of m.

        Returns
        -------
        m, log_likelihood : ndarray, shape (sets, count)
        """
        scale = self._scale[self.owner, row]
        precision = 1.0 / scale**2
        middle = centres @ precision / precision.sum()
        half = _SPAN / np.sqrt(precision.sum())
        steps = np.linspace(-half, half, count)
        last = self._table.shape[2] - 1
        total = np.zeros((len(centres), count))
        for test, owner in enumerate(self.owner.tolist()):
            nodes = last / (2.0 * REACH * scale[test])  # per unit of ln K
            start = (centres[:, test] - middle) * nodes + 0.5 * last
            place = start[:, None] - steps * nodes
            # beyond the table there is a normal tail
            if min(start.min(), last - start.max()) < half * nodes:
                u = (place - 0.5 * last) * (2.0 * REACH / last)
                total -= 0.5 * np.maximum(u * u - REACH**2, 0.0)
                place = np.clip(place, 0.0, last)
            first = place.astype(np.intp)
            place -= first
            place *= self._slope[owner, row].take(first)
            total += self._table[owner, row].take(first)
            total += place
        return middle[:, None] + steps, total

    def integrated(self, centres: FloatArray) -> FloatArray:
        """Return the log likelihood of t of sets of tests, integrated over m with a flat prior.

        Parameters
        ----------
        centres : ndarray, shape (sets, tests)
            Apparent ln K of each test.

        Returns
        -------
        ndarray, shape (sets, t)
        """
        log_likelihood = np.empty((len(centres), len(self.t)))
        block = max(_VALUES // _MEANS_OF_MANY, 1)
        for start in range(0, len(centres), block):
            some = centres[start : start + block]
            for row in range(len(self.t)):
                m, total = self.on_grid(some, row, _MEANS_OF_MANY)
                top = total.max(axis=1)
                log_likelihood[start : start + block, row] = top + np.log(
                    np.exp(total - top[:, None]).sum(axis=1) * (m[:, 1] - m[:, 0])
                )
        return log_likelihood


def upper_limits(log_likelihood: FloatArray, t: FloatArray, probability: float) -> FloatArray:
    """Return the one-sided upper limit of t of each set of tests, shape (sets,).

    Parameters
    ----------
    log_likelihood : ndarray, shape (sets, t)
        From `Hierarchy.integrated`.
    t : ndarray, shape (t,)
    probability : float
        Probability of a smaller t, with a half-normal prior.
    """
    log_density = log_likelihood + np.log(half_normal(t))
    density = np.exp(log_density - log_density.max(axis=1, keepdims=True))
    return np.array([np.interp(probability, row, t) for row in _cumulative(density, t)])


def ratios(log_likelihood: FloatArray) -> FloatArray:
    """Return twice the logarithm of the likelihood ratio of the best t and of t = 0.

    Parameters
    ----------
    log_likelihood : ndarray, shape (sets, t)
        From `Hierarchy.integrated`; the first t is 0.
    """
    return np.asarray(2.0 * (log_likelihood.max(axis=1) - log_likelihood[:, 0]))


def _cumulative(density: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the distribution function from a density on a grid, along the last axis."""
    parts = 0.5 * (density[..., 1:] + density[..., :-1]) * np.diff(grid)
    total = np.concatenate([np.zeros((*parts.shape[:-1], 1)), np.cumsum(parts, axis=-1)], axis=-1)
    return np.asarray(total / total[..., -1:])


@dataclass(frozen=True)
class Posterior:
    """Posterior of m and t, with a flat prior of m and a half-normal prior of t.

    Parameters
    ----------
    t : ndarray, shape (t,)
        Grid of the scatter of ln K.
    m : ndarray, shape (t, m)
        Grid of the mean of ln K for each t.
    log_likelihood : ndarray, shape (t, m)
    scale : float
        Scale of the prior of t.
    """

    t: FloatArray
    m: FloatArray
    log_likelihood: FloatArray
    scale: float = PRIOR_SCALE

    @classmethod
    def of(cls, kernels: Sequence[LikelihoodMixture], count: int = 160) -> Posterior:
        """Return the posterior of tests with the given likelihoods."""
        grid = scatters(count)
        hierarchy = Hierarchy(kernels, grid)
        centres = np.array([[kernel.mean for kernel in kernels]])
        rows = [hierarchy.on_grid(centres, row, _MEANS) for row in range(count)]
        return cls(grid, np.stack([m[0] for m, _ in rows]), np.stack([v[0] for _, v in rows]))

    def evidence(self) -> FloatArray:
        """Return the likelihood of each t, integrated over m, relative to the greatest."""
        top = self.log_likelihood.max()
        return np.asarray(
            np.exp(self.log_likelihood - top).sum(axis=1) * (self.m[:, 1] - self.m[:, 0])
        )

    def bayes_factor(self, scale: float | None = None) -> float:
        """Return the ratio of evidence, t = 0 over a half-normal t, with a flat m.

        Parameters
        ----------
        scale : float, optional
            Scale of the prior of t; by default the scale of the posterior.
        """
        prior = half_normal(self.t, scale or self.scale) * trapezoid_weights(self.t)
        evidence = self.evidence()
        return float(evidence[0] * prior.sum() / (evidence @ prior))

    def density(self) -> FloatArray:
        """Return the density of m and t, shape (t, m)."""
        density = np.exp(self.log_likelihood - self.log_likelihood.max())
        density = density * half_normal(self.t, self.scale)[:, None]
        inner = density.sum(axis=1) * (self.m[:, 1] - self.m[:, 0])
        return np.asarray(density / (inner @ trapezoid_weights(self.t)))

    def scatter(self, probability: Sequence[float], scale: float | None = None) -> list[float]:
        """Return quantiles of t.

        Parameters
        ----------
        probability : sequence of float
        scale : float, optional
            Scale of the prior of t; by default the scale of the posterior.
        """
        below = _cumulative(self.evidence() * half_normal(self.t, scale or self.scale), self.t)
        return [float(np.interp(p, below, self.t)) for p in probability]

    def mean(self, probability: Sequence[float]) -> list[float]:
        """Return quantiles of m."""
        return self._mixture(probability, np.zeros_like(self.t))

    def next(self, probability: Sequence[float], more: float = 0.0) -> list[float]:
        """Return quantiles of ln K of one more specimen.

        Parameters
        ----------
        probability : sequence of float
        more : float
            Standard deviation of something added to ln K, such as inputs of the next test.
        """
        return self._mixture(probability, np.hypot(self.t, more))

    def _mixture(self, probability: Sequence[float], std: FloatArray) -> list[float]:
        """Return quantiles of m plus a normal number of standard deviation `std` for each t."""
        from scipy.special import ndtr  # noqa: PLC0415  (slow to import)

        weight = self.density() * trapezoid_weights(self.t)[:, None]
        weight *= (self.m[:, 1] - self.m[:, 0])[:, None]
        centre = float((weight * self.m).sum())
        spread = float(np.sqrt((weight * ((self.m - centre) ** 2 + std[:, None] ** 2)).sum()))
        widths = np.maximum(std, 0.3 * (self.m[:, 1] - self.m[:, 0]))
        rows = np.flatnonzero(weight.sum(axis=1) > 1e-9)

        def share_below(values: FloatArray) -> FloatArray:
            parts = [ndtr((values[:, None] - self.m[k]) / widths[k]) @ weight[k] for k in rows]
            return np.asarray(np.sum(parts, axis=0))

        coarse = centre + spread * np.linspace(-8.0, 8.0, 41)
        below = share_below(coarse)
        wanted = below[-1] * np.asarray(probability)
        places = np.clip(np.searchsorted(below, wanted), 1, coarse.size - 1)
        fine = np.linspace(coarse[places - 1], coarse[places], 21, axis=1)
        return [float(np.interp(w, share_below(x), x)) for w, x in zip(wanted, fine, strict=True)]
