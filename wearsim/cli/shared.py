"""Arguments and options that verbs share, their checks, and the output of all verbs."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from wearsim.arguments import ArgumentError
from wearsim.errors import ResultsFileError, printable

if TYPE_CHECKING:
    from rich.console import Console

    from wearsim.profiles import ProfileChoice
    from wearsim.report.surfaces import Sampling
    from wearsim.scenario import Scenario


_WIDTH = 110  # columns of a table in a file or a pipe
ScenarioFile: TypeAlias = Annotated[
    Path, typer.Argument(metavar="SCENARIO", help="Scenario, a TOML file.", show_default=False)
]
ResultsFile: TypeAlias = Annotated[
    Path, typer.Argument(metavar="FILE.h5", help="Results file.", show_default=False)
]
Settings: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a value of the scenario: load.normal_force='350 N'. May be repeated.",
        show_default=False,
    ),
]
Json: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Write one JSON object in SI units instead of tables.")
]
Quiet: TypeAlias = Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")]
Force: TypeAlias = Annotated[
    bool, typer.Option("--force", "-f", help="Overwrite existing output files.")
]
Figure: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="FIG", help="Figure: .png, .pdf or .svg.", show_default=False
    ),
]
FigureOption: TypeAlias = Annotated[
    Path | None,
    typer.Option("--figure", metavar="FIG", help="Figure: .png, .pdf or .svg.", show_default=False),
]
SurfaceFile: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--surface",
        metavar="FILE",
        help="Surface of the cam as closed curves for CAD and CAM: .csv or .dxf.",
        show_default=False,
    ),
]
Chord: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--chord",
        metavar="LENGTH",
        help="Greatest distance of the chords of --surface from it; default: '1 um'.",
        show_default=False,
    ),
]
Points: TypeAlias = Annotated[
    int | None,
    typer.Option(
        "--points",
        min=3,
        metavar="N",
        help="Number of points of --surface, equally spaced along it, instead of --chord.",
        show_default=False,
    ),
]
Spline: TypeAlias = Annotated[
    bool, typer.Option("--spline", help="Cubic splines instead of polylines in a .dxf.")
]
Realisations: TypeAlias = Annotated[
    int, typer.Option("--realisations", "-n", min=1, metavar="N", help="Number of realisations.")
]
Seed: TypeAlias = Annotated[
    int | None,
    typer.Option(
        min=0,
        metavar="SEED",
        help="Seed of the random numbers; default: that of the scenario.",
        show_default=False,
    ),
]
Workers: TypeAlias = Annotated[
    int | None,
    typer.Option(
        min=1,
        metavar="K",
        help="Number of parallel workers; default: the number of processors.",
        show_default=False,
    ),
]
Scheduler: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="WHO",
        help="Where realisations are computed: processes (the default), threads, serial, dask, or"
        " the address of a Dask scheduler, tcp://host:port.",
        show_default=False,
    ),
]
Columns: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--columns",
        metavar="Y,Z",
        help="Names of the columns of position and height in the profile; -Z is a depth.",
        show_default=False,
    ),
]
Units: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--units", metavar="U,V", help="Units of these columns: mm,um.", show_default=False
    ),
]
Row: TypeAlias = Annotated[
    int | None,
    typer.Option("--row", min=0, help="Row of a surface, counted from 0.", show_default=False),
]
MeanRows: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--mean-rows",
        metavar="FROM:TO",
        help="Mean of the rows of a surface from one up to, not including, another.",
        show_default=False,
    ),
]
At: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar="POSITION",
        help="Position of a row across the rows of a surface: '2 mm'.",
        show_default=False,
    ),
]


def console(*, err: bool = False) -> Console:
    """Return a console without markup and highlighting."""
    from rich.console import Console

    made = Console(stderr=err, markup=False, highlight=False, emoji=False)
    if not made.is_terminal:
        made.width = _WIDTH
    return made


def write_table(title: str, rows: Iterable[tuple[str, str]]) -> None:
    """Write a table with the columns name and value to stdout."""
    from rich import box
    from rich.table import Table

    screen, title = console(), printable(title)
    table = Table(
        title=title,
        title_justify="left",
        show_header=False,
        box=box.SIMPLE_HEAD,
        min_width=min(len(title), screen.width),  # keeps a long title on one line
    )
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*map(printable, row))
    screen.print(table)


def write_list(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Write rows to stdout, one line each, in columns aligned under their heads."""
    lines = [[printable(cell) for cell in line] for line in (heads, *rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(heads))]
    for line in lines:
        typer.echo("  ".join(map(str.ljust, line, widths)).rstrip())


