"""Completeness and consistency of the reference data."""

import numpy as np
import pytest

from wearsim_bench.exact_solutions import CREEPAGES, WORN, rows, strips_of, table, worn_profile


@pytest.mark.parametrize("name", WORN)
def test_worn_profiles_sum_to_their_load_and_power(name):
    worn = worn_profile(name)
    dy = worn["y"][1] - worn["y"][0]
    assert worn["q"].sum() * dy == pytest.approx(300.0, rel=1e-6)
    for creepage in CREEPAGES:
        total = worn[f"P_l_over_V_{creepage}"].sum() * dy
        assert total == pytest.approx(worn[f"P_over_V_{creepage}"], rel=5e-3)


@pytest.mark.parametrize(
    ("kind", "cases"),
    [
        ("paper", rows("rig_random", kind="paper")),
        ("partial", rows("rig_random", kind="partial")),
        ("hard", rows("hard_cases")),
    ],
)
def test_strips_of_elliptic_cases_sum_to_their_power(kind, cases):
    y, dissipation = strips_of(kind)
    for strips, case in zip(dissipation, cases, strict=True):
        total = strips.sum() * (y[1] - y[0]) * case["b_m"]
        # the hard cases include pure spin and almost full adhesion
        assert total == pytest.approx(case["P_over_V_N"], rel=1.5e-2 if kind == "hard" else 1e-2)


def test_forces_and_creepages_give_the_stated_power():
    for case in rows("rig_random") + rows("hard_cases"):
        work = -sum(
            case[force] * case[slip]
            for force, slip in (("Fx_N", "xi"), ("Fy_N", "eta"), ("Mz_Nm", "phi_per_m"))
        )
        assert work == pytest.approx(case["P_over_V_N"], rel=2e-2)


def test_mean_problem_is_in_full_sliding():
    mean = table("mean_problem")["rows"][0]
    assert mean["P_over_V_N"] == pytest.approx(0.1 * 300.0 * 1e-3, rel=1e-3)
    assert np.max(mean["P_l_over_V_N_per_m"]) > 0.0
