"""FaStrip: linear and sliding limits, Carter's closed form, FaStrip of CONTACT, and fields."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp, trapezoid

from tests.materials import STEEL
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.tangential.fastrip import fastrip, fastrip_fields
from wearsim.mechanics.tangential.fastsim import march
from wearsim.mechanics.tangential.kalker_coefficients import (
    creepage_coefficients,
    flexibilities,
    one_flexibility,
)
from wearsim.mechanics.tangential.strip_with_spin import (
    StripMotion,
    amended_moduli,
    slip_at,
    strip_of,
)

PAIR = combine(STEEL, STEEL)
SHEAR, NU = PAIR.shear_modulus, PAIR.poisson_ratio
LOAD, A, B = 300.0, 1.363e-4, 1.545e-3


class Ellipse:
    """The strips of a Hertzian ellipse under a creepage."""

    def __init__(self, xi=0.0, eta=0.0, phi=0.0, mu=0.1, a=A, b=B, load=LOAD, strips=60):
        self.creepage, self.friction, self.load = (xi, eta, phi), mu, load
        self.a, self.b, self.width = a, b, 2.0 * b / strips
        self.y = (np.arange(strips) + 0.5) * self.width - b
        self.half_length = a * np.sqrt(1.0 - (self.y / b) ** 2)
        peak = 1.5 * load / (math.pi * a * b)
        self.bound_peak = mu * peak * self.half_length / a
        self.coefficients = creepage_coefficients(a / b, NU)
        self.moduli = amended_moduli(self.coefficients, a, b, SHEAR)
        three = flexibilities(self.coefficients, a, b, SHEAR)
        self.flexibility = one_flexibility(
            three.longitudinal, three.lateral, three.spin, xi, eta, phi * math.sqrt(a * b)
        )
        turning = -phi * self.y
        drive = xi * self.moduli.longitudinal + turning * self.moduli.spin_along
        self.motion = StripMotion(xi + turning, drive, eta, phi)

    def rows(self, points=50):
        """Return force along and across, moment and adhesion of every strip."""
        problem = self.half_length, self.bound_peak, self.motion, self.moduli
        return fastrip(*problem, self.flexibility, points)

    def totals(self, points=50):
        """Return Fx, Fy, Mz and P over V."""
        along, across, moment, _ = self.rows(points)
        xi, eta, phi = self.creepage
        sums = along.sum(), across.sum(), (moment - self.y * along).sum()
        work = -(xi * sums[0] + eta * sums[1] + phi * sums[2])
        return np.array([*sums, work]) * self.width

    def fields(self, points=401):
        """Return traction and slip, from the leading edge on."""
        return fastrip_fields(self.half_length, self.bound_peak, self.motion, self.moduli, points)


@pytest.mark.parametrize(("a", "b"), [(A, B), (3e-4, 3e-4), (1e-3, 2e-4)])
def test_small_creepage_meets_kalkers_coefficients(a, b):
    small = 1e-9
    kalker = creepage_coefficients(a / b, NU)
    shape = {"a": a, "b": b, "mu": 10.0, "strips": 2000}
    unit = SHEAR * a * b * small
    assert Ellipse(small, **shape).totals()[0] == pytest.approx(-kalker.c11 * unit, rel=1e-3)
    assert Ellipse(0.0, small, **shape).totals()[1] == pytest.approx(-kalker.c22 * unit, rel=1e-3)
    turning = Ellipse(0.0, 0.0, small, **shape).totals()
    assert turning[1] == pytest.approx(-kalker.c23 * unit * math.sqrt(a * b), rel=1e-3)
    assert turning[2] == pytest.approx(-kalker.c33 * unit * a * b, rel=1e-3, abs=0.0)


def test_long_contact_has_the_moduli_of_a_plane():
    ratio = 1e-7
    found = amended_moduli(creepage_coefficients(ratio, 0.3), ratio, 1.0, 1.0)
    assert found[:3] == pytest.approx((1.0 / 0.7, 1.0, 1.0 / 0.7), rel=1e-5)
    logarithm = math.log(16.0 / ratio) - 5.0
    assert found.spin_across == pytest.approx((1.0 + 0.3 * logarithm) / 0.7, rel=1e-5)


@pytest.mark.parametrize("axis", ["longitudinal", "lateral"])
def test_single_creepage_is_carters_closed_form_for_any_steps(axis):
    ellipse = Ellipse(5e-4) if axis == "longitudinal" else Ellipse(0.0, 5e-4)
    a, rise = ellipse.half_length, ellipse.bound_peak[0] / ellipse.half_length[0]
    d = np.minimum(0.5 * 5e-4 * getattr(ellipse.moduli, axis) / rise, a)
    expected = -0.5 * math.pi * rise * d * (2.0 * a - d)
    for points in (1, 7, 50):
        found = ellipse.rows(points)
        assert found[0 if axis == "longitudinal" else 1] == pytest.approx(expected, rel=1e-12)
        assert found[3] == pytest.approx(2.0 * (a - d), abs=1e-18)
    assert np.any(d < a)
    assert np.any(d == a)


def about_sliding_throughout(ellipse, number):
    """Return a strip just above and just below full sliding; None if it always slides."""

    def strip(factor):
        bound_peak = ellipse.bound_peak * factor
        return strip_of(number, ellipse.half_length, bound_peak, ellipse.motion, ellipse.moduli)

    a = ellipse.half_length[number]
    spin = abs(ellipse.creepage[2]) * ellipse.moduli.spin_across * a
    low, high = 0.5001 * spin / ellipse.bound_peak[number], 1e3  # psi is just below 1, or nothing
    if strip(low).shift < a:
        return None
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if strip(middle).shift >= a else (low, middle)
    return strip(low * (1.0 - 1e-9)), strip(high * (1.0 + 1e-9))


def test_direction_is_continuous_at_the_onset_of_full_sliding():
    rng, found = np.random.default_rng(2), []
    for xi, eta, phi in rng.normal(size=(30, 3)) * (5e-4, 5e-4, 1.0):
        ellipse = Ellipse(xi, eta, phi, a=1e-3, b=2e-4, strips=11)
        found.append(about_sliding_throughout(ellipse, 2))
    pairs = [pair for pair in found if pair is not None]
    assert len(pairs) > 15
    for sliding, adhering in pairs:
        assert sliding.shift == sliding.half_length > adhering.shift
        assert sliding.direction_x == pytest.approx(adhering.direction_x, abs=1e-5)
        assert sliding.direction_y == pytest.approx(adhering.direction_y, abs=1e-5)


def test_full_sliding_force_is_friction_times_load():
    ellipse = Ellipse(0.03, -0.04)
    for points in (1, 5, 50):
        *force, _, power = ellipse.totals(points)
        assert np.hypot(*force) == pytest.approx(30.0, rel=1e-3)
        assert force / np.hypot(*force) == pytest.approx([-0.6, 0.8], rel=2e-2)
        assert power == pytest.approx(30.0 * 0.05, rel=1e-3)
    slight = Ellipse(0.03, -0.04, mu=1e-10).totals()
    assert np.hypot(*slight[:2]) == pytest.approx(3e-8, rel=1e-3, abs=0.0)


SHAPE = {"a": "a_m", "b": "b_m", "load": "N_N", "mu": "mu"}


def from_contact(cases, *, published):
    """Return the relative error of the power against FaStrip of CONTACT.

    In the published version, C23 amends the plane moduli 1/(1 - nu) and 1 of both parts of spin.
    """
    powers = []
    for case in cases:
        shape = {key: case[name] for key, name in SHAPE.items()}
        creepage = case["xi"], case["eta"], case["phi_per_m"]
        ellipse = Ellipse(*creepage, **shape, strips=120)
        if published:
            excess = ellipse.moduli.spin_across / (1.0 - NU) - ellipse.moduli.spin_along
            drive = ellipse.motion.drive - excess * case["phi_per_m"] * ellipse.y
            ellipse.motion = ellipse.motion._replace(drive=drive)
        powers.append(ellipse.totals()[3])
    return np.array(powers) / [case["fastrip_P_over_V_N"] for case in cases] - 1.0


def test_few_steps_are_sufficient():
    ellipses = [
        Ellipse(*case) for case in ((6e-4, 5e-4, 0.05), (3e-4, -2e-4, 0.6), (0.0, 0.0, 0.8))
    ]
    powers = np.array([[e.totals(n)[3] for e in ellipses] for n in (10, 50, 250, 5000)])
    errors = np.abs(powers[:-1] / powers[-1] - 1.0).max(axis=1)
    assert np.all(np.diff(errors) < 0.0)
    assert errors[0] < 2.5e-4
    assert errors[1] < 4e-5


CREEPAGES = st.tuples(st.floats(-2e-3, 2e-3), st.floats(-2e-3, 2e-3), st.floats(-1.5, 1.5))


@settings(deadline=None, max_examples=60)
@given(CREEPAGES)
def test_traction_is_within_the_bound_and_slip_opposes_it(creepage):
    ellipse = Ellipse(*creepage, strips=11)
    t_x, t_y, s_x, s_y = ellipse.fields(201)
    place = np.linspace(1.0, -1.0, 201)[:, None]
    bound = ellipse.bound_peak * np.sqrt(np.maximum((1.0 - place) * (1.0 + place), 0.0))
    traction, slip = np.hypot(t_x, t_y), np.hypot(s_x, s_y)
    assert np.all(traction <= bound * (1.0 + 1e-9))
    assert np.all(np.abs(t_x * s_x + t_y * s_y + traction * slip) <= 1e-9 * traction * slip + 1e-30)
    assert np.allclose(traction[slip > 0.0], bound[slip > 0.0], rtol=1e-9)


@settings(deadline=None, max_examples=60)
@given(CREEPAGES)
def test_mirrored_contact_is_mirrored_and_power_is_positive(creepage):
    xi, eta, phi = creepage
    here, there = Ellipse(xi, eta, phi), Ellipse(xi, -eta, -phi)
    one, other = here.rows(), there.rows()[:, ::-1]
    scale = here.bound_peak.max() * here.a
    assert other[0] == pytest.approx(one[0], abs=1e-9 * scale)
    assert other[1] == pytest.approx(-one[1], abs=1e-9 * scale)
    assert here.totals()[3] >= -1e-12 * LOAD * max(map(abs, creepage))


@pytest.mark.parametrize("creepage", [(4e-4, 5e-4, 0.05), (2e-4, 0.0, 0.6), (5e-3, 5e-3, 0.1)])
def test_fields_integrate_to_the_sums(creepage):
    ellipse = Ellipse(*creepage)
    along, across, moment, _ = ellipse.rows(2000)
    t_x, t_y, *_ = ellipse.fields(4001)
    x = np.linspace(1.0, -1.0, 4001)[:, None] * ellipse.half_length
    scale = ellipse.bound_peak.max() * ellipse.a
    assert -trapezoid(t_x, x, axis=0) == pytest.approx(along, abs=1e-3 * scale)
    assert -trapezoid(t_y, x, axis=0) == pytest.approx(across, abs=1e-3 * scale)
    found = -trapezoid(x * t_y, x, axis=0)
    assert found == pytest.approx(moment, abs=1e-3 * scale * ellipse.a)


@pytest.mark.parametrize("creepage", [(3e-4, 2e-4, 0.05), (2e-4, -3e-4, 0.1), (-2e-4, 2e-4, 0.2)])
def test_direction_of_the_traction_follows_its_differential_equation(creepage):
    case, points = Ellipse(*creepage, strips=3), 2001
    fields, rows = case.fields(points)[:2], case.rows(5000)
    angles = np.arccos(np.linspace(1.0, -1.0, points))
    for j in range(3):
        strip = strip_of(j, case.half_length, case.bound_peak, case.motion, case.moduli)
        a, d = strip.half_length, strip.shift
        assert 0.1 * a < d < a
        onset, direction = math.acos(2.0 * d / a - 1.0), (strip.direction_x, strip.direction_y)

        def turn(q, theta, strip=strip, a=a):
            e = np.array([np.cos(theta[0]), np.sin(theta[0])])
            slip = slip_at(strip, a * math.cos(q), *e)
            give = e[1] ** 2 / strip.modulus_x + e[0] ** 2 / strip.modulus_y
            pull = slip[1] * e[0] - slip[0] * e[1]
            return [-pull / (2.0 * strip.rise * a * math.sin(q) * give)]

        sliding = np.flatnonzero((angles > onset) & (angles < 3.1))
        span, start = (onset, 3.1), [math.atan2(direction[1], direction[0])]
        solved = solve_ivp(turn, span, start, t_eval=angles[sliding], rtol=1e-9, atol=1e-10)
        bound = strip.rise * a * np.sin(angles[sliding])
        known = bound * np.array([np.cos(solved.y[0]), np.sin(solved.y[0])])
        error = np.abs(fields[:, sliding, j] - known).max()
        assert error < 2e-5 * bound.max()
        x = a * np.linspace(1.0, -1.0, points)
        lateral = fields[1, :, j]
        expected = [*-trapezoid(fields[:, :, j], x, axis=1), -trapezoid(x * lateral, x)]
        np.testing.assert_allclose(rows[:2, j], expected[:2], atol=1e-4 * bound.max() * a)
        assert rows[2, j] == pytest.approx(expected[2], abs=1e-4 * bound.max() * a * a)


def test_strips_without_adhesion_by_spin_are_solved_by_fastsim():
    ellipse = Ellipse(1e-3, 5e-4, 20.0)
    found = ellipse.rows()  # first, so that no memory holds what is expected
    share = 1.0 / ellipse.flexibility
    expected = march(
        ellipse.half_length,
        ellipse.bound_peak,
        True,
        ellipse.motion.longitudinal * share,
        5e-4 * share,
        20.0 * share,
        50,
    )
    assert found == pytest.approx(expected, rel=1e-12)
    assert not ellipse.fields().any()


def test_strips_without_contact_friction_or_creepage_have_no_force():
    still = Ellipse()
    assert not still.rows()[:3].any()
    assert still.rows()[3] == pytest.approx(2.0 * still.half_length)
    moving = Ellipse(1e-3, 1e-4, 0.1)
    moving.half_length[:5] = 0.0
    moving.bound_peak[10:15] = 0.0
    for found in (moving.rows(), moving.fields().reshape(-1, 60)):
        assert np.isfinite(found).all()
        assert not found[:, :5].any()
        assert not found[:, 10:15].any()


@pytest.mark.parametrize(
    "creepage", [(8e-4, 0.0, 0.0), (5e-4, 4e-4, 0.0), (5e-4, 3e-4, 0.4), (-2e-2, 1e-2, 0.5)]
)
def test_sums_of_few_strips_are_integrals_of_their_fields(creepage):
    case, points = Ellipse(*creepage, strips=2), 601
    rows, (along, across, _, _) = case.rows(400), case.fields(points)
    x = np.linspace(1.0, -1.0, points)[:, None] * case.half_length
    forces = [-trapezoid(traction, x, axis=0) for traction in (along, across, x * across)]
    scale = np.hypot(*rows[:2]).max()
    np.testing.assert_allclose(rows[:2], forces[:2], atol=2e-3 * scale)
    np.testing.assert_allclose(rows[2], forces[2], atol=2e-3 * scale * case.half_length.max())
    bound = case.bound_peak * np.sqrt(np.maximum(1.0 - (x / case.half_length) ** 2, 0.0))
    sliding = (np.hypot(along, across) > bound * (1.0 - 1e-9)) & (bound > 0.0)
    assert sliding.any()
    assert (np.hypot(along, across) <= bound * (1.0 + 1e-9)).all()
