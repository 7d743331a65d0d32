"""`wearsim life`: the life of a design until a limit is reached, and comparison of designs."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import wearsim
from wearsim.cli.commands.life_use import LifeUse
from wearsim.cli.commands.run import swept
from wearsim.cli.render import draw_figure, show_view, show_with_figure
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
    refuse,
    refuse_options,
    refuse_same_file,
    results_option,
    settings_with,
)
from wearsim.errors import Interrupted, ResultsFileError, SolverError

if TYPE_CHECKING:
    from wearsim.scenario import Scenario
    from wearsim.studies.life.result import LifeResult

_FILES = {".h5", ".hdf5"}


def life(
    designs: Annotated[
        list[Path],
        typer.Argument(
            metavar="SCENARIO...",
            help="Scenario, or two to compare with common draws; or files of earlier studies, .h5.",
            show_default=False,
        ),
    ],
    realisations: Annotated[
        int,
        typer.Option("--realisations", "-n", min=1, metavar="N", help="Number of realisations."),
    ] = 400,
    limit: Annotated[
        list[str] | None,
        typer.Option(
            "--limit",
            metavar="NAME=VALUE",
            help="Limit that ends the life: depth=50um, roller_depth, lift_error, volume, width,"
            " peak_pressure or clearance. May be repeated; the first that is reached counts.",
            show_default=False,
        ),
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(
            metavar="LIFE",
            help="Life of which the probability is estimated: a number of passes, or turns of a"
            " cam, or a time such as '200 h'.",
            show_default=False,
        ),
    ] = None,
    b: Annotated[
        str,
        typer.Option("--b", metavar="P1,P2,...", help="Percentages failed of the lives shown."),
    ] = "1,10,50",
    most: Annotated[
        str | None,
        typer.Option(
            "--max",
            metavar="LIFE",
            help="Life at which tests are censored, as --target; default: ten times the longer of"
            " target and test.",
            show_default=False,
        ),
    ] = None,
    precision: Annotated[
        str | None,
        typer.Option(
            metavar="TARGET",
            help="Stop when the relative half-width of a 95 % confidence interval is reached:"
            " 'b10 3%'.",
            show_default=False,
        ),
    ] = None,
    rare: Annotated[
        int,
        typer.Option(
            min=0,
            metavar="N",
            help="Number of further tests for a small probability of a life before --target.",
            show_default=False,
        ),
    ] = 0,
    rare_method: Annotated[
        str,
        typer.Option(
            metavar="METHOD",
            help="Method of --rare: importance sampling, subset simulation, or auto, the second"
            " with at most as many tests again where the first fails.",
        ),
    ] = "auto",
    output: Annotated[Path | None, results_option("-life.h5")] = None,
    figure: FigureOption = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    sweep: Annotated[
        str | None,
        typer.Option(
            metavar="KEY=V1,V2,...",
            help="Life for each value of a key, with common draws: cam.base_radius=25mm,27mm.",
            show_default=False,
        ),
    ] = None,
    posterior: Annotated[
        Path | None,
        typer.Option(
            metavar="K.csv",
            help="K/H with what is not known of it, from `wearsim identify --posterior`, instead of"
            " the wear factor of the scenario; of a results file without new tests.",
            show_default=False,
        ),
    ] = None,
    returns: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv",
            help="Lives of units in service, which update the posterior of K/H: columns life (or"
            " low and high), state (failed, suspended), and optionally limit, design and unit.",
            show_default=False,
        ),
    ] = None,
    life_factor: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            metavar="FACTOR",
            help="Prior of the factor by which all lives of --returns differ from the computed"
            " ones: two of three within FACTOR, by default 1.5; 1 for none.",
            show_default=False,
        ),
    ] = None,
    demonstrate: Annotated[
        str | None,
        typer.Option(
            metavar="'R=0.9 C=0.95 at LIFE'",
            help="Specimens and duration of tests that show the survival R of a life with the"
            " confidence C. Further designs are the conditions of accelerated tests.",
            show_default=False,
        ),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option("--page", metavar="FILE.html", help="Also write a page.", show_default=False),
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option(
            "--table",
            metavar="FILE.csv",
            help="Also write the running units of --returns, or the tests of --demonstrate.",
            show_default=False,
        ),
    ] = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Compute the life of a design until a limit is reached, and compare two designs."""
    check_figure(figure, force, "--figure")
    use = LifeUse(returns, life_factor, demonstrate, page, table)
    use.check(force)
    with checking("--b"):
        shares = _shares(b)
    files = [path.suffix.lower() in _FILES for path in designs]
    refuse(len(designs) > 2 and not all(files), "give one design, or two to compare", "SCENARIO")
    refuse(
        len({path.resolve() for path in designs}) < len(designs),
        f"{designs[0]} is given twice",
        "SCENARIO",
    )
    if any(files):
        refuse(
            not all(files),
            "compare two scenarios or two results files, not one of each",
            "SCENARIO",
        )
        refuse_options(
            {
                "--limit": limit,
                "--max": most,
                "--precision": precision,
                "--sweep": sweep,
                "--set": settings,
                "--seed": seed,
                "--output": output,
            },
            "has no meaning for results files",
        )
        show_lives(*_reopened(designs, target, shares, posterior), use, json, figure)
        return
    from wearsim.cli.progress import BATCHES, EnsembleWatcher, watching
    from wearsim.results.io.outputs import check_output
    from wearsim.studies.life.settings import checked_study

    labels, scenarios, key = _variants(designs, sweep, settings_with(settings, seed=seed))
    if posterior is not None:
        from wearsim.studies.life.factor import with_posterior

        with checking("--posterior"):
            scenarios = [with_posterior(scenario, posterior) for scenario in scenarios]
    arguments: dict[str, Any] = {
        "target": target,
        "b": shares,
        "most": most,
        "precision": precision,
        "rare": rare,
        "rare_method": rare_method,
    }
    checked = [
        checked_study(scenario, realisations, limits=limit or [], **arguments)
        for scenario in scenarios
    ]
    scenarios = [scenario for scenario, _, _ in checked]
    use.check_studies(labels, [(scenario, settings) for scenario, settings, _ in checked])
    paths = _paths(scenarios, labels, output)
    scheduler = checked_scheduler(scheduler, workers)
    going_on = partial(_going_on, labels, scenarios, paths, key)
    for scenario, path in zip(scenarios, paths, strict=True):
        refuse_same_file(figure, path, scenario.paths)
        with going_on(path):
            check_output(path, force, scenario.paths)
    results = []
    for label, scenario, path in zip(labels, scenarios, paths, strict=True):
        if len(scenarios) > 1 and not quiet:
            note(f"{label}: {path}")
        with going_on(path), watching(EnsembleWatcher, scenario, quiet, BATCHES) as watch:
            results.append(
                wearsim.life(
                    scenario,
                    realisations,
                    path,
                    variable=key,
                    workers=workers,
                    scheduler=scheduler,
                    force=force,
                    **arguments,
                    **watch.callbacks,
                )
            )
    show_lives(results, labels, use, json, figure)


