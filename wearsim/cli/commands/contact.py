"""Verbs for contacts before wear: contact, cam, and dissipation for many realisations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import wearsim
from wearsim.atomic_write import refuse_inputs
from wearsim.cli.render import (
    draw_figure,
    show_view,
    show_with_figure,
    write_surface,
    write_table_file,
)
from wearsim.cli.shared import (
    At,
    Chord,
    Columns,
    Figure,
    FigureOption,
    Force,
    Json,
    MeanRows,
    Points,
    Quiet,
    Realisations,
    Row,
    ScenarioFile,
    Seed,
    Settings,
    Spline,
    SurfaceFile,
    Units,
    check_ending,
    check_figure,
    check_surface,
    checking,
    profile_choice,
    quantity_of,
    read_scenario,
    refuse,
    refuse_same_file,
    results_option,
    settings_with,
)
from wearsim.errors import PluginError

if TYPE_CHECKING:
    from wearsim.scenario import Scenario


_STOPPING = (
    "stopping after the current realisations, results are kept; repeat to stop at once and lose"
    " them"
)


def contact(
    scenario: ScenarioFile,
    profile: Annotated[
        Path | None,
        typer.Option(
            "--profile",
            metavar="FILE",
            help="Profile of the cylinder: CSV with columns 'y [mm]' and 'height [um]', worn is"
            " negative, or 'depth [um]'; or a surface, SDF or X3P.",
            show_default=False,
        ),
    ] = None,
    columns: Columns = None,
    units: Units = None,
    row: Row = None,
    mean_rows: MeanRows = None,
    at: At = None,
    cutoff: Annotated[
        str | None,
        typer.Option(
            "--filter",
            metavar="CUTOFF",
            help="Cutoff wavelength of a Gaussian filter that removes roughness from the profile"
            " (ISO 16610-21): '0.8 mm'.",
            show_default=False,
        ),
    ] = None,
    settings: Settings = None,
    against: Annotated[
        str | None,
        typer.Option(
            metavar="MODEL",
            help="Also solve the contact with this contact model, such as halfspace, and show the"
            " difference.",
            show_default=False,
        ),
    ] = None,
    figure: Figure = None,
    json: Json = False,
    force: Force = False,
) -> None:
    """Solve one contact: the first roller at the start of the load."""
    check_figure(figure, force)
    loaded = read_scenario(scenario, settings)
    from wearsim.cli.progress import Display, watching
    from wearsim.input_files import read_input
    from wearsim.profiles import ProfileChoice, gaussian_filtered, load_profile, sign_note
    from wearsim.studies.contact.comparison import reference_spec
    from wearsim.studies.dry_run import profile_data
    from wearsim.studies.dry_run_table import profile_rows

    if against is not None:
        with checking("--against", kind=PluginError):
            reference_spec(against)
    refuse_inputs(figure, loaded.paths)
    refuse_inputs(figure, [profile] if profile else [], "the profile")
    choice = profile_choice(columns, units, row, mean_rows, at)
    refuse(
        profile is None and (cutoff is not None or choice != ProfileChoice()),
        "is needed for --columns, --units, --row, --mean-rows, --at and --filter",
        "--profile",
    )
    cylinder, files = loaded.cylinder, dict(loaded.files)
    wavelength = quantity_of(cutoff, "m", "--filter")
    if profile is not None:
        measured = load_profile(profile, choice)
        if wavelength is not None:
            with checking("--filter"):
                measured = gaussian_filtered(measured, wavelength)
        files[str(profile)] = read_input(profile, choice)
        cylinder = replace(
            cylinder, profile=measured, profile_file=str(profile), profile_filter=wavelength
        )
    start = profile_data(cylinder, files)
    # all models that "auto" takes have fields
    has_fields = loaded.contact.model == "auto" or loaded.contact.spec.capabilities.fields
    with_fields = figure is not None and has_fields
    with watching(Display, loaded, kind="contact", fields=with_fields):
        study = wearsim.study_contact(loaded, cylinder.profile, with_fields, True, against)
    view = study.view
    further = [
        sign_note(cylinder.profile, choice, str(profile)) if profile and cylinder.profile else "",
        f"model '{study.model}' gives no fields; the figure shows its strips only"
        if figure is not None and not has_fields
        else "",
    ]
    view.notes = [*study.notes, *_notes_on_means(loaded), *filter(None, further)]
    view.start = dict(profile_rows(start))
    show_with_figure(view, figure, json=json, more={"figure": figure, "profile": start})


def _notes_on_means(scenario: Scenario) -> list[str]:
    """Return notes that name the random inputs, which are set to their means."""
    named = {
        "random inputs are set to their means": [
            item.name for item in scenario.random if item.role != "field"
        ],
        "random fields are set to the means of their marginals": [
            item.name for item in scenario.random if item.role == "field"
        ],
    }
    return [f"{text}: {', '.join(names)}" for text, names in named.items() if names]


def dissipation(
    scenario: ScenarioFile,
    realisations: Realisations = 1000,
    output: Annotated[Path | None, results_option("-dissipation.h5")] = None,
    figure: FigureOption = None,
    plan: Annotated[
        str | None,
        typer.Option(
            metavar="PLAN",
            help="Sampling design: monte-carlo, latin-hypercube or sobol; default: that of the"
            " scenario.",
            show_default=False,
        ),
    ] = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Solve one contact for many realisations of its random inputs."""
    check_figure(figure, force, "--figure")
    loaded = read_scenario(
        scenario, settings_with(settings, **{"sampling.plan": plan, "seed": seed})
    )
    path = output if output is not None else Path(f"{scenario.stem}-dissipation.h5")
    refuse_same_file(figure, path, loaded.paths)
    from wearsim.cli.progress import Counter, watching

    with watching(Counter, loaded, quiet, _STOPPING, kind="contacts") as counter:
        result = wearsim.dissipation(loaded, realisations, path, force=force, **counter.callbacks)
    show_with_figure(result.view, figure, json=json, files={"results file": result.path})


