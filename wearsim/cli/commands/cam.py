"""Verb cam: motion, loads and fresh contact of a cam along its angle."""

from __future__ import annotations

from typing import Annotated

import typer

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
    import numpy as np

    from wearsim.atomic_write import refuse_inputs
    from wearsim.cli.progress import Display
    from wearsim.quantities import quantity
    from wearsim.studies.cam.study import study_cam
    from wearsim.studies.kernels import kernels_of

    if figure is not None:
        refuse_inputs(figure, loaded.paths)
    angles = None
    if at is not None:
        with checking("--at"):
            angles = np.array([quantity(text, "rad") for text in at.split(",")])
    with Display(quiet=False, kernels=lambda: kernels_of(loaded, "contacts"), transient=True):
        study = study_cam(loaded, angles)
    from wearsim.cli.render import draw_figure, show_view

    draw_figure(study.view.panels(), figure)
    show_view(study.view, json=json, files={"figure": figure}, more={"figure": figure})
