"""Coverage of small probabilities with the wear factor integrated, on lives of a closed form.

ln kappa of a test depends on the normal score of its friction, in several forms; K/H is log-normal.
Run as a script with the name of a JSON file, it writes the tables of docs/life.md there.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from wearsim.uq.distributions.base import Distribution
from wearsim.uq.survival.design_points import (
    DEFENSIVE,
    design_points,
    improved_shifts,
    mixture_log_weights,
)
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.effective import LEAST_NUMBER
from wearsim.uq.survival.rare_events import RareProbability, weighted_probability
from wearsim.uq.survival.scores import score_function

SEED, STUDIES = 11, 400
OF_FACTOR = math.log(1.5)  # standard deviation of ln K
FRICTION = (1.2, 1.6)  # factor of its scatter
SIZES = (40, 400)
PROBABILITIES = (1e-2, 1e-4, 1e-6)
RARE_TESTS = 200  # further tests
INPUTS = 3  # with scores, of which the first two have an effect

#: ln kappa over its scale from two normal scores.
Form: TypeAlias = Callable[[np.ndarray, np.ndarray], np.ndarray]

FORMS: dict[str, Form] = {
    "linear": lambda z, v: z,
    "curved to short lives": lambda z, v: z - 0.2 * (z**2 - 1.0),
    "curved to long lives": lambda z, v: z + 0.2 * (z**2 - 1.0),
    "folded": lambda z, v: -np.abs(z),
    "bimodal": lambda z, v: np.where(v < 0.0, -0.9, 0.9) + 0.44 * z,
    "bimodal, 10 % short": lambda z, v: np.where(v < ndtri(0.1), -2.7, 0.3) + 0.44 * z,
}


class _WearFactor(Distribution):
    def quantile(self, probability: np.ndarray) -> np.ndarray:
        return np.exp(OF_FACTOR * ndtri(probability))


SCORE = score_function(_WearFactor())


def log_target(form: str, factor: float, probability: float) -> float:
    """Return ln of the life that is not reached with a probability, by quadrature."""
    z = np.linspace(-10.0, 10.0, 8001)
    weight = np.exp(-0.5 * z**2)
    levels = np.array([-9.0, ndtri(0.3), 9.0]), np.array([0.1, 0.4, 0.5])  # of both modes
    each = np.array([math.log(factor) * FORMS[form](z, np.full_like(z, v)) for v in levels[0]])

    def excess(log: float) -> float:
        shares = ndtr((log - each) / OF_FACTOR) @ weight / weight.sum()
        return math.log(max(float(levels[1] @ shares), 1e-300) / probability)

    return float(brentq(excess, -12.0, 3.0))


def log_kappa(form: str, factor: float, scores: np.ndarray) -> np.ndarray:
    """Return ln kappa from normal scores, (n, INPUTS) to (n,)."""
    return math.log(factor) * FORMS[form](scores[:, 0], scores[:, 1])


@dataclass(frozen=True)
class Cell:
    """Result of many studies: how many state a probability, and how many of these hold it."""

    stated: int
    held: int
    of: int
    variation: float

    @property
    def false(self) -> int:
        """Number of studies with a stated interval that does not hold the probability."""
        return self.stated - self.held


def by_realisations(form: str, factor: float, count: int, probability: float) -> Cell:
    """Return how often the mean over plain realisations is stated, and its interval right."""
    random, log = np.random.default_rng((SEED, count)), log_target(form, factor, probability)
    life, held, found = math.exp(log), 0, []
    for _ in range(STUDIES):
        kappa = np.exp(log_kappa(form, factor, random.standard_normal((count, INPUTS))))
        mixture = FactorMixture(kappa, SCORE)
        if mixture.effective_number(life) >= LEAST_NUMBER:
            interval = mixture.probability_before(life)
            held += interval.low <= probability <= interval.high
            found.append(interval.value)
    variation = float(np.std(found)) / probability if len(found) > 1 else math.nan
    return Cell(len(found), held, STUDIES, variation)


def importance(
    form: str, factor: float, count: int, tests: int, life: float, seed: Sequence[int]
) -> RareProbability:
    """Return the estimate of importance sampling after plain realisations, as a study plans it."""
    random = np.random.default_rng(seed)
    plain = random.standard_normal((count, INPUTS))
    mixture = FactorMixture(np.exp(log_kappa(form, factor, plain)), SCORE)
    log, _ = mixture.log_kappa
    points = design_points(plain, log, lambda found: mixture.needed_score(found, life))
    sizes = [count, *([tests // 4 // len(points)] * len(points))]
    shifts = [np.zeros(INPUTS), *points]
    scores = np.concatenate([plain, _drawn(random, sizes[1:], points)])
    weights = np.exp(mixture_log_weights(scores, np.array(sizes) / sum(sizes), shifts))
    means, parts = improved_shifts(scores, weights * _failed(form, factor, scores, life), points)
    left = tests - sum(sizes[1:])
    shares = [DEFENSIVE, *((1.0 - DEFENSIVE) * part for part in parts)]
    ends = np.round(left * np.cumsum(shares)).astype(int)
    sizes, shifts = np.diff(ends, prepend=0).tolist(), [np.zeros(INPUTS), *means]
    scores = _drawn(random, sizes, shifts)
    log_weight = mixture_log_weights(scores, np.array(sizes) / left, shifts)
    return weighted_probability(_failed(form, factor, scores, life), log_weight, tests)


def _drawn(
    random: np.random.Generator, sizes: Sequence[int], shifts: Sequence[np.ndarray]
) -> np.ndarray:
    pairs = zip(sizes, shifts, strict=True)
    return np.concatenate([random.standard_normal((n, INPUTS)) + shift for n, shift in pairs])


def _failed(form: str, factor: float, scores: np.ndarray, life: float) -> np.ndarray:
    mixture = FactorMixture(np.exp(log_kappa(form, factor, scores)), SCORE)
    return mixture.failed(np.array([life]))[:, 0]


def by_further_tests(
    form: str, factor: float, count: int, probability: float, studies: int = STUDIES
) -> Cell:
    """Return how often importance sampling is stated, and its interval right."""
    life = math.exp(log_target(form, factor, probability))
    found = [
        importance(form, factor, count, RARE_TESTS, life, (SEED, number))
        for number in range(studies)
    ]
    stated = [item.probability for item in found if item.is_reliable]
    held = sum(item.low <= probability <= item.high for item in stated)
    values = [item.value for item in stated]
    variation = float(np.std(values)) / probability if len(values) > 1 else math.nan
    return Cell(len(stated), held, studies, variation)


def rows() -> Iterator[str]:
    """Yield the rows of the table."""
    yield (
        "| ln kappa | friction | realisations | P | stated | held | `--rare 200` stated | held |"
        " variation |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for form in FORMS:
        for factor in FRICTION:
            for count in SIZES:
                for chance in PROBABILITIES:
                    plain = by_realisations(form, factor, count, chance)
                    more = by_further_tests(form, factor, count, chance)
                    cells = [f"{form} | {factor:g} | {count} | {chance:.0e}"]
                    cells += [f"{one.stated} | {one.held}" for one in (plain, more)]
                    yield f"| {' | '.join(cells)} | {100.0 * more.variation:.1f} % |"


if __name__ == "__main__":
    from tests.benchmarks.table import save_tables

    lines = []
    for line in rows():
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()
        lines.append(line)
    command = "python -m tests.uq.survival.small_probabilities"
    save_tables(Path(sys.argv[1]), command, {"small": "\n".join(lines)})
