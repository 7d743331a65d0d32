"""Arguments and options that several verbs take."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

if TYPE_CHECKING:
    from wearsim.scenario import Scenario

ScenarioFile: TypeAlias = Annotated[
    Path, typer.Argument(metavar="SCENARIO", help="A scenario, a TOML file.", show_default=False)
]
ResultsFile: TypeAlias = Annotated[
    Path, typer.Argument(metavar="FILE.h5", help="A results file.", show_default=False)
]
Settings: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a value: load.normal_force='350 N'. May be repeated.",
        show_default=False,
    ),
]
Json: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Write one JSON object, in SI, and nothing else.")
]
Quiet: TypeAlias = Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")]
Force: TypeAlias = Annotated[
    bool, typer.Option("--force", "-f", help="Overwrite an output that exists.")
]
Figure: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="FIG", help="Figure: .png, .pdf or .svg.", show_default=False
    ),
]

Drawing: TypeAlias = Annotated[
    Path | None,
    typer.Option("--figure", metavar="FIG", help="Figure: .png, .pdf or .svg.", show_default=False),
]
Realisations: TypeAlias = Annotated[
    int, typer.Option("--realisations", "-n", min=1, metavar="N", help="How many realisations.")
]
Seed: TypeAlias = Annotated[
    int | None,
    typer.Option(
        min=0, metavar="SEED", help="Seed; by default the scenario's.", show_default=False
    ),
]
Workers: TypeAlias = Annotated[
    int | None,
    typer.Option(
        min=1,
        metavar="K",
        help="Realisations that run at a time; by default as many as there are processors.",
        show_default=False,
    ),
]
Scheduler: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="WHO",
        help="Who does the work: processes (the default), threads, serial, dask, or the address"
        " of a Dask scheduler, tcp://host:port.",
        show_default=False,
    ),
]


def results_option(ending: str) -> Any:
    """Return the option that names the results file of a study.

    Parameters
    ----------
    ending : str
        What follows the scenario's name where it is not given, "-ensemble.h5".
    """
    return typer.Option(
        "--output",
        "-o",
        metavar="FILE.h5",
        help=f"Results file; by default the scenario's name with {ending}, in the current folder.",
        show_default=False,
    )


def read_scenario(path: Path, settings: list[str] | None) -> Scenario:
    """Return the scenario in a file with the values given by --set.

    Raises
    ------
    typer.BadParameter
        If a setting is not of the form key=value.
    ScenarioError
        With every mistake in the file.
    """
    from wearsim.scenario import load_scenario, parse_override

    try:
        overrides = dict(parse_override(text) for text in settings or [])
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--set") from error
    return load_scenario(path, overrides)


def check_figure(path: Path, option: str = "-o") -> None:
    """Raise unless a figure's name ends as a kind of figure does, in a folder that exists.

    Parameters
    ----------
    path : Path
    option : str
        The option that named it.

    Raises
    ------
    typer.BadParameter
        If it does not.
    """
    if path.suffix.lower() not in {".png", ".pdf", ".svg"}:
        raise typer.BadParameter(
            f"'{path}' ends in no kind of figure, expected .png, .pdf or .svg", param_hint=option
        )
    if not path.parent.is_dir():
        raise typer.BadParameter(f"there is no folder {path.parent}", param_hint=option)


def check_drawing(path: Path, output: Path, inputs: Iterable[Path]) -> None:
    """Raise if a figure would take the place of the results file, or of an input.

    Parameters
    ----------
    path : Path
        The figure, named by --figure.
    output : Path
        The results file.
    inputs : iterable of Path
        What the scenario is read from.

    Raises
    ------
    ResultsFileError, typer.BadParameter
        If it would.
    """
    from wearsim.results import refuse_inputs, same_file

    refuse_inputs(path, inputs, option="--figure")
    if same_file(path, output):
        raise typer.BadParameter(
            f"{path} is the results file too, as -o says; give them different names",
            param_hint="--figure",
        )


def check_workforce(scheduler: str | None, workers: int | None) -> str:
    """Return who does the work of a study, checked.

    Parameters
    ----------
    scheduler : str, optional
        As given at the shell.
    workers : int, optional
        How many.

    Raises
    ------
    typer.BadParameter
        If there is no such scheduler, or it cannot have so many workers.
    """
    from wearsim.studies.execution.factory import check_scheduler

    chosen = scheduler or "processes"
    try:
        check_scheduler(chosen)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--scheduler") from error
    try:
        check_scheduler(chosen, workers)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--workers") from error
    return chosen


def read_text(path: Path) -> str:
    """Return the content of a text file that the user names.

    Raises
    ------
    ScenarioError
        If it cannot be read.
    """
    from wearsim.errors import Mistake, ScenarioError

    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioError(str(path), [Mistake("", "", "is not text in UTF-8")]) from error
    except OSError as error:
        problem = Mistake("", "", f"the file cannot be read ({error.strerror})")
        raise ScenarioError(str(path), [problem]) from error
