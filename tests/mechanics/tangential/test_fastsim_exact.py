"""Comparison with exact solutions of the data of wearsim-bench."""

import pytest
from test_fastsim import SPEED, rig

from wearsim.mechanics.tangential.fastsim import closed_form
from wearsim_bench.exact_solutions import rows, table


@pytest.mark.parametrize("bound", ["par", "ell"])
@pytest.mark.parametrize("case", rows("mean_problem")[:2], ids=lambda case: case["case"])
def test_closed_form_meets_the_fastsim_quadrature_of_contact(case, bound):
    mean = table("mean_problem")
    here = rig(
        strips=4000,
        xi=case["xi"],
        elliptic=bound == "ell",
        curvatures=(mean["A_per_m"], mean["B_per_m"]),
    )
    found = here.power(closed_form(*here.arguments[:5])) / SPEED
    assert found == pytest.approx(case[f"fastsim_{bound}_exact_P_over_V_N"], rel=2e-6)
