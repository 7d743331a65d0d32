"""Slender contact: equations, limits and difficult cases."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.special import ellipk

from tests.mechanics.slender.test_influence import direct
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.mechanics.slender.half_length import HIGHEST_FACTOR, LOWEST_FACTOR, SWEEPS
from wearsim.mechanics.slender.influence import (
    curvature_table,
    influence_table,
    middle_curvature,
    no_table,
)
from wearsim.mechanics.slender.newton import CONVERGED, TOO_FINE, solve_slender
from wearsim.plugins import SharedWear
from wearsim.types import Grid

MODULUS = 200e9 / (2.0 * (1.0 - 0.3**2))
CURVATURE = 90.0
PATCH = hertz(45.0, 1.0, 300.0, MODULUS)
BY_LOAD = 4.0 / (np.pi * MODULUS * CURVATURE)  # a^2/q of a strip without interaction
# difference of two converged solutions over the greatest line load: convergence is quadratic
# for local half-lengths, and linear with a small factor for coupled ones
RESIDUAL_LOAD = {"local": 2e-8, "coupled": 2e-8}


def solve(grid, gaps, loads, wear=None, start=None, lengths="coupled", found=None):
    """Solve one or several contacts; return status, line loads, approaches and iterations."""
    gaps = np.atleast_2d(gaps)
    count, n = gaps.shape
    wear = no_wear(count, n) if wear is None else wear
    line_load = np.zeros((count, n)) if start is None else start.copy()
    approach = np.zeros(count)
    half_length = np.zeros((count, n)) if found is None else found
    ((_, own, members, shared),) = wear.groups
    status, iterations = np.zeros((2, 1), np.int64)
    solve_slender(
        np.ascontiguousarray(gaps)[None],
        own,
        *((members, shared) if shared.any() else (None, None)),
        np.atleast_2d(np.asarray(loads, dtype=float)),
        np.full((1, count), CURVATURE),
        grid.spacing,
        MODULUS,
        influence_table(n),
        (curvature_table if lengths == "coupled" else no_table)(n),
        1e-8,
        line_load[None],
        approach[None],
        half_length[None],
        np.zeros((1, count, n)),
        status,
        iterations,
    )
    return status[0], line_load, approach, iterations[0]


def no_wear(count, n):
    """Return zero wear."""
    return SharedWear(np.zeros((count, 2), dtype=np.int64), np.zeros((count, 2, n)))


def wear_of_one(compliance):
    """Return the wear compliance of a single contact, given per strip, shape (strips,)."""
    both = np.stack([compliance, np.zeros_like(compliance)])
    return SharedWear(np.zeros((1, 2), dtype=np.int64), both[None])


def factors(line_load, spacing):
    """Return s of the loaded strips of one contact by two sweeps without a table."""
    place = np.flatnonzero(line_load)
    distance = place[:, None] - place

    def edge_curvature(t):
        short = 1.0 / (1.0 + t * t)  # the parameter m = k^2, whose complement is k'^2
        return 4.0 / np.pi * t * np.sqrt(short) * ellipk(short)

    s = np.ones(len(place))
    for _ in range(SWEEPS):
        a = np.sqrt(s * BY_LOAD * line_load[place]) / spacing
        curvature = edge_curvature((distance + 0.5) / a) - edge_curvature((distance - 0.5) / a)
        s = np.clip(s * (0.25 * curvature / s).sum(axis=1), LOWEST_FACTOR, HIGHEST_FACTOR)
    return s


def surface(grid, gaps, line_load, wear, lengths):
    """Return the sum of gap, wear and displacement, computed without a table."""
    count, n = gaps.shape
    total = gaps + wear.opening(line_load)
    for k in range(count):
        loaded = np.flatnonzero(line_load[k])
        s = factors(line_load[k], grid.spacing) if lengths == "coupled" else np.ones(len(loaded))
        a = np.sqrt(s * BY_LOAD * line_load[k, loaded])
        shapes = direct(np.log(a / grid.spacing), n)
        for j, shape in zip(loaded, shapes, strict=True):
            total[k] += line_load[k, j] / (np.pi * MODULUS) * shape[np.abs(np.arange(n) - j)]
    return total


def assert_solved(grid, gaps, loads, wear, line_load, approach, lengths="coupled"):
    """Check that a solution satisfies the equations of contact."""
    total = surface(grid, gaps, line_load, wear, lengths)
    scale = np.ptp(approach[:, None] - gaps) + np.abs(approach).max()
    scale += wear.opening(line_load).max()
    assert (line_load >= 0.0).all()
    np.testing.assert_allclose(line_load.sum(axis=1) * grid.spacing, loads, rtol=1e-10)
    for k in range(len(gaps)):
        inside = line_load[k] > 0.0
        # line loads converge relative to the greatest one, by their predicted change
        np.testing.assert_allclose(total[k][inside], approach[k], rtol=0.0, atol=2e-7 * scale)
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


# relative errors of p0, approach and line load (L1) of the unworn rig
ERRORS = {"local": (7e-3, 2e-3, 2.5e-3), "coupled": (2e-4, 1e-4, 6e-4)}


@pytest.mark.parametrize("lengths", ERRORS)
def test_unworn_rig_is_hertz(lengths):
    grid = Grid.spanning(-1.85e-3, 1.85e-3, 121)
    half_length = np.empty((1, 121))
    status, (q,), (approach,), _ = solve(grid, grid.y**2, 300.0, lengths=lengths, found=half_length)
    pressure, by_approach, by_load = ERRORS[lengths]
    assert status == CONVERGED
    (a,), inside = half_length, q > 0.0
    assert a.max() == pytest.approx(PATCH.a, rel=pressure)
    peak = 2.0 * (q[inside] / (np.pi * a[inside])).max()
    assert peak == pytest.approx(PATCH.peak_pressure, rel=pressure)
    assert approach == pytest.approx(PATCH.approach, rel=by_approach)
    exact = PATCH.line_load(grid.y)
    assert np.abs(q - exact).sum() / exact.sum() < by_load
    assert q.sum() * grid.spacing == pytest.approx(300.0, rel=1e-12)


def test_half_lengths_satisfy_their_definition():
    grid = Grid.spanning(-3e-3, 3e-3, 120)
    for name in ("fresh", "two patches", "edge"):
        half_length = np.empty((1, 120))
        _, (q,), _, _ = solve(grid, shape_of(name, grid.y), 300.0, found=half_length)
        inside = q > 0.0
        expected = np.sqrt(factors(q, grid.spacing) * BY_LOAD * q[inside])
        np.testing.assert_allclose(half_length[0, inside], expected, rtol=2e-7)
        assert (half_length[0, ~inside] == 0.0).all()


@pytest.mark.parametrize("name", ["fresh", "flat", "two patches", "step", "edge", "rough"])
@pytest.mark.parametrize(
    ("strips", "lengths"),
    [(41, "coupled"), (120, "coupled"), (120, "local"), (401, "coupled")],
)
def test_profiles_satisfy_the_equations(name, strips, lengths):
    grid = Grid.spanning(-3e-3, 3e-3, strips)
    gap = shape_of(name, grid.y)[None, :]
    status, q, approach, _ = solve(grid, gap, 300.0, lengths=lengths)
    assert status == CONVERGED
    assert_solved(grid, gap, [300.0], no_wear(1, strips), q, approach, lengths)


def test_newtons_method_takes_few_iterations():
    grid = Grid.spanning(-3e-3, 3e-3, 41)
    wave, taken = np.cos(2000.0 * grid.y), []
    for name, lengths in (("flat", "coupled"), ("two patches", "coupled"), ("step", "local")):
        gap, q = shape_of(name, grid.y), None
        # from no start, a near and a far one
        for depth, load in ((0.0, 300.0), (2e-8, 303.0), (2e-6, 330.0)):
            found = solve(grid, gap + depth * wave, load, start=q, lengths=lengths)
            status, q, _, iterations = found
            assert status == CONVERGED
            taken.append(iterations)
    gaps = np.array([(grid.y - offset) ** 2 for offset in (-0.5e-3, 0.2e-3, 0.5e-3)])
    random = np.random.default_rng(3)
    for bodies in GROUPS.values():
        wear, q = SharedWear(np.array(bodies), 2e-11 * random.random((3, 2, 41))), None
        for part in (1.0, 1.02):
            status, q, _, iterations = solve(grid, part * gaps, [300.0, 250.0, 400.0], wear, q)
            assert status == CONVERGED
            taken.append(iterations)
    assert sum(taken) <= 66


def test_ten_micrometre_bump_has_two_patches():
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
def test_random_rough_profiles_satisfy_the_equations(
    strips, roughness, curvature, load, compliance, seed
):
    grid = Grid.spanning(-3e-3, 3e-3, strips)
    random = np.random.default_rng(seed)
    gap = (curvature * grid.y**2 + roughness * 1e-6 * random.random(strips))[None, :]
    wear = wear_of_one(compliance * random.random(strips))
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
def test_coupled_contacts_satisfy_the_equations(bodies):
    grid = Grid.spanning(-4e-3, 4e-3, 81)
    gaps = np.array([(grid.y - offset) ** 2 for offset in (-1e-3, 0.3e-3, 1e-3)])
    random = np.random.default_rng(3)
    wear = SharedWear(np.array(bodies), 2e-11 * random.random((3, 2, 81)))
    status, q, approach, iterations = solve(grid, gaps, [300.0, 250.0, 400.0], wear)
    assert status == CONVERGED
    assert iterations < 20
    assert_solved(grid, gaps, [300.0, 250.0, 400.0], wear, q, approach)


@pytest.mark.parametrize(("stations", "rollers"), [(4, 2), (2, 4)])
def test_stations_and_rollers_that_all_wear_satisfy_the_equations(stations, rollers):
    grid = Grid.spanning(-5e-3, 5e-3, 61)
    random = np.random.default_rng(5)
    count = stations * rollers
    gaps = (grid.y - random.uniform(-1e-3, 1e-3, (count, 1))) ** 2
    bodies = np.stack(np.divmod(np.arange(count), rollers), axis=1)
    wear = SharedWear(bodies, 2e-11 * random.random((count, 2, 61)))
    loads = random.uniform(200.0, 400.0, count)
    status, q, approach, iterations = solve(grid, gaps, loads, wear)
    assert status == CONVERGED
    assert iterations < 20
    assert_solved(grid, gaps, loads, wear, q, approach)


def test_fifty_contacts_on_one_body_satisfy_the_equations():
    grid = Grid.spanning(-4e-3, 4e-3, 81)
    random = np.random.default_rng(4)
    gaps = (grid.y - random.uniform(-1e-3, 1e-3, (50, 1))) ** 2
    wear = SharedWear(np.zeros((50, 2), dtype=np.int64), np.full((50, 2, 81), 1e-11))
    loads = random.uniform(200.0, 400.0, 50)
    status, q, approach, iterations = solve(grid, gaps, loads, wear)
    assert status == CONVERGED
    assert iterations < 20
    assert_solved(grid, gaps, loads, wear, q, approach)


def test_uncoupled_contacts_equal_separate_solutions():
    grid = Grid.spanning(-4e-3, 4e-3, 81)
    gaps = np.array([(grid.y - 1e-3) ** 2, 0.5 * grid.y**2])
    _, both, _, _ = solve(grid, gaps, [300.0, 200.0])
    for k, load in enumerate((300.0, 200.0)):
        _, separate, _, _ = solve(grid, gaps[k], load)
        np.testing.assert_allclose(
            both[k], separate[0], atol=RESIDUAL_LOAD["coupled"] * separate.max()
        )


@pytest.mark.parametrize("lengths", RESIDUAL_LOAD)
def test_warm_start_converges_to_the_cold_solution(lengths):
    grid = Grid.spanning(-3e-3, 3e-3, 101)
    flat, two = shape_of("flat", grid.y), shape_of("two patches", grid.y)
    _, cold, _, _ = solve(grid, flat, 300.0, lengths=lengths)
    _, start, _, _ = solve(grid, two, 100.0, lengths=lengths)
    status, warm, _, _ = solve(grid, flat, 300.0, start=start, lengths=lengths)
    assert status == CONVERGED
    np.testing.assert_allclose(warm, cold, rtol=1e-9, atol=RESIDUAL_LOAD[lengths] * cold.max())


RIDGES = {
    "smooth": lambda y: np.exp(-((y / 0.4e-3) ** 2)),
    "off-centre": lambda y: np.exp(-(((y - 0.3e-3) / 0.2e-3) ** 2)),
    "plateau": lambda y: (np.abs(y - 0.1e-3) < 0.35e-3) * 1.0,
}


@pytest.mark.parametrize("compliance", [0.0, 1e-11, 1e-10])
@pytest.mark.parametrize("ridge", RIDGES)
def test_splitting_patch_is_equal_from_warm_and_cold_starts(ridge, compliance):
    grid = Grid.spanning(-3e-3, 3e-3, 81)
    wear = wear_of_one(np.full(81, compliance))
    start, patches = None, []
    for depth in (0.0, 1.0, 3.0, 8.0, 12.0, 5.0, 1.5, 0.0):
        gap = (grid.y**2 + depth * 1e-6 * RIDGES[ridge](grid.y))[None, :]
        status, q, approach, iterations = solve(grid, gap, 300.0, wear, start)
        assert status == CONVERGED
        assert iterations <= 12
        assert_solved(grid, gap, [300.0], wear, q, approach)
        _, cold, _, _ = solve(grid, gap, 300.0, wear)
        np.testing.assert_allclose(q, cold, atol=RESIDUAL_LOAD["coupled"] * cold.max())
        start = q
        patches.append(int((np.diff((q[0] > 0.0) * 1, prepend=0) == 1).sum()))
    assert patches[0] == patches[-1] == 1
    # fast wear removes a ridge within the step, and the contact remains one patch
    assert max(patches) > 1 or compliance == 1e-10


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_patch_far_from_the_start_is_found(side):
    grid = Grid.spanning(-3e-3, 3e-3, 160)
    y = side * grid.y
    gap = np.minimum((y + 1.5e-3) ** 2, 0.2e-6 + (y - 1.5e-3) ** 2)
    _, cold, (approach,), _ = solve(grid, gap, 300.0)
    start = np.where(y < 0.0, cold, 0.0)
    assert cold[0, y > 0.0].any()
    status, warm, (again,), _ = solve(grid, gap, 300.0, start=start)
    assert status == CONVERGED
    assert again == pytest.approx(approach, rel=1e-8)
    np.testing.assert_allclose(warm, cold, rtol=0.0, atol=RESIDUAL_LOAD["coupled"] * cold.max())


def test_mirrored_profile_has_the_mirrored_load():
    grid = Grid.spanning(-3e-3, 3e-3, 100)
    gap = shape_of("step", grid.y)
    _, (q,), _, _ = solve(grid, gap, 300.0)
    _, (mirrored,), _, _ = solve(grid, gap[::-1].copy(), 300.0)
    np.testing.assert_allclose(mirrored[::-1], q, rtol=1e-10, atol=1e-12 * q.max())


@pytest.mark.parametrize("ratio", [0.2, 1.0, 8.0])
def test_strips_of_an_ellipse_have_the_curvature_of_the_bodies(ratio):
    patch = hertz(45.0, 45.0 * ratio, 300.0, MODULUS)
    edges = np.linspace(-patch.b, patch.b, 402)
    spacing, middles = edges[1] - edges[0], 0.5 * (edges[1:] + edges[:-1])
    q, a = patch.line_load(middles), patch.half_length(middles)
    t = (middles[:, None, None] - middles[:, None] + np.array([0.5, -0.5]) * spacing) / a[:, None]
    edge_curvature = np.sign(t) * middle_curvature(np.abs(t).ravel())[0].reshape(t.shape)
    curvature = ((edge_curvature[..., 0] - edge_curvature[..., 1]) * q / a**2).sum(axis=1) / (
        np.pi * MODULUS
    )
    inner = np.abs(middles) < 0.9 * patch.b
    np.testing.assert_allclose(curvature[inner], CURVATURE, rtol=2e-3)


def test_load_converges_with_the_grid():
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


def test_useless_start_is_replaced_by_none():
    grid = Grid.spanning(-2.7e-4, 2.7e-4, 41)
    start, gap = np.zeros((1, 41)), 500.0 * grid.y**2
    start[0, 20] = 300.0 / grid.spacing  # too long for a strip
    status, warm, _, _ = solve(grid, gap, 300.0, start=start, lengths="local")
    assert status == CONVERGED
    _, cold, _, _ = solve(grid, gap, 300.0, lengths="local")
    np.testing.assert_allclose(warm, cold, atol=RESIDUAL_LOAD["local"] * cold.max())


def test_too_narrow_strips_are_refused():
    grid = Grid.spanning(-1e-5, 1e-5, 201)
    assert solve(grid, np.zeros(201), 300.0)[0] == TOO_FINE
