"""Files of ensembles and runs in any sequence of writes, failures, kills and readers.

A rule machine compares the file with what was written: after a failure or a kill it holds what it
held before, or all of the write. `WEARSIM_STATES=200 pytest tests/results/test_file_states.py`
tries more sequences.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ensemble_examples import finish, some_header, some_outcome, some_static
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from killed_ensemble_writer import kill_while
from run_examples import some_run

from tests.faulty_storage import STAGES, full_disk
from tests.results_compared import differences
from tests.stateful import STATES
from wearsim.atomic_write import DISK, Storage
from wearsim.errors import ResultsFileError
from wearsim.results.io.files import write_results
from wearsim.studies.ensemble.file.data import EnsembleData
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.ensemble.file.schema import DONE, FAILED, PENDING
from wearsim.studies.ensemble.file.writer import EnsembleFile
from wearsim.studies.run.result import read_results

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hasattr(os, "fork"), reason="kills are of forked processes"),
]

COUNT = 6
KINDS = st.lists(st.booleans(), min_size=COUNT, max_size=COUNT)
PLACES = st.integers(0, 60)  # numbers of file operations: beyond the last one nothing is killed
Work = Callable[[EnsembleFile], object]


def _in_other_process(check: Callable[[], None]) -> None:
    """Call a function in a forked process, which must not raise an exception."""
    child = os.fork()
    if not child:
        try:
            check()
        except BaseException:
            os._exit(1)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0


class EnsembleStates(RuleBasedStateMachine):
    """An ensemble with one writer, which may be killed, and readers."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.path = self.folder / "rig.h5"
        self.status = [PENDING] * COUNT
        self.seconds = 0.0
        self.finished = False
        self.held: tuple[EnsembleData, list[int]] | None = None

    @initialize()
    def create(self) -> None:
        header = some_header(COUNT, inputs=some_header().inputs)
        EnsembleFile.create(self.path, header, some_static(3)).close()

    def teardown(self) -> None:
        shutil.rmtree(self.folder)

    def _change(self, work: Work, status: list[int], **fields: Any) -> None:
        """Change the file, and what it is expected to hold."""
        with EnsembleFile.open(self.path) as file:
            work(file)
        self._expect(status, **fields)

    def _expect(self, status: list[int], **fields: Any) -> None:
        self.status = status
        self.seconds = fields.get("seconds", self.seconds)
        self.finished = fields.get("finished", False)

    def _put(self, failing: list[bool]) -> tuple[Work, list[int]]:
        """Return the writing of every second pending realisation, and the status after it."""
        numbers = [n for n, state in enumerate(self.status) if state == PENDING][::2]
        fails = {n for n in numbers if failing[n % COUNT]}
        outcomes = [some_outcome(n, 3, "lost" if n in fails else "") for n in numbers]
        status = list(self.status)
        for number in numbers:
            status[number] = FAILED if number in fails else DONE
        return lambda file: file.put(outcomes), status

    @rule(failing=KINDS)
    def put(self, failing: list[bool]) -> None:
        self._change(*self._put(failing))

    @rule(chosen=KINDS)
    def clear(self, chosen: list[bool]) -> None:
        numbers = [n for n in range(len(self.status)) if chosen[n % COUNT]]
        status = [PENDING if chosen[n % COUNT] else old for n, old in enumerate(self.status)]
        self._change(lambda file: file.clear(numbers), status)

    @rule(seconds=st.floats(0.0, 1e6))
    def put_state(self, seconds: float) -> None:
        self._change(
            lambda file: file.put_state(wall_seconds=seconds), self.status, seconds=seconds
        )

    @precondition(lambda self: len(self.status) < 4 * COUNT)
    @rule(more=st.integers(1, 3))
    def grow(self, more: int) -> None:
        count = len(self.status) + more
        self._change(lambda file: file.grow(count), [*self.status, *[PENDING] * more])

    @rule()
    def merge(self) -> None:
        self._change(finish, self.status, finished=True)

    @rule(failing=KINDS, at=PLACES)
    def kill_while_putting(self, failing: list[bool], at: int) -> None:
        self._kill(*self._put(failing), at)

    @rule(at=PLACES)
    def kill_while_merging(self, at: int) -> None:
        self._kill(finish, self.status, at, finished=True)

    @rule(at=PLACES)
    def kill_while_growing(self, at: int) -> None:
        count = len(self.status) + 1
        self._kill(lambda file: file.grow(count), [*self.status, PENDING], at)

    def _kill(self, work: Work, after: list[int], at: int, **fields: Any) -> None:
        def change(storage: Storage) -> None:
            with EnsembleFile.open(self.path, storage) as file:
                work(file)

        kill_while(change, at)
        found = read_ensemble(self.path)
        if found.status.tolist() == after and found.finished == fields.get("finished", False):
            self._expect(after, **fields)

    @rule(failing=KINDS, stage=st.sampled_from(STAGES))
    def put_on_a_full_disk(self, failing: list[bool], stage: str) -> None:
        work, after = self._put(failing)
        try:
            with EnsembleFile.open(self.path, full_disk(stage)) as file:
                work(file)
        except ResultsFileError:
            # synchronising the folder comes after the new content is in place
            after = after if stage == "fsync folder" else self.status
        self._expect(after, finished=self.finished and after == self.status)
        if stage == "fsync folder":
            self.finished = read_ensemble(self.path).finished

    @rule()
    def hold(self) -> None:
        """Open it as a reader that reads later."""
        self.held = read_ensemble(self.path), list(self.status)

    @precondition(lambda self: self.held is not None)
    @rule()
    def read_what_is_held(self) -> None:
        assert self.held is not None
        data, status = self.held
        try:
            depths = data.variables["depth"]
        except ResultsFileError:  # it was replaced, or its parts were merged
            return
        for number, state in enumerate(status):
            if state == DONE:
                expected = some_outcome(number, 3).values["depth"]
                assert depths[number].tobytes() == expected.tobytes()

    @rule()
    def read_in_another_process(self) -> None:
        _in_other_process(self.content_is_what_was_written)

    @invariant()
    def content_is_what_was_written(self) -> None:
        if not self.path.exists():
            return
        data = read_ensemble(self.path)
        assert data.status.tolist() == self.status
        assert data.wall_seconds == self.seconds
        assert data.finished == self.finished
        assert set(data.errors) == {n for n, state in enumerate(self.status) if state == FAILED}
        for name in ("depth", "depth_profile", "creepage.yaw"):
            rows = data.variables[name]
            for number in data.done.tolist():
                expected = some_outcome(number, 3).values[name]
                assert rows[number].tobytes() == expected.tobytes(), (name, number)


