"""Atomic writing: after a failure or a kill at any stage the old or the new file is complete."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from run_examples import some_run

from tests.faulty_storage import STAGES, WatchedStorage, full_disk, some_of_each
from tests.results_compared import differences
from wearsim.errors import ResultsFileError
from wearsim.results.io.files import write_results
from wearsim.results.io.outputs import check_output
from wearsim.studies.run.result import RunData, read_results

HERE = Path(__file__).parent
OLD, NEW = some_run(seed=1), some_run(seed=2, strips=200, records=10)


class Fault(Exception):  # noqa: N818
    pass


def _all_calls(folder: Path) -> list[str]:
    calls: list[str] = []
    write_results(folder / "all.h5", NEW, WatchedStorage(calls.append))
    return calls


def test_storage_is_used_for_every_stage(tmp_path: Path) -> None:
    calls = _all_calls(tmp_path)
    expected = [f"{when} {stage}" for stage in STAGES for when in ("before", "after")]
    assert list(dict.fromkeys(calls)) == expected
    assert calls.count("before write") > 1  # so that a failure can hit a half-written file


@pytest.fixture(scope="module")
def old_file(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return _bytes_of(OLD, tmp_path_factory.mktemp("old"))


@pytest.fixture(scope="module")
def new_file(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return _bytes_of(NEW, tmp_path_factory.mktemp("new"))


def _bytes_of(data: RunData, folder: Path) -> bytes:
    """Return the file of a run, from which the run is read again."""
    path = folder / "run.h5"
    write_results(path, data)
    assert differences(read_results(path), data) == []
    return path.read_bytes()


def test_failure_at_any_stage_leaves_old_or_new_file(
    tmp_path: Path, old_file: bytes, new_file: bytes
) -> None:
    path = tmp_path / "run.h5"
    calls = _all_calls(tmp_path)
    renamed = calls.index("after rename")
    for at in some_of_each(calls):
        path.write_bytes(old_file)
        left = at

        def fail(stage: str) -> None:
            nonlocal left
            left -= 1
            if left < 0:
                raise Fault(stage)

        with pytest.raises(Fault):
            write_results(path, NEW, WatchedStorage(fail))
        assert path.read_bytes() == (old_file if at < renamed else new_file)
        assert sorted(tmp_path.iterdir()) == [tmp_path / "all.h5", path]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")
def test_kill_at_any_stage_leaves_old_or_new_file(
    tmp_path: Path, old_file: bytes, new_file: bytes
) -> None:
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, str(HERE / "killed_writer.py"), str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
        env=environment | {"PYTHONPATH": str(HERE.parents[1])},
        cwd=HERE.parents[1],
    )
    lines = [line.split(",") for line in done.stdout.splitlines()]
    assert {name.split(maxsplit=1)[1] for _, _, name in lines} == set(STAGES)
    renamed = [name for _, _, name in lines].index("after rename")
    for place, (number, killed_by, _) in enumerate(lines):
        path = tmp_path / f"{number}.h5"
        assert int(killed_by) == signal.SIGKILL
        if place >= renamed:
            assert path.read_bytes() == new_file
        elif int(number) % 2 == 0:
            assert path.read_bytes() == old_file
        else:
            assert not path.exists()
        write_results(path, NEW)  # remains of the killed process do not matter
        assert path.read_bytes() == new_file
        assert not path.with_name(f"{number}.h5.tmp").exists()


@pytest.mark.parametrize("at", ["open", "write", "fsync", "rename"])
def test_full_disk_raises_one_line_error(tmp_path: Path, at: str) -> None:
    path = tmp_path / "run.h5"
    write_results(path, OLD)
    with pytest.raises(ResultsFileError) as caught:
        write_results(path, NEW, full_disk(at))
    assert str(caught.value) == f"{path}: cannot be written (No space left on device)"
    assert differences(read_results(path), OLD) == []


FULL_AT = ["open", "write", "fsync", "close", "rename"]


@pytest.mark.parametrize("stages", [FULL_AT] if hasattr(os, "fork") else [[at] for at in FULL_AT])
def test_process_ends_normally_after_a_failure(tmp_path: Path, stages: list[str]) -> None:
    """HDF5 crashes at the end of a process if it still refers to a Python file."""
    code = (
        "import os, sys; from run_examples import some_run\n"
        "from wearsim.results.io.files import write_results\n"
        "from tests.faulty_storage import full_disk\n"
        "for at in sys.argv[2:]:\n"
        "    child = os.fork() if len(sys.argv) > 3 else 0\n"
        "    if child == 0:\n"
        "        write_results(sys.argv[1], some_run(), full_disk(at))\n"
        "    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "run.h5"), *stages],
        capture_output=True,
        text=True,
        check=False,
        cwd=HERE,
        env=os.environ | {"PYTHONPATH": str(HERE.parents[1])},
    )
    codes = done.stdout.split() or [str(done.returncode)]
    assert codes == ["1"] * len(stages), done.stderr
    last = [line for line in done.stderr.splitlines() if line.startswith("wearsim.errors.")]
    assert len(last) == len(stages)
    assert all(line.endswith("cannot be written (No space left on device)") for line in last)
    assert "Exception ignored" not in done.stderr


def test_symbolic_link_is_kept(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    target, link = tmp_path / "disk" / "run.h5", tmp_path / "run.h5"
    link.symlink_to(target)
    write_results(link, OLD)
    write_results(link, NEW)
    assert link.is_symlink()
    assert differences(read_results(target), NEW) == []


def test_equal_runs_give_equal_files_at_any_time(tmp_path: Path) -> None:
    write_results(tmp_path / "one.h5", some_run(seed=4, rollers=2))
    time.sleep(1.1)  # time stamps of HDF5 would count seconds; none are written
    write_results(tmp_path / "two.h5", some_run(seed=4, rollers=2))
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()


def test_inconsistent_variables_are_refused(tmp_path: Path) -> None:
    history = some_run().history
    for broken in (
        {name: array for name, array in history.items() if name != "depth"},
        history | {"speed": history["time"]},
        history | {"depth": history["depth"][:-1]},
        history | {"depth": history["time"]},
    ):
        with pytest.raises(ValueError, match=r"depth|speed"):
            write_results(tmp_path / "run.h5", some_run(history=broken))
    with pytest.raises(ValueError, match="cannot be stored"):
        write_results(tmp_path / "run.h5", some_run(checkpoint={"a": history["time"] * 1j}))
    assert list(tmp_path.iterdir()) == []


def test_existing_file_is_replaced_only_with_force(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    check_output(path, force=False)
    path.write_bytes(b"precious")
    with pytest.raises(ResultsFileError) as caught:
        check_output(path, force=False)
    start = f"{path}: already exists; "
    assert str(caught.value) == f"{start}force=True replaces it, output=... chooses another"
    assert caught.value.at_shell == f"{start}--force replaces it, -o chooses another"
    check_output(path, force=True)


def test_unfinished_run_is_continued_rather_than_replaced(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    write_results(path, some_run(finished=False))
    with pytest.raises(ResultsFileError) as caught:
        check_output(path, force=False)
    start = f"{path}: already exists and is unfinished; "
    assert str(caught.value).startswith(f'{start}wearsim.resume("{path}") continues it, force=')
    assert caught.value.at_shell.startswith(f"{start}`wearsim resume {path}` continues it, --force")
    write_results(path, some_run(finished=True))
    with pytest.raises(ResultsFileError, match=r"already exists; force=True"):
        check_output(path, force=False)


def test_unwritable_output_is_refused_before_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ResultsFileError, match="is a folder"):
        check_output(tmp_path, force=True)
    with pytest.raises(ResultsFileError, match="there is no folder"):
        check_output(tmp_path / "no" / "run.h5", force=False)
    with pytest.raises(ResultsFileError, match="not a regular file"):
        check_output("/dev/null", force=True)
    with pytest.raises(ResultsFileError, match="cannot be written"):
        write_results(tmp_path / "no" / "run.h5", NEW)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(ResultsFileError, match="is not writable"):
        check_output(tmp_path / "run.h5", force=False)


@pytest.mark.parametrize("name", ["run.png", "run.PDF", "run.svg", "run.toml", "run.csv"])
def test_suffix_of_another_kind_of_file_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ResultsFileError, match=r"no results file ends in .*, such as run\.h5"):
        check_output(tmp_path / name, force=True)


def test_input_is_never_replaced_under_any_name(tmp_path: Path) -> None:
    log, link = tmp_path / "log.h5", tmp_path / "link.h5"
    log.write_text("precious")
    link.hardlink_to(log)
    for name in (log, link, tmp_path / "." / "log.h5", tmp_path / ".." / tmp_path.name / "log.h5"):
        with pytest.raises(ResultsFileError, match=f"the scenario is read from {log}"):
            check_output(name, force=True, inputs=[tmp_path / "a.toml", log])
    with pytest.raises(ResultsFileError, match="the scenario is read from"):
        # the output does not exist yet
        check_output(tmp_path / "b.h5", force=False, inputs=[tmp_path / "b.h5"])
    check_output(tmp_path / "other.h5", force=True, inputs=[log])
