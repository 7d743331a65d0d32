"""Batched Hertz-FASTSIM contacts equal single ones, for any order and batch."""

import math

import numpy as np
import pytest

from wearsim.mechanics.hertz.ellipse import given_ellipse, hertz
from wearsim.mechanics.hertz.parabola_fit import (
    CONVERGED,
    LEAVES_STRIPS,
    NO_CURVATURE,
    TOO_FEW_STRIPS,
    hertz_on_profile,
)
from wearsim.mechanics.hertz.patches import (
    NO_GAP,
    NO_LOAD,
    Bodies,
    Patches,
    cut_into_strips,
    find_patches,
    half_lengths,
)
from wearsim.mechanics.tangential.fastsim import march
from wearsim.mechanics.tangential.hertz_fastsim_batch import (
    ALWAYS,
    EXACT,
    GIVEN,
    LINE_LIMIT,
    NEVER,
    NO_LIMIT,
    NOT_FINITE,
    TABLE,
    ContactInputs,
    ContactResults,
    Theory,
    solve_contacts,
)
from wearsim.mechanics.tangential.kalker_coefficients import (
    CreepageCoefficients,
    coefficient,
    flexibilities,
    one_flexibility,
    short_limit,
    spline,
)
from wearsim.types import Grid

SHEAR, NU = 200e9 / 2.6, 0.3
MODULUS = SHEAR / (1.0 - NU)
GRID = Grid.spanning(-4e-3, 4e-3, 81)
Y = GRID.y
CONTACTS = 40
RANDOM = np.random.default_rng(2)
LOADS = RANDOM.uniform(150.0, 450.0, CONTACTS)
GROOVE = Y**2 + 0.6 * np.maximum(3e-6 - (Y - 2e-4) ** 2, 0.0)
GAPS = np.array([Y**2, 2e-6 + 1.3 * (Y - 4e-4) ** 2, GROOVE])
ROW = RANDOM.integers(0, 3, CONTACTS)


def bodies(contacts, a=0.0, b=0.0, curvature_x=45.0):
    return Bodies(Y, GRID.spacing, np.full(contacts, curvature_x), MODULUS, a, b, 1e-10, 200)


def patches_of(contacts):
    return Patches(*np.zeros((6, contacts)), *np.zeros((2, contacts), dtype=np.int64))


def find(gaps=GAPS, row=ROW, loads=LOADS, **given):
    patches = patches_of(len(row))
    find_patches(bodies(len(row), **given), gaps, row, loads, patches)
    return patches


def test_every_patch_equals_the_single_hertz_solution():
    patches = find()
    assert np.all(patches.status == CONVERGED)
    for k, load in enumerate(LOADS):
        gap = GAPS[ROW[k]]
        curvature, b, centre, height, iterations, _ = hertz_on_profile(
            Y, gap, 45.0, load, MODULUS, 1e-10, 200
        )
        patch = hertz(45.0, curvature, load, MODULUS)
        assert (patches.a[k], patches.b[k]) == (patch.a, patch.b)
        assert patches.b[k] == pytest.approx(b, rel=1e-9)
        assert patches.ratio[k] == pytest.approx(patch.a / patch.b, rel=1e-14)
        assert patches.peak_pressure[k] == patch.peak_pressure
        assert patches.approach[k] == patch.approach + height
        assert (patches.centre[k], patches.iterations[k]) == (centre, iterations)


@pytest.mark.parametrize("curvatures", [(45.0, 1.0), (1.0, 1.0), (1.0, 8.0)])
def test_parabola_has_the_patch_of_its_curvature(curvatures):
    gap = (3e-6 + curvatures[1] * (Y - 1e-4) ** 2)[None, :]
    load = np.array([300.0])
    patches = find(gap, np.zeros(1, dtype=np.int64), load, curvature_x=curvatures[0])
    patch = hertz(*curvatures, 300.0, MODULUS)
    assert patches.iterations[0] == 1
    assert (patches.a[0], patches.b[0]) == pytest.approx((patch.a, patch.b), rel=1e-13, abs=0.0)
    assert patches.ratio[0] == pytest.approx(patch.a / patch.b, rel=1e-13)
    assert patches.approach[0] == pytest.approx(patch.approach + 3e-6, rel=1e-13, abs=0.0)
    assert patches.centre[0] == pytest.approx(1e-4, rel=1e-11, abs=0.0)


