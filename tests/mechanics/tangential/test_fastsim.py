"""FASTSIM against a plain implementation, closed forms, energy balance, order of convergence."""

import math
from typing import NamedTuple

import numpy as np
import pytest
import scipy.special
from hypothesis import given, settings, strategies as st

from tests.mechanics.tangential.kalker_closed_form import closed_form_parabolic
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.mechanics.tangential.fastsim import (
    FORCE_X,
    FORCE_Y,
    ROWS,
    WORK,
    bound_shape,
    closed_form,
    closed_form_into,
    end_weights,
    march,
    march_fields,
    march_into,
    place_of,
)
from wearsim.mechanics.tangential.kalker_coefficients import flexibilities, line_limit_coefficients

SHEAR = 200e9 / 2.6
SPEED = 1000.0 * 2.0 * math.pi / 60.0 * 25e-3


class Case(NamedTuple):
    """Kalker's ellipse cut into strips, under one creepage."""

    y: np.ndarray
    half_length: np.ndarray
    bound_peak: np.ndarray
    elliptic: bool
    slip_x: np.ndarray
    eta: float
    phi: float
    flex: object
    spacing: float

    @property
    def arguments(self):
        spin_part = -self.phi * self.y
        mean = self.slip_x - spin_part
        return (
            self.half_length,
            self.bound_peak,
            self.elliptic,
            mean / self.flex.longitudinal + spin_part / self.flex.spin,
            self.eta / self.flex.lateral,
            self.phi / self.flex.spin,
        )

    def power(self, sums):
        work = self.slip_x * sums[0] + self.eta * sums[1] + self.phi * sums[2]
        return -SPEED * work.sum() * self.spacing


def rig(strips=50, xi=1e-3, eta=0.0, phi=0.0, elliptic=False, curvatures=(45.0, 1.0)):
    patch = hertz(*curvatures, 300.0, SHEAR / 0.7)
    y = patch.b * ((np.arange(strips) + 0.5) * 2.0 / strips - 1.0)
    section = 1.0 - (y / patch.b) ** 2
    peak = 2.0 * 300.0 / (math.pi * patch.a * patch.b) * section
    if elliptic:
        peak = patch.peak_pressure * np.sqrt(section)
    return Case(
        y=y,
        half_length=patch.a * np.sqrt(section),
        bound_peak=0.1 * peak,
        elliptic=elliptic,
        slip_x=xi - phi * y,
        eta=eta,
        phi=phi,
        flex=flexibilities(
            line_limit_coefficients(patch.a / patch.b, 0.3), patch.a, patch.b, SHEAR
        ),
        spacing=2.0 * patch.b / strips,
    )


def edge(points, elliptic):
    """Return the weight of the last inner point, which integrates a parabola exactly."""
    place = 1.0 - 2.0 * np.arange(1, points) / points
    if elliptic:
        return 1.0 - scipy.special.zeta(-0.5) * math.sqrt(points / (points - 1.0))
    missing = 4.0 / 3.0 - 2.0 / points * (1.0 - place**2).sum()
    return 1.0 + 0.25 * points * missing / (1.0 - place[0] ** 2)


def weights(sticks, elliptic):
    """Return the weights of the points of a march, (points, strips); `sticks` marks adhesion."""
    points = len(sticks)
    found = [end_weights(k, points, elliptic) for k in range(1, points + 1)]
    sticking, sliding = np.array(found).T[:, :, None]
    return np.where(sticks, sticking, sliding)


