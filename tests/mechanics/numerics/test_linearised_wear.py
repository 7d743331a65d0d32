"""Linearisation of wear in the line load, and its comparison with the wear of a solution."""

import numpy as np
import pytest

from wearsim.mechanics.numerics.linearised_wear import (
    FOUNDATION,
    LEAST,
    LEAST_EXPONENT,
    MIN_LOG_CHANGE,
    carried_errors,
    difference_sizes,
    linearised_wear,
    wear_of_bodies,
)

ROWS, ONE = np.array([[0, 1]]), np.ones(1, np.bool_)
LOAD = np.array([[0.0, 2.0, 0.0, 0.0, 4.0, 0.0]])
WEAR = np.array([[[0.0, 4.0, 0.0, 0.0, 20.0, 0.0]], np.zeros((1, 6))])


def compared(load, old_load, wear, old_wear, exponents, greatest=1.0):
    """Exponents and sizes of one contact whose second body does not wear."""
    both = np.stack([wear, np.zeros_like(wear)]), np.stack([old_wear, np.zeros_like(wear)])
    compliance, worn = np.empty((1, 1, 2, load.shape[1])), np.empty((2, 1, load.shape[1]))
    rows, base, opened = np.array([[0, 1]]), np.zeros_like(worn), np.empty_like(load)
    slopes = np.ones_like(load)
    constant = np.empty_like(both[0])
    arguments = exponents, slopes, rows, load, ONE, compliance, opened, constant
    linearised_wear(old_load, both[1], *arguments)
    arguments = load, old_load, *both, compliance, constant, rows, base, greatest, slopes
    sizes = wear_of_bodies(*arguments, ONE, exponents, worn, np.empty_like(load))
    assert (worn[0] == wear).all()
    return exponents[0], sizes[:, 0]


def test_ratio_is_extended_to_strips_without_load():
    compliance = np.empty((1, 1, 2, 6))
    opened = np.empty_like(LOAD)
    ones = np.ones((1, 6))
    constant = np.empty_like(WEAR)
    linearised_wear(LOAD, WEAR, ones, ones, ROWS, 7.0 * LOAD, ONE, compliance, opened, constant)
    assert (opened == 7.0 * LOAD).all()
    assert compliance[0, 0, 0] == pytest.approx([2.0, 2.0, 3.0, 4.0, 5.0, 5.0])
    assert not compliance[0, 0, 1].any()
    assert not constant.any()


def test_contact_without_load_has_no_compliance():
    compliance = np.empty((2, 1, 2, 3))
    none = np.zeros((2, 3))
    ones = np.ones((2, 3))
    wear = np.zeros((2, 2, 3))
    linearised_wear(
        none, wear, ones, ones, ROWS, none, np.ones(2, np.bool_), compliance, none, wear.copy()
    )
    assert not compliance.any()


def test_linearisation_has_value_and_slope_of_a_power_law():
    load, exponent = np.array([[1.0, 2.0, 3.0]]), 0.7
    wear = np.stack([load**exponent, 2.0 * load**exponent])
    compliance = np.empty((1, 1, 2, 3))
    opened, gap = np.empty_like(load), np.array([[5.0, 4.0, 6.0]])
    exponents, slopes = np.full((1, 3), exponent), np.ones((1, 3))
    constant = np.empty_like(wear)
    linearised_wear(load, wear, exponents, slopes, ROWS, gap, ONE, compliance, opened, constant)
    slope = compliance[0, 0]
    assert constant[:, 0] + slope * load == pytest.approx(wear[:, 0])
    assert opened == pytest.approx(gap + constant.sum(axis=0))
    assert slope[0] == pytest.approx(exponent * load[0] ** (exponent - 1.0))


def test_exponent_of_a_power_law_is_estimated():
    load, new = np.array([[1.0, 2.0, 3.0, 0.0]]), np.array([[1.5, 1.0, 3.0, 0.0]])
    exponents, _ = compared(new, load, new**0.7, load**0.7, np.full((1, 4), 0.9))
    # no estimate in a strip of constant load, nor in one without load
    assert exponents == pytest.approx([0.7, 0.7, 0.9, 0.9])


def test_exponents_are_limited_to_their_bounds():
    load, new = np.array([[1.0, 1.0]]), np.array([[2.0, 2.0]])
    exponents, _ = compared(new, load, new ** np.array([[3.0, 0.1]]), load, np.ones((1, 2)))
    assert exponents.tolist() == [1.0, 0.4]


def test_linear_wear_leaves_no_difference():
    load, new = np.array([[1.0, 2.0]]), np.array([[1.5, 1.0]])
    _, sizes = compared(new, load, 2.0 * new, 2.0 * load, np.ones((1, 2)))
    assert sizes.tolist() == [0.0, 3.0, 3.0]