class RunStates(RuleBasedStateMachine):
    """The file of a run, which is written whole."""

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.path = self.folder / "rig.h5"
        self.seed = -1

    def teardown(self) -> None:
        shutil.rmtree(self.folder)

    def _write(self, seed: int, storage: Storage = DISK) -> None:
        write_results(self.path, some_run(seed=seed, finished=seed % 2 == 0), storage)

    @rule(seed=st.integers(0, 9))
    def write(self, seed: int) -> None:
        self._write(seed)
        self.seed = seed

    @rule(seed=st.integers(0, 9), at=PLACES)
    def kill(self, seed: int, at: int) -> None:
        kill_while(lambda storage: self._write(seed, storage), at)
        if self.path.exists() and read_results(self.path).seed == seed:
            self.seed = seed

    @rule(seed=st.integers(0, 9), stage=st.sampled_from(STAGES))
    def fail(self, seed: int, stage: str) -> None:
        with pytest.raises(ResultsFileError):
            self._write(seed, full_disk(stage))
        if stage == "fsync folder":
            self.seed = seed

    @precondition(lambda self: self.seed >= 0)
    @rule()
    def read_in_another_process(self) -> None:
        _in_other_process(self.content_is_what_was_written)

    @invariant()
    def content_is_what_was_written(self) -> None:
        if self.seed < 0:
            assert not self.path.exists()
            return
        expected = some_run(seed=self.seed, finished=self.seed % 2 == 0)
        assert differences(read_results(self.path), expected) == []


TestEnsembleStates = EnsembleStates.TestCase
TestEnsembleStates.settings = STATES
TestRunStates = RunStates.TestCase
TestRunStates.settings = STATES
