"""`wearsim ensemble`: a wear test for each realisation of the random inputs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import wearsim
from wearsim.cli.render import show_with_figure
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
    refuse,
    refuse_same_file,
    results_option,
    settings_with,
)
from wearsim.errors import SolverError

if TYPE_CHECKING:
    from wearsim.studies.ensemble.result import EnsembleResult

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
    from wearsim.cli.progress import BATCHES, EnsembleWatcher, watching
    from wearsim.studies.comparison.view import comparison_view
    from wearsim.studies.ensemble.api import parse_target
    from wearsim.studies.ensemble.designs import parse_plan
    from wearsim.studies.ensemble.sweep import path_of, run_sweep

    with checking("--plan"):
        chosen_plan = plan and parse_plan(plan)
    if until is not None:
        refuse(precision is not None, "is the former name of --precision", "--until")
        note("warning: --until of ensembles is now --precision; the old name will be removed")
        precision = until
    if precision is not None:
        with checking("--precision"):
            parse_target(precision)
    options: dict[str, Any] = {
        "plan": chosen_plan,
        "workers": workers,
        "force": force,
        "precision": precision,
        "scheduler": checked_scheduler(scheduler, workers),
    }
    texts = settings_with(settings, seed=seed)
    path = output if output is not None else Path(f"{scenario.stem}-ensemble.h5")
    key, values = swept(sweep, texts)
    files = {value: path_of(path, value) for value in values} if key else {"": path}
    scenarios = {
        value: read_scenario(scenario, [*texts, *([f"{key}={value}"] if key else [])])
        for value in files
    }
    for value, file in files.items():
        refuse_same_file(figure, file, scenarios[value].paths)

    def announce(value: str, file: Path | None) -> None:
        if not quiet:
            note(f"{key} = {value}: {file}")

    first = scenarios[next(iter(files))]
    with watching(EnsembleWatcher, first, quiet, BATCHES) as watch:
        options |= watch.callbacks
        if not key:
            result = wearsim.ensemble(first, realisations, path, **options)
        else:
            designs = list(scenarios.values())
            results = run_sweep(
                designs, list(files), realisations, path, on_value=announce, **options
            )
    if not key:
        show_ensemble(result, json, figure, watch.workers)
        return
    for item in results:
        _refuse_failed(item)
    show_with_figure(comparison_view(results, list(files), "depth", key), figure, json=json)


def show_ensemble(
    result: EnsembleResult, json: bool, figure: Path | None, workers: str = ""
) -> None:
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
    from wearsim.studies.execution.processes import InProcess

    if workers == InProcess.describe:
        workers = "this process, one realisation at a time"
    files, more = {"workers": workers, "results file": result.path}, {"workers": workers or None}
    show_with_figure(result.view, figure, json=json, files=files, more=more)
    _refuse_failed(result)


def _refuse_failed(result: EnsembleResult) -> None:
    """Raise an error if all realisations failed."""
    if result.failed and not result.count:
        raise SolverError(f"{result.path}: all realisations failed")


def swept(sweep: str | None, settings: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """Return key and values of --sweep, which are empty without it.

    Raises
    ------
    typer.BadParameter
        If it cannot be read, or its key is also the key of a setting.
    """
    if sweep is None:
        return "", ()
    with checking("--sweep"):
        key, values = parse_sweep(sweep)
    given = any(text.partition("=")[0].strip() == key for text in settings)
    refuse(given, f"{key} is also the key of --sweep", "--set")
    return key, values


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
