"""The verdict on one hard case: its runs, what they are measured by, and the bounds."""

from __future__ import annotations

from collections.abc import Iterator

from wearsim.errors import WearsimError
from wearsim.results import Result
from wearsim.scenario import Scenario
from wearsim_bench.hard_cases import measures
from wearsim_bench.hard_cases.cases import HardCase
from wearsim_bench.hard_cases.runs import Plan, is_symmetric
from wearsim_bench.hard_cases.verdict import Check, Verdict

ROUND_OFF = 1e-9  # of sums over some hundred strips and steps, with room for their condition
UNSTEADY = 0.05  # energy by the power at the ends of half steps, where the load changes meanwhile
SMOOTH, ROUGH = 0.03, 0.1  # second difference of a smooth contact of 20 strips, and of waves
NEAR, NEAR_ROUGH = 0.02, 0.05  # change from refinement, and where the profile itself jumps
SIZE = 2.0  # times a tolerance: an estimate tells the size of an error, not the error itself
NOISE_OF_STEPS, NOISE_OF_STRIPS = 2e-3, 3e-3  # below these changes no order is asked for


def judged(case: HardCase, plan: Plan) -> Verdict:
    """Return the verdict on a hard case.

    Parameters
    ----------
    case : HardCase
    plan : Plan
    """
    try:
        return _refused(case, plan) if case.refused else _measured(case, plan)
    except WearsimError as error:
        return Verdict(case.name, str(error), f"stopped: {_first_line(error)}")
    except Exception as error:  # a bug must not hide the other cases
        return Verdict(case.name, trouble=f"raised {type(error).__name__}: {_first_line(error)}")


def _first_line(error: Exception) -> str:
    return next(iter(str(error).splitlines()), "")


def _refused(case: HardCase, plan: Plan) -> Verdict:
    """Return the verdict on a case that must end with an error."""
    try:
        plan.run(case)
    except WearsimError as error:
        text = str(error)
        lacking = [word for word in case.refused if word not in text]
        trouble = f"the error does not name {', '.join(lacking)}" if lacking else ""
        return Verdict(case.name, text, trouble)
    return Verdict(case.name, trouble="ran to its end, where an error should have named the cause")


def _measured(case: HardCase, plan: Plan) -> Verdict:
    """Return the verdict on a case that must run to its end."""
    scenario = plan.scenario(case)
    chosen, forced, refined = plan.chosen(case), plan.forced(case), plan.refined(case)
    first, runs = chosen[0], [*chosen, *forced, *refined]
    checks = [
        *_balances(scenario, runs, forced),
        *_shape(case, scenario, first, (refined or forced)[-1]),
        *_convergence(case, chosen, forced, refined),
        Check("mirror", measures.asymmetry(forced[0], plan.mirrored(case)), ROUND_OFF),
    ]
    trouble = "" if all(measures.is_finite(item) for item in runs) else "not finite, or no wear"
    seen = measures.patches(first)
    if case.patches and not _in_turn(case.patches, seen):
        trouble = f"patches {seen}, expected {case.patches}"
    figures = {"steps": float(first.steps), "strips": float(len(first.y))}
    ended = {key: measures.greatest(value) for key, value in first.final.items()}
    return Verdict(case.name, trouble=trouble, checks=tuple(checks), figures=figures | ended)


def _balances(scenario: Scenario, runs: list[Result], forced: list[Result]) -> Iterator[Check]:
    volumes = [measures.volume_balance(item, scenario) for item in runs]
    known = [volume for volume in volumes if volume is not None]
    if known:
        yield Check("volume", max(known), ROUND_OFF)
    steady = scenario.load.kind == "constant" and not scenario.random
    halved = [item for item in forced if measures.records_half_steps(item)]
    if halved:
        found = measures.energy_balance(halved[-1])
        yield Check("energy", found, ROUND_OFF if steady else UNSTEADY)
    if not scenario.creepage.differential_slip and not scenario.random:
        yield Check("work", max(measures.work_balance(r, scenario) for r in runs), ROUND_OFF)
    yield Check("load", max(measures.load_balance(item) for item in runs), ROUND_OFF)


def _shape(case: HardCase, scenario: Scenario, first: Result, finest: Result) -> Iterator[Check]:
    yield Check("oscillation", measures.roughest(finest), ROUGH if case.rough else SMOOTH)
    if is_symmetric(scenario):
        yield Check("drift", measures.drift(first), ROUND_OFF)


def _convergence(
    case: HardCase, chosen: list[Result], forced: list[Result], refined: list[Result]
) -> Iterator[Check]:
    if len(chosen) > 1:
        moved = measures.moved(*chosen)
        yield Check("tolerance", moved, SIZE * measures.promised(chosen[0]))
    # a jump of the profile falls anywhere in a strip, however narrow
    near, noise = (NEAR_ROUGH, NEAR_ROUGH) if case.rough else (NEAR, NOISE_OF_STRIPS)
    for name, runs, bound, floor in (
        ("steps", forced, NEAR, NOISE_OF_STEPS),
        ("strips", refined, near, noise),
    ):
        if len(runs) > 1:
            changes = measures.changes(runs)
            yield Check(name, changes[-1], bound, measures.order(changes), floor)


def _in_turn(wanted: tuple[int, ...], seen: tuple[int, ...]) -> bool:
    """Return whether all that is wanted is seen in that order, whatever comes between."""
    rest = iter(seen)
    return all(number in rest for number in wanted)
