"""Weights of the Runge-Kutta-Legendre scheme, checked by its stability polynomial."""

import numpy as np
import pytest

from wearsim.evolution.steppers.stabilised import MIN_STAGES, legendre_stages, reach, stages_for

COUNTS = (2, 3, 4, 5, 8, 17, 60)


def stability(z, count):
    """Return the result of a step of u' = z u from u = 1."""
    stages = legendre_stages(count)
    before, last = np.ones_like(z), 1.0 + stages[0][3] * z
    for of_last, of_before, rate, start_rate in stages[1:]:
        start = 1.0 - of_last - of_before + start_rate * z
        before, last = last, start + (of_last + rate * z) * last + of_before * before
    return last


@pytest.mark.parametrize("count", COUNTS)
def test_step_is_of_second_order(count):
    z = np.array([-1e-2, -5e-3])
    errors = np.abs(stability(z, count) - np.exp(z))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.02)


@pytest.mark.parametrize("count", COUNTS)
def test_stability_polynomial_is_shifted_legendre(count):
    z = np.linspace(-reach(count), 0.0, 101)
    b = (count * count + count - 2) / (2.0 * count * (count + 1))
    polynomial = np.polynomial.legendre.Legendre.basis(count)(1.0 + 2.0 * z / reach(count))
    np.testing.assert_allclose(stability(z, count), 1.0 - b + b * polynomial, atol=1e-10)


@pytest.mark.parametrize("count", COUNTS)
def test_decay_within_reach_has_no_change_of_sign(count):
    z = -np.linspace(0.01, 1.0 / 1.2, 2001) * reach(count)
    found = stability(z, count)
    assert found.min() > 0.0
    assert found.max() < 1.0


@pytest.mark.parametrize("count", COUNTS)
def test_number_of_stages_is_least_possible(count):
    assert stages_for(0.999 * reach(count)) == max(count, MIN_STAGES)
    assert stages_for(1.001 * reach(count)) == count + 1
    assert stages_for(0.0) == MIN_STAGES
