"""Life of a design: start and resume."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import cast

import numpy as np

from wearsim.errors import Mistake, ResultsFileError, ScenarioError
from wearsim.evolution.limits import OF_LIFE, Limit
from wearsim.quantities import quantity
from wearsim.results import (
    DISK,
    EnsembleData,
    EnsembleFile,
    Storage,
    check_output,
    open_ensemble,
    read_ensemble,
)
from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.life_settings import LifeSettings, LifeTarget
from wearsim.scenario import Scenario, as_scenario, parse_scenario
from wearsim.studies.ensemble.api import PRELOAD, Watcher, checked_request, ensemble_content
from wearsim.studies.ensemble.driver import EnsembleWork
from wearsim.studies.ensemble.realisation import shared_grid
from wearsim.studies.execution.factory import executor
from wearsim.studies.life.factor import exact_factor
from wearsim.studies.life.realisation import LifeRunner, first_length, with_length
from wearsim.studies.preparation import changed_origins, check_plugins
from wearsim.studies.progress import shown_progress
from wearsim.types import FloatArray, Grid
from wearsim.units import QuantityError

SHARES = (1.0, 10.0, 50.0)
LONGEST = 10.0  # default censoring over the target or the length of the test


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
        Results file; by default the name of the scenario with ``-life.h5``.
    limits : sequence of str
        Limits in addition to those of the scenario, or instead of equal ones: "depth 50 um",
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
        As in `ensemble`; `resume_life` continues from the file.

    Examples
    --------
    >>> factor = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.5}
    >>> scenario = wearsim.load_scenario("rig.toml", {"wear.cylinder.k_over_h": factor})
    >>> lives = wearsim.life(scenario, 1, "life.h5", limits=["depth 50 um"], scheduler="serial")
    >>> print(f"B10 {lives.b(10).value:.3g} {lives.unit}")
    B10 8.53e+05 passes
    """
    scenario = with_limits(as_scenario(scenario), limits)
    aim = None if precision is None else LifeTarget.parse(precision)
    settings = settings_of(scenario, realisations, target, b, most)
    path = Path(f"{scenario.name}-life.h5") if output is None else Path(output)
    check_output(path, force, scenario.paths)
    runner, content = _prepared(scenario, settings, aim)
    with (
        shown_progress(progress, "EnsembleWatcher", on_progress, scenario) as watch,
        executor(
            scheduler,
            workers,
            on_notice=on_notice or getattr(watch, "notice", None),
            stop_requested=stop_requested,
            preload=PRELOAD,
            realisations=settings.plain,
        ) as pool,
        EnsembleFile.create(path, *content, storage) as file,
    ):
        runner.compile_kernels()
        work = EnsembleWork(file, runner, aim, pool, watch, stop_requested)
        work.finish()
    return cast("LifeResult", open_ensemble(path))


def resume_life(
    file: str | Path,
    *,
    failed: bool = False,
    realisations: int | None = None,
    workers: int | None = None,
    scheduler: str = "processes",
    progress: bool = False,
    on_progress: Watcher | None = None,
    stop_requested: Callable[[], bool] | None = None,
    on_notice: Callable[[str], None] | None = None,
    storage: Storage = DISK,
) -> LifeResult:
    """Continue a study of lives from its file; the result is that of an unbroken one.

    Parameters
    ----------
    file : path
        Results file of `life`.
    failed, realisations, workers, scheduler, progress, on_progress, stop_requested, on_notice
        As in `resume_ensemble`.
    storage : Storage
        File operations.

    Returns
    -------
    LifeResult

    Raises
    ------
    ResultsFileError
        If the file cannot be continued.
    WorkerError, Interrupted
        As in `life`.

    Examples
    --------
    >>> wearsim.resume_life("life.h5", scheduler="serial").finished
    True
    """
    data, path = read_ensemble(file), Path(file)
    if not data.life:
        raise ResultsFileError(f"{path}: holds no study of lives; resume_ensemble continues it")
    check_plugins(path, data)
    if data.finished and realisations is None and not (failed and len(data.failed)):
        return cast("LifeResult", open_ensemble(path))
    scenario = parse_scenario(data.scenario_text, data.scenario_file, data.files.__getitem__)
    settings = LifeResult(data, path).settings
    total = settings.plain if realisations is None else realisations
    if total < settings.plain or (data.finished and not failed and total == settings.plain):
        raise ResultsFileError(
            f"{path}: has {settings.plain} realisations",
            python="give a larger number of realisations to extend it",
            shell="give a larger number with -n to extend it",
        )
    settings = replace(settings, plain=total)
    grid = Grid(data.variables["y"], data.strip_width)
    runner = LifeRunner(scenario, total, grid, settings, data.life["base"])
    aim = LifeTarget.parse(data.until) if data.until else None
    with (
        shown_progress(progress, "EnsembleWatcher", on_progress, scenario) as watch,
        executor(
            scheduler,
            workers,
            on_notice=on_notice or getattr(watch, "notice", None),
            stop_requested=stop_requested,
            preload=PRELOAD,
            realisations=total,
        ) as pool,
        EnsembleFile.open(path, storage) as opened,
    ):
        runner.compile_kernels()
        if total > data.requested:
            opened.put_state(life={**data.life, "plain": total})
            opened.grow(total)
        work = EnsembleWork(opened, runner, aim, pool, watch, stop_requested)
        work.warn(changed_origins(data, scenario))
        if failed:
            work.run_failed_again()
        else:
            work.finish()
    return cast("LifeResult", open_ensemble(path))


