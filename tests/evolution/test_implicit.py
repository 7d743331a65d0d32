"""Implicit stepper: order, conservation, monotonic wear, control of order and step length."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.evolution import built, never, stepped
from wearsim.evolution.error_estimates import volume_of
from wearsim.evolution.integrate import evolve
from wearsim.evolution.state import fresh_state
from wearsim.evolution.steppers.implicit import ImplicitStepper, implicit_step

SPRING = {"load__kind": "spring", "load__stiffness": "690 N/mm"}
THERMAL = {"load__thermal": {"gain": "50 N/W", "time_constant": "5 s"}}
BOTH = {"wear__roller__k_over_h": "1.1e-11 1/Pa"}
OFFSET = {"roller__offset": ["-1 mm", "0.3 mm", "1 mm"]}
CASES = {"constant": {}, "spring": SPRING, "thermal": THERMAL, "both wear": BOTH, "three": OFFSET}


def path_of(problem, stepper, stop):
    """Return all states of a test."""
    state = fresh_state(problem)
    steps = evolve(problem, state, stepper, stop, never, 10**6)
    return [state, *itertools.chain.from_iterable(advance.path[1:] for advance in steps)]


def log_of(loads, tmp_path, interval=30):
    """Return the options of a load log with a row in every interval [s]."""
    path = tmp_path / "log.csv"
    rows = (f"{interval * number}, {load}" for number, load in enumerate(loads))
    path.write_text("time [s], load [N]\n" + "\n".join(rows))
    return {"load": {"kind": "recorded", "file": str(path)}}


@pytest.mark.parametrize("case", ["constant", "spring", "thermal"])
def test_steps_that_grow_steadily_are_of_second_order_or_more(case):
    passes = 60_000
    problem, _, _ = built(contact__strips=41, operation__passes=passes, **CASES[case])
    problem = replace(problem, iteration_tolerance=1e-9)
    ends = []
    for count in (20, 40, 80, 320):
        state = fresh_state(problem)
        times = np.concatenate([[0.0], np.geomspace(10.0, passes, count)])
        for number, length in enumerate(np.diff(times)):
            state = ImplicitStepper(1.0).started(problem, state)
            state = implicit_step(
                problem, state.replaced(order=np.array([min(number + 1, 3)])), np.array([length])
            )
        ends.append(state)
    depths = np.array([state.cylinder_depth.max() for state in ends])
    errors = np.abs(depths[:-1] / depths[-1] - 1.0)
    assert (np.log2(errors[:-1] / errors[1:]) > 1.5).all()
    assert errors[-1] < 1e-4


@pytest.mark.parametrize("case", list(CASES))
def test_volume_is_wear_factor_times_energy(case):
    problem, stepper, stop = built(contact__strips=61, operation__passes=45_000, **CASES[case])
    state, _ = stepped(problem, stepper, stop)
    factor = 1.1e-11 * (2.0 if case == "both wear" else 1.0)
    assert volume_of(problem, state.depths) == pytest.approx(factor * state.energy, rel=1e-12)


LOADS = st.lists(st.floats(60.0, 600.0), min_size=11, max_size=14)


@settings(
    max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(loads=LOADS, stiffness=st.sampled_from([0.0, 2e5, 2e6]))
def test_no_depth_and_no_energy_decreases_on_any_log(tmp_path, loads, stiffness):
    changes = log_of(loads, tmp_path)
    changes["load"]["stiffness"] = f"{stiffness} N/m"
    problem, stepper, stop = built(
        contact__strips=41, operation__passes=15_000, wear__roller__k_over_h="3e-12 1/Pa", **changes
    )
    assert_monotonic(path_of(problem, stepper, stop))


def assert_monotonic(states):
    assert len(states) > 4
    for before, after in itertools.pairwise(states):
        assert (after.cylinder_depth >= before.cylinder_depth).all()
        assert (after.roller_depth >= before.roller_depth).all()
        assert (after.energy >= before.energy).all()


@pytest.mark.parametrize(
    "changes",
    [
        {**SPRING, "load__stiffness": "20 kN/mm"},  # the edge of the contact recedes
        {**OFFSET, "creepage__tilt": ["2 mrad", "-1 mrad", "0 mrad"], **BOTH},
        {"wear__cylinder__k_over_h": "2e-10 1/Pa"},
    ],
    ids=["stiff spring", "offset and tilt", "fast wear"],
)
def test_no_depth_and_no_energy_decreases(changes):
    problem, stepper, stop = built(contact__strips=61, operation__passes=30_000, **changes)
    assert_monotonic(path_of(problem, stepper, stop))


def test_a_smooth_test_is_stepped_at_third_and_fourth_order():
    problem, stepper, stop = built(operation__passes=45_000, evolution__tolerance=1e-4)
    orders = [int(state.order[0]) for state in path_of(problem, stepper, stop)[2::2]]
    assert np.mean(np.array(orders) >= 3) > 0.5
    assert 4 in orders


def test_steps_become_short_towards_the_end():
    problem, stepper, stop = built(operation__passes=45_000)
    passes = np.array([0.0, *(float(s.passes[0]) for s in path_of(problem, stepper, stop)[1:])])
    steps = np.diff(passes)
    assert steps[-1] < 0.3 * steps.max()
    assert passes[-1] == stop


def test_scatter_of_a_log_needs_no_steps_of_its_own(tmp_path):
    rng = np.random.default_rng(5)
    changes = {
        "contact__strips": 61,
        "operation__passes": 60_000,
        "creepage__longitudinal": 3e-4,
        **log_of(300.0 + 120.0 * rng.uniform(-1.0, 1.0, 402), tmp_path, interval=3),
    }
    state, _ = stepped(*built(**changes))
    exact, _ = stepped(*built(evolution__stepper="per-pass", **changes))
    assert state.steps[0] < 201  # half of the rows
    error = abs(state.cylinder_depth.max() / exact.cylinder_depth.max() - 1.0)
    assert error < 4e-3
    assert error * state.cylinder_depth.max() < state.depth_error[0]


@pytest.mark.parametrize("case", CASES)
def test_error_of_a_constant_load_is_stated_without_more_contact_solves(case):
    changes = {"operation__passes": 45_000, "contact__strips": 61, **CASES[case]}
    fine, _ = stepped(*built(evolution__tolerance=1e-6, **changes))
    covered = []
    for tolerance in (1e-2, 1e-3, 1e-4):
        problem, stepper, stop = built(evolution__tolerance=tolerance, **changes)
        state, _ = stepped(problem, stepper, stop)
        assert state.coarse_step_solution is None
        assert state.solves[0] <= problem.contacts_each * (1.5 * state.steps[0] + 2.0)
        norm = np.linalg.norm(state.stacked - fine.stacked) / np.linalg.norm(fine.stacked)
        assert 0.5 * norm < state.profile_error[0] < 20.0 * norm
        depth = abs(state.stacked.max() - fine.stacked.max())
        covered += [norm <= state.profile_error[0], depth <= state.depth_error[0]]
    # about one stated error in twenty is below the true one
    assert sum(covered) >= len(covered) - 1
