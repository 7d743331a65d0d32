"""`wearsim dissipation`: realisations of one contact, their power and its spread."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.arguments import (
    Drawing,
    Force,
    Json,
    Quiet,
    Realisations,
    ScenarioFile,
    Seed,
    Settings,
    check_drawing,
    check_figure,
    results_option,
)
from wearsim.cli.output import refuse_existing, tell_notes, write_json, write_line

if TYPE_CHECKING:
    from wearsim.results import DissipationResult
    from wearsim.scenario import Scenario

Output = Annotated[Path | None, results_option("-dissipation.h5")]
Plan = Annotated[
    str | None,
    typer.Option(
        metavar="PLAN",
        help="monte-carlo, latin-hypercube or sobol; by default the scenario's.",
        show_default=False,
    ),
]
_STOPPING = (
    "stopping after these realisations, and what is done is kept; once more to stop at once and"
    " lose it"
)


def dissipation(
    scenario: ScenarioFile,
    realisations: Realisations = 1000,
    output: Output = None,
    figure: Drawing = None,
    plan: Plan = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Draw a contact's random inputs many times, and solve each."""
    if figure is not None:
        check_figure(figure, "--figure")
        refuse_existing(figure, force, "--figure")
    loaded = _read(scenario, settings, plan, seed)
    path = output if output is not None else Path(f"{scenario.stem}-dissipation.h5")
    if figure is not None:
        check_drawing(figure, path, loaded.paths)
    from wearsim.cli.progress.count import counting
    from wearsim.cli.signals import stop_on_signals
    from wearsim.studies.contact.monte_carlo import dissipation as study

    with stop_on_signals(_STOPPING) as stop, counting(quiet, "realisations") as counted:
        result = study(
            loaded,
            realisations,
            path,
            force=force,
            on_progress=counted,
            stop_requested=stop.requested,
        )
    if figure is not None:
        draw(result, figure)
    _report(result, json, figure)


def _read(path: Path, settings: list[str] | None, plan: str | None, seed: int | None) -> Scenario:
    """Return the scenario with the options in the place of what it says."""
    from wearsim.cli.arguments import read_scenario

    more = [f"sampling.plan={plan}"] if plan is not None else []
    more += [f"seed={seed}"] if seed is not None else []
    return read_scenario(path, [*(settings or []), *more])


def _report(result: DissipationResult, json: bool, figure: Path | None) -> None:
    from wearsim.cli.render.dissipation_table import as_json, write_spread
    from wearsim.cli.render.run_footer import dissipation_line

    if json:
        write_json({**as_json(result), "figure": figure})
        return
    more = [("results file", str(result.path))]
    write_spread(result, [*more, *([("figure", str(figure))] if figure else [])])
    write_line(dissipation_line(result))
    tell_notes(result)


def draw(result: DissipationResult, path: Path) -> None:
    """Write the figure of a study."""
    from wearsim.report.figures.dissipation import dissipation_figure
    from wearsim.report.parts.saving import save_figure

    save_figure(dissipation_figure(result), path)
