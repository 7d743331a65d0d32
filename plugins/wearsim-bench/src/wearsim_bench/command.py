"""`wearsim bench`: time and error of contact models, steppers and sampling designs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from wearsim.cli.shared import Force, Json, Quiet, note, refuse_existing

if TYPE_CHECKING:
    from wearsim_bench.measure.measurement import Effort, OnProgress, Topic
    from wearsim_bench.output import Output


class TopicName(StrEnum):
    """The topics of `wearsim bench`."""

    contact = "contact"
    stepping = "stepping"
    sampling = "sampling"
    growth = "growth"
    savings = "savings"
    stated_errors = "stated-errors"
    random = "random"


MODEL_TOPICS = (TopicName.contact, TopicName.stepping, TopicName.growth)  # accept --plugin
RANDOM_TOPICS = (TopicName.stated_errors, TopicName.random)  # accept --tests, --seed and --jobs
Topics: TypeAlias = Annotated[
    list[TopicName] | None,
    typer.Argument(
        metavar="[TOPIC]...",
        help="contact, stepping, sampling, growth, savings, stated-errors, random; all by default.",
        show_default=False,
    ),
]
Plugin: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="NAME", help="Only this contact model and the default.", show_default=False
    ),
]
Against: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Contact model, such as halfspace, whose solutions replace the stored ones in the"
        " topic contact.",
        show_default=False,
    ),
]
Hard: TypeAlias = Annotated[
    bool, typer.Option("--hard", help="Run the hard cases and list which of them pass.")
]
Quick: TypeAlias = Annotated[
    bool, typer.Option("--quick", help="Few cases and short tests: seconds instead of minutes.")
]
All: TypeAlias = Annotated[
    bool, typer.Option("--all", help="Show all measurements, not only the best ones.")
]
Folder: TypeAlias = Annotated[
    Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for figures, JSON and tables.")
]
Tests: TypeAlias = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        help="Random tests of stated-errors and random, by default 40.",
        show_default=False,
    ),
]
Seed: TypeAlias = Annotated[
    int | None,
    typer.Option(
        metavar="N", min=0, help="Seed of the random tests, by default 1.", show_default=False
    ),
]
References: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        metavar="DIR",
        help="Folder that keeps the reference solutions of the random tests; they do not depend on"
        " the stepper.",
        show_default=False,
    ),
]

Jobs: TypeAlias = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        "-j",
        metavar="N",
        min=1,
        help="Processes that run the random tests, by default 1.",
        show_default=False,
    ),
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
    against: Against = None,
    hard: Hard = False,
    quick: Quick = False,
    tests: Tests = None,
    seed: Seed = None,
    references: References = None,
    jobs: Jobs = None,
    output: Folder = Path("bench"),
    show_all: All = False,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Measure time and error of models, steppers and sampling; --hard runs the hard cases."""
    if against is not None:
        topics = _topics_against(topics, against)
    selected = list(dict.fromkeys(topics or ([] if hard else TopicName)))
    if plugin is not None:
        selected = _topics_of_model(selected, topics, plugin)
    options = {"number": tests, "seed": seed, "references": references, "jobs": jobs}
    study = {name: value for name, value in options.items() if value is not None}
    if study and not set(RANDOM_TOPICS) & set(selected):
        raise typer.BadParameter(
            f"applies to the topics {' and '.join(RANDOM_TOPICS)}, which are not selected",
            param_hint="--tests, --seed, --references or --jobs",
        )
    if references is not None and TopicName.stated_errors not in selected:
        raise typer.BadParameter(
            f"applies to the topic {TopicName.stated_errors}, which is not selected",
            param_hint="--references",
        )
    endings = (".json", ".md", ".png")
    paths = [output / (topic.value + ending) for topic in selected for ending in endings]
    paths += [output / f"hard{ending}" for ending in endings[:2] if hard]
    _check_paths(output, paths)
    for path in paths:
        refuse_existing(path, force)
    from wearsim_bench.measure.machine import this_machine
    from wearsim_bench.measure.measurement import Effort
    from wearsim_bench.output import Output

    effort = Effort(quick, 1 if quick else 5, plugin, against)
    machine = this_machine()
    results = Output(output, machine, effort, show_all, json)
    results.begin()
    try:
        for topic in selected:
            with progress_bar(topic.value, quiet) as on_progress:
                measure = _measuring_function(topic)
                if topic == TopicName.stated_errors:
                    measure = partial(measure, **study)
                elif topic == TopicName.random:
                    without_references = {key: study[key] for key in study if key != "references"}
                    measure = partial(measure, **without_references)
                measured = measure(effort, on_progress)
            results.topic(measured)
        passed = not hard or _run_hard_cases(effort, results, quiet)
    finally:
        results.end()  # after an error too: completed topics are written
    if not passed:
        raise typer.Exit(1)


