"""Comparison with exact solutions of the data of wearsim-bench."""

import numpy as np
from test_hertz_model import contact

from wearsim.models.tangential.strip_theory import StripTheory
from wearsim_bench.exact_solutions import rows


def test_default_strip_theory_is_near_exact_theory():
    model, *_ = contact()
    assert isinstance(model.theory, StripTheory)
    errors = []
    for case in rows("rig_random", kind="paper"):
        creepage = case["xi"], case["eta"], case["phi_per_m"]
        *_, found = contact(None, creepage, case["N_N"], case["mu"])
        errors.append(found.power / 2.618 / case["P_over_V_N"] - 1.0)
    assert np.sqrt(np.mean(np.square(errors))) < 5e-3
