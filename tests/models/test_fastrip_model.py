"""FaStrip as a tangential theory: against exact theory, and on the strips of any contact."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from tests.materials import STEEL
from wearsim.errors import ContactError
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.models.contact.hertz import HertzModel, HertzOptions, strips_over_patch
from wearsim.models.tangential.base import spread_work
from wearsim.models.tangential.fastsim import FastripTheory
from wearsim.types import Creepage, Grid, OperatingPoint

MATERIALS = (STEEL, STEEL)
PAIR = combine(*MATERIALS)
RIG = (90.0, 2.0)  # relative curvatures along and across


def contact(case, curvatures=RIG, strips=60, mx=50):
    """Solve a case of the reference with exact Hertz."""
    chosen = HertzOptions(my=strips)
    grid = strips_over_patch(chosen, curvatures[1], curvatures[0], case["N_N"], MATERIALS)
    model = HertzModel(FastripTheory(mx), grid, MATERIALS)
    creepage = Creepage(case["xi"], case["eta"], case["phi_per_m"])
    point = OperatingPoint(case["N_N"], 1.0, creepage, case["mu"])
    gap = 0.5 * curvatures[1] * grid.y**2
    return model, gap, point, model.solve_one(gap, curvatures[0], point)


def errors(cases, solve):
    """Return the error of the power against the exact theory."""
    powers = np.array([solve(case)[-1].power for case in cases])
    return powers / [case["P_over_V_N"] for case in cases] - 1.0


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def hard(case):
    return contact(case, (2.0 * case["A_per_m"], 2.0 * case["B_per_m"]))


@pytest.mark.parametrize("creepage", [(4e-4, 5e-4, 0.05), (2e-4, -1e-4, 0.9), (1e-3, 5e-4, 30.0)])
def test_power_is_the_work_of_the_rigid_slip(creepage):
    xi, eta, phi = creepage
    case = {"N_N": 300.0, "mu": 0.1, "xi": xi, "eta": eta, "phi_per_m": phi}
    *_, found = contact(case)
    work = -(xi * found.force_x + eta * found.force_y + phi * found.spin_moment)
    assert found.power == pytest.approx(work, rel=1e-12)
    assert found.dissipation.sum() * (found.y[1] - found.y[0]) == pytest.approx(work, rel=1e-12)


@pytest.mark.parametrize("curvatures", [RIG, (20.0, 20.0), (2.0, 60.0)])
def test_no_strip_has_negative_dissipation(curvatures):
    rng, chosen = np.random.default_rng(11), HertzOptions(my=41)
    grid = strips_over_patch(chosen, curvatures[1], curvatures[0], 300.0, MATERIALS)
    model = HertzModel(FastripTheory(), grid, MATERIALS)
    gap = 0.5 * curvatures[1] * grid.y**2
    resting = 0
    for _ in range(250):
        xi, eta = rng.normal(size=2) * 10.0 ** rng.uniform(-5.0, -2.5, 2)
        phi = rng.normal() * 10.0 ** rng.uniform(-2.0, 1.0)
        point = OperatingPoint(300.0, 1.0, Creepage(xi, eta, phi), 0.1)
        found = model.solve_one(gap, curvatures[0], point)
        work = -(xi * found.force_x + eta * found.force_y + phi * found.spin_moment)
        assert found.dissipation.min() >= 0.0
        assert found.power == pytest.approx(work, rel=1e-9)
        resting += np.count_nonzero(found.dissipation == 0.0)
    assert resting > 0  # strips with negative work occur


def test_spread_work_is_not_negative_and_keeps_its_sum():
    rng = np.random.default_rng(3)
    for shift in (3.0, 1.0, 0.1, -0.5):
        work = rng.normal(size=50) + shift
        found = spread_work(work)
        assert found.min() >= 0.0
        assert found.sum() == pytest.approx(max(work.sum(), 0.0), rel=1e-12)
    assert np.array_equal(spread_work(np.arange(5.0)), np.arange(5.0))
    assert np.isnan(spread_work(np.array([1.0, np.nan]))).any()


def test_varying_creepage_approximates_longitudinal_spin():
    case = {"N_N": 300.0, "mu": 0.1, "xi": 4e-4, "eta": 0.0, "phi_per_m": 0.2}
    model, gap, point, turning = contact(case)
    varied = replace(point, creepage=Creepage(4e-4, variation=-0.2 * turning.y))
    found = model.solve_one(gap, RIG[0], varied)
    assert found.dissipation == pytest.approx(
        turning.dissipation, abs=0.02 * turning.dissipation.max()
    )


def test_bearing_torque_is_balanced_or_the_roller_skids():
    case = {"N_N": 300.0, "mu": 0.1, "xi": 0.0, "eta": 2e-4, "phi_per_m": 0.1}
    model, gap, point, _ = contact(case)
    torque = replace(point, bearing_torque=0.1, rolling_radius=np.full(60, 20e-3))
    found = model.solve_one(gap, RIG[0], torque)
    assert -found.force_x * 20e-3 == pytest.approx(0.1, rel=1e-9)
    with pytest.raises(ContactError, match="skids"):
        model.solve_one(gap, RIG[0], replace(torque, bearing_torque=1.0))


@pytest.mark.parametrize("creepage", [(6e-4, 3e-4, 0.05), (2e-4, 0.0, 0.5), (1e-3, 5e-4, 8.0)])
def test_fields_integrate_to_the_solution(creepage):
    xi, eta, phi = creepage
    case = {"N_N": 300.0, "mu": 0.1, "xi": xi, "eta": eta, "phi_per_m": phi}
    model, gap, point, solution = contact(case, mx=400)
    fields = model.fields(solution, gap, RIG[0], point, points_along=801)
    spacing = solution.y[1] - solution.y[0]
    load = trapezoid(fields.pressure, fields.x, axis=0).sum() * spacing
    assert load == pytest.approx(300.0, rel=2e-3)
    for traction, force in ((fields.traction_x, "force_x"), (fields.traction_y, "force_y")):
        found = trapezoid(traction, fields.x, axis=0).sum() * spacing
        assert found == pytest.approx(getattr(solution, force), abs=3e-3 * 30.0)
    traction = np.hypot(fields.traction_x, fields.traction_y)
    assert np.all(traction <= 0.1 * fields.pressure + 1.0)
    assert np.all(fields.power_density[fields.adhesion] == 0.0)
    assert np.all(fields.power_density >= -1e-9 * fields.power_density.max())
    share = np.average(fields.adhesion.mean(axis=0), weights=solution.half_length)
    assert share == pytest.approx(solution.adhesion_fraction, abs=0.02)


def test_transition_to_fastsim_at_large_spin_is_small():
    peak = 1.5 * 300.0 / (math.pi * 1.363e-4 * 1.545e-3)
    limit = 2.0 * 0.1 * peak / (1.363e-4 * PAIR.shear_modulus * 1.517)
    powers = []
    for factor in (0.999, 1.001):
        case = {"N_N": 300.0, "mu": 0.1, "xi": 4e-4, "eta": 2e-4, "phi_per_m": factor * limit}
        powers.append(contact(case, mx=400)[-1].power)
    assert powers[1] == pytest.approx(powers[0], rel=0.015)


def test_solution_is_independent_of_the_grid_width():
    case = {"N_N": 300.0, "mu": 0.1, "xi": 4e-4, "eta": 3e-4, "phi_per_m": 0.1}
    exact = contact(case, strips=1000)[-1].power
    for half in np.linspace(1.6e-3, 1.8e-3, 7):
        grid = Grid.spanning(-half, half, 61)
        model = HertzModel(FastripTheory(), grid, MATERIALS)
        point = OperatingPoint(300.0, 1.0, Creepage(4e-4, 3e-4, 0.1), 0.1)
        assert model.solve_one(grid.y**2, RIG[0], point).power == pytest.approx(exact, rel=1e-3)