def reference_march(
    half_length, bound_peak, elliptic, gradient_x, gradient_y, gradient_spin, points
):
    """Integrate one strip after another without vectorisation."""
    sums = np.zeros((4, len(half_length)))
    for j, a in enumerate(half_length):
        traction = np.zeros(2)
        dx = 2.0 * a / points
        for k in range(points):
            x = a - (k + 1) * dx
            middle = x + 0.5 * dx
            rise = np.array([gradient_x[j], gradient_y + gradient_spin * middle])
            traction = traction - rise * dx
            shape = max(1.0 - (x / a) ** 2, 0.0) if k + 1 < points else 0.0
            bound = bound_peak[j] * (math.sqrt(shape) if elliptic else shape)
            size = math.hypot(*traction)
            if size > bound:
                traction = traction * (bound / size)
            else:
                sums[3, j] += dx
            weight = dx
            if k == 0:
                weight *= edge(points, elliptic) if size > bound else 13.0 / 12.0
            elif k == points - 2:
                weight *= edge(points, elliptic)
            sums[:3, j] += np.array([traction[0], traction[1], x * traction[1]]) * weight
    return sums


def local(case, friction, first=0):
    """Integrate under a friction field; the bounds of `case` include a coefficient of 0.1."""
    sums = np.empty((ROWS, len(case.half_length)))
    half_length, bound_peak, elliptic, *gradients = case.arguments
    flexible = case.flex.longitudinal, case.flex.lateral
    march_into(
        len(half_length),
        half_length,
        bound_peak / 0.1,
        friction,
        first,
        elliptic,
        *gradients,
        *flexible,
        len(friction),
        sums,
        None,
    )
    return sums


CREEPAGES = [
    {"xi": 1e-3},
    {"xi": -4e-4, "eta": 5e-4, "phi": 0.5},
    {"xi": 0.0, "eta": 0.0, "phi": 2.0},
    {"xi": 1e-4, "eta": -2e-3, "phi": 20.0},
]


@pytest.mark.parametrize("elliptic", [False, True])
@pytest.mark.parametrize("problem", CREEPAGES)
def test_march_equals_its_reference_implementation(problem, elliptic):
    case = rig(strips=11, elliptic=elliptic, **problem)
    found, expected = march(*case.arguments, 24), reference_march(*case.arguments, 24)
    scale = np.abs(expected).max(axis=1, keepdims=True) + 1e-300
    assert found / scale == pytest.approx(expected / scale, abs=1e-10)


