"""Choice of order and length of the next implicit step, by the errors of the last one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import built
from tests.evolution.test_step_loads import SPRING, THREE, Line
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import COVER, VARYING_COVER, greatest_depth, sizes
from wearsim.evolution.quantities import Varying
from wearsim.evolution.steppers import edges
from wearsim.evolution.steppers.base import GROW, SAFETY
from wearsim.evolution.steppers.implicit import (
    DOUBLED_SHARE,
    LEAST_AIM_OF_ROWS,
    PART_EXPONENT,
    ImplicitStepper,
    implicit_step,
    with_rates,
)
from wearsim.evolution.steppers.load_errors import (
    next_steps_of_energy,
    next_steps_of_loads,
    unloading,
)
from wearsim.evolution.steppers.single_step import volumes_of, wear_per_pass
from wearsim.mechanics.numerics.multistep import MAX_ORDER, next_steps
from wearsim.mechanics.numerics.piecewise_linear import Paths
from wearsim.mechanics.numerics.step_errors import KEEP, LEAST_AIM, LEAST_OF_ENERGY, SHARE

TOLERANCE, TIGHT, STOP = 1e-3, 1e-6, 1e5
SECOND = np.array([2])  # order
STIFF = {"load__kind": "spring", "load__stiffness": "2e5 N/mm"}
THERMAL = {"load__thermal": {"gain": "50 N/W", "time_constant": "2 s"}}
PARTIAL = {"creepage__longitudinal": 1e-4}


def begun(stepper, steps=(200.0, 300.0, 400.0), **changes):
    """Return a problem, and its state after a few steps of increasing order."""
    problem, _, _ = built(contact__strips=41, **changes)
    return problem, after(stepper, problem, steps)


def after(stepper, problem, steps):
    """Return the state of a problem after a few steps of increasing order."""
    state = stepper.started(problem, fresh_state(problem))
    for number, passes in enumerate(steps):
        order = np.array([min(number + 1, 2)])
        state = implicit_step(problem, state.replaced(order=order), np.array([passes]))
    return state.replaced(order=SECOND)


def tried(stepper, problem, state, step=400.0, stop=STOP):
    return stepper.attempt(problem, state, np.array([step]), stop, implicit_step)


class Rows(Line):
    """Constant load, of which a log has a small deviation within a step."""

    def __init__(self, deviation):
        super().__init__(300.0, 0.0, deviation)


@pytest.fixture(scope="module")
def plain():
    return begun(ImplicitStepper(TOLERANCE))


def test_early_errors_may_be_greater(plain):
    stepper = ImplicitStepper(TOLERANCE)
    late, early = (tried(stepper, *plain, stop=stop) for stop in (STOP, 16.0 * STOP))
    assert late.excess == pytest.approx(16.0**PART_EXPONENT * early.excess, rel=1e-12, abs=0.0)
    assert len(late.path) == 1
    (end,) = late.path
    assert end.steps == 1
    volume = volumes_of(plain[0], end.stacked)
    for error, size in (
        (end.depth_error, greatest_depth(end.depths)),
        (end.volume_error, volume),
        (end.profile_error, 1.0),
    ):
        assert 1e-8 * size < error < 0.1 * size
    tighter = tried(ImplicitStepper(0.1 * TOLERANCE), *plain)
    assert tighter.excess == pytest.approx(10.0 * late.excess, rel=1e-12, abs=0.0)


def test_errors_so_far_shorten_the_next_step_alone(plain):
    stepper, (problem, state) = ImplicitStepper(TIGHT), plain
    part = (state.passes[0] / STOP) ** 0.5
    aimed = 1.125 * TIGHT * 6.0 / part  # half of the aim is left
    known = state.replaced(profile_error=np.array([aimed]))
    one, other = tried(stepper, problem, state), tried(stepper, problem, known)
    assert other.excess == pytest.approx(one.excess, rel=1e-12, abs=0.0)
    order = one.path[0].order[0]
    assert other.path[0].order[0] == order
    assert other.ratio == pytest.approx(one.ratio * 0.5 ** (1.0 / (order + 1)), rel=1e-12, abs=0.0)


def test_errors_that_no_step_reduces_are_added_once(plain):
    stepper, (problem, state) = ImplicitStepper(TOLERANCE), plain
    fixed = np.array([[3e-10], [5e-14], [2e-4]])
    known = state.replaced(
        quadrature=fixed, volume_error=fixed[1] + 1e-15, profile_error=fixed[2], order=state.order
    )
    one, other = (tried(stepper, problem, start).path[0] for start in (state, known))
    assert other.volume_error == pytest.approx(
        one.volume_error + 1e-15 + fixed[1], rel=1e-9, abs=0.0
    )
    assert other.depth_error >= one.depth_error + fixed[0]
    assert other.profile_error >= one.profile_error + fixed[2]
    assert other.depth_error <= 3.0 * (one.depth_error + fixed[0])


def test_error_of_the_loads_counts_under_a_stiff_spring():
    stepper = ImplicitStepper(TOLERANCE)
    worn = {"wear__cylinder__k_over_h": "5e-9 1/Pa"}
    problem, state = begun(stepper, (20.0, 30.0, 40.0), **STIFF, **worn)
    found = tried(stepper, problem, state, 60.0)
    (end,) = found.path
    scale = (end.passes / STOP) ** PART_EXPONENT
    given = problem, end.replaced(order=SECOND), scale, SHARE * TOLERANCE, KEEP
    (over, ratio), order, displaced = next_steps_of_loads(*given)
    assert found.excess == over
    assert found.ratio == ratio
    assert end.order == order
    assert end.depth_error >= displaced > 0.0


@pytest.mark.parametrize("tolerance", [1e-3, 1e-7])
def test_error_of_the_energy_counts_in_partial_slip(tolerance):
    stepper = ImplicitStepper(tolerance)
    problem, state = begun(stepper, (2.0, 3.0, 4.0), **PARTIAL)
    found = tried(stepper, problem, state, 6.0)
    (end,) = found.path
    least, ended = max(tolerance, LEAST_OF_ENERGY), end.replaced(order=SECOND)
    (over, ratio), _ = next_steps_of_energy(state, ended, least, KEEP, np.array([MAX_ORDER]))
    assert found.excess >= over > 0.0
    assert found.excess == over or tolerance < 1e-3
    assert found.ratio <= ratio


def test_steps_are_doubled_where_inputs_vary_or_lengths_are_given(plain):
    problem, state = plain
    assert len(tried(ImplicitStepper(TOLERANCE, by_doubling=True), problem, state).path) == 2
    assert len(tried(ImplicitStepper(TOLERANCE, 400.0), problem, state).path) == 2
    path = Paths.through(np.array([0.0, 1e5]), np.array([0.1, 0.2]))
    varying = replace(problem, varying=(Varying("friction", (0,), path),))
    assert len(tried(ImplicitStepper(TOLERANCE), varying, state).path) == 2
    counted = edges.with_whole_strips(problem, state.replaced(past_sums=state.past_sums[:, -1:]))
    (end,) = tried(ImplicitStepper(TOLERANCE), problem, counted).path
    assert edges.unresolved(end).all()


def doubled_errors(stepper, problem, state, step, found, left=1.0, cover=COVER):
    """Return excess of error, ratio and order of a doubled step by their definitions."""
    end, tolerance = found.path[1], stepper.tolerance
    part = (end.passes / STOP) ** PART_EXPONENT / left
    order, depths, most = np.empty_like(end.order), end.stacked, np.array([MAX_ORDER])
    half = implicit_step(problem, state, 0.5 * step)
    used = implicit_step(problem, half, 0.5 * step).order
    over, ratio = next_steps(
        *(end.past_wear, end.past_spans, depths, used, part / (DOUBLED_SHARE * tolerance)),
        *(1.0, 1.0, most, np.ones_like(depths), np.empty_like(depths), order),
    )
    coarse, before = end.coarse_step_solution, state.coarse_step_solution or state
    change = (end.stacked - coarse.stacked) - (state.stacked - before.stacked)
    added = cover * np.abs(sizes(problem, end, change))[0]
    of_depth = added * part / (tolerance * greatest_depth(end.depths))
    if of_depth > 1.0:
        ratio = np.minimum(ratio, min(GROW, SAFETY * of_depth[0] ** -0.5))
    return left * np.maximum(over, of_depth), ratio, order, of_depth > 1.0


@pytest.mark.parametrize(("step", "jumps"), [(400.0, False), (400.0, True), (40.0, False)])
def test_doubled_step_has_the_greater_of_two_errors(plain, step, jumps):
    stepper, (problem, state) = ImplicitStepper(TOLERANCE, by_doubling=True), plain
    if jumps:  # the coarse-step solution differs by a depth that it had not before
        rough = 3e-8 * (np.arange(41) % 2)
        state = state.replaced(
            coarse_step_solution=state.replaced(cylinder_depth=state.cylinder_depth + rough)
        )
    length = np.array([step])
    found = tried(stepper, problem, state, step)
    half, end = found.path
    over, ratio, order, rough = doubled_errors(stepper, problem, state, length, found)
    assert rough == jumps
    energy = next_steps_of_energy(half, end, TOLERANCE, KEEP, np.array([MAX_ORDER]))
    (of_energy, their_ratio), their_order = energy
    assert found.excess == pytest.approx(np.maximum(over, of_energy), rel=1e-9, abs=0.0)
    expected = order if ratio <= their_ratio else their_order
    assert end.order == expected
    assert all(one.order == expected for one in end.auxiliary.values())
    assert found.ratio == pytest.approx(np.minimum(ratio, their_ratio), rel=1e-9, abs=0.0)
    forced = tried(ImplicitStepper(TOLERANCE, 400.0), problem, state, step)
    assert forced.path[1].order == min(order[0], MAX_ORDER - 2)


def test_error_of_the_energy_counts_in_doubled_steps_of_a_constant_load():
    stepper, step = ImplicitStepper(TOLERANCE, by_doubling=True), np.array([6.0])
    problem, state = begun(stepper, (2.0, 3.0, 4.0), **PARTIAL)
    path = Paths.through(np.array([0.0, 1e9]), np.array([0.1, 0.1 + 1e-6]))
    varying = replace(problem, varying=(Varying("friction", (0,), path),))
    later = after(stepper, varying, (2.0, 3.0, 4.0))
    for one, start, counts in ((problem, state, True), (varying, later, False)):
        found = tried(stepper, one, start, 6.0)
        half, end = found.path
        ended = end.replaced(order=SECOND)
        (of_energy, _), _ = next_steps_of_energy(half, ended, TOLERANCE, KEEP, np.array([4]))
        over, *_ = doubled_errors(stepper, one, start, step, found)
        assert of_energy > 1.1 * over
        exact = of_energy if counts else over
        assert found.excess == pytest.approx(exact, rel=1e-9, abs=0.0)


@pytest.mark.parametrize("case", ["constant", "rows", "friction"])
def test_rows_of_a_log_shorter_than_a_step_leave_most_of_its_error(plain, case):
    problem, state = plain
    problem = replace(problem, loads=(Rows(1e-3 if case == "rows" else 0.0),))
    if case == "friction":
        path = Paths.through(np.array([0.0, 1e5]), np.array([0.1, 0.4]))
        problem = replace(problem, varying=(Varying("friction", (0,), path),))
    left, cover = LEAST_AIM_OF_ROWS if case == "rows" else LEAST_AIM, COVER
    cover *= 1.0 if case == "constant" else VARYING_COVER
    grown, step = (state.passes[0] / STOP) ** 0.5, np.array([400.0])
    for tolerance in (1e-3, 2e-5, 1e-5):
        known = state.replaced(profile_error=np.array([1.5 * tolerance * COVER / grown]))
        stepper = ImplicitStepper(tolerance)
        found = tried(stepper, problem, known)
        over, ratio, order, _ = doubled_errors(stepper, problem, known, step, found, left, cover)
        assert found.excess == pytest.approx(over, rel=1e-9, abs=0.0)
        assert found.ratio == pytest.approx(ratio, rel=1e-9, abs=0.0)
        assert found.path[1].order == order


@pytest.mark.parametrize("changes", [{}, SPRING, THERMAL], ids=["none", "spring", "term"])
def test_first_step_knows_the_rates_at_the_start(changes):
    problem, _, _ = built(**THREE, **changes)
    state = fresh_state(problem)
    start = with_rates(problem, state)
    wear, energy = wear_per_pass(problem, state.contacts)
    for found, rate in ((start.past_wear, wear), (start.past_sums, energy[None])):
        np.testing.assert_array_equal(found[0], rate)
        np.testing.assert_allclose(found[1], rate / 300.0, rtol=1e-14)
        assert not found[2:].any()
        assert len(found) == 6
    np.testing.assert_array_equal(start.past_spans[:, 0], [0.0, *[np.inf] * 4])
    assert start.order == 1
    assert (start.wear_exponents == 1.0).all()
    assert not start.stepping_error.any()
    if not changes:
        assert start.past_feedback is None
    else:
        slope = unloading(problem, state, np.array([300.0])) if changes is SPRING else 0.0
        np.testing.assert_array_equal(start.past_feedback[1], slope * np.ones(problem.shape))
        others = start.past_feedback[[0, 2, 3, 4, 5]]
        assert others.shape == (5, *problem.shape)
        assert not others.any()
    kept = with_rates(problem, state.replaced(stepping_error=np.ones_like(state.stacked)))
    assert (kept.stepping_error == 1.0).all()
    ends = [implicit_step(problem, one, np.array([100.0])) for one in (state, start)]
    np.testing.assert_array_equal(ends[0].stacked, ends[1].stacked)


def test_worn_cam_starts_again_from_its_loads():
    problem, _, _ = built("cam-cycloidal", contact__strips=41)
    state = fresh_state(problem)
    assert not with_rates(problem, state).past_feedback[0].any()
    lighter = replace(state.contacts, line_load=0.9 * state.contacts.line_load)
    worn = state.replaced(contacts=lighter, skid_loads=np.zeros((2, problem.shape[0], 1)))
    found = with_rates(problem, worn).past_feedback[0]
    force = problem.force(np.zeros(1))
    np.testing.assert_allclose(found, -0.1 * force, rtol=1e-6)
    rigid, _, _ = built(contact__strips=41)
    assert with_rates(rigid, fresh_state(rigid).replaced(skid_loads=worn.skid_loads)).order == 1
