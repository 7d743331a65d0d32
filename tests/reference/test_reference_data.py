"""The reference data are whole, and agree with each other."""

import numpy as np
import pytest

from tests.reference import CREEPAGES, WORN, rig_random_rows, rows, table, worn_profile


@pytest.mark.parametrize("name", WORN)
def test_that_a_worn_profile_carries_its_load_and_its_power(name):
    worn = worn_profile(name)
    dy = worn["y"][1] - worn["y"][0]
    assert worn["q"].sum() * dy == pytest.approx(300.0, rel=1e-6)
    for creepage in CREEPAGES:
        total = worn[f"P_l_over_V_{creepage}"].sum() * dy
        assert total == pytest.approx(worn[f"P_over_V_{creepage}"], rel=5e-3)


def test_that_rows_of_the_random_cases_add_up_to_their_power():
    found = rig_random_rows()
    y = found["y_over_b"]
    for kind in ("paper", "partial"):
        for row, case in zip(found[kind], rows("rig_random", kind=kind), strict=True):
            total = row.sum() * (y[1] - y[0]) * case["b_m"]
            assert total == pytest.approx(case["P_over_V_N"], rel=1e-2)


def test_that_every_force_does_the_power_that_is_given():
    for case in rows("rig_random") + rows("hard_cases"):
        work = -sum(
            case[force] * case[slip]
            for force, slip in (("Fx_N", "xi"), ("Fy_N", "eta"), ("Mz_Nm", "phi_per_m"))
        )
        assert work == pytest.approx(case["P_over_V_N"], rel=2e-2)


def test_that_the_mean_problem_slides_fully():
    mean = table("mean_problem")["rows"][0]
    assert mean["P_over_V_N"] == pytest.approx(0.1 * 300.0 * 1e-3, rel=1e-3)
    assert np.max(mean["P_l_over_V_N_per_m"]) > 0.0
