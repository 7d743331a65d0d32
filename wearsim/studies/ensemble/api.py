"""An ensemble of whole wear tests: run it, stop it anywhere, and go on from its file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from wearsim.errors import ResultsFileError, ScenarioError
from wearsim.results import EnsembleFile, EnsembleResult, check_output, open_ensemble, read_ensemble
from wearsim.results.ensemble.schema import OBSERVABLES
from wearsim.scenario import Scenario, parse_scenario, require_run
from wearsim.studies.ensemble.designs import EnsemblePlan, check_plan, parse_plan, whole_count
from wearsim.studies.ensemble.driver import EnsembleWork
from wearsim.studies.ensemble.grid import shared_grid
from wearsim.studies.ensemble.metadata import header_of, nothing_random, static_of
from wearsim.studies.ensemble.progress import EnsembleProgress
from wearsim.studies.ensemble.realisation import RealisationRunner
from wearsim.studies.execution.factory import executor
from wearsim.studies.limits import checked_count
from wearsim.studies.run.draws import Drawer
from wearsim.studies.run.provenance import changed_origins, missing_plugins
from wearsim.types import Grid
from wearsim.uq.estimation.stopping_rule import Target

Watcher = Callable[[EnsembleProgress], None]


def ensemble(
    scenario: Scenario,
    realisations: int,
    output: str | Path,
    *,
    plan: str | None = None,
    until: str | None = None,
    workers: int | None = None,
    scheduler: str = "processes",
    force: bool = False,
    on_progress: Watcher | None = None,
    stop_requested: Callable[[], bool] | None = None,
    on_notice: Callable[[str], None] | None = None,
) -> EnsembleResult:
    """Run a whole wear test for each of many realisations of a scenario's random inputs.

    Parameters
    ----------
    scenario : Scenario
    realisations : int
        How many, at most.
    output : path
        Results file, which grows as realisations finish.
    plan : str, optional
        "monte-carlo", "latin-hypercube", "sobol", "control-variate" or "saltelli"; by default the
        scenario's.
    until : str, optional
        What to reach before that, "depth.mean 1%": 95 % confidence of an estimate.
    workers : int, optional
        How many realisations run at a time; by default as many as there are processors.
    scheduler : str
        "processes", "threads", "serial", "dask", or the address of a Dask scheduler.
    force : bool
        Overwrite an existing file.
    on_progress : callable, optional
        Told how far it has come.
    stop_requested : callable, optional
        Asked after every batch; True ends the study there, and what is out then is run again by
        `resume_ensemble`.
    on_notice : callable, optional
        Told that a worker was lost, or that a cluster has none.

    Returns
    -------
    EnsembleResult

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError
        If the study cannot start. A realisation that fails is kept with its error.
    TypeError, ValueError
        If an argument is none of those above.
    WorkerError
        If workers break down again and again.
    Interrupted
        If it was stopped; `resume_ensemble` goes on from the file.
    """
    asked = checked(scenario, realisations, plan, until)
    path = Path(output)
    check_output(path, force, scenario.paths)
    with executor(scheduler, workers, tell=on_notice) as pool:
        grid = shared_grid(scenario)
        header = header_of(scenario, asked.plan, asked.realisations, asked.target, grid)
        with EnsembleFile.create(path, header, static_of(scenario, grid)) as file:
            members = RealisationRunner(scenario, asked.plan, asked.realisations, grid)
            EnsembleWork(file, members, asked.target, pool, on_progress, stop_requested).finish()
    return open_ensemble(path)


class Asked(NamedTuple):
    """What is asked of an ensemble, and can be had.

    Parameters
    ----------
    plan : str
    realisations : int
        At most.
    target : Target, optional
        What ends it before that.
    """

    plan: EnsemblePlan
    realisations: int
    target: Target | None


def checked(scenario: Scenario, realisations: int, plan: str | None, until: str | None) -> Asked:
    """Return what is asked of an ensemble, or refuse it; parameters and errors as of `ensemble`."""
    checked_count(scenario, realisations)
    require_run(scenario)
    chosen = parse_plan(plan or scenario.sampling.plan)
    target = None if until is None else parse_target(until)
    check_plan(scenario, chosen, until or "")
    drawer = Drawer(scenario, "monte-carlo")
    by_pass = any(item.persistence == "per-pass" for item in scenario.random)
    if not drawer.groups and not (by_pass and scenario.evolution.stepper == "per-pass"):
        raise ScenarioError(scenario.file, [nothing_random(scenario)])
    return Asked(chosen, whole_count(chosen, drawer.groups, realisations), target)


def parse_target(text: str) -> Target:
    """Return what is to be reached.

    Parameters
    ----------
    text : str
        As `Target.parse` reads it.

    Raises
    ------
    ValueError
        If it cannot be read, or nothing of the kind is observed.
    """
    target = Target.parse(text)
    if target.observable not in OBSERVABLES:
        raise ValueError(
            f"'{text}' asks for '{target.observable}', which is not followed, expected one of"
            f" {', '.join(OBSERVABLES)}"
        )
    return target


def resume_ensemble(
    file: str | Path,
    *,
    failed: bool = False,
    workers: int | None = None,
    scheduler: str = "processes",
    on_progress: Watcher | None = None,
    stop_requested: Callable[[], bool] | None = None,
    on_notice: Callable[[str], None] | None = None,
) -> EnsembleResult:
    """Go on with an ensemble from its file alone; it ends bit for bit as if unbroken.

    Parameters
    ----------
    file : path
        Results file of an ensemble that was stopped, or finished.
    failed : bool
        Run the realisations that failed once more, and no others.
    workers, scheduler, on_progress, stop_requested, on_notice
        As in `ensemble`.

    Returns
    -------
    EnsembleResult

    Raises
    ------
    ResultsFileError
        If the file cannot be read, needs a plugin that is not there, or is being written.
    WorkerError, Interrupted
        As in `ensemble`.
    """
    path = Path(file)
    data = read_ensemble(path)
    missing = missing_plugins(data.plugins)
    if missing:
        raise ResultsFileError(
            f"{path}: the ensemble needs {' and '.join(missing)}, which is not installed here;"
            " install it and resume again"
        )
    if data.finished and not (failed and len(data.failed)):
        return open_ensemble(path)
    scenario = parse_scenario(data.scenario_text, data.scenario_file, data.files.__getitem__)
    plan = parse_plan(data.plan)
    target = Target.parse(data.until) if data.until else None
    grid = Grid(data.variables["y"], data.strip_width)
    members = RealisationRunner(scenario, plan, data.asked, grid)
    with executor(scheduler, workers, tell=on_notice) as pool, EnsembleFile.open(path) as opened:
        work = EnsembleWork(opened, members, target, pool, on_progress, stop_requested)
        for text in changed_origins(data, scenario):
            work.warn(text)
        if failed:
            work.run_again()
        else:
            work.finish()
    return open_ensemble(path)
