"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
import pytest
from test_slender_half_lengths import solved

from wearsim_bench.exact_solutions import WORN, worn_profile


@pytest.mark.parametrize("name", WORN)
def test_worn_half_lengths_agree_with_exact_theory(name):
    exact = worn_profile(name)
    found = solved(lambda y: np.interp(y, exact["y"], exact["w"]), 4e-3, 321, curvature=45.0)
    q = np.interp(exact["y"], found.y, found.line_load)
    a = np.interp(exact["y"], found.y, found.half_length)
    assert np.abs(q - exact["q"]).sum() < 0.006 * exact["q"].sum()
    assert np.abs(a - exact["a"]).sum() < 0.005 * exact["a"].sum()
    assert found.approach == pytest.approx(exact["approach"], rel=1e-4)
    # the parabola has a kink, where the exact pressure has a logarithmic peak
    bound = 0.06 if name == "parabola" else 2e-3
    assert found.peak_pressure == pytest.approx(exact["peak_pressure"], rel=bound)
