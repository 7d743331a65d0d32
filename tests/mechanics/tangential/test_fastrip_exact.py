"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
import pytest
from test_fastrip import from_contact

from wearsim_bench.exact_solutions import rows, table


def test_fastrip_of_contact_agrees_for_weak_spin():
    errors = from_contact(rows("rig_random", kind="paper"), published=False)
    assert np.sqrt(np.mean(errors**2)) < 0.003
    whole = table("mean_problem")
    mean = [{**whole, **case} for case in whole["rows"]]
    assert from_contact(mean, published=False) == pytest.approx(0.0, abs=5e-3)
    # without spin; the coefficients of CONTACT at a/b = 10 are different
    without_spin = [
        c for c in rows("hard_cases") if c["phi_per_m"] == 0.0 and c["b_m"] > 0.2 * c["a_m"]
    ]
    assert len(without_spin) == 6
    assert from_contact(without_spin, published=False) == pytest.approx(0.0, abs=1e-3)


def test_strong_spin_differs_from_contact_by_the_amendment_only():
    partial = rows("rig_random", kind="partial")
    errors = from_contact(partial, published=True)
    assert np.sqrt(np.mean(errors**2)) < 0.009
    own = from_contact(partial, published=False)
    assert np.sqrt(np.mean(own**2)) > 5.0 * np.sqrt(np.mean(errors**2))
