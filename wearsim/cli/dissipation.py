"""`wearsim dissipation`: realisations of one contact, their power and its spread."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.arguments import Force, Json, Quiet, ScenarioFile, Settings, check_figure
from wearsim.cli.output import note, refuse_existing, write_json

if TYPE_CHECKING:
    from wearsim.results import DissipationResult
    from wearsim.scenario import Scenario

Number = Annotated[
    int, typer.Option("--realisations", "-n", min=1, metavar="N", help="How many realisations.")
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="FILE.h5",
        help="Results file; by default the scenario's name with -dissipation.h5, in the current"
        " folder.",
        show_default=False,
    ),
]
Drawing = Annotated[
    Path | None,
    typer.Option("--figure", metavar="FIG", help="Figure: .png, .pdf or .svg.", show_default=False),
]
Plan = Annotated[
    str | None,
    typer.Option(
        metavar="PLAN",
        help="monte-carlo, latin-hypercube or sobol; by default the scenario's.",
        show_default=False,
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(
        min=0, metavar="SEED", help="Seed; by default the scenario's.", show_default=False
    ),
]

_STOPPING = (
    "stopping after these realisations, and what is done is kept; once more to stop at once and"
    " lose it"
)


def dissipation(
    scenario: ScenarioFile,
    realisations: Number = 1000,
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
        _check_apart(figure, path, loaded)
    from wearsim.cli.counting import counting
    from wearsim.cli.stop import stop_on_signals
    from wearsim.studies.dissipation import dissipation as study

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


def _check_apart(figure: Path, output: Path, scenario: Scenario) -> None:
    """Raise if the figure would take the place of the results file, or of an input."""
    from wearsim.results import refuse_inputs, same_file

    refuse_inputs(figure, scenario.paths, option="--figure")
    if same_file(figure, output):
        raise typer.BadParameter(
            f"{figure} is the results file too, as -o says; give them different names",
            param_hint="--figure",
        )


def _report(result: DissipationResult, json: bool, figure: Path | None) -> None:
    from wearsim.cli.spread import as_json, write_spread

    if json:
        write_json({**as_json(result), "figure": figure})
        return
    more = [("results file", str(result.path))]
    write_spread(result, [*more, *([("figure", str(figure))] if figure else [])])
    tell(result)


def tell(result: DissipationResult) -> None:
    """Write what a user should know of a study to stderr."""
    for text in result.notes:
        note(f"note: {text}")
    for text in result.warnings:
        note(f"warning: {text}")


def draw(result: DissipationResult, path: Path) -> None:
    """Write the figure of a study."""
    from wearsim.report.dissipation import dissipation_figure
    from wearsim.report.saving import save_figure

    save_figure(dissipation_figure(result), path)
