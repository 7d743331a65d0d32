"""Mixture of distributions, such as of batches or suppliers with their shares."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import Distribution
from wearsim.uq.survival.scores import ScoreFunction, score_function

_HALVINGS = 60
_GREATEST = 700.0  # magnitude of the exponent of a standardised value


class Mixture(Distribution):
    """Distribution of a value from one of several distributions, chosen with given probabilities.

    Parameters
    ----------
    components : sequence of Distribution
    weights : sequence of float
        Above zero; they are divided by their sum.

    Notes
    -----
    The distribution function is the weighted sum of those of the components, each tabulated to an
    error of 1e-8 of its normal score, at steps to rounding, see `score_function`. Its inverse is
    found by bisection.
    """

    def __init__(self, components: Sequence[Distribution], weights: Sequence[float]) -> None:
        self.components = tuple(components)
        total = math.fsum(weights)
        self.weights = tuple(weight / total for weight in weights)

    @property
    def contained(self) -> tuple[str, ...]:
        """Dotted keys of inputs whose scatter a posterior among the components contains."""
        return tuple(key for item in self.components for key in getattr(item, "contained", ()))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the validity of the components."""
        return tuple(text for item in self.components for text in item.warnings)

    @cached_property
    def support(self) -> tuple[float, float]:
        """Minimum and maximum."""
        lows, highs = zip(*(item.support for item in self.components), strict=True)
        return min(lows), max(highs)

    @cached_property
    def mean(self) -> float:
        """Mean, exact if the means of the components are exact."""
        return math.fsum(w * item.mean for w, item in self._pairs)

    @cached_property
    def std(self) -> float:
        """Standard deviation, exact if the components have exact ones."""
        return math.sqrt(
            math.fsum(w * (item.std**2 + (item.mean - self.mean) ** 2) for w, item in self._pairs)
        )

    def cumulative(self, value: FloatArray) -> FloatArray:
        """Return the probability of a number that is not above each value, shape as `value`."""
        return self._cumulative(self._transformed(np.asarray(value, dtype=float)))

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles, shape as `probability`."""
        probability = np.asarray(probability, dtype=float)
        below = np.clip(probability, 0.0, 1.0).ravel()
        nodes, chances = self._table
        place = np.searchsorted(chances, below)  # of the first node that reaches the probability
        high = nodes[np.minimum(place, len(nodes) - 1)]
        low = nodes[np.clip(place - 1, 0, len(nodes) - 1)]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            short = self._cumulative(middle) < below
            low, high = np.where(short, middle, low), np.where(short, high, middle)
        restored = np.exp(high) if self._is_logarithmic else self.mean + (self.std or 1.0) * high
        values = np.clip(restored, *self.support)
        return np.where(
            below <= 0.0, self.support[0], np.where(below >= 1.0, self.support[1], values)
        ).reshape(probability.shape)

    @property
    def _pairs(self) -> list[tuple[float, Distribution]]:
        return list(zip(self.weights, self.components, strict=True))

    @property
    def _is_logarithmic(self) -> bool:
        return self.support[0] >= 0.0

    def _transformed(self, value: FloatArray) -> FloatArray:
        """Return logarithms of positive values, and others standardised."""
        if self._is_logarithmic:
            with np.errstate(divide="ignore"):
                return np.asarray(np.log(value))
        return (value - self.mean) / (self.std or 1.0)

    def _cumulative(self, transformed: FloatArray) -> FloatArray:
        from scipy.special import ndtr  # noqa: PLC0415  (slow to import, and rarely needed)

        chance = np.zeros_like(transformed)
        for weight, score in zip(self.weights, self._scores, strict=True):
            chance += weight * ndtr(
                np.interp(transformed, score.logs, score.scores, left=-math.inf, right=math.inf)
            )
        return chance

    @cached_property
    def _scores(self) -> list[ScoreFunction]:
        """Normal score of each component, of the transformed value."""
        return [score_function(_Transformed(self, item)) for item in self.components]

    @cached_property
    def _table(self) -> tuple[FloatArray, FloatArray]:
        """Transformed values at which a component is tabulated, and the probabilities there."""
        nodes = np.unique(np.concatenate([score.logs for score in self._scores]))
        return nodes, np.maximum.accumulate(self._cumulative(nodes))


class _Transformed(Distribution):
    """A component as a positive value, whose logarithm is the transformed one."""

    def __init__(self, mixture: Mixture, component: Distribution) -> None:
        self._mixture, self._component = mixture, component

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles of the exponential of the transformed value."""
        values = self._mixture._transformed(np.asarray(self._component.quantile(probability)))
        return np.exp(np.clip(values, -_GREATEST, _GREATEST))
