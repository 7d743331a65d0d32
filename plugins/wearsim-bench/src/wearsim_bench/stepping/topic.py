"""Steppers: error against time over tolerances, contact models and numbers of strips."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE
from wearsim_bench.contact.methods import DEFAULT_MODEL, Method, methods
from wearsim_bench.measure.measurement import Effort, Measurement, OnProgress, Topic
from wearsim_bench.stepping.groups import (
    CONVERGED,
    StepperBenchmark,
    of_model,
    of_steppers,
    of_strips,
)
from wearsim_bench.stepping.runs import WearTest
from wearsim_bench.stepping.solvers import MOST_SOLVES

RIG = "rig-450min"
SPRING = {"load.kind": "spring", "load.stiffness": "690 N/mm"}
WHOLE, PART, EARLY = 450.0, 45.0, 4.5  # min
TOLERANCES = (1e-1, 1e-2, DEFAULT_TOLERANCE, 1e-4, 1e-5)
FEWER = (1e-2, DEFAULT_TOLERANCE, 1e-4)
STRIPS, EARLY_STRIPS = (25, 41, 75), (15, 25, 41)
QUICK = 0.005  # fraction of every test
QUICK_TOLERANCES = (1e-1, DEFAULT_TOLERANCE)
ERRORS = {"depth": "depth", "profile": "profile, L2", "volume": "worn volume"}
COUNTS = {"steps": "steps", "solves": "contact solves", "truth": "error of reference"}
ABOUT = (
    "Time is that of a wear test from fresh bodies to its end, without preparation and records."
    " Errors are those of stepping at the end of the test, relative to individually solved passes"
    " on the same strips, which have no stepping error. If the loop over passes is not compiled,"
    f" the reference is LSODA of scipy at a tolerance of {CONVERGED:g} with the same contact model."
    " The error of this reference is the difference of its profile from that of BDF at the same"
    " tolerance, or of LSODA at ten times the tolerance; smaller errors are replaced by it. The"
    " reference for numbers of strips has twice the default number, and these errors include those"
    " of stepping. A tolerance of the steppers of wearsim applies to the whole test, one of BDF and"
    " LSODA to each step, so that equal tolerances do not mean equal errors. BDF and LSODA use the"
    " wear per pass of the same contacts and its Jacobian by finite differences, which LSODA"
    f" requires only while the problem is stiff, and at most {MOST_SOLVES} contact solves. A method"
    " that takes more than a second is timed once."
)


@dataclass(frozen=True)
class _Group:
    """A group of measurements and its approximate number of measurements."""

    name: str
    measure: Callable[[], Iterator[Measurement]]
    size: int


def stepping(effort: Effort, on_progress: OnProgress) -> Topic:
    """Measure all steppers over tolerances, all contact models, and numbers of strips.

    Parameters
    ----------
    effort : Effort
        Number of cases and repetitions.
    on_progress : callable
        Called with a description and the completed fraction.

    Raises
    ------
    PluginError
        If the requested contact model is not registered.
    """
    measurements: list[Measurement] = []
    groups = _groups(effort)
    total, completed = sum(group.size for group in groups), 0
    for group in groups:
        on_progress(group.name, completed / total)
        for number, item in enumerate(group.measure(), start=1):
            measurements.append(item)
            part = min(number, group.size)
            on_progress(f"{group.name}: {item.method}, {item.setting}", (completed + part) / total)
        completed += group.size
    return Topic(
        name="stepping",
        title="Wear tests: steppers, tolerances and numbers of strips",
        about=ABOUT,
        seconds="one test",
        error="profile",
        errors=ERRORS,
        counts=COUNTS,
        measurements=tuple(measurements),
    )


def _groups(effort: Effort) -> list[_Group]:
    share, repetitions = QUICK if effort.quick else 1.0, effort.repetitions
    whole, part, early = (share * minutes for minutes in (WHOLE, PART, EARLY))
    models = methods(effort.plugin)
    default = Method(effort.plugin or DEFAULT_MODEL)
    tests = {
        f"rig, {whole:g} min": (WearTest(RIG, whole), TOLERANCES),
        f"spring, {part:g} min": (WearTest(RIG, part, SPRING), FEWER),
        f"three rollers, {part:g} min": (WearTest("rig-three-rollers", part), FEWER),
    }
    groups = []
    for name, (test, tolerances) in tests.items():
        chosen = QUICK_TOLERANCES if effort.quick else tolerances
        steppers = partial(of_steppers, StepperBenchmark(name, test, default, repetitions), chosen)
        groups.append(_Group(name, steppers, 1 + 5 * len(chosen)))
    title = f"contact models, {part:g} min"
    benches = [
        StepperBenchmark(title, WearTest(RIG, part), method, repetitions) for method in models
    ]
    usual = QUICK_TOLERANCES[1:] if effort.quick else FEWER[:2]
    measured = partial(_of_models, benches, usual)
    groups.append(_Group(title, measured, len(usual) * len(benches)))
    if effort.plugin is None:
        for minutes, counts in ((whole, STRIPS), (early, EARLY_STRIPS)):
            name = f"strips, {minutes:g} min"
            bench = StepperBenchmark(name, WearTest(RIG, minutes), default, repetitions)
            groups.append(_Group(name, partial(of_strips, bench, counts), 2 * len(counts) + 2))
    return groups


def _of_models(
    benches: Sequence[StepperBenchmark], tolerances: Sequence[float]
) -> Iterator[Measurement]:
    for bench in benches:
        yield from of_model(bench, tolerances)
