"""Evaluation of one hard case: its runs, criteria and bounds."""

from __future__ import annotations

from collections.abc import Iterator

from wearsim.errors import WearsimError
from wearsim.scenario import Scenario
from wearsim.studies.run.result import Result
from wearsim_bench.hard_cases import measures
from wearsim_bench.hard_cases.cases import RobustnessCase
from wearsim_bench.hard_cases.runs import Plan, is_symmetric
from wearsim_bench.hard_cases.truths import rigid_depth
from wearsim_bench.hard_cases.verdict import Criterion, Verdict

ROUND_OFF = 1e-9  # for sums over some hundred strips and steps
STEADY, UNSTEADY = 0.01, 0.05  # energy from the power at records, for constant and other loads
SMOOTH, ROUGH = 0.03, 0.1  # second difference of a smooth contact of 20 strips, and of waves
NEAR, NEAR_ROUGH = 0.02, 0.05  # change from refinement of continuous and discontinuous profiles
SIZE = 2.0  # factor on a tolerance, since an error estimate is not exact
NOISE_OF_STEPS, NOISE_OF_STRIPS = 2e-3, 3e-3  # no order is required of smaller changes


def evaluate(case: RobustnessCase, plan: Plan) -> Verdict:
    """Run a hard case and return the verdict."""
    try:
        return _evaluate_refusal(case, plan) if case.refused else _evaluate_run(case, plan)
    except WearsimError as error:
        return Verdict(case.name, str(error), f"stopped: {_first_line(error)}")
    except Exception as error:  # a fault must not stop the other cases
        return Verdict(case.name, unexpected=f"raised {type(error).__name__}: {_first_line(error)}")


def _first_line(error: Exception) -> str:
    return next(iter(str(error).splitlines()), "")


def _evaluate_refusal(case: RobustnessCase, plan: Plan) -> Verdict:
    """Return the verdict on a case that must raise an error."""
    try:
        plan.run(case)
    except WearsimError as error:
        text = str(error)
        missing = [word for word in case.refused if word not in text]
        unexpected = f"the error does not name {', '.join(missing)}" if missing else ""
        return Verdict(case.name, text, unexpected)
    return Verdict(case.name, unexpected="completed, although an error is required")


def _evaluate_run(case: RobustnessCase, plan: Plan) -> Verdict:
    """Return the verdict on a case that must complete."""
    scenario = plan.scenario(case)
    adaptive, fixed, refined = plan.adaptive(case), plan.fixed(case), plan.refined(case)
    first, runs = adaptive[0], [*adaptive, *fixed, *refined]
    criteria = [
        *_balances(scenario, runs, fixed),
        *_truth(case, scenario, first),
        *_shape(case, scenario, first, (refined or fixed)[-1]),
        *_convergence(case, adaptive, fixed, refined),
        Criterion("mirror", measures.asymmetry(fixed[0], plan.mirrored(case)), ROUND_OFF),
    ]
    unexpected = "" if all(measures.is_finite(item) for item in runs) else "not finite, or no wear"
    patches = measures.patches(first)
    if case.patches and not _is_subsequence(case.patches, patches):
        unexpected = f"patches {patches}, expected {case.patches}"
    figures = {"steps": float(first.steps), "strips": float(len(first.y))}
    final = {key: measures.greatest(value) for key, value in first.final.items()}
    return Verdict(
        case.name, unexpected=unexpected, criteria=tuple(criteria), figures=figures | final
    )


def _balances(scenario: Scenario, runs: list[Result], fixed: list[Result]) -> Iterator[Criterion]:
    volumes = [measures.volume_balance(item, scenario) for item in runs]
    known = [volume for volume in volumes if volume is not None]
    if known:
        yield Criterion("volume", max(known), ROUND_OFF)
    steady = scenario.load.kind == "constant" and not scenario.random
    halved = [item for item in fixed if measures.records_half_steps(item)]
    if halved:
        error = measures.energy_balance(halved[-1])
        yield Criterion("energy", error, STEADY if steady else UNSTEADY)
    if not scenario.creepage.differential_slip and not scenario.random:
        yield Criterion("work", max(measures.work_balance(r, scenario) for r in runs), ROUND_OFF)
    yield Criterion("load", max(measures.load_balance(item) for item in runs), ROUND_OFF)


def _truth(case: RobustnessCase, scenario: Scenario, first: Result) -> Iterator[Criterion]:
    if case.true_within:
        error = abs(float(first.depth[-1]) / rigid_depth(scenario) - 1.0)
        yield Criterion("truth", error, case.true_within)


def _shape(
    case: RobustnessCase, scenario: Scenario, first: Result, finest: Result
) -> Iterator[Criterion]:
    yield Criterion(
        "oscillation", measures.max_oscillation(finest), ROUGH if case.rough else SMOOTH
    )
    if is_symmetric(scenario):
        yield Criterion("drift", measures.drift(first), ROUND_OFF)


def _convergence(
    case: RobustnessCase, adaptive: list[Result], fixed: list[Result], refined: list[Result]
) -> Iterator[Criterion]:
    if len(adaptive) > 1:
        change = measures.observable_change(*adaptive)
        yield Criterion("tolerance", change, SIZE * measures.stated_error(adaptive[0]))
    # the position of a jump of the profile within a strip is arbitrary
    near, noise = (NEAR_ROUGH, NEAR_ROUGH) if case.rough else (NEAR, NOISE_OF_STRIPS)
    for name, runs, bound, floor in (
        ("steps", fixed, NEAR, NOISE_OF_STEPS),
        ("strips", refined, near, noise),
    ):
        if len(runs) > 1:
            changes = measures.changes(runs)
            yield Criterion(name, changes[-1], bound, measures.order(changes), floor)


def _is_subsequence(part: tuple[int, ...], sequence: tuple[int, ...]) -> bool:
    """Return whether `part` occurs in `sequence` in this order, not necessarily consecutively."""
    rest = iter(sequence)
    return all(number in rest for number in part)
