"""Loads, exposures and errors of loads in one step, against formulas written out here."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import built
from wearsim.errors import StepError
from wearsim.evolution.contacts import LEAST_LOAD as NEXT_TO_A_PAUSE, fresh_state
from wearsim.evolution.quantities import Varying
from wearsim.evolution.steppers.conditions import conditions_of
from wearsim.evolution.steppers.implicit import ImplicitStepper
from wearsim.evolution.steppers.load_errors import (
    LEAST_LOAD,
    next_steps_of_energy,
    next_steps_of_loads,
    unloading,
)
from wearsim.evolution.steppers.loads import (
    ABRUPT,
    TREND,
    abrupt_loads,
    advanced_terms,
    checked_loads,
    corrected_loads,
    descents,
    displacement_at,
    elastic_approach,
    fresh_approach,
    mean_loads,
    smooth_loads,
    with_feedback,
)
from wearsim.mechanics.numerics.multistep import GROW, LIMIT, SAFETY
from wearsim.mechanics.numerics.piecewise_linear import Paths
from wearsim.mechanics.numerics.step_errors import LEAST_ENERGY
from wearsim.plugins import Load

THREE = {"roller__offset": ["-1 mm", "0 mm", "0.5 mm"], "contact__strips": 41}
STIFFNESS, GAIN, LAG = 20e6, 500.0, 2.0  # N/m, N/W, s
SPRING = {"load__kind": "spring", "load__stiffness": "20 kN/mm"}
RISE = np.array([[10.0], [-5.0], [2.0]])  # of the load of each roller [N]


class Line(Load):
    """Load that changes from a start by some newtons per second, with a given deviation."""

    def __init__(self, start=300.0, rate=0.0, deviation=0.0, stiffness=0.0, pauses=()):
        self.start, self.rate, self._deviation = start, rate, deviation
        self.stiffness, self._pauses = stiffness, np.array(pauses).reshape(-1, 2)

    def force(self, time):
        return self.start + self.rate * np.asarray(time)

    def mean(self, start, stop):
        return self.start + 0.5 * self.rate * (start + stop)

    def deviation(self, start, stop):
        return self._deviation

    @property
    def pauses(self):
        return self._pauses


def with_loads(problem, *loads):
    """Return the problem with a realisation for each load."""
    return replace(problem.at(np.zeros(len(loads), dtype=np.int64)), loads=loads)


@pytest.fixture(scope="module")
def three():
    """Problem of three rollers that differ, on springs, and its start."""
    problem, _, _ = built(**THREE, **SPRING, wear__roller__k_over_h="3e-11 1/Pa")
    problem = replace(problem, inputs=problem.inputs.with_values({"normal_force_offset": RISE}))
    return problem, fresh_state(problem)


def test_trend_of_a_smooth_load_explains_most_of_its_variance():
    seconds, root = 4.0, math.sqrt(12.0)
    cases = [  # start [N], change [N], deviation [N], whether smooth, whether abrupt
        (300.0, 60.0, 60.0 / root, True, False),
        (300.0, -60.0, 60.0 / root, True, False),
        (300.0, 60.0, 60.0 / math.sqrt(12.0 * (TREND + 0.01)), True, False),
        (300.0, 60.0, 60.0 / math.sqrt(12.0 * (TREND - 0.01)), False, True),
        (100.0, 195.0, 195.0 / root, True, False),
        (100.0, 205.0, 205.0 / root, False, True),
        (5.0, 2.0, 2.0 / root, True, False),
        (300.0, 0.0, 0.0, False, False),
        (300.0, 0.0, 1.01 * ABRUPT * 300.0, False, True),
        (300.0, 0.0, 0.99 * ABRUPT * 300.0, False, False),
        (290.0, 20.0, 0.99 * ABRUPT * 300.0, False, False),
    ]
    problem, _, _ = built(contact__strips=41)
    first = np.full(len(cases), 100.0)
    passes = np.full(len(cases), seconds * problem.kinematics.pass_rate)
    begun = 100.0 / problem.kinematics.pass_rate
    loads = [
        Line(start - change / seconds * begun, change / seconds, deviation)
        for start, change, deviation, *_ in cases
    ]
    many = with_loads(problem, *loads)
    assert smooth_loads(many, first, passes).tolist() == [case[3] for case in cases]
    assert abrupt_loads(many, first, passes).tolist() == [case[4] for case in cases]
    paused = with_loads(problem, Line(*vars_of(loads[0]), pauses=[(50.0, 60.0)]))
    assert not smooth_loads(paused, first[:1], passes[:1]).any()


def vars_of(load):
    """Return start, rate and deviation of a load."""
    return load.start, load.rate, load.deviation(0.0, 0.0)


def test_loads_contain_offsets_springs_and_terms(three):
    problem, state = three
    descent = np.array([1e-6, 2e-6, 4e-6]).reshape(1, 3, 1)
    terms = [np.array([[1.0], [2.0], [4.0]]), np.array([[0.5], [0.25], [0.125]])]
    found = with_feedback(problem, np.array([300.0]), descent, terms)[0, :, 0]
    expected = 300.0 + RISE[:, 0] - STIFFNESS * descent[0, :, 0] + [1.5, 2.25, 4.125]
    np.testing.assert_allclose(found, expected, rtol=1e-14)
    free, _, _ = built(contact__strips=41)
    assert with_feedback(free, np.array([300.0]), np.array(1e-6), [])[0, 0, 0] == 300.0
    greatest = 300.0 * NEXT_TO_A_PAUSE
    paused = with_loads(free, Line(300.0, stiffness=STIFFNESS, pauses=[(1.0, 2.0)]))
    assert with_feedback(paused, np.array([3.0]), np.array(1e-6), [])[0, 0, 0] == greatest
    assert checked_loads(state, descent) is descent
    for bad in (0.0, -2.5, math.nan):
        with pytest.raises(StepError, match=r"contact is lost at pass 0: the load") as caught:
            checked_loads(state, np.where(descent == 2e-6, bad, descent))
        assert caught.value.cause == "lost"


def test_mean_loads_of_a_step_have_the_exact_mean_of_load_and_terms():
    problem, _, _ = built(**THREE, load__thermal={"gain": f"{GAIN} N/W", "time_constant": "2 s"})
    problem = replace(with_loads(problem, Line(300.0, 5.0)), inputs=problem.inputs)
    state = fresh_state(problem)
    own, passes = np.array([[[3.0], [-1.0], [7.0]]]), np.array([150.0])
    state = state.replaced(terms=own, passes=np.array([100.0]))
    power = state.contacts.power * np.array([1.0, 2.0, 3.0])
    contacts = replace(state.contacts, power=power)
    times = 100.0 / problem.kinematics.pass_rate, 250.0 / problem.kinematics.pass_rate
    ratio = (times[1] - times[0]) / LAG
    target = GAIN * power
    mean = target + (own[0, :, 0] - target) * (1.0 - math.exp(-ratio)) / ratio
    found = mean_loads(problem, state, passes, np.zeros(()), contacts)[0, :, 0]
    np.testing.assert_allclose(found, 300.0 + 2.5 * sum(times) + mean, rtol=1e-12)
    end = advanced_terms(problem, state, state.passes + passes, power[:, None])[0, :, 0]
    exact = target + (own[0, :, 0] - target) * math.exp(-ratio)
    np.testing.assert_allclose(end, exact, rtol=1e-12)


def test_displacement_is_the_descent_less_the_recovery(three):
    problem, state = three
    y = problem.grid.y
    cylinder = 1e-6 * np.maximum(1.0 - (y / 3e-3) ** 2, 0.0)
    roller = 1e-6 * np.array([[0.0], [1.0], [2.0]]) * np.ones_like(y)
    depths = cylinder[None, None, None], roller[None, :, None]
    gaps = problem.nominal_gap[0, :, 0]
    exact = (gaps + cylinder + roller).min(axis=1) - gaps.min(axis=1)
    assert np.ptp(exact) > 1e-6
    np.testing.assert_allclose(descents(problem, depths)[0, :, 0], exact, rtol=1e-9)
    recovered = np.array([1e-7, 2e-7, 3e-7]).reshape(1, 3, 1)
    found = displacement_at(problem, [depths, state.depths], recovered)[0, :, 0]
    np.testing.assert_allclose(found, 0.5 * exact - recovered[0, :, 0], rtol=1e-9)
    approach = state.contacts.approach - gaps.min(axis=1)
    assert elastic_approach(problem, state)[0] == pytest.approx(approach.min(), rel=1e-12, abs=0.0)
    force = np.array([400.0])
    fresh = approach * ((400.0 + RISE[:, 0]) / (300.0 + RISE[:, 0])) ** (2.0 / 3.0)
    np.testing.assert_allclose(fresh_approach(problem, state, force)[0, :, 0], fresh, rtol=1e-12)
    lifted = fresh_approach(problem, state, np.array([-3.0]))[0, :, 0]
    np.testing.assert_allclose(lifted, approach * [(7.0 / 310.0) ** (2.0 / 3.0), 0.0, 0.0])
    rigid, _, _ = built(contact__strips=41)
    start = fresh_state(rigid)
    assert fresh_approach(rigid, start, force) == displacement_at(rigid, [depths], recovered) == 0.0


def test_corrected_loads_solve_a_linear_spring_and_contact(three):
    problem, _ = three
    loads = np.array([300.0, 200.0, 100.0]).reshape(1, 3, 1)
    compliance, target_at = 3e-8, 280.0  # approach = compliance * load, to the power one
    approach = compliance * loads
    target = target_at - STIFFNESS * approach
    found = corrected_loads(problem, loads, target, approach, 1.0)
    np.testing.assert_allclose(found, target_at / (1.0 + STIFFNESS * compliance), rtol=1e-12)
    flat = corrected_loads(problem, loads, target, -approach)
    np.testing.assert_allclose(flat, target, rtol=1e-12)
    half = corrected_loads(problem, loads, target, approach)
    slope = STIFFNESS * 0.75 * compliance
    np.testing.assert_allclose(half, loads + (target - loads) / (1.0 + slope), rtol=1e-12)


def test_exposure_is_the_mean_load_times_friction():
    problem, _, _ = built(**THREE)
    inputs = problem.inputs.with_values({"normal_force_offset": RISE})
    passes, rate = np.array([200.0]), problem.kinematics.pass_rate
    problem = replace(problem, inputs=inputs)
    state = fresh_state(problem).replaced(passes=np.array([100.0]))
    mean = float(RISE.mean())
    constant = conditions_of(problem, problem, state, passes)
    assert constant.force[0] == 300.0
    assert constant.own[0] == constant.mean[0] == pytest.approx(300.0 + mean, rel=1e-14, abs=0.0)
    rising = Paths.through(np.array([0.0, 100.0]), np.array([0.1, 0.3]))
    varying = replace(problem, varying=(Varying("friction", (1,), rising),))
    here = varying.at_time(*(np.array([n]) / rate for n in (100.0, 300.0)))
    friction = (0.1 + 0.1 + 0.1 + 0.002 * 200.0 / rate) / 3.0
    found = conditions_of(here, varying, state, passes)
    assert (
        found.own[0]
        == found.mean[0]
        == pytest.approx((300.0 + mean) * friction, rel=1e-12, abs=0.0)
    )
    creeping = replace(problem, varying=(Varying("longitudinal", (1,), rising),))
    found = conditions_of(creeping, creeping, state, passes)
    assert found.own[0] == found.mean[0] == pytest.approx(300.0 + mean, rel=1e-14, abs=0.0)
    line = with_loads(problem, Line(300.0, 4.0, 4.0 * 200.0 / rate / math.sqrt(12.0)))
    found = conditions_of(line, line, state, passes)
    assert found.force[0] == pytest.approx(300.0 + 4.0 * 300.0 / rate, rel=1e-14, abs=0.0)
    assert found.own[0] == pytest.approx(found.force[0] + mean, rel=1e-14, abs=0.0)
    assert found.mean[0] == pytest.approx(300.0 + 4.0 * 200.0 / rate + mean, rel=1e-14, abs=0.0)
    rough = with_loads(problem, Line(300.0, 4.0, 10.0))
    found = conditions_of(rough, rough, state, passes)
    assert found.force[0] == pytest.approx(300.0 + 4.0 * 200.0 / rate, rel=1e-14, abs=0.0)
    assert found.own[0] == found.mean[0] == pytest.approx(found.force[0] + mean, rel=1e-14, abs=0.0)


def test_exposure_of_a_cam_is_the_mean_over_its_turn():
    problem, _, _ = built("cam-cycloidal", contact__strips=41)
    state = fresh_state(problem)
    found = conditions_of(problem, problem, state, np.array([10.0]))
    cam = problem.kinematics.track
    mean = (cam.time_share * problem.force(np.zeros(1))).sum()
    assert found.own[0] == pytest.approx(mean, rel=1e-12, abs=0.0)
    assert found.force.shape == (problem.shape[0], 1, 1)


def test_loads_of_springs_fall_first_by_the_wear_under_the_load(three):
    problem, state = three
    exposure = np.array([250.0])
    found = unloading(problem, state, exposure)[0, :, 0]
    cylinder, rollers = problem.sum_of_parts(*problem.wear_parts(state.contacts, 1.0))
    q = state.contacts.line_load
    for c in range(3):
        descent = (q[c] * (cylinder[0, 0, 0] + rollers[0, c, 0])).sum() / q[c].sum()
        load = q[c].sum() * problem.grid.spacing
        slope = 2.0 / 3.0 * (state.contacts.approach[c] - problem.nominal_gap[0, c, 0].min()) / load
        expected = -STIFFNESS * descent / (1.0 + STIFFNESS * slope) / 250.0
        assert found[c] == pytest.approx(expected, rel=1e-10, abs=0.0)


def stepped_once(problem, spans, sums=None, feedback=None, energy=(2.0, 5.0)):
    """Return the start and the end of a step of first order with known second differences."""
    state = ImplicitStepper(1e-3).started(problem, fresh_state(problem))
    many = state.past_spans.shape[1]
    known = np.full((5, many), np.inf)
    known[:2] = spans
    end = state.replaced(
        past_spans=known,
        past_sums=state.past_sums if sums is None else sums,
        past_feedback=state.past_feedback if feedback is None else feedback,
        passes=np.full(many, 500.0),
        energy=np.full(many, energy[1]),
    )
    return state.replaced(passes=np.full(many, 400.0), energy=np.full(many, energy[0])), end


def test_error_of_the_loads_is_relative_to_each_of_them(three):
    stiffness = [STIFFNESS, STIFFNESS, 0.0, 0.5]
    loads = [Line(stiffness=one) for one in stiffness]
    for load in loads:
        load.constant = True
    problem = with_loads(three[0], *loads)
    spans = np.array([[10.0, 10.0, 10.0, 10.0], [25.0, 10.0, 25.0, 25.0]])
    feedback = np.zeros((6, *problem.shape))
    feedback[0] = np.array([-100.0, -10.0, -301.9]).reshape(3, 1)  # the last one has decayed
    feedback[2] = 1e-5 * np.array([3.0, -2.0, 1e-2]).reshape(3, 1)
    _, end = stepped_once(problem, spans, feedback=feedback)
    part, aim = np.array([0.5, 2.0, 0.5, 0.5]), 3e-4
    (over, ratio), order, displaced = next_steps_of_loads(problem, end, part, aim, 0.9)
    whole = 300.0 + RISE[:, 0]
    scale = np.maximum(whole + feedback[0, 0, :, 0], LEAST_LOAD * whole)
    assert scale[2] == LEAST_LOAD * whole[2]
    for v in range(4):
        factor = 10.0 / (1.0 / 10.0 + 1.0 / spans[1, v])
        errors = factor * feedback[2, 0, :, v]
        size = math.sqrt(np.square(errors / scale).mean()) * part[v] / aim
        assert over[v] == pytest.approx(size / LIMIT, rel=1e-12, abs=0.0)
        best = 2 if size <= LIMIT else 1
        assert order[v] == best
        assert ratio[v] == pytest.approx(
            min(SAFETY * size**-0.5, GROW[best - 1]), rel=1e-12, abs=0.0
        )
        # without a past point the slope at the start is estimated
        true = np.abs(errors).max() / stiffness[v] if v in {0, 3} else 0.0
        assert displaced[v] == pytest.approx(true, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("energy", [(2.0, 5.0), (4.99, 5.0)])
def test_error_of_the_energy_is_relative_to_that_of_the_step(energy):
    problem, _, _ = built(**THREE)
    sums = np.zeros((6, 2, 1))  # a sum of depths before that of the energy
    sums[2] = [[7.0], [2e-6]]
    start, end = stepped_once(problem, [[10.0], [25.0]], sums=sums, energy=energy)
    (over, ratio), order = next_steps_of_energy(start, end, 1e-4, 0.9, np.array([4]))
    worn = max(energy[1] - energy[0], LEAST_ENERGY * energy[1] * (1.0 - 400.0 / 500.0))
    size = 2e-6 * 10.0 / (1.0 / 10.0 + 1.0 / 25.0) / worn / 1e-4
    assert over[0] == pytest.approx(size / LIMIT, rel=1e-12, abs=0.0)
    best = 2 if size <= LIMIT else 1
    assert order[0] == best
    assert ratio[0] == pytest.approx(min(SAFETY * size**-0.5, GROW[best - 1]), rel=1e-12, abs=0.0)
