"""Stabilised steps of models without capabilities: order, stability, balance, errors, failures."""

from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import built, cylinder_depth_of, next_state, stepped
from tests.evolution.black_box import BlackBox, boxed
from tests.evolution.test_closed_forms import (
    K_OVER_H,
    PASSES,
    closed_depth,
    closed_depth_with_spring,
    recovery_of,
)
from tests.evolution.test_steppers import (
    CASES,
    SMALL,
    SPIKE,
    THREE,
    end_by_every_pass,
    roughened,
)
from tests.studies.random_examples import SLACK, end_of, scenario_of
from wearsim.errors import ContactError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import greatest_depth, volume_of
from wearsim.evolution.quantities import oscillation, worn_volume
from wearsim.evolution.steppers.forward_euler import decay_rates, stability_limit
from wearsim.evolution.steppers.stabilised import StabilisedStepper, stabilised_step

SPRING = {"load__kind": "spring", "load__stiffness": "20 kN/mm"}
THERMAL = {"load.thermal": {"gain": "300 N/W", "time_constant": "3 min"}}


def assert_covered(problem, reference, found):
    """Check that the error estimates of depth and volume cover the errors."""
    assert (
        abs(greatest_depth(found.depths) - greatest_depth(reference.depths))[0]
        <= found.depth_error[0]
    )
    volumes = volume_of(problem, found.depths)[0], volume_of(problem, reference.depths)[0]
    assert abs(volumes[0] - volumes[1]) <= found.volume_error[0] + 1e-7 * volumes[1]


@pytest.fixture(scope="module")
def foundation():
    problem, stepper, stop = boxed(foundation=True)
    return problem, *stepped(problem, stepper, stop)


def test_rig_on_a_foundation_needs_fewer_than_300_solves(foundation):
    problem, state, advances = foundation
    assert problem.model.solved < 300
    assert state.depth_error[0] < 1e-3 * greatest_depth(state.depths)[0]
    assert max(oscillation(a.end.contacts[0].line_load) for a in advances) < 0.01


def test_depth_on_a_foundation_equals_closed_form(foundation):
    assert cylinder_depth_of(foundation[1])[0] == pytest.approx(closed_depth(PASSES), rel=5e-3)


def test_depth_with_a_spring_equals_closed_form():
    problem, stepper, stop = boxed(foundation=True, load__kind="spring", load__stiffness="690 N/mm")
    state = stepped(problem, stepper, stop)[0]
    closed = closed_depth_with_spring(PASSES, 690e3, recovery_of(problem, state))
    assert cylinder_depth_of(state)[0] == pytest.approx(closed, rel=5e-3)


def test_tighter_tolerance_gives_a_smaller_error(foundation):
    problem, _, stop = boxed(foundation=True)
    exact = stepped(problem, StabilisedStepper(3e-5), stop)[0]
    loose = stepped(problem, StabilisedStepper(1e-2), stop)[0]
    assert_covered(problem, exact, foundation[1])
    assert_covered(problem, exact, loose)
    errors = [
        abs(greatest_depth(s.depths) - greatest_depth(exact.depths))[0]
        for s in (foundation[1], loose)
    ]
    assert errors[0] < 0.5 * errors[1]


@pytest.mark.parametrize(
    "changes", [{}, SPRING, THREE, THERMAL], ids=["constant", "spring", "three", "thermal"]
)
def test_steps_are_of_second_order(changes):
    passes = 10_000
    problem, _, _ = boxed(foundation=True, contact__strips=41, **changes)
    profiles = []
    for steps in (4, 8, 16, 48):
        stepper = StabilisedStepper(1.0, forced_step=passes / steps)
        state, _ = stepped(problem, stepper, passes)
        profiles.append(state.cylinder_depth)
    errors = np.array([np.abs(p - profiles[-1]).max() for p in profiles[:-1]])
    orders = np.log2(errors[:-1] / errors[1:])
    assert (orders > 1.7).all()
    assert (orders < 2.5).all()
    assert errors[-1] < 5e-6 * profiles[-1].max()


@pytest.mark.parametrize("case", list(CASES))
@pytest.mark.parametrize("tolerance", [1e-2, 3e-4])
def test_slender_contacts_match_per_pass_within_estimate(case, tolerance):
    problem, stepper, stop = boxed(evolution__tolerance=tolerance, **SMALL, **CASES[case])
    found, _ = stepped(problem, stepper, stop)
    assert_covered(problem, end_by_every_pass(case), found)
    assert found.depth_error[0] < tolerance * greatest_depth(found.depths)[0]
    assert found.volume_error[0] < tolerance * volume_of(problem, found.depths)[0]


