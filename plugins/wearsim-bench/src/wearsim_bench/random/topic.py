"""Invariants of random scenarios: how many hold, and the smallest scenarios that break one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from wearsim.errors import ScenarioError
from wearsim_bench.measure.measurement import Effort, Measurement, OnProgress, Topic
from wearsim_bench.random.invariants import EXCESS, INVARIANTS, measured
from wearsim_bench.random.scenarios import random_scenario
from wearsim_bench.random.smallest import smallest
from wearsim_bench.stated_errors.random_tests import RandomTest
from wearsim_bench.stated_errors.study import QUANTITIES, STATED, TESTS, coverage
from wearsim_bench.stated_errors.topic import (
    NUMBER,
    QUICK_NUMBER,
    results_of_tests,
    scenario_files,
)

SUMMARY = "invariants"
ERRORS = {
    prefix + name: f"{name}, {kind}"
    for name in QUANTITIES
    for prefix, kind in (("", "true"), (STATED, "stated"))
}
COUNTS = {
    "tests": "tests",
    "clear": "ended with a clear error",
    "broken": "broken",
    EXCESS: "over what is allowed",
    "covered": "covered",
    "tolerance": "tolerance",
}
ABOUT = (
    "Random scenarios over the scenario language: cylinders and cams, outer and in a groove, with"
    " every contact model of the core, loads that are constant, recorded, random or of a spring,"
    " free rollers, widths and forms of rollers, worn starts, materials, fatigue, random inputs and"
    " all steppers. Each is run once and must meet the invariants that apply to it. Scaled and"
    " mirrored tests may differ by a tenth of their stated errors, and the halves of a test by"
    " these errors; true errors are relative to a run with a tolerance of 0.03 times that of the"
    " test on three times as many strips. An error is an estimate, which a few of a hundred true"
    " errors exceed: such tests are listed too. Runs that end with a clear error are counted apart."
)


def random(
    effort: Effort,
    on_progress: OnProgress,
    seed: int = 1,
    number: int | None = None,
    jobs: int = 1,
) -> Topic:
    """Run random scenarios and report which invariants they break.

    Parameters
    ----------
    effort : Effort
        Number of cases and repetitions.
    on_progress : callable
        Called with a description and the completed fraction.
    seed : int
        Seed of the scenarios.
    number : int, optional
        Number of scenarios.
    jobs : int
        Processes in which they are run.
    """
    number = number or (QUICK_NUMBER if effort.quick else NUMBER)
    rows: dict[int, list[Measurement]] = {}
    files: dict[str, str] = {}
    work = partial(measured_scenarios, seed=seed, reduce=not effort.quick)
    for place, measurements in results_of_tests(work, number, jobs, on_progress):
        rows[place] = [row for row, _ in measurements]
        for _, reproducers in measurements:
            files |= reproducers
    return topic_of([row for place in range(number) for row in rows[place]], seed, number, files)


def measured_scenarios(
    places: Sequence[int], seed: int, *, reduce: bool
) -> list[list[tuple[Measurement, dict[str, str]]]]:
    """Measure the random scenarios of some numbers by `measured_scenario`."""
    return [measured_scenario(place, seed, reduce=reduce) for place in places]


def measured_scenario(
    place: int, seed: int, *, reduce: bool
) -> list[tuple[Measurement, dict[str, str]]]:
    """Return the measurements of a scenario by all invariants, with the files of reproducers.

    Parameters
    ----------
    place : int
        Number of the scenario.
    seed : int
        Seed of the scenarios.
    reduce : bool
        Whether reproducers are reduced, which takes up to two minutes each.
    """
    first = Measurement(TESTS, f"{seed}-{place}", next(iter(INVARIANTS)))
    try:
        test, _ = random_scenario(seed, place)
    except ScenarioError as error:
        return [(replace(first, failed=str(error)), {})]
    measurements = []
    for name in INVARIANTS:
        row = measured(name, test.scenario(), first)
        reduced = smallest(test, row) if reduce and row.failed else test
        measurements.append((row, reproducer(reduced, row) if row.failed else {}))
        if row.remark and name == first.setting:
            break  # the run itself ends with a clear error
    return measurements


def reproducer(test: RandomTest, row: Measurement) -> dict[str, str]:
    """Return the files of a scenario that breaks the invariant of a row, by name."""
    stem = f"{row.method}-{row.setting.partition(',')[0].replace(' ', '-')}"
    return {
        f"{stem}.toml" if name == "toml" else f"{stem}-{name}": text
        for name, text in scenario_files(stem, test.scenario())
    }


def topic_of(rows: Sequence[Measurement], seed: int, number: int, files: dict[str, str]) -> Topic:
    """Return the topic of the measurements of all scenarios.

    Parameters
    ----------
    rows : sequence of Measurement
        One for each scenario and invariant, see `wearsim_bench.random.invariants.measured`.
    seed, number : int
        Seed and number of the scenarios.
    files : dict of str to str
        Reproducers by name.
    """
    summary = []
    for name in INVARIANTS:
        of_invariant = [row for row in rows if row.setting == name]
        held = [row.counts[EXCESS] for row in of_invariant if EXCESS in row.counts]
        counts: dict[str, float] = {
            "tests": len(held)
            + sum(bool(row.failed) and EXCESS not in row.counts for row in of_invariant),
            "clear": sum(bool(row.remark) for row in of_invariant),
            "broken": sum(bool(row.failed) for row in of_invariant),
        }
        counts |= {EXCESS: max(held)} if held else {}
        if any(row.errors for row in of_invariant):
            covered = [
                coverage([row], quantity).covered for row in of_invariant for quantity in QUANTITIES
            ]
            counts["covered"] = sum(covered)
        summary.append(Measurement(SUMMARY, name, "", counts=counts))
    broken = [row for row in rows if row.failed]
    lines = [f"- {row.method}, {row.setting}: {row.failed}" for row in broken]
    texts = [
        f"\n{name}:\n\n```toml\n{text}```" for name, text in files.items() if name.endswith(".toml")
    ]
    return Topic(
        name="random",
        title=f"Invariants of {number} random scenarios, seed {seed}",
        about=ABOUT,
        seconds="one scenario",
        error="profile",
        errors=ERRORS,
        counts=COUNTS,
        measurements=(*summary, *rows),
        details=(TESTS,),
        conclusions={SUMMARY: "\n".join([*lines, *texts]) or "All invariants hold."},
        timing="not timed",
        files=files,
    )
