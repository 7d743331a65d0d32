"""Equations of implicit steps: wear, energy, loads and terms at the end of each step."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import built, stepped
from tests.evolution.test_step_loads import Line
from wearsim.errors import ContactError, StepError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.steppers import edges
from wearsim.evolution.steppers.conditions import conditions_of
from wearsim.evolution.steppers.implicit import ImplicitStepper, implicit_step
from wearsim.evolution.steppers.implicit_solution import CONVERGED, step_by_formula
from wearsim.evolution.steppers.single_step import energy_per_pass, solve_present
from wearsim.models.contact.slender import Slender

STIFFNESS, GAIN, LAG = 20e6, 500.0, 2.0
SPRING = {"load__kind": "spring", "load__stiffness": "20 kN/mm"}
THERMAL = {"load__thermal": {"gain": "500 N/W", "time_constant": "2 s"}}
THREE = {
    "roller__offset": ["-1 mm", "0.3 mm", "1 mm"],
    "wear__roller__k_over_h": "3e-11 1/Pa",
}
CASES = {
    "constant": {},
    "three": THREE,
    "two": {**THREE, "operation__rollers": 2, "roller__offset": ["0 mm", "0.5 mm"]},
    "spring": SPRING,
    "spring, three": {**SPRING, **THREE},
    "thermal": {**THERMAL, **THREE},
    "spring, thermal": {**SPRING, **THERMAL},
    "partial slip": {"creepage__longitudinal": 3e-4},
    "differential slip": {"creepage__differential_slip": True, **THREE},
    "ramp": THREE,
    "other law": {"wear": {"law": "t-gamma", "cylinder": {}, "roller": {}}},
}


def derivative(points, values):
    """Return the derivative at the last point of the polynomial through all of them."""
    last = points[-1]
    total = 0.0
    for k, (point, value) in enumerate(zip(points, values, strict=True)):
        others = [other for j, other in enumerate(points) if j != k]
        if point == last:
            weight = sum(1.0 / (last - other) for other in others)
        else:
            product = math.prod((last - other) for other in others if other != last)
            weight = product / math.prod(point - other for other in others)
        total = total + weight * value
    return total


def solved_again(problem, state):
    """Return contacts on the profiles of a state under its loads, with rates of wear and energy."""
    carried = state.contacts.line_load.sum(axis=-1) * problem.grid.spacing
    contacts = solve_present(problem, state, carried.reshape(problem.shape), cold=True)
    cylinder, roller = problem.sum_of_parts(*problem.wear_parts(contacts, 1.0))
    rates = np.concatenate([cylinder[:, 0], roller[0]])
    return contacts, carried.reshape(problem.shape), rates, energy_per_pass(problem, contacts)


class Ramp(Line):
    """Load that rises steadily."""

    def deviation(self, start, stop):
        return abs(self.rate) * (stop - start) / math.sqrt(12.0)


class Counting(Slender):
    """Model that counts the contacts that it solves."""

    def __init__(self, model):
        vars(self).update(vars(model))
        self.solved = 0

    def solve(self, batch, *arguments, **options):
        self.solved += len(batch)
        return super().solve(batch, *arguments, **options)


def started(case):
    """Return problem and start of a case, for two tests where load terms allow it."""
    problem, _, _ = built(contact__strips=41, **CASES[case])
    problem = replace(problem, model=Counting(problem.model))
    realisations = 1 if problem.terms else 2
    problem = problem.at(np.zeros(realisations, dtype=np.int64))
    if case == "ramp":
        problem = replace(problem, loads=(Ramp(300.0, 4.0), Ramp(300.0, -3.0)))
    friction = np.array([[0.1, 0.07]])[:, :realisations]
    inputs = problem.inputs.with_values({"friction": friction})
    problem = replace(problem, inputs=inputs, iteration_tolerance=1e-11)
    return problem, ImplicitStepper(1e-3).started(problem, fresh_state(problem))


@pytest.mark.parametrize("case", list(CASES))
def test_steps_solve_the_formulas_of_their_order(case):
    problem, state = started(case)
    many, states, solved = len(state.passes), [state], problem.model.solved
    for order, passes in ((1, [200.0, 300.0]), (2, [300.0, 400.0]), (3, [350.0, 450.0])):
        given = state.replaced(order=np.full(many, order))
        state = implicit_step(problem, given, np.array(passes[:many]))
        assert state.order.tolist() == [order] * many
        states.append(state)
    assert (state.solves - states[0].solves).sum() == problem.model.solved - solved
    found = [solved_again(problem, one) for one in states]
    times = [problem.time(one.passes) for one in states]
    forces = [problem.force(time) for time in times]
    # the load, and its integral over the passes
    means = [problem.mean_force(*two) for two in itertools.pairwise(times)]
    steps = np.diff([one.passes for one in states], axis=0)
    places = np.vstack([np.zeros(many), np.cumsum(np.array(means) * steps, axis=0)])
    for order, v in itertools.product((1, 2, 3), range(many)):
        points = places[: order + 1, v]
        depths = [one.stacked[:, v] for one in states], [one[2][:, v] for one in found]
        energies = [one.energy[v] for one in states], [one[3][v] for one in found]
        past = states[1].past_wear[:, :, v], states[1].past_sums[:, -1, v]
        for (values, rates), rows in zip((depths, energies), past, strict=True):
            # passes are counted one by one: half a pass later
            pairs = zip(values[: order + 1], rates, strict=False)
            later = [value + 0.5 * rate for value, rate in pairs]
            slope = rates[order] / forces[order][v]
            error = derivative(points, later) - slope
            assert np.abs(error).max() < 1e-7 * np.abs(slope).max()
            first = (later[1] - later[0]) / (points[1] - points[0])
            scale = np.abs(rates[1]).max()
            np.testing.assert_allclose(rows[0], rates[1], rtol=0.0, atol=1e-7 * scale)
            atol = 1e-7 * scale / forces[0][v]
            np.testing.assert_allclose(rows[1], first, rtol=0.0, atol=atol)
    spans = (places[3] - places[:3])[::-1]
    np.testing.assert_allclose(states[-1].past_spans[:3], spans, rtol=1e-12)
    for before, after in itertools.pairwise(range(4)):
        pair = (states[before], found[before]), (states[after], found[after])
        assert_in_equilibrium(problem, *pair, forces[after])


def assert_in_equilibrium(problem, before, after, force):
    """Check loads and terms at the end of a step, and their part due to feedback."""
    (start, (old, *_)), (end, (contacts, carried, *_)) = before, after
    terms = end.terms
    if problem.terms:
        power = 0.5 * (old.power + contacts.power).reshape(problem.shape)[0]
        decay = np.exp(-(end.passes - start.passes) / problem.kinematics.pass_rate / LAG)
        expected = GAIN * power + (start.terms[0] - GAIN * power) * decay
        np.testing.assert_allclose(terms[0], expected, rtol=1e-7)
    loads = np.broadcast_to(force, problem.shape)
    for term in terms:
        loads = loads + term
    if problem.has_spring:
        approach = contacts.approach.reshape(problem.shape) - problem.nominal_least_gap
        fresh = end.approach_factor * force ** (2.0 / 3.0)
        loads = loads - STIFFNESS * (approach - fresh)
    np.testing.assert_allclose(carried, loads, rtol=1e-8)
    if end.past_feedback is not None:
        exact = loads - force
        np.testing.assert_allclose(
            end.past_feedback[0], exact, rtol=0.0, atol=1e-6 * abs(exact).max()
        )


class Failing(Slender):
    """Model that fails in its first solutions."""

    def __init__(self, model, error, times=1):
        vars(self).update(vars(model))
        self.error, self.left = error, times

    def solve(self, *arguments, **options):
        self.left -= 1
        if self.left >= 0:
            raise self.error
        return super().solve(*arguments, **options)


@pytest.fixture(scope="module")
def grooved():
    """Problem, and its state in a groove in which edges of the contact are resolved."""
    changes = {"wear__cylinder__k_over_h": "1.1e-9 1/Pa", "operation__passes": 13_500}
    problem, stepper, _ = built(contact__strips=61, **changes)
    state, _ = stepped(problem, stepper, 2000.0)
    assert not edges.unresolved(state).any()
    return problem, state


def failing(problem, error, **options):
    return replace(problem, model=Failing(problem.model, error, **options))


@pytest.mark.parametrize("error", [ContactError("none"), StepError("lost", cause="lost")])
def test_step_that_fails_is_repeated_at_first_order_on_whole_strips(grooved, error):
    passes = np.array([20.0])
    for whole in (False, True):
        problem, state = grooved
        if whole:
            state = edges.without_edges(problem, state)
            state = state.replaced(cylinder_depth=0.0 * state.cylinder_depth)  # without a groove
        for order in (1, 2):
            start = state.replaced(order=np.array([order]))
            if whole and order == 1:
                with pytest.raises(type(error)):
                    implicit_step(failing(problem, error), start, passes)
                continue
            found = implicit_step(failing(problem, error), start, passes)
            first = edges.without_edges(problem, start).replaced(order=np.array([1]))
            exact = step_by_formula(
                *(problem, first, passes),
                *(conditions_of(problem, problem, first, passes), np.array([1])),
            )[0]
            np.testing.assert_array_equal(found.cylinder_depth, exact.cylinder_depth)
            assert found.order[0] == 1
            with pytest.raises(type(error)):
                implicit_step(failing(problem, error, times=2), start, passes)


def test_step_that_fails_is_not_repeated_at_the_outer_strips_or_with_others(grooved):
    problem, state = grooved
    start, passes = state.replaced(order=np.array([2])), np.array([20.0])
    with pytest.raises(StepError, match="outer"):
        implicit_step(failing(problem, StepError("outer", cause="edge")), start, passes)
    both = np.zeros(2, dtype=np.int64)
    two = failing(problem.at(both), ContactError("none"))
    with pytest.raises(ContactError):
        implicit_step(two, start.at(both), passes.repeat(2))


class Noisy(Counting):
    """Contact model with a power that changes slightly from call to call."""

    def __init__(self, model, noise):
        super().__init__(model)
        self.noise = noise

    def solve(self, *arguments, **options):
        found = super().solve(*arguments, **options)
        factor = 1.0 + 0.5 * self.noise * (-1.0) ** self.solved
        return replace(found, dissipation=factor * found.dissipation)


class NoisyAfterFirst(Noisy):
    """Contact model with a noisy power, except in the first contact of a batch of three."""

    def solve(self, batch, *arguments, **options):
        found = Counting.solve(self, batch, *arguments, **options)
        self.calls = getattr(self, "calls", 0) + 1
        factors = np.full(len(batch), 1.0 + 0.5 * self.noise * (-1.0) ** self.calls)
        if len(batch) == 3:
            factors[0] = 1.0
        return replace(found, dissipation=factors[:, None] * found.dissipation)


def test_tolerance_of_an_iteration_is_relaxed_every_twenty_times(grooved):
    problem, _, _ = built(contact__strips=41)
    step, exact = np.array([100.0]), problem.iteration_tolerance * CONVERGED
    state = fresh_state(problem)  # without depths: the wear of the step is all of the depth
    for noise, solves in ((0.5, 1), (5.0, 21), (50.0, 41)):
        noisy = replace(problem, model=Noisy(problem.model, noise * exact))
        end = implicit_step(noisy, state, step)
        assert end.solves - state.solves == solves
    noisy = replace(problem, model=Noisy(problem.model, 500.0 * exact))
    with pytest.raises(StepError, match="did not converge"):
        implicit_step(noisy, state, step)
    assert noisy.model.solved == 60
    cut, state = grooved
    noisy = replace(cut, model=Noisy(cut.model, 0.1))
    end = implicit_step(noisy, state.replaced(order=np.array([1])), step)
    # where strips are cut, the step is repeated on whole strips instead
    assert end.solves - state.solves == 21
    assert noisy.model.solved == 20 + 21


def test_steps_that_do_not_converge_are_repeated_without_the_others(grooved):
    cut, state = grooved
    state = state.replaced(order=np.array([1]))
    several, passes = np.zeros(3, dtype=np.int64), np.full(3, 100.0)
    single = replace(cut, model=Noisy(cut.model, 0.1))
    alone = implicit_step(single, state, passes[:1])
    many = replace(cut.at(several), model=NoisyAfterFirst(cut.model, 0.1))
    found = implicit_step(many, state.at(several), passes)
    quiet = implicit_step(cut, state, passes[:1])
    # the first test converges, and its contact is not solved again for the others
    assert many.model.solved == quiet.solves - state.solves + 2 * single.model.solved
    np.testing.assert_array_equal(found.cylinder_depth[..., 0, :], quiet.cylinder_depth[..., 0, :])
    for place in (1, 2):
        depth = found.cylinder_depth[..., place, :]
        np.testing.assert_allclose(depth, alone.cylinder_depth[..., 0, :], rtol=1e-6)
    whole = edges.without_edges(cut, state).at(several)
    whole = whole.replaced(cylinder_depth=0.0 * whole.cylinder_depth)
    with pytest.raises(StepError, match="did not converge") as raised:
        implicit_step(replace(many, model=NoisyAfterFirst(cut.model, 0.5)), whole, passes)
    assert raised.value.places == (1, 2)
