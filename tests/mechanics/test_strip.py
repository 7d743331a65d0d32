"""Strip theory against Carter, and against the exact theory on the rig."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.reference import rows
from wearsim.mechanics.elasticity import combine
from wearsim.mechanics.strip import strip_force, strip_tractions
from wearsim.types import Material

PAIR = combine(Material(200e9, 0.3), Material(200e9, 0.3))
MODULI = PAIR.contact_modulus, PAIR.shear_modulus


def relative_saturation(slip, half_length=1e-4, line_load=1e5, friction=0.1):
    force = strip_force(half_length, line_load, friction, slip, 0.0, *MODULI)[0]
    return -force / (friction * line_load)


def test_that_carters_law_is_met():
    half_length, line_load, friction = 1e-4, 1e5, 0.1
    pressure = 2.0 * line_load / (np.pi * half_length)
    saturating = 2.0 * friction * pressure / MODULI[0]
    for part in (0.1, 0.4, 0.9):
        expected = 1.0 - (1.0 - part) ** 2
        assert relative_saturation(part * saturating) == pytest.approx(expected, rel=1e-12)
    assert relative_saturation(1.5 * saturating) == pytest.approx(1.0, rel=1e-12)
    assert relative_saturation(0.4 * saturating) == pytest.approx(
        rows("carter")[0]["exact"], rel=1e-12
    )


slips = st.floats(-1e-2, 1e-2).filter(lambda x: x == 0.0 or abs(x) > 1e-9)


@given(slips, slips, st.floats(0.01, 0.8))
def test_that_traction_opposes_slip_within_the_traction_bound(slip_x, slip_y, friction):
    force_x, force_y, adhering = strip_force(1e-4, 1e5, friction, slip_x, slip_y, *MODULI)
    assert force_x * slip_x + force_y * slip_y <= 0.0
    assert np.hypot(force_x, force_y) <= friction * 1e5 * (1.0 + 1e-12)
    assert 0.0 <= adhering <= 2e-4
    mirrored = strip_force(1e-4, 1e5, friction, -slip_x, slip_y, *MODULI)
    assert mirrored == (-force_x, force_y, adhering)


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.8, 1.5])
def test_that_the_force_is_continuous_where_the_strip_begins_to_slide_fully(angle):
    line_load, half_length, friction = 1e5, 1e-4, 0.2
    bound = 4.0 * friction * line_load / (np.pi * half_length**2)
    rate = np.hypot(np.cos(angle) * MODULI[0], np.sin(angle) * MODULI[1]) / bound
    forces = []
    for factor in (1.0 - 1e-9, 1.0 + 1e-9):
        slip = factor * half_length / rate
        forces.append(
            strip_force(
                half_length,
                line_load,
                friction,
                slip * np.cos(angle),
                slip * np.sin(angle),
                *MODULI,
            )[:2]
        )
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-7, atol=1e-6)


def rig_power(row, strips=400):
    """Return power over V of a row of `rig_random` on its Hertzian patch [N]."""
    a, b, load = row["a_m"], row["b_m"], row["N_N"]
    y = (np.arange(strips) - 0.5 * (strips - 1)) * 2.0 * b / strips
    half_length = a * np.sqrt(1.0 - (y / b) ** 2)
    q = 0.75 * load / b * (1.0 - (y / b) ** 2)
    q *= load / (q.sum() * 2.0 * b / strips)
    slip = row["xi"] - row["phi_per_m"] * y
    out = np.empty((4, strips))
    friction = np.full(strips, row["mu"])
    strip_tractions(half_length, q, friction, slip, row["eta"], *MODULI, 1.0, *out)
    return out[2].sum() * 2.0 * b / strips


@pytest.mark.parametrize(
    ("kind", "rms", "worst"), [("paper", 3.2e-3, 8e-3), ("partial", 1.3e-2, 3.6e-2)]
)
def test_that_the_power_is_near_the_exact_theory_on_random_inputs(kind, rms, worst):
    found = [(rig_power(row), row["P_over_V_N"]) for row in rows("rig_random", kind=kind)]
    errors = np.array([ours / exact - 1.0 for ours, exact in found])
    assert len(errors) == 40
    assert np.sqrt((errors**2).mean()) < rms
    assert np.abs(errors).max() < worst
