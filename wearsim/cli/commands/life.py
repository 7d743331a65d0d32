"""`wearsim life`: the life of a design until a limit is reached, and comparison of designs."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wearsim.cli.commands.ensemble import STOPPING, parse_sweep
from wearsim.cli.shared import (
    FigureOption,
    Force,
    Json,
    Quiet,
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
from wearsim.errors import Interrupted, ResultsFileError

if TYPE_CHECKING:
    from wearsim.scenario import Scenario
    from wearsim.studies.life.result import LifeResult

Designs = Annotated[
    list[Path],
    typer.Argument(
        metavar="SCENARIO...",
        help="Scenario, or two to compare with common draws; or files of earlier studies, .h5.",
        show_default=False,
    ),
]
Realisations = Annotated[
    int, typer.Option("--realisations", "-n", min=1, metavar="N", help="Number of realisations.")
]
Limits = Annotated[
    list[str] | None,
    typer.Option(
        "--limit",
        metavar="NAME=VALUE",
        help="Limit that ends the life: depth=50um, roller_depth, lift_error, volume, width,"
        " peak_pressure or clearance. May be repeated; the first that is reached counts.",
        show_default=False,
    ),
]
Life = "a number of passes, or turns of a cam, or a time such as '200 h'"
Target = Annotated[
    str | None,
    typer.Option(
        metavar="LIFE",
        help=f"Life of which the probability is estimated: {Life}.",
        show_default=False,
    ),
]
Shares = Annotated[
    str,
    typer.Option("--b", metavar="P1,P2,...", help="Percentages failed of the lives shown."),
]
Most = Annotated[
    str | None,
    typer.Option(
        "--max",
        metavar="LIFE",
        help="Life at which tests are censored, as --target; default: ten times the longer of"
        " target and test.",
        show_default=False,
    ),
]
Precision = Annotated[
    str | None,
    typer.Option(
        metavar="TARGET",
        help="Stop when the relative half-width of a 95 % confidence interval is reached:"
        " 'b10 3%'.",
        show_default=False,
    ),
]
Rare = Annotated[
    int,
    typer.Option(
        min=0,
        metavar="N",
        help="Number of further tests for a small probability of a life before --target.",
        show_default=False,
    ),
]
RareMethod = Annotated[
    str,
    typer.Option(
        metavar="METHOD",
        help="Method of --rare: importance sampling, subset simulation, or auto, the second with"
        " at most as many tests again where the first fails.",
    ),
]
Sweep = Annotated[
    str | None,
    typer.Option(
        metavar="KEY=V1,V2,...",
        help="Life for each value of a key, with common draws: cam.base_radius=25mm,27mm.",
        show_default=False,
    ),
]
Posterior = Annotated[
    Path | None,
    typer.Option(
        metavar="K.csv",
        help="K/H with what is not known of it, from `wearsim identify --posterior`, instead of the"
        " wear factor of the scenario; of a results file without new tests.",
        show_default=False,
    ),
]
Output = Annotated[Path | None, results_option("-life.h5")]
_FILES = {".h5", ".hdf5"}


def life(
    designs: Designs,
    realisations: Realisations = 400,
    limit: Limits = None,
    target: Target = None,
    b: Shares = "1,10,50",
    most: Most = None,
    precision: Precision = None,
    rare: Rare = 0,
    rare_method: RareMethod = "auto",
    output: Output = None,
    figure: FigureOption = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    posterior: Posterior = None,
    sweep: Sweep = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Compute the life of a design until a limit is reached, and compare two designs."""
    check_figure(figure, force, "--figure")
    with checking("--b"):
        shares = _shares(b)
    files = [path.suffix.lower() in _FILES for path in designs]
    if len(designs) > 2 and not all(files):
        raise typer.BadParameter("give one design, or two to compare", param_hint="SCENARIO")
    if len({path.resolve() for path in designs}) < len(designs):
        raise typer.BadParameter(f"{designs[0]} is given twice", param_hint="SCENARIO")
    if any(files):
        if not all(files):
            raise typer.BadParameter(
                "compare two scenarios or two results files, not one of each",
                param_hint="SCENARIO",
            )
        given = {
            "--limit": limit,
            "--max": most,
            "--precision": precision,
            "--sweep": sweep,
            "--set": settings,
            "--seed": seed,
            "--output": output,
        }
        for option, value in given.items():
            if value is not None:
                raise typer.BadParameter("has no meaning for results files", param_hint=option)
        from wearsim.studies.life.stored_settings import swept_variable

        results = [_opened(path, target, shares, posterior) for path in designs]
        labels = _labels(designs)
        if swept_variable(results):
            labels = [one.variable.text for one in results if one.variable]
        report(results, labels, json, figure)
        return
    with checking("--precision"):
        if precision is not None:
            from wearsim.studies.life.stored_settings import LifeTarget

            LifeTarget.parse(precision)
    from wearsim.studies.life.factor import with_posterior

    texts = [*(settings or []), *([f"seed={seed}"] if seed is not None else [])]
    labels, variants, key = _variants(designs, sweep, texts)
    if posterior is not None:
        with checking("--posterior"):
            variants = [with_posterior(scenario, posterior) for scenario in variants]
    options: dict[str, Any] = {
        "limits": limit or [],
        "target": target,
        "b": shares,
        "most": most,
        "precision": precision,
        "rare": rare,
        "rare_method": rare_method,
        "variable": key,
        "workers": workers,
        "scheduler": checked_scheduler(scheduler, workers),
        "force": force,
    }
    results = _run(labels, variants, realisations, output, figure, quiet, options)
    report(results, labels, json, figure)


