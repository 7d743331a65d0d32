"""Verdict on the scatter of K, calibrated by simulated sets of tests, and power of a design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from wearsim.types import BoolArray, FloatArray
from wearsim.uq.hierarchy.kernels import Kernel
from wearsim.uq.hierarchy.pooled import Hierarchy, ratios, scatters, upper_limits
from wearsim.uq.sampling.sobol import Stream

Word: TypeAlias = Literal["explained", "random", "undecided"]

NEGLIGIBLE = 0.2  # scatter of ln K
ALPHA = 0.05
SETS = 4000  # simulated sets of tests for a quantile
_SCATTERS = 30  # values of t for simulated sets
_GREATEST = 3.0


def simulated_centres(
    kernels: Sequence[Kernel], tests: int, sets: int, t: float, seed: int, name: str
) -> FloatArray:
    """Return the apparent ln K of simulated tests, whose m is 0.

    Parameters
    ----------
    kernels : sequence of Kernel
        Likelihood of each test, or one for all of them.
    tests, sets : int
        Number of tests of a set, and of sets.
    t : float
        Scatter of ln K.
    seed : int
    name : str
        Name of the stream of random numbers.

    Returns
    -------
    ndarray, shape (sets, tests)
    """
    from scipy.special import ndtri  # noqa: PLC0415  (slow to import)

    numbers = Stream(seed, name, "test").rows(0, sets, 3 * tests).reshape(sets, 3, tests)
    found = t * ndtri(numbers[:, 0])
    for test in range(tests):
        kernel = kernels[test if len(kernels) > 1 else 0]
        found[:, test] += kernel.deviations(numbers[:, 1:, test].T)
    return np.asarray(found)


class Decision(NamedTuple):
    """Verdicts of sets of tests, each shape (sets,).

    Parameters
    ----------
    random, explained : ndarray of bool
        Sets of which the scatter is beyond chance, and of which it is negligible.
    """

    random: BoolArray
    explained: BoolArray


class Design:
    """Tests of known likelihoods, with the quantile of the ratio statistic for t = 0.

    Parameters
    ----------
    kernels : sequence of Kernel
        Likelihood of each test, or one for all of them.
    tests : int, optional
        Number of tests, where one kernel is given.
    negligible : float
        Scatter of ln K below which it is negligible.
    seed : int
    sets : int
        Number of simulated sets of tests.
    """

    def __init__(
        self,
        kernels: Sequence[Kernel],
        tests: int | None = None,
        *,
        negligible: float = NEGLIGIBLE,
        seed: int = 0,
        sets: int = SETS,
    ) -> None:
        self.kernels, self.tests = list(kernels), tests or len(kernels)
        self.negligible, self.seed, self.sets = negligible, seed, sets
        self.hierarchy = Hierarchy(kernels, scatters(_SCATTERS, _GREATEST), tests)
        null = self.simulated(0.0, "null")
        self.null = np.sort(ratios(self.hierarchy.integrated(null)))
        self.quantile = float(np.quantile(self.null, 1.0 - ALPHA))

    def simulated(self, t: float, name: str) -> FloatArray:
        """Return apparent ln K of simulated sets with the scatter t, shape (sets, tests)."""
        stream = f"identify {name} {self.tests}"
        return simulated_centres(self.kernels, self.tests, self.sets, t, self.seed, stream)

    def ratio(self, centres: FloatArray) -> float:
        """Return the likelihood ratio statistic of one set of tests, shape (tests,)."""
        return float(ratios(self.hierarchy.integrated(centres[None]))[0])

    def decide(self, centres: FloatArray) -> Decision:
        """Return the verdicts of sets of tests, shape (sets, tests)."""
        found = self.hierarchy.integrated(centres)
        random = ratios(found) > self.quantile
        upper = upper_limits(found, self.hierarchy.t, 1.0 - ALPHA)
        explained = ~random & (upper < self.negligible)
        return Decision(random, explained)

    def rates(self, t: float) -> tuple[float, float]:
        """Return the rates of the verdicts "random" and "explained" where the scatter is t."""
        found = self.decide(self.simulated(t, f"scatter {t:g}"))
        return float(found.random.mean()), float(found.explained.mean())


def word(random: bool, upper: float, negligible: float) -> Word:
    """Return the verdict of tests.

    Parameters
    ----------
    random : bool
        Whether the likelihood ratio of t = 0 exceeds its 95 % quantile for t = 0.
    upper : float
        One-sided upper 95 % limit of t.
    negligible : float
    """
    if random:
        return "random"
    return "explained" if upper < negligible else "undecided"


def normal_power(tests: int, variance: float, t: float) -> float:
    """Return the power of the variance test for normal apparent values of equal variance.

    Parameters
    ----------
    tests : int
        Number of tests, 2 or more.
    variance : float
        Variance of the apparent ln K where t = 0.
    t : float
        Scatter of ln K.
    """
    from scipy.special import chdtrc, chdtri  # noqa: PLC0415  (slow to import)

    limit = chdtri(tests - 1, ALPHA)
    return float(chdtrc(tests - 1, limit * variance / (variance + t * t)))


def needed_tests(variance: float, t: float, power: float = 0.8, most: int = 10_000) -> int | None:
    """Return the number of tests with a power, or None if it exceeds `most`; see `normal_power`."""
    low, high = 1, 2
    while normal_power(high, variance, t) < power:
        low, high = high, 2 * high
        if low >= most:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        enough = normal_power(middle, variance, t) >= power
        low, high = (low, middle) if enough else (middle, high)
    return high if high <= most else None
