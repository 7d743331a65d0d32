"""Parts of steps: pauses, side steps, first steps, errors that no step reduces, and warnings."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import built
from tests.evolution.black_box import boxed
from tests.evolution.test_fatigue import QUICK, fatigue
from tests.evolution.test_single_steps import FACTOR, LOAD, PER_LOAD, RADII, Rig, solved
from tests.evolution.test_step_loads import Line, with_loads
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import volume_of
from wearsim.evolution.quantities import oscillation
from wearsim.evolution.steppers import edges
from wearsim.evolution.steppers.base import GROW, Attempt
from wearsim.evolution.steppers.damage import damage_excess, with_damage
from wearsim.evolution.steppers.forward_euler import OSCILLATING, ExplicitStepper, stability_limit
from wearsim.evolution.steppers.implicit import (
    FIRST,
    FIRST_EXPONENT,
    OF_STEPS,
    ImplicitStepper,
    with_rates,
)
from wearsim.evolution.steppers.per_pass import PerPassStepper, run_passes
from wearsim.evolution.steppers.single_step import explicit_step
from wearsim.evolution.steppers.stabilised import StabilisedStepper
from wearsim.mechanics.numerics.step_errors import ADDED_UP, LEAST_AIM

# from PASSES to STOP, the sum of passes and step differs from the stop by round-off
PASSES, STOP = 438.4497060569215, 5462.310172436656
THERMAL = {"load__thermal": {"gain": "500 N/W", "time_constant": "2 s"}}


@pytest.fixture(scope="module")
def rig():
    return Rig()


@pytest.fixture(scope="module")
def pausing():
    """Problem without load from pass 100 to 400, and a state at the start of the pause."""
    problem, _, _ = boxed(foundation=True, contact__strips=41, **THERMAL)
    times = np.array([100.0, 400.0]) / problem.kinematics.pass_rate
    problem = with_loads(problem, Line(LOAD, pauses=[times]))
    state = fresh_state(problem).replaced(terms=np.full((1, 1, 1), 8.0))
    return problem, explicit_step(problem, state, np.array([100.0]))


def relaxed(problem, state, passes):
    """Return the load term after some passes without power [N]."""
    return state.terms[0, 0, 0] * math.exp(-passes / problem.kinematics.pass_rate / 2.0)


def test_pause_is_one_step_in_which_terms_relax(pausing):
    problem, state = pausing
    state = state.replaced(coarse_step_solution=state.replaced(terms=2.0 * state.terms))
    step, stop = np.array([400.0]) - state.passes, 400.0
    (end,) = ExplicitStepper(1e-3).rest(problem, state, step, stop)
    half, whole = StabilisedStepper(1e-3).rest(problem, state, step, stop)
    for found, passes in ((end, 300.0), (half, 150.0), (whole, 300.0)):
        assert found.passes[0] == 100.0 + passes
        expected = relaxed(problem, state, passes)
        assert found.terms[0, 0, 0] == pytest.approx(expected, rel=1e-12, abs=0.0)
        coarse = found.coarse_step_solution
        assert coarse.terms[0, 0, 0] == pytest.approx(2.0 * expected, rel=1e-12, abs=0.0)
        assert (found.cylinder_depth == state.cylinder_depth).all()


def test_record_between_steps_is_one_step_or_a_pause(pausing, rig):
    problem, state = pausing
    passes = np.array([50.0])
    resting = ExplicitStepper(1e-3).side_step(problem, state, passes)
    assert resting.terms[0, 0, 0] == pytest.approx(
        relaxed(problem, state, 50.0), rel=1e-12, abs=0.0
    )
    assert (resting.cylinder_depth == state.cylinder_depth).all()
    found = ExplicitStepper(1e-3).side_step(rig.problem, rig.state, passes)
    exact = explicit_step(rig.problem, rig.state, passes)
    assert (found.cylinder_depth == exact.cylinder_depth).all()
    assert found.damage is None
    passed = PerPassStepper().side_step(rig.problem, rig.state, np.array([3.0]))
    every = run_passes(rig.problem, rig.state, np.array([3.0]))
    assert (passed.cylinder_depth == every.cylinder_depth).all()


def test_every_part_of_a_step_adds_its_damage():
    problem, _, _ = built(**{**QUICK, "contact__strips": 41}, **fatigue())
    state, stepper = fresh_state(problem), ExplicitStepper(1e-3)
    half = explicit_step(problem, state, np.array([10.0]))
    end = explicit_step(problem, half, np.array([10.0]))
    first, early = with_damage(problem, state, half)
    second, late = with_damage(problem, first, end)
    errors = [damage_excess(one, 1e-3)[0] for one in (early, late)]
    assert errors[0] != errors[1]
    for excess, ratio in ((0.0, GROW), (1e9, 1e-9)):
        tried = Attempt((half, end), np.array([excess]), np.array([ratio]), "warning")
        found = stepper.with_damage(problem, state, tried)
        for one, exact in zip(found.path, (first, second), strict=True):
            assert (one.damage == exact.damage).all()
        assert found.excess[0] == max(excess, *errors)
        assert found.ratio[0] == pytest.approx(min(ratio, 0.7 * max(errors) ** (-1.0 / 3.0)))
        assert found.warning == "warning"
    record = stepper.side_step(problem, state, np.array([10.0]))
    assert (record.damage == first.damage).all()


def test_first_step_wears_a_tenth_of_the_approach_of_the_hardest_contact_off_both_bodies():
    problem, _, _ = boxed(
        foundation=True,
        contact__strips=41,
        roller__offset=["0 mm", "1 mm", "-0.5 mm"],
        wear__roller__k_over_h="3e-11 1/Pa",
    )
    offset = np.array([[0.0], [50.0], [-50.0]])
    problem = replace(problem, inputs=problem.inputs.with_values({"normal_force_offset": offset}))
    problem = problem.at(np.zeros(2, dtype=np.int64))
    state, gaps = fresh_state(problem), problem.nominal_gap[0, :, 0]
    contacts = [
        solved(gap, LOAD + own, problem.grid.spacing)
        for gap, own in zip(gaps, offset[:, 0], strict=True)
    ]
    cylinder = PER_LOAD * sum(q for q, _ in contacts) / 3.0
    turned = 3e-11 / FACTOR * PER_LOAD * RADII[0] / RADII[1] / 3.0
    rate = max((cylinder + turned * q).max() for q, _ in contacts)
    hardest = max(range(3), key=lambda number: contacts[number][0].max())
    approach = contacts[hardest][1] - gaps[hardest].min()
    stepper = StabilisedStepper(1e-3)
    found = stepper.proposed(problem, state.replaced(step=np.array([0.0, 0.5])))
    assert found == pytest.approx([0.1 * approach / rate, 0.5], rel=1e-6, abs=0.0)
    implicit = ImplicitStepper(4e-4).first_steps(problem, state)
    part = FIRST * 4e-4**FIRST_EXPONENT
    assert implicit == pytest.approx(part * 0.1 * approach / rate, rel=1e-6, abs=0.0)
    unworn, _, _ = boxed(foundation=True, contact__strips=41, wear__cylinder__k_over_h="0 1/Pa")
    assert stepper.first_steps(unworn, fresh_state(unworn))[0] == np.inf


@pytest.mark.parametrize("stepper", [StabilisedStepper(1e-3), ExplicitStepper(1e-3)])
def test_errors_that_no_step_reduces_are_added_once(rig, stepper):
    fixed = np.array([[3e-9], [5e-13], [2e-3]])
    before = fixed + np.array([[1e-9], [4e-13], [1e-3]])
    names = "depth_error", "volume_error", "profile_error"
    known = rig.state.replaced(
        quadrature=fixed, **dict(zip(names, before, strict=True)), steps=np.array([6])
    )
    step = np.array([4000.0])
    plain, found = (
        stepper.attempt(rig.problem, state, step, 1e6, explicit_step).path[-1]
        for state in (rig.state, known)
    )
    # the differences of two solutions contain those of earlier steps, but for the volume
    kept = before if isinstance(stepper, ExplicitStepper) else fixed
    kept = [kept[0, 0], before[1, 0], kept[2, 0]]
    for name, part in zip(names, kept, strict=True):
        assert getattr(found, name)[0] == pytest.approx(
            getattr(plain, name)[0] + part, rel=1e-9, abs=0.0
        )
    assert (found.steps[0], plain.steps[0]) == (7, 1)


@pytest.mark.parametrize("stepper", [StabilisedStepper(1e-3), ExplicitStepper(1e-3)])
def test_step_to_the_stop_ends_exactly_there(rig, stepper):
    state, stop = rig.state.replaced(passes=np.array([PASSES])), STOP
    tried = stepper.attempt(rig.problem, state, stop - state.passes, stop, explicit_step)
    end = tried.path[-1]
    assert end.passes[0] == stop
    assert all(one.passes[0] == stop for one in end.auxiliary.values())
    short = stepper.attempt(rig.problem, state, np.array([10.0]), stop, explicit_step).path[-1]
    assert short.passes[0] == pytest.approx(PASSES + 10.0, rel=1e-15, abs=0.0)


def test_alternating_line_load_gives_a_warning_except_next_to_a_pause(rig):
    scratch = np.where(np.arange(41) % 2 == 0, 6e-7, 0.0) * np.ones((1, 1, 1, 1))
    worn = rig.state.with_added((scratch, np.zeros_like(rig.state.roller_depth)))
    start = explicit_step(rig.problem, worn, np.array([1.0]))
    stepper, step = ExplicitStepper(1e-3), np.array([20.0])
    tried = stepper.attempt(rig.problem, start, step, 1e6, explicit_step)
    (end,) = tried.path
    worst = oscillation(end.contacts[0].line_load)
    assert worst > OSCILLATING
    ratio = 20.0 / stability_limit(rig.problem, end)[0]
    assert tried.warning == (
        f"unstable: at pass 21 the line load alternates from strip to strip by {worst:.0%} of its"
        f" peak; the step of 20 passes is {ratio:.2g} times the stability limit"
    )
    times = np.array([21.0, 400.0]) / rig.problem.kinematics.pass_rate
    paused = with_loads(rig.problem, Line(LOAD, pauses=[times]))
    assert stepper.attempt(paused, start, step, 1e6, explicit_step).warning is None
    later = with_loads(rig.problem, Line(LOAD, pauses=[2.0 * times]))
    assert stepper.attempt(later, start, step, 1e6, explicit_step).warning is not None


def test_steps_aim_at_less_where_errors_have_added_up(rig):
    tolerance, stop, (low, high) = 1e-3, 1e6, ADDED_UP
    problem = rig.problem.at(np.zeros(5, dtype=np.int64))
    state = with_rates(problem, fresh_state(problem)).replaced(
        passes=np.array([1e6, 1e6, 2.5e5, 2.5e5, 1e6])
    )
    groove = 1e-6 * np.maximum(1.0 - (problem.grid.y / 2e-3) ** 2, 0.0)
    worn = state.replaced(cylinder_depth=groove * np.array([[1.0]] * 4 + [[0.0]])[None, None])
    middle = 0.5 * (low + high) * tolerance
    volume = volume_of(problem, worn.depths)
    fixed = np.array([[0.0] * 5, 0.3 * volume, [0.2] * 5])
    of_volume = np.array([middle, 0.0, 4.0**0.75 * middle, 0.0, 0.0]) * volume
    of_profile = np.array([0.0, 4.0 * high * tolerance, 0.0, 4.0**0.5 * middle, 1.0])
    worn = worn.replaced(
        quadrature=fixed,
        volume_error=fixed[1] + OF_STEPS[0] * of_volume,
        profile_error=fixed[2] + OF_STEPS[1] * of_profile,
    )

    def left(problem, state, fixed):
        found = np.empty(len(state.passes))
        ImplicitStepper(tolerance)._left(problem, state, stop, OF_STEPS, fixed, found)
        return found

    found = left(problem, worn, worn.irreducible)
    np.testing.assert_allclose(found, [0.5, LEAST_AIM, 0.5, 0.5, 1.0], rtol=1e-9)
    # where edges are resolved, the error of the profile decays
    cut = edges.without_edges(problem, worn)
    cut = cut.replaced(**dict.fromkeys(edges.FIELDS, np.zeros_like(worn.cylinder_depth)))
    found = left(problem, cut, worn.irreducible)
    np.testing.assert_allclose(found, [0.5, 1.0, 0.5, 1.0, 1.0], rtol=1e-9)
    young = worn.replaced(profile_error=np.full(5, 0.49 * low * tolerance))
    assert (left(problem, young, fixed) == 1.0).all()
    errors = {"profile_error": np.array([0.45 * tolerance]), "volume_error": of_volume[:1]}
    both = worn.at(np.array([0])).replaced(quadrature=0.0 * fixed[:, :1], **errors)
    found = left(problem.at(np.array([0])), both, both.irreducible)
    np.testing.assert_allclose(found, 0.5, rtol=1e-9)
