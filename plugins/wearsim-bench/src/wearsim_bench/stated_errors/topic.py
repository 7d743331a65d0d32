"""Stated errors of random wear tests, compared with their true errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from wearsim_bench.measure.measurement import Effort, Measurement, OnProgress, Topic
from wearsim_bench.stated_errors.random_tests import random_test
from wearsim_bench.stated_errors.study import (
    QUANTITIES,
    SMALL,
    STATED,
    TESTS,
    coverage,
    measured,
    worst,
)
from wearsim_bench.stepping.groups import CONVERGED

NUMBER, QUICK_NUMBER = 40, 6  # of tests
QUICK_SHARE = 0.02  # of the passes
UNCOVERED = "not covered, {}"
WORST = 5  # tests listed for each quantity
ERRORS = {
    prefix + name: head.format(name)
    for name in QUANTITIES
    for prefix, head in (("", "{}, true"), (STATED, "{}, stated"))
}
COUNTS = {
    "tests": "tests",
    "covered": "covered",
    "q05": "ratio, 5 %",
    "q25": "25 %",
    "median": "median",
    "q75": "75 %",
    "q95": "95 %",
    "met": "tolerance met",
    "steps": "steps",
    "solves": "contact solves",
    "first": "first pass",
}
ABOUT = (
    "Random wear tests of the default stepper: passes, load, crown radius, wear factors, friction,"
    " creepage, angles, springs, thermal terms, logged and random loads, wear laws, wear of both"
    " bodies, several rollers, free rollers, and inputs drawn at every pass, each with a tolerance"
    " of 1e-2, 1e-3 or 1e-4. True errors are relative to individually solved passes on the same"
    " strips. If the loop over passes is not compiled and the passes are many, the reference is"
    f" LSODA of scipy at a tolerance of {CONVERGED:g}. Stated errors are the estimates at the end"
    " of a test. Depth is the greatest depth, profile the L2 norm over all bodies. A test is"
    f" covered if the stated error is at least the true one, or the true one is below {SMALL:g}."
    f" Ratios, of stated to true errors, are those of tests with a true error above {SMALL:g}."
    " First pass is the depth that it wears off, relative to the final depth: half of it bounds the"
    " difference between individual passes and continuous wear. The tests whose true error exceeds"
    " the stated one most are listed with their settings."
)


def stated_errors(
    effort: Effort,
    on_progress: OnProgress,
    seed: int = 1,
    number: int | None = None,
    references: Path | None = None,
) -> Topic:
    """Compare stated with true errors of random tests.

    Parameters
    ----------
    effort : Effort
        Number of cases and repetitions.
    on_progress : callable
        Called with a description and the completed fraction.
    seed : int
        Seed of the tests.
    number : int, optional
        Number of tests.
    references : Path, optional
        Folder in which references are kept; they do not depend on the stepper.
    """
    number = number or (QUICK_NUMBER if effort.quick else NUMBER)
    share = QUICK_SHARE if effort.quick else 1.0
    tests = [random_test(seed, place, share) for place in range(number)]
    rows = []
    for test in tests:
        rows.append(measured(test, references))
        on_progress(f"test {len(rows)} of {number}", len(rows) / number)
    summary = statistics(rows)
    settings = {test.name: test.settings for test in tests}
    described = {
        group: "\n".join(f"- {row.method}: {settings[row.method]}" for row in summary[group])
        for group in (*map(UNCOVERED.format, QUANTITIES), TESTS)
        if group in summary
    }
    return Topic(
        name="stated-errors",
        title=f"Stated and true errors of {number} random wear tests, seed {seed}",
        about=ABOUT,
        seconds="one test",
        error="profile",
        errors=ERRORS,
        counts=COUNTS,
        measurements=tuple(item for items in summary.values() for item in items),
        details=(TESTS,),
        conclusions=described,
        timing="timed once",
    )


def statistics(rows: Sequence[Measurement]) -> dict[str, list[Measurement]]:
    """Return the measurements by group: statistics, the worst tests, and all tests.

    Parameters
    ----------
    rows : sequence of Measurement
        Results of `measured`.
    """
    tests = {"all tests": list(rows)}
    tolerances = {row.counts["tolerance"] for row in rows if not row.failed}
    for tolerance in sorted(tolerances, reverse=True):
        same = [row for row in rows if row.counts.get("tolerance") == tolerance]
        tests[f"tolerance {tolerance:g}"] = same
    groups = {
        group: [
            Measurement(group, name, "", counts=coverage(some, name).counts) for name in QUANTITIES
        ]
        for group, some in tests.items()
    }
    for name in QUANTITIES:
        group = UNCOVERED.format(name)
        groups[group] = [
            replace(row, group=group, seconds=None) for row in worst(rows, name, WORST)
        ]
    failed = [replace(row, group="failed") for row in rows if row.failed]
    return {group: items for group, items in (groups | {"failed": failed}).items() if items} | {
        TESTS: list(rows)
    }