def test_contacts_on_one_body_add_their_wear():
    loads, rows = np.array([[1.0], [2.0]]), np.array([[0, 1], [0, 2]])
    wear = np.array([[[1.0], [2.0]], [[10.0], [20.0]]])
    compliance, worn = np.empty((1, 2, 2, 1)), np.empty((3, 1, 1))
    constant = np.empty_like(wear)
    linearised_wear(
        *(loads, wear, np.full((2, 1), 0.5), np.ones((2, 1)), rows, loads, ONE, compliance),
        opened := np.empty((2, 1)),
        constant,
    )
    # both contacts wear the first body
    assert opened.ravel().tolist() == [1.0 + 0.5 * (3.0 + 10.0), 2.0 + 0.5 * (3.0 + 20.0)]
    base = np.full((3, 1, 1), 100.0)
    sizes = wear_of_bodies(
        *(loads, loads, wear, wear, compliance, constant, rows, base, 1.0, np.ones((2, 1))),
        *(np.ones(1, np.bool_), np.ones((2, 1)), worn, np.empty((2, 1))),
    )
    assert worn.ravel().tolist() == [3.0, 10.0, 20.0]
    assert sizes[:, 0].tolist() == [0.0, 23.0, 223.0]


def test_sizes_of_differences():
    depths = 1e-6 * np.array([[[4.0, 1.0, 3.0]], [[0.0, 1.0, 1.0]]])
    differences = 1e-6 * np.array([[[0.1, -9.0, -0.2]], [[5.0, 0.3, 0.0]]])
    weights = np.array([[1.0, 0.0], [2.0, 3.0]])
    sizes = difference_sizes(depths, differences, weights)[:, 0]
    norms = np.linalg.norm(differences), np.linalg.norm(depths)
    assert sizes == pytest.approx([0.3e-6, 1e-6 * (2.0 * -9.1 + 3.0 * 5.3), *norms])


@pytest.mark.parametrize("stiffness", [0.0, 4e6])
def test_wear_fills_the_errors_of_a_shape(stiffness):
    n, spacing = 8, 1e-4
    loads, depths = np.full((1, n), 2e5), np.zeros((2, 1, n))
    depths[0] = 1.0
    wear = np.stack([np.full((1, n), 3e-6), np.zeros((1, n))])
    before, added = np.zeros((2, 1, n)), np.zeros((2, 1, n))
    added[0, 0] = 1e-8 * (1.0 + (-1.0) ** np.arange(n))
    weights = np.array([[1.0, 0.0], [2.0, 5.0]])
    errors, sizes = carried_errors(
        before,
        added,
        loads,
        wear,
        np.ones((1, n)),
        np.array([2e-6]),
        np.full((1, n), -1.0),  # with the depth, a gap of zero
        depths,
        np.array([[0, 1]]),
        np.array([stiffness]),
        spacing,
        weights,
    )
    # strips as springs in series with the wear, and the spring of the load
    elastic, worn = 0.5 * 2e-6 / 2e5, 3e-6 / 2e5
    mean = 1e-8 * n / (n + stiffness / spacing * (elastic + worn))
    expected = added[0, 0] - worn / (elastic + worn) * (added[0, 0] - mean)
    np.testing.assert_allclose(errors[0, 0], expected, rtol=1e-12)
    assert not errors[1].any()
    greatest = max(np.abs(expected).max(), 0.15 * np.linalg.norm(expected) / np.sqrt(n))
    assert sizes[0, 0] == pytest.approx(greatest)
    assert sizes[1, 0] == pytest.approx(abs(2.0 * expected.sum()))
    assert sizes[2, 0] == pytest.approx(np.linalg.norm(expected) / np.sqrt(n))


