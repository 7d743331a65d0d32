"""The half-space model: requirements on contact models, Carter, hard contacts, runs."""

import subprocess
import sys
from ast import literal_eval

import pytest

import wearsim
from wearsim.scenario.examples import shipped_scenario
from wearsim.testing import contact_model_tests
from wearsim.types import Creepage, Grid, Material, OperatingPoint
from wearsim_halfspace import SPEC, Halfspace, HalfspaceOptions

STEEL = Material(youngs_modulus=200e9, poisson_ratio=0.3)

test_halfspace = contact_model_tests(SPEC, {"mx": 24})


def solved(gap, curvature, point, strips=81, half_width=2.5e-3, **options):
    grid = Grid.spanning(-half_width, half_width, strips)
    model = Halfspace(HalfspaceOptions(**options), grid, (STEEL, STEEL))
    return model.solve_one(gap(grid.y), curvature, point), grid


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


def test_stated_error_of_a_contact_includes_that_of_elements_along_rolling():
    raw = {"contact.model": "halfspace", "contact.extrapolate": False, "contact.strips": 121}
    scenario = shipped_scenario("rig-450min", {**raw, "contact.mx": 30})
    found = wearsim.study_contact(scenario, with_error=True)
    finer = wearsim.solve_contact(shipped_scenario("rig-450min", {**raw, "contact.mx": 120}))
    true = abs(found.solution.power / finer.power - 1.0)
    assert 5e-5 < true < found.grid_error < 5.0 * true
    # the changes with half the strips and with half the elements are added without their signs
    bronze = {"roller.material": "bronze", "creepage.yaw": "0.2 mrad", "friction.coefficient": 0.3}
    errors = [
        wearsim.study_contact(
            shipped_scenario(
                "rig-450min", {"contact.model": "halfspace", "contact.mx": mx, **bronze}
            ),
            with_error=True,
        ).grid_error
        for mx in (12, 24)
    ]
    assert min(errors) > 5e-4


def test_extrapolation_leaves_a_part_of_the_error():
    point = OperatingPoint(300.0, 1.0, Creepage(4e-4, 5e-4, 0.05), 0.1)

    def power(**options):
        return solved(lambda y: y**2, 90.0, point, 61, **options)[0].power

    known = power(mx=160)
    for mx, rest in ((24, 4e-3), (47, 2e-3)):
        error = abs(power(mx=mx, order=1) / known - 1.0)
        assert error < rest
        assert error < 0.5 * abs(power(mx=mx, order=1, extrapolate=False) / known - 1.0)
    # elements of second order need hardly any
    for extrapolate in (False, True):
        assert power(mx=24, extrapolate=extrapolate) == pytest.approx(known, rel=4e-4)
        assert power(mx=47, extrapolate=extrapolate) == pytest.approx(known, rel=2e-4)


def test_plugin_loads_no_transforms_before_a_solution():
    code = (
        "import sys, wearsim_halfspace; print([m for m in sys.modules if m.startswith('scipy.')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"scipy.fft", "scipy.special", "scipy.optimize"} & set(literal_eval(done.stdout))
