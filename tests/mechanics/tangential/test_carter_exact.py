"""Comparison with exact solutions of the data of wearsim-bench."""

import pytest
from test_carter import force, scaled

from wearsim_bench.exact_solutions import rows


def test_strip_force_meets_carters_law():
    for part in (0.1, 0.4, 0.9, 1.0, 1.5):
        expected = 1.0 - (1.0 - min(part, 1.0)) ** 2
        for d_x, d_y in ((part, 0.0), (0.0, part)):
            found = force(*scaled(d_x, d_y, 0.0))
            assert found[:2] == pytest.approx([-expected * (d_x > 0), -expected * (d_y > 0)])
    exact = rows("carter")[0]["exact"]
    assert force(*scaled(0.4, 0.0, 0.0))[0] == pytest.approx(-exact, rel=1e-12)
