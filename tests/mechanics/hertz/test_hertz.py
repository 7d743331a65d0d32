"""Hertz contact against closed forms, scipy's integrals and computed reference cases."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.special import ellipe, ellipkm1

from wearsim.mechanics.hertz.ellipse import (
    axis_ratio,
    elliptic_integrals,
    elliptic_integrals_of,
    given_ellipse,
    hertz,
)
from wearsim.mechanics.hertz.parabola_fit import (
    CONVERGED,
    LEAVES_STRIPS,
    NO_CURVATURE,
    TOO_FEW_STRIPS,
    fit_parabola,
    hertz_on_profile,
)

MODULUS = 200e9 / (2.0 * (1.0 - 0.3**2))


@pytest.mark.parametrize(
    ("radii", "two_a", "two_b", "peak", "approach"),
    [
        ((20e-3, 500e-3, 25e-3), 0.2726e-3, 3.0898e-3, 680.22e6, 3.2227e-6),
        ((40e-3, 1000e-3, 50e-3), 0.3435e-3, 3.8929e-3, 428.51e6, None),
    ],
)
def test_patch_of_the_rig_meets_the_hand_calculation(radii, two_a, two_b, peak, approach):
    roller, crown, cylinder = radii
    patch = hertz(0.5 / roller + 0.5 / cylinder, 0.5 / crown, 300.0, MODULUS)
    assert 2.0 * patch.a == pytest.approx(two_a, rel=2e-4)
    assert 2.0 * patch.b == pytest.approx(two_b, rel=2e-5)
    assert patch.peak_pressure == pytest.approx(peak, rel=2e-5)
    if approach is not None:
        assert patch.approach == pytest.approx(approach, rel=2e-5)


@settings(deadline=None)  # the first call compiles
@given(st.floats(-9.0, 0.0))
def test_elliptic_integrals_equal_those_of_scipy(exponent):
    complement = 10.0**exponent
    first, d_integral = elliptic_integrals(complement)
    assert first == pytest.approx(float(ellipkm1(complement**2)), rel=4e-15)
    square = 1.0 - complement**2
    if square > 1e-3:  # scipy's difference loses digits below
        expected = (float(ellipkm1(complement**2)) - float(ellipe(square))) / square
        assert d_integral == pytest.approx(expected, rel=1e-12)


def test_elliptic_integrals_of_the_circle():
    first, d_integral = elliptic_integrals(1.0)
    assert first == pytest.approx(0.5 * math.pi, rel=1e-15)
    assert d_integral == pytest.approx(0.25 * math.pi, rel=1e-14)


@pytest.mark.parametrize("exponent", range(-16, -2))
def test_elliptic_integrals_are_smooth_near_the_circle(exponent):
    complement = 1.0 - 10.0**exponent
    square = (1.0 - complement) * (1.0 + complement)
    first, d_integral = elliptic_integrals(complement)
    # K = pi/2 (1 + m/4 + ...), D = pi/4 (1 + 3m/8 + ...), m = e^2
    assert first == pytest.approx(0.5 * math.pi * (1.0 + square / 4.0), rel=square**2 + 1e-15)
    assert d_integral == pytest.approx(
        0.25 * math.pi * (1.0 + 3.0 * square / 8.0), rel=square**2 + 1e-14
    )


@settings(deadline=None)  # the first call compiles
@given(st.floats(-4.0, 4.0))
def test_axis_ratio_solves_its_equation_over_eight_decades(exponent):
    # from a chosen b/a to A/B by scipy's integrals, and back
    aspect = 10.0 ** (-abs(exponent))
    first = float(ellipkm1(aspect**2))
    second = float(ellipe(1.0 - aspect**2))
    if 1.0 - aspect < 1e-4:
        ratio = aspect**-1.5  # the leading term; the next is of second order
        assert axis_ratio(ratio) == pytest.approx(aspect, rel=1e-8)
        return
    ratio = (second / aspect**2 - first) / (first - second)
    assert axis_ratio(ratio) == pytest.approx(aspect, rel=1e-10)


@settings(deadline=None)  # the first call compiles
@given(st.floats(-4.0, 4.0), st.floats(1.0, 1e4))
def test_swapped_curvatures_swap_the_axes(exponent, load):
    ratio = 10.0**exponent
    one = hertz(20.0, 20.0 * ratio, load, MODULUS)
    other = hertz(20.0 * ratio, 20.0, load, MODULUS)
    assert (one.a, one.b) == (other.b, other.a)
    assert one.peak_pressure == other.peak_pressure
    assert one.approach == other.approach


def test_equal_curvatures_have_a_circular_patch():
    patch = hertz(5.0, 5.0, 300.0, MODULUS)
    radius = (0.75 * 300.0 * 0.1 / MODULUS) ** (1.0 / 3.0)  # R = 1/(2 A)
    assert patch.a == pytest.approx(radius, rel=1e-13, abs=0.0)
    assert patch.a == patch.b
    assert patch.approach == pytest.approx(radius**2 / 0.1, rel=1e-13, abs=0.0)
    nearby = hertz(5.0, 5.0 * (1.0 + 1e-12), 300.0, MODULUS)
    assert nearby.a == pytest.approx(patch.a, rel=1e-11, abs=0.0)


@settings(deadline=None)  # the first call compiles
@given(st.floats(-4.0, 4.0), st.floats(1.0, 1e4))
def test_pressure_integrates_to_the_load(exponent, load):
    patch = hertz(20.0, 20.0 * 10.0**exponent, load, MODULUS)
    volume = 2.0 / 3.0 * math.pi * patch.a * patch.b * patch.peak_pressure
    assert volume == pytest.approx(load, rel=1e-13)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    y = patch.b * nodes
    assert np.dot(weights, patch.line_load(y)) * patch.b == pytest.approx(load, rel=1e-13)
    section = 0.5 * math.pi * patch.peak_pressure * patch.half_length(y) ** 2 / patch.a
    assert patch.line_load(y) == pytest.approx(section, rel=1e-12)


def test_load_below_is_the_integral_of_the_line_load():
    patch = hertz(45.0, 1.0, 300.0, MODULUS)
    edges = np.linspace(-1.2 * patch.b, 1.2 * patch.b, 4001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    steps = np.diff(patch.load_below(edges))
    assert steps.sum() == pytest.approx(300.0, rel=1e-14)
    assert steps / np.diff(edges) == pytest.approx(patch.line_load(middle), rel=1e-3, abs=60.0)
    assert patch.load_below(np.zeros(1))[0] == pytest.approx(150.0, rel=1e-14)


def test_given_hertz_ellipse_has_the_approach_of_hertz():
    patch = hertz(45.0, 1.0, 300.0, MODULUS)
    assert given_ellipse(patch.a, patch.b, 300.0, MODULUS).approach == pytest.approx(
        patch.approach, rel=1e-13, abs=0.0
    )


@pytest.mark.parametrize(
    "bad", [(0.0, 1.0, 1.0, 1.0), (1.0, -1.0, 1.0, 1.0), (1.0, 1.0, math.nan, 1.0)]
)
def test_invalid_input_is_refused(bad):
    with pytest.raises(ValueError, match="must be positive and finite"):
        hertz(*bad)


def fit(gap, strips=161, half=8e-3):
    y = (np.arange(strips) - 0.5 * (strips - 1)) * (2.0 * half / strips)
    return hertz_on_profile(y, gap(y), 45.0, 300.0, MODULUS, 1e-10, 200)


@settings(deadline=None)  # the first call compiles
@given(st.floats(-2e-3, 2e-3), st.floats(0.5, 5.0), st.floats(-1e-3, 1e-3))
def test_parabola_is_fitted_exactly_at_any_position(centre, curvature, height):
    found = fit(lambda y: height + curvature * (y - centre) ** 2)
    assert found[-1] == CONVERGED
    expected = hertz(45.0, curvature, 300.0, MODULUS)
    assert found[:2] == pytest.approx((curvature, expected.b), rel=1e-6)
    assert found[2] == pytest.approx(centre, abs=1e-9)
    assert found[3] == pytest.approx(height, abs=1e-14)


@pytest.mark.parametrize("depth", [1e-6, 5e-6, 17e-6, 48e-6])
@pytest.mark.parametrize("offset", [0.0, 0.4e-3])
def test_patch_of_worn_profile_is_consistent_with_its_fit(depth, offset):
    def gap(y):
        return y**2 + 0.95 * np.maximum(depth - (y - offset) ** 2, 0.0)

    curvature, b, centre, _, _, status = fit(gap)
    assert status == CONVERGED
    assert b == pytest.approx(hertz(45.0, curvature, 300.0, MODULUS).b, rel=1e-9)
    y = (np.arange(161) - 80.0) * (16e-3 / 161)
    inside = np.abs(y - centre) < b
    weight = np.sqrt(1.0 - ((y[inside] - centre) / b) ** 2)
    expected = np.polyfit(y[inside] - centre, gap(y[inside]), 2, w=weight)
    assert curvature == pytest.approx(expected[0], rel=1e-6)
    assert abs(expected[1] / (2.0 * expected[0])) < 1e-8 * b


def test_unsuitable_profiles_have_a_status():
    assert fit(lambda y: -(y**2))[-1] == NO_CURVATURE
    assert fit(lambda y: 1e-3 * y**2)[-1] == LEAVES_STRIPS
    assert fit(lambda y: 1e6 * y**2, strips=9)[-1] == TOO_FEW_STRIPS
    assert fit_parabola(np.zeros(2), np.zeros(2), 0.0, 1.0)[-1] == 2


def test_elliptic_integrals_of_an_array_are_those_of_its_elements():
    complement = np.concatenate(
        [np.geomspace(1e-300, 1.0, 400), 1.0 - np.geomspace(1e-16, 0.5, 99)]
    )
    expected = np.array([elliptic_integrals(value) for value in complement.tolist()])
    np.testing.assert_array_equal(np.transpose(elliptic_integrals_of(complement)), expected)
