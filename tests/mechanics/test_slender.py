"""Slender contact: its equations, its limits and its hard cases."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.mechanics.test_influence import direct
from wearsim.mechanics.hertz import hertz
from wearsim.mechanics.influence import influence_table
from wearsim.mechanics.slender import CONVERGED, TOO_FINE, solve_slender
from wearsim.plugins import SharedWear
from wearsim.types import Grid

MODULUS = 200e9 / (2.0 * (1.0 - 0.3**2))
CURVATURE = 90.0
PATCH = hertz(45.0, 1.0, 300.0, MODULUS)


def solve(grid, gaps, loads, wear=None, start=None):
    """Solve one or several contacts; return status, line loads, approaches and iterations."""
    gaps = np.atleast_2d(gaps)
    count, n = gaps.shape
    wear = no_wear(count, n) if wear is None else wear
    line_load = np.zeros((count, n)) if start is None else start.copy()
    approach = np.zeros(count)
    status, iterations = solve_slender(
        np.ascontiguousarray(gaps),
        *wear.reduced,
        np.atleast_1d(np.asarray(loads, dtype=float)),
        grid.spacing,
        MODULUS,
        CURVATURE,
        influence_table(n),
        line_load,
        approach,
    )
    return status, line_load, approach, iterations


def no_wear(count, n):
    """Return the wear of contacts that wear nothing."""
    return SharedWear(np.zeros((count, 2), dtype=np.int64), np.zeros((count, 2, n)))


def surface(grid, gaps, line_load, wear):
    """Return gap, wear and displacement together, written out without any table."""
    count, n = gaps.shape
    total = gaps + wear.opening(line_load)
    for k in range(count):
        for j in np.flatnonzero(line_load[k]):
            a = np.sqrt(4.0 * line_load[k, j] / (np.pi * MODULUS * CURVATURE))
            shape = direct(np.log(a / grid.spacing), n)
            total[k] += line_load[k, j] / (np.pi * MODULUS) * shape[np.abs(np.arange(n) - j)]
    return total


def assert_solved(grid, gaps, loads, wear, line_load, approach):
    """Hold a solution against the equations of contact themselves."""
    total = surface(grid, gaps, line_load, wear)
    scale = np.ptp(approach[:, None] - gaps) + np.abs(approach).max()
    assert (line_load >= 0.0).all()
    np.testing.assert_allclose(line_load.sum(axis=1) * grid.spacing, loads, rtol=1e-10)
    for k in range(len(gaps)):
        inside = line_load[k] > 0.0
        np.testing.assert_allclose(total[k][inside], approach[k], atol=1e-8 * scale)
        assert (total[k][~inside] >= approach[k] - 1e-6 * scale).all()


def shape_of(name, y):
    """Return a gap profile by name [m]."""
    return {
        "fresh": y**2,
        "flat": np.maximum(0.0, y**2 - 1e-6),
        "two patches": y**2 + 10e-6 * np.exp(-((y / 0.4e-3) ** 2)),
        "step": y**2 - 3e-6 * (np.abs(y - 0.5e-3) < 0.7e-3),
        "edge": np.where(y < -0.3e-3, y**2 + 50e-6, y**2),
        "rough": y**2 + 0.5e-6 * np.sin(2 * np.pi * y / 0.1e-3 + 0.4),
    }[name]


def test_that_the_fresh_rig_is_hertz_within_seven_thousandths():
    grid = Grid.spanning(-1.85e-3, 1.85e-3, 121)
    status, (q,), (approach,), _ = solve(grid, grid.y**2, 300.0)
    assert status == CONVERGED
    a = np.sqrt(4.0 * q / (np.pi * MODULUS * CURVATURE))
    assert a.max() == pytest.approx(PATCH.a, rel=7e-3)
    assert 0.5 * MODULUS * CURVATURE * a.max() == pytest.approx(PATCH.peak_pressure, rel=7e-3)
    assert approach == pytest.approx(PATCH.approach, rel=2e-3)
    exact = PATCH.line_load(grid.y)
    assert np.abs(q - exact).sum() / exact.sum() < 2.5e-3
    assert q.sum() * grid.spacing == pytest.approx(300.0, rel=1e-12)


@pytest.mark.parametrize("name", ["fresh", "flat", "two patches", "step", "edge", "rough"])
@pytest.mark.parametrize("strips", [41, 120, 401])
def test_that_every_profile_is_solved_to_the_equations(name, strips):
    grid = Grid.spanning(-3e-3, 3e-3, strips)
    gap = shape_of(name, grid.y)[None, :]
    status, q, approach, _ = solve(grid, gap, 300.0)
    assert status == CONVERGED
    assert_solved(grid, gap, [300.0], no_wear(1, strips), q, approach)


def test_that_the_ten_micrometre_bump_makes_two_patches():
    grid = Grid.spanning(-3e-3, 3e-3, 120)
    _, (q,), _, _ = solve(grid, shape_of("two patches", grid.y), 300.0)
    assert (q[:60] > 0.0).any()
    assert (q[60:] > 0.0).any()
    assert (q[56:64] == 0.0).all()


@settings(max_examples=60, deadline=None)
@given(
    st.integers(5, 90),
    st.floats(0.0, 20.0),
    st.floats(0.0, 3.0),
    st.floats(1.0, 2000.0),
    st.floats(0.0, 1e-10),
    st.integers(0, 10**6),
)
def test_that_random_rough_profiles_are_solved_to_the_equations(
    strips, roughness, curvature, load, compliance, seed
):
    grid = Grid.spanning(-3e-3, 3e-3, strips)
    random = np.random.default_rng(seed)
    gap = (curvature * grid.y**2 + roughness * 1e-6 * random.random(strips))[None, :]
    wear = SharedWear.of_one(compliance * random.random(strips))
    status, q, approach, _ = solve(grid, gap, load, wear)
    assert status in {CONVERGED, TOO_FINE}
    if status == CONVERGED:
        assert_solved(grid, gap, [load], wear, q, approach)


GROUPS = {
    "one cylinder, three rollers": [(0, 0), (0, 1), (0, 2)],
    "one cylinder, one roller": [(0, 0), (0, 0), (0, 0)],
    "one cylinder, two rollers": [(0, 0), (0, 1), (0, 0)],
    "two stations, two rollers": [(0, 0), (1, 1), (1, 0)],
}


@pytest.mark.parametrize("bodies", GROUPS.values(), ids=GROUPS)
def test_that_coupled_contacts_are_solved_to_the_equations(bodies):
    grid = Grid.spanning(-4e-3, 4e-3, 81)
    gaps = np.array([(grid.y - offset) ** 2 for offset in (-1e-3, 0.3e-3, 1e-3)])
    random = np.random.default_rng(3)
    wear = SharedWear(np.array(bodies), 2e-11 * random.random((3, 2, 81)))
    status, q, approach, iterations = solve(grid, gaps, [300.0, 250.0, 400.0], wear)
    assert status == CONVERGED
    assert iterations < 20
    assert_solved(grid, gaps, [300.0, 250.0, 400.0], wear, q, approach)


def test_that_fifty_contacts_on_one_body_are_solved_to_the_equations():
    grid = Grid.spanning(-4e-3, 4e-3, 81)
    random = np.random.default_rng(4)
    gaps = (grid.y - random.uniform(-1e-3, 1e-3, (50, 1))) ** 2
    wear = SharedWear(np.zeros((50, 2), dtype=np.int64), np.full((50, 2, 81), 1e-11))
    loads = random.uniform(200.0, 400.0, 50)
    status, q, approach, iterations = solve(grid, gaps, loads, wear)
    assert status == CONVERGED
    assert iterations < 20
    assert_solved(grid, gaps, loads, wear, q, approach)


def test_that_uncoupled_contacts_are_solved_as_if_alone():
    grid = Grid.spanning(-4e-3, 4e-3, 81)
    gaps = np.array([(grid.y - 1e-3) ** 2, 0.5 * grid.y**2])
    _, both, _, _ = solve(grid, gaps, [300.0, 200.0])
    for k, load in enumerate((300.0, 200.0)):
        _, alone, _, _ = solve(grid, gaps[k], load)
        np.testing.assert_allclose(both[k], alone[0], rtol=1e-9, atol=1e-6)


def test_that_a_start_nearby_ends_where_a_start_from_nothing_does():
    grid = Grid.spanning(-3e-3, 3e-3, 101)
    _, cold, _, _ = solve(grid, shape_of("flat", grid.y), 300.0)
    _, start, _, _ = solve(grid, shape_of("two patches", grid.y), 100.0)
    status, warm, _, _ = solve(grid, shape_of("flat", grid.y), 300.0, start=start)
    assert status == CONVERGED
    np.testing.assert_allclose(warm, cold, rtol=1e-9, atol=1e-6)


def test_that_a_mirrored_profile_gives_the_mirrored_load():
    grid = Grid.spanning(-3e-3, 3e-3, 100)
    gap = shape_of("step", grid.y)
    _, (q,), _, _ = solve(grid, gap, 300.0)
    _, (mirrored,), _, _ = solve(grid, gap[::-1].copy(), 300.0)
    np.testing.assert_allclose(mirrored[::-1], q, rtol=1e-10, atol=1e-6)


def test_that_the_load_converges_with_the_grid():
    exact, errors = None, []
    for strips in (1215, 405, 135, 45):
        grid = Grid.spanning(-2e-3, 2e-3, strips)
        _, (q,), _, _ = solve(grid, grid.y**2, 300.0)
        coarse = q.reshape(45, -1).mean(axis=1)
        if exact is None:
            exact = coarse
        else:
            errors.append(np.abs(coarse - exact).sum() / exact.sum())
    assert errors[0] < 0.6 * errors[1] < 0.36 * errors[2]


def test_that_strips_far_narrower_than_the_contact_are_refused():
    grid = Grid.spanning(-1e-5, 1e-5, 201)
    assert solve(grid, np.zeros(201), 300.0)[0] == TOO_FINE
