"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
import pytest
from test_slender_model import SPEED, contact

from wearsim.types import Grid
from wearsim_bench.exact_solutions import CREEPAGES, WORN, rows, worn_profile


def test_forces_and_slip_have_the_signs_of_exact_theory():
    for row in rows("mean_problem", case="combined"):
        *_, solution = contact(
            gap=lambda y: 0.5 * y**2,
            curvature=45.0,
            grid=Grid.spanning(-2.4e-3, 2.4e-3, 121),
            creepage={
                "longitudinal": row["xi"],
                "lateral": row["eta"],
                "spin": row["phi_per_m"],
            },
        )
        assert solution.force_x == pytest.approx(row["Fx_N"], rel=5e-3)
        assert solution.force_y == pytest.approx(row["Fy_N"], rel=5e-3)
        # the moment is a small difference of two large terms
        assert solution.spin_moment == pytest.approx(row["Mz_Nm"], rel=0.1)
        assert solution.power / SPEED == pytest.approx(row["P_over_V_N"], rel=3e-3)


@pytest.mark.parametrize("name", WORN)
def test_worn_line_loads_agree_with_exact_theory(name):
    exact = worn_profile(name)
    *_, solution = contact(
        grid=Grid.spanning(-4e-3, 4e-3, 321),
        gap=lambda y: np.interp(y, exact["y"], exact["w"]),
        curvature=45.0,
    )
    q = np.interp(exact["y"], solution.y, solution.line_load)
    assert np.abs(q - exact["q"]).sum() / exact["q"].sum() < 0.03
    assert solution.approach == pytest.approx(exact["approach"], rel=0.01)


@pytest.mark.parametrize("name", WORN)
@pytest.mark.parametrize("case", list(CREEPAGES))
def test_worn_dissipation_agrees_with_exact_theory(name, case):
    exact = worn_profile(name)
    xi, eta, phi = CREEPAGES[case]
    *_, solution = contact(
        grid=Grid.spanning(-4e-3, 4e-3, 321),
        gap=lambda y: np.interp(y, exact["y"], exact["w"]),
        curvature=45.0,
        creepage={"longitudinal": xi, "lateral": eta, "spin": phi},
    )
    assert solution.power / SPEED == pytest.approx(exact[f"P_over_V_{case}"], rel=6e-3)
    rows_exact = exact[f"P_l_over_V_{case}"]
    ours = np.interp(exact["y"], solution.y, solution.dissipation) / SPEED
    # the parabola has a kink, at which the error of the line load is as large
    limit = 0.035 if name == "parabola" else 0.016
    assert np.linalg.norm(ours - rows_exact) < limit * np.linalg.norm(rows_exact)
