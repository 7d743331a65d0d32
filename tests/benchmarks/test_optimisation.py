"""Small versions of the measurements of `tests.benchmarks.optimisation`."""

from __future__ import annotations

import pytest

from tests.benchmarks import optimisation

pytest.importorskip("wearsim_optimise")
pytestmark = pytest.mark.bench


def test_peak_pressure_of_a_roller_is_within_one_per_cent_of_a_grid():
    # three values of each on few strips, aligned: the search is not worse than the grid
    (row,) = optimisation.profiles(3, 65, (65,), ("0 mrad",))
    assert float(row[5]) <= 1.01 * float(row[4])
    assert row[-1] == row[5]
