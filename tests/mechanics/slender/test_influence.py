"""The influence of one strip on another, against adaptive quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad

from wearsim.mechanics.slender.influence import (
    HIGHEST,
    LOWEST,
    STEP,
    curvature_table,
    influence_table,
    mean_asinh,
    middle_curvature,
    no_table,
    read_influence,
    read_value,
)


def by_quadrature(t):
    """Return f(t) = mean of asinh(t/|s|) under the weight (2/pi) sqrt(1 - s^2)."""
    return quad(
        lambda angle: 4.0 / np.pi * np.cos(angle) ** 2 * np.arcsinh(t / np.sin(angle)),
        0.0,
        0.5 * np.pi,
        epsabs=1e-13,
        epsrel=1e-13,
        limit=400,
    )[0]


@pytest.mark.parametrize("t", [0.005, 0.02, 0.3, 1.0, 2.9999, 3.0, 7.0, 300.0])
def test_f_and_its_slope_meet_adaptive_quadrature(t):
    value, slope = (float(x[0]) for x in mean_asinh(np.array([t])))
    assert value == pytest.approx(by_quadrature(t), abs=1e-11)
    step = 1e-4
    difference = (by_quadrature(t * (1 + step)) - by_quadrature(t * (1 - step))) / (2 * step)
    assert slope == pytest.approx(difference, abs=1e-7)


def test_f_tends_to_its_logarithm():
    value, slope = mean_asinh(np.array([1e6]))
    assert value[0] == pytest.approx(np.log(2e6) + np.log(2.0) + 0.5, abs=1e-11)
    assert slope[0] == pytest.approx(1.0, abs=1e-11)


@pytest.mark.parametrize("t", [0.005, 0.3, 1.0, 7.0, 300.0])
def test_h_and_its_slope_meet_adaptive_quadrature(t):
    def by_integral(t):
        # the mean over s of the second derivative of asinh(t/|s - x|) at x = 0, by parts
        return quad(
            lambda angle: 4.0 / np.pi * t / np.hypot(t, np.sin(angle)),
            0.0,
            0.5 * np.pi,
            epsabs=1e-13,
            epsrel=1e-13,
            limit=400,
        )[0]

    value, slope = (float(x[0]) for x in middle_curvature(np.array([t])))
    assert value == pytest.approx(by_integral(t), abs=1e-12)
    step = 1e-4
    difference = (by_integral(t * (1 + step)) - by_integral(t * (1 - step))) / (2 * step)
    assert slope == pytest.approx(difference, abs=1e-7)


def test_infinite_strip_has_curvature_coefficient_four():
    assert 2.0 * middle_curvature(np.array([1e8]))[0][0] == pytest.approx(4.0, rel=1e-14)


def direct(tau, count, function=mean_asinh):
    """Return F_k (or C_k) at one or several ln(a/dy) = tau without the table."""
    t = (np.arange(count + 1) - 0.5) * np.exp(-np.asarray(tau))[..., None]
    return np.diff(np.sign(t) * function(np.abs(t).ravel())[0].reshape(t.shape))


@pytest.mark.parametrize(
    ("tabulated", "function"),
    [(influence_table, mean_asinh), (curvature_table, middle_curvature)],
    ids=["displacement", "curvature"],
)
@pytest.mark.parametrize("tau", [LOWEST, -3.21, -0.7, 0.0, 0.333, 2.5, HIGHEST])
def test_table_interpolates_the_function(tau, tabulated, function):
    table, expected = tabulated(40), direct(tau, 40, function)
    value, tangent = np.empty(40), np.empty(40)
    read_influence(table, tau, 40, value, tangent)
    assert [read_value(table, tau, k) for k in range(40)] == pytest.approx(value, rel=1e-14)
    np.testing.assert_allclose(value, expected, atol=3e-8)  # of C_0 = 4 at most
    step = 1e-4
    if LOWEST < tau < HIGHEST:
        slope = direct(tau + step, 40, function) - direct(tau - step, 40, function)
        np.testing.assert_allclose(tangent, expected + 0.25 * slope / step, atol=4e-6)


def test_tables_are_shared_and_kept() -> None:
    for tabulated in (influence_table, curvature_table, no_table):
        table = tabulated(5)
        assert tabulated(5) is table
        assert not table.flags.writeable
        nodes = round((HIGHEST - LOWEST) / STEP) + 1
        assert table.shape == (0 if tabulated is no_table else nodes, 2, 9)


def test_vanishing_half_length_is_a_line_load():
    value, tangent = np.empty(40), np.empty(40)
    read_influence(influence_table(40), -50.0, 40, value, tangent)
    k = np.arange(1, 40)
    np.testing.assert_allclose(value[1:], np.log((k + 0.5) / (k - 0.5)), atol=1e-8)
    np.testing.assert_array_equal(value, tangent)
    read_influence(influence_table(40), LOWEST, 40, tangent, np.empty(40))
    np.testing.assert_array_equal(value, tangent)
