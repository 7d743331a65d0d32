"""The smallest scenario that breaks an invariant."""

from __future__ import annotations

import time
from dataclasses import replace

from wearsim.errors import ScenarioError
from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.random.invariants import measured
from wearsim_bench.stated_errors.random_tests import RandomTest

MOST_SECONDS = 120.0  # process time after which no further change is left out


def smallest(test: RandomTest, row: Measurement) -> RandomTest:
    """Return a test with as few changes of its shipped scenario as break the same invariant.

    Each change is left out in turn, until none can be.

    Parameters
    ----------
    test : RandomTest
        The test.
    row : Measurement
        Its failed measurement, whose setting is the invariant.
    """
    begin, reduced = time.process_time(), True
    while reduced:
        reduced = False
        for key in list(test.changes):
            if time.process_time() - begin > MOST_SECONDS:
                return test
            less = {name: value for name, value in test.changes.items() if name != key}
            simpler = replace(test, changes=less)
            try:
                scenario = simpler.scenario()
            except ScenarioError:
                continue
            if measured(row.setting, scenario, row).failed:
                test, reduced = simpler, True
    return test