def with_limits(scenario: Scenario, limits: Sequence[str]) -> Scenario:
    """Return a scenario with limits added to its table [limit].

    Raises
    ------
    ValueError
        If one is not a limit of a life, or given twice.
    ScenarioError
        If there is none, or one is of no meaning for the scenario.
    """
    found: dict[str, str] = {}
    for text in limits:
        limit = Limit.parse(text)
        if limit.quantity not in OF_LIFE:
            raise ValueError(
                f"'{text}' does not end a life, expected a limit of {', '.join(OF_LIFE)}; a time"
                " after which lives are censored is the maximum"
            )
        if f"limit.{limit.key}" in found:
            raise ValueError(f"'{text}': a limit of {limit.quantity} is given twice")
        found[f"limit.{limit.key}"] = limit.text.removeprefix(limit.quantity).strip()
    changed = scenario.changed(found) if found else scenario
    if not changed.limit.given:
        what, expected = "is needed for a life", 'one limit or more, such as depth = "50 um"'
        raise ScenarioError(scenario.file, [Mistake("limit", "", what, "none", expected)])
    return changed


def settings_of(
    scenario: Scenario,
    realisations: int,
    target: float | str | None,
    shares: Sequence[float],
    most: float | str | None,
) -> LifeSettings:
    """Return the settings of a study, with lives in roller passes; parameters as in `life`.

    Raises
    ------
    ValueError
        If a life or a percentage is invalid.
    ScenarioError
        If nothing is random.
    """
    cam = scenario.cam is not None
    per_unit = float(scenario.operation.rollers) if cam else 1.0
    rate, unit = scenario.pass_rate / per_unit, "turns" if cam else "passes"
    aim = None if target is None else per_unit * parse_life(target, unit, rate, "target")
    for share in shares:
        if not 0.0 < share < 100.0:
            raise ValueError(f"B{share:g} is not a life, expected percentages between 0 and 100")
    if most is not None:
        longest = per_unit * parse_life(most, unit, rate, "max")
    else:
        own = float(scenario.total_passes) if scenario.has_length else 0.0
        longest = LONGEST * max(own, aim or 0.0)
        if longest == 0.0:
            raise ValueError(
                "a maximum is needed at which lives are censored, such as 1e7, since the scenario"
                " has no length"
            )
    span = scenario.load.build().span
    if span is not None:  # the log cannot be extended
        longest = min(longest, span[1] * scenario.pass_rate)
    if aim is not None and aim > longest:
        raise ValueError(
            f"the target of {aim / per_unit:g} {unit} is beyond the maximum of"
            f" {longest / per_unit:g} {unit}; give a greater maximum"
        )
    if not scenario.has_length:
        scenario = with_length(scenario, longest)
    request = checked_request(scenario, realisations, "monte-carlo", None)
    factor, reason = exact_factor(scenario)
    alone = factor is not None and len(scenario.random) == 1
    return LifeSettings(
        most=longest,
        unit=unit,
        per_unit=per_unit,
        rate=rate,
        target=aim,
        shares=tuple(map(float, shares)),
        factor=factor.item.name if factor else "",
        reason=reason,
        reference=factor.reference if factor else 0.0,
        spread=factor.spread if factor else 1.0,
        alone=alone,
        plain=1 if alone else request.realisations,
    )


def parse_life(value: float | str, unit: str, rate: float, what: str) -> float:
    """Return a life in its unit, from a number, "5e6 turns" or a time such as "200 h".

    Raises
    ------
    ValueError
        If it cannot be read, or is not above zero.
    """
    text = str(value).strip()
    try:
        found = float(text.removesuffix(unit))
    except ValueError:
        try:
            found = rate * quantity(text, "s")
        except QuantityError as error:
            raise ValueError(
                f"{what} '{text}' is not a life, expected a number of {unit} such as 675000, or a"
                " time such as '200 h'"
            ) from error
    if not 0.0 < found < np.inf:
        raise ValueError(f"{what} '{text}' must be above zero")
    return found


def _prepared(
    scenario: Scenario, settings: LifeSettings, aim: LifeTarget | None
) -> tuple[LifeRunner, tuple[EnsembleData, dict[str, FloatArray]]]:
    """Return the runner of a study, and the content of its file before the first realisation."""
    fixed = {settings.factor: settings.reference} if settings.factor else {}
    if not scenario.has_length:
        scenario = with_length(scenario, settings.most)
    base = first_length(scenario, fixed, settings.most)
    first = with_length(scenario, base)
    grid = shared_grid(first)
    request = checked_request(first, settings.plain, "monte-carlo", None)
    header, static = ensemble_content(first, request, grid)
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
