"""`wearsim ensemble`: a wear test for each realisation of the random inputs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wearsim.cli.shared import (
    FigureOption,
    Force,
    Json,
    Quiet,
    Realisations,
    ScenarioFile,
    Scheduler,
    Seed,
    Settings,
    Workers,
    check_figure,
    checked_scheduler,
    checking,
    note,
    read_scenario,
    refuse_same_file,
    results_option,
)

if TYPE_CHECKING:
    from wearsim.studies.ensemble.result import EnsembleResult

STOPPING = "stopping after the next batch; repeat to stop at once"
_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_WITHOUT_SPACE = re.compile(rf"({_NUMBER})([A-Za-zµμ°].*)")
_QUANTITY = re.compile(rf"({_NUMBER})\s*(\S.*)?")
_EXAMPLE = "such as load.normal_force=250N,300N,350N"


def ensemble(
    scenario: ScenarioFile,
    realisations: Realisations = 1000,
    output: Annotated[Path | None, results_option("-ensemble.h5")] = None,
    figure: FigureOption = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    precision: Annotated[
        str | None,
        typer.Option(
            metavar="TARGET",
            help="Stop when the relative half-width of a 95 % confidence interval is reached,"
            " 'depth.mean 1%'. First checked after 64 realisations.",
            show_default=False,
        ),
    ] = None,
    until: Annotated[str | None, typer.Option(metavar="TARGET", hidden=True)] = None,
    plan: Annotated[
        str | None,
        typer.Option(
            metavar="PLAN",
            help="Sampling design: monte-carlo, latin-hypercube, sobol, saltelli or"
            " control-variate; default: that of the scenario.",
            show_default=False,
        ),
    ] = None,
    sweep: Annotated[
        str | None,
        typer.Option(
            metavar="KEY=V1,V2,...",
            help="Run and compare one ensemble per value: load.normal_force=250N,300N.",
            show_default=False,
        ),
    ] = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Run a wear test for each realisation of the random inputs."""
    check_figure(figure, force, "--figure")
    from wearsim.cli.progress import EnsembleWatcher, stop_on_signals
    from wearsim.studies.ensemble import api
    from wearsim.studies.ensemble.designs import parse_plan
    from wearsim.studies.ensemble.sweep import path_of, run_sweep
    from wearsim.studies.kernels import kernels_of

    options: dict[str, Any] = {"plan": plan, "workers": workers, "force": force}
    with checking("--plan"):
        options["plan"] = plan if plan is None else parse_plan(plan)
    if until is not None:
        if precision is not None:
            raise typer.BadParameter("is the former name of --precision", param_hint="--until")
        note("warning: --until of ensembles is now --precision; the old name will be removed")
        precision = until
    with checking("--precision"):
        options["precision"] = precision
        if precision is not None:
            api.parse_target(precision)
    options["scheduler"] = checked_scheduler(scheduler, workers)
    texts = [*(settings or []), *([f"seed={seed}"] if seed is not None else [])]
    path = output if output is not None else Path(f"{scenario.stem}-ensemble.h5")
    if sweep is None:
        key, files = "", {"": path}
    else:
        with checking("--sweep"):
            key, values = parse_sweep(sweep)
        if any(text.partition("=")[0].strip() == key for text in texts):
            raise typer.BadParameter(f"{key} is also the key of --sweep", param_hint="--set")
        files = {value: path_of(path, value) for value in values}
    scenarios = {
        value: read_scenario(scenario, [*texts, *([f"{key}={value}"] if key else [])])
        for value in files
    }
    for value, file in files.items():
        refuse_same_file(figure, file, scenarios[value].paths)

    def announce(value: str, file: Path) -> None:
        if not quiet:
            note(f"{key} = {value}: {file}")

    first = scenarios[next(iter(files))]
    watcher = EnsembleWatcher(quiet, kernels=lambda: kernels_of(first))
    with stop_on_signals(STOPPING) as stop, watcher as watch:
        options |= {
            "on_progress": watch,
            "stop_requested": stop.is_set,
            "on_notice": watch.notice,
        }
        if key:
            options["on_value"] = announce
            results = run_sweep(
                list(scenarios.values()), list(files), realisations, path, **options
            )
        else:
            results = [api.ensemble(scenarios[""], realisations, path, **options)]
    if not key:
        report(results[0], json, figure, watch.workers)
        return
    for result in results:
        _end(result)
    from wearsim.cli.render import draw_figure, show_view
    from wearsim.studies.comparison.view import comparison_view

    view = comparison_view(results, list(files), "depth", key)
    draw_figure(view.panels(), figure)
    show_view(view, json=json, files={"figure": figure}, more={"figure": figure})


def report(result: EnsembleResult, json: bool, figure: Path | None, workers: str = "") -> None:
    """Write an ensemble or lives to stdout and failures to stderr, and draw the figure.

    Parameters
    ----------
    result : EnsembleResult
    json : bool
        Whether to write JSON instead of tables.
    figure : Path, optional
        Name of the figure.
    workers : str
        Workers that were used, "2 processes".

    Raises
    ------
    SolverError
        If all realisations failed.
    """
    from wearsim.cli.render import draw_figure, show_view
    from wearsim.studies.execution.processes import InProcess

    if workers == InProcess.describe:
        workers = "this process, one realisation at a time"
    view = result.view
    draw_figure(view.panels(), figure)
    files = {"workers": workers, "results file": result.path, "figure": figure}
    show_view(view, json=json, files=files, more={"workers": workers or None, "figure": figure})
    _end(result)


def _end(result: EnsembleResult) -> None:
    """Raise an error if all realisations failed."""
    if result.failed and not result.count:
        from wearsim.errors import SolverError

        raise SolverError(f"{result.path}: all realisations failed")


def parse_sweep(text: str) -> tuple[str, tuple[str, ...]]:
    """Return the key and the values of a sweep.

    Parameters
    ----------
    text : str
        "load.normal_force=250N,300N"; the space before a unit may be left out.

    Returns
    -------
    key : str
        Dotted key.
    values : tuple of str
        Two or more different values, with a space before the unit.

    Raises
    ------
    ValueError
        If there is no key, an empty value, fewer than two values, or two equal ones.
    """
    key, equals, listed = text.partition("=")
    if not equals or not key.strip():
        raise ValueError(f"'{text}' is not a key with values, expected one {_EXAMPLE}")
    values = tuple(
        _WITHOUT_SPACE.sub(r"\1 \2", value) if _WITHOUT_SPACE.fullmatch(value) else value
        for value in map(str.strip, listed.split(","))
    )
    if not all(values):
        raise ValueError(f"'{text}' has an empty value, expected values {_EXAMPLE}")
    if len(values) < 2:
        raise ValueError(f"'{text}' has one value, expected two or more {_EXAMPLE}")
    for number, value in enumerate(values):
        for before in values[:number]:
            if _are_equal(before, value):
                raise ValueError(f"'{before}' and '{value}' are the same value; remove one")
    return key.strip(), values


def _are_equal(one: str, other: str) -> bool:
    """Return whether two values are equal, also in different units."""
    matches = [_QUANTITY.fullmatch(value) for value in (one, other)]
    if matches[0] is None or matches[1] is None:
        return one == other
    (first, unit), (second, other_unit) = matches[0].groups(), matches[1].groups()
    if not (unit and other_unit):
        return not (unit or other_unit) and float(first) == float(second)
    from wearsim.units import conversion

    try:
        factor = conversion(other_unit, unit)
    except ValueError:  # reported when the scenario is read
        return one == other
    from fractions import Fraction

    return Fraction(first) == Fraction(second) * factor