def _run_hard_cases(effort: Effort, results: Output, quiet: bool) -> bool:
    """Run the hard cases, write the verdicts, and return whether all pass."""
    from wearsim_bench.contact.methods import is_reference
    from wearsim_bench.hard_cases.topic import hard as run_hard_cases

    if is_reference(effort.plugin) and not effort.quick:
        note(f"note: '{effort.plugin}' is a slow reference; the hard cases are those of --quick")
        effort = replace(effort, quick=True)
    with progress_bar("hard cases", quiet) as on_progress:
        verdicts = run_hard_cases(effort, on_progress)
    results.hard(verdicts, effort)
    return all(verdict.holds for verdict in verdicts)


def _check_paths(folder: Path, paths: list[Path]) -> None:
    """Raise if the folder is a file, or an output path is a folder."""
    if folder.exists() and not folder.is_dir():
        raise typer.BadParameter(f"{folder} is a file; name a folder", param_hint="-o")
    for path in paths:
        if path.is_dir():
            raise typer.BadParameter(f"{path} is a folder; name another", param_hint="-o")


def _topics_against(topics: list[TopicName] | None, against: str) -> list[TopicName]:
    """Return the topic that a reference model serves; refuse other topics and a missing model."""
    from wearsim.errors import PluginError
    from wearsim.studies.contact.comparison import reference_spec

    try:
        reference_spec(against)
    except PluginError as error:
        raise typer.BadParameter(str(error), param_hint="--against") from error
    refused = [name.value for name in topics or () if name != TopicName.contact]
    if refused:
        raise typer.BadParameter(
            f"{refused[0]} has no contacts with exact solutions; omit --against, or name contact",
            param_hint="--against",
        )
    return [TopicName.contact]


def _topics_of_model(
    selected: list[TopicName], topics: list[TopicName] | None, plugin: str
) -> list[TopicName]:
    """Return the selected topics that measure contact models; refuse others that were named."""
    from wearsim.plugins import ContactModelSpec, registry

    known = registry().names(ContactModelSpec)
    if plugin not in known:
        raise typer.BadParameter(
            f"no installed contact model is named '{plugin}'; there are {', '.join(known)}",
            param_hint="--plugin",
        )
    for name in topics or ():
        if name not in MODEL_TOPICS:
            raise typer.BadParameter(
                f"{name.value} does not measure contact models; omit --plugin, or name"
                f" {', '.join(topic.value for topic in MODEL_TOPICS)}",
                param_hint="--plugin",
            )
    return [name for name in selected if name in MODEL_TOPICS]


def _measuring_function(name: TopicName) -> Callable[[Effort, OnProgress], Topic]:
    from importlib import import_module

    function: Callable[[Effort, OnProgress], Topic] = getattr(
        import_module(f"wearsim_bench.{name.name}.topic"), name.name
    )
    return function


@contextmanager
def progress_bar(name: str, quiet: bool) -> Iterator[OnProgress]:
    """Yield a function that shows the progress of a topic on stderr.

    Parameters
    ----------
    name : str
        Name of the topic.
    quiet : bool
        Show nothing.
    """
    from wearsim.cli.shared import console

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

            def on_progress(what: str, part: float) -> None:
                progress.update(task, description=f"{name}: {what}", completed=part)

            yield on_progress
