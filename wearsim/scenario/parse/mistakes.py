"""Collection of all mistakes of a scenario, for one error message."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import ConfigDict

from wearsim.errors import Mistake, ScenarioError
from wearsim.plugins import Options

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from wearsim.scenario.parse.suggestions import Names
    from wearsim.scenario.random.model import RandomInput


class Table(Options):
    """Base of the scenario's own tables."""

    model_config = ConfigDict(allow_inf_nan=False)


class Report:
    """Everything that is wrong with one scenario, and the random inputs found on the way.

    Parameters
    ----------
    file : str
        The scenario's file, for messages.
    read : callable
        Returns the content of a file that the scenario names.
    names : Names
        The keys and tables there are, for suggestions.

    Attributes
    ----------
    random : list of RandomInput
        The random inputs.
    tried : set of str
        Dotted keys where a random input stands, be it right or wrong.
    means : dict of str to object
        What took the place of the random inputs, as written, by dotted key; None for nothing.
    """

    def __init__(self, file: str, read: Callable[[str], str], names: Names) -> None:
        self.file = file
        self.names = names
        self.mistakes: list[Mistake] = []
        self.notes: list[str] = []
        self.random: list[RandomInput] = []
        self.tried: set[str] = set()
        self.means: dict[str, object] = {}
        self.read = read

    def add(
        self,
        table: str,
        key: str,
        what: str,
        got: str | None = None,
        expected: str | None = None,
    ) -> None:
        """Note one mistake."""
        self.mistakes.append(Mistake(table, key, what, got, expected))

    def raise_any(self) -> None:
        """Raise a ScenarioError if there is any mistake."""
        if self.mistakes:
            raise ScenarioError(self.file, self.mistakes)

    def exactly_one(self, raw: Mapping[str, object], table: str, keys: tuple[str, ...]) -> None:
        """Note a mistake unless exactly one of `keys` is given."""
        given = [key for key in keys if key in raw]
        if len(given) != 1:
            got = " and ".join(given) or "none"
            self.add(table, " or ".join(keys), "exactly one is needed", got)

    def add_file(self, error: ScenarioError, table: str, key: str) -> None:
        """Note the mistakes of a file that the table's `key` names."""
        for problem in error.mistakes:
            what = f"{error.file} {problem}" if problem.key else f"{error.file}: {problem}"
            self.add(table, key, what)