def write_json(data: Mapping[str, Any]) -> None:
    """Write one JSON object to stdout; numbers that are not finite become null."""
    from wearsim.report.text import plain

    typer.echo(json.dumps(plain(data), indent=2, ensure_ascii=False, allow_nan=False))


def note(text: str) -> None:
    """Write a line to stderr."""
    typer.echo(printable(text), err=True)


def write_notes(notes: Iterable[str], warnings: Iterable[str] = ()) -> None:
    """Write notes and warnings on a scenario or a study to stderr."""
    for text in (*(f"note: {text}" for text in notes), *(f"warning: {text}" for text in warnings)):
        note(text)


def refuse(condition: object, text: str, option: str) -> None:
    """Raise a usage error of an option or an argument if a condition holds.

    Raises
    ------
    typer.BadParameter
        With the text.
    """
    if condition:
        raise typer.BadParameter(text, param_hint=option)


def refuse_options(given: Mapping[str, object], text: str) -> None:
    """Raise a usage error if one of several options is given, which are listed by name.

    Raises
    ------
    typer.BadParameter
        For the first one.
    """
    for option, value in given.items():
        refuse(value not in (None, False), text, option)


def refuse_existing(path: Path | None, force: bool, option: str = "-o") -> None:
    """Refuse to overwrite the file named by an option, if one is named.

    Raises
    ------
    ResultsFileError
        If the file exists and `force` is false.
    """
    if path is not None and path.exists() and not force:
        raise ResultsFileError(f"{path} exists; choose another name with {option}, or --force")


def profile_choice(
    columns: str | None, units: str | None, row: int | None, mean_rows: str | None, at: str | None
) -> ProfileChoice:
    """Return the choice of a profile that the options of these names make.

    Raises
    ------
    typer.BadParameter
        If an option has not its form.
    """
    from wearsim.profiles import ProfileChoice

    chosen: list[tuple[str, str] | None] = []
    for option, text in (("--columns", columns), ("--units", units)):
        names = [name.strip() for name in text.split(",")] if text is not None else []
        message = f"'{text}' is not two names, expected position and height such as y,z"
        refuse(text is not None and (len(names) != 2 or not all(names)), message, option)
        chosen.append((names[0], names[1]) if names else None)
    rows = None
    if mean_rows is not None:
        first, _, last = mean_rows.partition(":")
        message = f"'{mean_rows}' is no range of rows, expected one such as 0:10"
        refuse(not (first.isdigit() and last.isdigit()), message, "--mean-rows")
        rows = int(first), int(last)
    return ProfileChoice(chosen[0], chosen[1], row, rows, quantity_of(at, "m", "--at"))


def results_option(ending: str) -> Any:
    """Return the option for the name of a results file.

    Parameters
    ----------
    ending : str
        Added to the name of the scenario in the default name, "-ensemble.h5".
    """
    return typer.Option(
        "--output",
        "-o",
        metavar="FILE.h5",
        help=f"Results file; default: name of the scenario with {ending}, in the current folder.",
        show_default=False,
    )


def quantity_of(text: str | None, unit: str, option: str) -> float | None:
    """Return the quantity that an option states, in the SI unit; None if it is not given.

    Errors are as of `checking`.
    """
    from wearsim.quantities import quantity

    with checking(option):
        return None if text is None else quantity(text, unit)


@contextmanager
def checking(option: str, text: str = "", kind: type[Exception] = ValueError) -> Iterator[None]:
    """Turn a ValueError, or another kind of error, into a usage error of an option.

    Raises
    ------
    typer.BadParameter
        With the text, or the message of the error.
    """
    try:
        yield
    except kind as error:
        raise typer.BadParameter(text or str(error), param_hint=option) from error


@contextmanager
def checking_arguments(**options: str) -> Iterator[None]:
    """Turn errors of arguments into usage errors of the options that stand for them.

    Parameters
    ----------
    **options
        Options by argument, where they have not its name.

    Raises
    ------
    typer.BadParameter
        With the message of the error.
    """
    try:
        yield
    except ArgumentError as error:
        hint = options.get(error.argument, f"--{error.argument.replace('_', '-')}")
        raise typer.BadParameter(str(error), param_hint=hint) from error


