"""Runs in any sequence of starts, stops, kills, failures of the disk, prolongations and readers.

A rule machine drives `run` and `resume`. At any time the file holds the first rows of an unbroken
run, no fewer than before, and all of it once it is finished. `WEARSIM_STATES=200 pytest
tests/studies/run/test_run_states.py` tries more sequences.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from killed_run import ended, forked, killing
from study_examples import LOADS, ROLLERS, after, run_differences, short

from tests.faulty_storage import STAGES, WatchedStorage
from tests.stateful import STATES
from wearsim.atomic_write import DISK, Storage
from wearsim.errors import Interrupted, ResultsFileError
from wearsim.scenario import Scenario
from wearsim.studies.opening import open_results
from wearsim.studies.run import run as studies
from wearsim.studies.run.recorder import Event
from wearsim.studies.run.result import Result

pytestmark = [
    pytest.mark.slow,
    pytest.mark.usefixtures("quick_disk"),
    pytest.mark.skipif(not hasattr(os, "fork"), reason="kills are of forked processes"),
]

FIRST, LONGER, MOST = 120.0, 40.0, 200.0  # duration of a test, of a prolongation, greatest [s]
STEPS = st.integers(1, 4)  # steps after which a run is stopped; some are beyond its end
PLACES = st.integers(0, 1800)  # numbers of file operations; beyond the last one nothing is killed


@cache
def scenario() -> Scenario:
    """Return a test with a spring and wearing rollers, with a checkpoint after every step."""
    often = {"outputs.checkpoint_every": "1e-9 s", "evolution.step": 2000}
    return short(**LOADS["spring"], **ROLLERS["wearing"], **often)


@cache
def unbroken(seconds: float) -> Result:
    """Return the run of a duration, prolonged from the run before it in one go."""
    if seconds == FIRST:
        return studies.run(scenario())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "whole.h5")
        studies.run(scenario(), path)
        for end in np.arange(FIRST + LONGER, seconds + 1.0, LONGER):
            result = studies.resume(path, float(end))
        return result


def prefix_of_unbroken(path: Path) -> Result:
    """Return the content of a file, which must be the first rows of an unbroken run."""
    found = open_results(path)
    whole = unbroken(found.scenario.total_time)
    if found.finished:
        assert run_differences(found, whole) == []
        return found
    rows = len(found.passes)
    for name, array in found.raw.history.items():
        if not name.endswith(("_error", "_by_strips")):  # estimated again for the whole test
            np.testing.assert_array_equal(array, whole.raw.history[name][:rows], name)
    assert found.passes[-1] == found.raw.checkpoint["passes"]
    assert found.failure == ""
    return found


class RunStates(RuleBasedStateMachine):
    """A results file on which tests are run and resumed, one at a time."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.path = self.folder / "rig.h5"
        self.rows = 0
        self.held: tuple[Result, int] | None = None

    def teardown(self) -> None:
        if self.path.exists():
            studies.resume(self.path)
            assert prefix_of_unbroken(self.path).finished
        assert {path.name for path in self.folder.iterdir()} <= {"rig.h5", "rig.h5.tmp"}
        shutil.rmtree(self.folder)

    def _start(self, steps: int, storage: Storage = DISK) -> None:
        studies.run(scenario(), self.path, force=True, stop_requested=after(steps), storage=storage)

    def _resume(self, until: float | None, steps: int = 99, storage: Storage = DISK) -> None:
        studies.resume(self.path, until, stop_requested=after(steps), storage=storage)

    def _until(self, prolonged: bool) -> float | None:
        """Return the end of a prolongation, if that is asked for and the test is finished."""
        found = open_results(self.path)
        end = found.scenario.total_time + LONGER
        return end if prolonged and found.finished and end <= MOST else None

    def _kill(self, work: Callable[[Storage], None], at: int) -> None:
        assert ended(forked(lambda: work(killing(at)))) in (0, 9)

    @initialize(steps=STEPS)
    def start(self, steps: int) -> None:
        try:
            self._start(steps)
        except Interrupted:
            assert not open_results(self.path).finished

    @rule(steps=STEPS)
    def start_again(self, steps: int) -> None:
        self.rows = 0
        self.start(steps)

    @rule()
    def start_without_force(self) -> None:
        before = self.path.read_bytes()
        with pytest.raises(ResultsFileError, match="already exists"):
            studies.run(scenario(), self.path)
        assert self.path.read_bytes() == before

    @rule(steps=STEPS, prolonged=st.booleans())
    def resume(self, steps: int, prolonged: bool) -> None:
        until = self._until(prolonged)
        try:
            self._resume(until, steps)
        except Interrupted:
            return
        found = open_results(self.path)
        assert found.finished
        assert until in (None, found.scenario.total_time)

    @rule(at=PLACES)
    def kill_as_it_starts_again(self, at: int) -> None:
        self.rows = 0
        self._kill(lambda storage: self._start(99, storage), at)

    @rule(at=PLACES, prolonged=st.booleans())
    def kill_as_it_resumes(self, at: int, prolonged: bool) -> None:
        until = self._until(prolonged)
        self._kill(lambda storage: self._resume(until, storage=storage), at)

    @rule(stage=st.sampled_from(STAGES), number=st.integers(1, 4), prolonged=st.booleans())
    def fail_as_it_resumes(self, stage: str, number: int, prolonged: bool) -> None:
        calls: list[str] = []

        def fill(now: str) -> None:
            if now == f"before {stage}":
                calls.append(now)
                if len(calls) == number:
                    raise OSError(28, "No space left on device")

        try:
            self._resume(self._until(prolonged), storage=WatchedStorage(fill))
        except ResultsFileError as error:
            assert "No space left" in str(error)  # noqa: PT017  (it may also end before)
        else:
            assert len(calls) < number

    @rule(prolonged=st.booleans())
    def read_meanwhile(self, prolonged: bool) -> None:
        """Read in this process after every event, and in another one after every third."""
        events: list[Event] = []

        def read(event: Event) -> None:
            events.append(event)
            self.content_is_a_prefix()
            if len(events) % 3 == 0:
                assert ended(forked(self.content_is_a_prefix)) == 0

        studies.resume(self.path, self._until(prolonged), on_event=read)

    @rule()
    def hold(self) -> None:
        """Open it as a reader that reads later."""
        found = open_results(self.path)
        self.held = found, len(found.passes)

    @precondition(lambda self: self.held is not None)
    @rule()
    def read_what_is_held(self) -> None:
        assert self.held is not None
        found, rows = self.held
        assert len(found.passes) == rows
        whole = unbroken(found.scenario.total_time)
        np.testing.assert_array_equal(found.depth, whole.depth[:rows])

    @invariant()
    def content_is_a_prefix(self) -> None:
        if self.path.exists():
            rows = len(prefix_of_unbroken(self.path).passes)
            assert rows >= self.rows
            self.rows = rows


TestRunStates = RunStates.TestCase
TestRunStates.settings = STATES
