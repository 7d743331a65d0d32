"""`wearsim ensemble`: a whole wear test for each realisation of the random inputs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wearsim.cli.arguments import (
    Drawing,
    Force,
    Json,
    Quiet,
    Realisations,
    ScenarioFile,
    Scheduler,
    Seed,
    Settings,
    Workers,
    check_drawing,
    check_figure,
    check_workforce,
    read_scenario,
    results_option,
)
from wearsim.cli.output import note, refuse_existing, tell_notes, write_json, write_line

if TYPE_CHECKING:
    from wearsim.cli.sweep_option import Swept
    from wearsim.results import EnsembleResult
    from wearsim.scenario import Scenario

Output = Annotated[Path | None, results_option("-ensemble.h5")]
Until = Annotated[
    str | None,
    typer.Option(
        metavar="TARGET",
        help="Stop as soon as this is known well enough, 'depth.mean 1%': half of its 95 %"
        " interval, in parts of it. It is first looked at after 64 realisations.",
        show_default=False,
    ),
]
Plan = Annotated[
    str | None,
    typer.Option(
        metavar="PLAN",
        help="monte-carlo, latin-hypercube, sobol, saltelli or control-variate; by default the"
        " scenario's.",
        show_default=False,
    ),
]
Sweep = Annotated[
    str | None,
    typer.Option(
        metavar="KEY=V1,V2,...",
        help="An ensemble for each value, and their comparison: load.normal_force=250N,300N.",
        show_default=False,
    ),
]
_ALONE = "this process, one realisation after the other"
STOPPING = "stopping as soon as the next batch is in; once more to stop at once"


def ensemble(
    scenario: ScenarioFile,
    realisations: Realisations = 1000,
    output: Output = None,
    figure: Drawing = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    until: Until = None,
    plan: Plan = None,
    sweep: Sweep = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Run a wear test for each realisation of the random inputs."""
    if figure is not None:
        check_figure(figure, "--figure")
        refuse_existing(figure, force, "--figure")
    options: dict[str, Any] = {
        "plan": _plan(plan),
        "until": _until(until),
        "scheduler": check_workforce(scheduler, workers),
        "workers": workers,
        "force": force,
    }
    texts = [*(settings or []), *([f"seed={seed}"] if seed is not None else [])]
    path = output if output is not None else Path(f"{scenario.stem}-ensemble.h5")
    if sweep is not None:
        from wearsim.cli.sweep_option import parse_sweep

        swept = parse_sweep(sweep)
        if any(text.partition("=")[0].strip() == swept.key for text in texts):
            raise typer.BadParameter(
                f"{swept.key} is set besides; leave it to --sweep", param_hint="--set"
            )
        _sweep(scenario, texts, swept, realisations, path, figure, options, json, quiet)
        return
    loaded = read_scenario(scenario, texts)
    if figure is not None:
        check_drawing(figure, path, loaded.paths)
    _run(loaded, realisations, path, figure, options, json, quiet)


def _run(
    loaded: Scenario,
    realisations: int,
    path: Path,
    figure: Path | None,
    options: dict[str, Any],
    json: bool,
    quiet: bool,
) -> None:
    from wearsim.cli.progress.ensemble import watching_ensemble
    from wearsim.cli.signals import stop_on_signals
    from wearsim.studies.ensemble.api import ensemble as study

    with stop_on_signals(STOPPING) as stop, watching_ensemble(quiet) as watch:
        result = study(
            loaded,
            realisations,
            path,
            on_progress=watch,
            stop_requested=stop.requested,
            on_notice=note,
            **options,
        )
    if figure is not None:
        draw(result, figure)
    report(result, json, figure, in_words(watch.workers))


def _plan(name: str | None) -> str | None:
    """Return a plan's name, checked."""
    if name is None:
        return None
    from wearsim.studies.ensemble.designs import parse_plan

    try:
        return parse_plan(name)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--plan") from error