def settings_with(settings: list[str] | None, **values: object) -> list[str]:
    """Return the settings of --set, and of options that stand for a key, if they are given.

    Parameters
    ----------
    settings : list of str, optional
    **values
        Values by key.
    """
    return [
        *(settings or []),
        *(f"{key}={value}" for key, value in values.items() if value is not None),
    ]


def read_scenario(path: Path, settings: list[str] | None) -> Scenario:
    """Return the scenario in a file with the values given by --set.

    Raises
    ------
    typer.BadParameter
        If a setting has not the form key=value.
    ScenarioError
        With all mistakes in the file.
    """
    from wearsim.scenario import load_scenario, parse_override

    with checking("--set"):
        overrides = dict(parse_override(text) for text in settings or [])
    return load_scenario(path, overrides)


def check_figure(path: Path | None, force: bool, option: str = "-o") -> None:
    """Check the name of a figure, if one is given.

    Parameters
    ----------
    path : Path, optional
        Name of the figure.
    force : bool
        Whether an existing file may be overwritten.
    option : str
        Option that gave the name.

    Raises
    ------
    typer.BadParameter
        If the format is unknown or the folder does not exist.
    ResultsFileError
        If the file exists and `force` is false.
    """
    check_ending(path, force, option, (".png", ".pdf", ".svg"), "figure format")


def check_ending(
    path: Path | None, force: bool, option: str, endings: Sequence[str], what: str
) -> None:
    """Check ending and folder of a file to be written, and that nothing is overwritten unasked.

    Parameters
    ----------
    path, force, option
        As of `check_figure`, also the errors.
    endings : sequence of str
        Known endings, such as ".csv".
    what : str
        What the ending stands for, "figure format".
    """
    if path is None:
        return
    known = " or ".join(filter(None, [", ".join(endings[:-1]), endings[-1]]))
    refuse(
        path.suffix.lower() not in endings,
        f"'{path}' has no known {what}, expected {known}",
        option,
    )
    refuse(not path.parent.is_dir(), f"folder {path.parent} does not exist", option)
    refuse_existing(path, force, option)


def check_surface(
    path: Path | None,
    force: bool,
    *,
    chord: str | None,
    points: int | None,
    position: str | None = None,
    spline: bool,
) -> Sampling | None:
    """Check the name of a surface and its options, and return how it is represented by points.

    Raises
    ------
    typer.BadParameter
        If an option has not its form, or is given without --surface.
    PluginError
        If ezdxf is needed and not installed.
    ResultsFileError
        If the file exists and `force` is false.
    """
    if path is None:
        given = {"--chord": chord, "--points": points, "--position": position, "--spline": spline}
        refuse_options(given, "needs a file, --surface")
        return None
    from wearsim.report.surfaces import CHORD, ENDINGS, Sampling, dxf_library

    check_ending(path, force, "--surface", ENDINGS, "format of a surface")
    if path.suffix.lower() == ".dxf":
        dxf_library()
    else:
        refuse(spline, f"is for a .dxf, and the surface is {path}", "--spline")
    if chord is not None:
        refuse_options({"--points": points}, "is given beside --chord; delete one of them")
    length = quantity_of(chord, "m", "--chord")
    refuse(length is not None and length <= 0.0, f"'{chord}' is not above 0", "--chord")
    return Sampling(
        CHORD if length is None else length, points, quantity_of(position, "m", "--position")
    )


def refuse_same_file(figure: Path | None, output: Path, inputs: Iterable[Path]) -> None:
    """Refuse a figure that would overwrite the results file or an input.

    Parameters
    ----------
    figure : Path, optional
        Name given by --figure.
    output : Path
        Results file.
    inputs : iterable of Path
        Scenario and the files that it reads.

    Raises
    ------
    ResultsFileError, typer.BadParameter
        If it would.
    """
    if figure is None:
        return
    from wearsim.atomic_write import refuse_inputs, same_file

    refuse_inputs(figure, inputs, option="--figure")
    text = f"{figure} is also the results file given by -o; give them different names"
    refuse(same_file(figure, output), text, "--figure")


def checked_scheduler(scheduler: str | None, workers: int | None) -> str:
    """Return the scheduler of a study, "processes" by default.

    Raises
    ------
    typer.BadParameter
        If the scheduler is unknown, or cannot have that number of workers.
    """
    from wearsim.studies.execution.factory import check_scheduler

    chosen = scheduler or "processes"
    for option, count in (("--scheduler", None), ("--workers", workers)):
        with checking(option):
            check_scheduler(chosen, count)
    return chosen
