"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
import pytest

from tests.reference import half_space
from tests.reference.test_half_space import MODULUS, difference
from wearsim_bench.exact_solutions import WORN, worn_profile


@pytest.mark.parametrize("name", WORN)
def test_worn_profile_equals_solution_of_contact(name):
    exact = worn_profile(name)
    edge = np.abs(exact["y"]).max()
    y = (np.arange(400) + 0.5) / 200.0 * edge - edge
    gap = np.interp(y, exact["y"], exact["w"])
    found = half_space.solve(gap, y, 45.0, 300.0, MODULUS, 1.2 * exact["a"].max())
    q = np.interp(exact["y"], y, found.line_load)
    a = np.interp(exact["y"], y, found.half_length)
    assert difference(q, exact["q"]) < 3e-3
    assert difference(a, exact["a"]) < 3e-3
    assert found.approach == pytest.approx(exact["approach"], rel=2e-5)
    assert found.peak_pressure == pytest.approx(exact["peak_pressure"], rel=1e-3)
