"""Steppers against every pass by itself: error against time, over tolerances, models and strips."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE
from wearsim_bench.contact.methods import DEFAULT_MODEL, Method, methods
from wearsim_bench.measure.measurement import Effort, Measurement, Tell, Topic
from wearsim_bench.stepping.groups import CONVERGED, Bench, of_model, of_steppers, of_strips
from wearsim_bench.stepping.runs import WearTest
from wearsim_bench.stepping.solvers import MOST_SOLVES

RIG = "rig-450min"
SPRING = {"load.kind": "spring", "load.stiffness": "690 N/mm"}
WHOLE, PART, EARLY = 450.0, 45.0, 4.5  # min
TOLERANCES = (1e-1, 1e-2, DEFAULT_TOLERANCE, 1e-4, 1e-5)
FEWER = (1e-2, DEFAULT_TOLERANCE, 1e-4)
STRIPS, EARLY_STRIPS = (25, 41, 75), (15, 25, 41)
QUICK = 0.005  # of every test
QUICK_TOLERANCES = (1e-1, DEFAULT_TOLERANCE)
ERRORS = {"depth": "depth", "profile": "profile, L2", "volume": "worn volume"}
COUNTS = {"steps": "steps", "solves": "contact solves", "truth": "truth known to"}
ABOUT = (
    "Time is that of a wear test from fresh bodies to its end, built already and with nothing"
    " recorded. Errors are those of stepping alone, at the end, against every pass by itself on the"
    " same strips, which has none of its own; where no compiled code takes every pass, against"
    f" LSODA of scipy's at a tolerance of {CONVERGED:g} with the same contact model. `truth known"
    " to` is then its own error in the profile: how far it is from BDF at that tolerance or from"
    " itself ten times as loose; an error below it is given as that. Strips are held against twice"
    " as many as there are by default, and their errors hold those of stepping too. A tolerance"
    " of wearsim's steppers is of the whole test, one of BDF and LSODA of each of their steps: the"
    " same number is not the same error. Both are given the wear per pass of the same contacts and"
    " its Jacobian by differences, which LSODA asks for only while it finds the test stiff, and"
    f" {MOST_SOLVES} contact solves at most. A way that takes more than a second is timed once."
)


@dataclass(frozen=True)
class _Group:
    """What is measured one after another, and of how many measurements it is about."""

    name: str
    measure: Callable[[], Iterator[Measurement]]
    size: int


def stepping(effort: Effort, tell: Tell) -> Topic:
    """Measure every stepper over tolerances, every contact model, and numbers of strips.

    Parameters
    ----------
    effort : Effort
    tell : callable
        Gets what is being measured, and which part is done.

    Raises
    ------
    PluginError
        If the one model that is asked for is not registered.
    """
    found: list[Measurement] = []
    groups = _groups(effort)
    total, before = sum(group.size for group in groups), 0
    for group in groups:
        tell(group.name, before / total)
        for number, item in enumerate(group.measure(), start=1):
            found.append(item)
            part = min(number, group.size)
            tell(f"{group.name}: {item.method}, {item.setting}", (before + part) / total)
        before += group.size
    return Topic(
        name="stepping",
        title="Whole wear tests: every stepper, tolerance and number of strips",
        about=ABOUT,
        seconds="one test",
        error="profile",
        errors=ERRORS,
        counts=COUNTS,
        measurements=tuple(found),
    )


def _groups(effort: Effort) -> list[_Group]:
    share, repetitions = QUICK if effort.quick else 1.0, effort.repetitions
    whole, part, early = (share * minutes for minutes in (WHOLE, PART, EARLY))
    asked = methods(effort.plugin)
    host = Method(effort.plugin or DEFAULT_MODEL)
    tests = {
        f"rig, {whole:g} min": (WearTest(RIG, whole), TOLERANCES),
        f"spring, {part:g} min": (WearTest(RIG, part, SPRING), FEWER),
        f"three rollers, {part:g} min": (WearTest("rig-three-rollers", part), FEWER),
    }
    groups = []
    for name, (test, tolerances) in tests.items():
        chosen = QUICK_TOLERANCES if effort.quick else tolerances
        steppers = partial(of_steppers, Bench(name, test, host, repetitions), chosen)
        groups.append(_Group(name, steppers, 1 + 5 * len(chosen)))
    models = f"contact models, {part:g} min"
    benches = [Bench(models, WearTest(RIG, part), method, repetitions) for method in asked]
    usual = QUICK_TOLERANCES[1:] if effort.quick else FEWER[:2]
    measured = partial(_of_models, benches, usual)
    groups.append(_Group(models, measured, len(usual) * len(benches)))
    if effort.plugin is None:
        for minutes, counts in ((whole, STRIPS), (early, EARLY_STRIPS)):
            name = f"strips, {minutes:g} min"
            bench = Bench(name, WearTest(RIG, minutes), host, repetitions)
            groups.append(_Group(name, partial(of_strips, bench, counts), 2 * len(counts) + 2))
    return groups


def _of_models(benches: Sequence[Bench], tolerances: Sequence[float]) -> Iterator[Measurement]:
    for bench in benches:
        yield from of_model(bench, tolerances)
