"""`wearsim bench`: what every model, stepper and plan costs, and how near it comes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from wearsim.cli.arguments import Force, Json, Quiet
from wearsim.cli.output import note, refuse_existing

if TYPE_CHECKING:
    from wearsim_bench.measure.measurement import Effort, Tell, Topic
    from wearsim_bench.output import Output


class Name(StrEnum):
    """The topics of `wearsim bench`."""

    contact = "contact"
    stepping = "stepping"
    sampling = "sampling"
    growth = "growth"
    savings = "savings"


MODELS = (Name.contact, Name.stepping, Name.growth)  # topics that measure one model if asked
Topics: TypeAlias = Annotated[
    list[Name] | None,
    typer.Argument(
        metavar="[TOPIC]...",
        help="contact, stepping, sampling, growth, savings; all of them by default.",
        show_default=False,
    ),
]
Plugin: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="NAME", help="Only this contact model, beside the default.", show_default=False
    ),
]
Hard: TypeAlias = Annotated[
    bool, typer.Option("--hard", help="Run the hard cases, and tell which of them hold.")
]
Quick: TypeAlias = Annotated[
    bool, typer.Option("--quick", help="Few cases and short tests: seconds instead of minutes.")
]
All: TypeAlias = Annotated[
    bool, typer.Option("--all", help="Show all that was measured, not the best of it alone.")
]
Folder: TypeAlias = Annotated[
    Path, typer.Option("--output", "-o", metavar="DIR", help="Where figures, JSON and tables go.")
]


app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def bench(
    topics: Topics = None,
    plugin: Plugin = None,
    hard: Hard = False,
    quick: Quick = False,
    output: Folder = Path("bench"),
    show_all: All = False,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Measure speed beside error: models, steppers, plans, growth; --hard for hard cases."""
    asked = list(dict.fromkeys(topics or ([] if hard else Name)))
    if plugin is not None:
        asked = _with_a_model(asked, topics, plugin)
    endings = (".json", ".md", ".png")
    wanted = [output / (topic.value + ending) for topic in asked for ending in endings]
    wanted += [output / f"hard{ending}" for ending in endings[:2] if hard]
    _refuse_places(output, wanted)
    for path in wanted:
        refuse_existing(path, force)
    from wearsim_bench.measure.machine import this_machine
    from wearsim_bench.measure.measurement import Effort
    from wearsim_bench.output import Output

    effort = Effort(quick, 1 if quick else 5, plugin)
    machine = this_machine()
    shown = Output(output, machine, effort, show_all, json)
    shown.begin()
    try:
        for topic in asked:
            with telling(topic.value, quiet) as tell:
                found = _function(topic)(effort, tell)
            shown.topic(found)
        holds = not hard or _hard_cases_hold(effort, shown, quiet)
    finally:
        shown.end()  # what was finished is told, whatever became of the rest
    if not holds:
        raise typer.Exit(1)


def _hard_cases_hold(effort: Effort, shown: Output, quiet: bool) -> bool:
    """Run the hard cases, show them, and return whether all are as they should be."""
    from wearsim_bench.hard_cases.topic import hard as run_hard_cases

    with telling("hard cases", quiet) as tell:
        verdicts = run_hard_cases(effort, tell)
    shown.hard(verdicts)
    return all(verdict.holds for verdict in verdicts)


def _refuse_places(folder: Path, wanted: list[Path]) -> None:
    """Raise where a folder or a file stands in the way that --force does not take out of it."""
    if folder.exists() and not folder.is_dir():
        raise typer.BadParameter(f"{folder} is a file; name a folder", param_hint="-o")
    for path in wanted:
        if path.is_dir():
            raise typer.BadParameter(f"{path} is a folder; name another", param_hint="-o")


def _with_a_model(asked: list[Name], topics: list[Name] | None, plugin: str) -> list[Name]:
    """Return the topics that measure one model; those that cannot are left out, or refused."""
    from wearsim.plugins import ContactModelSpec, registry

    known = registry().names(ContactModelSpec)
    if plugin not in known:
        raise typer.BadParameter(
            f"'{plugin}' is no contact model that is installed; there are {', '.join(known)}",
            param_hint="--plugin",
        )
    for name in topics or ():
        if name not in MODELS:
            raise typer.BadParameter(
                f"{name.value} does not measure contact models; leave --plugin out, or name"
                f" {', '.join(topic.value for topic in MODELS)}",
                param_hint="--plugin",
            )
    return [name for name in asked if name in MODELS]


def _function(name: Name) -> Callable[[Effort, Tell], Topic]:
    """Return what measures a topic."""
    from importlib import import_module

    function: Callable[[Effort, Tell], Topic] = getattr(
        import_module(f"wearsim_bench.{name.value}.topic"), name.value
    )
    return function


@contextmanager
def telling(name: str, quiet: bool) -> Iterator[Tell]:
    """Give what shows how far a topic has come, on stderr.

    Parameters
    ----------
    name : str
        The topic's.
    quiet : bool
        Show nothing.
    """
    from wearsim.cli.output import console

    screen = console(err=True)
    if quiet:
        yield lambda _what, _part: None
    elif not screen.is_terminal:
        note(f"measuring {name}")
        yield lambda _what, _part: None
    else:
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (
            TextColumn("{task.percentage:3.0f} %"),
            BarColumn(bar_width=24),
            TimeElapsedColumn(),
            TextColumn("{task.description}", markup=False),
        )
        with Progress(*columns, console=screen, transient=True) as progress:
            task = progress.add_task(name, total=1.0)

            def tell(what: str, part: float) -> None:
                progress.update(task, description=f"{name}: {what}", completed=part)

            yield tell
