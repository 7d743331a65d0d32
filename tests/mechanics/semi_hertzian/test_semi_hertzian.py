"""Semi-Hertzian contact: limit of Hertz, published conditions, and difficult profiles."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.mechanics.slender.test_influence import direct
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.mechanics.semi_hertzian.penetration import (
    CONVERGED,
    NO_CONVERGENCE,
    NOT_FINITE,
    TOO_FINE,
    contact_levels,
    first_contacts,
)
from wearsim.mechanics.semi_hertzian.solver import (
    ANALYN,
    AYASSE_CHOLLET,
    KIK_PIOTROWSKI,
    local_hertz_table,
    patch_curvature,
    read_local_hertz,
    smoothed_curvature,
    solve_semi_hertzian,
)
from wearsim.mechanics.slender.influence import influence_table
from wearsim.types import Grid

MODULUS = 200e9 / (2.0 * (1.0 - 0.3**2))
CURVATURE = 90.0
VARIANTS = (KIK_PIOTROWSKI, AYASSE_CHOLLET, ANALYN)
LOCAL = (AYASSE_CHOLLET, ANALYN)


def solve(variant, grid, gap, load=300.0, compliance=None, curvature=CURVATURE):
    """Return status, approach, line load and half-length."""
    q, a = np.zeros(grid.strips), np.zeros(grid.strips)
    status, _, approach = solve_semi_hertzian(
        variant,
        np.ascontiguousarray(gap),
        np.zeros(grid.strips) if compliance is None else compliance,
        load,
        grid.spacing,
        MODULUS,
        curvature,
        influence_table(grid.strips),
        local_hertz_table(),
        q,
        a,
    )
    return status, approach, q, a


def solved(*arguments, **others):
    status, *found = solve(*arguments, **others)
    assert status == CONVERGED
    return found


def shape_of(name, y):
    """Return a gap profile by name [m]."""
    return {
        "fresh": y**2,
        "flat": np.maximum(0.0, y**2 - 1e-6),
        "plane": 0.0 * y + np.where(np.abs(y) > 2e-3, 1e-3, 0.0),
        "concave": np.where(np.abs(y) < 1.2e-3, -2.0 * y**2, y**2 - 3.0 * 1.44e-6),
        "two patches": y**2 + 10e-6 * np.exp(-((y / 0.4e-3) ** 2)),
        "skew": y**2 * (1.0 + y / 9e-3),
        "step": y**2 - 3e-6 * (np.abs(y - 0.5e-3) < 0.7e-3),
        "rough": y**2 + 0.5e-6 * np.sin(2 * np.pi * y / 0.1e-3 + 0.4),
    }[name]


NAMES = ["fresh", "flat", "plane", "concave", "two patches", "step", "rough"]


def patch_of_shape(ratio):
    """Return the curvature B [1/m] that makes b/a the given ratio, and its Hertzian patch."""
    low, high = -25.0, 12.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        patch = hertz(0.5 * CURVATURE, np.exp(middle), 300.0, MODULUS)
        low, high = (middle, high) if patch.b / patch.a > ratio else (low, middle)
    return np.exp(middle), patch


@pytest.mark.parametrize("ratio", [0.3, 0.9, 1.0, 1.1, 3.0, 11.3, 30.0])
@pytest.mark.parametrize("variant", LOCAL)
def test_local_methods_are_hertz_on_every_ellipse(variant, ratio):
    curvature, patch = patch_of_shape(ratio)
    grid = Grid.spanning(-1.3 * patch.b, 1.3 * patch.b, 80)
    approach, q, a = solved(variant, grid, curvature * grid.y**2)
    assert approach == pytest.approx(patch.approach, rel=4e-4)
    np.testing.assert_allclose(q, patch.line_load(grid.y), atol=3e-4 * q.max())
    inside = np.abs(grid.y) < 0.95 * patch.b
    np.testing.assert_allclose(a[inside], patch.half_length(grid.y)[inside], rtol=2e-3)


@pytest.mark.parametrize("variant", LOCAL)
def test_error_relative_to_hertz_decreases_with_strip_width(variant):
    curvature, patch = patch_of_shape(11.3)
    errors = []
    for strips in (20, 80, 320):
        grid = Grid.spanning(-1.3 * patch.b, 1.3 * patch.b, strips)
        _, q, _ = solved(variant, grid, curvature * grid.y**2)
        errors.append(np.abs(q - patch.line_load(grid.y)).sum() / q.sum())
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 2e-5


@settings(max_examples=50, deadline=None)
# next to the circle `hertz` itself has an error of up to 1e-6
@given(st.floats(-19.0, 9.0).filter(lambda value: abs(value) > 1e-9))
def test_table_interpolates_hertz(logarithm):
    ratio = np.exp(logarithm)
    patch = hertz(1.0, ratio, 1.0, 1.0)
    stiffness, length, part = read_local_hertz(local_hertz_table(), ratio)
    rise = ratio * patch.b**2
    assert stiffness == pytest.approx(0.5 * np.pi * patch.peak_pressure * patch.a / rise, rel=1e-8)
    assert length == pytest.approx(patch.a**2 / rise, rel=1e-8)
    assert part == pytest.approx(rise / patch.approach, rel=1e-8)


@pytest.mark.parametrize("name", ["fresh", "skew"])
def test_virtual_penetration_meets_its_published_conditions(name):
    grid = Grid.spanning(-3e-3, 3e-3, 121)
    gap = shape_of(name, grid.y)
    first = int(np.argmin(gap))
    approach, q, a = solved(KIK_PIOTROWSKI, grid, gap)
    delta = approach - gap.min()
    depth = np.maximum(0.55 * delta - (gap - gap.min()), 0.0)
    np.testing.assert_allclose(a, np.sqrt(2.0 * depth / CURVATURE), rtol=1e-9)
    np.testing.assert_allclose(q / q.max(), depth / depth.max(), atol=1e-12)
    displacement = sum(
        q[j] / (np.pi * MODULUS) * direct(np.log(a[j] / grid.spacing), 121)[abs(first - j)]
        for j in np.flatnonzero(q)
    )
    # on a skew profile the mean position around the lowest point is slightly different from it
    assert displacement == pytest.approx(delta, rel=1e-6 if name == "fresh" else 2e-3)


@pytest.mark.parametrize(
    ("ratio", "error"), [(0.3, 0.25), (1.0, 0.04), (3.0, 0.1), (11.3, 0.18), (30.0, 0.21)]
)
def test_error_of_virtual_penetration_is_the_published_one(ratio, error):
    curvature, patch = patch_of_shape(ratio)
    grid = Grid.spanning(-1.3 * patch.b, 1.3 * patch.b, 80)
    approach, q, _ = solved(KIK_PIOTROWSKI, grid, curvature * grid.y**2)
    missed = np.abs(q - patch.line_load(grid.y)).sum() / q.sum()
    assert missed < error
    assert approach == pytest.approx(patch.approach, rel=0.04)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("strips", [41, 120, 301])
def test_profiles_carry_their_load_on_the_strips_in_contact(variant, name, strips):
    grid = Grid.spanning(-3e-3, 3e-3, strips)
    gap = shape_of(name, grid.y)
    approach, q, a = solved(variant, grid, gap)
    assert q.sum() * grid.spacing == pytest.approx(300.0, rel=1e-12)
    assert (q >= 0.0).all()
    np.testing.assert_array_equal(a > 0.0, q > 0.0)
    assert (gap[q > 0.0] < approach).all()
    # the result does not depend on the zero of the gap
    moved, same, _ = solved(variant, grid, gap + 5e-6)
    assert moved - approach == pytest.approx(5e-6, rel=1e-6)
    np.testing.assert_allclose(same, q, atol=1e-7 * q.max())


random_profiles = st.tuples(
    st.integers(5, 90),
    st.floats(0.0, 20.0),
    st.floats(0.01, 3.0),
    st.floats(1.0, 2000.0),
    st.integers(0, 10**6),
)


def random_profile(strips, roughness, curvature, seed):
    grid = Grid.spanning(-3e-3, 3e-3, strips)
    random = np.random.default_rng(seed)
    return grid, curvature * grid.y**2 + roughness * 1e-6 * random.random(strips)


@pytest.mark.parametrize("variant", VARIANTS)
@settings(max_examples=40, deadline=None)
@given(random_profiles)
def test_mirrored_profile_has_the_mirrored_contact(variant, drawn):
    strips, roughness, curvature, load, seed = drawn
    grid, gap = random_profile(strips, roughness, curvature, seed)
    status, approach, q, a = solve(variant, grid, gap, load)
    assert status in {CONVERGED, TOO_FINE}
    if status == CONVERGED:
        other, mirrored, length = solved(variant, grid, gap[::-1], load)
        assert other == pytest.approx(approach, rel=1e-10, abs=0.0)
        np.testing.assert_allclose(mirrored[::-1], q, atol=1e-9 * q.max())
        np.testing.assert_allclose(length[::-1], a, atol=1e-7 * a.max())
        assert q.sum() * grid.spacing == pytest.approx(load, rel=1e-12)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("name", ["fresh", "flat", "concave", "two patches"])
@pytest.mark.parametrize("compliance", [1e-12, 1e-11, 1e-10])
def test_wear_compliance_is_the_contact_in_the_worn_gap(variant, name, compliance):
    grid = Grid.spanning(-4e-3, 4e-3, 80)
    gap = shape_of(name, grid.y)
    softening = compliance * (1.0 + 0.3 * grid.y / grid.y[-1])
    approach, q, a = solved(variant, grid, gap, compliance=softening)
    again, same, length = solved(variant, grid, gap + softening * q)
    np.testing.assert_allclose(same, q, atol=1e-8 * q.max())
    np.testing.assert_allclose(length, a, atol=1e-6 * a.max())
    assert again == pytest.approx(approach, rel=1e-9, abs=0.0)
    assert q.sum() * grid.spacing == pytest.approx(300.0, rel=1e-12)
    hard = solved(variant, grid, gap)[1]
    assert q.max() < hard.max()


@pytest.mark.parametrize("variant", LOCAL)
def test_distant_patches_share_the_load_at_a_common_approach(variant):
    sharp, blunt, behind = 4.0, 2.0, 1.5e-6
    grid = Grid.spanning(-8e-3, 8e-3, 800)
    gap = np.minimum(sharp * (grid.y + 4e-3) ** 2, behind + blunt * (grid.y - 4e-3) ** 2)
    approach, q, _ = solved(variant, grid, gap, load=500.0)
    expected = np.zeros_like(q)
    for curvature, centre, delta in ((sharp, -4e-3, approach), (blunt, 4e-3, approach - behind)):
        unit = hertz(0.5 * CURVATURE, curvature, 1.0, MODULUS)
        patch = hertz(0.5 * CURVATURE, curvature, (delta / unit.approach) ** 1.5, MODULUS)
        expected += patch.line_load(grid.y - centre)
    np.testing.assert_allclose(q, expected, atol=2e-3 * q.max())


@pytest.mark.parametrize("variant", VARIANTS)
def test_patches_merge_continuously(variant):
    grid = Grid.spanning(-3e-3, 3e-3, 240)
    ridges = np.linspace(12e-6, 0.0, 601)
    lean = np.where(grid.y > 0.0, 0.3e-6, 0.0) * np.minimum(np.abs(grid.y) / 0.5e-3, 1.0)
    loads = [
        solved(variant, grid, grid.y**2 + lean + h * np.exp(-((grid.y / 0.4e-3) ** 2)))[1]
        for h in ridges
    ]
    moved = np.abs(np.diff(loads, axis=0)).sum(axis=1) / np.sum(loads[0])
    # from two patches to one, a change of the ridge by 20 nm moves a few thousandths of the load
    assert (loads[0][118:122] == 0.0).all()
    assert (loads[-1][118:122] > 0.0).all()
    assert moved.max() < 0.02


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("name", ["flat", "concave", "two patches"])
def test_load_converges_with_the_grid(variant, name):
    exact, errors = None, []
    for strips in (1215, 405, 135, 45):
        grid = Grid.spanning(-3e-3, 3e-3, strips)
        _, q, _ = solved(variant, grid, shape_of(name, grid.y))
        coarse = q.reshape(45, -1).mean(axis=1)
        if exact is None:
            exact = coarse
        else:
            errors.append(np.abs(coarse - exact).sum() / exact.sum())
    assert errors[0] < 0.02
    assert errors[0] < errors[1] < errors[2]


def test_smoothed_curvature_of_a_parabola_is_exact():
    grid = Grid.spanning(-3e-3, 3e-3, 101)
    gap = 1.3 * (grid.y - 0.2e-3) ** 2 + 1e-6
    depth = np.maximum(2e-6 - (gap - gap.min()), 0.0)
    found = np.empty(101)
    smoothed_curvature(gap, depth, 3e-6, grid.spacing, found)
    np.testing.assert_allclose(found[depth > 0.0], 1.3, rtol=1e-9)


@pytest.mark.parametrize("name", ["plane", "concave", "rough", "step"])
def test_smoothed_curvature_is_within_its_bounds(name):
    grid = Grid.spanning(-3e-3, 3e-3, 241)
    gap = shape_of(name, grid.y)
    depth = np.maximum(2e-6 - (gap - gap.min()), 0.0)
    found = np.empty(241)
    smoothed_curvature(gap, depth, 3e-6, grid.spacing, found)
    half_width, typical = patch_curvature(depth, grid.spacing)
    assert typical == pytest.approx(depth.max() / half_width**2)
    assert (found >= 0.125 * typical).all()
    assert (found <= 100.0 * typical).all()
    if name in {"plane", "concave"}:
        assert found[120] == 0.125 * typical


def test_smoothed_curvature_is_independent_of_the_strip_count():
    found = []
    for strips in (101, 303, 909):
        grid = Grid.spanning(-3e-3, 3e-3, strips)
        gap = shape_of("flat", grid.y)
        curvature = np.empty(strips)
        smoothed_curvature(gap, np.maximum(2e-6 - gap, 0.0), 3e-6, grid.spacing, curvature)
        found.append(curvature[strips // 6 :: strips // 101][: 101 * 2 // 3])
    centre = slice(10, 55)
    coarse, fine = (np.abs(one[centre] / found[2][centre] - 1.0).max() for one in found[:2])
    assert fine < 0.03
    assert fine < coarse < 0.1


def test_minima_are_found_at_their_middles():
    gap = np.array([0.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.5, 2.0, 3.0, 3.0, 2.0, 2.5, 1.0])
    places = np.empty((13, 2), dtype=np.int64)
    count = first_contacts(gap, places)
    assert places[:count].tolist() == [[0, 0], [4, 5], [10, 10], [12, 12]]


def test_ridge_limits_the_level_from_a_lower_patch():
    gap = np.array([3.0, 1.0, 0.0, 1.0, 2.0, 1.0, 0.8, 1.0, 3.0])
    places = np.empty((9, 2), dtype=np.int64)
    level, slope = np.empty(9), np.empty(9)
    reach = np.full(9, 0.5)

    def levels(rigid):
        count = first_contacts(gap, places)
        contact_levels(gap, places, count, reach, True, rigid, level, slope)
        return level[2], level[6]

    # separate patches have half of their overlap; the second level is then limited by the ridge
    assert levels(1.8) == pytest.approx((0.9, 1.3))
    assert levels(3.0) == pytest.approx((1.5, 1.9))
    assert levels(3.6) == pytest.approx((1.8, 2.0))
    assert levels(4.4) == pytest.approx((2.2, 2.2))


@pytest.mark.parametrize("variant", VARIANTS)
def test_unsolvable_contacts_have_a_status(variant):
    grid = Grid.spanning(-3e-3, 3e-3, 41)
    broken = grid.y**2
    broken[7] = np.nan
    assert solve(variant, grid, broken)[0] == NOT_FINITE
    assert solve(variant, grid, grid.y**2, load=0.0)[0] == NOT_FINITE
    endless = np.full(41, 1e305)  # wear beyond all numbers
    with np.errstate(over="ignore"):
        assert solve(variant, grid, grid.y**2, compliance=endless)[0] == NOT_FINITE
    narrow = Grid.spanning(-1e-5, 1e-5, 201)
    assert solve(variant, narrow, np.zeros(201))[0] == TOO_FINE


def test_irregular_wear_compliance_never_converges_wrongly():
    random = np.random.default_rng(5)
    outcomes = set()
    for _ in range(20):
        grid = Grid.spanning(-3e-3, 3e-3, 81)
        compliance = 1e-9 * random.random(81)
        gap = grid.y**2 + 5e-6 * random.random(81)
        status, _, q, _ = solve(AYASSE_CHOLLET, grid, gap, compliance=compliance)
        outcomes.add(status)
        if status == CONVERGED:
            same = solved(AYASSE_CHOLLET, grid, gap + compliance * q)[1]
            np.testing.assert_allclose(same, q, atol=1e-6 * q.max())
    assert outcomes <= {CONVERGED, NO_CONVERGENCE}
    assert CONVERGED in outcomes
