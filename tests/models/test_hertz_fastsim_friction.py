"""Friction that varies within the contact of the model `hertz-fastsim`."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hertz_fastsim_examples import CONTACTS, RIG, SPEED, batch, contact, draws
from scipy.integrate import trapezoid

from wearsim.contact_batch import ContactBatch
from wearsim.errors import CapabilityError, ContactError
from wearsim.types import Creepage, Grid, OperatingPoint


def test_friction_may_differ_from_strip_to_strip():
    model, gap, _, whole = contact()
    friction = np.where(np.arange(50) < 25, 0.1, 0.05)
    half = model.solve_one(gap, RIG[0], OperatingPoint(300.0, SPEED, Creepage(1e-3), friction))
    assert half.dissipation[:25] == pytest.approx(whole.dissipation[:25], rel=1e-12)
    assert np.all(half.dissipation[25:] < whole.dissipation[25:])


FIELD_OPTIONS = [{}, {"bound": "elliptic"}, {"dissipation": "element-sum"}]


@pytest.mark.parametrize("options", FIELD_OPTIONS)
def test_uniform_friction_field_equals_one_coefficient(options):
    options = options | {"closed_form": "never"}
    model, gap, point, expected = contact(creepage=(4e-4, 5e-4, 0.3), **options)
    for carried in (False, True):
        field = replace(point, friction=np.full((50, 50), 0.1), friction_carried=carried)
        found = model.solve_one(gap, RIG[0], field)
        assert found.dissipation == pytest.approx(expected.dissipation, rel=1e-13)
        assert found.adhesion_fraction == pytest.approx(expected.adhesion_fraction, rel=1e-12)
        assert found.force_y == pytest.approx(expected.force_y, rel=1e-13)


def test_carried_friction_is_the_mean_over_particles():
    model, gap, point, _ = contact(creepage=(4e-4, 5e-4, 0.0), mx=6)
    friction = np.random.default_rng(3).uniform(0.05, 0.2, (6, 50))
    found = model.solve_one(gap, RIG[0], replace(point, friction=friction, friction_carried=True))
    singles = [model.solve_one(gap, RIG[0], replace(point, friction=row)) for row in friction]
    for name in ("dissipation", "force_x", "force_y", "adhesion_fraction", "power"):
        mean = np.mean([getattr(solution, name) for solution in singles], axis=0)
        assert getattr(found, name) == pytest.approx(mean, rel=1e-13), name


def noise(points_along, strips, carried=False, contacts=12):
    """Return the mean power and its standard error with random friction at each point."""
    random = np.random.default_rng(points_along)
    same = np.ones(contacts)
    points = replace(
        draws(contacts),
        normal_force=300.0 * same,
        longitudinal=1e-3 * same,
        lateral=0.0 * same,
        spin=0.0 * same,
        friction=random.normal(0.1, 0.02, (contacts, points_along, strips)),
        friction_carried=carried,
    )
    options = {"mx": points_along, "kalker": "line-limit"}
    half = 0.5 * strips * contact(my=strips)[0]._grid.spacing
    power = batch(points, None, half, strips, **options)[2].power
    return power.mean(), power.std() / math.sqrt(contacts)


@pytest.mark.parametrize(
    ("cells", "expected"),
    [(25, 0.0689), (50, 0.0653), (100, 0.0614), (200, 0.0569), (400, 0.0527), (800, 0.0487)],
)
def test_white_noise_power_decreases_with_grid_refinement(cells, expected):
    mean, deviation = noise(cells, strips=50)
    assert deviation < 0.01 * expected
    assert mean == pytest.approx(expected, rel=0.02)


def test_carried_white_noise_has_a_continuum_limit():
    # the limit is the mean of the power over the distribution of the coefficient
    nodes, weights = np.polynomial.hermite_e.hermegauss(21)
    powers = [contact(mu=0.1 + 0.02 * z, kalker="line-limit")[-1].power for z in nodes]
    limit = np.dot(weights, powers) / weights.sum()
    for cells in (25, 100, 400):
        mean, deviation = noise(cells, 50, carried=True)
        assert mean == pytest.approx(limit, abs=4.0 * deviation)
    assert deviation < 1e-3 * limit


def test_friction_points_are_the_ends_of_the_steps():
    model, gap, point, solution = contact(Grid.spanning(-3e-3, 3e-3, 60), mx=10)
    (x,), y = model.friction_points(ContactBatch.of(gap[None], RIG[0], [point]))
    assert np.array_equal(y, solution.y)
    expected = (1.0 - 0.2 * np.arange(1, 11))[:, None] * solution.half_length
    assert x == pytest.approx(expected, abs=1e-18)
    model, contacts, found = batch(draws(), mx=10)
    many, _ = model.friction_points(contacts)
    assert many.shape == (CONTACTS, 10, 50)
    assert np.array_equal(-many[:, -1], found.half_length)
    contacts.normal_force[3] = -1.0
    with pytest.raises(ContactError, match="contact 3: the contact is lost"):
        model.friction_points(contacts)


def test_fields_support_friction_per_point():
    model, gap, point, _ = contact(creepage=(6e-4, 3e-4, 0.1), mx=200)
    friction = np.random.default_rng(4).uniform(0.05, 0.15, (200, 50))
    local = replace(point, friction=friction)
    solution = model.solve_one(gap, RIG[0], local)
    fields = model.fields(solution, gap, RIG[0], local)
    assert fields.x.shape == (201, 50)
    spacing = solution.y[1] - solution.y[0]
    force = trapezoid(fields.traction_x, fields.x, axis=0).sum() * spacing
    # the solution includes the corners that the trapezoidal rule omits at the edges
    assert force == pytest.approx(solution.force_x, rel=1e-4)
    bound = friction[::-1] * 4.0 / 3.0 * fields.pressure[:-1]
    assert np.all(np.hypot(fields.traction_x, fields.traction_y)[:-1] <= bound + 1e-3)
    with pytest.raises(CapabilityError, match="no stationary field inside"):
        model.fields(solution, gap, RIG[0], replace(local, friction_carried=True))
    driven = replace(local, bearing_torque=0.2, rolling_radius=np.full(50, 0.02))
    assert -0.02 * model.solve_one(gap, RIG[0], driven).force_x == pytest.approx(0.2, rel=1e-9)
