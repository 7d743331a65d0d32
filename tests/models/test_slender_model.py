"""The contact model `slender` against exact theory, and its balances."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from tests.materials import STEEL
from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import ContactError
from wearsim.mechanics.slender.newton import TOLERANCE, WEAR_TOLERANCE
from wearsim.models.contact.slender import SPEC, Slender, SlenderOptions
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.plugins import SharedWear
from wearsim.types import ContactSolution, Creepage, Grid, OperatingPoint

MATERIALS = (STEEL, STEEL)
SPEED = 1000.0 * 2.0 * math.pi / 60.0 * 25e-3
RIG = 90.0


def contact(grid=None, gap=None, creepage=None, load=300.0, curvature=RIG, mu=0.1, **options):
    chosen = SlenderOptions(**options)
    if grid is None:
        grid = SPEC.suggest_grid(chosen, 2.0, curvature, load, MATERIALS)
    model = SPEC.factory(chosen, grid, MATERIALS)
    gap = grid.y**2 if gap is None else gap(grid.y)
    torque = creepage.pop("bearing_torque", None) if isinstance(creepage, dict) else None
    creep = Creepage(**(creepage or {"longitudinal": 1e-3}))
    radius = np.full(grid.strips, 0.02) if torque is not None else None
    point = OperatingPoint(load, SPEED, creep, mu, torque, radius)
    return model, gap, point, model.solve_one(gap, curvature, point)


def test_rig_power_is_within_1_percent_of_exact_theory():
    *_, solution = contact()
    assert solution.power == pytest.approx(0.0771, rel=1e-2)
    assert solution.line_load.sum() * np.diff(solution.y)[0] == pytest.approx(300.0, rel=1e-10)


@pytest.mark.parametrize("tangential", ["strip", "fastsim"])
@pytest.mark.parametrize(
    "creepage",
    [
        {"longitudinal": 4e-4},
        {"longitudinal": 4e-4, "lateral": 5e-4},
        {"longitudinal": -3e-4, "lateral": 2e-4, "spin": 0.4},
        {"longitudinal": 0.0, "spin": 1.0},
    ],
)
def test_power_is_the_work_of_the_rigid_slip(creepage, tangential):
    *_, point, solution = contact(creepage=creepage, tangential=tangential)
    creep = point.creepage
    work = -SPEED * (
        creep.longitudinal * solution.force_x
        + creep.lateral * solution.force_y
        + creep.spin * solution.spin_moment
    )
    assert solution.power == pytest.approx(work, rel=1e-12)
    assert solution.power > 0.0
    assert solution.power == pytest.approx(
        solution.dissipation.sum() * np.diff(solution.y)[0], rel=1e-12
    )


@pytest.mark.parametrize(
    "creepage",
    [
        {"longitudinal": 2e-4},
        {"longitudinal": 2e-4, "lateral": 2e-4},
        {"longitudinal": 1e-4, "lateral": -4e-4, "spin": 0.7},
        {"longitudinal": 1e-3, "lateral": 1e-3},
        {"longitudinal": 0.0, "spin": 20.0},
    ],
)
def test_fields_integrate_to_the_strips(creepage):
    model, gap, point, solution = contact(creepage=creepage)
    fields = model.fields(solution, gap, RIG, point, points_along=4001)
    spacing = np.diff(solution.y)[0]

    def total(values):
        return trapezoid(values, fields.x, axis=0).sum() * spacing

    assert total(fields.pressure) == pytest.approx(300.0, rel=1e-4)
    # where the direction varies along a strip, tractions are cut off at their bound
    exact = 1e-4 if len(creepage) == 1 else 2e-3
    size = 0.1 * 300.0  # the friction force
    assert total(fields.traction_x) == pytest.approx(solution.force_x, rel=0.0, abs=exact * size)
    assert total(fields.traction_y) == pytest.approx(solution.force_y, rel=0.0, abs=exact * size)
    assert total(fields.power_density) == pytest.approx(solution.power, rel=exact)
    assert total(fields.adhesion.astype(float)) / total(np.ones_like(fields.x)) == pytest.approx(
        solution.adhesion_fraction, abs=2e-3
    )
    bound = point.friction * fields.pressure
    traction = np.hypot(fields.traction_x, fields.traction_y)
    assert (traction <= bound * (1.0 + 1e-9) + 1.0).all()
    slip = np.hypot(fields.slip_x, fields.slip_y)
    assert not slip[fields.adhesion].any()


def test_spin_equals_its_creepage_variation():
    grid = Grid.spanning(-1.9e-3, 1.9e-3, 101)
    spin = {"longitudinal": 3e-4, "spin": 0.5}
    profile = {"longitudinal": 3e-4, "spin": 0.5, "variation": -0.5 * grid.y + 7.0}
    *_, first = contact(grid=grid, creepage=spin)
    *_, second = contact(grid=grid, creepage=profile)
    np.testing.assert_allclose(second.dissipation, first.dissipation, rtol=1e-7)


def test_mirrored_contact_has_mirrored_dissipation():
    grid = Grid.spanning(-3e-3, 3e-3, 100)
    one = {"longitudinal": 3e-4, "lateral": 1e-4, "spin": 0.5}
    two = {"longitudinal": 3e-4, "lateral": -1e-4, "spin": -0.5}
    *_, first = contact(grid=grid, gap=lambda y: (y - 0.5e-3) ** 2, creepage=one)
    *_, second = contact(grid=grid, gap=lambda y: (y + 0.5e-3) ** 2, creepage=two)
    np.testing.assert_allclose(second.dissipation[::-1], first.dissipation, rtol=1e-9)
    assert second.force_y == pytest.approx(-first.force_y, rel=1e-10)
    assert second.spin_moment == pytest.approx(-first.spin_moment, rel=1e-9)


@pytest.mark.parametrize("torque", [0.0, 1e-3, 0.1, 0.5, -0.3])
def test_free_roller_balances_its_bearing_torque(torque):
    *_, solution = contact(creepage={"longitudinal": 0.0, "bearing_torque": torque, "spin": 0.2})
    assert -0.02 * solution.force_x == pytest.approx(torque, rel=1e-9, abs=1e-12)
    if torque == 0.0:
        assert abs(solution.longitudinal_creepage) < 1e-12


def test_skidding_roller_is_an_error():
    with pytest.raises(ContactError, match=r"the roller skids: its torque of 700 N mm"):
        contact(creepage={"longitudinal": 0.0, "bearing_torque": 0.7})


def test_contact_at_the_edge_of_its_strips_is_an_error():
    with pytest.raises(
        ContactError, match=r"raise contact\.width or move contact\.centre"
    ) as caught:
        contact(grid=Grid.spanning(-1e-3, 1e-3, 51))
    assert set(caught.value.state) >= {"gap", "line_load", "approach"}


def test_too_narrow_strips_are_an_error():
    with pytest.raises(ContactError, match=r"lower contact\.strips"):
        contact(grid=Grid.spanning(-1.8e-5, 1.8e-5, 51))


def test_friction_may_be_given_per_strip():
    grid = Grid.spanning(-1.9e-3, 1.9e-3, 101)
    local = np.where(grid.y > 0.0, 0.2, 0.1)
    *_, mixed = contact(grid=grid, creepage={"longitudinal": 5e-3}, mu=local)
    *_, low = contact(grid=grid, creepage={"longitudinal": 5e-3}, mu=0.1)
    np.testing.assert_allclose(mixed.dissipation, low.dissipation * local / 0.1, rtol=1e-10)


@pytest.mark.parametrize("warm", [False, True])
@pytest.mark.parametrize(
    "creepage",
    [
        {"longitudinal": 1e-3},
        {"longitudinal": -3e-4, "lateral": 2e-4, "spin": 0.4},
        {"longitudinal": 4e-4, "variation": np.linspace(-1e-4, 2e-4, 121)},
    ],
)
def test_single_solution_equals_batch_bit_for_bit(creepage, warm):
    mu = np.linspace(0.05, 0.15, 121) if "spin" in creepage else 0.1
    model, gap, point, start = contact(creepage=dict(creepage), mu=mu)
    near = start if warm else None
    point, compliance = replace(point, normal_force=310.0), np.full_like(gap, 1e-13)
    single = model.solve_one(gap, RIG, point, compliance, near)
    others = [point, replace(point, normal_force=280.0)]
    batch = model.solve(
        ContactBatch.of(np.stack([gap, gap]), RIG, others),
        np.stack([compliance, compliance]),
        warm=ContactBatchSolution.of([near, near]) if warm else None,
    )
    for item in fields(ContactSolution):
        assert np.array_equal(getattr(single, item.name), getattr(batch[0], item.name))


@pytest.mark.parametrize(
    ("wear", "tolerance"), [(None, TOLERANCE), (0.0, WEAR_TOLERANCE), (3e-12, WEAR_TOLERANCE)]
)
@pytest.mark.parametrize("half_length", ["coupled", "local"])
def test_solution_from_another_load_equals_the_cold_one(half_length, wear, tolerance):
    """The cold and the warm solution differ by the residual; both carry their load to rounding."""
    model, gap, point, _ = contact(half_length=half_length)
    less, compliance = replace(point, normal_force=297.0), None
    if wear is not None:
        compliance = np.full_like(gap, wear)
    near = model.solve_one(gap, RIG, less, compliance)
    cold = model.solve_one(gap, RIG, point, compliance)
    spacing = cold.y[1] - cold.y[0]
    for start in (near, cold):
        warm = model.solve_one(gap, RIG, point, compliance, start)
        assert warm.iterations <= cold.iterations
        peak = cold.line_load.max()
        np.testing.assert_allclose(warm.line_load, cold.line_load, atol=2.0 * tolerance * peak)
        assert warm.power == pytest.approx(cold.power, rel=1e-7)
        assert warm.line_load.sum() * spacing == pytest.approx(300.0, rel=1e-12)


@pytest.mark.parametrize(
    ("ratio", "most"), [(0.25, 1), (0.9, 1), (0.99, -1), (1.0, -2), (1.01, -1), (1.1, 0), (4.0, 0)]
)
def test_solution_from_another_load_takes_few_iterations(ratio, most):
    """`most` is the number of iterations beyond that of a solution without a start."""
    grid = Grid.spanning(-4e-3, 4e-3, 161)
    model, gap, point, cold = contact(grid)
    near = model.solve_one(gap, RIG, replace(point, normal_force=ratio * point.normal_force))
    warm = model.solve_one(gap, RIG, point, None, near)
    assert warm.iterations <= cold.iterations + most
    np.testing.assert_allclose(warm.line_load, cold.line_load, atol=2e-8 * cold.line_load.max())


def test_gap_that_is_not_finite_fails_alone():
    model, gap, point, alone = contact()
    bad = gap.copy()
    bad[3] = np.inf
    with pytest.raises(ContactError, match=r"^contact 1: .* a value is not finite"):
        model.solve(ContactBatch.of(np.stack([gap, bad, gap]), RIG, [point] * 3))
    np.testing.assert_array_equal(model.solve_one(gap, RIG, point).line_load, alone.line_load)


def test_inputs_are_not_changed_and_may_be_read_only():
    model, gap, point, near = contact()
    batch, warm = ContactBatch.of(gap[None], RIG, [point]), ContactBatchSolution.of([near])
    before = model.solve(batch, np.full((1, len(gap)), 1e-13), warm=warm)
    shared = np.broadcast_to(np.array(1e-13), (1, len(gap)))
    read_only = replace(batch, gap=np.broadcast_to(gap, (1, len(gap))))
    loads = near.line_load.copy()
    after = model.solve(read_only, shared, warm=warm)
    np.testing.assert_array_equal(after.line_load, before.line_load)
    np.testing.assert_array_equal(near.line_load, loads)


def test_infinite_power_is_an_error_naming_the_contact():
    model, gap, point, _ = contact()
    bad = replace(point, creepage=Creepage(np.nan))
    with pytest.raises(ContactError, match=r"^the dissipated power is not finite"):
        model.solve_one(gap, RIG, bad)
    with pytest.raises(ContactError, match=r"^contact 1: the dissipated power is not finite"):
        model.solve(ContactBatch.of(np.stack([gap, gap]), RIG, [point, bad]))


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("tangential", ["strip", "fastsim"])
def test_curvature_and_speed_may_differ_from_contact_to_contact(tangential, coupled):
    model, gap, point, _ = contact(Grid.spanning(-2.5e-3, 2.5e-3, 81), tangential=tangential)
    curvatures, speeds = np.array([60.0, 90.0, 130.0]), np.array([1.0, 2.6, 4.0])
    points = [replace(point, rolling_speed=speed) for speed in speeds]
    batch = replace(
        ContactBatch.of(np.array([gap, 1.1 * gap, 0.9 * gap]), RIG, points),
        longitudinal_curvature=curvatures,
    )
    wear = SharedWear(np.zeros((3, 2), dtype=np.int64), np.full((3, 2, 81), 1e-13))
    found = model.solve(batch, coupling=wear if coupled else None)
    opened = wear.opening(found.line_load) if coupled else np.zeros_like(batch.gap)
    for k, curvature in enumerate(curvatures):
        single = model.solve_one(batch.gap[k] + opened[k], curvature, points[k])
        for item in fields(ContactSolution):
            value, expected = getattr(found[k], item.name), getattr(single, item.name)
            if not coupled:
                assert np.array_equal(value, expected), item.name
            elif item.name in {"line_load", "half_length", "power"}:
                assert value == pytest.approx(expected, rel=1e-4, abs=1e-6 * np.max(expected))


def test_wear_compliance_reduces_pressure_and_keeps_load():
    model, gap, point, hard = contact(grid=Grid.spanning(-4e-3, 4e-3, 81))
    soft = model.solve_one(gap, RIG, point, np.full(81, 5e-11), hard)
    assert soft.line_load.sum() == pytest.approx(hard.line_load.sum(), rel=1e-12)
    assert soft.peak_pressure < hard.peak_pressure
    assert (soft.line_load > 0).sum() > (hard.line_load > 0).sum()


def test_only_strip_theory_has_the_compiled_loop():
    arguments = Grid.spanning(-1e-3, 1e-3, 11), MATERIALS
    assert Slender(StripTheory(), *arguments).capabilities.pass_loop
    marched = SPEC.factory(SlenderOptions(tangential="fastsim"), *arguments)
    assert not marched.capabilities.pass_loop


def test_contacts_without_a_common_worn_body_are_solved_apart():
    grid = Grid.spanning(-6e-3, 6e-3, 61)
    model = SPEC.factory(SlenderOptions(), grid, MATERIALS)
    offsets = [-1e-3, 0.5e-3, 2e-3]
    gaps = np.array([scale * (grid.y - y) ** 2 for scale in (1.0, 1.3, 0.7) for y in offsets])
    points = [OperatingPoint(200.0 + 20.0 * k, SPEED, Creepage(1e-3), 0.1) for k in range(9)]
    batch = ContactBatch.of(gaps, RIG, points)
    compliance = np.zeros((9, 2, 61))
    compliance[:, 0] = 2e-11 * np.random.default_rng(1).random((9, 61))
    rollers = np.tile(np.arange(3), 3)
    bodies = np.stack([np.repeat(np.arange(3), 3), rollers], axis=1)
    together = model.solve(batch, None, SharedWear(bodies, compliance))
    for station in range(3):
        own = np.arange(3 * station, 3 * station + 3)
        alone = SharedWear(bodies[own], compliance[own])
        found = model.solve(batch.at(own), None, alone)
        for name in ("line_load", "half_length", "approach", "iterations", "power"):
            assert (getattr(together.at(own), name) == getattr(found, name)).all()
