"""Which keys and tables there are, to say what a misspelt or misplaced one was meant to be."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Collection, Mapping
from functools import cached_property


class Names:
    """The keys of every table.

    Parameters
    ----------
    find : callable
        Returns the keys of each table, by the table as a message names it: "[load]"; called with
        the first mistake.
    """

    def __init__(self, find: Callable[[], Mapping[str, Collection[str]]]) -> None:
        self._find = find

    @cached_property
    def _places(self) -> Mapping[str, Collection[str]]:
        return self._find()

    def hint(self, key: str, here: Collection[str]) -> str:
        """Return a hint in parentheses for an unknown key of a table with the keys `here`."""
        homes = [place for place, keys in self._places.items() if key in keys]
        if homes:
            return f" (it belongs in {' or '.join(homes)})"
        near = self.near(key, here)
        if near:
            return near
        elsewhere = difflib.get_close_matches(
            key, {name for keys in self._places.values() for name in keys}, n=1
        )
        if elsewhere:
            homes = [place for place, keys in self._places.items() if elsewhere[0] in keys]
            return f" (did you mean '{elsewhere[0]}' of {' or '.join(homes)}?)"
        return f" (known here: {', '.join(sorted(here))})" if here else ""

    @staticmethod
    def near(name: str, known: Collection[str]) -> str:
        """Return the nearest of the `known` names as a hint in parentheses, or nothing."""
        found = difflib.get_close_matches(name, known, n=1)
        return f" (did you mean '{found[0]}'?)" if found else ""
