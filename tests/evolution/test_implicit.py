"""Implicit stepper: order, conservation, monotonic wear, control of order and step length."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from tests.evolution import built, never, stepped
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import volume_of
from wearsim.evolution.integrate import evolve
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
    assert volume_of(problem, state.depths) == pytest.approx(
        factor * state.energy, rel=1e-12, abs=0.0
    )


LOADS = st.lists(st.floats(60.0, 600.0), min_size=8, max_size=10)


@settings(
    max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(loads=LOADS, stiffness=st.sampled_from([0.0, 2e5, 2e6]))
def test_no_depth_and_no_energy_decreases_on_any_log(tmp_path, loads, stiffness):
    changes = log_of(loads, tmp_path)
    changes["load"]["stiffness"] = f"{stiffness} N/m"
    problem, stepper, stop = built(
        contact__strips=41, operation__passes=10_000, wear__roller__k_over_h="3e-12 1/Pa", **changes
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


# partial slip of three rollers whose contacts overlap; strips leave a contact as others enter
OVERLAPPING = {
    "operation__rollers": 3,
    "roller__radius": "43 mm",
    "roller__crown_radius": "44.94 mm",
    "cylinder__radius": "34.72 mm",
    "load__normal_force": "96.46 N",
    "friction__coefficient": 0.07688,
    "roller__offset": ["-0.2005 mm", "-0.5011 mm", "0.07609 mm"],
    "creepage__longitudinal": 1.099e-4,
    "wear__cylinder__k_over_h": "1.096e-12 1/Pa",
    "wear__roller__k_over_h": "5.699e-14 1/Pa",
    "operation__passes": 2_500_000,
    "evolution__tolerance": 1e-4,
}


def test_step_in_which_a_strip_leaves_its_contact_is_of_second_order():
    problem, stepper, stop = built(**OVERLAPPING)
    lowered = 0
    for start, end in itertools.pairwise(path_of(problem, stepper, stop)):
        if start.past_spans is None or start.order[0] < 3:
            continue
        length = end.passes - start.passes
        one = implicit_step(problem, start, length)
        if one.order[0] == start.order[0]:
            continue
        lowered += 1
        assert one.order[0] == 2
        first = implicit_step(problem, start.replaced(order=np.array([1])), length)
        several = start
        for _ in range(8):
            several = implicit_step(problem, several.replaced(order=np.array([2])), length / 8)
        errors = [np.linalg.norm(other.stacked - several.stacked) for other in (one, first)]
        assert errors[0] < 0.5 * errors[1]
    assert lowered


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        OVERLAPPING,
        {  # partial slip in a groove that many strips enter one by one
            "operation__rollers": 1,
            "roller__radius": "13.05 mm",
            "roller__crown_radius": "26.55 mm",
            "cylinder__radius": "39.17 mm",
            "load__normal_force": "62.68 N",
            "friction__coefficient": 0.1329,
            "creepage__longitudinal": 3.654e-5,
            "wear__cylinder__k_over_h": "7.76e-12 1/Pa",
            "operation__passes": 614_600_000,
            "evolution__tolerance": 1e-4,
        },
    ],
    ids=["strips leave contacts", "strips enter"],
)
def test_errors_of_all_steps_are_at_most_twice_the_tolerance(changes):
    state, _ = stepped(*built(**changes))
    problem, stepper, stop = built(**{**changes, "evolution__tolerance": 1e-6})
    exact, _ = stepped(problem, stepper, stop)
    difference = state.stacked - exact.stacked
    assert np.linalg.norm(difference) < 2e-4 * np.linalg.norm(exact.stacked)
    volumes = [volume_of(problem, one.depths)[0] for one in (state, exact)]
    assert volumes[0] == pytest.approx(volumes[1], rel=2e-4, abs=0.0)
    assert state.depth_error < 2e-3 * exact.stacked.max()  # known without a wide margin


@pytest.mark.slow
def test_power_of_an_adhering_contact_does_not_jump_from_step_to_step():
    # a tilted roller has a line of pure rolling, on which a ridge carries most of the load
    problem, stepper, stop = built(
        operation__rollers=1,
        operation__passes=30_000_000,
        roller__radius="20 mm",
        roller__crown_radius="50 mm",
        cylinder__radius="10 mm",
        load__normal_force="10 N",
        friction__coefficient=0.1,
        creepage={"longitudinal": 1e-5, "tilt": "-1 mrad"},
        wear__cylinder__k_over_h="1e-9 1/Pa",
    )
    states = path_of(problem, stepper, stop)
    late = [state.contacts.power[0] for state in states if state.passes[0] > 0.3 * stop]
    assert np.abs(np.diff(late) / late[1:]).max() < 0.1


def test_step_in_which_a_logged_load_jumps_is_of_first_order(tmp_path):
    path = tmp_path / "log.csv"
    rows = ["0, 300", "59.9, 300", "60, 150", "90, 150", "120, 250"]
    path.write_text("\n".join(["time [s], load [N]", *rows]))
    changes = {"contact__strips": 41, "load": {"kind": "recorded", "file": str(path)}}
    problem, _, stop = built(operation__duration="2 min", **changes)
    rate = stop / 120.0  # passes per second
    state = ImplicitStepper(1.0).started(problem, fresh_state(problem))
    orders = []
    for until in (40.0, 50.0, 55.0, 65.0, 75.0, 85.0, 90.0, 95.0, 105.0):  # s
        length = np.array([until * rate]) - state.passes
        state = implicit_step(problem, state.replaced(order=np.array([2])), length)
        orders.append(int(state.order[0]))
    assert orders == [2, 2, 2, 1, 2, 2, 2, 2, 2]


def test_a_smooth_test_is_stepped_at_third_and_fourth_order():
    problem, stepper, stop = built(operation__passes=45_000, evolution__tolerance=1e-4)
    orders = [int(state.order[0]) for state in path_of(problem, stepper, stop)[2::2]]
    assert np.mean(np.array(orders) >= 3) > 0.5
    assert 4 in orders


def test_steps_become_short_towards_the_end():
    problem, stepper, stop = built(operation__passes=45_000)
    passes = np.array([0.0, *(float(s.passes[0]) for s in path_of(problem, stepper, stop)[1:])])
    steps = np.diff(passes)
    assert steps[-1] < 0.51 * steps.max()
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
