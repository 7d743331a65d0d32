"""Coverage of the intervals of lives: repeated samples of lives with known distributions.

Run as a script with the name of a JSON file, it writes the table of docs/life.md there.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.special import ndtr, ndtri

from wearsim.uq.distributions.base import Distribution
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.comparison import quantile_ratio, same_machine, two_specimens
from wearsim.uq.survival.distributions import CountedLives, FactorMixture
from wearsim.uq.survival.effective import LEAST_NUMBER
from wearsim.uq.survival.fits import fit_lives
from wearsim.uq.survival.lives import life_quantile, lower_bound, probability_before
from wearsim.uq.survival.scores import score_function

SEED, REPEATS = 1, 1000
SIZES = {36: 1.0, 100: 1.0, 1000: 0.25}  # lives of a sample, and part of the repeats
MEDIAN, TARGET = 1_428_499.0, 675_000.0  # passes
OF_FACTOR, OF_REST = 0.405, 0.2  # standard deviations of ln K and of the rest of ln life
LONGER, COMMON, OWN = 1.2, 0.15, 0.15  # the second design
CENSORED_ABOVE = 0.8  # probability of a shorter life than the censoring

_SPREADS = np.hypot(OF_FACTOR, OF_REST), np.sqrt(OF_FACTOR**2 + COMMON**2 + OWN**2)
TRUE = {
    "B10": MEDIAN * np.exp(_SPREADS[0] * ndtri(0.1)),
    "B50": MEDIAN,
    "P(life < target)": ndtr(np.log(TARGET / MEDIAN) / _SPREADS[0]),
    "ratio of B10": LONGER * np.exp((_SPREADS[1] - _SPREADS[0]) * ndtri(0.1)),
    "P(B > A), same machine": ndtr(np.log(LONGER) / np.hypot(OF_REST - COMMON, OWN)),
    "P(B > A), two specimens": ndtr(np.log(LONGER) / np.hypot(*_SPREADS)),
}
MOST = MEDIAN * np.exp(_SPREADS[0] * ndtri(CENSORED_ABOVE))


class _WearFactor(Distribution):
    def quantile(self, probability: np.ndarray) -> np.ndarray:
        return np.exp(OF_FACTOR * ndtri(probability))


@dataclass
class Case:
    """Intervals of one quantity by one method."""

    true: float
    logarithmic: bool
    found: list[Interval] = field(default_factory=list)

    @property
    def coverage(self) -> float:
        return float(np.mean([item.low <= self.true <= item.high for item in self.found]))

    @property
    def width(self) -> float:
        """Mean width over 3.92 standard deviations of the estimate, on the scale of the method."""
        scale = np.log if self.logarithmic else np.asarray
        with np.errstate(divide="ignore", invalid="ignore"):
            value, low, high = (
                scale(np.array([getattr(item, name) for item in self.found]))
                for name in ("value", "low", "high")
            )
        finite = np.isfinite(high - low) & np.isfinite(value)
        return float((high - low)[finite].mean() / (3.92 * value[finite].std()))

    @property
    def one_sided(self) -> float:
        """Share of intervals without a finite end."""
        ends = [item.low > -np.inf and item.high < np.inf for item in self.found]
        return 1.0 - float(np.mean(ends))


def samples(size: int, repeats: int, seed: int) -> Iterator[tuple[np.ndarray, ...]]:
    """Yield lives of both designs, and their passes times the wear factor."""
    random = np.random.default_rng((seed, size))
    for _ in range(repeats):
        factor, rest, own = random.standard_normal((3, size))
        kappa = MEDIAN * np.exp(OF_REST * rest)
        second = MEDIAN * LONGER * np.exp(COMMON * rest + OWN * own)
        k = np.exp(OF_FACTOR * factor)
        yield kappa / k, second / k, kappa, second


def study(
    size: int, censored: bool, repeats: int = REPEATS, seed: int = SEED
) -> dict[tuple[str, str], Case]:
    """Return the intervals of every quantity and method, by both names."""
    cases: dict[tuple[str, str], Case] = {}
    score, most = score_function(_WearFactor()), MOST if censored else np.inf

    def add(what: str, method: str, interval: Interval) -> None:
        logarithmic = what[0] == "B" or what.startswith("ratio")
        cases.setdefault((what, method), Case(TRUE[what], logarithmic)).found.append(interval)

    for first, second, kappa, other in samples(size, repeats, seed):
        observed = first < most
        life, late = np.minimum(first, most), np.minimum(second, most)
        mixtures = FactorMixture(kappa, score), FactorMixture(other, score)
        counted = (
            CountedLives(np.where(first < most, first, np.inf)),
            CountedLives(np.where(second < most, second, np.inf)),
        )
        fit = fit_lives("log-normal", life, observed)
        assert fit is not None
        for what, share in (("B10", 0.1), ("B50", 0.5)):
            add(what, "order statistics", life_quantile(life, observed, share))
            add(what, "mixture", mixtures[0].quantile(share))
            add(what, "likelihood", fit.interval(share))
        what = "P(life < target)"
        add(what, "exact", probability_before(life, observed, TARGET))
        if mixtures[0].effective_number(TARGET) >= LEAST_NUMBER:  # others are not stated
            add(what, "mixture", mixtures[0].probability_before(TARGET))
        for method, (one, two) in (("counted", counted), ("mixture", mixtures)):
            drawn = quantile_ratio(two, one, 0.1, most, samples=500)
            add("ratio of B10", f"bootstrap, {method}", drawn)
            found = two_specimens(two, one, most)
            add("P(B > A), two specimens", method, found)
        add("P(B > A), same machine", "exact", same_machine(late, life, most))
    return cases


def one_sided_coverage(size: int, repeats: int = REPEATS, seed: int = SEED) -> float:
    """Return how often the one-sided lower bound of B10 is below it."""
    bounds = [lower_bound(life, life > 0.0, 0.1) for life, *_ in samples(size, repeats, seed)]
    return float(np.mean(np.array(bounds) <= TRUE["B10"]))


def rows(repeats: int, seed: int) -> Iterator[str]:
    """Yield the rows of the table."""
    yield "| lives | quantity | interval | coverage | width | one-sided |"
    yield "|---|---|---|---|---|---|"
    for size, part in SIZES.items():
        for censored in (False, True):
            found = study(size, censored, round(part * repeats), seed)
            for (what, method), case in found.items():
                lives = f"{size}{', censored' if censored else ''}"
                row = f"{case.coverage:.1%} | {case.width:.2f} | {case.one_sided:.0%}"
                yield f"| {lives} | {what} | {method} | {row} |"
    for size in (29, 35):
        yield f"| {size} | B10 | one-sided | {one_sided_coverage(size, repeats, seed):.1%} | | |"


if __name__ == "__main__":
    from tests.benchmarks.table import save_tables

    lines = []
    for line in rows(REPEATS, SEED):
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()
        lines.append(line)
    command = "python -m tests.uq.survival.coverage_study"
    save_tables(Path(sys.argv[1]), command, {"coverage": "\n".join(lines)})
