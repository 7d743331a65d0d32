"""Verbs that other distributions add, through the entry-point group ``wearsim.commands``.

The name of an entry point is the verb, its value is a `typer.Typer` app. The help lists the verbs
from the metadata of their distributions; only the verb that is called is imported.
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import typer
from typer.core import TyperCommand

from wearsim.errors import PluginError

GROUP = "wearsim.commands"
FIRST_PARTY = {"bench": "wearsim-bench", "reproduce": "wearsim-chevalier2005"}


class InstalledVerb(TyperCommand):
    """The help line of a verb whose code has not been imported."""

    def __init__(self, name: str, points: tuple[EntryPoint, ...]) -> None:
        super().__init__(name, help="; ".join(_summary(point) for point in points))
        self.points = points

    def load(self) -> Any:
        """Import the verb and return its command.

        Raises
        ------
        PluginError
            If two distributions bring the verb, or if it cannot be imported.
        """
        names = [_distribution(point) for point in self.points]
        if len(names) > 1:
            raise PluginError(
                f"the verb '{self.name}' is brought by {' and by '.join(names)}; uninstall one"
            )
        try:
            app = self.points[0].load()
            if not isinstance(app, typer.Typer):
                raise TypeError(f"{self.points[0].value} is not a Typer app")
            command = typer.main.get_command(app)
        except Exception as error:
            raise PluginError(
                f"the verb '{self.name}' of {names[0]} cannot be loaded:"
                f" {type(error).__name__}: {error}; update or uninstall it"
            ) from error
        command.name = self.name
        return command


@cache
def installed_verbs() -> dict[str, InstalledVerb]:
    """Return the verbs of all installed distributions, by name."""
    points = sorted(entry_points(group=GROUP), key=lambda point: (point.name, point.value))
    return {
        name: InstalledVerb(name, tuple(point for point in points if point.name == name))
        for name in sorted({point.name for point in points})
    }


def missing_verb(name: str) -> str | None:
    """Return how to install a verb that is known but not installed, or None."""
    distribution = FIRST_PARTY.get(name)
    if distribution is None:
        return None
    extra = distribution.removeprefix("wearsim-")
    return (
        f"No such command '{name}'. It is part of {distribution}: pip install 'wearsim[{extra}]',"
        f" or pip install ./plugins/{distribution} from a clone."
    )


def _distribution(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist else "an unknown distribution"


def _summary(point: EntryPoint) -> str:
    if point.dist is None or "Summary" not in point.dist.metadata:
        return f"From {_distribution(point)}."
    return point.dist.metadata["Summary"]
