"""Run of a wear test: start, stop and resume."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from wearsim.arguments import checking_argument
from wearsim.atomic_write import DISK, Storage, write_lock
from wearsim.errors import ResultsFileError, ScenarioError
from wearsim.evolution.limits import Limit
from wearsim.evolution.state import WearState
from wearsim.results.io.files import as_path
from wearsim.results.io.outputs import output_lock
from wearsim.results.kinds import kind_of
from wearsim.scenario import Scenario
from wearsim.scenario.parse.overrides import apply_overrides
from wearsim.scenario.tables.plugin import AUTO
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.preparation import check_plugins
from wearsim.studies.progress import shown_progress
from wearsim.studies.run.continuation import (
    EXTENSIONS,
    is_at_limit,
    last_value,
    limit_warnings,
    stored_scenario,
    with_end,
    without_limit_rows,
    written_value,
)
from wearsim.studies.run.in_progress import RunInProgress, Watcher
from wearsim.studies.run.result import Result, read_results


def run(
    scenario: Scenario | str | Path,
    output: str | Path | None = None,
    *,
    until: str | float | None = None,
    force: bool = False,
    progress: bool = False,
    on_event: Watcher | None = None,
    stop_requested: Callable[[], bool] | None = None,
    storage: Storage = DISK,
) -> Result:
    """Run a wear test from unworn bodies to its end, or to a limit.

    Parameters
    ----------
    scenario : Scenario or path
        The scenario, or its file.
    output : path, optional
        Results file; without it the result is kept in memory only.
    until : str or float, optional
        Limit at which the run stops: "depth 50 um", "roller depth 5 um", "lift error 30 um",
        "volume 12 mm^3", "width 14 mm", "peak pressure 900 MPa", "clearance 60 um", "damage 1",
        "pitting 0.1", "12 h", "2e6 passes" or "5e5 turns"; a number is a time [s]. A test that ends
        before its limit is extended.
    force : bool
        Overwrite an existing file.
    progress : bool
        Whether to show the progress, on a terminal or in a notebook.
    on_event : callable, optional
        Called with every event, see `wearsim.studies.run.recorder`.
    stop_requested : callable, optional
        Called after every step; True stops the run after a checkpoint.
    storage : Storage
        File operations, of the operating system except in tests.

    Returns
    -------
    Result

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError
        If the run cannot start.
    ValueError
        If `until` is not a limit.
    SolverError
        If it fails; the file then holds everything up to the last accepted step.
    Interrupted
        If it was stopped; `resume` continues from the file.

    Examples
    --------
    >>> result = wearsim.run("rig.toml")
    >>> print(f"{result.depth[-1] * 1e6:.1f} um")
    48.1 um
    >>> kept = wearsim.run("rig.toml", "rig.h5")  # writes the file as well
    """
    if not isinstance(scenario, Scenario) or scenario.contact.model == AUTO:
        scenario = with_chosen_model(scenario, test=True)
    path = as_path(output) if output is not None else None
    limit, warnings = None, []
    if until is not None:
        with checking_argument("until"):
            limit = Limit.parse(until, scenario.operation.rollers)
        scenario, limit = with_end(scenario, limit)
        warnings = limit_warnings(scenario, limit) if limit else []
    with (
        output_lock(path, force, scenario.paths) if path is not None else nullcontext(),
        shown_progress(progress, "RunWatcher", on_event, scenario)
        if progress
        else nullcontext(on_event) as watch,
    ):
        started = RunInProgress(scenario, path, storage, watch, stop_requested, limit=limit)
        for text in warnings:
            started.warn(text)
        result = _run_to_limit(started)
    if scenario.text == result.raw.scenario_text and not scenario.drawn:
        vars(result)["scenario"] = scenario  # its cached property, which would parse it again
    return result


def resume(
    file: str | Path,
    until: str | float | None = None,
    *,
    allow_deep: bool = False,
    progress: bool = False,
    on_event: Watcher | None = None,
    stop_requested: Callable[[], bool] | None = None,
    storage: Storage = DISK,
) -> Result:
    """Continue a run from its file; the result equals an unbroken one bit for bit.

    Parameters
    ----------
    file : path
        Results file of a run that was stopped, or finished.
    until : str or float, optional
        Limit at which the run stops, as in `run`. By default an interrupted run continues to its
        limit, and a run that has reached its limit to the end of the scenario.
    allow_deep : bool
        Set evolution.allow_deep = true, to continue a run that ended at a depth beyond the validity
        of the contact models.
    progress, on_event, stop_requested, storage
        As in `run`.

    Returns
    -------
    Result

    Raises
    ------
    ResultsFileError
        If the file cannot be read, is being written by another process, needs a plugin that is not
        installed, or holds a test that is already past `until`.
    ValueError
        If `until` is not a limit.
    SolverError, Interrupted
        As in `run`.

    Examples
    --------
    >>> result = wearsim.run("rig.toml", "rig.h5")
    >>> longer = wearsim.resume("rig.h5", until="500 min")
    >>> print(f"{longer.time[-1] / 60:.0f} min")
    500 min
    """
    kind, path = kind_of(file), Path(file)
    if kind.resume and kind.name != "run":
        raise ResultsFileError(
            f"{path}: holds an ensemble of wear tests, which resume_ensemble continues; expected"
            " a single wear test"
        )
    before, data = path.stat(), read_results(path)
    if allow_deep:
        text = apply_overrides(data.scenario_text, str(path), {"evolution.allow_deep": True})
        data = replace(data, scenario_text=text)
    check_plugins(path, data)
    stored = stored_scenario(data)
    end, limit = until, None
    if until is None and data.until and not data.finished:
        end = data.until
    if end is not None:
        with checking_argument("until"):
            limit = Limit.parse(end, stored.operation.rollers)
    reached = is_at_limit(path, data, limit)
    if limit is not None and not reached and until is not None:
        limit_warnings(stored, limit)
    state = WearState.from_arrays(data.checkpoint)
    scenario, limit = with_end(stored, limit)
    at_end = not data.until and scenario.total_passes == float(state.passes[0])
    if data.finished and (reached or (at_end and limit is None)):
        return Result(data, path)
    data = without_limit_rows(data, state)
    with (
        write_lock(path, before),
        shown_progress(progress, "RunWatcher", on_event, scenario) as watch,
    ):
        return _run_to_limit(
            RunInProgress(scenario, path, storage, watch, stop_requested, data, state, limit)
        )


def _run_to_limit(run: RunInProgress) -> Result:
    """Finish a run; extend the test as long as it ends before its limit.

    Each extension doubles the test. A run without wear, with a log that ends, or after `EXTENSIONS`
    ends before its limit, with a warning.
    """
    result, extensions = run.finish(), 0
    while run.limit is not None and not run.reached:
        data, state, reason = run.data(finished=True), run.recorder.state, ""
        last = last_value(data, run.limit)
        # a groove has a width from a certain depth on
        worn = np.max(data.history["depth"][-1]) if run.limit.quantity == "width" else last
        if worn <= 0.0:
            reason = "nothing is worn"
        elif extensions == EXTENSIONS:
            reason = f"the test has been extended {2**EXTENSIONS}-fold"
        else:
            try:
                scenario = stored_scenario(data, 2.0 * data.total_passes)
                options = run.path, run.storage, run.on_event, run.stop_requested
                longer = RunInProgress(scenario, *options, data, state, run.limit)
            except ScenarioError as error:
                reason = "it cannot be extended: " + "; ".join(map(str, error.mistakes))
        if reason:
            return run.end_before_limit(
                f"{written_value(run.limit, last)} at the end of the test; {reason}"
            )
        run, extensions = longer, extensions + 1
        result = run.finish()
    return result
