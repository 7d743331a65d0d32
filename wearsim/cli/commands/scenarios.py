"""Verbs for scenarios and plugins: check, schema, new and plugins."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from wearsim.cli.shared import (
    Force,
    Json,
    ScenarioFile,
    Settings,
    checking,
    note,
    read_scenario,
    refuse,
    refuse_existing,
    write_json,
    write_list,
    write_notes,
    write_table,
)

_HEADS = ("name", "kind", "distribution", "version", "protocol", "capabilities", "summary")
new = typer.Typer(
    name="new",
    help="Create a new plugin, scenario or cam.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
NewScenario = Annotated[Path, typer.Argument(metavar="[FILE]", help="Name of the new file.")]


def check(scenario: ScenarioFile, settings: Settings = None, json: Json = False) -> None:
    """Check a scenario: print all mistakes, or the inputs and a summary of the run."""
    loaded = read_scenario(scenario, settings)
    from wearsim.cli.progress import Display, watching
    from wearsim.studies.dry_run import dry_run
    from wearsim.studies.dry_run_table import plan, station_table

    with watching(Display, loaded, kind="contacts" if loaded.wear else "contact"):
        data = dry_run(loaded)
    if json:
        write_json(data)
        return
    write_table(f"ok: {loaded.title}", plan(data))
    if data["cam"]:
        write_list(*station_table(data["cam"]["stations"]))
    write_notes(data["notes"], data["warnings"])


def schema() -> None:
    """Write the JSON Schema of a scenario, for editors."""
    from wearsim.scenario.examples import scenario_schema

    write_json(scenario_schema())


@new.command("plugin")
def new_plugin(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="Name of the contact model of the plugin: sponge.",
            show_default=False,
        ),
    ],
    directory: Annotated[
        Path,
        typer.Option(
            "--directory",
            "-d",
            metavar="DIR",
            help="Folder in which the plugin's folder is created.",
        ),
    ] = Path(),
) -> None:
    """Create a plugin with a contact model, tests and a README."""
    from wearsim.plugins import ContactModelSpec, registry
    from wearsim.plugins.template import write_plugin

    refuse(
        name in registry().names(ContactModelSpec),
        f"a contact model named '{name}' is already installed",
        "NAME",
    )
    try:
        with checking("NAME"):
            written = write_plugin(name, directory)
    except FileExistsError as error:
        raise typer.BadParameter(
            f"{error}; choose another name or --directory", param_hint="--directory"
        ) from error
    except OSError as error:
        raise _unwritable(error, directory, "--directory") from error
    typer.echo("\n".join(map(str, written)))
    note(f"next: cd {directory / f'wearsim-{name}'} && pip install -e '.[dev]' && pytest")


@new.command("scenario")
def new_scenario(file: NewScenario = Path("scenario.toml"), force: Force = False) -> None:
    """Create a commented scenario that runs unchanged."""
    _write_scenario("starter", file, force)


@new.command("cam")
def new_cam(file: NewScenario = Path("cam.toml"), force: Force = False) -> None:
    """Create a commented scenario of a cam that runs unchanged."""
    _write_scenario("starter_cam", file, force)


def _write_scenario(name: Literal["starter", "starter_cam"], file: Path, force: bool) -> None:
    from wearsim.scenario.examples import starter_scenario

    try:
        refuse(
            file.is_dir(),
            f"{file} is a folder; name a file in it: {file / 'scenario.toml'}",
            "FILE",
        )
        refuse_existing(file, force, "FILE")
        refuse(not file.parent.is_dir(), f"folder {file.parent} does not exist", "FILE")
        file.write_text(starter_scenario(name), encoding="utf-8")
    except OSError as error:
        raise _unwritable(error, file, "FILE") from error
    typer.echo(file)
    note(f"next: wearsim run {file}")


def _unwritable(error: OSError, path: Path, option: str) -> typer.BadParameter:
    return typer.BadParameter(
        f"cannot write to {path} ({error.strerror}); choose another name or folder",
        param_hint=option,
    )


def plugins(json: Json = False) -> None:
    """List contact models, wear laws, loads, random inputs and motion laws."""
    from wearsim.plugins import registry

    installed = registry()
    entries: list[dict[str, Any]] = [
        {
            "name": item.spec.name,
            "kind": item.spec.kind,
            "distribution": item.distribution,
            "version": item.version,
            "protocol": item.spec.protocol,
            "refused": item.refusal,
            "capabilities": item.spec.describe(),
            "summary": item.spec.summary,
            "references": list(item.spec.references),
        }
        for item in installed.all()
    ]
    if json:
        broken = [
            {key: getattr(item, key) for key in ("entry_point", "distribution", "version", "cause")}
            for item in installed.broken
        ]
        write_json({"plugins": entries, "broken": broken})
        return
    for entry in entries:
        entry["capabilities"] = ", ".join(word.replace("_", " ") for word in entry["capabilities"])
    write_list(_HEADS, [[str(entry[head]) for head in _HEADS] for entry in entries])
    for refusal in filter(None, (entry["refused"] for entry in entries)):
        note(f"refused: {refusal}")
    for item in installed.broken:
        note(
            f"broken: plugin '{item.entry_point}' of {item.distribution} {item.version}"
            f" failed to load: {item.cause}"
        )
