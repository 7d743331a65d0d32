"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
import pytest
from test_strip_theory import errors, solve_row

from wearsim_bench.exact_solutions import rows, strips_of, table

MEAN = table("mean_problem")


@pytest.mark.parametrize(
    ("kind", "rms", "worst", "row_error"),
    [("paper", 5e-4, 1.2e-3, 3e-3), ("partial", 2.2e-3, 6.5e-3, 5e-3)],
)
def test_power_for_random_inputs_meets_the_exact_theory(kind, rms, worst, row_error):
    powers, distances = [], []
    y_over_b, dissipation = strips_of(kind)
    for row, exact in zip(rows("rig_random", kind=kind), dissipation, strict=True):
        y, found = solve_row(row["a_m"], row["b_m"], row["N_N"], row["mu"], row)
        powers.append((found.work.sum() * (y[1] - y[0]), row["P_over_V_N"]))
        ours = np.interp(y_over_b * row["b_m"], y, found.work, left=0.0, right=0.0)
        distances.append(np.linalg.norm(ours - exact) / np.linalg.norm(exact))
    assert len(powers) == 40
    found_rms, found_worst = errors(powers)
    assert found_rms < rms
    assert found_worst < worst
    assert np.median(distances) < row_error
    assert np.max(distances) < 0.03


def test_power_of_hard_cases_on_wide_patches_meets_exact_theory():
    powers = []
    for row in rows("hard_cases"):
        if row["b_m"] >= 2.99 * row["a_m"]:
            y, found = solve_row(row["a_m"], row["b_m"], row["N_N"], row["mu"], row)
            powers.append((found.work.sum() * (y[1] - y[0]), row["P_over_V_N"]))
    assert len(powers) == 7
    rms, worst = errors(powers)
    assert rms < 5e-3
    assert worst < 1.2e-2


@pytest.mark.parametrize("row", rows("mean_problem"), ids=lambda row: row["case"])
def test_forces_and_power_of_the_rig_meet_the_exact_theory(row):
    patch = [MEAN[key] for key in ("a_m", "b_m", "N_N", "mu")]
    y, found = solve_row(*patch, row)
    spacing = y[1] - y[0]
    assert found.force_x.sum() * spacing == pytest.approx(row["Fx_N"], rel=4e-3)
    assert found.force_y.sum() * spacing == pytest.approx(row["Fy_N"], rel=4e-3, abs=1e-6)
    assert found.work.sum() * spacing == pytest.approx(row["P_over_V_N"], rel=2e-3)