def _variants(
    designs: Sequence[Path], sweep: str | None, texts: list[str]
) -> tuple[list[str], list[Scenario], str]:
    """Return labels and scenarios of the designs, all with one seed, and the key of a sweep."""
    refuse(sweep is not None and len(designs) > 1, "goes with one scenario", "--sweep")
    key, values = swept(sweep, texts)
    if key:
        scenarios = [read_scenario(designs[0], [*texts, f"{key}={value}"]) for value in values]
        return list(values), scenarios, key
    scenarios = [read_scenario(path, texts) for path in designs]
    if len({scenario.seed for scenario in scenarios}) > 1:
        note(f"note: {designs[1]} is drawn with the seed of {designs[0]}, for common draws")
        scenarios[1] = scenarios[1].changed({"seed": scenarios[0].seed})
    return _labels(designs), scenarios, ""


def _paths(scenarios: Sequence[Scenario], labels: Sequence[str], output: Path | None) -> list[Path]:
    """Return the results files of the designs."""
    from wearsim.studies.ensemble.sweep import path_of
    from wearsim.studies.life.settings import results_file

    paths = [results_file(scenario) for scenario in scenarios]
    if len(scenarios) == 1:
        return [output or paths[0]]
    return (
        paths
        if output is None and len(set(paths)) == len(paths)
        else [path_of(output or paths[0], label) for label in labels]
    )


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


