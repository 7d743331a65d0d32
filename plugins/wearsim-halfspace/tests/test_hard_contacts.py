"""Contacts at the limits of the theory: Coulomb's law and equilibrium hold on every element."""

from dataclasses import replace

import numpy as np
import pytest
from halfspace_cases import RANDOM, STEEL, normal_of, problem_of

from wearsim.errors import CapabilityError, ContactError
from wearsim.plugins import ContactBatch
from wearsim.types import Creepage, Grid, OperatingPoint
from wearsim_halfspace import Halfspace, HalfspaceOptions
from wearsim_halfspace.grids import solve
from wearsim_halfspace.influence import Elements
from wearsim_halfspace.normal import solve_normal
from wearsim_halfspace.tangential import solve_tangential

GRID = Grid.spanning(-3e-3, 3e-3, 61)
CURVATURE = 90.0
GENTLE, LARGE = Creepage(1e-4, 5e-5, 0.2), Creepage(1e-3, 5e-4, 1.0)


def crown(y):
    return y**2


def two_patches(y):
    """Return the gap of a crown with a groove of 20 um."""
    return y**2 + 2e-5 * np.exp(-((y / 6e-4) ** 2))


def assert_law(model, gap, point):
    """Check the laws of contact and friction on each element, and the balances of the solution."""
    patch = model._patch(gap, CURVATURE, point, None, None)
    _, found = model._rolled(patch, point.creepage)
    problem, pressure, rolling = found.problem, found.normal.pressure, found.rolling
    touching, area = pressure > 0.0, problem.dx * problem.dy
    assert pressure.sum() * area == pytest.approx(point.normal_force, rel=1e-9)
    opened = problem.elements.normal(pressure) + problem.gap - found.normal.approach
    assert np.abs(opened[touching]).max() < 1e-4 * found.normal.approach
    assert opened[~touching].min() > -1e-4 * found.normal.approach
    bound = problem.friction * pressure
    size = np.hypot(*rolling.traction)
    assert (size <= bound * (1.0 + 1e-9)).all()
    slips = touching & ~rolling.sticks
    assert slips.any() or point.friction == 1.0
    assert size[slips] == pytest.approx(bound[slips], abs=2e-6 * bound.max())
    # traction and slip are opposite; the scale is that of the rigid slip
    along = (rolling.traction * rolling.slip).sum(axis=0)[slips]
    speed = np.hypot(*rolling.slip)[slips]
    scale = np.hypot(*problem.rigid_slip).max()
    assert np.abs(along + size[slips] * speed).max(initial=0.0) < 1e-3 * scale * bound.max()
    solution = model.solve_one(gap, CURVATURE, point)
    assert (solution.dissipation >= 0.0).all()
    total = solution.dissipation.sum() * (solution.y[1] - solution.y[0])
    assert total == pytest.approx(solution.power, rel=1e-9)
    friction = float(np.max(point.friction))
    assert np.hypot(solution.force_x, solution.force_y) <= friction * point.normal_force * 1.001
    return solution


