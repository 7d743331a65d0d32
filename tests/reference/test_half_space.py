"""The reference half-space solver against closed forms and against CONTACT."""

import numpy as np
import pytest

from tests.reference import half_space
from wearsim.mechanics.hertz.ellipse import hertz

MODULUS = 200e9 / (2.0 * (1.0 - 0.3**2))


def difference(found, exact):
    """Return the L1 norm of the difference over that of `exact`."""
    return np.abs(found - exact).sum() / np.abs(exact).sum()


def test_displacement_at_centre_of_square_is_closed_form():
    middle = half_space.under_rectangle(0.0, 0.0, 2e-3, 2e-3)
    assert middle == pytest.approx(8e-3 * np.log(1.0 + np.sqrt(2.0)), rel=1e-12)


def test_distant_rectangle_acts_as_point_load():
    space = half_space.HalfSpace((128, 96), 1e-4, 1e-4, MODULUS)
    pressure = np.zeros((128, 96))
    pressure[3, 2] = 1e9
    found = space.displacement(pressure)[123, 92]
    assert found == pytest.approx(10.0 / (np.pi * MODULUS * 0.015), rel=1e-4)


@pytest.mark.parametrize("across", [45.0, 15.83, 8.495, 3.805, 1.2317])
def test_elliptic_contact_equals_hertz(across):
    patch = hertz(45.0, across, 300.0, MODULUS)
    y = (np.arange(200) + 0.5) / 100.0 * 1.15 * patch.b - 1.15 * patch.b
    found = half_space.solve(across * y**2, y, 90.0, 300.0, MODULUS, 1.15 * patch.a)
    assert found.line_load.sum() * (y[1] - y[0]) == pytest.approx(300.0, rel=1e-12)
    assert difference(found.line_load, patch.line_load(y)) < 1e-3
    assert difference(found.half_length, patch.half_length(y)) < 4e-3
    assert found.approach == pytest.approx(patch.approach, rel=1e-4)
    assert found.peak_pressure == pytest.approx(patch.peak_pressure, rel=1e-3)
