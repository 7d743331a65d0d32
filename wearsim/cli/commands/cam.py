"""Verb cam: motion, loads and fresh contact of a cam along its angle."""

from __future__ import annotations

from typing import Annotated

import typer

import wearsim
from wearsim.atomic_write import refuse_inputs
from wearsim.cli.render import show_with_figure
from wearsim.cli.shared import (
    Figure,
    Force,
    Json,
    ScenarioFile,
    Settings,
    check_figure,
    checking,
    read_scenario,
)


def cam(
    scenario: ScenarioFile,
    at: Annotated[
        str | None,
        typer.Option(
            "--at",
            metavar="ANGLES",
            help="Angles of the cam instead of the stations of a run: '10 deg,80 deg'.",
            show_default=False,
        ),
    ] = None,
    settings: Settings = None,
    figure: Figure = None,
    json: Json = False,
    force: Force = False,
) -> None:
    """Show motion, loads and fresh contact of a cam along its angle."""
    check_figure(figure, force)
    loaded = read_scenario(scenario, settings)
    from wearsim.cli.progress import Display, watching
    from wearsim.quantities import quantity

    if figure is not None:
        refuse_inputs(figure, loaded.paths)
    with checking("--at"):
        angles = None if at is None else [quantity(text, "rad") for text in at.split(",")]
    with watching(Display, loaded, kind="contacts"):
        study = wearsim.study_cam(loaded, angles)
    show_with_figure(study.view, figure, json=json)
