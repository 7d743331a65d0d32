"""Built-in contact models have the capabilities that they claim, and refuse others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from wearsim.contact_batch import ContactBatch
from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics.slender.newton import solve_slender
from wearsim.plugins import ContactModelSpec, SharedWear, registry
from wearsim.types import Creepage, Grid, Material, OperatingPoint

STEEL = Material(youngs_modulus=210e9, poisson_ratio=0.3)
CURVATURE = 1 / 0.025 + 1 / 0.020
POINT = OperatingPoint(300.0, 2.618, Creepage(1e-3), 0.1)
MODELS = {
    "slender": {},
    "slender-fastsim": {"tangential": "fastsim"},
    "hertz-fastsim": {},
    "hertz-fastsim-march": {"closed_form": "never"},
}


class Case:
    """Contact model with a contact to solve."""

    def __init__(self, name: str) -> None:
        model = "slender" if name.startswith("slender") else "hertz-fastsim"
        self.spec = registry().get(ContactModelSpec, model)
        self.grid = Grid.spanning(-2.5e-3, 2.5e-3, 61)
        options = self.spec.options(**MODELS[name])
        self.model = self.spec.factory(options, self.grid, (STEEL, STEEL))
        self.gap = self.grid.y**2 / (2 * 0.5)
        self.solution = self.solve(POINT)

    def solve(self, point: OperatingPoint, compliance=None):
        return self.model.solve_one(self.gap, CURVATURE, point, compliance)


@pytest.fixture(params=MODELS)
def case(request):
    return Case(request.param)


def test_spec_has_at_least_the_capabilities_of_its_models(case):
    assert set(case.model.capabilities.names()) <= set(case.spec.describe())


def test_wear_compliance(case):
    compliance = np.full(case.grid.strips, 1e-12)
    if not case.model.capabilities.wear_compliance:
        with pytest.raises(CapabilityError, match="wear compliance"):
            case.solve(POINT, compliance)
        return
    softer = case.solve(POINT, compliance)
    opened = case.model.solve_one(case.gap + compliance * softer.line_load, CURVATURE, POINT)
    assert softer.line_load.max() < 0.99 * case.solution.line_load.max()
    assert opened.line_load == pytest.approx(softer.line_load, rel=1e-5, abs=1.0)


def test_coupled(case):
    batch = ContactBatch.of(np.array([case.gap, case.gap]), CURVATURE, [POINT, POINT])
    wear = SharedWear(np.zeros((2, 2), dtype=np.int64), np.full((2, 2, case.grid.strips), 5e-13))
    if not case.model.capabilities.coupled:
        with pytest.raises(CapabilityError, match="contacts that wear common bodies"):
            case.model.solve(batch, coupling=wear)
        return
    one, other = case.model.solve(batch, coupling=wear)
    single = case.solve(POINT, 2 * wear.total[0])
    assert one.line_load == pytest.approx(other.line_load, rel=1e-9)
    assert one.line_load == pytest.approx(single.line_load, rel=1e-6, abs=1e-3)


def test_coupled_sets_equal_single_solutions(case):
    if not case.model.capabilities.coupled:
        pytest.skip("solves one contact at a time")
    softness = np.array([1e-13, 5e-13, 0.0])[:, None, None, None]
    bodies = np.zeros((2, 2), dtype=np.int64)
    wear = SharedWear(bodies, softness * np.ones((3, 2, 2, case.grid.strips)))
    lighter = replace(POINT, normal_force=0.8 * POINT.normal_force)
    batch = ContactBatch.of(np.array([case.gap] * 6), CURVATURE, [POINT, lighter] * 3)
    found = case.model.solve(batch, coupling=wear)
    again = case.model.solve(batch, coupling=wear, warm=found)
    for k in range(3):
        own = np.array([2 * k, 2 * k + 1])
        single = case.model.solve(batch.at(own), coupling=wear.at(k))
        warm = case.model.solve(batch.at(own), coupling=wear.at(k), warm=found.at(own))
        for one, other in zip([*found.at(own), *again.at(own)], [*single, *warm], strict=True):
            assert (one.line_load == other.line_load).all()
            assert one.power == other.power
    # with and without bodies in common; each further signature takes a quarter of a minute
    layouts = [
        argument.layout
        for item in solve_slender.dispatcher.signatures
        for argument in item
        if hasattr(argument, "layout")
    ]
    assert set(layouts) <= {"C"}


def test_creepage_variation(case):
    assert case.model.capabilities.creepage_variation
    variation = 2e-4 * np.sign(case.grid.y)
    varied = case.solve(replace(POINT, creepage=Creepage(2e-4, variation=variation)))
    left = varied.dissipation[case.grid.y < 0].sum()
    right = varied.dissipation[case.grid.y > 0].sum()
    assert right > 5 * left


def test_bearing_torque(case):
    assert case.model.capabilities.bearing_torque
    radius = np.full(case.grid.strips, 0.020)
    point = replace(POINT, bearing_torque=0.3, rolling_radius=radius)
    solution = case.solve(point)
    assert solution.force_x * 0.020 == pytest.approx(-0.3, rel=1e-9)
    assert 0.0 < solution.longitudinal_creepage < 1e-3


def test_local_friction(case):
    assert case.model.capabilities.local_friction
    friction = np.where(case.grid.y > 0, 0.2, 0.1)
    solution = case.solve(replace(POINT, friction=friction))
    assert not np.allclose(solution.dissipation, solution.dissipation[::-1], rtol=0.1, atol=0.0)


def test_friction_field(case):
    batch = ContactBatch.of(case.gap[None], CURVATURE, [POINT])
    if not case.model.capabilities.friction_field:
        with pytest.raises(CapabilityError, match="from point to point"):
            case.solve(replace(POINT, friction=np.full((50, case.grid.strips), 0.1)))
        with pytest.raises(CapabilityError, match="from point to point"):
            case.model.friction_points(batch)
        return
    (x,), y = case.model.friction_points(batch)
    friction = np.where(x > 0.0, 0.05, 0.15) + np.zeros_like(y)
    changed = case.solve(replace(POINT, friction=friction))
    assert changed.power == pytest.approx(case.solution.power, rel=0.2)
    assert changed.power != pytest.approx(case.solution.power, rel=1e-3)
    carried = case.solve(replace(POINT, friction=friction, friction_carried=True))
    assert carried.power != pytest.approx(changed.power, rel=1e-3)


def test_batch_equals_single_solutions(case):
    loads = np.array([250.0, 300.0, 320.0])
    points = [replace(POINT, normal_force=n, creepage=Creepage(1e-3, 3e-4, 0.02)) for n in loads]
    contacts = ContactBatch.of(np.array([case.gap] * 3), CURVATURE, points)
    batch = case.model.solve(contacts)
    assert batch.line_load.shape == contacts.gap.shape
    for k, found in enumerate(batch):
        single = case.solve(points[k])
        assert found.dissipation == pytest.approx(single.dissipation, rel=1e-12, abs=1e-12)
        assert batch.power[k] == found.power == pytest.approx(single.power)
        assert [type(value) for value in vars(found).values()] == [
            type(value) for value in vars(single).values()
        ]
    bad = replace(contacts, normal_force=np.array([300.0, 300.0, 1e7]))
    with pytest.raises(ContactError, match=r"^contact 2: "):
        case.model.solve(bad)
    with pytest.raises(ContactError, match=r"^realisation 2: "):
        case.model.solve(replace(bad, shape=(1, 1, 3)))


def test_pass_loop(case):
    if not case.model.capabilities.pass_loop:
        with pytest.raises(CapabilityError, match="per-pass loop"):
            case.model.pass_loop(None)
        return
    assert "pass_loop" in vars(type(case.model))


def test_fields(case):
    assert case.model.capabilities.fields
    fields = case.model.fields(case.solution, case.gap, CURVATURE, POINT)
    middle = case.grid.strips // 2
    power = trapezoid(fields.power_density[:, middle], fields.x[:, middle])
    assert abs(power) == pytest.approx(case.solution.dissipation[middle], rel=0.1)
