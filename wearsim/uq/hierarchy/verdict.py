"""Verdict on the scatter of K, calibrated by simulated sets of tests, and power of a design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
import scipy

from wearsim.types import BoolArray, FloatArray
from wearsim.uq.hierarchy.kernels import LikelihoodMixture
from wearsim.uq.hierarchy.pooled import Hierarchy, ratios, scatters, upper_limits
from wearsim.uq.sampling.sobol import Stream

NEGLIGIBLE = 0.2  # scatter of ln K
ALPHA = 0.05
SETS = 4000  # simulated sets of tests for a quantile
POWER_SETS = 1000  # simulated sets of tests for a power
MOST_TESTS = 128  # for which a power is simulated
_SCATTERS = 30  # values of t for simulated sets
_GREATEST = 3.0


def simulated_centres(
    kernels: Sequence[LikelihoodMixture], tests: int, sets: int, t: float, seed: int, name: str
) -> FloatArray:
    """Return the apparent ln K of simulated tests, whose m is 0.

    Parameters
    ----------
    kernels : sequence of LikelihoodMixture
        Likelihood of each test; of more tests they are repeated in this order.
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
    numbers = Stream(seed, name, "test").rows(0, sets, 3 * tests).reshape(sets, 3, tests)
    centres = t * scipy.special.ndtri(numbers[:, 0])
    for test in range(tests):
        centres[:, test] += kernels[test % len(kernels)].deviations(numbers[:, 1:, test].T)
    return np.asarray(centres)


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
    kernels : sequence of LikelihoodMixture
        Likelihood of each test; of more tests they are repeated in this order.
    tests : int, optional
        Number of tests, by default one for each kernel.
    negligible : float
        Scatter of ln K below which it is negligible.
    seed : int
    sets : int
        Number of simulated sets of tests.
    """

    def __init__(
        self,
        kernels: Sequence[LikelihoodMixture],
        tests: int | None = None,
        *,
        negligible: float = NEGLIGIBLE,
        seed: int = 0,
        sets: int = SETS,
    ) -> None:
        self.kernels, self.tests = list(kernels), tests or len(kernels)
        self.negligible, self.seed, self.sets = negligible, seed, sets
        self.hierarchy = Hierarchy(kernels, scatters(_SCATTERS, _GREATEST), tests)
        self.null = np.sort(ratios(self.hierarchy.integrated(self.simulated(0.0, "null"))))
        self.quantile = float(np.quantile(self.null, 1.0 - ALPHA))

    def simulated(self, t: float, name: str) -> FloatArray:
        """Return apparent ln K of simulated sets with the scatter t, shape (sets, tests)."""
        return simulated_centres(
            self.kernels, self.tests, self.sets, t, self.seed, f"identify {name} {self.tests}"
        )

    def ratio(self, centres: FloatArray) -> float:
        """Return the likelihood ratio statistic of one set of tests, shape (tests,)."""
        return float(ratios(self.hierarchy.integrated(centres[None]))[0])

    def decide(self, centres: FloatArray) -> Decision:
        """Return the verdicts of sets of tests, shape (sets, tests)."""
        log_likelihood = self.hierarchy.integrated(centres)
        explained = upper_limits(log_likelihood, self.hierarchy.t, 1.0 - ALPHA) < self.negligible
        return Decision((ratios(log_likelihood) > self.quantile) & ~explained, explained)

    def rates(self, t: float) -> tuple[float, float]:
        """Return the rates of the verdicts "random" and "explained" where the scatter is t."""
        decision = self.decide(self.simulated(t, f"scatter {t:g}"))
        return float(decision.random.mean()), float(decision.explained.mean())


def word(
    random: bool, upper: float, negligible: float
) -> Literal["explained", "random", "undecided"]:
    """Return the verdict of tests: by a test of equivalence first, then by a test of t = 0.

    Parameters
    ----------
    random : bool
        Whether the likelihood ratio of t = 0 exceeds its 95 % quantile for t = 0.
    upper : float
        One-sided upper 95 % limit of t.
    negligible : float
    """
    if upper < negligible:
        return "explained"
    return "random" if random else "undecided"


class Power:
    """Rates of the verdicts of tests like given ones, by simulated sets of tests.

    The parameters are those of `Design`; the number of tests is given to the methods.
    """

    def __init__(
        self,
        kernels: Sequence[LikelihoodMixture],
        *,
        negligible: float = NEGLIGIBLE,
        seed: int = 0,
        sets: int = POWER_SETS,
    ) -> None:
        self.kernels, self._options = list(kernels), (negligible, seed, sets)
        self._designs: dict[int, Design] = {}

    def rates(self, tests: int, t: float) -> tuple[float, float]:
        """Return the rates of "random" and "explained" by a number of tests with the scatter t."""
        if tests not in self._designs:
            negligible, seed, sets = self._options
            self._designs[tests] = Design(
                self.kernels, tests, negligible=negligible, seed=seed, sets=sets
            )
        return self._designs[tests].rates(t)

    def needed(self, t: float, power: float = 0.8, most: int = MOST_TESTS) -> int | None:
        """Return the least number of tests with a power, or None if it exceeds `most`.

        Between numbers in the ratio 2 the power is interpolated: its normal quantile against the
        logarithm of the number.
        """
        low, below, tests = 1, ALPHA, 2
        while (rate := self.rates(tests, t)[0]) < power:
            if tests >= most:
                return None
            low, below, tests = tests, max(rate, ALPHA), min(2 * tests, most)
        ends = scipy.special.ndtri([below, power, min(rate, 0.999)])
        part = (ends[1] - ends[0]) / (ends[2] - ends[0])
        return max(int(np.ceil(low * (tests / low) ** part)), 2)
