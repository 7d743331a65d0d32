"""`wearsim new`: a plugin or a scenario to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wearsim.cli.arguments import Force
from wearsim.cli.output import note, refuse_existing

new = typer.Typer(
    name="new",
    help="Write a plugin or a scenario to start from.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

Name = Annotated[
    str,
    typer.Argument(metavar="NAME", help="Name of its contact model: sponge.", show_default=False),
]
Directory = Annotated[
    Path, typer.Option("--directory", "-d", metavar="DIR", help="Where its folder goes.")
]
NewScenario = Annotated[Path, typer.Argument(metavar="[FILE]", help="The file to write.")]


@new.command("plugin")
def new_plugin(name: Name, directory: Directory = Path()) -> None:
    """Write a plugin with a contact model of its own, its tests and its README."""
    from wearsim.plugins import ContactModelSpec, registry
    from wearsim.plugins.template import write_plugin

    if name in registry().names(ContactModelSpec):
        raise typer.BadParameter(
            f"a contact model named '{name}' is installed already", param_hint="NAME"
        )
    try:
        written = write_plugin(name, directory)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="NAME") from error
    except FileExistsError as error:
        told = f"{error}; choose another name or --directory"
        raise typer.BadParameter(told, param_hint="--directory") from error
    except OSError as error:
        raise typer.BadParameter(
            _not_written(error, directory), param_hint="--directory"
        ) from error
    for path in written:
        typer.echo(path)
    folder = directory / f"wearsim-{name}"
    note(f"next: cd {folder} && pip install -e '.[dev]' && pytest")


@new.command("scenario")
def new_scenario(file: NewScenario = Path("scenario.toml"), force: Force = False) -> None:
    """Write a commented scenario that runs as it stands."""
    from wearsim.scenario.examples import starter_scenario

    try:
        if file.is_dir():
            told = f"{file} is a folder; name a file in it: {file / 'scenario.toml'}"
            raise typer.BadParameter(told, param_hint="FILE")
        refuse_existing(file, force, "FILE")
        if not file.parent.is_dir():
            raise typer.BadParameter(f"there is no folder {file.parent}", param_hint="FILE")
        file.write_text(starter_scenario(), encoding="utf-8")
    except OSError as error:
        raise typer.BadParameter(_not_written(error, file), param_hint="FILE") from error
    typer.echo(file)
    note(f"next: wearsim run {file}")


def _not_written(error: OSError, path: Path) -> str:
    """Return what is told when something cannot be written."""
    return f"cannot write to {path} ({error.strerror}); choose another name or place"
