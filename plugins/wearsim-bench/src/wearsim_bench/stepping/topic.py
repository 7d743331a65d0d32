"""Steppers: error against time over tolerances, contact models and numbers of strips."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE
from wearsim_bench.contact.methods import DEFAULT_MODEL, Method, methods
from wearsim_bench.measure.measurement import Effort, Measurement, OnProgress, Topic
from wearsim_bench.stepping.groups import (
    CLOSER,
    CONVERGED,
    FINEST,
    Report,
    StepperBenchmark,
    of_model,
    of_steppers,
    of_strips,
)
from wearsim_bench.stepping.runs import WearTest
from wearsim_bench.stepping.solvers import MOST_SOLVES
from wearsim_bench.stepping.turns import LONG, NEGLIGIBLE, NOTABLE, ROUNDS, TIE, conclusion

RIG = "rig-450min"
SPRING = {"load.kind": "spring", "load.stiffness": "690 N/mm"}
WHOLE, PART, EARLY = 450.0, 45.0, 4.5  # lengths of tests [min]
TOLERANCES = (1e-1, 1e-2, DEFAULT_TOLERANCE, 1e-4, 1e-5)
FEWER = (1e-1, 1e-2, DEFAULT_TOLERANCE, 1e-4)
#: tolerances of the default stepper
FINER = (1e-1, 5e-2, 2e-2, 1e-2, 5e-3, 2e-3, DEFAULT_TOLERANCE, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)
STRIPS, EARLY_STRIPS = (25, 41, 75), (15, 25, 41)
QUICK = 0.005  # fraction of every test
QUICK_TOLERANCES = (1e-1, DEFAULT_TOLERANCE)
OF_STEPS = (
    "Errors are those of the steps, against a converged run with the same contact model;"
    " `wearsim bench contact` measures the errors of the models."
)
ERRORS = {"depth": "depth", "profile": "profile, L2", "volume": "worn volume"}
COUNTS = {"steps": "steps", "solves": "contact solves", "truth": "error of reference"}
ABOUT = (
    "Time is that of a wear test from fresh bodies to its end, without preparation and records."
    " Errors are those of stepping at the end of the test, relative to individually solved passes"
    " on the same strips, which have no stepping error. If the loop over passes is not compiled,"
    f" the reference is LSODA of scipy at a tolerance of {CONVERGED:g} with the same contact model."
    " The error of this reference is the difference of its profile from that of BDF at the same"
    " tolerance, or of LSODA at ten times the tolerance; smaller errors are replaced by it. The"
    f" reference for numbers of strips has {FINEST} times the default number and is computed by"
    f" LSODA at a tolerance of {CLOSER:g}; its error is the larger of the differences from half as"
    " many strips and from ten times the tolerance, and the errors include those of stepping. A"
    " tolerance of the steppers of wearsim applies to the whole test, one of BDF and LSODA to each"
    " step, so that equal tolerances do not mean equal errors. BDF and LSODA use the wear per pass"
    " of the same contacts and its Jacobian by finite differences, which LSODA requires only while"
    f" the problem is stiff, and at most {MOST_SOLVES} contact solves. The methods of a group are"
    " timed in turns; times"
    f" are medians of {ROUNDS} rounds, of one round for a method that takes more than {LONG:g} s."
    f" A setting of BDF or LSODA with a profile error of {100.0 * NOTABLE:g} % or more is dominated"
    " if some setting of the default stepper is as fast, by the median of the ratios of paired"
    " times, and as near in depth, profile and volume, all within a factor of"
    f" {TIE:g}; errors below {NEGLIGIBLE:g} count as that. Of one that is not dominated, the"
    " nearest setting is given with its largest ratio."
)


@dataclass(frozen=True)
class _Group:
    """A group of measurements and its approximate number of measurements."""

    name: str
    measure: Callable[[Report], list[Measurement]]
    size: int
    remark: str = ""


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
    conclusions: dict[str, str] = {}
    groups = _groups(effort)
    total, completed = sum(group.size for group in groups), 0
    for group in groups:
        done = 0

        def report(what: str, group: _Group = group, completed: int = completed) -> None:
            nonlocal done
            on_progress(f"{group.name}: {what}", (completed + min(done, group.size)) / total)
            done += 1

        items = group.measure(report)
        measurements += items
        texts = conclusion(items, DEFAULT_TOLERANCE), group.remark
        conclusions[group.name] = " ".join(filter(None, texts))
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
        conclusions={group: text for group, text in conclusions.items() if text},
        timing="timed once" if effort.quick else f"median of {ROUNDS}",
    )


def _groups(effort: Effort) -> list[_Group]:
    share, rounds = (QUICK, 1) if effort.quick else (1.0, ROUNDS)
    whole, part, early = (share * minutes for minutes in (WHOLE, PART, EARLY))
    default = Method(effort.plugin or DEFAULT_MODEL)
    tests = {
        f"rig, {whole:g} min": (WearTest(RIG, whole), TOLERANCES),
        f"spring, {part:g} min": (WearTest(RIG, part, SPRING), FEWER),
        f"three rollers, {part:g} min": (WearTest("rig-three-rollers", part), FEWER),
    }
    finer = QUICK_TOLERANCES if effort.quick else FINER
    groups = []
    for name, (test, tolerances) in tests.items():
        chosen = QUICK_TOLERANCES if effort.quick else tolerances

        def steppers(
            report: Report,
            name: str = name,
            test: WearTest = test,
            chosen: Sequence[float] = chosen,
        ) -> list[Measurement]:
            bench = StepperBenchmark(name, test, default, rounds, report)
            return of_steppers(bench, chosen, finer)

        groups.append(_Group(name, steppers, 2 + 4 * len(chosen) + len(finer)))
    models, usual = methods(effort.plugin), QUICK_TOLERANCES[1:] if effort.quick else FEWER[1:3]
    title = f"contact models, {part:g} min"

    def all_models(report: Report) -> list[Measurement]:
        benches = (
            StepperBenchmark(title, WearTest(RIG, part), method, rounds, report)
            for method in models
        )
        return [item for bench in benches for item in of_model(bench, usual)]

    size = (2 + len(usual)) * len(models)
    groups.append(_Group(title, all_models, size, OF_STEPS))
    if effort.plugin is None:
        decades = QUICK_TOLERANCES if effort.quick else FINER
        for minutes, counts in ((whole, STRIPS), (early, EARLY_STRIPS)):
            name = f"strips, {minutes:g} min"

            def strips(
                report: Report,
                name: str = name,
                minutes: float = minutes,
                counts: Sequence[int] = counts,
            ) -> list[Measurement]:
                bench = StepperBenchmark(name, WearTest(RIG, minutes), default, rounds, report)
                return of_strips(bench, counts, decades)

            size = 2 + (len(decades) + 1) * (len(counts) + 1)
            groups.append(_Group(name, strips, size))
    return groups
