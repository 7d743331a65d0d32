"""True and stated errors of random tests, and their statistics."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wearsim.evolution.error_estimates import greatest_depth, volume_of
from wearsim.evolution.state import fresh_state
from wearsim_bench.contact.worn_profiles import failure_reason
from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.stated_errors.random_tests import RandomTest
from wearsim_bench.stated_errors.references import reference_of
from wearsim_bench.stepping.runs import EndState, PreparedTest, errors_of

QUANTITIES = ("depth", "profile", "volume")
STATED = "stated_"  # prefix of the stated error of a quantity
TESTS = "tests"  # group of the measurements of single tests
SMALL = 1e-6  # true errors below it count as covered, and have no ratio
QUANTILES = {"q05": 0.05, "q25": 0.25, "median": 0.5, "q75": 0.75, "q95": 0.95}


def measured(test: RandomTest, folder: Path | None) -> Measurement:
    """Return time, true and stated errors of a random test, or the reason of its failure.

    Parameters
    ----------
    test : RandomTest
        The test.
    folder : Path, optional
        Folder of the references, see `reference_of`.
    """
    row = Measurement(TESTS, test.name, f"tolerance {test.tolerance:g}")
    try:
        reference = reference_of(test, folder)
        prepared = PreparedTest(test.scenario(), reference.grid)
        start = time.perf_counter()
        end = prepared.stepped(prepared.stop)
        seconds = time.perf_counter() - start
        true = errors_of(end, reference.as_end_of(end))
        errors = {**true, **{STATED + name: value for name, value in stated(end).items()}}
    except Exception as error:
        return Measurement(TESTS, row.method, row.setting, failed=failure_reason(error))
    counts = {
        "tolerance": test.tolerance,
        "steps": int(end.state.steps[0]),
        "solves": int(end.state.solves[0]),
        "first": first_pass(prepared, end),
        "reference_seconds": float(reference.seconds),
    }
    return row.with_results(seconds, errors, counts)


def stated(end: EndState) -> dict[str, float]:
    """Return the stated relative errors of a final state, by quantity."""
    state, depths = end.state, end.state.depths
    depth = float((state.depth_error / greatest_depth(depths))[0])
    volume = float((state.volume_error / volume_of(end.problem, depths))[0])
    # without an estimate of the profile that of the depth is taken
    profile = float(getattr(state, "profile_error", [depth])[0])
    return {"depth": depth, "profile": profile, "volume": volume}


def first_pass(prepared: PreparedTest, end: EndState) -> float:
    """Return the depth that the first pass wears off over the final depth.

    Half of it bounds the difference between passes solved individually and wear as a continuous
    function of the passes, which no step estimates.
    """
    problem, state = prepared.problem, fresh_state(prepared.problem)
    rates = problem.sum_of_parts(*problem.wear_parts(state.contacts, 1.0))
    return float((greatest_depth(rates) / greatest_depth(end.state.depths))[0])


@dataclass(frozen=True)
class Coverage:
    """Statistics of the stated errors of one quantity.

    Parameters
    ----------
    true, stated, tolerances : sequence of float
        Relative errors of every test, and its tolerance.
    """

    true: Sequence[float]
    stated: Sequence[float]
    tolerances: Sequence[float]

    @property
    def covered(self) -> int:
        """Tests with a stated error of at least the true one, or a true error below `SMALL`."""
        return sum(s >= t or t < SMALL for s, t in zip(self.stated, self.true, strict=True))

    @property
    def met(self) -> int:
        """Tests with a true error within their tolerance."""
        return sum(t <= limit for t, limit in zip(self.true, self.tolerances, strict=True))

    @property
    def ratios(self) -> list[float]:
        """Stated over true errors, where the true error is above `SMALL`."""
        return [s / t for s, t in zip(self.stated, self.true, strict=True) if t > SMALL]

    @property
    def counts(self) -> dict[str, float]:
        """The statistics by name."""
        ratios = self.ratios
        numbers = {"tests": len(self.true), "covered": self.covered, "met": self.met}
        quantiles = np.quantile(ratios, list(QUANTILES.values())) if ratios else ()
        return {**numbers, **dict(zip(QUANTILES, map(float, quantiles), strict=False))}


def coverage(rows: Sequence[Measurement], quantity: str) -> Coverage:
    """Return the statistics of a quantity over tests that have not failed."""
    done = [row for row in rows if not row.failed]
    return Coverage(
        [row.errors[quantity] for row in done],
        [row.errors[STATED + quantity] for row in done],
        [row.counts["tolerance"] for row in done],
    )


def worst(rows: Sequence[Measurement], quantity: str, count: int) -> list[Measurement]:
    """Return the tests with the greatest ratios of true to stated error, in decreasing order."""

    def ratio(row: Measurement) -> float:
        true, own = row.errors[quantity], row.errors[STATED + quantity]
        return float("inf") if true < SMALL else own / true

    done = [row for row in rows if not row.failed]
    return [row for row in sorted(done, key=ratio)[:count] if ratio(row) < 1.0]