_MOST_ANGLES = 100_000


def cam(
    scenario: ScenarioFile,
    at: Annotated[
        str | None,
        typer.Option(
            "--at",
            metavar="ANGLES",
            help="Angles of the cam instead of the stations of a run: '10 deg,80 deg', or ranges"
            " '0:359:1 deg': first, last and step.",
            show_default=False,
        ),
    ] = None,
    settings: Settings = None,
    figure: Figure = None,
    table: Annotated[
        Path | None,
        typer.Option(
            "--table",
            metavar="FILE.csv",
            help="Motion, loads and surface at the angles, one row each; instead of the terminal.",
            show_default=False,
        ),
    ] = None,
    surface: SurfaceFile = None,
    chord: Chord = None,
    points: Points = None,
    spline: Spline = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Show motion, loads and fresh contact of a cam along its angle."""
    check_figure(figure, force)
    check_ending(table, force, "--table", (".csv",), "format of a table")
    sampling = check_surface(surface, force, chord=chord, points=points, spline=spline)
    with checking("--at"):
        angles = None if at is None else _angles(at)
    loaded = read_scenario(scenario, settings)
    from wearsim.cli.progress import Display, watching

    files = {"figure": figure, "table": table, "surface": surface}
    for option, file in (("-o", figure), ("--table", table), ("--surface", surface)):
        refuse_inputs(file, loaded.paths, option=option)
    with watching(Display, loaded, kind="contacts"):
        study = wearsim.study_cam(loaded, angles)
    view = study.view
    draw_figure(view.panels, figure)
    if table is not None:
        (columns,) = view.columns().values()
        write_table_file(columns, table)
    if surface is not None and sampling is not None:
        write_surface(view.surface(sampling), surface, spline=spline)
    show_view(view, json=json, files=files, more=files, brief=table is not None)


def _angles(text: str) -> list[float]:
    """Return the angles in a list of angles and ranges [rad].

    Raises
    ------
    ValueError
        If the text is neither.
    """
    from wearsim.quantities import NUMBER, quantity

    angles: list[float] = []
    for part in text.split(","):
        ends = [end.strip() for end in part.split(":")]
        if len(ends) == 1:
            angles.append(quantity(ends[0], "rad"))
            continue
        number = NUMBER.match(ends[-1])
        if len(ends) != 3 or number is None:
            raise ValueError(f"'{part.strip()}' is no range, expected one such as 0:359:1 deg")
        unit = ends[-1][number.end() :]
        first, last, step = (
            quantity(end if end.endswith(unit.strip()) and unit.strip() else f"{end} {unit}", "rad")
            for end in ends
        )
        count = (last - first) / step if step else -1.0
        if not 0.0 <= count <= _MOST_ANGLES:
            raise ValueError(
                f"'{part.strip()}' is no range of 1 to {_MOST_ANGLES:,} angles, expected one such"
                " as 0:359:1 deg"
            )
        angles += [first + step * place for place in range(int(count + 1e-9) + 1)]
    return angles
