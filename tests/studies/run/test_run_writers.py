"""A results file has one writer at a time."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path

import pytest
from study_examples import run_differences, run_once, short

from wearsim import operating_system
from wearsim.atomic_write import lock_path, write_lock
from wearsim.errors import Interrupted, ResultsFileError
from wearsim.results.io import outputs
from wearsim.results.io.outputs import check_output, output_lock
from wearsim.studies.opening import open_results
from wearsim.studies.run import run as studies
from wearsim.studies.run.recorder import Event, Stepped

pytestmark = pytest.mark.skipif(operating_system.fcntl is None, reason="there are no locks")
BUSY = "is being written by another process; wait until it ends, or stop it"

SECOND: dict[str, Callable[[Path], object]] = {
    "run": partial(studies.run, short()),
    "run with force": partial(studies.run, short(), force=True),
    "resume": studies.resume,
    "any study with force": partial(check_output, force=True),
}


@pytest.mark.parametrize("second", SECOND.values(), ids=SECOND)
@pytest.mark.parametrize("first", ["run", "resume"])
def test_second_writer_is_refused_while_a_run_writes(
    first: str, second: Callable[[Path], object], path: Path
) -> None:
    refused = []

    def watch(event: Event) -> None:
        if isinstance(event, Stepped) and not refused:
            with pytest.raises(ResultsFileError) as caught:
                second(path)
            refused.append(str(caught.value))

    unbroken = run_once(short())
    if first == "resume":
        with pytest.raises(Interrupted):
            studies.run(short(), path, stop_requested=lambda: True)
        studies.resume(path, on_event=watch)
    else:
        studies.run(short(), path, on_event=watch)
    assert refused == [f"{path}: {BUSY}"]
    assert run_differences(open_results(path), unbroken) == []
    assert list(path.parent.iterdir()) == [path]


def test_remaining_lock_of_a_killed_run_blocks_no_writer(path: Path) -> None:
    lock_path(path).touch()  # a kill releases the lock, and the file remains
    with pytest.raises(Interrupted):
        studies.run(short(), path, stop_requested=lambda: True)
    lock_path(path).touch()
    assert studies.resume(path).finished
    assert list(path.parent.iterdir()) == [path]


def test_lock_ends_with_its_process_and_not_before(path: Path) -> None:
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        with output_lock(path, force=False):
            os.write(writing, b"locked")
            os.read(os.pipe()[0], 1)  # never returns
    os.read(reading, 6)
    with pytest.raises(ResultsFileError, match=BUSY):
        studies.run(short(), path)
    os.kill(child, 9)
    os.waitpid(child, 0)
    assert studies.run(short(), path).finished
    assert list(path.parent.iterdir()) == [path]


def test_file_written_after_its_check_is_not_replaced(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = []

    def meanwhile(file: Path) -> AbstractContextManager[None]:
        monkeypatch.setattr(outputs, "write_lock", write_lock)
        studies.run(short(), file)
        written.append(file.read_bytes())
        return write_lock(file)

    monkeypatch.setattr(outputs, "write_lock", meanwhile)
    with pytest.raises(ResultsFileError, match="already exists"), output_lock(path, force=False):
        pytest.fail("the file may be replaced")
    assert written == [path.read_bytes()]


def test_file_written_while_resume_reads_it_is_not_replaced(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(Interrupted):
        studies.run(short(), path, stop_requested=lambda: True)
    with_end = studies.with_end

    def meanwhile(*arguments: object) -> object:
        monkeypatch.setattr(studies, "with_end", with_end)
        studies.resume(path)
        return with_end(*arguments)

    monkeypatch.setattr(studies, "with_end", meanwhile)
    with pytest.raises(ResultsFileError, match=BUSY):
        studies.resume(path)
    assert open_results(path).finished
