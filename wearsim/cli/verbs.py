"""Verbs, imported when called: those of wearsim and those of other distributions.

Another distribution adds a verb through the entry-point group ``wearsim.commands``: the name of
the entry point is the verb, its value a `typer.Typer` app, and the help line the summary of the
distribution.
"""

from __future__ import annotations

from abc import abstractmethod
from importlib import import_module
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperCommand

from wearsim.errors import PluginError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint  # slow to import

GROUP = "wearsim.commands"
#: distributions of this project that add a verb
FIRST_PARTY = {"bench": "wearsim-bench", "reproduce": "wearsim-chevalier2005"}


#: built-in verbs with their help lines, in the order of the help
BUILT_IN = {
    "check": "Check a scenario: print all mistakes, or what will run.",
    "contact": "Solve one contact: the first roller at the start of the load.",
    "dissipation": "Solve one contact for many realisations of its random inputs.",
    "run": "Run a wear test and write its results file.",
    "ensemble": "Run a wear test for each realisation of the random inputs.",
    "resume": "Continue a run or an ensemble from its results file.",
    "show": "Show the content of a results file and the end state.",
    "plot": "Draw the figure of a results file of any kind.",
    "compare": "Compare runs and ensembles, with confidence intervals.",
    "export": "Write a results file as CSV, with units in the headers.",
    "maxent": "Compute a maximum-entropy distribution from moments.",
    "plugins": "List contact models, wear laws, loads and random inputs.",
    "schema": "Write the JSON Schema of a scenario, for editors.",
    "new": "Create a new plugin or scenario.",
}


class LazyVerb(TyperCommand):
    """Help line of a verb whose code is imported when the verb is called."""

    @abstractmethod
    def load(self) -> typer.Typer:
        """Import the verb and return its app."""

    def make_context(self, *args: Any, **kwargs: Any) -> Any:
        """Import the verb and return the context of its command, with the arguments parsed."""
        command = typer.main.get_command(self.load())
        command.name = self.name
        # Typer adds them to every app; they would install the completion of `wearsim`
        completion = ("install_completion", "show_completion")
        command.params = [item for item in command.params if item.name not in completion]
        return command.make_context(*args, **kwargs)


class BuiltInVerb(LazyVerb):
    """Verb of wearsim, in the module of its name in `wearsim.cli.commands`."""

    def __init__(self, name: str) -> None:
        super().__init__(name, help=BUILT_IN[name])

    def load(self) -> typer.Typer:
        """Import the verb and return its app."""
        verb = getattr(import_module(f"wearsim.cli.commands.{self.name}"), str(self.name))
        if isinstance(verb, typer.Typer):
            return verb
        app = typer.Typer(rich_markup_mode=None)
        app.command()(verb)
        return app


class InstalledVerb(LazyVerb):
    """Verb of another distribution.

    Parameters
    ----------
    name : str
        The verb.
    points : list of EntryPoint
        All entry points of this name; more than one is an error once the verb is called.
    """

    def __init__(self, name: str, points: list[EntryPoint]) -> None:
        super().__init__(name, help="; ".join(map(_summary, points)))
        self.points = points

    def load(self) -> typer.Typer:
        """Import the verb and return its app, or raise a PluginError."""
        point, name = self.points[0], f"the verb '{self.name}'"
        distributions = sorted(map(_distribution, self.points))
        if len(self.points) > 1:
            raise PluginError(
                f"{name} is added by {' and by '.join(distributions)}; uninstall one of them"
            )
        try:
            app = point.load()
            if not isinstance(app, typer.Typer):
                raise TypeError(f"{point.value} is a {type(app).__name__}, expected a typer.Typer")
            typer.main.get_command(app)  # an app without commands cannot be called
        except (Exception, SystemExit) as error:  # an import may even end the process
            raise PluginError(
                f"{name} of {distributions[0]} cannot be loaded:"
                f" {type(error).__name__}: {error}; update or uninstall it"
            ) from error
        return app


def installed_verbs() -> dict[str, InstalledVerb]:
    """Return the verbs of all installed distributions by name, sorted."""
    from importlib.metadata import entry_points

    points = entry_points(group=GROUP)
    return {
        name: InstalledVerb(name, list(points.select(name=name))) for name in sorted(points.names)
    }


def installation_hint(name: str) -> str | None:
    """Return how to install a verb of this project, or None for other names."""
    if name not in FIRST_PARTY:
        return None
    distribution = FIRST_PARTY[name]
    return (
        f"No such command '{name}'. It is part of {distribution}, which is not installed: pip"
        f" install 'wearsim[{distribution.removeprefix('wearsim-')}]', or from a clone pip install"
        f" ./plugins/{distribution}"
    )


def _distribution(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist else "an unknown distribution"


def _summary(point: EntryPoint) -> str:
    # the text itself: parsing all metadata as an e-mail message takes longer
    lines = ((point.dist and point.dist.read_text("METADATA")) or "").splitlines()
    summaries = [line.partition(": ")[2] for line in lines if line.startswith("Summary: ")]
    return summaries[0] if summaries else f"From {_distribution(point)}."
