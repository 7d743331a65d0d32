"""Comparison with exact solutions of the data of wearsim-bench."""

import pytest
from test_semi_hertzian_model import LINE_LOAD, VARIANTS, carried_on, contact, difference

from wearsim.types import Grid
from wearsim_bench.exact_solutions import CREEPAGES, WORN, worn_profile


def on_worn(variant, name, creepage):
    exact = worn_profile(name)
    grid = Grid.spanning(-4e-3, 4e-3, 321)
    *_, solution = contact(variant, grid, lambda y: carried_on(exact, y), creepage, curvature=45.0)
    return exact, solution


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("name", WORN)
def test_worn_line_loads_are_near_exact_theory(variant, name):
    exact, solution = on_worn(variant, name, {"longitudinal": 1e-3})
    allowed = LINE_LOAD[variant][WORN.index(name)] / 100.0
    assert difference(exact, solution, "q", "line_load") < allowed
    bottom = exact["w"].min()
    found = (solution.approach - bottom) / (exact["approach"] - bottom)
    assert found == pytest.approx(1.0, abs=0.17 if name == "parabola" else 0.07)
    if variant != "kik-piotrowski":
        assert difference(exact, solution, "a", "half_length") < 0.07


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("case", list(CREEPAGES))
def test_worn_dissipation_is_near_exact_theory(variant, case):
    longitudinal, lateral, spin = CREEPAGES[case]
    kik = variant == "kik-piotrowski"
    for name in WORN:
        creepage = {"longitudinal": longitudinal, "lateral": lateral, "spin": spin}
        exact, solution = on_worn(variant, name, creepage)
        power = solution.power / 2.6
        assert power == pytest.approx(exact[f"P_over_V_{case}"], rel=0.14 if kik else 0.025)
        scaled = {**exact, "rows": 2.6 * exact[f"P_l_over_V_{case}"]}
        assert difference(scaled, solution, "rows", "dissipation", 2) < (0.32 if kik else 0.21)
