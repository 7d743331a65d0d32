"""Ensembles of whole wear tests: start and stop; they and studies of lives are continued."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, NamedTuple

import numpy as np

from wearsim.arguments import ArgumentError, checking_argument
from wearsim.atomic_write import DISK, Storage
from wearsim.errors import CapabilityError, ResultsFileError, ScenarioError
from wearsim.results.io.files import as_path
from wearsim.results.io.outputs import check_output
from wearsim.scenario import Scenario, require_run
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.cam.observables import CURVE_ANGLES
from wearsim.studies.ensemble.designs import (
    BASE_PLANS,
    EnsemblePlan,
    check_plan,
    parse_plan,
    whole_count,
)
from wearsim.studies.ensemble.driver import EnsembleProgress, EnsembleWork
from wearsim.studies.ensemble.file.data import EnsembleData
from wearsim.studies.ensemble.file.schema import (
    observables_of,
)
from wearsim.studies.ensemble.file.writer import EnsembleFile
from wearsim.studies.ensemble.realisation import RealisationRunner, control_of, profile_axis
from wearsim.studies.ensemble.result import EnsembleResult
from wearsim.studies.execution.factory import executor
from wearsim.studies.opening import open_ensemble
from wearsim.studies.preparation import (
    changed_origins,
    check_plugins,
    checked_count,
    nothing_random,
    origin_of,
)
from wearsim.studies.progress import shown_progress
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import Drawer, draw, units_of
from wearsim.studies.schedule import RecordSchedule
from wearsim.types import FloatArray, Grid
from wearsim.uq.estimation.estimates import Target

PRELOAD = f"{RealisationRunner.__module__} numba scipy.special"  # all of them used by every worker

Watcher = Callable[[EnsembleProgress], None]


def ensemble(
    scenario: Scenario | str | Path,
    realisations: int,
    output: str | Path,
    *,
    plan: str | None = None,
    precision: str | None = None,
    until: str | None = None,
    workers: int | None = None,
    scheduler: str = "processes",
    force: bool = False,
    progress: bool = False,
    on_progress: Watcher | None = None,
    stop_requested: Callable[[], bool] | None = None,
    on_notice: Callable[[str], None] | None = None,
    storage: Storage = DISK,
) -> EnsembleResult:
    """Run a whole wear test for each realisation of a scenario's random inputs.

    Parameters
    ----------
    scenario : Scenario or path
        The scenario, or its file.
    realisations : int
        Maximum number of realisations.
    output : path
        Results file. Until the ensemble is finished, realisations are in a folder beside it,
        ``rig.h5.parts`` for ``rig.h5``.
    plan : str, optional
        "monte-carlo", "latin-hypercube", "sobol", "control-variate" or "saltelli"; by default the
        scenario's.
    precision : str, optional
        Target that ends the ensemble early, such as "depth.mean 1%": the relative half-width of the
        95 % confidence interval of an estimate.
    until : str, optional
        Former name of `precision`.
    workers : int, optional
        Number of realisations run at the same time; by default the number of processors.
    scheduler : str
        "processes", "threads", "serial", "dask", or the address of a Dask scheduler.
    force : bool
        Overwrite an existing file.
    progress : bool
        Whether to show the progress, on a terminal or in a notebook.
    on_progress : callable, optional
        Called with the progress after every batch.
    stop_requested : callable, optional
        Called after every batch, and while a cluster has no workers; True stops the ensemble.
        Unfinished realisations are run by `resume_ensemble`.
    on_notice : callable, optional
        Called with a message when a worker is lost, or a cluster has no workers.
    storage : Storage
        File operations, of the operating system except in tests.

    Returns
    -------
    EnsembleResult

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError
        If the study cannot start. A realisation that fails is stored with its error.
    TypeError, ValueError
        If an argument is invalid.
    WorkerError
        If workers fail repeatedly.
    Interrupted
        If it was stopped; `resume_ensemble` continues from the file.

    Examples
    --------
    >>> friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    >>> scenario = wearsim.load_scenario("rig.toml", {"friction.coefficient": friction})
    >>> tests = wearsim.ensemble(scenario, 8, "tests.h5", scheduler="serial")
    >>> tests.count
    8
    """
    scenario = with_chosen_model(scenario, test=True)
    request = checked_request(scenario, realisations, plan, named_precision(precision, until))
    path = as_path(output)
    check_output(path, force, scenario.paths)
    hands = workers, scheduler, progress, on_progress, stop_requested, on_notice
    with watched_executor(scenario, request.realisations, *hands) as (watch, pool):
        grid = profile_axis(scenario)
        content = ensemble_content(scenario, request, grid)
        with EnsembleFile.create(path, *content, storage) as file:
            runner = RealisationRunner(scenario, request.plan, request.realisations, grid)
            runner.compile_kernels()
            EnsembleWork(file, runner, request.target, pool, watch, stop_requested).finish()
    return open_ensemble(path)


class EnsembleRequest(NamedTuple):
    """A request for an ensemble that has been checked.

    Parameters
    ----------
    plan : str
    realisations : int
        Maximum number of realisations.
    target : Target, optional
        Target that ends the ensemble early.
    """

    plan: EnsemblePlan
    realisations: int
    target: Target | None


def checked_request(
    scenario: Scenario, realisations: int, plan: str | None, precision: str | None
) -> EnsembleRequest:
    """Check the arguments of an ensemble; parameters and errors as in `ensemble`."""
    checked_count(scenario, realisations)
    require_run(scenario)
    chosen = parse_plan(plan or scenario.sampling.plan)
    check_plan(scenario, chosen, "a target" if precision else "")
    drawer = Drawer(scenario, "monte-carlo")
    by_pass = any(item.is_redrawn for item in scenario.random)
    if not drawer.groups and not (by_pass and scenario.evolution.stepper == "per-pass"):
        what = "no random input differs between realisations"
        if scenario.random:
            what += ': inputs drawn at every pass are averaged unless stepper = "per-pass"'
        raise ScenarioError(scenario.file, [nothing_random(what)])
    return EnsembleRequest(
        chosen,
        whole_count(chosen, drawer.groups, realisations),
        None if precision is None else parse_target(precision, scenario),
    )


def named_precision(precision: str | None, until: str | None) -> str | None:
    """Return the precision of a study, from its present or its former name.

    Raises
    ------
    TypeError
        If both are given.
    """
    if until is None:
        return precision
    if precision is not None:
        raise TypeError("until is the former name of precision; give precision only")
    warnings.warn(
        "until of an ensemble is now precision; the old name will be removed",
        DeprecationWarning,
        stacklevel=3,
    )
    return until


def parse_target(text: str, scenario: Scenario | None = None) -> Target:
    """Return the target of a text.

    Parameters
    ----------
    text : str
        In the form of `Target.parse`.
    scenario : Scenario, optional
        Scenario of the tests, which may have observables of cams and of fatigue.

    Raises
    ------
    ArgumentError
        If it cannot be read, or names no observable of an ensemble.
    """
    with checking_argument("precision"):
        target = Target.parse(text)
    given = {} if scenario is None else {"cam": scenario.cam, "fatigue": scenario.fatigue}
    known = observables_of(**{name: bool(table) for name, table in given.items()})
    if target.observable not in known:
        expected = f"which is not an observable, expected one of {', '.join(known)}"
        raise ArgumentError("precision", f"'{text}' names '{target.observable}', {expected}")
    return target


def resume_ensemble(
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
) -> EnsembleResult:
    """Continue an ensemble or a study of lives from its file; the result equals an unbroken one.

    Parameters
    ----------
    file : path
        Results file of an ensemble or of lives that was stopped, or finished.
    failed : bool
        Run the failed realisations again, and no others.
    realisations : int, optional
        New maximum number of realisations, to extend the study.
    workers, scheduler, progress, on_progress, stop_requested, on_notice, storage
        As in `ensemble`.

    Returns
    -------
    EnsembleResult
        Of lives, of the class that `life` returns.

    Raises
    ------
    ResultsFileError
        If the file cannot be read, needs a plugin that is not installed, is being written, has as
        many realisations already, or has tests for rare events after them.
    ScenarioError
        If the size of the plan is fixed, so that it cannot be extended.
    WorkerError, Interrupted
        As in `ensemble`.

    Examples
    --------
    >>> wearsim.resume_ensemble("rig-ensemble.h5", realisations=20, scheduler="serial").count
    20
    >>> wearsim.resume_ensemble("rig-life.h5", realisations=20, scheduler="serial").count
    20
    """
    before, path = open_ensemble(file), Path(file)
    data = before.raw
    check_plugins(path, data)
    if realisations is not None:
        _check_growth(before, realisations, failed)
    runner: RealisationRunner = resolve_name(before.runner).continuing(before, realisations)
    repeated = failed and len(data.failed)
    if data.finished and realisations is None and not (repeated or runner.further(before)):
        return before
    target = Target.parse(data.until) if data.until else None
    hands = workers, scheduler, progress, on_progress, stop_requested, on_notice
    with (
        watched_executor(runner.scenario, runner.total, *hands) as (watch, pool),
        EnsembleFile.open(path, storage) as opened,
    ):
        runner.compile_kernels()
        if runner.total > data.requested:
            opened.grow(runner.total, **runner.state)
        work = EnsembleWork(opened, runner, target, pool, watch, stop_requested)
        work.warn(changed_origins(data, runner.scenario))
        (work.run_failed_again if failed else work.finish)()
    return open_ensemble(path)


def _check_growth(before: EnsembleResult, realisations: int, failed: bool) -> None:
    """Check that a study can be extended to a number of realisations; raises as its caller."""
    data, path = before.raw, before.path
    checked_count(before.scenario, realisations)
    check_plan(before.scenario, parse_plan(data.plan), "more realisations")
    if data.life.get("rare"):
        raise ResultsFileError(
            f"{path}: has tests for rare events after its realisations, and cannot be extended"
        )
    held, finished = data.requested, data.finished and not failed
    if realisations < held or (finished and realisations == held):
        raise ResultsFileError(
            f"{path}: has {held} realisations",
            python="give a larger number of realisations to extend it",
            shell="give a larger number with -n to extend it",
        )


@contextmanager
def watched_executor(
    scenario: Scenario,
    realisations: int,
    workers: int | None,
    scheduler: str,
    progress: bool,
    on_progress: Watcher | None,
    stop_requested: Callable[[], bool] | None,
    on_notice: Callable[[str], None] | None,
) -> Iterator[tuple[Any, Any]]:
    """Give the watcher of the progress and the executor of batches; parameters as of `ensemble`."""
    with (
        shown_progress(progress, "EnsembleWatcher", on_progress, scenario) as watch,
        executor(
            scheduler,
            workers,
            on_notice=on_notice or getattr(watch, "notice", None),
            stop_requested=stop_requested,
            preload=PRELOAD,
            realisations=realisations,
        ) as pool,
    ):
        yield watch, pool


def ensemble_content(
    scenario: Scenario, request: EnsembleRequest, grid: Grid
) -> tuple[EnsembleData, dict[str, FloatArray]]:
    """Return header and common arrays of an ensemble's file before its first realisation.

    Raises
    ------
    ScenarioError, CapabilityError
        If the scenario cannot run, or the plan has no control variate for it.
    """
    drawer = Drawer(scenario, BASE_PLANS[request.plan], request.realisations)
    units = units_of(scenario)
    drawn = [item for item in scenario.random if item.name in drawer.groups]
    averaged = tuple(item for item in scenario.random if item.name not in drawer.groups)
    # a scenario that cannot run is refused before anything is written
    _, _, stepper = assemble_problem(draw(replace(scenario, random=averaged)), grid)
    control = control_of(drawer) if request.plan == "control-variate" else {}
    if control is None:
        raise CapabilityError(
            f"{scenario.file}: the control variate is a depth in closed form, which needs a wear"
            " law linear in the dissipation; choose another plan, such as monte-carlo"
        )
    stop = float(scenario.total_passes)
    passes = RecordSchedule.of(scenario, stop).all_records(
        stop, scenario.evolution.stepper == "per-pass"
    )
    header = EnsembleData(
        **origin_of(scenario),
        finished=False,
        wall_seconds=0.0,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        notes=list(scenario.notes),
        stepper=stepper,
        tolerance=scenario.evolution.tolerance,
        width_threshold=scenario.outputs.width_threshold,
        total_passes=stop,
        total_time=scenario.total_time,
        strip_width=grid.spacing,
        plan=request.plan,
        requested=request.realisations,
        until="" if request.target is None else str(request.target),
        inputs=[
            {
                "key": key,
                "unit": units[key],
                "input": item.name,
                "rollers": "each" if item.persistence == "per-roller" else "",
            }
            for item in drawn
            for key in item.keys
        ],
        groups=[
            {
                "name": item.name,
                "role": item.role,
                "persistence": item.persistence,
                "text": item.describe(),
            }
            for item in drawn
        ],
        control=control,
        cam=scenario.cam is not None,
        fatigue=scenario.fatigue is not None,
    )
    static = {
        "angle": CURVE_ANGLES,
        "y": grid.y,
        "multiplicity": np.ones(scenario.operation.rollers),
        "record_passes": passes,
        "record_time": passes / scenario.pass_rate,
    }
    return header, {n: v for n, v in static.items() if n in header.schema.variables}
