"""What to ask for where the points of a contact are too far apart for its friction field."""

from __future__ import annotations

from collections.abc import Callable

from wearsim.plugins import FrictionField
from wearsim.scenario import Scenario

_MOST = 2**20  # points that are tried


def finer_grid(
    scenario: Scenario, friction: FrictionField, points: int, along: float, across: float
) -> str:
    """Return the settings with which a grid resolves a friction field.

    Parameters
    ----------
    scenario : Scenario
    friction : FrictionField
    points : int
        Points along rolling in each strip.
    along, across : float
        Their spacing, and the width of a strip [m].

    Returns
    -------
    str
        "contact.my = 124": of either direction that is too coarse, the key and its least value.
    """
    choice = scenario.contact
    settings = []
    if friction.unresolved(along, 0.0) is not None:
        needed = _least(points, lambda count: friction.unresolved(along * points / count, 0.0))
        named = hasattr(choice.options, "mx")
        settings.append(f"contact.mx = {needed}" if named else f"{needed} points along rolling")
    if friction.unresolved(0.0, across) is not None:
        strips = choice.strips or getattr(choice.options, "my", None)
        key = "contact.strips" if choice.strips else "contact.my"
        if strips is None:
            settings.append("more contact.strips")
        else:
            needed = _least(strips, lambda count: friction.unresolved(0.0, across * strips / count))
            settings.append(f"{key} = {needed}")
    return " and ".join(settings)


def _least(count: int, wrong: Callable[[int], str | None]) -> int:
    """Return the least count beyond a wrong one that is not wrong."""
    refused, taken = count, 2 * count
    while wrong(taken) is not None and taken < _MOST:
        refused, taken = taken, 2 * taken
    while taken - refused > 1:
        middle = (refused + taken) // 2
        if wrong(middle) is None:
            taken = middle
        else:
            refused = middle
    return taken
