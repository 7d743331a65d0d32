"""Checks of a study of realisations before any input is drawn."""

from __future__ import annotations

import operator

from wearsim.errors import Mistake, ScenarioError
from wearsim.scenario import Scenario

MOST_BYTES = 4_000_000_000
"""Memory limit for the results of a study."""

# measured while the file is written: numbers per realisation, and per random input of a realisation
_NUMBERS, _NUMBERS_OF_A_DRAW = 17, 2


def checked_count(scenario: Scenario, realisations: int) -> int:
    """Return the number of realisations as an int.

    Parameters
    ----------
    scenario : Scenario
    realisations : int
        As requested.

    Raises
    ------
    TypeError
        If `scenario` is not a Scenario, or `realisations` not a whole number.
    ValueError
        If `realisations` is below 1.
    ScenarioError
        If the results would not fit into memory.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(
            f"scenario must be a Scenario, got {scenario!r}; wearsim.load_scenario reads one"
        )
    try:
        count = operator.index(realisations)
    except TypeError:
        what = f"realisations must be a whole number such as 1000, got {realisations!r}"
        raise TypeError(what) from None
    if count < 1:
        raise ValueError(f"realisations must be 1 or more, got {count}")
    size = bytes_per_realisation(scenario)
    if count * size > MOST_BYTES:
        what = f"would take {count * size / 1e9:,.4g} GB of memory, {size} bytes each"
        most = f"at most {MOST_BYTES // size}, which take {MOST_BYTES / 1e9:g} GB"
        raise ScenarioError(scenario.file, [Mistake("", "realisations", what, str(count), most)])
    return count


def bytes_per_realisation(scenario: Scenario) -> int:
    """Return the memory of a realisation without P_l(y), which is kept for some of them only."""
    drawn = sum(len(item.keys) for item in scenario.random if item.role != "field")
    return 8 * (_NUMBERS + _NUMBERS_OF_A_DRAW * drawn)


def nothing_random(what: str) -> Mistake:
    """Return the mistake of a scenario without effective random inputs."""
    expected = (
        "a distribution instead of a value, such as friction.coefficient ="
        ' {distribution = "maxent", support = [0, "inf"], mean = 0.1, std = 0.02}'
    )
    return Mistake("", "", what, None, expected)
