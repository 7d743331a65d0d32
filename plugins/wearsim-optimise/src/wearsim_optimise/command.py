"""`wearsim optimise`: the best values of design variables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.shared import (
    FigureOption,
    Force,
    Json,
    Quiet,
    ScenarioFile,
    Scheduler,
    Seed,
    Settings,
    Workers,
    check_ending,
    check_figure,
    checked_scheduler,
    read_scenario,
    refuse_same_file,
    results_option,
    settings_with,
)

if TYPE_CHECKING:
    from wearsim_optimise.result import OptimisationResult

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def optimise(
    scenario: ScenarioFile,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=LOW:HIGH",
            help="Variable with its bounds: cam.base_radius=35mm:60mm; whole numbers"
            " operation.rollers=1:4; a list cam.material=steel,bronze. May be repeated.",
            show_default=False,
        ),
    ] = None,
    maximise: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Quantity to make great, as cam, contact, run, ensemble and life state it:"
            " life.b10. Two objectives give a front.",
            show_default=False,
        ),
    ] = None,
    minimise: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Quantity to make small.", show_default=False),
    ] = None,
    subject_to: Annotated[
        list[str] | None,
        typer.Option(
            "--subject-to",
            metavar="LIMIT",
            help="Constraint: 'peak_pressure < 900 MPa'. May be repeated.",
            show_default=False,
        ),
    ] = None,
    then: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Quantity that is least among designs within 1 % of the best.",
            show_default=False,
        ),
    ] = "",
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=WIDTH",
            help="Tolerance of the drawing: cam.base_radius=0.05mm. May be repeated.",
            show_default=False,
        ),
    ] = None,
    realisations: Annotated[
        int | None,
        typer.Option(
            "--realisations",
            "-n",
            min=1,
            metavar="N",
            help="Realisations of lives and ensembles; default: 40.",
            show_default=False,
        ),
    ] = None,
    evaluations: Annotated[
        int | None,
        typer.Option(
            min=3,
            metavar="N",
            help="Most designs of the search; default: 10, and 15 for each variable.",
            show_default=False,
        ),
    ] = None,
    starts: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Starts; default: 3.", show_default=False),
    ] = None,
    method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="cobyqa, evolution, or auto: the second for integers, lists and counted lives.",
        ),
    ] = "auto",
    most: Annotated[
        str | None,
        typer.Option(
            "--max",
            metavar="LIFE",
            help="Life at which tests are censored, as of `wearsim life`.",
            show_default=False,
        ),
    ] = None,
    confirm: Annotated[
        bool,
        typer.Option("--confirm/--no-confirm", help="Confirm the optimum with fresh draws."),
    ] = True,
    best: Annotated[
        Path | None,
        typer.Option(
            metavar="BEST.toml",
            help="Write the best design as a scenario.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[Path | None, results_option("-optimise.h5")] = None,
    figure: FigureOption = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Choose the best values of design variables, by lives and constraints."""
    check_figure(figure, force, "--figure")
    check_ending(best, force, "--best", (".toml",), "ending of a scenario")
    loaded = read_scenario(scenario, settings_with(settings, seed=seed))
    name = scenario.stem.removesuffix("-optimise")
    path = output if output is not None else Path(f"{name}-optimise.h5")
    refuse_same_file(figure, path, loaded.paths)
    from wearsim.atomic_write import refuse_inputs
    from wearsim.cli.progress import PARTS, PartWatcher, watching
    from wearsim.cli.render import show_with_figure
    from wearsim_optimise.api import optimise as study

    if best is not None:
        refuse_inputs(best, loaded.paths, option="--best")
    with watching(PartWatcher, loaded, quiet, PARTS) as watch:
        result = study(
            loaded,
            vary or (),
            path,
            maximise=maximise or (),
            minimise=minimise or (),
            subject_to=subject_to or (),
            then=then,
            realisations=realisations,
            evaluations=evaluations,
            starts=starts,
            method=method,
            most=most,
            tolerance=tolerance or (),
            confirm=confirm,
            workers=workers,
            scheduler=checked_scheduler(scheduler, workers),
            force=force,
            **watch.callbacks,
        )
    if best is not None:
        write_best(result, best)
    files = {"results file": result.path, "best design": best}
    show_with_figure(result.view, figure, json=json, files=files, more={"best_scenario": best})


def write_best(result: OptimisationResult, path: Path) -> None:
    """Write the best design as a scenario, beside copies of the files that it names."""
    from wearsim.atomic_write import replacement

    scenario = result.best_scenario
    with replacement(path) as file:
        file.write(scenario.text.encode())
    if path.resolve().parent == Path(scenario.file).resolve().parent:
        return
    for name, text in scenario.files.items():
        copy = path.parent / name
        if not copy.exists():
            with replacement(copy) as file:
                file.write(text.encode())