def test_prescribed_patch_keeps_its_axes_under_any_load():
    patches = find(a=2e-4, b=2e-3)
    assert np.all(patches.a == 2e-4)
    assert np.all(patches.b == 2e-3)
    for k, load in enumerate(LOADS):
        expected = given_ellipse(2e-4, 2e-3, load, MODULUS)
        assert patches.peak_pressure[k] == expected.peak_pressure


@pytest.mark.parametrize(
    ("gap", "load", "status"),
    [
        (-(Y**2), 300.0, NO_CURVATURE),
        (1e-2 * Y**2, 300.0, LEAVES_STRIPS),
        ((Y - 3.5e-3) ** 2, 300.0, LEAVES_STRIPS),
        (1e6 * Y**2, 300.0, TOO_FEW_STRIPS),
        (np.where(Y > 1e-3, np.inf, Y**2), 300.0, NO_GAP),
        (Y**2, 0.0, NO_LOAD),
        (Y**2, math.nan, NO_LOAD),
    ],
)
def test_failed_contact_has_a_status_and_does_not_affect_others(gap, load, status):
    gaps, row = np.array([Y**2, gap]), np.array([0, 1, 0])
    patches = find(gaps, row, np.array([300.0, load, 300.0]))
    assert patches.status.tolist() == [CONVERGED, status, CONVERGED]
    assert patches.b[0] == patches.b[2] > 0.0
    halves = half_lengths(bodies(3), patches, np.array([300.0, load, 300.0]))
    assert not halves[1].any()
    assert np.array_equal(halves[0], halves[2])


def theory(closed_form=NEVER, kalker=TABLE, element_sum=False, points=24, single=False):
    tables = spline(0), spline(1), spline(2)
    return Theory(
        SHEAR, NU, False, closed_form, element_sum, points, single, kalker, np.zeros(3), tables
    )  # fmt: skip


def operating_points(chosen=slice(None), radius=None):
    random = np.random.default_rng(5)
    numbers = random.normal(size=(3, CONTACTS)) * [[4e-4], [5e-4], [0.1]]
    friction = random.uniform(0.05, 0.15, (CONTACTS, 1, 1))
    columns = [LOADS, 1e-3 + numbers[0], numbers[1], numbers[2], friction]
    speed, none = np.full(CONTACTS, 2.6)[chosen], np.zeros((0, len(Y)))
    arms = none if radius is None else np.broadcast_to(radius, (CONTACTS, len(Y)))[chosen].copy()
    return ContactInputs(*(column[chosen] for column in columns), False, none, speed, arms)


def solve(options, inputs, row=ROW, gaps=GAPS, **given):
    found = ContactResults(*np.zeros((3, len(row), len(Y))), *np.zeros((6, len(row))))
    patches = patches_of(len(row))
    failed = solve_contacts(bodies(len(row), **given), options, gaps, row, inputs, patches, found)
    return failed, found, patches


OPTIONS = [
    {},
    {"closed_form": EXACT},
    {"closed_form": ALWAYS},
    {"kalker": LINE_LIMIT},
    {"element_sum": True},
]


@pytest.mark.parametrize("options", OPTIONS)
def test_result_is_bitwise_independent_of_order_and_batch(options):
    options = theory(**options)
    failed, found, _ = solve(options, operating_points())
    assert failed == CONTACTS
    order = np.random.default_rng(1).permutation(CONTACTS)[:25]
    _, other, _ = solve(options, operating_points(order), ROW[order])
    copied = GAPS[ROW]
    _, separate, _ = solve(options, operating_points(), np.arange(CONTACTS), copied)
    for name in ContactResults._fields:
        assert np.array_equal(getattr(found, name)[order], getattr(other, name)), name
        assert np.array_equal(getattr(found, name), getattr(separate, name)), name


@pytest.mark.parametrize("closed_form", [NEVER, EXACT])
def test_power_is_the_work_of_forces_and_moment(closed_form):
    inputs = operating_points()
    _, found, _ = solve(theory(closed_form), inputs)
    work = inputs.longitudinal * found.force_x + inputs.lateral * found.force_y
    expected = -2.6 * (work + inputs.spin * found.spin_moment)
    assert found.power == pytest.approx(expected, rel=1e-12)
    assert found.dissipation.sum(axis=1) * GRID.spacing == pytest.approx(found.power, rel=1e-12)
    assert found.line_load.sum(axis=1) * GRID.spacing == pytest.approx(LOADS, rel=1e-12)


