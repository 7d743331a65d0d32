"""Verbs that other distributions add through the entry-point group ``wearsim.commands``.

The name of an entry point is the verb, its value a `typer.Typer` app. The help lists the verbs
with the summaries of their distributions; only the verb that is called is imported.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperCommand

from wearsim.errors import PluginError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint  # slow to import

GROUP = "wearsim.commands"
#: distributions of this project that add a verb
FIRST_PARTY = {"bench": "wearsim-bench", "reproduce": "wearsim-chevalier2005"}


class InstalledVerb(TyperCommand):
    """Help line of a verb whose code is imported when the verb is called.

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

    def make_context(self, *args: Any, **kwargs: Any) -> Any:
        """Import the verb and return the context of its command, with the arguments parsed."""
        return self._load().make_context(*args, **kwargs)

    def _load(self) -> Any:
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
            command = typer.main.get_command(app)
        except (Exception, SystemExit) as error:  # an import may even end the process
            raise PluginError(
                f"{name} of {distributions[0]} cannot be loaded:"
                f" {type(error).__name__}: {error}; update or uninstall it"
            ) from error
        command.name = self.name
        # Typer adds them to every app; they would install the completion of `wearsim`
        completion = ("install_completion", "show_completion")
        command.params = [item for item in command.params if item.name not in completion]
        return command


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
