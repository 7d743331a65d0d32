"""Verb cam: motion, loads and fresh contact of a cam along its angle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import wearsim
from wearsim.atomic_write import refuse_inputs
from wearsim.cli.render import draw_figure, show_view, write_surface, write_table_file
from wearsim.cli.shared import (
    Chord,
    Figure,
    Force,
    Json,
    Points,
    ScenarioFile,
    Settings,
    Spline,
    SurfaceFile,
    check_ending,
    check_figure,
    check_surface,
    checking,
    read_scenario,
)

MotionTable = Annotated[
    Path | None,
    typer.Option(
        "--table",
        metavar="FILE.csv",
        help="Motion, loads and surface at the angles, one row each; instead of the terminal.",
        show_default=False,
    ),
]
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
    table: MotionTable = None,
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
        if file is not None:
            refuse_inputs(file, loaded.paths, option=option)
    with watching(Display, loaded, kind="contacts"):
        study = wearsim.study_cam(loaded, angles)
    view = study.view
    draw_figure(view.panels(), figure)
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
            what = f"'{part.strip()}' is no range of 1 to {_MOST_ANGLES:,} angles"
            raise ValueError(f"{what}, expected one such as 0:359:1 deg")
        angles += [first + step * place for place in range(int(count + 1e-9) + 1)]
    return angles
