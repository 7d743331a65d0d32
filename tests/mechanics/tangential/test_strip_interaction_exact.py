"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
import pytest

from wearsim.mechanics.tangential.strip_interaction import (
    strip_elasticity,
)
from wearsim.mechanics.tangential.strip_theory import new_tractions, strips_of_contact
from wearsim_bench.exact_solutions import rows


@pytest.mark.parametrize("ratio", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("nu", [0.0, 0.25, 0.5])
def test_small_creepage_meets_kalkers_coefficients(nu, ratio):
    exact = rows("kalker_coefficients", nu=nu, a_over_b=ratio)[0]
    n, a, shear = 256, 1e-4, 80e9
    b = a / ratio
    spacing = 2.0 * b / n
    y = (np.arange(n) - 0.5 * (n - 1)) * spacing
    part = 1.0 - (y / b) ** 2
    half_length, line_load, friction = a * np.sqrt(part), 1e5 * part, np.full(n, 1e4)
    elasticity = strip_elasticity(shear / (1.0 - nu), shear)

    def found(longitudinal, lateral, spin):
        out = new_tractions(n)
        slip_x = longitudinal - spin * y
        strips_of_contact(
            half_length, line_load, friction, slip_x, lateral, spin, spacing, elasticity, out
        )
        moment = (out.moment - y * out.force_x).sum()
        return -np.array([out.force_x.sum(), out.force_y.sum(), moment]) * spacing / shear

    size, spin = 1e-3, 1.0
    # longitudinal and lateral creepage together, so that the strips interact
    both = found(size, size, 0.0) / (a * b * size)
    assert both[0] == pytest.approx(exact["C11"], rel=0.02)
    assert both[1] == pytest.approx(exact["C22"], rel=0.02)
    assert -both[2] * a * b / (a * b) ** 1.5 == pytest.approx(exact["C23"], rel=0.05)
    turning = found(0.0, 0.0, spin)
    assert turning[1] / ((a * b) ** 1.5 * spin) == pytest.approx(exact["C23"], rel=0.05)
    assert turning[2] / ((a * b) ** 2 * spin) == pytest.approx(exact["C33"], rel=0.07)