def test_exponents_and_results_of_finished_realisations_are_kept():
    load, new = np.array([[1.0, 2.0], [1.0, 2.0]]), np.array([[1.5, 1.0], [1.5, 1.0]])
    wear, old = np.stack([new**0.7, 0.0 * new]), np.stack([load**0.7, 0.0 * load])
    exponents, worn, linear = np.full((2, 2), 0.9), np.full((2, 2, 2), 7.0), np.full((2, 2), 7.0)
    active, slopes = np.array([False, True]), np.ones((2, 2))
    compliance, opened, constant = (
        np.full((2, 1, 2, 2), 7.0),
        linear.copy(),
        np.full((2, 2, 2), 7.0),
    )
    linearised_wear(
        load, old, exponents, slopes, ROWS, np.zeros((2, 2)), active, compliance, opened, constant
    )
    assert (compliance[0] == 7.0).all()
    assert (opened[0] == 7.0).all()
    assert (constant[:, 0] == 7.0).all()
    assert opened[1] == pytest.approx(0.1 * load[1] ** 0.7)
    sizes = wear_of_bodies(
        *(new, load, wear, old, np.zeros((2, 1, 2, 2)), np.zeros((2, 2, 2)), ROWS),
        *(np.zeros((2, 2, 2)), 1.0, slopes, active, exponents, worn, linear),
    )
    assert exponents[0].tolist() == [0.9, 0.9]
    assert exponents[1] == pytest.approx([0.7, 0.7])
    assert (worn[:, 0] == 7.0).all()
    assert worn[0, 1] == pytest.approx(new[1] ** 0.7)
    assert linear.tolist() == [[7.0, 7.0], [0.0, 0.0]]
    assert sizes[:, 0].tolist() == [0.0, 0.0, np.inf]
    assert sizes[1:, 1] == pytest.approx([1.5**0.7] * 2)


TESTS, STRIPS = 2, 9
ROLLERS = np.array([[0, 1], [0, 2]])  # two rollers on one cylinder


def contacts():
    """Yield contact, its roller, test and number."""
    for c in range(len(ROLLERS)):
        for v in range(TESTS):
            yield c, v, c * TESTS + v


def random_loads(rng):
    """Return line loads of all contacts, some of them zero [N/m]."""
    loads = 1e5 * (0.5 + rng.random((len(ROLLERS) * TESTS, STRIPS)))
    return np.where(rng.random(loads.shape) < 0.7, loads, 0.0)


def test_linearised_wear_of_all_contacts_opens_the_gaps():
    rng = np.random.default_rng(1)
    loads, exponents = random_loads(rng), 0.4 + rng.random((4, STRIPS))
    loads[0, :2], loads[3, 0], loads[3, 1:] = [1e5, 0.0], 1e5, 0.0  # a load at the end
    slopes = np.where(rng.random((4, STRIPS)) < 0.7, 0.5 + rng.random((4, STRIPS)), np.inf)
    wear, gap = rng.random((2, 4, STRIPS)) * (loads > 0.0), rng.random((4, STRIPS))
    compliance, opened = np.full((TESTS, 2, 2, STRIPS), np.nan), np.full_like(gap, np.nan)
    constant, place = np.full_like(wear, np.nan), np.arange(STRIPS)
    active = np.ones(TESTS, np.bool_)
    linearised_wear(
        loads, wear, exponents, slopes, ROLLERS, gap, active, compliance, opened, constant
    )
    np.testing.assert_allclose(constant, (1.0 - exponents) * wear / slopes, rtol=1e-13)
    expected = gap.copy()
    for c, v, k in contacts():
        for other, _, m in (one for one in contacts() if one[1] == v):
            expected[k] += constant[0, m] + constant[1, m] * (other == c)
        for side in range(2):
            inside = loads[k] > 0.0
            ratio = np.interp(place, place[inside], wear[side, k, inside] / loads[k, inside])
            found = compliance[v, c, side]
            np.testing.assert_allclose(found, exponents[k] * ratio / slopes[k], rtol=1e-12)
    np.testing.assert_allclose(opened, expected, rtol=1e-13)


