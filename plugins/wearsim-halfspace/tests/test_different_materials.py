"""Half-spaces of different materials, whose pressure and traction are coupled."""

import numpy as np
import pytest

import wearsim
from wearsim.errors import ContactError
from wearsim.scenario.examples import shipped_scenario
from wearsim.types import Creepage, Grid, Material, OperatingPoint
from wearsim_halfspace import Halfspace, HalfspaceOptions
from wearsim_halfspace.strips import combined, difference, half_width

STEEL, BRONZE, HARD_PLASTIC = Material(210e9, 0.3), Material(100e9, 0.34), Material(7e9, 0.2)
GRID = Grid.spanning(-1.5e-3, 1.5e-3, 41)


def solved(materials, creepage, friction=0.3, force=300.0, **options):
    model = Halfspace(HalfspaceOptions(mx=24, **options), GRID, materials)
    return model.solve_one(20.0 * GRID.y**2, 90.0, OperatingPoint(force, 1.0, creepage, friction))


def long_contact(materials, creepage, friction):
    """Return the solution of a contact with b/a = 30, its middle row, a and b."""
    shear, nu = combined(materials)
    modulus, along, across, force = shear / (1.0 - nu), 45.0, 0.189865872, 300.0
    half, a = (half_width(*pair, force, modulus) for pair in ((along, across), (across, along)))
    assert half / a == pytest.approx(30.0, rel=1e-6)
    grid = Grid.spanning(-1.2 * half, 1.2 * half, 61)
    point = OperatingPoint(force, 1.0, Creepage(creepage), friction)
    model = Halfspace(HalfspaceOptions(mx=48), grid, materials)
    patch = model._patch(across * grid.y**2, 2.0 * along, point, None, None)
    patch, solution = model._rolled(patch, point.creepage)
    return patch, solution, grid.strips // 2 - patch.strips.start, a, half


@pytest.mark.parametrize("materials", [(STEEL, HARD_PLASTIC), (HARD_PLASTIC, STEEL)])
def test_sliding_long_contact_is_that_of_line_contact(materials):
    """Pressure of sliding cylinders (Johnson, Contact Mechanics, section 8.1).

    It is proportional to (a - x)^(1/2 + e) (a + x)^(1/2 - e) about a middle that is shifted by
    2 e a, with tan(pi e) = mu K/(1 - nu): its mean position is shifted by 8 e a/3. In an ellipse
    the tractions elsewhere incline the surface by K mu q pi/(G b) less than in line contact.
    """
    friction, nu = 0.3, combined(materials)[1]
    patch, _, middle, a, half = long_contact(materials, 0.05, friction)
    pressure = patch.normal.pressure[middle]
    mean = float(pressure @ patch.problem.x / pressure.sum())
    exponent = np.arctan(friction * difference(materials) / (1.0 - nu)) / np.pi
    exact = 8.0 / 3.0 * exponent * a * (1.0 - 3.0 * np.pi**2 / 32.0 * a / half)
    assert mean == pytest.approx(exact, rel=0.01)


def test_long_contact_of_little_friction_rolls_freely_at_its_creepage():
    """Creepage at which tractions of both directions balance.

    In line contact the pressure adds 2 K p/G to the slip. Of a semi-ellipse, the part |x| < t a
    carries half of the load with asin t + t sqrt(1 - t^2) = pi/4, t = 0.40397: there the slip is
    opposite if the creepage is that of the pressure p0 sqrt(1 - t^2). In an ellipse it is smaller
    by K q/(G b), with the line load q = pi a p0/2.
    """
    materials, friction = (STEEL, BRONZE), 1e-4
    patch, _, middle, a, half = long_contact(materials, 0.0, friction)
    per_pressure = -2.0 * difference(materials) / combined(materials)[0]
    level = np.sqrt(1.0 - 0.40397**2) - 0.25 * np.pi * a / half
    free = per_pressure * level * patch.normal.pressure[middle].max()
    assert free > 1e-4
    patch, solution, *_ = long_contact(materials, free, friction)
    force = solution.rolling.traction[0][middle].sum() * patch.problem.dx
    assert abs(force) < 0.05 * friction * patch.load[patch.strips][middle]


@pytest.mark.parametrize(
    "creepage", [Creepage(0.0), Creepage(3e-4, 2e-4), Creepage(2e-3, 2e-3, 2.0)]
)
def test_friction_dissipates_the_work_of_forces_and_torque(creepage):
    model = Halfspace(HalfspaceOptions(mx=48), GRID, (STEEL, BRONZE))
    point = OperatingPoint(300.0, 1.0, creepage, 0.3)
    patch = model._patch(20.0 * GRID.y**2, 90.0, point, None, None)
    patch, solution = model._rolled(patch, creepage)
    work, problem = solution.work(), patch.problem
    area = problem.dx * problem.dy
    of_forces = creepage.longitudinal * work.force_x + creepage.lateral * work.force_y
    of_torque = 90.0 * float((patch.normal.pressure * problem.x).sum()) * area
    done = of_torque - (of_forces + creepage.spin * work.moment)
    assert work.power == pytest.approx(done, rel=2e-3)
    # by slip and traction of each element
    assert float(work.rows.sum()) * problem.dy == pytest.approx(work.power, rel=3e-3)
    assert work.power > 0.0


