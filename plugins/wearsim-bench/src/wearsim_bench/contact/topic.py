"""Error against time of all contact models, options and numbers of strips."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from wearsim.errors import ContactError
from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE
from wearsim.studies.run.grid import strips_over
from wearsim_bench.contact.against import solved_by
from wearsim_bench.contact.cases import Case, all_worn_cases, elliptic_cases
from wearsim_bench.contact.methods import Method, is_reference, methods, normal_methods
from wearsim_bench.contact.worn_profiles import failure_reason, measure
from wearsim_bench.exact_solutions import POWER_ERRORS, PURE_SPIN_ERROR, STRIPS_ERROR
from wearsim_bench.measure.measurement import Effort, Measurement, OnProgress, Topic

ELLIPTIC_STRIPS = (11, 21, 41, 81, 161)
WORN_STRIPS = (21, 41, 81, 161, 321)
#: groups of hard cases by the lower bound of b/a
HARD = {
    "hard cases, b/a 5 to 30": 3.0,
    "hard cases, b/a 0.5 to 2": 0.3,
    "hard cases, b/a 0.1": 0.0,
}
ERRORS = {
    "power": "power, rms",
    "worst_power": "power, worst",
    "dissipation": "P_l(y), L2",
    "width": "width, rms",
    "peak_pressure": "peak pressure, rms",
}
COUNTS = {"warm_seconds": "warm-started", "prepare_seconds": "first prepared"}
_TIMES = (
    "The time is that of one solve without a starting solution, by a model that has been built for"
    " its strips; it is the mean over the contacts of a group. A warm start begins with the"
    " solution under a load that is 1 % lower."
)
ABOUT = (
    f"{_TIMES} Errors are relative to half-space solutions by"
    " CONTACT, whose own errors are"
    f" {100.0 * POWER_ERRORS[0]:g} to {100.0 * POWER_ERRORS[1]:g} % in power, up to"
    f" {100.0 * PURE_SPIN_ERROR:g} % with pure spin, and {100.0 * STRIPS_ERROR:g} % in P_l(y);"
    " models that differ by less than that are not ranked. The peak pressure and the width of"
    " elliptic contacts are compared with Hertz. The error of P_l(y) is the median over the"
    " contacts of the L2 error over the strips. The strips cover the width that the model suggests"
    " (1.2 times the patch, or the patch), or 8 mm for worn profiles; theories that march along"
    " rolling take as many steps as there are strips. The two default numbers of strips are those"
    " of a run and of a single contact."
)
_NUMBERS = re.compile(r"[-+.\d]+")  # ignored when failures are compared
_EVERY = 10  # stride of the cases of a quick benchmark, and with a reference model


@dataclass(frozen=True)
class _Group:
    """Cases of a group, with methods and numbers of strips."""

    name: str
    cases: Sequence[Case]
    methods: Sequence[Method]
    strips: Sequence[int]


def contact(effort: Effort, on_progress: OnProgress) -> Topic:
    """Measure every contact model, option and number of strips.

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
    slow = is_reference(effort.plugin)
    stride = _EVERY if effort.quick or slow else 1
    # without the finest strips, on which a reference takes seconds a contact
    groups, about, floor = _groups(effort, stride, -1 if slow else None), ABOUT, STRIPS_ERROR
    if effort.against is not None:
        groups, floor = _solved_by(groups, effort.against, on_progress)
        about = (
            f"{_TIMES} Errors are relative to '{effort.against}' on the default strips, whose own"
            f" error of P_l(y) is {100.0 * floor:.2g} % (median over the contacts)."
        )
    if stride > 1:
        about += f" Of the contacts of each group one in {stride} is measured."
    total = sum(len(group.methods) for group in groups)
    done = 0
    for group in groups:
        for method in group.methods:
            on_progress(f"{group.name}: {method.name}", done / total)
            measurements += _measured(group, method, effort)
            done += 1
    return Topic(
        name="contact",
        title="One contact: every model, option and number of strips",
        about=about,
        seconds="one contact",
        error="dissipation",
        errors=ERRORS,
        counts=COUNTS,
        measurements=tuple(measurements),
        floor=floor,
    )


def _groups(effort: Effort, stride: int, until: int | None) -> list[_Group]:
    all_methods, normal = methods(effort.plugin), normal_methods(effort.plugin)
    every = ELLIPTIC_STRIPS[:until], WORN_STRIPS[:until]
    fine, worn = ((), ()) if effort.quick else every
    elliptic = {
        "fresh rig": elliptic_cases("paper"),
        "partial slip with spin": elliptic_cases("partial"),
        **_hard_cases(),
    }
    groups = [_Group(name, cases, all_methods, fine) for name, cases in elliptic.items()]
    groups.append(_Group("worn profiles", all_worn_cases(), normal, worn))
    return [replace(group, cases=group.cases[::stride]) for group in groups]


def _solved_by(
    groups: Sequence[_Group], reference: str, on_progress: OnProgress
) -> tuple[list[_Group], float]:
    """Return the groups with the contacts that a reference solves, and its median error.

    Raises
    ------
    ContactError
        If it solves none of them.
    """
    total = sum(len(group.cases) for group in groups)
    errors: list[float] = []
    solved_groups: list[_Group] = []
    failure = ContactError(f"'{reference}' solves none of the contacts")
    for group in groups:
        cases = []
        for case in group.cases:
            on_progress(f"{reference}: {case.name}", len(errors) / total)
            try:
                solved, error = solved_by(case, reference)
            except ContactError as unsolved:
                failure = unsolved
                continue
            cases.append(solved)
            errors.append(error)
        solved_groups += [replace(group, cases=cases)] if cases else []
    if not errors:
        raise failure
    return solved_groups, float(np.median(errors))


def _hard_cases() -> dict[str, Sequence[Case]]:
    """Return the hard cases in groups of b/a, since strip theory holds for long contacts only."""
    groups: dict[str, list[Case]] = {}
    for case in elliptic_cases("hard"):
        ratio = case.patch.b / case.patch.a
        name = next(name for name, least in HARD.items() if ratio > least)
        groups.setdefault(name, []).append(case)
    return {name: groups[name] for name in HARD}


def _measured(group: _Group, method: Method, effort: Effort) -> Iterator[Measurement]:
    """Yield the measurements of a method on a group; identical failures are merged."""
    try:
        usual = _usual_strips(method, group.cases[0])
        sizes = sorted({*group.strips, *usual})
        measured = [
            replace(
                measure(group.name, group.cases, method, strips, effort.repetitions),
                default=method.default and strips in usual,
            )
            for strips in sizes
        ]
    except Exception as error:  # a faulty plugin must not stop the benchmark
        yield Measurement(group.name, method.name, "any", failed=failure_reason(error))
        return
    for failed, same in groupby(measured, key=lambda item: _NUMBERS.sub("", item.failed)):
        merged = list(same)
        if failed and len(merged) > 1:
            setting = f"{merged[0].setting.removesuffix(' strips')} to {merged[-1].setting}"
            merged = [replace(merged[0], setting=setting, default=any(i.default for i in merged))]
        yield from merged


def _usual_strips(method: Method, case: Case) -> tuple[int, int]:
    """Return the default numbers of strips of a run and of a single contact."""
    grid = case.grid(method.choice())
    of_run = strips_over(grid.strips * grid.spacing, case.patch.b, DEFAULT_TOLERANCE)
    return of_run, grid.strips
