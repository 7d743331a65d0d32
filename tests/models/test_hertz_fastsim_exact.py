"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
import pytest
from hertz_fastsim_examples import MATERIALS, PAIR, SPEED, contact

from wearsim.models.contact.hertz import strips_over_patch
from wearsim.models.contact.hertz_fastsim import HertzFastsim, HertzFastsimOptions
from wearsim.models.tangential.base import Strips, complete
from wearsim.models.tangential.fastsim import FastsimTheory
from wearsim.types import Creepage, OperatingPoint
from wearsim_bench.exact_solutions import rows, table, worn_profile


def test_kalker_table_changes_the_power_by_under_0_002():
    power = {name: contact(kalker=name)[-1].power for name in ("table", "line-limit")}
    assert 1e-4 < power["table"] / power["line-limit"] - 1.0 < 2e-3


@pytest.mark.parametrize(
    ("bound", "kind", "rms", "from_contact"),
    [
        ("parabolic", "paper", 0.037, 0.01),
        ("elliptic", "paper", 0.0499, 0.015),
        ("parabolic", "partial", 0.057, 0.025),
        ("elliptic", "partial", 0.078, 0.025),
    ],
)
def test_error_against_exact_theory_is_the_known_one(bound, kind, rms, from_contact):
    # the FASTSIM of CONTACT has flexibilities that depend on creepage, hence the small difference
    exact, other = [], []
    for case in rows("rig_random", kind=kind):
        creepage = (case["xi"], case["eta"], case["phi_per_m"])
        *_, solution = contact(None, creepage, case["N_N"], case["mu"], bound=bound)
        exact.append(solution.power / SPEED / case["P_over_V_N"] - 1.0)
        other.append(solution.power / SPEED / case[f"fastsim_{bound[:3]}_P_over_V_N"] - 1.0)
    assert np.sqrt(np.mean(np.square(exact))) == pytest.approx(rms, rel=0.03)
    assert np.sqrt(np.mean(np.square(other))) < from_contact


@pytest.mark.parametrize(("bound", "rms"), [("parabolic", 0.093), ("elliptic", 0.030)])
def test_errors_of_hard_cases_are_those_of_kalkers_fastsim(bound, rms):
    errors = []
    for case in rows("hard_cases"):
        creepage = Creepage(case["xi"], case["eta"], case["phi_per_m"])
        curvatures = 2.0 * case["A_per_m"], 2.0 * case["B_per_m"]
        options = HertzFastsimOptions(mx=200, my=100, bound=bound)
        grid = strips_over_patch(options, curvatures[1], curvatures[0], case["N_N"], MATERIALS)
        model = HertzFastsim(options, grid, MATERIALS)
        point = OperatingPoint(case["N_N"], 1.0, creepage, case["mu"])
        power = model.solve_one(0.5 * curvatures[1] * grid.y**2, curvatures[0], point).power
        errors.append(power / case["P_over_V_N"] - 1.0)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(rms, rel=0.03)


@pytest.mark.parametrize("flexibility", ["three", "one"])
@pytest.mark.parametrize(("bound", "rate"), [("parabolic", 0.12), ("elliptic", 0.25)])
def test_march_converges_to_the_reference_quadrature(bound, rate, flexibility):
    whole = table("mean_problem")
    c11 = 8.0 * whole["a_m"] / (3.0 * 1.6889956260024387e-15 * PAIR.shear_modulus)
    given = {"c11": c11, "c22": 2.5, "c23": 0.5}
    for case in whole["rows"][:2]:
        for mx in (10, 25, 50, 100, 200):
            options = HertzFastsimOptions(
                mx=mx, my=1200, bound=bound, flexibility=flexibility, closed_form="never",
                kalker_coefficients=given,
            )  # fmt: skip
            grid = strips_over_patch(options, 1.0, 45.0, 300.0, MATERIALS)
            model = HertzFastsim(options, grid, MATERIALS)
            point = OperatingPoint(300.0, 1.0, Creepage(case["xi"]), 0.1)
            power = model.solve_one(0.5 * grid.y**2, 45.0, point).power
            error = power / case[f"fastsim_{bound[:3]}_exact_P_over_V_N"] - 1.0
            assert abs(error) < rate / mx**2


@pytest.mark.parametrize("name", ["flat", "bump_1um", "bump_10um", "parabola"])
def test_fastsim_supports_strips_of_a_worn_profile(name):
    worn = worn_profile(name)
    y = worn["y"]
    strips = Strips(
        y, worn["a"], worn["q"], y[1] - y[0], 45.0, worn["approach"], worn["peak_pressure"], 0
    )
    point = OperatingPoint(300.0, 1.0, Creepage(1e-3), 0.1)
    found = complete(FastsimTheory("elliptic"), strips, PAIR, point)
    assert found.power == pytest.approx(worn["P_over_V_mean"], rel=0.05)