def _variants(
    designs: Sequence[Path], sweep: str | None, texts: list[str]
) -> tuple[list[str], list[Any], str]:
    """Return labels and scenarios of the designs, all with one seed, and the key of a sweep."""
    if sweep is not None:
        if len(designs) > 1:
            raise typer.BadParameter("goes with one scenario", param_hint="--sweep")
        with checking("--sweep"):
            key, values = parse_sweep(sweep)
        if any(text.partition("=")[0].strip() == key for text in texts):
            raise typer.BadParameter(f"{key} is also the key of --sweep", param_hint="--set")
        scenarios = [read_scenario(designs[0], [*texts, f"{key}={value}"]) for value in values]
        return list(values), scenarios, key
    scenarios = [read_scenario(path, texts) for path in designs]
    if len({scenario.seed for scenario in scenarios}) > 1:
        note(f"note: {designs[1]} is drawn with the seed of {designs[0]}, for common draws")
        scenarios[1] = scenarios[1].changed({"seed": scenarios[0].seed})
    return _labels(designs), scenarios, ""


def _run(
    labels: Sequence[str],
    scenarios: Sequence[Any],
    realisations: int,
    output: Path | None,
    figure: Path | None,
    quiet: bool,
    options: dict[str, Any],
) -> list[LifeResult]:
    """Run the studies of all designs, and return their results."""
    from wearsim.cli.progress import EnsembleWatcher, stop_on_signals
    from wearsim.results.io.outputs import check_output
    from wearsim.studies.ensemble.sweep import path_of
    from wearsim.studies.kernels import kernels_of
    from wearsim.studies.life import api, settings

    several = len(scenarios) > 1
    base = output or settings.results_file(scenarios[0])
    same = {settings.results_file(scenario) for scenario in scenarios}
    if not several:
        paths = [base]
    elif output is None and len(same) == len(scenarios):
        paths = [settings.results_file(scenario) for scenario in scenarios]
    else:
        paths = [path_of(base, label) for label in labels]
    checked = []
    for scenario in scenarios:
        with checking("--limit"):
            checked.append(settings.with_limits(scenario, options["limits"]))
    for name, option in (("target", "--target"), ("most", "--max")):
        with checking(option):
            for scenario in checked:
                aim = options["target"]
                most = options["most"] if name == "most" else None
                settings.settings_of(scenario, realisations, aim, (10.0,), most)
    with checking("--rare"):
        for scenario in checked:
            chosen = settings.settings_of(
                scenario, realisations, options["target"], (10.0,), options["most"]
            )
            rare = (options[name] for name in ("rare", "precision", "rare_method"))
            settings.with_rare_events(scenario, chosen, *rare)
    going_on = partial(_going_on, labels, checked, paths, options["variable"])
    for scenario, path in zip(checked, paths, strict=True):
        refuse_same_file(figure, path, scenario.paths)
        with going_on(path):
            check_output(path, options["force"], scenario.paths)
    results = []
    for label, scenario, path in zip(labels, checked, paths, strict=True):
        if several and not quiet:
            note(f"{label}: {path}")
        watcher = EnsembleWatcher(quiet, kernels=partial(kernels_of, scenario))
        with going_on(path), stop_on_signals(STOPPING) as stop, watcher as watch:
            found = api.life(
                scenario,
                realisations,
                path,
                on_progress=watch,
                stop_requested=stop.is_set,
                on_notice=watch.notice,
                **{**options, "limits": []},
            )
        results.append(found)
    return results


