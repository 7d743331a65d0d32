"""Stated errors of random wear tests, compared with their true errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from wearsim.scenario import Scenario
from wearsim.studies.execution.factory import executor
from wearsim_bench.measure.measurement import Effort, Measurement, OnProgress, Topic
from wearsim_bench.stated_errors.observed import OBSERVED
from wearsim_bench.stated_errors.random_tests import TRUE_TOLERANCE
from wearsim_bench.stated_errors.references import SECONDS
from wearsim_bench.stated_errors.strata import STRATA, random_test
from wearsim_bench.stated_errors.study import (
    CLEAR,
    LACKS,
    QUANTITIES,
    SMALL,
    STATED,
    STEPS,
    STRIPS,
    TESTS,
    coverage,
    measured,
    worst,
)

T = TypeVar("T")
NUMBER, QUICK_NUMBER = 40, 5  # of tests
QUICK_SHARE = 0.02  # of the passes
UNCOVERED, FAILED = "not covered, {}", "without a result"
ALL, STRATUM, TOLERANCE = "all tests", "stratum {}", "tolerance {:g}"
WORST = 5  # tests listed for each quantity
#: required parts of the tests that are covered, of all tests and in each stratum; greatest true
#: error by steps over the tolerance; greatest median ratio; greatest part of clear errors
COVERED, COVERED_IN_STRATUM, MOST_BY_STEPS, MOST_RATIO, MOST_CLEAR = 0.93, 0.9, 2.0, 10.0, 0.05
MOST_LACKING = 0.05  # greatest part of tests without a reference
ERRORS = {
    prefix + name: head.format(name)
    for name in QUANTITIES
    for prefix, head in (
        ("", "{}, true"),
        (STATED, "{}, stated"),
        (STEPS, "{}, by steps"),
        (STRIPS, "{}, by strips"),
    )
} | {
    prefix + name: head.format(name.replace("_", " "))
    for name in OBSERVED
    for prefix, head in (("", "{}, true"), (STATED, "{}, stated"))
}
ALL_QUANTITIES = *QUANTITIES, *OBSERVED
COUNTS = {
    "tests": "tests",
    "failed": "without result",
    "covered": "covered",
    "q05": "ratio, 5 %",
    "q25": "25 %",
    "median": "median",
    "q75": "75 %",
    "q95": "95 %",
    "met": "tolerance met",
    "greatest": "greatest true",
    "greatest_step": "by steps / tolerance",
    "steps": "steps",
    "solves": "contact solves",
    "strips": "strips",
    "finer": "width over the reference's",
}
ABOUT = (
    "Random wear tests of the default stepper on automatic strips, in five strata: ordinary ones,"
    " adhesion (a creepage far below full slip, small rollers, light loads), loads with a spring,"
    " cams, and free rollers; with wide ranges of radii, loads, friction, creepage, wear factors,"
    " wear of both bodies, angles, offsets and durations, and tolerances of 1e-2, 1e-3 and 1e-4,"
    " after whole turns of the cylinder."
    f" True errors are relative to a solution with steps at a tolerance of {TRUE_TOLERANCE:g}, none"
    " longer than a fiftieth of the passes done, or with each pass solved individually where they"
    " are few, on finer strips. Stated errors are the estimates at the end of a run. Depth is the"
    " greatest depth, profile the L2 norm over all bodies. A test is"
    f" covered if the stated error is at least the true one, or the true one is below {SMALL:g}."
    f" Ratios, of stated to true errors, are those of tests with a true error above {SMALL:g}."
    " The error of a cam between its stations is left out, as the reference has the same stations."
    " Power, energy, forces, pressure, width, descent, approach and the lift error of a cam are"
    " compared with those that the reference records; errors of angles are in radians."
    " The true errors by steps alone, on the strips of the run, and by strips alone, without"
    " stepping error, are given for every test; with inputs drawn at every pass the former contain"
    " the scatter of the draws, and are not compared with the tolerance. Tests that end with a"
    " clear error are counted apart, and so are those without a reference, as after"
    f" {SECONDS:g} s of processor time. The"
    " tests whose true error exceeds the stated one most are listed with their settings,"
    " and their scenarios are written to files."
)


def stated_errors(
    effort: Effort,
    on_progress: OnProgress,
    seed: int = 1,
    number: int | None = None,
    references: Path | None = None,
    jobs: int = 1,
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
    jobs : int
        Processes in which tests are run.
    """
    number = number or (QUICK_NUMBER if effort.quick else NUMBER)
    share = QUICK_SHARE if effort.quick else 1.0
    tests = [random_test(seed, place, share) for place in range(number)]
    work = partial(measured_tests, seed=seed, share=share, references=references)
    rows = dict(results_of_tests(work, number, jobs, on_progress))
    summary = statistics([rows[place] for place in range(number)])
    settings = {test.name: test.settings for test in tests}
    described = {
        group: "\n".join(f"- {row.method}: {settings[row.method]}" for row in summary[group])
        for group in (*map(UNCOVERED.format, ALL_QUANTITIES), FAILED, TESTS)
        if group in summary
    }
    described[ALL] = requirements(list(rows.values()))
    missed = [group for group in described if group not in (ALL, TESTS)]
    listed = {row.method for group in missed for row in summary[group]}
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
        files={
            f"{test.name}-{name}" if name != "toml" else f"{test.name}.toml": text
            for test in tests
            if test.name in listed
            for name, text in scenario_files(test.name, test.scenario())
        },
    )


