"""`wearsim dissipation`: Monte Carlo study of the power dissipated in one contact."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wearsim.cli.shared import (
    FigureOption,
    Force,
    Json,
    Quiet,
    Realisations,
    ScenarioFile,
    Seed,
    Settings,
    check_figure,
    read_scenario,
    refuse_same_file,
    results_option,
    write_json,
    write_notes,
)

Output = Annotated[Path | None, results_option("-dissipation.h5")]
Plan = Annotated[
    str | None,
    typer.Option(
        metavar="PLAN",
        help="Sampling design: monte-carlo, latin-hypercube or sobol; default: that of the"
        " scenario.",
        show_default=False,
    ),
]
_STOPPING = (
    "stopping after the current realisations, results are kept; repeat to stop at once and lose"
    " them"
)


def dissipation(
    scenario: ScenarioFile,
    realisations: Realisations = 1000,
    output: Output = None,
    figure: FigureOption = None,
    plan: Plan = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Solve one contact for many realisations of its random inputs."""
    check_figure(figure, force, "--figure")
    given = {"sampling.plan": plan, "seed": seed}
    options = [f"{key}={value}" for key, value in given.items() if value is not None]
    loaded = read_scenario(scenario, [*(settings or []), *options])
    path = output if output is not None else Path(f"{scenario.stem}-dissipation.h5")
    refuse_same_file(figure, path, loaded.paths)
    from wearsim.cli.progress import Counter, stop_on_signals
    from wearsim.cli.render.summary import dissipation_json, dissipation_line, write_spread
    from wearsim.studies.contact.monte_carlo import dissipation as study

    with stop_on_signals(_STOPPING) as stop, Counter(quiet) as counter:
        result = study(
            loaded,
            realisations,
            path,
            force=force,
            on_progress=counter,
            stop_requested=stop.is_set,
        )
    if figure is not None:
        from wearsim.cli.commands.plot import draw

        draw(result, figure)
    if json:
        write_json({**dissipation_json(result), "figure": figure})
        return
    more = [("results file", str(result.path))]
    write_spread(result, [*more, *([("figure", str(figure))] if figure else [])])
    typer.echo(dissipation_line(result))
    write_notes(result.notes, result.warnings)
