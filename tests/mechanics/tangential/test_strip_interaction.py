"""Interaction of strips, against the half-space and the exact linear theory."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from wearsim.mechanics.tangential.kalker_coefficients import creepage_coefficients, short_limit
from wearsim.mechanics.tangential.strip_interaction import (
    _add_group,
    coupling_length,
    effective_moduli,
    equivalent_ratio,
    induced_slip,
    strip_elasticity,
)

STEEL = strip_elasticity(110e9, 77e9)
POISSON = 0.3


def induced(force_x, force_y, spacing, length):
    out = np.zeros((2, len(force_x)))
    induced_slip(force_x, force_y, 0, len(force_x) - 1, spacing, length, STEEL, out[0], out[1])
    return out


def test_infinitely_wide_contact_has_the_moduli_of_the_material():
    assert effective_moduli(1e-6, STEEL) == pytest.approx((110e9, 77e9), rel=1e-4)
    assert effective_moduli(1e3, STEEL) == effective_moduli(50.0, STEEL)


@pytest.mark.parametrize("ratio", [3e-3, 0.1, 1.0, 19.9])
def test_moduli_of_an_ellipse_are_those_of_kalkers_coefficients(ratio):
    found = creepage_coefficients(ratio, 1.0 - 77.0 / 110.0)
    limits = short_limit(1e-9, 1.0 - 77.0 / 110.0)
    expected = 110e9 * found.c11 / limits[0], 77e9 * found.c22 / limits[1]
    assert effective_moduli(ratio, STEEL) == pytest.approx(expected, rel=3e-4)


@pytest.mark.parametrize("sign", [-1, 1])
def test_induced_slip_of_a_distant_strip_falls_with_the_square_of_the_distance(sign):
    # W is 1/|y| far from a strip, also in a contact that is thousands of times as wide as long
    forces = np.zeros((2, 2000))
    forces[:, 0] = 3.0, 5.0
    found = induced(*forces[:, ::sign].copy(), 0.5, 0.5)[:, ::sign]
    for distance in (4, 20, 100, 500, 1999):
        expected = -sign * POISSON / (np.pi * 77e9) * np.array([5.0, 3.0]) / (0.5 * distance**2)
        assert found[:, distance] == pytest.approx(expected, rel=0.1, abs=0.0)


def test_ellipse_is_its_own_equivalent_ellipse():
    n, a, b = 400, 1e-4, 1.3e-3
    y = (np.arange(n) - 0.5 * (n - 1)) * 2.0 * b / n
    half_length = a * np.sqrt(1.0 - (y / b) ** 2)
    assert equivalent_ratio(half_length, half_length, 2.0 * b / n) == pytest.approx(a / b, rel=1e-3)
    assert equivalent_ratio(half_length, np.zeros(n), 2.0 * b / n) == 1.0
    two = np.concatenate([half_length, np.zeros(50), half_length])
    assert equivalent_ratio(two, two, 2.0 * b / n) == pytest.approx(a / b, rel=1e-3)


@pytest.mark.parametrize(("adhering", "source", "target"), [(0.0, 0, 0), (1.0, -1, 1)])
def test_induced_slip_is_that_of_the_half_space(adhering, source, target):
    # forces 1 - (y/b)^2, spread along x elliptically, or as in adhesion: sqrt((1 - s)/(1 + s)),
    # and (1 + s) for the weight of slip in the force of a strip that adheres
    a, b, n = 1.0, 12.0, 480
    spacing = 2.0 * b / n
    y = (np.arange(n) - 0.5 * (n - 1)) * spacing
    forces = 1.0 - (y / b) ** 2

    def points(kind, count):
        angle = (np.arange(count) + 0.5) * np.pi / count
        weight = np.sin(angle) ** 2 if kind == 0 else 1.0 + kind * np.cos(angle)
        return np.cos(angle), weight / weight.sum()

    (to, gain), (origin, share) = points(target, 40), points(source, 41)
    apart_x, weight = to[:, None] - origin, gain[:, None] * share
    exact, at = [], [60, 120, 180]
    for i in at:
        apart_y = (y[i] - y)[:, None, None]
        strain = apart_y * (apart_y**2 - 2.0 * apart_x**2) / (apart_x**2 + apart_y**2) ** 2.5
        exact.append((strain * weight * forces[:, None, None]).sum() * spacing)
    exact = -POISSON / (np.pi * 77e9) * np.array(exact)
    found = induced(np.zeros(n), forces, spacing, coupling_length(a, adhering))
    np.testing.assert_allclose(found[0][at], exact, rtol=0.04)
    assert not found[1].any()


arrays = st.lists(st.floats(-1e5, 1e5), min_size=60, max_size=60).map(np.array)


@given(arrays, st.floats(0.05, 5.0))
def test_induced_slip_conserves_the_total_power(forces, length):
    force_x, force_y = np.ascontiguousarray(forces[::2]), np.ascontiguousarray(forces[1::2])
    found = induced(force_x, force_y, 1.0, length)
    passed = force_x * found[0] + force_y * found[1]
    assert abs(passed.sum()) <= 1e-12 * np.abs(passed).sum() + 1e-30
    turned = induced(force_x[::-1].copy(), force_y[::-1].copy(), 1.0, length)
    np.testing.assert_allclose(turned[:, ::-1], -found, rtol=1e-9, atol=1e-13 * np.abs(found).max())


def test_group_of_exponentials_is_a_sum_over_pairs():
    rng = np.random.default_rng(1)
    x, y = rng.standard_normal((2, 6))
    found = np.zeros((2, 6))
    _add_group(x, y, 1, 4, 0.3, 2.0, *found)
    decays = 0.3 ** (0.25 ** np.arange(4))
    weights = 2.0 / 16.0 ** np.arange(4)
    known = np.zeros((2, 6))
    for i in range(1, 5):
        for j in range(1, 5):
            total = weights @ decays ** abs(i - j)
            known[:, i] += np.sign(j - i) * total * np.array([y[j], x[j]])
    assert found == pytest.approx(known, rel=1e-12)
