"""Contacts solved together with their loads, by the fewest solutions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.evolution.black_box import BlackBox, boxed
from tests.evolution.test_step_loads import RISE, THREE, Line, with_loads
from wearsim.errors import StepError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.quantities import Varying
from wearsim.evolution.steppers.single_step import (
    MAX_LOAD_ITERATIONS,
    carried_loads,
    contacts_at,
    energy_per_pass,
    explicit_step,
    solve_at_present_loads,
    solve_at_record,
    solve_loaded,
    solve_present,
    volumes_of,
    wear_per_pass,
    worn_state,
)
from wearsim.mechanics.numerics.piecewise_linear import Paths

STIFFNESS = 20e6  # N/m
SPRING = {"load__kind": "spring", "load__stiffness": "20 kN/mm"}
THERMAL = {"load__thermal": {"gain": "500 N/W", "time_constant": "2 s"}}


class Jumping(BlackBox):
    """Contact model with an approach that is discontinuous at a load of 270 N."""

    jump = 4e-6

    def solve_contact(self, gap, curvature, point, *others):
        found = super().solve_contact(gap, curvature, point, *others)
        rise = self.jump if point.normal_force > 270.0 else 0.0
        return replace(found, approach=found.approach + rise)


class Softening(BlackBox):
    """Contact model with an approach that decreases in proportion to the load."""

    def solve_contact(self, gap, curvature, point, *others):
        found = super().solve_contact(gap, curvature, point, *others)
        return replace(found, approach=5e-6 - point.normal_force / STIFFNESS)


def sprung(box=BlackBox, **changes):
    """Return a problem on springs and its start, with a groove of a micrometre."""
    options = {"foundation": True, "contact__strips": 41, **SPRING, **changes}
    problem = replace(boxed(box=box, **options)[0], iteration_tolerance=1e-9)
    state = fresh_state(problem)
    groove = 1e-6 * np.maximum(1.0 - (problem.grid.y / 3e-3) ** 2, 0.0)
    return problem, state.replaced(cylinder_depth=state.cylinder_depth + groove)


def loads_at(problem, state, fresh):
    """Return the function from displacements to loads, and the elastic approach of a solution."""

    def found(displacement):
        return 300.0 + problem.inputs.normal_force_offset - STIFFNESS * displacement

    gaps = problem.gap(*state.depths).min(axis=-1)
    descent = gaps - problem.nominal_least_gap

    def equilibrium(contacts):
        elastic = contacts.approach.reshape(problem.shape) - gaps
        return found(descent - (fresh - elastic))

    return found, equilibrium


@pytest.mark.parametrize("guess", [None, 0.5, 10.0])
def test_load_of_a_spring_and_its_contact_are_in_equilibrium(guess):
    problem, state = sprung(**THREE)
    problem = replace(problem, inputs=problem.inputs.with_values({"normal_force_offset": RISE}))
    start = fresh_state(problem)
    fresh = start.contacts.approach.reshape(problem.shape) - problem.nominal_least_gap
    found, equilibrium = loads_at(problem, state, fresh)
    elastic = None if guess is None else guess * fresh
    before = problem.model.solved
    given = problem, state, found, fresh, elastic, solve_present
    contacts, loads, solves = solve_loaded(*given)
    assert problem.model.solved - before == 3 * solves
    np.testing.assert_allclose(carried_loads(problem, contacts), loads, rtol=1e-9)
    np.testing.assert_allclose(equilibrium(contacts), loads, rtol=2e-8)
    assert np.ptp(loads) > 5.0
    assert solves <= 12


def test_load_at_a_jump_of_the_approach_is_that_of_the_jump():
    problem, state = sprung(Jumping)
    fresh = np.full(problem.shape, 10e-6)
    found, _ = loads_at(problem, state, fresh)
    given = problem, state, found, fresh, None, solve_present
    contacts, loads, solves = solve_loaded(*given)
    assert loads[0, 0, 0] == pytest.approx(270.0, rel=2e-8, abs=0.0)
    assert solves < MAX_LOAD_ITERATIONS
    np.testing.assert_allclose(carried_loads(problem, contacts), loads, rtol=1e-9)


def test_load_that_does_not_converge_is_an_error():
    problem, state = sprung(Softening)
    fresh = np.full(problem.shape, 3e-6)
    found, _ = loads_at(problem, state, fresh)
    with pytest.raises(StepError, match="did not converge at pass 0"):
        solve_loaded(problem, state, found, fresh, None, solve_present)


def test_load_that_a_spring_loses_is_an_error():
    problem, state = sprung()
    state = state.replaced(cylinder_depth=state.cylinder_depth + 30e-6)
    fresh = np.full(problem.shape, 3e-6)
    found, _ = loads_at(problem, state, fresh)
    with pytest.raises(StepError, match="contact is lost at pass 0"):
        solve_loaded(problem, state, found, fresh, None, solve_present)


def test_contacts_that_carry_their_loads_are_not_solved_again():
    problem, _, _ = boxed(foundation=True, **THREE)
    problem = problem.at(np.zeros(4, dtype=np.int64))
    state, model = fresh_state(problem), problem.model
    loads = np.full(problem.shape, 300.0)
    before = model.solved
    assert contacts_at(problem, state, loads * (1.0 + 0.5e-9)) is state.contacts
    assert model.solved == before
    loads[0, 1, 2], loads[0, 0, 1] = 301.0, 300.0 * (1.0 + 5e-9)
    found = contacts_at(problem, state, loads)
    assert model.solved - before == 2 * 3  # all contacts of two tests
    np.testing.assert_allclose(carried_loads(problem, found), loads, rtol=2e-9)
    exact = solve_present(problem, state, loads)
    np.testing.assert_allclose(found.approach, exact.approach, rtol=1e-12)
    before = model.solved
    contacts_at(problem, state, loads + 1.0)
    assert model.solved - before == 4 * 3
    path = Paths.through(np.array([0.0, 1.0]), np.array([0.1, 0.2]))
    varying = replace(
        problem, varying=(Varying("friction", (0,), path.at(np.zeros(4, dtype=np.int64))),)
    )
    before = model.solved
    contacts_at(varying, state, np.full(problem.shape, 300.0))
    assert model.solved - before == 4 * 3


def test_contacts_of_a_record_have_the_load_of_their_time():
    problem, _, _ = boxed(foundation=True, contact__strips=41, **SPRING, **THERMAL)
    problem = with_loads(problem, Line(300.0, 5.0, stiffness=STIFFNESS))
    problem = replace(problem, iteration_tolerance=1e-9)
    state = explicit_step(problem, fresh_state(problem), np.array([2000.0]))
    time = float(problem.time(state.passes)[0])
    fresh = state.approach_factor[0, 0, 0] * (300.0 + 5.0 * time) ** (2.0 / 3.0)
    gap = problem.gap(*state.depths)[0, 0, 0]
    for found in (
        solve_at_record(problem, state, on_profile=True),
        solve_at_record(problem, state, on_profile=False),
        solve_at_record(problem, state, on_profile=False, cold=True),
        solve_at_present_loads(problem, state, None),
    ):
        contacts, loads = found[:2]
        displacement = contacts.approach[0] - problem.nominal_least_gap[0, 0, 0] - fresh
        expected = 300.0 + 5.0 * time + state.terms[0, 0, 0] - STIFFNESS * displacement
        assert loads[0, 0, 0] == pytest.approx(expected, rel=1e-8, abs=0.0)
        exact = problem.model.inner._line_load(gap, 90.0, contacts.approach[0])[0]
        np.testing.assert_allclose(contacts.line_load[0], exact, rtol=1e-6, atol=1e-3)
    before = problem.model.solved
    solve_at_record(problem, state, on_profile=True)
    assert problem.model.solved == before  # a step leaves contacts at the loads of its end
    solve_at_record(problem, state, on_profile=False)
    assert problem.model.solved > before


def test_contacts_of_an_implicit_step_are_those_of_its_record():
    problem, _, _ = boxed(foundation=True, contact__strips=41, **SPRING, **THERMAL)
    problem = replace(problem, iteration_tolerance=1e-9)
    state = fresh_state(problem).replaced(terms=np.full((1, 1, 1), 10.0))
    loads = solve_at_record(problem, state, on_profile=True)[1]
    assert loads[0, 0, 0] > 303.0
    stepped = state.replaced(past_spans=np.zeros((5, 1)))
    contacts, carried = solve_at_record(problem, stepped, on_profile=True)
    assert contacts is state.contacts
    assert carried[0, 0, 0] == pytest.approx(300.0, rel=1e-9, abs=0.0)
    for one, on_profile in ((stepped, False), (state, True)):
        again = solve_at_record(problem, one, on_profile=on_profile)[1]
        assert again == pytest.approx(loads, rel=1e-8, abs=0.0)
    varied = with_loads(problem, Line(300.0, 0.0, stiffness=STIFFNESS))
    assert solve_at_record(varied, stepped, on_profile=True)[1] == pytest.approx(
        loads, rel=1e-8, abs=0.0
    )


def test_contacts_of_a_record_have_the_friction_of_their_time():
    problem, _, _ = boxed(foundation=True, contact__strips=41)
    path = Paths.through(np.array([0.0, 100.0]), np.array([0.1, 0.3]))
    problem = replace(problem, varying=(Varying("friction", (0,), path),))
    state = fresh_state(problem)
    later = state.replaced(passes=np.array([10.0 * problem.kinematics.pass_rate]))
    contacts, _ = solve_at_record(problem, later, on_profile=True)
    assert contacts.power[0] == pytest.approx(1.2 * state.contacts.power[0], rel=1e-9, abs=0.0)


def test_state_after_a_step_has_its_energy_and_its_terms():
    problem, _, _ = boxed(foundation=True, **THREE, **THERMAL)
    state = fresh_state(problem).replaced(
        energy=np.array([7.0]), passes=np.array([50.0]), terms=np.array([[[1.0], [2.0], [3.0]]])
    )
    power = np.array([[[2.0], [3.0], [5.0]]])
    found = worn_state(problem, state, np.array([150.0]), power)
    seconds = 150.0 / problem.kinematics.pass_rate
    assert found.passes[0] == 200.0
    assert found.energy[0] == pytest.approx(7.0 + 10.0 * seconds, rel=1e-13, abs=0.0)
    target = 500.0 * power[0]
    expected = target + (state.terms[0] - target) * math.exp(-seconds / 2.0)
    np.testing.assert_allclose(found.terms[0], expected, rtol=1e-13)
    plain, _, _ = boxed(foundation=True, **THREE)
    start = fresh_state(plain)
    assert worn_state(plain, start, np.array([150.0]), power).terms is start.terms


def test_wear_energy_and_volume_of_a_pass_agree():
    problem, _, _ = boxed(foundation=True, **THREE, wear__roller__k_over_h="3e-11 1/Pa")
    state = fresh_state(problem)
    wear, energy = wear_per_pass(problem, state.contacts)
    power = state.contacts.power.sum()
    assert energy[0] == pytest.approx(power / problem.kinematics.pass_rate, rel=1e-13, abs=0.0)
    assert energy_per_pass(problem, state.contacts)[0] == energy[0]
    volume = volumes_of(problem, wear)[0]
    assert volume == pytest.approx((1.1e-11 + 3e-11) * energy[0], rel=1e-12, abs=0.0)
    assert wear.shape == (4, 1, 41)