def test_torque_is_the_force_times_its_lever_arm():
    _, found, _ = solve(theory(EXACT), operating_points(radius=0.02))
    assert found.torque == pytest.approx(-0.02 * found.force_x, rel=1e-12)
    _, tilted, _ = solve(theory(EXACT), operating_points(radius=0.02 + 0.1 * Y))
    arm = tilted.torque / -found.force_x - 0.02
    assert np.abs(arm).max() < 0.1 * np.abs(Y).max()
    assert np.all(arm != 0.0)


def test_first_failed_contact_is_returned():
    inputs = operating_points()
    inputs.lateral[[7, 9]] = math.nan
    failed, _, patches = solve(theory(), inputs)
    assert (failed, patches.status[7]) == (7, NOT_FINITE)
    gap = 8.0 * Y[None, :] ** 2
    failed, _, patches = solve(
        theory(kalker=LINE_LIMIT),
        operating_points(),
        np.zeros(CONTACTS, np.int64),
        gap,
        curvature_x=1.0,
    )
    assert (failed, patches.status[0]) == (0, NO_LIMIT)
    row = np.where(np.arange(CONTACTS) == 5, 3, ROW)
    failed, found, patches = solve(theory(), operating_points(), row, np.vstack([GAPS, -(Y**2)]))
    assert (failed, patches.status[5]) == (5, NO_CURVATURE)
    assert not found.power[5:].any()


def full_slip(friction, variation=None, spin=0.0, lateral=0.0, carried=False, **options):
    """Return the results of one contact with creepages far beyond those of adhesion."""
    none = np.zeros((0, len(Y)))
    one = [np.array([value]) for value in (300.0, 0.2, lateral, spin)]
    field = np.asarray(friction, dtype=float).reshape(1, *np.shape(friction))
    varied = none if variation is None else variation[None]
    inputs = ContactInputs(*one, field, carried, varied, np.array([2.0]), none)
    failed, found, patches = solve(theory(**options), inputs, np.zeros(1, np.int64), GAPS[1:2])
    assert failed == 1
    return found, patches


def bounds_of(patches):
    """Return the integral along each strip of a bound that is parabolic over the patch [N/m]."""
    b = patches.b[0]
    section = np.maximum(1.0 - ((Y - patches.centre[0]) / b) ** 2, 0.0)
    return 300.0 * 8.0 / (3.0 * np.pi * b) * section**1.5


@pytest.mark.parametrize("options", [{}, {"closed_form": ALWAYS}, {"single": True}])
def test_forces_in_full_slip_are_friction_times_load(options):
    found, _ = full_slip([[0.1]], **options)
    assert found.force_x[0] == pytest.approx(-30.0, rel=1e-3)
    assert found.power[0] == pytest.approx(2.0 * 0.2 * 30.0, rel=1e-3)
    assert found.adhesion_fraction[0] < 0.02
    slope = 0.02 * Y / Y[-1]
    local, patches = full_slip([[0.1]], slope, **options)
    load, bound = local.line_load[0], bounds_of(patches)
    creepage = 0.2 + slope - (slope @ load) / load.sum()
    inside = local.half_length[0] > 0.5 * local.half_length[0].max()
    assert local.dissipation[0][inside] == pytest.approx(
        (2.0 * creepage * 0.1 * bound)[inside], rel=0.02
    )
    # of several material points the mean counts, and along a strip the integral over the patch
    carried, _ = full_slip([[0.05], [0.15]], carried=True, **options)
    assert carried.force_x[0] == pytest.approx(-30.0, rel=1e-3)
    along, _ = full_slip(np.full((24, len(Y)), 0.1), **options)
    assert along.force_x[0] == pytest.approx(-30.0, rel=2e-2)
    strips = 0.1 + 0.05 * Y / Y[-1]
    across, patches = full_slip(strips[None], **options)
    assert across.force_x[0] == pytest.approx(-(strips @ bound) * GRID.spacing, rel=1e-3)
    assert patches.centre[0] == pytest.approx(4e-4, rel=1e-9)


def test_spin_varies_the_creepage_about_its_mean_by_load():
    found, patches = full_slip([[0.1]], spin=10.0, single=True)
    load = found.line_load[0]
    slope = -10.0 * (Y - (Y @ load) / load.sum())
    inside = found.half_length[0] > 0.7 * found.half_length[0].max()
    assert found.dissipation[0][inside] == pytest.approx(
        (2.0 * (0.2 + slope) * 0.1 * bounds_of(patches))[inside], rel=0.02
    )
    lateral, _ = full_slip([[0.1]], lateral=-0.2, single=True)
    assert lateral.force_y[0] == pytest.approx(30.0 / math.sqrt(2.0), rel=0.05)
    assert lateral.force_x[0] == pytest.approx(-30.0 / math.sqrt(2.0), rel=0.05)


