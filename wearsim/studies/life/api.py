"""Life of a design, and of several designs of a sweep."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

import numpy as np

from wearsim.atomic_write import DISK, Storage
from wearsim.errors import Interrupted
from wearsim.results.io.files import as_path
from wearsim.results.io.outputs import check_output
from wearsim.scenario import Scenario, realise
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.ensemble.api import (
    Watcher,
    checked_request,
    ensemble_content,
    watched_executor,
)
from wearsim.studies.ensemble.driver import EnsembleWork
from wearsim.studies.ensemble.file.data import EnsembleData
from wearsim.studies.ensemble.file.writer import EnsembleFile
from wearsim.studies.ensemble.realisation import profile_axis
from wearsim.studies.ensemble.sweep import path_of, scenarios_of
from wearsim.studies.life.realisation import LifeRunner, first_length, with_length
from wearsim.studies.life.result import LifeResult
from wearsim.studies.life.settings import SHARES, checked_study, design_variable
from wearsim.studies.life.stored_settings import LifeSettings
from wearsim.studies.opening import open_ensemble
from wearsim.types import FloatArray
from wearsim.uq.estimation.estimates import Target


def life(
    scenario: Scenario | str | Path,
    realisations: int = 400,
    output: str | Path | None = None,
    *,
    limits: Sequence[str] = (),
    target: float | str | None = None,
    b: Sequence[float] = SHARES,
    most: float | str | None = None,
    precision: str | None = None,
    rare: int = 0,
    rare_method: str = "auto",
    variable: str = "",
    workers: int | None = None,
    scheduler: str = "processes",
    force: bool = False,
    progress: bool = False,
    on_progress: Watcher | None = None,
    stop_requested: Callable[[], bool] | None = None,
    on_notice: Callable[[str], None] | None = None,
    storage: Storage = DISK,
) -> LifeResult:
    """Return the life of a design: the passes, or turns of a cam, until a limit is first reached.

    Parameters
    ----------
    scenario : Scenario or path
        The scenario, or its file. Its table [limit] may hold limits.
    realisations : int
        Maximum number of realisations; one is sufficient where the wear factor alone is random.
    output : path, optional
        Results file; without it the result is kept in memory only.
    limits : sequence of str
        Limits in addition to the scenario's, or instead of equal ones: "depth 50 um",
        "lift_error=30um".
    target : float or str, optional
        Life of which the probability is estimated, a number of passes or turns, or "200 h".
    b : sequence of float
        Percentages of failed specimens whose lives are estimated.
    most : float or str, optional
        Life at which realisations are censored, as `target`; by default ten times the longer of
        the target and the test of the scenario.
    precision : str, optional
        Target that ends the study early, such as "b10 3%": the relative half-width of the 95 %
        confidence interval.
    rare : int
        Number of further tests, 200 or more, for a small probability of a life before the target.
        Where the wear factor is integrated exactly, they sample the other inputs.
    rare_method : {"auto", "importance", "subset"}
        Importance sampling, subset simulation, or the second where the first fails, each with at
        most `rare` tests.
    variable : str
        Dotted key of a design variable, whose value is stored for a comparison of designs.
    workers, scheduler, force, progress, on_progress, stop_requested, on_notice, storage
        As in `ensemble`.

    Returns
    -------
    LifeResult
        With ``.b(10)``, ``.survival(n)`` and ``.compare(other)``.

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError
        If the study cannot start.
    TypeError, ValueError
        If an argument is invalid.
    WorkerError, Interrupted
        As in `ensemble`; `resume_ensemble` continues from the file.

    Examples
    --------
    >>> factor = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.5}
    >>> scenario = wearsim.load_scenario("rig.toml", {"wear.cylinder.k_over_h": factor})
    >>> lives = wearsim.life(scenario, 1, "life.h5", limits=["depth 50 um"], scheduler="serial")
    >>> print(f"B10 {lives.b(10).value:.3g} {lives.unit}")
    B10 8.51e+05 passes
    """
    scenario, settings, aim = checked_study(
        with_chosen_model(scenario, test=True),
        realisations,
        limits=limits,
        target=target,
        b=b,
        most=most,
        precision=precision,
        rare=rare,
        rare_method=rare_method,
    )
    if variable and (value := design_variable(scenario, variable)):
        settings = replace(settings, variable=asdict(value))
    if output is not None:
        check_output(output, force, scenario.paths)
    with _results_path(output) as path:
        hands = workers, scheduler, progress, on_progress, stop_requested, on_notice
        with watched_executor(scenario, settings.plain, *hands) as (watch, pool):
            runner, content = _prepared(scenario, settings, aim)
            with EnsembleFile.create(path, *content, storage) as file:
                runner.compile_kernels()
                EnsembleWork(file, runner, aim, pool, watch, stop_requested).finish()
        return _opened(path, in_memory=output is None)


@contextmanager
def _results_path(output: str | Path | None) -> Iterator[Path]:
    """Give the results file of a study, one in a temporary folder without `output`."""
    if output is not None:
        yield as_path(output)
        return
    with TemporaryDirectory(prefix="wearsim-") as folder:
        try:
            yield Path(folder) / "life.h5"
        except Interrupted as error:
            raise Interrupted("stopped; nothing was written, since no output is given") from error


def _opened(path: Path, in_memory: bool) -> LifeResult:
    """Open the result of a study; read all of it if it is to be kept in memory only."""
    result = cast("LifeResult", open_ensemble(path))
    if not in_memory:
        return result
    variables = {name: result.raw.variables[name] for name in result.raw.schema.variables}
    return replace(result, raw=replace(result.raw, variables=variables), path=None)


def _prepared(
    scenario: Scenario, settings: LifeSettings, aim: Target | None
) -> tuple[LifeRunner, tuple[EnsembleData, dict[str, FloatArray]]]:
    """Return the runner of a study, and the content of its file before the first realisation."""
    fixed = {settings.factor: settings.reference} if settings.factor else {}
    if not scenario.has_length:
        scenario = with_length(scenario, settings.most)
    base = first_length(scenario, fixed, settings.most)
    first = with_length(scenario, base)
    # a single test has the groove of the wear factor with which it is run
    grid = profile_axis(realise(first, fixed) if settings.alone else first)
    header, static = ensemble_content(
        first, checked_request(first, settings.plain, "monte-carlo", None), grid
    )
    header = replace(
        header,
        scenario_text=scenario.text,
        sha256=scenario.sha256,
        total_passes=settings.most,
        total_time=settings.most / scenario.pass_rate,
        until="" if aim is None else str(aim),
        life={**asdict(settings), "base": base},
    )
    passes = np.array([0.0, settings.most])
    static |= {"record_passes": passes, "record_time": passes / scenario.pass_rate}
    return LifeRunner(scenario, settings.plain, grid, settings, base), (header, static)


def sweep_life(
    scenario: Scenario | str | Path,
    key: str,
    values: Sequence[object],
    output: str | Path,
    realisations: int = 400,
    *,
    on_value: Callable[[str, Path], None] | None = None,
    **options: Any,
) -> list[LifeResult]:
    """Return the lives of a design for each of several values of one key.

    The draws are common to all values, so that lives differ by the value only. Each result has the
    value as `variable`.

    Parameters
    ----------
    scenario : Scenario or path
        The scenario, or its file.
    key : str
        Dotted key, "cam.base_radius".
    values : sequence
        Values of the key, as in a scenario: "25 mm", 0.1.
    output : path
        ``FILE.h5``, for files ``FILE-VALUE.h5``.
    realisations : int
        Maximum number of realisations for each value.
    on_value : callable, optional
        Called with value and file before each study.
    **options
        Options of `life`, such as ``limits=["depth 50 um"]``.

    Returns
    -------
    list of LifeResult
        In the order of the values.

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError, TypeError, ValueError
        As `life`; mistakes in values and files are raised before the first study.

    Examples
    --------
    >>> factor = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.5}
    >>> rig = wearsim.load_scenario("rig.toml", {"wear.cylinder.k_over_h": factor})
    >>> options = {"limits": ["depth 50 um"], "scheduler": "serial"}
    >>> radii = ["400 mm", "500 mm"]
    >>> found = wearsim.sweep_life(rig, "roller.crown_radius", radii, "crown.h5", **options)
    >>> [f"{one.variable.text}: B10 {one.b(10).value:.3g}" for one in found]
    ['400 mm: B10 7.61e+05', '500 mm: B10 8.51e+05']
    """
    names, scenarios = scenarios_of(scenario, key, values)
    paths = [path_of(output, name) for name in names]
    if len(set(paths)) < len(paths):
        raise ValueError("two values have the same file; write them differently")
    for design, path in zip(scenarios, paths, strict=True):
        check_output(path, options.get("force", False), design.paths)
    results = []
    for design, name, path in zip(scenarios, names, paths, strict=True):
        if on_value is not None:
            on_value(name, path)
        results.append(life(design, realisations, path, variable=key, **options))
    return results