def _until(text: str | None) -> str | None:
    """Return what is to be reached, checked."""
    if text is None:
        return None
    from wearsim.studies.ensemble.api import parse_target

    try:
        parse_target(text)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--until") from error
    return text


def _sweep(
    scenario: Path,
    settings: list[str],
    swept: Swept,
    realisations: int,
    path: Path,
    figure: Path | None,
    options: dict[str, Any],
    json: bool,
    quiet: bool,
) -> None:
    """Run an ensemble for each value, and compare them."""
    from wearsim.cli.progress.ensemble import watching_ensemble
    from wearsim.cli.signals import stop_on_signals
    from wearsim.studies.ensemble.sweep import path_of
    from wearsim.studies.ensemble.sweep import sweep as study

    scenarios = {
        value: read_scenario(scenario, [*settings, swept.setting(value)]) for value in swept.values
    }
    if figure is not None:
        for value, loaded in scenarios.items():
            check_drawing(figure, path_of(path, value), loaded.paths)

    def announce(value: str, file: Path) -> None:
        if not quiet:
            note(f"{swept.key} = {value}: {file}")

    with stop_on_signals(STOPPING) as stop, watching_ensemble(quiet) as watch:
        results = study(
            scenarios.__getitem__,
            swept.values,
            realisations,
            path,
            on_value=announce,
            on_progress=watch,
            stop_requested=stop.requested,
            on_notice=note,
            **options,
        )
    from wearsim.cli.render.comparison_table import report_comparison

    for result in results:
        tell_failures(result)
        _refuse_nothing(result)
    report_comparison(results, list(swept.values), "depth", swept.key, figure, json)


def report(result: EnsembleResult, json: bool, figure: Path | None, workers: str = "") -> None:
    """Write how an ensemble ended to stdout, and what failed to stderr.

    Parameters
    ----------
    result : EnsembleResult
    json : bool
        As one JSON object.
    figure : Path, optional
        The figure that was drawn.
    workers : str
        Who did the work.

    Raises
    ------
    SolverError
        If every realisation failed.
    """
    from wearsim.cli.render.ensemble_table import as_json, write_ensemble
    from wearsim.cli.render.run_footer import ensemble_line

    if json:
        write_json({**as_json(result), "workers": workers or None, "figure": figure})
    else:
        more = [("results file", str(result.path))]
        more += [("figure", str(figure))] if figure else []
        write_ensemble(result, more, workers)
        write_line(ensemble_line(result))
        tell_notes(result)
    tell_failures(result)
    _refuse_nothing(result)


def tell_failures(result: EnsembleResult) -> None:
    """Write how many realisations failed, and why the first did, to stderr."""
    if not result.failed:
        return
    from wearsim.report.text.units import count

    first, text = next(iter(result.errors.items()))
    note(
        f"warning: {count(result.failed)} of {count(result.count + result.failed)} realisations"
        f" failed, the first of them number {first}: {text}\n"
        "the same draws fail again unless the scenario or the software changes; after a lack of"
        " memory, a killed worker or an updated plugin run them again with:"
        f" wearsim resume {result.path} --failed"
    )


def in_words(workers: str) -> str:
    """Return who did the work; where one worker does, it is this process whatever was asked for."""
    from wearsim.studies.execution.factory import InProcess

    return _ALONE if workers == InProcess.describe else workers


def _refuse_nothing(result: EnsembleResult) -> None:
    """End with exit code 1 where not one realisation ended well."""
    if result.failed and not result.count:
        from wearsim.errors import SolverError

        raise SolverError(f"{result.path}: no realisation ended well")


def draw(result: EnsembleResult, path: Path) -> None:
    """Write the figure of an ensemble."""
    from wearsim.report.figures.ensemble import ensemble_figure
    from wearsim.report.parts.saving import save_figure

    save_figure(ensemble_figure(result), path)
