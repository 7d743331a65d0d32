"""Contact models against the exact theory: error against time, for every model, option and grid."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE
from wearsim.studies.run.grid import strips_over
from wearsim_bench.contact.cases import Case, all_worn_cases, elliptic_cases
from wearsim_bench.contact.methods import Method, methods, normal_methods
from wearsim_bench.contact.worn_profiles import measure, why
from wearsim_bench.exact_solutions import POWER_ERRORS, PURE_SPIN_ERROR, STRIPS_ERROR
from wearsim_bench.measure.measurement import Effort, Measurement, Tell, Topic

ELLIPTIC_STRIPS = (11, 21, 41, 81, 161)
WORN_STRIPS = (21, 41, 81, 161, 321)
#: hard cases by what b/a is greater than
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
ABOUT = (
    "Time is that of one solve from nothing, the mean over a group's contacts, strips being"
    " prepared; warm-started it begins at the solution under 1 % less load. Errors are against"
    " CONTACT's half-space solutions, whose own is"
    f" {100.0 * POWER_ERRORS[0]:g} to {100.0 * POWER_ERRORS[1]:g} % in power, up to"
    f" {100.0 * PURE_SPIN_ERROR:g} % with pure spin, and {100.0 * STRIPS_ERROR:g} % in P_l(y),"
    " nearer to which none counts as better; peak pressure and width of ellipses are against Hertz."
    " P_l(y) is the median of L2 over the strips. Strips span what the model suggests (1.2 times"
    " the patch, or the patch itself), or 8 mm with worn profiles; marches take as many steps. The"
    " two defaults are the strips of a run and of a single contact."
)
_NUMBERS = re.compile(r"[-+.\d]+")  # in which failures that are the same differ
_EVERY = 10  # of the cases are enough to show that all works


@dataclass(frozen=True)
class _Group:
    """Cases to be measured together, and how."""

    name: str
    cases: Sequence[Case]
    methods: Sequence[Method]
    strips: Sequence[int]


def contact(effort: Effort, tell: Tell) -> Topic:
    """Measure every contact model, option and number of strips.

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
    total = sum(len(group.methods) for group in groups)
    done = 0
    for group in groups:
        for method in group.methods:
            tell(f"{group.name}: {method.name}", done / total)
            found += _measured(group, method, effort)
            done += 1
    return Topic(
        name="contact",
        title="One contact: every model, option and number of strips",
        about=ABOUT,
        seconds="one contact",
        error="dissipation",
        errors=ERRORS,
        counts=COUNTS,
        measurements=tuple(found),
        floor=STRIPS_ERROR,
    )


def _groups(effort: Effort) -> list[_Group]:
    everywhere, normal = methods(effort.plugin), normal_methods(effort.plugin)
    fine, worn = (() if effort.quick else strips for strips in (ELLIPTIC_STRIPS, WORN_STRIPS))
    elliptic = {
        "fresh rig": elliptic_cases("paper"),
        "partial slip with spin": elliptic_cases("partial"),
        **_hard_cases(),
    }
    groups = [_Group(name, cases, everywhere, fine) for name, cases in elliptic.items()]
    groups.append(_Group("worn profiles", all_worn_cases(), normal, worn))
    if effort.quick:
        groups = [replace(group, cases=group.cases[::_EVERY]) for group in groups]
    return groups


def _hard_cases() -> dict[str, Sequence[Case]]:
    """Return the hard cases apart: strips are strips in long contacts alone."""
    found: dict[str, list[Case]] = {}
    for case in elliptic_cases("hard"):
        ratio = case.patch.b / case.patch.a
        name = next(name for name, least in HARD.items() if ratio > least)
        found.setdefault(name, []).append(case)
    return {name: found[name] for name in HARD}


def _measured(group: _Group, method: Method, effort: Effort) -> Iterator[Measurement]:
    """Yield a method's measurements on a group, those that fail alike as one."""
    try:
        usual = _usual_strips(method, group.cases[0])
        sizes = sorted({*group.strips, *usual})
        found = [
            replace(
                measure(group.name, group.cases, method, strips, effort.repetitions),
                default=method.default and strips in usual,
            )
            for strips in sizes
        ]
    except Exception as error:  # a plugin that cannot even be built stops nothing
        yield Measurement(group.name, method.name, "any", failed=why(error))
        return
    for failed, same in groupby(found, key=lambda item: _NUMBERS.sub("", item.failed)):
        alike = list(same)
        if failed and len(alike) > 1:
            setting = f"{alike[0].setting.removesuffix(' strips')} to {alike[-1].setting}"
            alike = [replace(alike[0], setting=setting, default=any(i.default for i in alike))]
        yield from alike


def _usual_strips(method: Method, case: Case) -> tuple[int, int]:
    """Return how many strips a run has over a case's width, and a single contact."""
    grid = case.grid(method.build())
    of_run = strips_over(grid.strips * grid.spacing, case.patch.b, DEFAULT_TOLERANCE)
    return of_run, grid.strips