def _reopened(
    designs: Sequence[Path], target: str | None, shares: tuple[float, ...], posterior: Path | None
) -> tuple[list[LifeResult], list[str]]:
    """Return the results in files, and their labels: of a sweep the values of its key."""
    from wearsim.studies.life.comparison import swept_variable

    results = [_opened(path, target, shares, posterior) for path in designs]
    values = [result.variable.text for result in results if result.variable]
    return results, _labels(designs) if swept_variable(results) is None else values


def _opened(
    path: Path, target: str | None, shares: tuple[float, ...], posterior: Path | None
) -> LifeResult:
    """Return the result in a file, for another target, other percentages and another K/H."""
    from wearsim.results.kinds import kind_of
    from wearsim.studies.life.settings import parse_life

    if kind_of(path).name != "life":
        raise ResultsFileError(f"{path}: holds no study of lives; wearsim life SCENARIO makes one")
    result: LifeResult = wearsim.open_results(path)
    changed: dict[str, Any] = {"shares": list(shares)}
    if target is not None:
        with checking("--target"):
            life = parse_life(target, result.unit, result.settings.rate, "target")
        refuse(
            life > result.most,
            f"{life:,.0f} {result.unit} is beyond the maximum of {path},"
            f" {result.most:,.0f} {result.unit}",
            "--target",
        )
        changed["target"] = life * result.settings.per_unit
    if posterior is not None:
        with checking("--posterior"):
            result = result.with_posterior(posterior)
    return result.with_settings(**changed)


def show_lives(
    results: Sequence[LifeResult],
    labels: Sequence[str],
    use: LifeUse,
    json: bool,
    figure: Path | None,
) -> None:
    """Write the lives of designs to stdout, and compare each with the first.

    Parameters
    ----------
    results : sequence of LifeResult
    labels : sequence of str
    use : LifeUse
        Returns or a demonstration test, which are shown instead.
    json : bool
        Whether to write JSON instead of tables.
    figure : Path, optional
        Name of the figure.

    Raises
    ------
    ResultsFileError, SolverError
        If the units of lives differ, or all realisations of a design failed.
    """
    from wearsim.studies.opening import comparison_of

    views = [result.view for result in results]
    for result, view in zip(results, views, strict=True):
        if result.failed and not result.count:
            note(f"warning: {view.failures}")
            raise SolverError(f"{result.path}: all realisations failed")
    if use.is_special:
        view = use.view_of(results, labels)
        files = use.write([view])
        show_with_figure(view, figure, json=json, files=files, more=files)
        return
    if len(results) > 1:
        views.append(comparison_of(results, labels))
    draw_figure(views[-1].panels, figure)
    # the comparison is the first part of a page
    files = use.write([views[-1], *views[:-1]])
    more = {"figure": figure, **({"page": use.page} if use.page else {})}
    paths = [*(result.path for result in results), None]
    for view, path in list(zip(views, paths, strict=False))[-1 if json else 0 :]:
        show_view(view, json=json, files={"results file": path}, more=more)
    for name, file in {"figure": figure, **files}.items():
        if file is not None and not json:
            note(f"{name}: {file}")


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
        missing = [
            [
                *("wearsim", "life", scenario.file),
                *(["--set", f"{key}={label}"] if key else []),
                *("--seed", str(scenario.seed), "-o", str(file)),
            ]
            for label, scenario, file in zip(labels, scenarios, paths, strict=True)
            if not file.exists()
        ]
        steps = [
            *(f"`{shlex.join(words)}` with the other options" for words in missing),
            f"`{shlex.join(['wearsim', 'life', *map(str, paths)])}`",
        ]
        raise type(error)(
            f"{error.at_shell}; the comparison is finished by {', then '.join(steps)}"
        ) from error
