"""The half-space model: requirements on contact models, CONTACT, Hertz, Carter, runs."""

import json
from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim.scenario.examples import shipped_scenario
from wearsim.testing import contact_model_tests
from wearsim.types import Creepage, Grid, Material, OperatingPoint
from wearsim_halfspace import SPEC, Halfspace, HalfspaceOptions
from wearsim_halfspace.influence import Elements
from wearsim_halfspace.normal import solve_normal
from wearsim_halfspace.rolling import solve_rolling

STEEL = Material(youngs_modulus=200e9, poisson_ratio=0.3)
CONTACT = json.loads((Path(__file__).parent / "contact_rig.json").read_text())
SHEAR = STEEL.youngs_modulus / (2.0 * (1.0 + STEEL.poisson_ratio))

test_halfspace = contact_model_tests(SPEC, {"mx": 24})


def ellipse(case, n):
    """Return the contact of a case on n x n elements across its ellipse, as CONTACT has them."""
    a, b = case["a_m"], case["b_m"]
    dx, dy = 2.0 * a / n, 2.0 * b / n
    places = np.arange(n + 4) - 0.5 * (n + 3)
    elements = Elements(n + 4, n + 4, dx, dy, SHEAR, STEEL.poisson_ratio)
    x, y = places * dx, places * dy
    gap = CONTACT["A_per_m"] * x**2 + CONTACT["B_per_m"] * y[:, None] ** 2
    start = np.sqrt(np.maximum(1.0 - (x / a) ** 2 - (y[:, None] / b) ** 2, 0.0))
    return elements, x, y, solve_normal(elements, gap, case["N_N"], start, 1e-7)


def power_of(case, n):
    """Return the power over the rolling velocity of a case [N]."""
    elements, x, y, normal = ellipse(case, n)
    slip = np.empty((2, n + 4, n + 4))
    slip[0] = case["xi"] - case["phi_rad_per_m"] * y[:, None]
    slip[1] = case["eta"] + case["phi_rad_per_m"] * x
    found = solve_rolling(elements, case["mu"] * normal.pressure, slip, 1e-6)
    return -float((found.traction * slip).sum()) * elements.dx * elements.dy


@pytest.mark.parametrize("number", range(0, 40, 4))
def test_power_is_that_of_contact_on_the_same_elements(number):
    case = CONTACT["rows"][number]
    assert power_of(case, 60) == pytest.approx(case["power_60_N"], rel=3e-4)


@pytest.mark.slow
@pytest.mark.parametrize("number", [2, 13, 27])
def test_power_is_that_of_contact_on_fine_elements(number):
    case = CONTACT["rows"][number]
    assert power_of(case, 120) == pytest.approx(case["power_120_N"], rel=3e-4)


def test_pressure_and_approach_converge_to_those_of_hertz():
    case = CONTACT["rows"][0]
    errors = []
    for n in (20, 40, 80):
        *_, normal = ellipse(case, n)
        errors.append(abs(normal.approach / case["approach_m"] - 1.0))
    assert errors[-1] < 2e-4
    assert np.log2(errors[0] / errors[2]) / 2.0 > 0.9


def solved(gap, curvature, point, strips=81, half_width=2.5e-3, **options):
    grid = Grid.spanning(-half_width, half_width, strips)
    model = Halfspace(HalfspaceOptions(**options), grid, (STEEL, STEEL))
    return model.solve_one(gap(grid.y), curvature, point), grid


def test_long_contact_has_the_creep_force_of_carter_in_its_middle():
    # the strip theory is exact in the middle of a contact that is thirty times as wide as long
    curvature, across = 90.0, 0.03
    point = OperatingPoint(300.0, 1.0, Creepage(4e-4), 0.1)
    found, grid = solved(lambda y: 0.5 * across * y**2, curvature, point, 61, 8e-3, mx=60)
    middle = grid.strips // 2
    load, a = found.line_load[middle], found.half_length[middle]
    modulus = STEEL.youngs_modulus / (2.0 * (1.0 - STEEL.poisson_ratio**2))
    assert a == pytest.approx(np.sqrt(4.0 * load / (np.pi * modulus * curvature)), rel=0.01)
    # Carter: xi = mu a kappa (1 - sqrt(1 - F/(mu q))), dissipation = (F xi) V
    adhesion = 1.0 - 4e-4 / (0.1 * a * curvature)
    force = 0.1 * load * (1.0 - adhesion**2)
    assert found.dissipation[middle] == pytest.approx(force * 4e-4, rel=0.02)


def test_total_power_is_the_work_of_the_rigid_slip():
    point = OperatingPoint(300.0, 1.3, Creepage(4e-4, 5e-4, 0.5), 0.1)
    found, grid = solved(lambda y: 0.5 * y**2, 45.0, point, mx=30)
    work = found.force_x * 4e-4 + found.force_y * 5e-4 + found.spin_moment * 0.5
    assert found.power == pytest.approx(-1.3 * work, rel=1e-9)
    assert found.dissipation.sum() * grid.spacing == pytest.approx(found.power, rel=1e-12)
    assert (found.dissipation >= 0.0).all()


def test_number_of_strips_and_elements_changes_the_power_little():
    point = OperatingPoint(300.0, 1.0, Creepage(4e-4, 5e-4, 0.05), 0.1)
    coarse, _ = solved(lambda y: 0.5 * y**2, 45.0, point, 61, mx=30)
    fine, _ = solved(lambda y: 0.5 * y**2, 45.0, point, 121, mx=60)
    assert coarse.power == pytest.approx(fine.power, rel=0.015)


def test_run_wears_as_with_the_default_model():
    changes = {"operation.duration": "1 min", "contact.strips": 61, "outputs.records": 3}
    exact = wearsim.run(
        shipped_scenario("rig-450min", {**changes, "contact.model": "halfspace", "contact.mx": 24})
    )
    usual = wearsim.run(shipped_scenario("rig-450min", changes))
    assert exact.stepper == "implicit"
    assert exact.depth[-1] == pytest.approx(usual.depth[-1], rel=0.02)
    factor = 1.1e-11
    energy = exact.dissipated_energy[-1]
    assert exact.worn_volume[-1] == pytest.approx(factor * energy, rel=1e-12)
