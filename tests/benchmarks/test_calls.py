"""Calls of functions by a step, which are most of the time of a short test."""

import wearsim
from tests.benchmarks.calls import RIG, SCENARIOS, calls_per_step

# measured: 300 and 119. Calls in C depend on the versions of Python and numpy, and the tests call
# each kernel through one more function where they run in several processes
MOST, MOST_OWN = 335, 125


def test_a_step_takes_few_calls() -> None:
    every, own = calls_per_step(lambda: wearsim.run(SCENARIOS / f"{RIG}.toml"))
    assert every <= MOST
    assert own <= MOST_OWN
