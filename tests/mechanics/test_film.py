"""Film thickness after Hamrock and Dowson."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.mechanics.film import minimum_film

CONTACT = {
    "entrainment_speed": np.array([2.618]),
    "normal_force": np.array([300.0]),
    "curvature_x": np.array([90.0]),
    "curvature_y": 2.0,
    "contact_modulus": 109.89e9,
    "viscosity": 0.05,
    "pressure_viscosity": 20e-9,
}


def test_film_of_the_rig_by_hand():
    speed = 0.05 * 2.618 / (219.78e9 / 90.0)
    load = 300.0 / (219.78e9 / 90.0**2)
    k = 1.03 * 45.0**0.64
    expected = 3.63 * speed**0.68 * 4395.6**0.49 * load**-0.073 * (1.0 - np.exp(-0.68 * k)) / 90.0
    assert minimum_film(**CONTACT)[0] == pytest.approx(expected, rel=1e-12, abs=0.0)
    assert 0.1e-6 < expected < 2e-6


@pytest.mark.parametrize(
    ("key", "exponent"), [("entrainment_speed", 0.68), ("normal_force", -0.073)]
)
def test_exponents(key, exponent):
    ratio = minimum_film(**{**CONTACT, key: 2.0 * CONTACT[key]}) / minimum_film(**CONTACT)
    assert ratio == pytest.approx(2.0**exponent, rel=1e-12)
