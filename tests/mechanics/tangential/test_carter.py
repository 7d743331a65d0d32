"""One strip in rolling contact against Carter, the linear theory and a numerical solution."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tests.materials import STEEL
from tests.mechanics.tangential.line_contact import rolling_strip
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.tangential import carter
from wearsim.mechanics.tangential.carter import SPIN_LIMIT, TURNED, mean_direction

strip_force = kernel(carter.strip_force)

PAIR = combine(STEEL, STEEL)
MODULI = PAIR.contact_modulus, PAIR.shear_modulus
A, Q, MU = 1e-4, 1e5, 0.1
STEEPNESS = 4.0 * Q / (np.pi * A**2)
RATE = MU * STEEPNESS * A  # E* times the creepage at which a strip slides fully


def scaled(d_x, d_y, psi, moduli=MODULI):
    """Return creepage and spin of given d_x/a, d_y/a and psi."""
    return d_x * RATE / moduli[0], d_y * RATE / moduli[1], psi * RATE / (A * moduli[1])


def force(slip_x, slip_y, spin, moduli=MODULI, friction=MU):
    """Return forces over mu q, and moment over mu q a."""
    found = np.array(strip_force(A, Q, friction, STEEPNESS, slip_x, slip_y, spin, *moduli)[:3])
    return found / (friction * Q * np.array([1.0, 1.0, A]))


def work(slip_x, slip_y, spin, found):
    return -(found[0] * slip_x + found[1] * slip_y + spin * A * found[2])


@pytest.mark.parametrize("psi", [-0.3, 0.1, 0.3])
def test_lateral_creepage_with_spin_is_carter_of_other_stiffness(psi):
    # for lateral traction only, its reduction by 1 - psi in the adhesion zone is exact
    for d_y in (0.1, 0.5):
        t = d_y / (1.0 - psi)
        found = force(*scaled(0.0, d_y, psi))
        assert found[1] == pytest.approx(-(1.0 - (1.0 - psi) * (1.0 - t) ** 2), rel=1e-12)
        assert found[2] == pytest.approx((1.0 - psi) * (1.0 - t) ** 2 * t, rel=1e-12)


def test_small_creepage_meets_the_linear_theory():
    slip_x, slip_y, spin = 1e-9, -2e-9, 3e-5
    force_x, force_y, moment, adhering = strip_force(
        A, Q, MU, STEEPNESS, slip_x, slip_y, spin, *MODULI
    )
    stiff_x, stiff_y = 0.5 * np.pi * A * MODULI[0], 0.5 * np.pi * A * MODULI[1]
    assert force_x == pytest.approx(-stiff_x * slip_x, rel=1e-4)
    assert force_y == pytest.approx(-stiff_y * (slip_y + 0.5 * spin * A), rel=1e-4)
    assert moment == pytest.approx(0.5 * stiff_y * A * slip_y, rel=1e-4)
    assert adhering == pytest.approx(2.0 * A, rel=1e-4)


CASES = [
    (d, angle, psi)
    for d in (0.15, 0.7, 1.3)
    for angle in (25.0, 155.0)
    for psi in (0.0, 0.08, -0.08, 0.2)
]


def test_strip_force_meets_numerical_solution():
    errors = {0.0: [], 0.08: [], 0.2: []}
    for d, angle, psi in CASES:
        d_x, d_y = d * np.cos(np.radians(angle)), d * np.sin(np.radians(angle))
        exact = rolling_strip(d_x, d_y, psi, MODULI[0] / MODULI[1])
        slip = scaled(d_x, d_y, psi)
        found = force(*slip)
        assert np.abs(found - exact).max() < (0.02 if abs(psi) > 0.1 else 0.012)
        errors[abs(psi)].append(work(*slip, found) / work(*slip, exact) - 1.0)
    assert np.abs(errors[0.0]).max() < 1.2e-3
    assert np.abs(errors[0.08]).max() < 2.5e-3
    assert np.abs(errors[0.2]).max() < 5e-3


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.0, 3.0])
def test_full_sliding_traction_follows_the_local_slip(turn):
    slip_x, slip_y = 0.5, 0.3
    place = np.cos((np.arange(400) + 0.5) * np.pi / 400)
    weight = (1.0 - place**2) / (1.0 - place**2).sum()
    local = np.hypot(slip_x, slip_y + turn * place)
    exact = (
        (weight * slip_x / local).sum(),
        (weight * (slip_y + turn * place) / local).sum(),
        (weight * place * (slip_y + turn * place) / local).sum(),
    )
    # elasticity is negligible at a hundred times the creepage of saturation
    size = 100.0 * RATE / MODULI[1]
    found = force(size * slip_x, size * slip_y, size * turn / A)
    # below TURNED the rotation of the slip is neglected, an error of second order
    tolerance = 0.01 + 0.5 * TURNED**2
    np.testing.assert_allclose(found, np.negative(exact), atol=tolerance)
    own = work(size * slip_x, size * slip_y, size * turn / A, found)
    assert own == pytest.approx(size * (weight * local).sum(), rel=2e-3)


def test_mean_direction_for_small_rotation_is_its_series():
    assert mean_direction(3.0, 4.0, 0.0) == pytest.approx((0.6, 0.8, 0.0))
    # the mean of s^2 and of s^4 are 1/4 and 1/8
    turn = 0.2
    expected = 1.0 - 0.5 * turn**2 / 4.0 + 0.375 * turn**4 / 8.0
    assert mean_direction(1.0, 0.0, turn)[0] == pytest.approx(expected, abs=turn**6)
    expected = turn / 4.0 - 0.5 * turn**3 / 8.0
    assert mean_direction(1.0, 0.0, turn)[2] == pytest.approx(expected, abs=turn**5)


# Gauss quadrature for the weight sqrt(1 - s^2): exact for polynomials up to the degree 13
PLACES = np.cos(np.pi * np.arange(1, 8) / 8.0)
WEIGHTS = (1.0 - PLACES**2) / 4.0


def tractions_of_the_docstring(d_x, d_y, whole):
    """Return forces and moment by quadrature of the tractions of `carter`, and the adhering part.

    Over mu q, mu q a and 2 a; lengths are over a.
    """
    slip_x, slip_y, spin = scaled(d_x, d_y, whole)
    psi = min(max(whole, -SPIN_LIMIT), SPIN_LIMIT)
    t = np.roots([1.0 - psi * psi, -2.0 * d_y * psi, -d_x * d_x - d_y * d_y]).max()
    slip = np.hypot(slip_x, slip_y)
    y_hat, e, turn = np.array([0.0, psi]), np.array([0.0, psi]), np.zeros(2)
    if slip > 0.0:
        e = np.array([d_x / t, d_y / t + psi])
        turn = np.array([slip_x, slip_y]) / slip - e
    reach = max(1.0 - t, 0.0)
    back = t + reach * PLACES  # in the adhesion zone
    if t < 1.0:
        per = 1.0 / t if t > 0.0 else 0.0
        whole_strip = e + np.outer(1.5 - (1.0 + PLACES) * per, turn)
        reduced = np.outer((1.0 + back) * per - 0.5, turn) - (e - y_hat)
    else:
        whole_strip = e + np.outer(1.0 - 0.5 / t**2 - PLACES / t, turn)
        reduced = np.zeros((7, 2))
    force = -(WEIGHTS @ whole_strip + reach**2 * (WEIGHTS @ reduced))
    moment = -(WEIGHTS * PLACES @ whole_strip + reach**2 * (WEIGHTS * back @ reduced))[1]
    # the rotation of the slip along the strip, and spin beyond its limit
    local = np.column_stack([np.full(7, slip_x), slip_y + spin * A * PLACES])
    size = np.hypot(*local.T)[:, None]
    direction = np.divide(local, size, out=np.zeros((7, 2)), where=size > 0.0)
    mean, turning = WEIGHTS @ direction, (WEIGHTS * PLACES @ direction)[1]
    rotating = whole != 0.0 and t > 1.0
    turned = max(0.0, 1.0 - 1.0 / t**2 - (TURNED * slip / (spin * A)) ** 2) if rotating else 0.0
    scrubbed = max(0.0, 1.0 - SPIN_LIMIT / abs(whole)) if whole else 0.0
    force = (1.0 - scrubbed) * (force + turned * (turn + e - mean)) - scrubbed * mean
    moment = (1.0 - scrubbed) * ((1.0 - turned) * moment - turned * turning) - scrubbed * turning
    return np.array([*force, moment, (1.0 - scrubbed) * reach])


@pytest.mark.parametrize("psi", [0.0, 0.15, -0.35, 0.6, -1.4])
@pytest.mark.parametrize(
    ("d_x", "d_y"),
    [(0.3, -0.2), (-0.1, 0.3), (0.7, 0.5), (-1.2, 0.4), (1.5, -2.5), (0.0, 0.4), (0.0, 0.0)],
)
def test_strip_force_integrates_the_tractions_of_its_description(d_x, d_y, psi):
    motion = scaled(d_x, d_y, psi)
    found = [*force(*motion), strip_force(A, Q, MU, STEEPNESS, *motion, *MODULI)[3] / (2.0 * A)]
    expected = tractions_of_the_docstring(d_x, d_y, psi)
    assert found == pytest.approx(expected, rel=1e-11, abs=1e-12)
    # without the full formula where neither the slip turns nor the spin exceeds its limit
    turns = carter.spin_turns(A, MU * STEEPNESS, *motion, MODULI[1])
    turn = abs(motion[2]) * A
    assert turns == (turn > TURNED * np.hypot(*motion[:2]) or abs(psi) > SPIN_LIMIT)
    if not turns:
        full = strip_force(A, Q, MU, STEEPNESS, *motion, *MODULI)
        straight = carter.straight_force(A, MU * Q, MU * STEEPNESS, *motion, *MODULI)
        assert straight == pytest.approx(full, rel=1e-15)


sizes = st.floats(-6.0, 6.0).map(lambda x: np.sign(x) * 10.0 ** (abs(x) - 4.0) if x else 0.0)


@given(sizes, sizes, sizes, st.floats(0.01, 0.8))
def test_traction_opposes_slip_within_the_bound(d_x, d_y, psi, friction):
    slip = scaled(d_x, d_y, psi)
    found = force(*slip, friction=friction)
    scale = np.hypot(slip[0], slip[1]) + abs(slip[2]) * A
    assert work(*slip, found) >= -1e-14 * scale
    assert np.hypot(*found[:2]) <= 1.0 + 1e-12
    assert 0.0 <= strip_force(A, Q, friction, STEEPNESS, *slip, *MODULI)[3] <= 2.0 * A


@given(sizes, sizes, sizes)
def test_mirrored_strip_has_mirrored_forces(d_x, d_y, psi):
    slip_x, slip_y, spin = scaled(d_x, d_y, psi)
    force_x, force_y, moment, adhering = strip_force(
        A, Q, MU, STEEPNESS, slip_x, slip_y, spin, *MODULI
    )
    mirrored = strip_force(A, Q, MU, STEEPNESS, slip_x, -slip_y, -spin, *MODULI)
    assert mirrored == (force_x, -force_y, -moment, adhering)
    turned = strip_force(A, Q, MU, STEEPNESS, -slip_x, slip_y, spin, *MODULI)
    assert turned == (-force_x, force_y, moment, adhering)


@given(sizes, sizes, sizes)
def test_force_is_lipschitz_in_creepage(d_x, d_y, psi):
    here = force(*scaled(d_x, d_y, psi))
    near = force(*scaled(d_x * (1.0 + 1e-9), d_y * (1.0 - 1e-9), psi * (1.0 + 1e-9)))
    assert np.abs(near - here).max() < 1e-6


@pytest.mark.parametrize("psi", [0.0, 0.3, SPIN_LIMIT, 2.0])
@pytest.mark.parametrize("angle", [0.0, 0.3, 0.8, 1.5])
def test_force_is_continuous_at_the_onset_of_full_sliding(angle, psi):
    def at(d):
        return force(*scaled(d * np.cos(angle), d * np.sin(angle), psi))

    def adhering(d):
        slip = scaled(d * np.cos(angle), d * np.sin(angle), psi)
        return strip_force(A, Q, MU, STEEPNESS, *slip, *MODULI)[3]

    low, high = 0.01, 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if adhering(middle) > 0.0 else (low, middle)
    np.testing.assert_allclose(at(low * (1.0 - 1e-9)), at(high * (1.0 + 1e-9)), atol=1e-7)


def test_strip_without_creepage_adheres_and_without_friction_slides():
    assert strip_force(A, Q, MU, STEEPNESS, 0.0, 0.0, 0.0, *MODULI) == (0.0, 0.0, 0.0, 2.0 * A)
    assert strip_force(A, Q, 0.0, STEEPNESS, 1e-3, 1e-3, 1.0, *MODULI) == (0.0, 0.0, 0.0, 0.0)
    slight = strip_force(A, Q, 1e-9, STEEPNESS, 1e-3, 0.0, 0.0, *MODULI)
    assert slight == pytest.approx((-1e-9 * Q, 0.0, 0.0, 0.0), rel=1e-9)


@pytest.mark.parametrize("psi", [0.0, 0.4, -0.7])
@pytest.mark.parametrize(("d_x", "d_y"), [(0.3, -0.2), (-0.1, 0.5), (0.0, 0.4)])
def test_traction_at_the_end_of_adhesion_is_on_the_bound(psi: float, d_x: float, d_y: float):
    motion = scaled(d_x, d_y, psi)
    state = carter.strip_state(A, MU * STEEPNESS, *motion, *MODULI)
    assert (d_x / state.t) ** 2 + (d_y / state.t + psi) ** 2 == pytest.approx(1.0, rel=1e-12)
    assert (state.e_x, state.e_y) == pytest.approx((d_x / state.t, d_y / state.t + psi))
    size = np.hypot(*motion[:2])
    assert (state.u_x, state.u_y) == pytest.approx((motion[0] / size, motion[1] / size))
    assert state.psi == pytest.approx(psi)
    assert (state.turned, state.scrubbed) == (0.0, 0.0)