def results_of_tests(
    work: Callable[[Sequence[int]], list[T]], number: int, jobs: int, on_progress: OnProgress
) -> Iterator[tuple[int, T]]:
    """Yield the number and the result of every test, in the order in which they end.

    Parameters
    ----------
    work : callable
        Returns the results of some tests, by number.
    number : int
        Number of tests.
    jobs : int
        Processes in which they are run.
    on_progress : callable
        Called with a description and the completed fraction.
    """
    scheduler, done = "serial" if jobs == 1 else "processes", 0
    with executor(scheduler, None if jobs == 1 else jobs, realisations=number) as processes:
        for places, results in processes.results(work, iter([place] for place in range(number))):
            for place, result in zip(places, results, strict=True):
                done += 1
                yield place, result
            on_progress(f"test {done} of {number}", done / number)


def scenario_files(name: str, scenario: Scenario) -> list[tuple[str, str]]:
    """Return the text of a scenario as "toml", and its files, which carry the name of the test."""
    text = scenario.text
    for file in scenario.files:
        text = text.replace(f'"{file}"', f'"{name}-{file}"')
    return [("toml", text), *scenario.files.items()]


def measured_tests(
    places: Sequence[int], seed: int, share: float, references: Path | None
) -> list[Measurement]:
    """Return the measurements of some tests, by number."""
    return [measured(random_test(seed, place, share), references) for place in places]


def requirements(rows: Sequence[Measurement]) -> str:
    """Return which requirements the stated errors meet, one per line."""
    counted = [row for row in rows if not row.failed.startswith((CLEAR, LACKS))]
    lines = []
    for name in ALL_QUANTITIES:
        statistics = coverage(counted, name)
        if not statistics.true and name in OBSERVED:
            continue
        part = statistics.covered / max(len(statistics.true), 1)
        lines.append(_verdict(part >= COVERED, f"{name} covered in {part:.1%} of the tests"))
        median = statistics.counts.get("median", 0.0)
        if name in QUANTITIES:
            ratio = f"{name}: median of stated/true {median:.3g}"
            lines.append(_verdict(median < MOST_RATIO, ratio))
        for stratum in dict.fromkeys(row.setting for row in counted):
            of_stratum = [row for row in counted if row.setting == stratum]
            statistics = coverage(of_stratum, name)
            part = statistics.covered / max(len(statistics.true), 1)
            if statistics.true and part < COVERED_IN_STRATUM:
                lines.append(_verdict(False, f"{name} covered in {part:.1%} of '{stratum}'"))
    steps = max(coverage(counted, name).greatest_step for name in QUANTITIES)
    lines.append(_verdict(steps <= MOST_BY_STEPS, f"errors by steps up to {steps:.3g} tolerances"))
    clear = sum(row.failed.startswith(CLEAR) for row in rows)
    lines.append(
        _verdict(clear <= MOST_CLEAR * len(rows), f"{clear} of {len(rows)} end with an error")
    )
    lacking = sum(row.failed.startswith(LACKS) for row in rows)
    lines.append(
        _verdict(lacking <= MOST_LACKING * len(rows), f"{lacking} of {len(rows)} lack a reference")
    )
    return "\n".join(lines)


def _verdict(holds: bool, what: str) -> str:
    return f"- {'met' if holds else 'NOT MET'}: {what}"


def statistics(rows: Sequence[Measurement]) -> dict[str, list[Measurement]]:
    """Return the measurements by group: statistics, the worst tests, and all tests.

    Parameters
    ----------
    rows : sequence of Measurement
        Results of `measured`.
    """
    tests = {ALL: list(rows)}
    for stratum in STRATA:
        tests[STRATUM.format(stratum)] = [row for row in rows if row.setting == stratum]
    tolerances = {row.counts["tolerance"] for row in rows if not row.failed}
    for tolerance in sorted(tolerances, reverse=True):
        of_tolerance = [row for row in rows if row.counts.get("tolerance") == tolerance]
        tests[TOLERANCE.format(tolerance)] = of_tolerance
    groups = {}
    for group, of_group in tests.items():
        lost = {"failed": sum(bool(row.failed) for row in of_group)}
        if of_group:
            groups[group] = [
                Measurement(group, name, "", counts=coverage(of_group, name).counts | lost)
                for name in ALL_QUANTITIES
                if name in QUANTITIES or coverage(of_group, name).true
            ]
    for name in ALL_QUANTITIES:
        group = UNCOVERED.format(name)
        groups[group] = [
            replace(row, group=group, seconds=None) for row in worst(rows, name, WORST)
        ]
    groups[FAILED] = [replace(row, group=FAILED) for row in rows if row.failed]
    return {group: items for group, items in groups.items() if items} | {TESTS: list(rows)}
