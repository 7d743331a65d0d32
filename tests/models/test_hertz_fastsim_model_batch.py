"""Batches of contacts of the model `hertz-fastsim`."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hertz_fastsim_examples import CONTACTS, RIG, SPEED, batch, contact, draws, groove

from wearsim.contact_batch import ContactBatch
from wearsim.errors import CapabilityError, ContactError
from wearsim.types import Creepage, OperatingPoint


def assert_same(found, expected):
    for name, value in vars(expected).items():
        assert np.array_equal(getattr(found, name), value), name
        assert type(getattr(found, name)) is type(value)


OPTIONS = [
    {},
    {"closed_form": "always"},
    {"closed_form": "never", "bound": "elliptic", "mx": 17},
    {"dissipation": "element-sum"},
    {"kalker": "line-limit"},
    {"kalker_coefficients": {"c11": 4.0, "c22": 3.0, "c23": 0.5}},
    {"patch": {"a": "0.2 mm", "b": "2 mm"}},
    {"flexibility": "one", "closed_form": "never"},
    {"flexibility": "one", "dissipation": "element-sum", "bound": "elliptic"},
]


@pytest.mark.parametrize("spin", [True, False])
@pytest.mark.parametrize("options", OPTIONS)
def test_batch_equals_single_solutions(options, spin):
    points = draws() if spin else replace(draws(), spin=np.zeros(CONTACTS))
    model, contacts, found = batch(points, **options)
    assert found.line_load.shape == (CONTACTS, 50)
    for k in range(0, CONTACTS, 4):
        assert_same(found[k], model.solve_one(contacts.gap[k], RIG[0], contacts.point(k)))


@pytest.mark.parametrize("flexibility", ["three", "one"])
def test_batch_supports_any_gap_friction_and_creepage(flexibility):
    random = np.random.default_rng(1)
    shapes = [groove(depth, offset) for depth, offset in random.random((CONTACTS, 2)) * 3e-6]
    points = replace(
        draws(),
        friction=random.uniform(0.05, 0.15, (CONTACTS, 81)),
        variation=random.normal(size=(CONTACTS, 81)) * 1e-4,
    )
    model, contacts, found = batch(
        points, lambda y, k: shapes[k](y), 9e-3, 81, flexibility=flexibility
    )
    for k in range(0, CONTACTS, 4):
        assert_same(found[k], model.solve_one(contacts.gap[k], RIG[0], contacts.point(k)))


def test_list_of_points_equals_columns():
    model, contacts, found = batch(draws())
    points = [contacts.point(k) for k in range(CONTACTS)]
    listed = model.solve(ContactBatch.of(contacts.gap, RIG[0], points))
    assert np.array_equal(listed.power, found.power)
    part = model.solve(contacts.at(np.arange(10, 20)))
    assert np.array_equal(part.dissipation, found.dissipation[10:20])


def test_curvature_and_speed_may_differ_from_contact_to_contact():
    spread = np.linspace(0.5, 1.5, CONTACTS)
    contacts = replace(
        draws(), longitudinal_curvature=RIG[0] * spread, rolling_speed=SPEED * spread[::-1]
    )
    for shape in (None, lambda y, k: groove(1e-6 * (k % 3))(y)):
        model, same, found = batch(contacts, shape, 4e-3, 81)
        for k in range(0, CONTACTS, 4):
            curvature = float(same.longitudinal_curvature[k])
            assert_same(found[k], model.solve_one(same.gap[k], curvature, same.point(k)))


def test_columns_of_different_lengths_are_refused():
    with pytest.raises(ValueError, match="spin has 2 values for 60 contacts"):
        replace(draws(), spin=np.zeros(2))


def test_batch_with_bearing_torques_is_solved():
    model, gap, _, _ = contact()
    points = [
        OperatingPoint(
            300.0, SPEED, Creepage(0.0), 0.1, bearing_torque=torque,
            rolling_radius=np.full(50, 20e-3),
        )
        for torque in (0.1, 0.2)
    ]  # fmt: skip
    found = model.solve(ContactBatch.of(np.array([gap, gap]), RIG[0], points))
    assert -found.force_x * 20e-3 == pytest.approx([0.1, 0.2], rel=1e-9)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"normal_force": 0.0}, "contact is lost"),
        ({"normal_force": 1e5}, "extends beyond its strips"),
        ({"lateral": math.nan}, "power is not finite"),
    ],
)
def test_batch_error_names_the_failed_contact(change, match):
    points = draws()
    for name, value in change.items():
        getattr(points, name)[17] = value
    with pytest.raises(ContactError, match=f"^contact 17: .*{match}") as caught:
        batch(points)
    assert caught.value.state["contact"] == [17]
    assert "gap" in caught.value.state


def test_batch_refuses_wrong_curvature_and_friction_shape():
    points = draws()
    model, contacts, _ = batch(points)
    with pytest.raises(ContactError, match="curvature along rolling is -1 1/m"):
        model.solve(replace(contacts, longitudinal_curvature=-np.ones(CONTACTS)))
    with pytest.raises(ValueError, match=r"friction has the shape \(7, 50\)"):
        batch(replace(points, friction=np.full((CONTACTS, 7, 50), 0.1)))
    with pytest.raises(ValueError, match="has 60 values for 59 contacts"):
        replace(contacts, gap=contacts.gap[1:])
    with pytest.raises(CapabilityError, match="stepper = 'stabilised'"):
        model.solve(contacts, np.zeros_like(contacts.gap))


def test_neglect_of_lateral_spin_slip_has_the_stated_error():
    points = draws(300)
    powers = {
        name: batch(points, None, 1.8e-3, strips, closed_form=form, mx=mx)[2].power
        for name, form, strips, mx in (
            ("reference", "never", 200, 200),
            ("strips", "always", 200, 200),
            ("quick", "always", 24, 50),
        )
    }
    reference = powers["reference"]
    error = powers["strips"] / reference - 1.0
    assert np.sqrt(np.mean(error**2)) < 2.5e-3
    assert np.abs(error).max() < 0.03
    for name, tolerance in (("strips", 2e-4), ("quick", 1e-3)):
        assert powers[name].mean() == pytest.approx(reference.mean(), rel=tolerance)
        assert powers[name].std() == pytest.approx(reference.std(), rel=tolerance)
