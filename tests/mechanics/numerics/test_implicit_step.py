"""Implicit steps of few strips against the backward differentiation formula of polynomials."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import built, stepped
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import volume_of
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.implicit import ImplicitStepper, implicit_step
from wearsim.evolution.steppers.single_step import carried_loads, solve_present, wear_per_pass

CASES = {
    "one roller": {"operation__rollers": 1},
    "both wear": {"wear__roller__k_over_h": "2e-11 1/Pa", "operation__rollers": 1},
    "three rollers": {
        "wear__roller__k_over_h": "0.5e-11 1/Pa",
        "roller__offset": ["-1 mm", "0.3 mm", "1 mm"],
    },
    "spring": {"load__kind": "spring", "load__stiffness": "690 N/mm", "operation__rollers": 1},
}
LENGTHS = [0.5, 0.6, 0.7, 50.0, 60.0, 70.0, 90.0, 100.0, 130.0]


def rates_of(problem: WearProblem, state: WearState) -> tuple[np.ndarray, np.ndarray]:
    """Return wear and energy per pass of the profiles of a state, solved anew."""
    contacts = solve_present(problem, state, carried_loads(problem, state.contacts))
    return wear_per_pass(problem, contacts)


@pytest.mark.parametrize("case", list(CASES))
@pytest.mark.parametrize("most", [1, 2, 4])
def test_slope_of_the_polynomial_through_the_points_is_the_wear(case: str, most: int) -> None:
    changes = {"contact__strips": 11, "contact__width": "8 mm", "operation__passes": 10_000}
    problem, _, _ = built(**changes, **CASES[case])
    problem = replace(problem, iteration_tolerance=1e-9)
    # without edges resolved within a strip
    state = ImplicitStepper(1.0, by_doubling=True).started(problem, fresh_state(problem))
    at, rate, power = [0.0], *rates_of(problem, state)
    depths, energy, whole = [np.zeros_like(rate)], [np.zeros_like(power)], [state]
    for number, length in enumerate(LENGTHS):
        order = np.array([min(number + 1, most)])
        state = implicit_step(problem, state.replaced(order=order), np.array([length]))
        new, new_power = rates_of(problem, state)
        # passes are counted one by one in steps of more than two: half of the change of the rate
        half = 0.5 if length > 2.0 else 0.0
        whole.append(state)
        depths.append(depths[-1] + state.stacked - whole[-2].stacked + half * (new - rate))
        energy.append(energy[-1] + state.energy - whole[-2].energy + half * (new_power - power))
        at.append(at[-1] + length)
        rate, power = new, new_power
        # the order is one where a step is much longer than the last one
        order_of_step = 1 if length == 50.0 else int(order[0])
        points = np.array(at[-1 - order_of_step :]) - at[-1]
        weights = np.linalg.solve(
            np.vander(points, increasing=True).T, np.eye(len(points))[1]
        )  # of the derivative at the end
        slope, power_of_step = (
            np.tensordot(weights, np.array(values[-1 - order_of_step :]), axes=1)
            for values in (depths, energy)
        )
        assert slope == pytest.approx(rate, rel=1e-5, abs=1e-5 * rate.max())
        assert power_of_step == pytest.approx(power, rel=1e-5)


@pytest.mark.parametrize("case", ["one roller", "both wear", "three rollers"])
def test_volume_in_a_groove_with_resolved_edges_is_wear_factor_times_energy(
    case: str,
) -> None:
    problem, stepper, stop = built(
        contact__strips=31,
        contact__width="20 mm",
        operation__passes=200_000,
        evolution__tolerance=0.02,
        **CASES[case],
    )
    state, steps = stepped(problem, stepper, stop)
    assert all(step.end.separation is not None for step in steps)
    factor = 1.1e-11 + {"both wear": 2e-11, "three rollers": 0.5e-11}.get(case, 0.0)
    assert volume_of(problem, state.depths) == pytest.approx(
        factor * state.energy, rel=1e-12, abs=0.0
    )
    for start, end in itertools.pairwise(steps):
        assert (end.end.stacked >= start.end.stacked).all()
    if case == "one roller":
        # rigid bodies in full slip; the crown is 500 mm
        rigid = (0.75 * 1.1e-15 * 300.0 * 200_000) ** (2.0 / 3.0)
        assert state.cylinder_depth.max() == pytest.approx(rigid, rel=0.02)
        assert state.stacked == pytest.approx(state.stacked[..., ::-1], rel=1e-6, abs=1e-12)
