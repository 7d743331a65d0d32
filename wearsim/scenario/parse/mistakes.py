"""Collection of all mistakes of a scenario, for one error message."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Collection, Mapping
from functools import cached_property
from typing import TypeVar

from pydantic import ConfigDict

from wearsim.errors import Mistake, PluginError, ScenarioError
from wearsim.plugins import Options, Spec, registry
from wearsim.scenario.random.model import RandomInput

S = TypeVar("S", bound=Spec)


class Table(Options):
    """Base class of the scenario's own tables."""

    model_config = ConfigDict(allow_inf_nan=False)


class Mistakes:
    """Collector of the mistakes, notes and random inputs of one scenario.

    Parameters
    ----------
    file : str
        The scenario's file, for messages.
    read : callable
        Returns the content of a file that the scenario names.
    find_keys : callable
        Returns the keys of each table by the table's name in messages, "[load]"; called when the
        first suggestion is needed.

    Attributes
    ----------
    entries : list of Mistake
        The mistakes, in the order in which they were found.
    notes : list of str
        Notes on the choices made for the user.
    random : dict of str to RandomInput or None
        The random inputs by dotted key; None for one with mistakes.
    """

    def __init__(
        self,
        file: str,
        read: Callable[[str], str],
        find_keys: Callable[[], Mapping[str, Collection[str]]],
    ) -> None:
        self.file = file
        self.read = read
        self._find_keys = find_keys
        self.entries: list[Mistake] = []
        self.notes: list[str] = []
        self.random: dict[str, RandomInput | None] = {}

    @property
    def random_inputs(self) -> list[RandomInput]:
        """The random inputs without mistakes, in the order of their names."""
        return [item for _, item in sorted(self.random.items()) if item]

    @cached_property
    def _keys(self) -> Mapping[str, Collection[str]]:
        return self._find_keys()

    def add(
        self,
        table: str,
        key: str,
        what: str,
        got: str | None = None,
        expected: str | None = None,
    ) -> None:
        """Add one mistake; the parameters are the fields of `Mistake`."""
        self.entries.append(Mistake(table, key, what, got, expected))

    def add_file(self, error: ScenarioError, table: str, key: str) -> None:
        """Add the mistakes of a file that the table's `key` names."""
        for mistake in error.mistakes:
            what = f"{error.file} {mistake}" if mistake.key else f"{error.file}: {mistake}"
            self.add(table, key, what)

    def raise_any(self) -> None:
        """Raise a ScenarioError if there is any mistake."""
        if self.entries:
            raise ScenarioError(self.file, self.entries)

    def require_one(self, raw: Mapping[str, object], table: str, keys: tuple[str, ...]) -> None:
        """Add a mistake unless exactly one of `keys` is given."""
        given = [key for key in keys if key in raw]
        if len(given) != 1:
            got = " and ".join(given) or "none"
            self.add(table, " or ".join(keys), "exactly one is needed", got)

    def find_plugin(self, kind: type[S], name: str, table: str, key: str) -> S | None:
        """Return the plugin that a table's `key` names, or None after adding a mistake."""
        try:
            return registry().get(kind, name)
        except PluginError as error:
            self.add(table, key, str(error))
            return None

    def hint(self, key: str, here: Collection[str]) -> str:
        """Return a hint in parentheses for an unknown key of a table with the keys `here`."""
        if places := self._places(key):
            return f" (it belongs in {places})"
        if near := nearest(key, here):
            return near
        everywhere = {name for keys in self._keys.values() for name in keys}
        for name in difflib.get_close_matches(key, everywhere, n=1):
            return f" (did you mean '{name}' of {self._places(name)}?)"
        return f" (known here: {', '.join(sorted(here))})" if here else ""

    def _places(self, key: str) -> str:
        """Return the tables that have a key, in words."""
        return " or ".join(place for place, keys in self._keys.items() if key in keys)


def installed(kind: type[S]) -> list[S]:
    """Return the plugins of a kind, in the order of their names."""
    return [registry().get(kind, name) for name in registry().names(kind)]


def nearest(name: str, known: Collection[str]) -> str:
    """Return the most similar of the `known` names as a hint in parentheses, or nothing."""
    similar = difflib.get_close_matches(name, known, n=1)
    return f" (did you mean '{similar[0]}'?)" if similar else ""
