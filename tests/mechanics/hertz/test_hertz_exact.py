"""Comparison with exact solutions of the data of wearsim-bench."""

import pytest
from test_hertz import MODULUS

from wearsim.mechanics.hertz.ellipse import hertz
from wearsim_bench.exact_solutions import rows


@pytest.mark.parametrize("case", rows("hertz"))
def test_reference_cases_are_met(case):
    patch = hertz(case["A_per_m"], case["B_per_m"], case["N_N"], MODULUS)
    assert patch.a == pytest.approx(case["a_m"], rel=1e-12, abs=0.0)
    assert patch.b == pytest.approx(case["b_m"], rel=1e-12, abs=0.0)
    assert patch.peak_pressure == pytest.approx(case["p0_Pa"], rel=1e-12)
    assert patch.approach == pytest.approx(case["approach_m"], rel=1e-12, abs=0.0)
    assert patch.peak_pressure == pytest.approx(case["numerical_pmax_Pa"], rel=5e-3)