@pytest.mark.parametrize("friction", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("creepage", [GENTLE, LARGE, Creepage(0.0, 0.0, 0.5)])
@pytest.mark.parametrize("shape", [crown, two_patches])
def test_coulomb_holds_for_any_friction_and_creepage(friction, creepage, shape):
    model = Halfspace(HalfspaceOptions(mx=24), GRID, (STEEL, STEEL))
    point = OperatingPoint(300.0, 1.0, creepage, friction)
    found = assert_law(model, shape(GRID.y), point)
    middle = found.line_load[GRID.strips // 2]
    assert (middle == 0.0) == (shape is two_patches)


def test_strips_of_scattered_friction_keep_their_own_bounds():
    generator = np.random.default_rng(3)
    friction = 0.1 * np.exp(0.5 * generator.standard_normal(GRID.strips))
    model = Halfspace(HalfspaceOptions(mx=24), GRID, (STEEL, STEEL))
    assert_law(model, crown(GRID.y), OperatingPoint(300.0, 1.0, GENTLE, friction))


def test_friction_of_each_point_bounds_its_traction():
    model = Halfspace(HalfspaceOptions(mx=24), GRID, (STEEL, STEEL))
    uniform = OperatingPoint(300.0, 1.0, GENTLE, 0.1)
    batch = ContactBatch.of(crown(GRID.y)[None], CURVATURE, [uniform])
    x, y = model.friction_points(batch)
    assert x.shape == (1, 24, GRID.strips)
    friction = 0.1 * np.exp(0.5 * np.random.default_rng(4).standard_normal(x[0].shape))
    assert_law(model, crown(y), replace(uniform, friction=friction))
    # in full slip, the power is that of the local friction
    sliding = replace(uniform, creepage=Creepage(1e-2))
    halves = replace(sliding, friction=np.where(x[0] > 0.0, 0.2, 0.1))
    power = model.solve_one(crown(y), CURVATURE, halves).power
    assert power == pytest.approx(0.15 * 300.0 * 1e-2, rel=1e-3)
    with pytest.raises(CapabilityError, match="not steady"):
        model.solve_one(crown(y), CURVATURE, replace(halves, friction_carried=True))


def test_full_adhesion_needs_no_slip():
    model = Halfspace(HalfspaceOptions(mx=24), GRID, (STEEL, STEEL))
    point = OperatingPoint(300.0, 1.0, Creepage(1e-7), 1.0)
    found = assert_law(model, crown(GRID.y), point)
    assert found.adhesion_fraction > 0.9


def test_contact_of_one_strip():
    coarse = Grid.spanning(-30e-3, 30e-3, 21)
    model = Halfspace(HalfspaceOptions(), coarse, (STEEL, STEEL))
    point = OperatingPoint(30.0, 1.0, LARGE, 0.1)
    found = model.solve_one(crown(coarse.y), CURVATURE, point)
    assert np.count_nonzero(found.line_load) == 1
    assert found.power == pytest.approx(0.1 * 30.0 * np.hypot(1e-3, 5e-4), rel=0.15)


def test_contact_of_one_element():
    elements = Elements(5, 5, 1e-4, 1e-4, 8e10, 0.3)
    gap = np.ones((5, 5))
    gap[2, 2] = 0.0
    normal = solve_normal(elements, gap, 10.0, np.ones((5, 5)), 1e-9)
    assert np.count_nonzero(normal.pressure) == 1
    assert normal.pressure[2, 2] == pytest.approx(1e9)
    slip = np.full((2, 5, 5), 1e-4)
    for friction, adhesion in ((1e-3, False), (1.0, True)):
        found = solve_tangential(elements.rolling, friction * normal.pressure, slip, 1e-9)
        assert found.sticks[2, 2] == adhesion


@pytest.mark.parametrize("width", [1e-3, 2.5e-3])
def test_contact_at_the_edge_of_the_strips_is_an_error(width):
    grid = Grid.spanning(-0.5 * width, 0.5 * width, 41)
    model = Halfspace(HalfspaceOptions(mx=24), grid, (STEEL, STEEL))
    with pytest.raises(ContactError, match=r"edge of its strips"):
        model.solve_one(crown(grid.y), CURVATURE, OperatingPoint(300.0, 1.0, LARGE, 0.1))


def test_warm_grids_do_not_change_the_solution():
    case = RANDOM[3]
    problem = problem_of(case, 40)
    normal = normal_of(problem, case)
    nested = solve(problem, normal, 1e-8).rolling.traction
    bound = problem.friction * normal.pressure
    alone = solve_tangential(problem.elements.rolling, bound, problem.slip_ahead, 1e-8).traction
    assert np.abs(nested - alone).max() < 1e-5 * bound.max()


def test_wear_that_gives_way_far_more_than_the_bodies():
    """The line load is then the penetration over the wear compliance."""
    grid = Grid.spanning(-6e-3, 6e-3, 81)
    model = Halfspace(HalfspaceOptions(mx=24), grid, (STEEL, STEEL))
    point, compliance = OperatingPoint(300.0, 2.6, Creepage(1e-3), 0.1), 3e-8
    gap = 2700.0 * grid.y**2
    found = model.solve_one(gap, CURVATURE, point, np.full_like(gap, compliance))
    line_load = np.maximum(found.approach - gap, 0.0) / compliance
    np.testing.assert_allclose(found.line_load, line_load, atol=0.01 * line_load.max())
    assert found.line_load.sum() * grid.spacing == pytest.approx(300.0, rel=1e-9)