def _labels(paths: Sequence[Path]) -> list[str]:
    stems = [path.stem.removesuffix("-life") for path in paths]
    return stems if len(set(stems)) == len(stems) else [str(path) for path in paths]


def _shares(text: str) -> tuple[float, ...]:
    """Return the percentages of a text such as "1,10,50"."""
    try:
        shares = tuple(float(part) for part in text.split(","))
    except ValueError as error:
        raise ValueError(f"'{text}' is not a list of percentages such as 1,10,50") from error
    if not all(0.0 < share < 100.0 for share in shares):
        raise ValueError(f"'{text}' has a percentage that is not between 0 and 100")
    return shares


def _opened(
    path: Path, target: str | None, shares: tuple[float, ...], posterior: Path | None
) -> LifeResult:
    """Return the result in a file, for another target, other percentages and another K/H."""
    from wearsim.errors import ResultsFileError
    from wearsim.studies.life.result import LifeResult
    from wearsim.studies.life.settings import parse_life
    from wearsim.studies.opening import open_results

    result = open_results(path)
    if not isinstance(result, LifeResult):
        raise ResultsFileError(f"{path}: holds no study of lives; wearsim life SCENARIO makes one")
    changed: dict[str, Any] = {"shares": list(shares)}
    if target is not None:
        with checking("--target"):
            found = parse_life(target, result.unit, result.settings.rate, "target")
            if found > result.most:
                raise ValueError(
                    f"{found:,.0f} {result.unit} is beyond the maximum of {path},"
                    f" {result.most:,.0f} {result.unit}"
                )
        changed["target"] = found * result.settings.per_unit
    if posterior is not None:
        with checking("--posterior"):
            result = result.with_posterior(posterior)
    return result.with_settings(**changed)


def report(
    results: Sequence[LifeResult], labels: Sequence[str], json: bool, figure: Path | None
) -> None:
    """Write the lives of designs to stdout, and compare each with the first.

    Parameters
    ----------
    results : sequence of LifeResult
    labels : sequence of str
    json : bool
        Whether to write JSON instead of tables.
    figure : Path, optional
        Name of the figure.

    Raises
    ------
    ResultsFileError, SolverError
        If the units of lives differ, or all realisations of a design failed.
    """
    from wearsim.cli.render import draw_figure, show_view
    from wearsim.errors import SolverError
    from wearsim.studies.opening import comparison_of

    views = [result.view for result in results]
    for result in results:
        if result.failed and not result.count:
            note(f"warning: {result.view.failures}")
            raise SolverError(f"{result.path}: all realisations failed")
    compared = comparison_of(results, labels) if len(results) > 1 else views[0]
    draw_figure(compared.panels(), figure)
    if not json or compared is views[0]:
        for result, view in zip(results, views, strict=True):
            files = {"results file": result.path}
            show_view(view, json=json, files=files, more={"figure": figure})
    if compared is not views[0]:
        show_view(compared, json=json, more={"figure": figure})
    if figure is not None and not json:
        note(f"figure: {figure}")


@contextmanager
def _going_on(
    labels: Sequence[str],
    scenarios: Sequence[Scenario],
    paths: Sequence[Path],
    key: str,
    path: Path,
) -> Iterator[None]:
    """Add the commands for the other designs to the error of a file that exists or was stopped.

    Parameters
    ----------
    labels, scenarios, paths : sequence
        Designs and their results files.
    key : str
        Key of a sweep, whose values are the labels; empty for scenarios.
    path : Path
        The file in question.

    Raises
    ------
    ResultsFileError, Interrupted
        Those within, with more text where several designs are compared.
    """
    try:
        yield
    except (ResultsFileError, Interrupted) as error:
        if len(paths) == 1 or not path.exists():
            raise
        commands = []
        for label, scenario, file in zip(labels, scenarios, paths, strict=True):
            if file.exists():
                continue
            swept = ["--set", f"{key}={label}"] if key else []
            options = [*swept, "--seed", str(scenario.seed), "-o", str(file)]
            commands.append(shlex.join(["wearsim", "life", scenario.file, *options]))
        steps = [f"`{command}` with the other options" for command in commands]
        steps.append(f"`{shlex.join(['wearsim', 'life', *map(str, paths)])}`")
        text = f"{error.at_shell}; the comparison is finished by {', then '.join(steps)}"
        raise type(error)(text) from error
