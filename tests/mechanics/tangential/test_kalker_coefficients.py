"""Kalker's creepage coefficients against the exact linear theory, and their continuity."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.interpolate import CubicSpline

from wearsim.mechanics.tangential.kalker_coefficients import (
    creepage_coefficients,
    flexibilities,
    line_limit_coefficients,
    long_limit,
    one_flexibility,
    short_limit,
    spline,
)

NAMES = ("c11", "c22", "c23", "c33")


def values(ratio, nu):
    found = creepage_coefficients(ratio, nu)
    return np.array([getattr(found, name) for name in NAMES])


@pytest.mark.parametrize(
    ("ratio", "nu", "expected"),
    [
        (0.1, 0.25, (3.31, 2.52, 0.473, 8.28)),
        (1.0, 0.0, (3.40, 3.40, 1.33, 1.21)),
        (1.0 / 0.3, 0.5, (7.34, 7.51, 5.01, 0.446)),
        (10.0, 0.25, (11.7, 12.8, 14.6, 0.526)),
    ],
)
def test_interpolation_reproduces_the_printed_table(ratio, nu, expected):
    assert values(ratio, nu) == pytest.approx(expected, rel=1e-12)


@settings(deadline=None)
@given(st.floats(-6.0, 6.0), st.floats(0.0, 0.5))
def test_coefficients_are_positive(exponent, nu):
    assert np.all(values(10.0**exponent, nu) > 0.0)


@settings(deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(0.0, 0.499))
def test_coefficients_are_continuous_in_both_arguments(exponent, nu):
    ratio = 10.0**exponent
    here = values(ratio, nu)
    assert values(ratio * (1.0 + 1e-7), nu) == pytest.approx(here, rel=1e-6)
    assert values(ratio, nu + 1e-7) == pytest.approx(here, rel=1e-5)


KNOTS = sorted({round(math.exp(place), 12) for which in range(4) for place in spline(which).knots})


@pytest.mark.parametrize("nu", [0.0, 0.1, 0.25, 0.3, 0.42, 0.5])
def test_coefficients_are_smooth_at_knots_and_table_ends(nu):
    assert len(KNOTS) == 20
    assert (KNOTS[0], KNOTS[-1]) == (0.1, 20.0)
    step = 1e-4
    for knot in KNOTS:
        below, here, above = (np.log(values(knot * math.exp(k * step), nu)) for k in (-1, 0, 1))
        near = np.log(values(knot * (1.0 + 1e-12), nu)), np.log(values(knot * (1.0 - 1e-12), nu))
        assert near[0] == pytest.approx(near[1], abs=1e-10)
        # a kink would add its change of slope times the step
        assert above - here == pytest.approx(here - below, abs=5e-7)


@pytest.mark.parametrize("which", range(4))
def test_splines_have_a_continuous_second_derivative(which):
    knots, known, slopes = spline(which)
    clamped = CubicSpline(knots, known, bc_type=((1, slopes[0]), (1, slopes[-1])))
    assert slopes == pytest.approx(clamped(knots, 1), rel=1e-12)
    places = 0.6 * knots[:-1] + 0.4 * knots[1:]
    for k, nu in enumerate((0.0, 0.25, 0.5)):  # the columns of the table
        found = [values(math.exp(place), nu)[which] for place in places]
        assert np.log(found) == pytest.approx(clamped(places)[:, k], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("ratio", [0.05, 0.3, 1.0, 4.0, 15.0])
def test_coefficients_are_smooth_at_tabulated_poisson_ratios(ratio):
    step = 1e-4
    below, here, above = (values(ratio, 0.25 + k * step) for k in (-1, 0, 1))
    assert above - here == pytest.approx(here - below, rel=5e-3, abs=1e-6)
    assert values(ratio, 0.25 + 1e-12) == pytest.approx(values(ratio, 0.25 - 1e-12), rel=1e-10)


@pytest.mark.parametrize(("edge", "limit"), [(0.1, short_limit), (10.0, long_limit)])
def test_dependence_on_poissons_ratio_is_that_of_the_limits(edge, limit):
    # the ratio of table and limit varies slowly, and lies between those of the columns
    def excess(nu):
        return values(edge, nu) / np.array(limit(min(edge, 1.0 / edge), nu))

    columns = np.array([excess(nu) for nu in (0.0, 0.25, 0.5)])
    allowed = np.array([1e-3, 1e-3, 4e-3, 1.5e-2])
    for nu in np.linspace(0.0, 0.5, 21):
        found = excess(nu)
        assert np.all(found <= columns.max(axis=0) * (1.0 + allowed))
        assert np.all(found >= columns.min(axis=0) * (1.0 - allowed))


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_limits_are_reached(nu):
    assert values(1e-7, nu) == pytest.approx(short_limit(1e-7, nu), rel=1e-6)
    assert values(1e9, nu)[2] == pytest.approx(long_limit(1e-9, nu)[2], rel=3e-3)
    assert values(1e9, nu)[0] == pytest.approx(long_limit(1e-9, nu)[0], rel=3e-3)


@pytest.mark.parametrize("nu", [0.1, 0.45])
def test_limits_are_kalkers_and_the_table_fades_to_them(nu):
    g, log4 = 0.02, math.log(4.0)
    large = math.log(16.0 / g**2)  # Kalker's Lambda
    c23 = math.pi * math.sqrt(g) / (3.0 * (1.0 - nu)) * (1.0 + nu * (0.5 * large + log4 - 5.0))
    c33 = math.pi**2 / (16.0 * (1.0 - nu) * g)
    plane = math.pi**2 / 4.0
    assert short_limit(g, nu) == pytest.approx((plane / (1.0 - nu), plane, c23, c33), rel=1e-13)
    along, across = large - 2.0 * nu, (1.0 - nu) * large + 2.0 * nu
    turning = (1.0 - nu) * large - 2.0 + 4.0 * nu
    c11 = 2.0 * math.pi / (g * along) * (1.0 + (3.0 - log4) / along)
    c22 = 2.0 * math.pi / (g * across) * (1.0 + (1.0 - nu) * (3.0 - log4) / across)
    c23 = 2.0 * math.pi / (3.0 * g * math.sqrt(g) * turning)
    c33 = 0.25 * math.pi * (1.0 - nu * (large - 2.0) / turning)
    assert long_limit(g, nu) == pytest.approx((c11, c22, c23, c33), rel=1e-13)

    def excess(ratio):
        limit = short_limit(ratio, nu) if ratio < 1.0 else long_limit(1.0 / ratio, nu)
        return values(ratio, nu) / limit - 1.0

    fade = 4.0 ** np.array([1.5, 1.5, 2.5, 1.5])
    assert excess(0.025) * fade == pytest.approx(excess(0.1), rel=1e-9)
    ends = 10.0, 10.0, 10.0, 20.0
    at = np.diag([excess(end) for end in ends])
    decay = (np.log(16.0 * np.square(ends)) / math.log(16.0 * 300.0**2)) ** 2
    assert excess(300.0) == pytest.approx(at * decay, rel=1e-9)


def test_long_contact_has_the_line_limit():
    found = line_limit_coefficients(0.088, 0.3)
    assert found.c11 == pytest.approx(3.5249, rel=2e-5)
    assert found.c22 == pytest.approx(math.pi**2 / 4.0, rel=1e-14)
    with pytest.raises(ValueError, match="too large"):
        line_limit_coefficients(50.0, 0.5)


@pytest.mark.parametrize(("ratio", "nu"), [(0.0, 0.3), (math.nan, 0.3), (1.0, -0.1), (1.0, 0.6)])
def test_arguments_out_of_range_are_refused(ratio, nu):
    with pytest.raises(ValueError, match=r"must"):
        creepage_coefficients(ratio, nu)


def test_flexibilities_are_computed_from_coefficients():
    # L1 and L2 of the reference run of the mean problem
    found = flexibilities(
        line_limit_coefficients(0.17173473898160382 / 1.9464336537534505, 0.3),
        0.17173473898160382e-3,
        1.9464336537534505e-3,
        200e9 / 2.6,
    )
    assert found.longitudinal == pytest.approx(1.6889956260024387e-15, rel=1e-12, abs=0.0)
    assert found.lateral == pytest.approx(2.4128508942891984e-15, rel=1e-12, abs=0.0)
    assert found.spin == pytest.approx(1.1056223217325914e-15, rel=2e-4, abs=0.0)


def test_single_flexibility_is_the_weighted_mean():
    three = (2.0, 3.0, 5.0)
    for k in range(3):
        creepages = [0.0, 0.0, 0.0]
        creepages[k] = -7e-4
        assert one_flexibility(*three, *creepages) == pytest.approx(three[k], rel=1e-15)
    assert one_flexibility(*three, 0.0, 0.0, 0.0) == three[0]
    found = one_flexibility(*three, 3e-300, -4e-300, 12e-300)
    assert found == pytest.approx((3.0 * 2.0 + 4.0 * 3.0 + 12.0 * 5.0) / 13.0, rel=1e-14)
