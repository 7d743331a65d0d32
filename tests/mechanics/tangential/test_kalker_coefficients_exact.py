"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
import pytest
from test_kalker_coefficients import NAMES, values

from wearsim_bench.exact_solutions import rows


@pytest.mark.parametrize("case", rows("kalker_coefficients"))
def test_coefficients_meet_the_exact_theory_within_1_5_percent(case):
    found = values(case["a_over_b"], case["nu"])
    for name, value in zip(NAMES, found, strict=True):
        bound = 0.015
        if name == "c33":  # error of the reference; README of the data for a/b >= 5
            bound = max(bound, case["rel_err"]["C33"])
        assert value == pytest.approx(case[name.upper()], rel=bound), name


def test_interpolation_error_is_small_on_average():
    errors = np.array(
        [
            [value / case[name.upper()] - 1.0 for name, value in zip(NAMES, found, strict=True)]
            for case in rows("kalker_coefficients")
            for found in [values(case["a_over_b"], case["nu"])]
        ]
    )
    assert np.sqrt((errors**2).mean(axis=0)) == pytest.approx(0.0, abs=0.008)