def test_bodies_in_the_other_order_slip_the_other_way():
    one = solved((STEEL, BRONZE), Creepage(3e-4, 2e-4, 1.0))
    other = solved((BRONZE, STEEL), Creepage(-3e-4, -2e-4, -1.0))
    assert other.power == pytest.approx(one.power, rel=1e-6)
    assert other.force_x == pytest.approx(-one.force_x, rel=1e-6)
    assert other.force_y == pytest.approx(-one.force_y, rel=1e-6)
    np.testing.assert_allclose(other.line_load, one.line_load, rtol=1e-5)


def test_coupling_is_optional_and_absent_for_equal_materials():
    creepage = Creepage(3e-4, 2e-4)
    without = solved((STEEL, BRONZE), creepage, coupling=False)
    with_it = solved((STEEL, BRONZE), creepage)
    assert abs(with_it.force_x - without.force_x) > 0.1 * abs(without.force_x)
    assert with_it.peak_pressure == pytest.approx(without.peak_pressure, rel=0.02)
    equal = solved((STEEL, STEEL), creepage)
    np.testing.assert_array_equal(
        equal.dissipation, solved((STEEL, STEEL), creepage, coupling=False).dissipation
    )


def test_fields_are_those_of_the_coupled_contact():
    model = Halfspace(HalfspaceOptions(mx=24), GRID, (STEEL, HARD_PLASTIC))
    point, gap = OperatingPoint(30.0, 1.0, Creepage(0.05), 0.3), 20.0 * GRID.y**2
    solution = model.solve_one(gap, 90.0, point)
    fields = model.fields(solution, gap, 90.0, point)
    middle = GRID.strips // 2
    mean = fields.pressure[:, middle] @ fields.x[:, middle] / fields.pressure[:, middle].sum()
    assert mean < -0.05 * solution.half_length[middle]


def test_contact_that_traction_moves_off_the_elements_is_an_error():
    with pytest.raises(ContactError, match="traction shifts the contact beyond"):
        solved((STEEL, HARD_PLASTIC), Creepage(0.5), friction=4.0, force=3.0)


@pytest.mark.parametrize(
    ("material", "mx", "creepages"),
    [
        ("aluminium", 24, (2.98e-4, 3e-4, 3.02e-4)),
        pytest.param(*("bronze", 50, (2.1203e-4, 2.1356e-4, 2.1509e-4)), marks=pytest.mark.slow),
    ],
)
def test_row_that_alternates_between_states_ends_the_iteration(material, mx, creepages):
    """In the contact at the middle creepage, near free rolling, the same row changes each time."""
    changes = {
        "contact.model": "halfspace",
        "contact.mx": mx,
        "roller.material": material,
        "load.normal_force": "28.7 N",
        "cylinder.radius": "20 mm",
        "roller.radius": "25 mm",
        "roller.crown_radius": "25 mm",
    }
    before, power, after = (
        wearsim.solve_contact(
            shipped_scenario("rig-450min", changes | {"creepage.longitudinal": creepage})
        ).power
        for creepage in creepages
    )
    assert power == pytest.approx(0.5 * (before + after), rel=5e-3)


def test_note_on_neglected_coupling_is_left_out_where_it_is_included():
    bronze = {"roller.material": "bronze", "contact.model": "halfspace"}
    assert shipped_scenario("rig-450min", bronze).notes == ()
    [note] = shipped_scenario("rig-450min", bronze | {"contact.coupling": False}).notes
    assert "neglected" in note


def test_creep_factor_changes_no_sliding_contact_of_different_materials():
    materials, slip = (STEEL, BRONZE), Creepage(0.1)
    point = OperatingPoint(300.0, 1.0, slip, 0.3)
    model = Halfspace(HalfspaceOptions(mx=24), GRID, materials)
    ideal = model.solve_one(20.0 * GRID.y**2, 90.0, point)
    film = model.with_creep_factor(0.5).solve_one(20.0 * GRID.y**2, 90.0, point)
    # the power extrapolated from coarser elements is that of the tolerance there
    assert film.power == pytest.approx(ideal.power, rel=1e-4)
    np.testing.assert_allclose(
        film.line_load, ideal.line_load, rtol=0.0, atol=3e-4 * ideal.line_load.max()
    )
    partly = model.with_creep_factor(0.5).solve_one(
        20.0 * GRID.y**2, 90.0, OperatingPoint(300.0, 1.0, Creepage(2e-3), 0.3)
    )
    whole = model.solve_one(20.0 * GRID.y**2, 90.0, OperatingPoint(300.0, 1.0, Creepage(2e-3), 0.3))
    assert 0.0 < -partly.force_x < -0.9 * whole.force_x
