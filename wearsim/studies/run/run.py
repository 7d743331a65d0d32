"""A wear test from start to end: run it, stop it anywhere, and go on from its file."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from wearsim.errors import Interrupted, ResultsFileError, SolverError
from wearsim.evolution.error_control.error_estimates import greatest_depth, total_worn_volume
from wearsim.evolution.integrate import evolve
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import SIGMAS, WearState, fresh_state, widened, widened_state
from wearsim.evolution.steppers.base import Advance, Stepper
from wearsim.results import Result, RunData, check_output, kind_of, read_results, write_results
from wearsim.results.run.schema import VARIABLES
from wearsim.scenario import Scenario, parse_scenario
from wearsim.studies.run.assemble import assemble_problem, start_height, strips_of_run
from wearsim.studies.run.draws import draw, drawn_values
from wearsim.studies.run.events import Checkpointed, Event, Finished, Started, Stepped, Warned
from wearsim.studies.run.output_schedule import RecordSchedule
from wearsim.studies.run.provenance import changed_origins, missing_plugins, origin_of
from wearsim.studies.run.recorder import Recorder
from wearsim.types import Grid

Watcher = Callable[[Event], None]


def run(
    scenario: Scenario,
    output: str | Path | None = None,
    *,
    force: bool = False,
    on_event: Watcher | None = None,
    stop_requested: Callable[[], bool] | None = None,
) -> Result:
    """Run a wear test from fresh bodies to its end.

    Parameters
    ----------
    scenario : Scenario
    output : path, optional
        Results file; without it the result is kept in memory only.
    force : bool
        Overwrite an existing file.
    on_event : callable, optional
        Told what happens, see `wearsim.studies.run.events`.
    stop_requested : callable, optional
        Asked after every step; True ends the run after a checkpoint.

    Returns
    -------
    Result

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError
        If the run cannot start.
    SolverError
        If it fails; the file then holds everything up to the last good step.
    Interrupted
        If it was stopped; `resume` goes on from the file.
    """
    path = Path(output) if output is not None else None
    if path is not None:
        check_output(path, force, scenario.paths)
    problem, stepper, name = assemble_problem(scenario)
    replay = _RunInProgress(scenario, problem, stepper, name, path, on_event, stop_requested)
    replay.begin(fresh_state(problem), float(scenario.total_passes))
    return replay.finish()


def resume(
    file: str | Path,
    until: float | None = None,
    *,
    on_event: Watcher | None = None,
    stop_requested: Callable[[], bool] | None = None,
) -> Result:
    """Go on with a run from its file alone; the end is the same, bit for bit, as if unbroken.

    Parameters
    ----------
    file : path
        Results file of a run that was stopped, or finished.
    until : float, optional
        New simulated end of the test [s], to extend it.
    on_event, stop_requested
        As in `run`.

    Returns
    -------
    Result

    Raises
    ------
    ResultsFileError
        If the file cannot be read, needs a plugin that is not there, or holds a test that is
        already past `until`.
    SolverError, Interrupted
        As in `run`.
    """
    path = Path(file)
    if kind_of(path) == "ensemble":
        raise ResultsFileError(
            f"{path}: holds an ensemble of wear tests, with which resume_ensemble goes on; what is"
            " needed is a wear test"
        )
    data = read_results(path)
    missing = missing_plugins(data.plugins)
    if missing:
        raise ResultsFileError(
            f"{path}: the run needs {' and '.join(missing)}, which is not installed here; install"
            " it and resume again"
        )
    overrides = {"operation.duration": f"{until!r} s"} if until is not None else None
    scenario = parse_scenario(
        data.scenario_text, data.scenario_file, data.files.__getitem__, overrides
    )
    state = WearState.from_arrays(
        {name: array for name, array in data.checkpoint.items() if name not in _EXTRA}
    )
    if scenario.total_passes < state.passes:
        raise ResultsFileError(
            f"{path}: the test stands at {state.passes / scenario.pass_rate / 60.0:.6g} min"
            f" already, which is past {(until or 0.0) / 60.0:.6g} min; give a later --until"
        )
    if data.finished and scenario.total_passes == state.passes:
        return Result(data, path)
    data, state = _widened(scenario, data, state)
    grid = Grid(data.static["y"], float(data.checkpoint["spacing"]))
    problem, stepper, name = assemble_problem(scenario, grid)
    replay = _RunInProgress(scenario, problem, stepper, name, path, on_event, stop_requested)
    replay.go_on(data, state)
    return replay.finish()


def _widened(scenario: Scenario, data: RunData, state: WearState) -> tuple[RunData, WearState]:
    """Return data and state on as many more strips as an extended test needs, if any.

    The strips that are there stay as they are, so that nothing is interpolated.
    """
    y, spacing = data.static["y"], float(data.checkpoint["spacing"])
    needed = strips_of_run(draw(scenario))
    lacking = 0.5 * (needed.spacing * needed.strips - spacing * len(y))
    # a little more costs less than a contact that runs off its strips
    strips = int(np.ceil(lacking / spacing)) if lacking > 1e-6 * spacing else 0
    if strips == 0 or scenario.total_passes == data.total_passes:
        return data, state
    margin = spacing * np.arange(1, strips + 1)
    wider = np.concatenate([y[0] - margin[::-1], y, y[-1] + margin])
    records = {
        name: widened(array, strips) if VARIABLES[name].dims[-1] == "y" else array
        for name, array in data.records.items()
    }
    data = replace(data, static={**data.static, "y": wider}, records=records)
    return data, widened_state(state, wider, strips)


#: what a checkpoint holds besides the state
_EXTRA = ("record_base", "spacing")


class _RunInProgress:
    """One run in this process: it owns the recorder, the clock and the file."""

    def __init__(
        self,
        scenario: Scenario,
        problem: WearProblem,
        stepper: Stepper,
        stepper_name: str,
        path: Path | None,
        on_event: Watcher | None,
        stop_requested: Callable[[], bool] | None,
    ) -> None:
        self.scenario, self.problem = scenario, problem
        self.stepper, self.stepper_name = stepper, stepper_name
        self.path = path
        self.tell: Watcher = on_event or (lambda event: None)
        self.stop_requested = stop_requested or (lambda: False)
        self.stop = float(scenario.total_passes)
        self.origin = origin_of(scenario)
        self.drawn = drawn_values(scenario, draw(scenario))
        self.warnings: list[str] = []
        self.created = datetime.now(UTC).isoformat(timespec="seconds")
        self.wall_before, self.started = 0.0, time.monotonic()

    def begin(self, state: WearState, record_base: float) -> None:
        """Start from fresh bodies."""
        self.record_base = record_base
        self.recorder = self._recorder(state)
        self._write()

    def go_on(self, data: RunData, state: WearState) -> None:
        """Start from what a file holds."""
        self.record_base = float(data.checkpoint["record_base"])
        self.recorder = self._recorder(state, data)
        self.warnings, self.created = list(data.warnings), data.created
        self.wall_before = data.wall_seconds
        for text in changed_origins(data, self.scenario):
            self._warn(text)

    def _recorder(self, state: WearState, data: RunData | None = None) -> Recorder:
        schedule = RecordSchedule.of(self.scenario, self.record_base)
        threshold = self.scenario.outputs.width_threshold
        if data is None:
            return Recorder(self.problem, self.stepper, schedule, threshold, state)
        return Recorder(
            self.problem, self.stepper, schedule, threshold, state, data.history, data.records
        )

    def finish(self) -> Result:
        """Step to the end of the test and return the result."""
        state = self.recorder.state
        self.tell(
            Started(
                self.stop,
                self.problem.time(self.stop),
                state.passes,
                self.stepper_name,
                self.scenario.contact.model,
            )
        )
        try:
            self._step_through()
            self._judge()
            self._write(finished=True)
        except KeyboardInterrupt:
            self._interrupted()
        except SolverError:
            # nothing is lost: the file keeps the last good step, and the user sees how it got there
            self.recorder.drop_unfinished()
            self._write()
            raise
        self.tell(Finished(self._wall()))
        return Result(self._data(finished=True), self.path)

    def _judge(self) -> None:
        """Warn where the estimated error has outgrown the tolerance in spite of all."""
        state, tolerance = self.recorder.state, self.scenario.evolution.tolerance
        sizes = greatest_depth(state), total_worn_volume(self.problem, state)
        errors = state.depth_error, state.volume_error
        for kind, name in enumerate(("depth", "worn volume")):
            parts = [errors[kind], state.quadrature[kind], SIGMAS * np.sqrt(state.scatter[kind])]
            whole = np.where(sizes[kind] > 0.0, sizes[kind], np.inf)
            relative, quadrature, scatter = (float((part / whole).max()) for part in parts)
            if relative <= tolerance:
                continue
            remedy = "lower evolution.tolerance or evolution.step"
            if max(quadrature, scatter) > 0.5 * relative:
                remedy = "raise evolution.nodes"
                if scatter > quadrature:
                    part = scatter / relative
                    remedy = f"{part:.0%} of it is what draws at so few passes leave to chance"
            self._warn(
                f"estimated error of {name}: {100.0 * relative:.2g} % is more than the tolerance"
                f" of {100.0 * tolerance:.2g} %; {remedy}"
            )

    def _step_through(self) -> None:
        every = self.scenario.outputs.checkpoint_every
        written = time.monotonic()
        for advance in evolve(
            self.problem,
            self.recorder.state,
            self.stepper,
            self.stop,
            self.recorder.schedule.next_record,
            self.scenario.evolution.max_steps,
        ):
            self.recorder.add(advance, self.stop)
            self._report(advance)
            if self.stop_requested() and self.recorder.state.passes < self.stop:
                self._interrupted()
            # a slow disk must not hold up the run: at most a fiftieth of the time goes into files
            if time.monotonic() - written > max(every, 50.0 * self._last_write):
                self._write()
                written = time.monotonic()

    def _report(self, advance: Advance) -> None:
        state = advance.end
        if advance.warning is not None:
            self._warn(advance.warning)
        self.tell(
            Stepped(
                passes=state.passes,
                total_passes=self.stop,
                time=self.problem.time(state.passes),
                depth=float(state.cylinder_depth.max()),
                step_passes=state.passes - advance.path[0].passes,
                depth_error=float(state.depth_error.max()),
                wall_seconds=self._wall(),
            )
        )

    def _warn(self, message: str) -> None:
        """Tell a warning; only the first of a kind is kept, or a long run would keep thousands."""
        kind = message.split(":", maxsplit=1)[0]
        if not any(known.split(":")[0] == kind for known in self.warnings):
            self.warnings.append(message)
            self.tell(Warned(message))

    def _interrupted(self) -> None:
        self.recorder.drop_unfinished()
        self._write()
        passes = self.recorder.state.passes
        kept = f"go on with: wearsim resume {self.path}" if self.path else "nothing was written"
        raise Interrupted(f"stopped at pass {passes:.0f} of {self.stop:.0f}; {kept}") from None

    def _wall(self) -> float:
        return self.wall_before + time.monotonic() - self.started

    _last_write = 0.0

    def _write(self, finished: bool = False) -> None:
        if self.path is None:
            return
        begun = time.monotonic()
        write_results(self.path, self._data(finished))
        self._last_write = time.monotonic() - begun
        self.tell(Checkpointed(str(self.path), self.recorder.state.passes))

    def _data(self, finished: bool) -> RunData:
        scenario, problem = self.scenario, self.problem
        kinematics = problem.kinematics
        checkpoint = self.recorder.state.to_arrays()
        checkpoint["record_base"] = np.asarray(self.record_base)
        checkpoint["spacing"] = np.asarray(problem.grid.spacing)
        return RunData(
            **self.origin,
            drawn=self.drawn,
            stepper=self.stepper_name,
            tolerance=scenario.evolution.tolerance,
            width_threshold=scenario.outputs.width_threshold,
            total_passes=self.stop,
            notes=list(scenario.notes),
            warnings=self.warnings,
            kinematics={
                "rolling_speed": kinematics.rolling_speed,
                "cylinder_radius": kinematics.cylinder_radius,
                "roller_radius": kinematics.roller_radius,
                "crown_radius": kinematics.crown_radius,
                "pass_rate": kinematics.pass_rate,
                "physical_rollers": kinematics.physical_rollers,
            },
            static={
                "y": problem.grid.y,
                "nominal_gap": problem.per_roller(problem.at_time(0.0, 0.0).nominal_gap),
                "start_height": start_height(scenario.cylinder.profile, problem.grid),
                "multiplicity": kinematics.multiplicity,
            },
            history=self.recorder.history,
            records=self.recorder.records,
            checkpoint=checkpoint,
            finished=finished,
            wall_seconds=self._wall(),
            created=self.created,
        )
