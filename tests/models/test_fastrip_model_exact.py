"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
import pytest
from test_fastrip_model import PAIR, contact, errors, hard, rms

from wearsim.models.tangential.base import Strips, complete
from wearsim.models.tangential.fastsim import FastripTheory
from wearsim.types import Creepage, OperatingPoint
from wearsim_bench.exact_solutions import CREEPAGES, rows, strips_of, worn_profile


@pytest.mark.parametrize(
    ("kind", "bound", "worst"), [("paper", 2e-3, 3e-3), ("partial", 5e-3, 0.012)]
)
def test_rig_power_agrees_with_exact_theory(kind, bound, worst):
    found = errors(rows("rig_random", kind=kind), contact)
    assert rms(found) < bound
    assert np.abs(found).max() < worst


@pytest.mark.parametrize("kind", ["paper", "partial"])
def test_rig_dissipation_profile_agrees_with_exact_theory(kind):
    y_over_b, exact = strips_of(kind)
    distances = []
    for number, case in enumerate(rows("rig_random", kind=kind)):
        *_, solution = contact(case)
        place = solution.y / (solution.y[-1] + 0.5 * (solution.y[1] - solution.y[0]))
        expected = np.interp(place, y_over_b, exact[number])
        off = np.linalg.norm(solution.dissipation - expected)
        distances.append(off / np.linalg.norm(expected))
    assert np.median(distances) < 0.022


def test_hard_cases_are_within_three_percent_rms():
    cases = rows("hard_cases")
    found = errors(cases, hard)
    assert rms(found) < 0.02
    assert np.abs(found).max() < 0.055
    # the range of strip theory: long across rolling, or creepage that dominates spin
    long = np.array([case["b_m"] >= 4.9 * case["a_m"] for case in cases])
    assert np.abs(found[long]).max() < 0.01


@pytest.mark.parametrize("name", ["hertz", "flat", "bump_1um", "bump_10um", "parabola"])
@pytest.mark.parametrize("creepage", ["mean", "partial", "combined"])
def test_strips_of_a_worn_profile_are_supported(name, creepage):
    worn = worn_profile(name)
    y = worn["y"]
    strips = Strips(
        y, worn["a"], worn["q"], y[1] - y[0], 45.0, worn["approach"], worn["peak_pressure"], 0
    )
    point = OperatingPoint(300.0, 1.0, Creepage(*CREEPAGES[creepage]), 0.1)
    found = complete(FastripTheory(), strips, PAIR, point)
    assert found.power == pytest.approx(worn[f"P_over_V_{creepage}"], rel=0.02)
    expected = worn[f"P_l_over_V_{creepage}"]
    assert np.linalg.norm(found.dissipation - expected) < 0.065 * np.linalg.norm(expected)
