"""What a study of realisations is asked for, checked before anything is drawn."""

from __future__ import annotations

import operator

from wearsim.errors import Mistake, ScenarioError
from wearsim.scenario import Scenario

MOST_BYTES = 4_000_000_000
"""Memory that the numbers of a study may take."""

# numbers per realisation, as measured: of the solution and its statistics, and of each drawn value
_NUMBERS, _NUMBERS_OF_A_DRAW = 20, 3


def checked_count(scenario: Scenario, realisations: int) -> int:
    """Return how many realisations there will be.

    Parameters
    ----------
    scenario : Scenario
    realisations : int
        As asked for.

    Raises
    ------
    TypeError
        If the one is no scenario, or the other no whole number.
    ValueError
        If there would be none.
    ScenarioError
        If their numbers do not fit into memory.
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
    each = bytes_of_each(scenario)
    if count * each > MOST_BYTES:
        what = f"would take {count * each / 1e9:,.4g} GB of memory, {each} bytes each"
        most = f"at most {MOST_BYTES // each}, which take {MOST_BYTES / 1e9:g} GB"
        problem = Mistake("", "realisations", what, str(count), most)
        raise ScenarioError(scenario.file, [problem])
    return count


def bytes_of_each(scenario: Scenario) -> int:
    """Return how much memory a realisation takes, but for P_l(y), of which only some are kept."""
    drawn = sum(len(item.keys) for item in scenario.random if item.role != "field")
    return 8 * (_NUMBERS + _NUMBERS_OF_A_DRAW * drawn)