@pytest.mark.parametrize("elliptic", [False, True])
@pytest.mark.parametrize("problem", CREEPAGES)
def test_fields_integrate_to_the_sums_of_the_march(problem, elliptic):
    case = rig(strips=11, elliptic=elliptic, **problem)
    sums = march(*case.arguments, 40)
    traction_x, traction_y, cut_x, cut_y = march_fields(*case.arguments, np.ones((40, 11)))
    place = np.linspace(1.0, -1.0, 41)[:, None] * case.half_length
    dx = case.half_length / 20.0
    sticks = (cut_x == 0.0) & (cut_y == 0.0)
    counted = weights(sticks[1:], elliptic)
    for found, integrand in (
        (sums[0], traction_x),
        (sums[1], traction_y),
        (sums[2], place * traction_y),
    ):
        expected = (counted * integrand[1:]).sum(axis=0) * dx
        assert found == pytest.approx(
            expected, rel=1e-9, abs=1e-10 * np.abs(integrand).max() * dx[5]
        )
    assert sums[3] == pytest.approx(sticks[1:].sum(axis=0) * dx, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("elliptic", [False, True])
@pytest.mark.parametrize("problem", CREEPAGES)
def test_uniform_friction_field_equals_a_coefficient(problem, elliptic):
    case = rig(strips=11, elliptic=elliptic, **problem)
    found, expected = local(case, np.full((24, 11), 0.1)), march(*case.arguments, 24)
    scale = np.abs(expected).max(axis=1)
    for row in range(WORK):
        assert found[row] == pytest.approx(expected[row], abs=1e-14 * scale[row])


@pytest.mark.parametrize("problem", CREEPAGES)
def test_sums_under_local_friction_integrate_its_fields(problem):
    case = rig(strips=11, **problem)
    friction = np.random.default_rng(0).uniform(0.02, 0.2, (30, 14))
    half_length, bound_peak, elliptic, *gradients = case.arguments
    own = np.ascontiguousarray(friction[:, 2:13])
    inside = march_fields(half_length, bound_peak / 0.1, elliptic, *gradients, own)
    size = np.hypot(inside[0], inside[1])[1:]
    place = np.linspace(1.0, -1.0, 31)[1:, None]
    bound = own * (1.0 - place**2) * bound_peak / 0.1
    assert np.all(size <= bound * (1.0 + 1e-12) + 1e-3)
    found, dx = local(case, friction, first=2), half_length / 15.0
    scale = size.max() * dx.max()
    counted = weights(((inside[2] == 0.0) & (inside[3] == 0.0))[1:], elliptic)
    for force, traction in zip((found[FORCE_X], found[FORCE_Y]), inside[:2, 1:], strict=True):
        assert force == pytest.approx((counted * traction).sum(axis=0) * dx, abs=1e-12 * scale)
    expected = element_sum(inside, case.flex.longitudinal, case.flex.lateral, 1.0)
    assert found[WORK] == pytest.approx(expected, rel=1e-10, abs=1e-12 * expected.max())


@pytest.mark.parametrize("elliptic", [False, True])
@pytest.mark.parametrize("points", [2, 3, 8, 13, 50])
def test_end_weights_integrate_the_bound(points, elliptic):
    counted = [end_weights(k, points, elliptic)[1] for k in range(1, points + 1)]
    shapes = [bound_shape(place_of(k, points), elliptic) for k in range(1, points + 1)]
    integrand = math.pi / 2.0 if elliptic else 4.0 / 3.0
    # the next correction for the square root is neglected
    missing = 0.07 * points**-2.5 if elliptic else 1e-14
    assert 2.0 / points * np.dot(counted, shapes) == pytest.approx(integrand, rel=missing)


def test_full_sliding_integrates_friction_times_pressure():
    # mu = 0.1 (1 + s^2) with s = x/a: the integral of (1 - s^2)(1 + s^2) is 8/5
    case = rig(strips=11, xi=0.5)
    place = np.linspace(1.0, -1.0, 401)[1:, None]
    sums = local(case, 0.1 * (1.0 + place**2) + np.zeros(11))
    assert sums[FORCE_X] == pytest.approx(-1.6 * case.bound_peak * case.half_length, rel=1e-4)


def test_traction_is_within_the_bound_and_zero_at_both_edges():
    case = rig(strips=11, eta=5e-4, phi=3.0)
    traction_x, traction_y, _, _ = march_fields(*case.arguments, np.ones((40, 11)))
    shape = 1.0 - np.linspace(1.0, -1.0, 41)[:, None] ** 2
    size = np.hypot(traction_x, traction_y)
    assert np.all(size <= shape * case.bound_peak * (1.0 + 1e-12))
    assert np.all(size[[0, -1]] == 0.0)


@pytest.mark.parametrize("elliptic", [False, True])
@pytest.mark.parametrize("creepage", [(1e-5, 0.0), (3e-4, 2e-4), (1e-3, 0.0), (0.0, 5e-3)])
def test_march_converges_to_the_closed_form_without_spin(creepage, elliptic):
    case = rig(strips=7, xi=creepage[0], eta=creepage[1], elliptic=elliptic)
    found, expected = march(*case.arguments, 20000), closed_form(*case.arguments[:5])
    force = np.hypot(expected[0], expected[1]).max()
    lengths = 2.0 * case.half_length
    scales = (force, force, force * case.half_length.max(), lengths)
    for one, other, scale in zip(found, expected, scales, strict=True):
        assert np.max(np.abs(one - other) / scale) < 2e-4


@pytest.mark.parametrize("elliptic", [False, True])
def test_few_elements_are_close_to_the_closed_form(elliptic):
    case = rig(strips=3, xi=3e-4, eta=2e-4, elliptic=elliptic)
    found, expected = march(*case.arguments, 500), closed_form(*case.arguments[:5])
    scale = np.hypot(expected[0], expected[1]).max()
    np.testing.assert_allclose(found[:2], expected[:2], atol=8e-3 * scale)
    np.testing.assert_allclose(found[2], expected[2], atol=8e-3 * scale * case.half_length.max())
    np.testing.assert_allclose(found[3], expected[3], atol=8e-3 * case.half_length.max())
    # tractions are proportional to bound and gradients
    length, bound, _, *gradients = case.arguments[:5]
    small = closed_form(length, 1e-12 * bound, elliptic, *(1e-12 * one for one in gradients))
    np.testing.assert_allclose(small[:3], 1e-12 * expected[:3], rtol=1e-10)
    np.testing.assert_allclose(small[3], expected[3], rtol=1e-10)


def test_strips_without_contact_or_creepage_have_no_force():
    half_length, peak = np.array([0.0, 1e-4]), np.array([0.0, 1e8])
    none = np.zeros(2)
    for found in (
        march(half_length, peak, False, none, 0.0, 0.0, 10),
        closed_form(half_length, peak, False, none, 0.0),
    ):
        assert np.all(found[:3] == 0.0)
        assert found[3] == pytest.approx([0.0, 2e-4])
    # rows of an earlier contact are overwritten
    former = np.full((ROWS, 3), 7.0)
    closed_form_into(2, half_length, peak, False, none, 0.0, former)
    assert former[:3].tolist() == [[0.0, 0.0, 7.0]] * 3
    former = np.full((ROWS, 3), 7.0)
    fields = 0.0, 0.0, 10, former, None
    march_into(2, half_length, peak, None, 0, False, none, 0.0, 0.0, *fields)
    assert former[:3].tolist() == [[0.0, 0.0, 7.0]] * 3


@pytest.mark.parametrize("strip", [0.1, 0.5, 0.9])
def test_closed_form_equals_kalkers_formula(strip):
    patch = hertz(45.0, 1.0, 300.0, SHEAR / 0.7)
    flex = 8.0 * patch.a / (3.0 * math.pi**2 / 2.8 * SHEAR)
    half = patch.a * math.sqrt(1.0 - strip**2)
    peak = 2.0 * 300.0 / (math.pi * patch.a * patch.b)
    kappa = 1e-3 * patch.a**2 / (flex * 0.1 * peak)
    assert kappa == pytest.approx(0.15281e-3, rel=1e-4)
    expected = 1e-3 / flex * (2.0 * half**2 - half * kappa + kappa**2 / 6.0)
    if kappa > 2.0 * half:
        expected = 4.0 / 3.0 * 0.1 * peak * half**3 / patch.a**2
    found = closed_form_parabolic(patch.a, patch.b, 300.0, 0.1, 1e-3, flex, np.array([half]))
    assert found[0] == pytest.approx(expected, rel=1e-12)


def test_closed_form_power_of_the_mean_problem():
    case = rig(strips=2000)
    sums = closed_form(*case.arguments[:5])
    assert case.power(sums) == pytest.approx(0.073873, rel=1e-5)
    assert -sums[0].sum() * case.spacing / 30.0 == pytest.approx(0.94057, rel=1e-5)


def test_50_by_50_points_meet_the_closed_form_within_1e_3():
    case = rig(strips=50)
    assert case.power(march(*case.arguments, 50)) == pytest.approx(0.073873, rel=1e-3)


def element_sum(fields, longitudinal, lateral, rolling_speed):
    """Return the dissipation as a sum over elements of their new traction times their slip."""
    traction_x, traction_y, excess_x, excess_y = fields
    work = longitudinal * traction_x * excess_x + lateral * traction_y * excess_y
    return rolling_speed * work.sum(axis=0)


def errors(points, **problem):
    """Return the relative errors of the rigid slip's work and of the element sum."""
    fine = rig(strips=800, **problem)
    exact = fine.power(march(*fine.arguments, 3200))
    work, textbook = [], []
    for n in points:
        case = rig(strips=n, **problem)
        work.append(case.power(march(*case.arguments, n)) / exact - 1.0)
        fields = march_fields(*case.arguments, np.ones((n, n)))
        flex = case.flex
        total = element_sum(fields, flex.longitudinal, flex.lateral, SPEED).sum() * case.spacing
        textbook.append(total / exact - 1.0)
    return np.array(work), np.array(textbook)


def order(points, values):
    return -np.polyfit(np.log(points), np.log(np.abs(values)), 1)[0]


@pytest.mark.parametrize(
    "problem", [{}, {"eta": 5e-4}, {"eta": 5e-4, "phi": 0.05}], ids=["one-way", "lateral", "spin"]
)
def test_rigid_slip_work_is_second_order_and_element_sum_first(problem):
    points = np.array([10, 20, 50, 100, 200])
    work, textbook = errors(points, **problem)
    # the error at the onset of slip has either sign, so that it partly cancels over the strips
    assert np.all(np.abs(work) * points**2 < 0.25)
    assert order(points, textbook) == pytest.approx(1.0, abs=0.1)
    assert np.all(textbook < 0.0)


def test_few_steps_are_sufficient_where_spin_turns_the_slip():
    for count, worst in ((6, 1e-2), (10, 3.5e-3), (16, 1.2e-3), (40, 3e-4)):
        work, _ = errors(np.array([count]), xi=-4e-4, eta=5e-4, phi=0.5)
        assert abs(work[0]) < worst


def test_grid_errors_are_the_recorded_ones():
    work, textbook = errors(np.array([10, 20, 50, 200]))
    assert textbook == pytest.approx([-0.165, -0.082, -0.032, -0.008], abs=5e-4)
    assert np.all(np.abs(work) < [2e-3, 3e-4, 5e-5, 2e-6])


@settings(deadline=None, max_examples=30)
@given(st.floats(-2e-3, 2e-3), st.floats(-2e-3, 2e-3), st.floats(-5.0, 5.0), st.booleans())
def test_mirrored_contact_has_mirrored_tractions(xi, eta, phi, elliptic):
    # y to -y: lateral creepage, spin, lateral force and moment change sign
    one, other = (
        rig(strips=9, xi=xi, eta=sign * eta, phi=sign * phi, elliptic=elliptic) for sign in (1, -1)
    )
    found, mirrored = march(*one.arguments, 20), march(*other.arguments, 20)[:, ::-1]
    signs = np.array([1.0, -1.0, -1.0, 1.0])[:, None]
    scale = np.abs(found).max(axis=1, keepdims=True) + 1e-30
    assert found[:3] / scale[:3] == pytest.approx(signs[:3] * mirrored[:3] / scale[:3], abs=1e-9)


@settings(deadline=None, max_examples=30)
@given(st.floats(-2e-3, 2e-3), st.floats(-2e-3, 2e-3), st.floats(-5.0, 5.0), st.booleans())
def test_power_is_between_zero_and_full_sliding(xi, eta, phi, elliptic):
    case = rig(strips=9, xi=xi, eta=eta, phi=phi, elliptic=elliptic)
    power = case.power(march(*case.arguments, 60))
    # traction bound at every point times the rigid slip there
    place = np.linspace(-1.0, 1.0, 601)[:, None]
    shape = 1.0 - place**2
    slip = np.hypot(case.slip_x, eta + phi * place * case.half_length)
    bound = case.bound_peak * (np.sqrt(shape) if elliptic else shape)
    most = SPEED * (bound * slip).sum(axis=0) @ case.half_length / 300.0 * case.spacing
    assert -1e-3 * most - 1e-18 <= power <= most * (1.0 + 1e-3) + 1e-18
