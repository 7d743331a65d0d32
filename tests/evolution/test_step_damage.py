"""Damage that a step adds, with rates of damage and of wear found one by one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import built
from tests.evolution.test_fatigue import LAW, QUICK, fatigue
from tests.evolution.test_step_loads import Line, with_loads
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.fatigue import damage_per_pass, effective_of_rows, layer_thickness
from wearsim.evolution.quantities import Varying
from wearsim.evolution.steppers.damage import _load_nodes, with_damage
from wearsim.evolution.steppers.loads import descents
from wearsim.evolution.steppers.single_step import explicit_step, solve_present
from wearsim.mechanics.fatigue import damage_of_step
from wearsim.mechanics.numerics.piecewise_linear import Paths

ROOT, STIFFNESS = math.sqrt(3.0), 690e3
BOTH = fatigue(roller=LAW, remove=True)
OFFSETS = {"roller__offset": ["0 mm", "0.5 mm", "0.5 mm"], "contact__strips": 41}
WEAR = {"wear__roller__k_over_h": "5e-10 1/Pa"}


# nodes and weights of a load with the deviation 40 N that is at most 50 N below its mean
UPPER = ROOT * 40.0
THREE_LOADS = (
    (-50.0, 1600.0 / (50.0 * (50.0 + UPPER))),
    (0.0, 1.0 - 1600.0 / (50.0 * UPPER)),
    (UPPER, 1600.0 / (UPPER * (50.0 + UPPER))),
)


class Scattered(Line):
    """Load with given extremes around its mean."""

    def __init__(self, deviation, below, above, **options):
        super().__init__(deviation=deviation, **options)
        self.below, self.above = below, above

    def deviation(self, start, stop):
        return super().deviation(start, stop) if stop > start else 0.0

    def extremes(self, start, stop):
        mean = self.mean(start, stop)
        return mean - self.below, mean + self.above


def exact_damage(problem, start, end, first, last, points, slope=0.0):
    """Return the damage of a step and the effective damage by the kernel."""
    strips, passes = problem.grid.strips, end.passes - start.passes
    removed = (end.stacked - start.stacked) / layer_thickness(problem, end.contacts)
    if not problem.fatigue.remove:
        removed = np.empty((0, strips))
    added, sums = damage_of_step(
        *(start.damage.reshape(4, -1, strips), first.reshape(-1, strips)),
        *(last.reshape(-1, strips), removed.reshape(-1, strips)),
        *(start.passes, passes, points, slope),
    )
    effective = effective_of_rows(problem, sums.reshape(3, -1, len(passes)))
    return added.reshape(start.damage.shape), effective


def stepped_twice(problem, start=None, passes=400.0):
    """Return the states before and after a second step, and without the damage of the latter."""
    step = np.full(problem.shape[2], passes)
    state = start or fresh_state(problem)
    middle = explicit_step(problem, state, step)
    middle = with_damage(problem, state, middle)[0]
    return middle, explicit_step(problem, middle, step)


@pytest.mark.parametrize("changes", [BOTH, fatigue()], ids=["removed", "kept"])
def test_damage_under_a_constant_load_is_that_of_both_ends(changes):
    problem, _, _ = built(**{**QUICK, **OFFSETS, **WEAR, **changes})
    start, end = stepped_twice(problem)
    found, effective = with_damage(problem, start, end)
    assert start.damage_points[0, 0] == 0.0
    last = damage_per_pass(problem, end.contacts)
    exact, sums = exact_damage(problem, start, end, start.damage[2], last, start.damage_points)
    np.testing.assert_array_equal(found.damage, exact)
    np.testing.assert_array_equal(effective, sums)
    np.testing.assert_array_equal(found.damage_points, [[400.0], start.damage_points[1]])
    assert start.damage_points[0, 0] == 0.0  # unchanged


def test_sums_of_the_weakest_link_have_the_slope_of_the_lives():
    area = fatigue(scatter="weakest-link", reference_area="50 mm^2")
    problem, _, _ = built(**{**QUICK, **OFFSETS, **area})
    start, end = stepped_twice(problem)
    _, effective = with_damage(problem, start, end)
    last, slope = damage_per_pass(problem, end.contacts), problem.fatigue.slope
    given = start.damage[2], last, start.damage_points, slope
    np.testing.assert_array_equal(effective, exact_damage(problem, start, end, *given)[1])


def test_pause_adds_no_damage():
    problem, _, _ = built(**{**QUICK, **OFFSETS, **BOTH})
    times = np.array([400.0, 900.0]) / problem.kinematics.pass_rate
    problem = with_loads(problem, Line(pauses=[times]), Line(pauses=[2.0 * times]))
    start = fresh_state(problem)
    worn = explicit_step(problem, start, np.full(2, 400.0))
    start = with_damage(problem, start, worn)[0]
    end = start.replaced(passes=start.passes + 500.0)
    found, _ = with_damage(problem, start, end)
    greatest = [state.damage[0].max(axis=(0, 2)) for state in (start, found)]
    assert greatest[0][0] == greatest[1][0] > 0.0
    assert greatest[1][1] > 1.5 * greatest[0][1]


def test_damage_of_a_scattered_load_is_that_of_three_loads():
    problem, _, _ = built(
        **{**QUICK, **OFFSETS, **WEAR, **BOTH},
        load__kind="spring",
        load__stiffness=f"{STIFFNESS / 1e3} N/mm",
        load__thermal={"gain": "500 N/W", "time_constant": "2 s"},
    )
    loads = [Scattered(40.0, 50.0, 300.0, rate=3.0, stiffness=STIFFNESS) for _ in range(2)]
    problem = with_loads(problem, *loads)
    known = fresh_state(problem)
    known = known.replaced(terms=np.array([[[5.0, 6.0], [7.0, 8.0]]]))
    start, end = stepped_twice(problem, known)
    found, effective = with_damage(problem, start, end)
    time = 600.0 / problem.kinematics.pass_rate  # in the middle of the step
    rates = []
    for state in (start, end):
        mean = 300.0 + 3.0 * time - STIFFNESS * descents(problem, state.depths) + state.terms[0]
        rate = 0.0
        for offset, weight in THREE_LOADS:
            contacts = solve_present(problem, state, mean + offset)
            rate = rate + weight * damage_per_pass(problem, contacts)
        rates.append(rate)
    points = start.damage_points.copy()
    points[0] = np.nan
    exact, sums = exact_damage(problem, start, end, *rates, points)
    scale = exact.max(axis=(1, 2, 3))[:, None, None, None]
    np.testing.assert_allclose(found.damage / scale, exact / scale, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(effective, sums, rtol=1e-7)
    assert (
        exact[0].max()
        > 1.05
        * exact_damage(
            problem, start, end, start.damage[2], damage_per_pass(problem, end.contacts), points
        )[0][0].max()
    )


def test_small_loads_are_a_small_part_of_the_mean():
    problem, _, _ = built(**{**QUICK, **OFFSETS, **fatigue()})
    problem = with_loads(problem, Scattered(300.0, 600.0, 600.0))
    start, end = stepped_twice(problem)
    found, _ = with_damage(problem, start, end)
    upper, middle = (
        damage_per_pass(problem, solve_present(problem, end, np.full(problem.shape, load)))
        for load in (300.0 * (1.0 + ROOT), 300.0)
    )
    np.testing.assert_allclose(found.damage[2], upper / 6.0 + 2.0 * middle / 3.0, rtol=1e-6)


def test_damage_under_a_varying_friction_has_no_point_before():
    problem, _, _ = built(**{**QUICK, **OFFSETS, **BOTH})
    path = Paths.through(np.array([0.0, 1e3]), np.array([0.1, 0.2]))
    problem = replace(problem, varying=(Varying("friction", (0,), path),))
    start, end = stepped_twice(problem)
    found, _ = with_damage(problem, start, end)
    points = np.stack([[np.nan], start.damage_points[1]])
    rates = (
        damage_per_pass(problem, solve_present(problem, state, np.full(problem.shape, 300.0)))
        for state in (start, end)
    )
    exact, _ = exact_damage(problem, start, end, *rates, points)
    np.testing.assert_allclose(found.damage[0], exact[0], rtol=1e-7, atol=1e-9 * exact[0].max())


def test_damage_on_a_cam_varies_with_the_load_on_its_follower():
    problem, _, _ = built("cam-cycloidal", contact__strips=41, **fatigue())
    cam = problem.kinematics.track
    varied = with_loads(problem, Scattered(40.0, 50.0, 300.0))
    state = fresh_state(problem)
    start, end = (state.replaced(passes=np.array([n])) for n in (100.0, 110.0))
    found, _ = with_damage(varied, start, end)
    mean, rate = problem.at_stations(np.array([300.0])), 0.0
    for offset, weight in THREE_LOADS:
        contacts = solve_present(problem, state, mean + cam.load_factor * offset)
        rate = rate + weight * damage_per_pass(problem, contacts)
    np.testing.assert_allclose(found.damage[2], rate, rtol=1e-7, atol=1e-12 * rate.max())


NODES = [  # deviation, reach below and above the mean
    (40.0, 200.0, 300.0),
    (40.0, 50.0, 300.0),
    (40.0, 300.0, 50.0),
    (40.0, 40.0, 40.0),
    (40.0, 20.0, 80.0),  # two levels
    (40.0, 80.0, 20.0),
    (40.0, 25.0, 120.0),
    (40.0, 120.0, 25.0),
    (1e-3, 0.5, 0.7),
]


def test_nodes_have_the_mean_and_the_variance_of_the_load():
    problem, _, _ = built(contact__strips=41)
    many = with_loads(problem, *(Scattered(*case) for case in NODES))
    times = np.zeros(len(NODES)), np.ones(len(NODES))
    offsets, weights = (np.array(part) for part in zip(*_load_nodes(many, *times), strict=True))
    deviation, below, above = np.array(NODES).T
    assert (weights >= 0.0).all()
    assert (offsets >= -below * (1.0 + 1e-12)).all()
    assert (offsets <= above * (1.0 + 1e-12)).all()
    np.testing.assert_allclose(weights.sum(axis=0), 1.0, rtol=1e-14)
    np.testing.assert_allclose((weights * offsets).sum(axis=0) / deviation, 0.0, atol=1e-12)
    np.testing.assert_allclose((weights * offsets**2).sum(axis=0), deviation**2, rtol=1e-12)
    normal = np.array([0, 8])
    np.testing.assert_allclose(offsets[2, normal], ROOT * deviation[normal], rtol=1e-12)
    np.testing.assert_allclose(offsets[0, normal], -offsets[2, normal], rtol=1e-12)
    np.testing.assert_array_equal(weights[1, 3:6], 0.0)
    # within the reach that is short, and as far from normal nodes as this requires
    np.testing.assert_allclose(offsets[[0, 2], 1], [-50.0, ROOT * 40.0], rtol=1e-12)
    np.testing.assert_allclose(offsets[[0, 2], 2], [-ROOT * 40.0, 50.0], rtol=1e-12)
    np.testing.assert_allclose(offsets[[0, 2], 6], [-25.0, ROOT * 40.0], rtol=1e-12)
    np.testing.assert_allclose(offsets[[0, 2], 7], [-ROOT * 40.0, 25.0], rtol=1e-12)


def test_nodes_of_a_constant_load_are_its_mean_alone():
    problem, _, _ = built(contact__strips=41)
    cases = (0.0, 50.0, 50.0), (40.0, 0.0, 50.0), (40.0, 50.0, 0.0)
    many = with_loads(problem, *(Scattered(*case) for case in cases))
    nodes = _load_nodes(many, np.zeros(3), np.ones(3))
    weights = np.array([weight for _, weight in nodes])
    np.testing.assert_array_equal(weights, np.array([[0.0], [1.0], [0.0]]) * np.ones(3))


def test_nodes_contain_the_scatter_of_the_offset():
    problem, _, _ = built(contact__strips=41)
    path = Paths.through(np.array([0.0, 2.0]), np.array([0.0, 60.0]))
    other = Paths.through(np.array([0.0, 2.0]), np.array([0.1, 0.3]))
    items = Varying("friction", (0,), other), Varying("normal_force_offset", (0,), path)
    problem = replace(with_loads(problem, Scattered(20.0, 10.0, 60.0)), varying=items)
    nodes = _load_nodes(problem, np.zeros(1), np.full(1, 2.0))
    own = 60.0 / math.sqrt(12.0)
    variance = 20.0**2 + own**2
    root = math.sqrt(3.0 * variance)
    low = min(10.0 + ROOT * own, root)
    exact = [-low, 0.0, max(root, variance / low)]
    np.testing.assert_allclose([offset[0] for offset, _ in nodes], exact, rtol=1e-12)