def test_wear_of_bodies_is_compared_with_the_linearised_one():
    rng = np.random.default_rng(2)
    loads, shape = random_loads(rng), (2, 4, STRIPS)
    old = np.where(rng.random(loads.shape) < 0.8, loads * (0.6 + rng.random(loads.shape)), 0.0)
    old[:, 3] = loads[:, 3] * np.exp(MIN_LOG_CHANGE * np.array([0.9, 1.1, -0.9, -1.1]))
    wear, old_wear = (1e-6 * rng.random(shape) * (one > 0.0) for one in (loads, old))
    slopes = 0.5 + rng.random(loads.shape)
    compliance = 1e-11 * rng.random((TESTS, 2, 2, STRIPS))
    constant, base = 1e-6 * rng.random(shape), 2e-6 * rng.random((3, TESTS, STRIPS))
    exponents = np.full(loads.shape, 0.9)
    worn, linear = np.empty(base.shape), np.empty(loads.shape)
    sizes = wear_of_bodies(
        *(loads, old, wear, old_wear, compliance, constant, ROLLERS, base, 1.2, slopes),
        *(np.ones(TESTS, np.bool_), exponents, worn, linear),
    )
    known, opening, part, scaled = (np.zeros(base.shape) for _ in range(4))
    for c, v, k in contacts():
        for side, b in enumerate(ROLLERS[c]):
            known[b, v] += wear[side, k]
            scaled[b, v] += wear[side, k] / slopes[k]
            part[b, v] += constant[side, k] + compliance[v, c, side] * loads[k]
    np.testing.assert_allclose(worn, known, rtol=1e-13)
    expected = np.zeros((3, TESTS))
    for c, v, k in contacts():
        pair = ROLLERS[c]
        opening = part[pair, v].sum(axis=0)
        np.testing.assert_allclose(linear[k], opening, rtol=1e-13)
        rest = np.abs(scaled[pair, v].sum(axis=0) - opening) * np.minimum(slopes[k], 1.0)
        total = known[pair, v].sum(axis=0)
        deepest = (base[pair, v].sum(axis=0) + total).max()
        expected[:, v] = np.maximum(expected[:, v], [rest.max(), total.max(), deepest])
        for i in range(STRIPS):
            exponent, both = 0.9, loads[k, i] > 0.0 and old[k, i] > 0.0
            rise = np.log(loads[k, i] / old[k, i]) if both else 0.0
            if abs(rise) > MIN_LOG_CHANGE:
                of_wear = np.log(wear[:, k, i].sum() / old_wear[:, k, i].sum())
                exponent = min(max(of_wear / rise, LEAST_EXPONENT), 1.2)
            assert exponents[k, i] == pytest.approx(exponent, rel=1e-9)
    np.testing.assert_allclose(sizes, expected, rtol=1e-12)
    none = wear_of_bodies(
        *(loads, old, 0.0 * wear, 0.0 * wear, 0.0 * compliance, 0.0 * constant, ROLLERS),
        *(0.0 * base, 1.2, slopes, np.ones(2, bool), exponents, worn, linear),
    )
    assert none.tolist() == [[0.0, 0.0], [0.0, 0.0], [np.inf, np.inf]]


@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_errors_of_bodies_with_several_contacts_are_filled_by_wear(size):
    rng, shape, spacing = np.random.default_rng(3), (3, TESTS, STRIPS), 1e-4
    loads, (errors, added) = size * random_loads(rng), 1e-8 * rng.standard_normal((2, *shape))
    loads[1, 2], loads[3, 2] = 0.0, 0.0
    wear, exponents = 2e-6 * rng.random((2, 4, STRIPS)), 0.5 + rng.random((4, STRIPS))
    approaches, gap = 4e-6 + 2e-6 * rng.random(4), 1e-6 * rng.random((4, STRIPS))
    depths, stiffness = 1e-6 * rng.random(shape), size * np.array([0.0, 4e6, 2e6, 0.0])
    weights = np.array([[1.0, 0.0, 0.0], [2e-4, 3e-4, 5e-4]])
    carried, sizes = carried_errors(
        *(errors, added, loads, wear, exponents, approaches, gap, depths, ROLLERS, stiffness),
        *(spacing, weights),
    )
    whole, soft, own = errors + added, np.zeros(shape), np.zeros((2, 4, STRIPS))
    for c, v, k in contacts():
        inside = loads[k] > 0.0
        own[:, k, inside] = (exponents[k] * wear[:, k])[:, inside] / loads[k, inside]
        for side, b in enumerate(ROLLERS[c]):
            soft[b, v] += own[side, k]
    expected = whole.copy()
    for c, v, k in contacts():
        pair = ROLLERS[c]
        least = (gap[k] + depths[pair, v].sum(axis=0)).min()
        elastic = FOUNDATION * (approaches[k] - least) / loads[k].max()
        spring = (loads[k] > 0.0) / (elastic + soft[pair, v].sum(axis=0))
        opened = whole[pair, v].sum(axis=0)
        level = spring @ opened / (spring.sum() + stiffness[k] / spacing)
        expected[pair, v] -= own[:, k] * spring * (opened - level)
    np.testing.assert_allclose(carried, expected, rtol=1e-10, atol=1e-22)
    assert np.abs(carried - whole).max() > 0.3 * np.abs(whole).max()
    of_depths = difference_sizes(depths, carried, weights)
    profile = of_depths[2] / of_depths[3]
    np.testing.assert_allclose(sizes[2], profile, rtol=1e-12)
    least = LEAST * profile * depths.max(axis=(0, 2))
    np.testing.assert_allclose(sizes[0], np.maximum(of_depths[0], least), rtol=1e-12)
    volume = np.einsum("b,bvi->v", weights[1], carried - errors)
    np.testing.assert_allclose(sizes[1], np.abs(volume), rtol=1e-9)
    fresh = carried_errors(
        *(errors, added, loads, wear, exponents, approaches, gap, 0.0 * depths, ROLLERS),
        *(stiffness, spacing, weights),
    )[1]
    assert not fresh[2].any()
