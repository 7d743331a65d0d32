"""`wearsim validate`: published tests and simulations, computed and compared."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from wearsim.cli.shared import Force, Quiet, note, refuse_existing, write_json

if TYPE_CHECKING:
    from wearsim_validation.case import Case

Cases: TypeAlias = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[CASE]...",
        help="Names of cases, see --list, or TOML files of cases; all of them by default.",
        show_default=False,
    ),
]
Folder: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="DIR",
        help="Folder for validation.json and a figure of each case.",
        show_default=False,
    ),
]
Quick: TypeAlias = Annotated[
    bool, typer.Option("--quick", help="Only the cases that take a few seconds.")
]
Names: TypeAlias = Annotated[bool, typer.Option("--list", help="List the cases.")]
Json: TypeAlias = Annotated[
    bool, typer.Option("--json", help="Write one JSON object, in the units of the publications.")
]


app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def validate(
    cases: Cases = None,
    output: Folder = None,
    quick: Quick = False,
    names: Names = False,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Compare wearsim with published tests and simulations.

    Exit code 1 where a verdict is not the one that its case records.
    """
    from wearsim_validation.files import read_case, shipped

    chosen = [read_case(_path(name)) for name in dict.fromkeys(cases or shipped())]
    if quick:
        chosen = [case for case in chosen if case.file.quick]
    if names:
        for case in chosen:
            typer.echo(f"{case.name:26} {case.file.title}")
        return
    if output is not None:
        _check(output, chosen, force)
    from wearsim_validation.comparison import compare
    from wearsim_validation.output import as_json, show, show_summary, write_files

    outcomes = []
    for case in chosen:
        outcomes.append(compare(case, partial(_tell, quiet, case.name)))
        if not json:
            show(outcomes[-1])
    words = [*(cases or ()), *(["--quick"] if quick else ())]
    data = as_json(outcomes, " ".join(["wearsim validate", *words]))
    if json:
        write_json(data)
    elif len(outcomes) > 1:
        show_summary(outcomes)
    if output is not None:
        for path in write_files(outcomes, data, output):
            note(f"written: {path}")
    if not all(outcome.expected for outcome in outcomes):
        raise typer.Exit(1)


def _tell(quiet: bool, case: str, what: str) -> None:
    if not quiet:
        note(f"{case}: {what}")


def _path(name: str) -> Path:
    """Return the file of a case.

    Raises
    ------
    BadParameter
        If no shipped case has the name, and it is no file.
    """
    from difflib import get_close_matches

    from wearsim_validation.files import SHIPPED, shipped

    if name in shipped():
        return SHIPPED / f"{name}.toml"
    if name.endswith(".toml"):
        return Path(name)
    near = get_close_matches(name, shipped(), n=1)
    hint = f" (did you mean '{near[0]}'?)" if near else ""
    raise typer.BadParameter(
        f"no case '{name}'{hint}; there are {', '.join(shipped())}, or name a TOML file",
        param_hint="CASE",
    )


def _check(folder: Path, cases: list[Case], force: bool) -> None:
    """Raise if the folder is a file, or an output file exists."""
    if folder.exists() and not folder.is_dir():
        raise typer.BadParameter(f"{folder} is a file; name a folder", param_hint="-o")
    for path in (folder / "validation.json", *(folder / f"{case.name}.png" for case in cases)):
        refuse_existing(path, force)
