"""Calls of functions by a step, most of the time of a short test, and before the first kernel."""

import wearsim
from tests.benchmarks.calls import RIG, SCENARIOS, calls_per_step, way_to_first_kernel

# measured: 299 and 116. Calls in C depend on the versions of Python and numpy, and the tests call
# each kernel through one more function where they run in several processes
MOST, MOST_OWN = 334, 122
# measured: 20, 8 and 132; each file and each way back up is one more place to read from a value
# of a scenario to a contact
MOST_FILES, MOST_WAYS_UP, MOST_CALLS = 20, 8, 135


def test_a_step_takes_few_calls() -> None:
    every, own = calls_per_step(lambda: wearsim.run(SCENARIOS / f"{RIG}.toml"))
    assert every <= MOST
    assert own <= MOST_OWN


def test_the_way_to_the_first_kernel_is_short() -> None:
    wearsim.run(SCENARIOS / f"{RIG}.toml")  # imports everything
    scenario = wearsim.load_scenario(SCENARIOS / f"{RIG}.toml")
    files, ways_up, calls = way_to_first_kernel(lambda: wearsim.run(scenario))
    assert files <= MOST_FILES
    assert ways_up <= MOST_WAYS_UP
    assert calls <= MOST_CALLS