def test_no_step_skips_a_peak_of_the_load(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(SPIKE)
    common = {
        "load": {"kind": "recorded", "file": str(path)},
        "operation__passes": 45_000,
        "contact__strips": 71,
    }
    problem, stepper, stop = built(evolution__stepper="per-pass", **common)
    reference, _ = stepped(problem, stepper, stop)
    problem, stepper, stop = boxed(evolution__tolerance=3e-3, **common)
    found, _ = stepped(problem, stepper, stop)
    assert_covered(problem, reference, found)
    assert found.depth_error[0] < 5e-3 * greatest_depth(found.depths)[0]


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"wear__roller__k_over_h": "2e-12 1/Pa", "creepage__tilt": ["0 mrad", "1 mrad", "1 mrad"]},
        {"creepage__longitudinal": 3e-4, "creepage__yaw": "0.2 mrad", **SPRING},
        {"creepage__differential_slip": True, **THERMAL},
        {"contact__model": "hertz-fastsim"},
    ],
    ids=["constant", "tilted", "spring", "thermal", "hertz-fastsim"],
)
def test_worn_volume_is_wear_factor_times_energy(changes):
    problem, stepper, stop = boxed(operation__passes=20_000, **changes)
    state, _ = stepped(problem, stepper, stop)
    volume = worn_volume(state.cylinder_depth, problem.grid.spacing, 0.025)
    assert volume.sum() == pytest.approx(K_OVER_H * state.energy[0], rel=1e-12, abs=0.0)


@pytest.fixture(scope="module")
def half_worn():
    problem, stepper, _ = boxed(contact__strips=121)
    state, _ = stepped(problem, stepper, 300_000.0)
    return problem, replace(state, coarse_step_solution=None, decay=None)


@pytest.mark.parametrize("factor", [3.0, 10.0, 30.0])
def test_steps_beyond_explicit_limit_smooth_a_scratch(half_worn, factor):
    problem, state = half_worn
    state = roughened(state)
    step = factor * stability_limit(problem, state)[0]
    first = stabilised_step(problem, state, np.ones(1), decay_rates(problem, state))
    worst = oscillation(first.contacts[0].line_load)
    stepper = StabilisedStepper(1.0, forced_step=step)
    for _ in range(8):
        state = next_state(problem, stepper, state)
        assert oscillation(state.contacts[0].line_load) < worst
    assert oscillation(state.contacts[0].line_load) < 0.05 * worst


def test_decay_rate_on_a_foundation_is_that_of_stiffest_strip():
    problem, _, _ = boxed(foundation=True)
    state = fresh_state(problem)
    contact = state.contacts[0]
    loaded = contact.line_load > 0.0
    # q = (4/3) E d a with a = sqrt(2 d/kappa): dq/dd = 2 E a
    stiffness = 2.0 * 2.0e13 * contact.half_length[loaded]
    wear = K_OVER_H * contact.dissipation[loaded] / problem.kinematics.rolling_speed
    slowest = (wear / contact.line_load[loaded] * stiffness).max()
    before = problem.model.solved
    assert decay_rates(problem, state)[0] == pytest.approx(slowest, rel=0.01)
    assert problem.model.solved - before <= 2
    # one iteration is sufficient if the rate is known
    known = replace(state, decay=decay_rates(problem, state))
    before = problem.model.solved
    assert decay_rates(problem, known)[0] == pytest.approx(slowest, rel=0.01)
    assert problem.model.solved - before == 1


def test_expectation_over_passes_matches_drawn_passes():
    drawn = {"creepage__misalignment": {**SLACK, "persistence": "per-pass"}}
    drawn |= {"passes": 1500, "contact__strips": 41}
    _, reference = end_of(scenario_of(evolution__stepper="per-pass", **drawn))
    problem, state = end_of(scenario_of(evolution__stepper="stabilised", **drawn))
    assert problem.has_nodes
    assert state.quadrature[0, 0] > 0.0
    assert_covered(problem, reference, state)
    assert state.depth_error[0] < 0.02 * greatest_depth(state.depths)[0]


class FailingFarAway(BlackBox):
    """Model that fails if the contact differs too much from the initial guess."""

    def solve_contact(self, gap, longitudinal_curvature, point, wear_compliance=None, warm=None):
        found = super().solve_contact(gap, longitudinal_curvature, point, wear_compliance, warm)
        if warm is not None and abs(found.approach - warm.approach) > 0.1e-6:
            raise ContactError("the contact has moved too far", {"gap": gap})
        return found


def test_step_is_shortened_until_every_stage_is_solved():
    common = {"foundation": True, "operation__passes": 30_000, "contact__strips": 61}
    problem, stepper, stop = boxed(box=FailingFarAway, **common)
    found, advances = stepped(problem, stepper, stop)
    reference, plain = stepped(*boxed(**common))
    assert found.rejected > 0
    assert len(advances) > len(plain)
    assert greatest_depth(found.depths) == pytest.approx(greatest_depth(reference.depths), rel=2e-3)


def test_error_of_a_model_that_always_fails_is_raised():
    class Failing(BlackBox):
        def solve_contact(self, gap, *others):
            if gap.min() > 1e-6:
                raise ContactError("no solution beyond a micrometre", {"gap": gap})
            return super().solve_contact(gap, *others)

    problem, stepper, stop = boxed(foundation=True, box=Failing)
    with pytest.raises(ContactError, match="no solution beyond a micrometre") as caught:
        stepped(problem, stepper, stop)
    assert caught.value.state["gap"].min() > 1e-6
    with pytest.raises(ContactError, match="no solution beyond a micrometre"):
        stepped(problem, StabilisedStepper(1e-3, forced_step=1e5), stop)
