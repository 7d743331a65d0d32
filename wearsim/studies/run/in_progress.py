"""A run in this process, with its recorder, clock and file."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import numpy as np

from wearsim.atomic_write import Storage
from wearsim.errors import Interrupted, ResultsFileError, SolverError, failure_text
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import evolve
from wearsim.evolution.limits import Limit
from wearsim.evolution.observables import present_batch
from wearsim.evolution.observed_errors import (
    load_before_feedback,
    observed_errors,
    relative_crown_radius,
)
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import SIGMAS, WearState
from wearsim.evolution.strip_errors import Course, coarse_courses, strip_errors
from wearsim.evolution.strips import on_grid, same_strips
from wearsim.plugins import ContactModelSpec, registry
from wearsim.results.io.files import write_results
from wearsim.scenario import Scenario
from wearsim.studies.cam.observables import at_every_station, observables_of_track
from wearsim.studies.contact.comparison import REFERENCE, error_above_tolerance
from wearsim.studies.effort import large_records
from wearsim.studies.failures import (
    explained,
    too_deep_failure,
)
from wearsim.studies.plausibility import plausibility_warnings
from wearsim.studies.preparation import changed_origins, origin_of
from wearsim.studies.roller_ends import width_between_edges
from wearsim.studies.run.assemble import assemble_problem, coarse_stepper, start_height
from wearsim.studies.run.continuation import earlier_warnings
from wearsim.studies.run.draws import draw, units_of
from wearsim.studies.run.grid import start_of_run
from wearsim.studies.run.recorder import (
    Checkpointed,
    Event,
    Finished,
    History,
    Recorder,
    Started,
    Stepped,
    Warned,
)
from wearsim.studies.run.result import Result, RunData
from wearsim.studies.run.setup import Setup
from wearsim.studies.schedule import RecordSchedule
from wearsim.types import FloatArray, Grid

Watcher = Callable[[Event], None]

FIRST_CHECKPOINT = 1.0  # s after the start of a run
WRITING = 0.02  # greatest part of the time that is spent on checkpoints, with a slow disk


class RunInProgress:
    """A run in this process, with its recorder, clock and file.

    It starts from unworn bodies, or continues from the data and the state of a file.
    """

    _last_write = 0.0  # duration [s]
    failure = failed_at = ""

    def __init__(
        self,
        scenario: Scenario,
        path: Path | None,
        storage: Storage,
        on_event: Watcher | None,
        stop_requested: Callable[[], bool] | None,
        data: RunData | None = None,
        state: WearState | None = None,
        limit: Limit | None = None,
    ) -> None:
        self.limit, self.reached = limit, False
        setup = draw(scenario) if scenario.random else Setup(scenario)
        self.start = grid = start_of_run(scenario, setup)
        if data is not None:
            grid = Grid(data.static["y"], float(data.checkpoint["spacing"]))
        self.scenario, self.setup, self.path, self.storage = scenario, setup, path, storage
        self.problem, self.stepper, self.stepper_name = assemble_problem(setup, grid)
        self.on_event: Watcher = on_event or (lambda event: None)
        self._watched = on_event is not None
        self.stop_requested = stop_requested or (lambda: False)
        self.stop = float(scenario.total_passes)
        self.warnings: list[str] = [] if data is None else earlier_warnings(data)
        self.created = (
            datetime.now(UTC).isoformat(timespec="seconds") if data is None else data.created
        )
        self.wall_before = 0.0 if data is None else data.wall_seconds
        self.started = self._written = time.monotonic()  # time of the last checkpoint too
        self.record_base = self.stop if data is None else float(data.checkpoint["record_base"])
        try:
            state = fresh_state(self.problem) if state is None else state
        except SolverError as error:
            raise explained(error, scenario) from error.__cause__
        self.recorder = Recorder(
            self.problem,
            self.stepper,
            RecordSchedule.of(scenario, self.record_base),
            scenario.outputs.width_threshold,
            state,
            None if data is None else data.history,
            None if data is None else data.records,
        )
        self.origin, units = origin_of(scenario), units_of(scenario)
        self.drawn: dict[str, dict[str, object]] = {
            key: {"values": np.atleast_1d(value).tolist(), "unit": units[key]}
            for key, value in setup.values.items()
        }
        if data is None:
            means = setup if setup.scenario is scenario else Setup(scenario)
            large = large_records(scenario, self.problem, path)
            for text in [*plausibility_warnings(means), *([large] if large else [])]:
                self.warn(text)
            self._write()
            self._last_write = 0.0  # it has imported the library that writes
        else:
            for text in changed_origins(data, scenario):
                self.warn(text)

    def finish(self) -> Result:
        """Step to the end of the test and return the result."""
        self.on_event(
            Started(
                self.stop,
                self.stop / self.problem.kinematics.pass_rate,
                self._passes,
                self.stepper_name,
                self.scenario.contact.model,
            )
        )
        try:
            self._step_to_end()
            # the test on coarse strips may take as long as the last steps
            if self.path and not self.reached:
                self._write_in_time(FIRST_CHECKPOINT)
            self._estimate_strip_errors()
            data = self.data(finished=True)
            self._check_errors(data)
            self._write(data)
        except KeyboardInterrupt:
            self._interrupt()
        except (Interrupted, ResultsFileError):
            raise
        except Exception as error:
            # the file keeps the last accepted step, the history before the failure, and its cause
            self.recorder.drop_unfinished()
            failure: Exception = error
            if isinstance(error, SolverError):
                failure = explained(error, self.scenario, self._passes)
            self.failure = failure_text(failure)
            self.failed_at = datetime.now(UTC).isoformat(timespec="seconds")
            self._write()
            if failure is error:
                raise
            raise failure from error
        self.on_event(Finished(self._wall()))
        return Result(data, self.path)

    def end_before_limit(self, reason: str) -> Result:
        """Return the result of a run that does not reach its limit, with a warning."""
        self.warn(f"limit {self.limit.text if self.limit else ''} is not reached: {reason}")
        data = self.data(finished=True)
        self._write(data)
        return Result(data, self.path)

    def _estimate_strip_errors(self) -> None:
        """Estimate the errors due to the strips by the same test on coarse ones."""
        problem = self.present
        stepper = coarse_stepper(self.setup, problem)
        if stepper is None or self._passes == 0.0:
            return
        first = self.problem
        if not same_strips(first.grid, self.start):
            first = assemble_problem(self.setup, self.start)[0]
        column, count = self.recorder.column, problem.kinematics.multiplicity
        passes, rollers = column("passes"), column("roller_worn_volume")[..., 0] @ count
        sizes = [
            column("depth")[:, 0],
            column("roller_depth")[..., 0].max(axis=1),
            column("worn_volume")[:, 0] + rollers,
        ]
        last, most = passes[-1:], self.scenario.evolution.max_steps

        history = History(stepper, self.recorder.threshold, {})

        def observe(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
            history.add(problem, state, state)
            return {}

        (coarse,) = coarse_courses(first, stepper, float(last[0]), last, most, observe)
        if coarse is not None:
            coarse.observed = history.compute()
        else:
            self.warn(
                "error by strips: not estimated, as the test fails on strips of twice the width"
            )
        record = self.recorder.last_record
        profiles = [record[f"{body}_depth_profile"][:, 0] for body in ("cylinder", "roller")]
        end = Course(profiles=np.concatenate(profiles), grid=problem.grid)
        errors = strip_errors(coarse, passes, np.array(sizes), end)
        crown, spacing = relative_crown_radius(first), problem.grid.spacing
        varies = problem.varies and problem.shape[0] == 1
        self.recorder.strip_errors = errors
        self.recorder.observed_errors = observed_errors(
            *(coarse, passes, self.recorder.observed, np.array(sizes), errors),
            *(None if crown is None else crown[:, 0], spacing, width_between_edges(self.scenario)),
            partial(load_before_feedback, problem) if varies else None,
            feedback=problem.has_spring or bool(problem.terms),
            free=problem.free,
            cam=problem.shape[0] > 1,
        )

    def _check_errors(self, data: RunData) -> None:
        """Warn if estimated errors in the data of a finished run exceed the tolerance."""
        state, tolerance = self.recorder.state, self.scenario.evolution.tolerance
        last = {name: values[-1] for name, values in data.history.items()}
        rollers = self.present.kinematics.multiplicity @ last["roller_worn_volume"]
        depth = np.maximum(last["depth"], last["roller_depth"].max(axis=0))
        sizes = {"depth": depth, "volume": last["worn_volume"] + rollers}
        beyond: dict[str, list[tuple[str, str]]] = {}  # names and errors by remedy
        for kind, (name, size) in enumerate(sizes.items()):
            relative, quadrature, scatter, strips, stations, rollers_together = (
                float((part / np.where(size > 0.0, size, np.inf)).max())
                for part in [
                    last[f"{name}_error"],
                    state.quadrature[kind],
                    SIGMAS * np.sqrt(state.scatter[kind]),
                    np.nan_to_num(last[f"{name}_error_by_strips"]),
                    last.get(f"{name}_error_by_stations", np.zeros(1)),
                    last[f"{name}_error_by_steps"] - getattr(state, f"{name}_error"),
                ]
            )
            if relative <= tolerance:
                continue
            remedy = "a lower evolution.tolerance or evolution.step decreases it"
            if max(quadrature, scatter) > 0.5 * relative:
                remedy = "more evolution.nodes decrease it"
                if scatter > quadrature:
                    part = scatter / relative
                    remedy = f"{part:.0%} of it is sampling scatter of the small number of passes"
            elif strips > 0.5 * relative:
                strips_here = self.scenario.contact.strips or self.present.grid.strips
                remedy = f"more contact.strips than {strips_here} decrease it"
                cylinder = self.scenario.cylinder
                if cylinder.profile is not None and cylinder.profile_filter is None:
                    remedy += (
                        ", or where the start profile is rough a filter, cylinder.profile_filter ="
                        ' "0.8 mm" (ISO 16610-21)'
                    )
            elif stations > 0.5 * relative:
                remedy = "more cam.stations decrease it"
            elif rollers_together > 0.5 * relative:
                remedy = (
                    "the different rollers pass one after another:"
                    ' evolution.stepper = "per-pass" takes their passes one by one'
                )
            words = "worn volume" if name == "volume" else name
            of_roller = name == "depth" and (size > last["depth"]).any()
            whose = " of the roller depth" if of_roller else ""
            beyond.setdefault(remedy, []).append((words, f"{100.0 * relative:.2g} %{whose}"))
        for remedy, texts in beyond.items():
            names, errors_text = map(" and ".join, zip(*texts, strict=True))
            self.warn(
                f"estimated error of {names}: {errors_text}, above the tolerance of"
                f" {100.0 * tolerance:.2g} %; {remedy}"
            )

    def _step_to_end(self) -> None:
        self._check_depth(self.recorder.state)
        for advance in evolve(
            self.problem,
            self.recorder.state,
            self.stepper,
            self.stop,
            self.recorder.schedule.next_record,
            self.scenario.evolution.max_steps,
        ):
            if at_limit := self.limit and self.limit.crossing(self.stepper, advance, 0):
                self.recorder.end_at(advance, at_limit, self.stop)
                self.reached = True
                return
            self.recorder.add(advance, self.stop)
            before, *_, state = advance.path
            passes = state.passes.item()
            if self.scenario.contact.auto is not None:
                self._verify_model(before.passes.item())
            if advance.warning is not None:
                self.warn(advance.warning)
            if self._watched:
                self.on_event(
                    Stepped(
                        passes=passes,
                        total_passes=self.stop,
                        time=passes / self.problem.kinematics.pass_rate,
                        depth=float(state.cylinder_depth.max()),
                        step_passes=passes - before.passes.item(),
                        depth_error=float(state.depth_error.max()),
                        wall_seconds=self._wall(),
                    )
                )
            self._check_depth(state)
            if self.stop_requested() and passes < self.stop:
                self._interrupt()
            if self.path:
                self._write_in_time()

    def _write_in_time(self, interval: float | None = None) -> None:
        """Write a checkpoint if the last one is longer ago than an interval [s].

        Without an interval it is that of the scenario. A short run has some too: until it is
        reached, as much time passes before a checkpoint as had passed before the last one.
        """
        since = time.monotonic() - self._written
        if interval is None:
            if since <= FIRST_CHECKPOINT <= self.scenario.outputs.checkpoint_every:
                return
            early = max(FIRST_CHECKPOINT, self._written - self.started)
            interval = min(self.scenario.outputs.checkpoint_every, early)
        if since > max(interval, self._last_write / WRITING):
            self._write()

    def _check_depth(self, state: WearState) -> None:
        """End the run if a groove is deeper than the model is valid for, unless that is allowed."""
        depth = float(np.maximum.reduce(state.stacked, axis=None))
        if depth <= self.scenario.greatest_valid_depth:
            return
        less = f"the limit {self.limit.text}" if self.limit else ""
        resuming = "; with the option allow_deep, resume continues" if self.path else ""
        if failure := too_deep_failure(self.scenario, depth, self._passes, less, resuming):
            raise failure

    def _verify_model(self, start: float) -> None:
        """Compare an automatically chosen contact model with exact theory, where it is installed.

        The contacts are those at the end of the first step, and of the steps in which half of the
        passes and all are reached; `start` is the pass at the start of the step.
        """
        choice, state = self.scenario.contact, self.recorder.state
        if choice.auto is None or choice.model == REFERENCE:
            return
        due = start == 0.0 or any(start < part * self.stop <= self._passes for part in (0.5, 1.0))
        if not due or REFERENCE not in registry().names(ContactModelSpec):
            return
        problem = self.present
        if text := error_above_tolerance(
            REFERENCE,
            problem.model,
            problem.grid,
            self.scenario.materials,
            present_batch(problem, state),
            choice.auto.tolerance,
            self.scenario.friction.creep_factor,
        ):
            self.warn(f"contact.model = 'auto': at {self._passes:.6g} passes {text}")

    def warn(self, message: str) -> None:
        """Report and store a warning, the first of each kind only."""
        kind = message.split(":", maxsplit=1)[0]
        if not any(known.split(":")[0] == kind for known in self.warnings):
            self.warnings.append(message)
            self.on_event(Warned(message))

    def _interrupt(self) -> None:
        """Write a checkpoint and raise Interrupted."""
        self.recorder.drop_unfinished()
        self._write()
        what = f"stopped at pass {self._passes:.0f} of {self.stop:.0f}"
        if self.path is None:
            raise Interrupted(f"{what}; nothing was written") from None
        raise Interrupted(
            what,
            python=f'continue with wearsim.resume("{self.path}")',
            shell=f"continue with: wearsim resume {self.path}",
        ) from None

    @property
    def present(self) -> WearProblem:
        """The problem on the present strips."""
        grid = self.recorder.grid
        return self.problem if grid is self.problem.grid else on_grid(self.problem, grid)

    @property
    def _passes(self) -> float:
        """Roller passes done."""
        return float(self.recorder.state.passes[0])

    def _wall(self) -> float:
        return self.wall_before + time.monotonic() - self.started

    def _write(self, data: RunData | None = None) -> None:
        """Write the results file, if there is one; by default that of a run in progress."""
        if self.path is None:
            return
        begin = time.monotonic()
        write_results(self.path, data or self.data(finished=False), self.storage)
        self._written = time.monotonic()
        self._last_write = self._written - begin
        self.on_event(Checkpointed(str(self.path), self._passes))

    def data(self, finished: bool) -> RunData:
        """Return the content of the results file."""
        scenario, problem = self.scenario, self.present
        kinematics = problem.kinematics
        return RunData(
            **self.origin,
            drawn=self.drawn,
            stepper=self.stepper_name,
            tolerance=scenario.evolution.tolerance,
            width_threshold=scenario.outputs.width_threshold,
            total_passes=self.stop,
            until=self.limit.text if self.limit and (self.reached or not finished) else "",
            notes=list(scenario.notes),
            warnings=self.warnings,
            kinematics={
                "rolling_speed": kinematics.rolling_speed,
                "cylinder_radius": kinematics.cylinder_radius,
                "roller_radius": kinematics.roller_radius,
                "crown_radius": scenario.axial_gap.crown_radius or math.nan,
                "pass_rate": kinematics.pass_rate,
                "physical_rollers": kinematics.physical_rollers,
            },
            static={
                "y": problem.grid.y,
                "nominal_gap": at_every_station(
                    problem,
                    problem.per_roller(problem.at_time(np.zeros(1), np.zeros(1)).nominal_gap),
                ),
                "start_height": start_height(scenario, problem.grid),
                "multiplicity": kinematics.multiplicity,
                **observables_of_track(problem).columns(),
            },
            history=self.recorder.history,
            records=self.recorder.records,
            checkpoint={
                **self.recorder.state.to_arrays(),
                "record_base": np.asarray(self.record_base),
                "spacing": np.asarray(problem.grid.spacing),
            },
            finished=finished,
            wall_seconds=self._wall(),
            created=self.created,
            failure=self.failure,
            failed_at=self.failed_at,
        )