def test_single_flexibility_is_that_of_the_creepages_and_the_spin():
    none = np.zeros((0, len(Y)))
    one = [np.array([value]) for value in (300.0, 2e-5, 0.0, 0.3)]
    friction = np.full((1, 1, 1), 1e3)
    inputs = ContactInputs(*one, friction, False, none, np.array([2.0]), none)
    row = np.zeros(1, np.int64)
    _, found, patches = solve(theory(single=True, points=200), inputs, row, GAPS[1:2])
    a, b = patches.a[0], patches.b[0]
    values = [coefficient(which, a / b, NU, spline(which)) for which in range(3)]
    three = flexibilities(CreepageCoefficients(*values, math.nan), a, b, SHEAR)
    length = one_flexibility(*three, 2e-5, 0.0, 0.3 * math.sqrt(a * b))
    # without slip the traction grows from the leading edge, by the creepage over the flexibility
    assert found.force_x[0] == pytest.approx(-2e-5 / length * 8.0 / 3.0 * a * a * b, rel=2e-2)
    assert found.adhesion_fraction[0] == pytest.approx(1.0, rel=1e-2)
    failed, _, patches = solve(theory(kalker=GIVEN), inputs, row, GAPS[1:2])
    assert (failed, patches.status[0]) == (0, NO_LIMIT)  # coefficients of zero


@pytest.mark.parametrize("elliptic", [False, True])
@pytest.mark.parametrize(("xi", "eta", "phi"), [(4e-4, -2e-4, 0.0), (1e-3, 1e-4, 1.0)])
def test_strips_have_the_tractions_of_march_and_their_work(elliptic, xi, eta, phi):
    friction, radius = 0.1 + 20.0 * Y, 0.02 + Y
    one = [np.array([value]) for value in (300.0, xi, eta, phi)]
    field, none = friction[None, None], np.zeros((0, len(Y)))
    inputs = ContactInputs(*one, field, False, none, np.array([2.6]), radius[None])
    options = theory()._replace(elliptic=elliptic)
    row, gap = np.zeros(1, np.int64), GAPS[1:2]
    _, found, patches = solve(options, inputs, row, gap)
    a, b, centre = patches.a[0], patches.b[0], patches.centre[0]
    length, load, middle, part = np.empty((4, len(Y)))
    cut_into_strips(bodies(1), a, b, centre, 300.0, length, load, middle, part)
    turning = -phi * (Y - Y @ load / load.sum())
    kalker = [coefficient(which, a / b, NU, spline(which)) for which in range(3)]
    flex = flexibilities(CreepageCoefficients(*kalker, math.nan), a, b, SHEAR)
    section = np.where(part > 0.0, np.maximum(1.0 - (middle / b) ** 2, 0.0), 0.0)
    peak = 1.5 * np.sqrt(section) if elliptic else 2.0 * section
    gradients = xi / flex.longitudinal + turning / flex.spin, eta / flex.lateral, phi / flex.spin
    bound = friction * peak * 300.0 / (math.pi * a * b)
    along, across, moment, adhering = march(length, bound, elliptic, *gradients, 24)
    work = -2.6 * part * ((xi + turning) * along + eta * across + phi * moment)
    if phi:  # three flexibilities may state a negative work, which others take
        assert work.min() < 0.0
    power, given = work.sum(), np.maximum(work, 0.0)
    dissipation = given * power / given.sum()
    np.testing.assert_allclose(found.dissipation[0], dissipation, rtol=1e-9, atol=1e-12 * power)
    lever = Y - Y @ load / load.sum()
    known = {
        "power": power,
        "force_x": part @ along,
        "force_y": part @ across,
        "spin_moment": part @ moment - (part * lever) @ along,
        "torque": -(part * radius) @ along,
    }
    for name, value in known.items():
        total = getattr(found, name)[0]
        assert total == pytest.approx(value * GRID.spacing, rel=1e-10, abs=0.0), name
    fraction = adhering.sum() / (2.0 * length.sum())
    assert found.adhesion_fraction[0] == pytest.approx(fraction, rel=1e-12)
    # the same coefficients by other means
    for kind, same in ((TABLE, kalker), (LINE_LIMIT, short_limit(a / b, NU)[:3])):
        powers = [
            solve(options._replace(kalker=how, given=np.array(same)), inputs, row, gap)[1].power
            for how in (kind, GIVEN)
        ]
        assert powers[0] == pytest.approx(powers[1], rel=1e-12)
