"""Verbs for results files: show, plot, compare, report and export."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import wearsim
from wearsim.atomic_write import refuse_inputs
from wearsim.cli.render import draw_figure, show_view, show_with_figure, write_surface
from wearsim.cli.shared import (
    At,
    Chord,
    Columns,
    Figure,
    Force,
    Json,
    MeanRows,
    Points,
    ResultsFile,
    Row,
    Spline,
    SurfaceFile,
    Units,
    check_ending,
    check_figure,
    check_surface,
    note,
    profile_choice,
    quantity_of,
    refuse,
    refuse_options,
    write_notes,
)

if TYPE_CHECKING:
    from wearsim.levelling import Measured
    from wearsim.profiles import ProfileChoice
    from wearsim.report.view import View


MeasuredFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--measured",
        metavar="FILE",
        help="Measured profile to draw as points: CSV with columns 'y [mm]' and 'depth [um]', or"
        " 'height [um]' with worn material negative; or a surface, SDF or X3P. May be repeated.",
        show_default=False,
    ),
]
Angle = Annotated[
    str | None,
    typer.Option(
        "--angle",
        metavar="ANGLE",
        help="Angle of the cam at which --measured was measured: '112 deg'; default: where the cam"
        " is worn deepest.",
        show_default=False,
    ),
]
Level = Annotated[
    bool,
    typer.Option(
        "--level",
        help="Remove offset, inclination and axial shift of measured profiles, found on the surface"
        " outside the computed groove.",
    ),
]


def plot(
    file: ResultsFile,
    figure: Figure = None,
    animate: Annotated[
        Path | None,
        typer.Option(
            "--animate",
            metavar="FILE",
            help="Animation of a worn cam instead of the figure: .gif, or .mp4 where ffmpeg is"
            " installed.",
            show_default=False,
        ),
    ] = None,
    measured: MeasuredFiles = None,
    angle: Angle = None,
    level: Level = False,
    columns: Columns = None,
    units: Units = None,
    row: Row = None,
    mean_rows: MeanRows = None,
    at: At = None,
    force: Force = False,
) -> None:
    """Draw the figure of a results file of any kind."""
    if animate is not None:
        _animate(file, animate, force)
        if figure is None and not measured:
            return
    path = figure if figure is not None else Path(f"{file.stem}.png")
    refuse_inputs(path, [file], "the figure")
    refuse_inputs(path, measured or [], "a measured profile")
    view = wearsim.open_results(file).view
    check_figure(path, force)
    refuse(
        measured and view.profile() is None,
        f"requires wear tests; {file} holds none: {view.question}",
        "--measured",
    )
    choice = profile_choice(columns, units, row, mean_rows, at)
    draw_figure(
        lambda: view.panels(measured_profiles(measured or [], choice, [view], level, angle)), path
    )
    note(f"figure: {path}")


def _animate(file: Path, path: Path, force: bool) -> None:
    """Write the animation of a results file."""
    from wearsim.report.animation import ENDINGS, check_animation, save_animation

    check_ending(path, force, "--animate", ENDINGS, "format of an animation")
    check_animation(path)
    refuse_inputs(path, [file], "the animation", option="--animate")
    animation = wearsim.open_results(file).view.animation()
    refuse(animation is None, f"requires the run of a cam, not {file}", "--animate")
    save_animation(animation, path)
    note(f"animation: {path}, {path.stat().st_size / 1e6:.1f} MB")


def measured_profiles(
    files: Sequence[Path],
    choice: ProfileChoice,
    views: Sequence[View],
    level: bool,
    angle: str | None = None,
) -> list[Measured]:
    """Return the profiles of measured files, levelled against the first profile if required.

    How signs were read and the residuals go to stderr.
    """
    if not files:
        refuse_options({"--level": level, "--angle": angle}, "needs a measured profile, --measured")
        return []
    from wearsim.levelling import Measured, levelled
    from wearsim.profiles import load_profile, sign_note
    from wearsim.report.measured import level_hint, residual_text

    at = quantity_of(angle, "rad", "--angle")
    read = {file: load_profile(file, choice) for file in files}
    write_notes(filter(None, (sign_note(read[file], choice, str(file)) for file in read)))
    profiles = [
        Measured(file.stem, profile.y, profile.height, at) for file, profile in read.items()
    ]
    test = next((view for view in views if view.profile() is not None), None)
    refuse(
        at is not None and not (test is not None and test.has_angles),
        "is for the run of a cam; ensembles hold the deepest groove",
        "--angle",
    )
    computed = None if test is None else test.profile(at)
    if computed is None:
        return profiles
    if level:
        profiles = [levelled(profile, computed) for profile in profiles]
    for profile in profiles:
        residual = residual_text(profile, computed)
        note(f"{profile.label}: {residual}{'' if level else level_hint(profile, computed)}")
    return profiles


def show(file: ResultsFile, json: Json = False) -> None:
    """Show the content of a results file and the end state."""
    show_view(wearsim.open_results(file).view, json=json, stored=True)


def compare(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE.h5 FILE.h5...",
            help="Results files of runs and ensembles; all others are compared with the first.",
            show_default=False,
        ),
    ],
    observable: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Quantity to compare: depth, width, worn_volume, dissipated_energy...",
        ),
    ] = "depth",
    figure: Figure = None,
    json: Json = False,
    force: Force = False,
) -> None:
    """Compare runs and ensembles, with confidence intervals."""
    refuse(len(files) < 2, f"there is one file, {files[0]}; give another one to compare", "FILE.h5")
    refuse_inputs(figure, files, "the comparison")
    for file in files:
        refuse(files.count(file) > 1, f"{file} is given twice", "FILE.h5")
    from wearsim.studies.opening import comparison_of, labels_of

    results = [wearsim.open_results(file) for file in files]
    check_figure(figure, force)
    show_with_figure(comparison_of(results, labels_of(results), observable), figure, json=json)


def export(
    file: ResultsFile,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Folder for the CSV files, by default the name of the results file.",
            show_default=False,
        ),
    ] = None,
    decimal: Annotated[
        str,
        typer.Option(
            "--decimal",
            metavar="SIGN",
            help="Decimal sign: '.', or ',' with semicolons between cells.",
        ),
    ] = ".",
    surface: SurfaceFile = None,
    chord: Chord = None,
    points: Points = None,
    position: Annotated[
        str | None,
        typer.Option(
            "--position",
            metavar="Y",
            help="Position across the track of --surface: '2 mm'; default: where it is worn"
            " deepest.",
            show_default=False,
        ),
    ] = None,
    spline: Spline = False,
    running_in: Annotated[
        Path | None,
        typer.Option(
            "--running-in",
            metavar="DIR",
            help="Folder for a scenario that starts from the worn profiles of the run, which are"
            " written as CSV.",
            show_default=False,
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Write a results file as CSV with units, or what is worn as a new start."""
    refuse(decimal not in {".", ","}, f"'{decimal}' is neither '.' nor ','", "--decimal")
    sampling = check_surface(
        surface, force, chord=chord, points=points, position=position, spline=spline
    )
    from wearsim.studies.opening import export_csv

    if running_in is not None:
        written = wearsim.export_running_in(wearsim.open_results(file), running_in, force=force)
        typer.echo("\n".join(map(str, written.paths)))
        write_notes(written.notes)
    if surface is not None and sampling is not None:
        refuse_inputs(surface, [file], "the surface", option="--surface")
        cam_surface = wearsim.open_results(file).view.surface(sampling)
        refuse(cam_surface is None, f"requires the run of a cam, not {file}", "--surface")
        write_surface(cam_surface, surface, spline=spline)
    if output is not None or (running_in is None and surface is None):
        sign: Literal[".", ","] = "," if decimal == "," else "."
        result, folder = wearsim.open_results(file), output or Path(file.stem)
        typer.echo("\n".join(map(str, export_csv(result, folder, force=force, decimal=sign))))


def report(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE.h5...",
            help="Results files of any kind; several runs and ensembles are also compared.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="PAGE",
            help="Page to write, by default the name of the first file with .html.",
            show_default=False,
        ),
    ] = None,
    measured: MeasuredFiles = None,
    angle: Angle = None,
    level: Level = False,
    columns: Columns = None,
    units: Units = None,
    row: Row = None,
    mean_rows: MeanRows = None,
    at: At = None,
    force: Force = False,
) -> None:
    """Write one page on results for a browser: answers, interactive figures, inputs."""
    path = output if output is not None else Path(f"{files[0].stem}.html")
    refuse_inputs(path, files, "the page")
    refuse_inputs(path, measured or [], "a measured profile")
    results = [wearsim.open_results(file) for file in files]
    check_ending(path, force, "-o", (".html", ".htm"), "format of a page")
    choice, views = profile_choice(columns, units, row, mean_rows, at), [r.view for r in results]
    wearsim.save_report(
        results, path, measured_profiles(measured or [], choice, views, level, angle)
    )
    note(f"page: {path}, {path.stat().st_size / 1e6:.1f} MB")
