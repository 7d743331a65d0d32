"""What is done where an operating system lacks a function of POSIX."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from wearsim import operating_system
from wearsim.atomic_write import DISK, lock_or_refuse, replacement
from wearsim.errors import ResultsFileError
from wearsim.operating_system import end_of_process, interrupts_blocked, processors

HAS_FCNTL = pytest.mark.skipif(operating_system.fcntl is None, reason="the fallback is in use")


def _is_refused(path: Path) -> bool:
    """Return whether a second writer of a locked file is refused."""
    with path.open("a+b") as first, path.open("a+b") as second:
        lock_or_refuse(first, path)
        try:
            lock_or_refuse(second, path)
        except ResultsFileError:
            return True
    return False


@HAS_FCNTL
def test_second_writer_is_refused_by_either_kind_of_lock(tmp_path, monkeypatch):
    assert _is_refused(tmp_path / "lock")
    monkeypatch.delattr(operating_system.fcntl, "F_OFD_SETLK", raising=False)
    assert _is_refused(tmp_path / "lock")


def test_without_locks_second_writer_is_not_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(operating_system, "fcntl", None)
    assert not _is_refused(tmp_path / "lock")


def test_without_folders_that_open_a_file_is_replaced_whole(tmp_path, monkeypatch):
    monkeypatch.delattr(os, "O_DIRECTORY", raising=False)
    opened = []
    monkeypatch.setattr(os, "open", lambda *arguments: opened.append(arguments))
    DISK.synchronise_folder(tmp_path)
    assert not opened
    monkeypatch.undo()
    monkeypatch.delattr(os, "O_DIRECTORY", raising=False)
    with replacement(tmp_path / "rig.h5") as file:
        file.write(b"new")
    assert (tmp_path / "rig.h5").read_bytes() == b"new"


def test_rename_that_the_system_refuses_leaves_the_file(tmp_path, monkeypatch):
    path = tmp_path / "rig.h5"
    path.write_bytes(b"old")

    def refused(self: Path, target: Path) -> None:
        raise PermissionError(13, "another process has the file open")

    monkeypatch.setattr(Path, "replace", refused)
    expected = pytest.raises(
        ResultsFileError, match=r"rig\.h5: cannot be written \(another process"
    )
    with expected, replacement(path) as file:
        file.write(b"new")
    assert path.read_bytes() == b"old"
    assert [item.name for item in tmp_path.iterdir()] == ["rig.h5"]


CHILD = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))"


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="the fallback is in use")
def test_process_that_is_started_with_interrupts_blocked_receives_none():
    with interrupts_blocked():
        done = subprocess.run([sys.executable, "-c", CHILD], capture_output=True, check=True)
    assert done.stdout.strip() == b"True"
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_without_masks_of_signals_processes_are_started_all_the_same(monkeypatch):
    monkeypatch.delattr(signal, "pthread_sigmask", raising=False)
    with interrupts_blocked():
        started = True
    assert started


@pytest.mark.parametrize("code", [0, 1, None, 3221225477, -99])
def test_process_without_a_known_signal_has_its_exit_code(code):
    assert end_of_process(code) == f"ended with exit code {code}"


def test_killed_process_has_its_signal():
    assert end_of_process(-signal.SIGTERM) == "was killed by SIGTERM"


def test_without_affinity_all_processors_count(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 6)
    assert processors() == 6
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert processors() == 1
