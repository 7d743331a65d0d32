"""Writing of an ensemble file: any order, kills at any moment, one writer, many readers."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import killed_ensemble_writer as killed
import numpy as np
import pytest
import xarray
from ensemble_examples import (
    SCALARS,
    some_header,
    some_outcome,
    some_static,
    some_statistics,
    without_state,
)
from run_examples import some_run

from wearsim.errors import ResultsFileError
from wearsim.results import EnsembleFile, check_output, read_ensemble, write_results
from wearsim.results.ensemble.schema import DONE, OBSERVABLES, PENDING
from wearsim.results.io import atomic_write

HERE = Path(__file__).parent
COUNT = 12
FAILED = {2, 3, 9}


def _outcomes(numbers, failed=FAILED):
    return [some_outcome(n, error=f"{n} failed" if n in failed else "") for n in numbers]


def _new(path: Path, **changes: object) -> EnsembleFile:
    return EnsembleFile.create(path, some_header(COUNT, **changes), some_static())


def test_file_does_not_depend_on_order_and_batches(tmp_path):
    contents = set()
    for seed, size in ((0, COUNT), (1, 1), (2, 3), (3, 5), (4, 2)):
        path = tmp_path / f"{seed}.h5"
        order = np.random.default_rng(seed).permutation(COUNT)
        with _new(path) as file:
            for start in range(0, COUNT, size):
                file.put(_outcomes(order[start : start + size].tolist()))
                file.put_state({"wall_seconds": float(start)})
        with EnsembleFile.open(path) as file:
            file.put_statistics(_statistics_for(tmp_path))
        contents.add(hashlib.sha256(without_state(path)).hexdigest())
    assert len(contents) == 1


def _statistics_for(folder: Path):
    path = folder / "shapes.h5"
    if not path.exists():
        _new(path).close()
    return some_statistics(path)


def test_repeated_failed_realisation_gives_the_same_file(tmp_path):
    once, twice = tmp_path / "once.h5", tmp_path / "twice.h5"
    with _new(once) as file:
        file.put(_outcomes(range(COUNT), failed={9}))
    with _new(twice) as file:
        file.put(_outcomes(range(COUNT)))
    with EnsembleFile.open(twice) as file:
        file.clear([3, 2])
        assert np.flatnonzero(file.status == PENDING).tolist() == [2, 3]
        file.put(_outcomes([2, 3], failed=set()))
    assert read_ensemble(twice).errors == {9: "9 failed"}
    is_same = without_state(once) == without_state(twice)
    assert is_same


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")
@pytest.mark.parametrize("extent", ["each stage", pytest.param("all", marks=pytest.mark.slow)])
def test_killed_ensemble_is_continued_bit_for_bit(tmp_path, extent):
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, str(HERE / "killed_ensemble_writer.py"), str(tmp_path), extent],
        capture_output=True,
        text=True,
        check=True,
        env=environment | {"PYTHONPATH": str(HERE.parents[1])},
    )
    lines = [line.split(",") for line in done.stdout.splitlines()]
    assert {int(killed_by) for _, killed_by, _ in lines} == {signal.SIGKILL}
    whole = without_state(tmp_path / "whole.h5")
    counts, exists = set(), False
    for name, _, stage in lines:
        path = tmp_path / name
        exists = exists or stage == "before fsync folder" or name.startswith("rows")
        assert path.exists() == exists
        if not exists:
            killed.create(path)  # remains of the killed process do not matter
        counts.add(_check_rows(path))
        killed.continue_writing(path)
        is_same = without_state(path) == whole  # pytest takes long to show how files differ
        assert is_same, name
    expected = {(0, 0), (1, 1), (2, 1), (2, 0), (3, 0)}  # done and failed, after each operation
    assert counts == expected if extent == "all" else {(0, 0)} < counts <= expected


def _check_rows(path: Path) -> tuple[int, int]:
    """Check what a killed writer left; return how many are done and failed."""
    data = read_ensemble(path)
    assert data.wall_seconds in (0.0, 3.0)
    assert data.status[[2, 4]].tolist() == [PENDING, PENDING]
    for number in data.done.tolist():
        for name, value in killed.outcome(number, fails=False).values.items():
            assert data.variables[name][number].tobytes() == np.asarray(value).tobytes(), name
    for number in data.failed.tolist():
        assert data.errors[number] == killed.outcome(number, fails=True).error
    return len(data.done), len(data.failed)


def test_partly_written_state_leaves_the_previous_one(tmp_path):
    path = tmp_path / "a.h5"
    with _new(path) as file:
        file.put_state({"wall_seconds": 1.0})
    before = path.read_bytes()
    with EnsembleFile.open(path) as file:
        file.put_state({"wall_seconds": 2.0, "finished": True})
    after = path.read_bytes()
    changed = np.flatnonzero(np.frombuffer(before, "u1") != np.frombuffer(after, "u1"))
    for at in (*changed[:20], *changed[20::9]):  # bytes before it are new, the others old
        path.write_bytes(after[:at] + before[at:])
        data = read_ensemble(path)
        assert (data.wall_seconds, data.finished) == (1.0, False), at
        assert data.notes == some_header().notes
    path.write_bytes(after[: changed[5]] + before[changed[5] :])
    with EnsembleFile.open(path) as file:  # overwrites the damaged one
        file.put_state({"wall_seconds": 3.0})
    assert read_ensemble(path).wall_seconds == 3.0


def test_second_writer_is_refused(tmp_path):
    path = tmp_path / "a.h5"
    busy = f"{path}: is being written by another process"
    with _new(path) as file:
        file.put(_outcomes([1]))
        for _ in range(2):  # reading in this process does not release the lock
            read_ensemble(path)
            for take in (EnsembleFile.open, _new, partial(check_output, force=True)):
                with pytest.raises(ResultsFileError) as caught:
                    take(path)
                assert str(caught.value) == busy
        file.put(_outcomes([2]))
    with EnsembleFile.open(path) as file:
        assert np.flatnonzero(file.status).tolist() == [1, 2]
    _new(path).close()
    assert (read_ensemble(path).status == PENDING).all()


def test_ensemble_replaces_a_file_of_another_kind(tmp_path):
    path = tmp_path / "a.h5"
    write_results(path, some_run())
    _new(path).close()
    assert read_ensemble(path).asked == COUNT


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere HDF5 waits for the lock")
def test_file_is_readable_while_it_is_written(tmp_path):
    path = tmp_path / "a.h5"
    with _new(path) as file:
        for number in range(4):
            file.put(_outcomes([number], failed=set()))
            data = read_ensemble(path)
            assert data.done.tolist() == list(range(number + 1))
            with h5py.File(path) as plain:
                assert plain["status"][number] == DONE
            with xarray.open_dataset(path, engine="h5netcdf") as dataset:
                expected = some_outcome(number).observables["depth"]
                np.testing.assert_array_equal(dataset["depth"].values[number], expected)


@pytest.mark.parametrize("full_at", ["write", "fsync", "open", "rename"])
def test_full_disk_raises_one_line_error_and_loses_no_row(tmp_path, monkeypatch, full_at):
    path, other = tmp_path / "a.h5", tmp_path / "b.h5"

    def fill(stage: str) -> None:
        if stage == f"before {full_at}":
            raise OSError(28, "No space left on device")

    with _new(path) as file:
        file.put(_outcomes([1]))
        monkeypatch.setattr(atomic_write, "on_write_stage", fill)
        with pytest.raises(ResultsFileError) as caught:
            _new(other)
        assert str(caught.value) == f"{other}: cannot be written (No space left on device)"
        assert list(tmp_path.iterdir()) == [path]
        if full_at in {"write", "fsync"}:
            for attempt in (
                lambda: file.put(_outcomes([0, 2])),
                lambda: file.clear([1] if full_at == "write" else []),
                lambda: file.put_state({"finished": True}),
            ):
                with pytest.raises(ResultsFileError) as caught:
                    attempt()
                assert str(caught.value) == f"{path}: cannot be written (No space left on device)"
        monkeypatch.undo()
        assert np.flatnonzero(file.status).tolist() == [1]
        file.put(_outcomes([0, 2]))
    data = read_ensemble(path)
    assert np.flatnonzero(data.status).tolist() == [0, 1, 2]
    assert not data.finished


@pytest.mark.skipif(sys.platform == "win32", reason="there is no limit on the size of files")
def test_limit_on_file_size_raises_one_line_error(tmp_path):
    """A limit on the file size represents a full disk, which HDF5 itself must not meet."""
    code = (
        "import resource, sys; from pathlib import Path\n"
        "from ensemble_examples import *\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "EnsembleFile.create(Path(sys.argv[1]), some_header(), some_static())"
    )
    path = tmp_path / "a.h5"
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)],
        capture_output=True,
        text=True,
        check=False,
        cwd=HERE,
        env=os.environ | {"PYTHONPATH": str(HERE.parents[1])},
    )
    message = f"wearsim.errors.ResultsFileError: {path}: cannot be written (File too large)"
    assert done.stderr.splitlines()[-1] == message
    assert "Exception ignored" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_read_only_file_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    _new(path).close()

    def refuse(self, *args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("wearsim.results.ensemble.writer.Path.open", refuse)
    monkeypatch.setattr("wearsim.results.ensemble.writer.kind_of", lambda path: "ensemble")
    with pytest.raises(ResultsFileError, match=r"a\.h5: cannot be written \(Permission denied\)"):
        EnsembleFile.open(path)


def _incomplete(outcome):
    del outcome.observables["width"]


def _with_unknown(outcome):
    outcome.scalars["speed"] = 1.0


def _with_scalar_depth(outcome):
    outcome.observables["depth"] = 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_incomplete, r"realisation 4: missing values \['width'\], unknown values \[\]"),
        (_with_unknown, r"realisation 4: missing values \[\], unknown values \['speed'\]"),
        (_with_scalar_depth, r"realisation 4: depth has the shape \(\), expected \(4,\)"),
    ],
)
def test_inconsistent_outcome_is_refused_and_not_written(tmp_path, change, message):
    path, outcome = tmp_path / "a.h5", some_outcome(4)
    change(outcome)
    with _new(path) as file:
        before = path.read_bytes()
        with pytest.raises(ValueError, match=message):
            file.put([some_outcome(0), outcome])
        assert path.read_bytes() == before


def test_realisation_is_written_only_once(tmp_path):
    with _new(tmp_path / "a.h5") as file:
        file.put(_outcomes([1]))
        for again in ([1], [0, 1], [5, 5]):
            with pytest.raises(ValueError, match="are there already"):
                file.put(_outcomes(again))
        for outside in (-1, COUNT):
            with pytest.raises(ValueError, match="there is no realisation"):
                file.put([replace(some_outcome(0), number=outside)])
            with pytest.raises(ValueError, match="there is no realisation"):
                file.clear([outside])
        with pytest.raises(ValueError, match="read-only"):
            file.status[0] = DONE


def test_profiles_beyond_the_kept_ones_are_not_stored(tmp_path, monkeypatch):
    monkeypatch.setattr("wearsim.results.ensemble.schema.MOST_KEPT", 27)
    path = tmp_path / "a.h5"
    bare = replace(some_outcome(5), profile=None)
    with _new(path) as file:
        file.put([some_outcome(number) for number in (1, 2, 3, 4)])
        file.put([bare])
        with pytest.raises(ValueError, match=r"missing values \['depth_profile'\]"):
            file.put([replace(some_outcome(0), profile=None)])
    data = read_ensemble(path)
    assert len(data.variables["depth_profile"]) == 3
    np.testing.assert_array_equal(data.variables["depth_profile"][2], some_outcome(2).profile)
    np.testing.assert_array_equal(data.variables["depth"][4], some_outcome(4).observables["depth"])


def test_inconsistent_state_is_refused(tmp_path):
    with _new(tmp_path / "a.h5") as file:
        with pytest.raises(ValueError, match="a state has the fields"):
            file.put_state({"depth": 1.0})
        with pytest.raises(ValueError, match="does not fit"):
            file.put_state({"warnings": ["too long " * 20_000]})
        file.put_state({"statistics": {"all": [np.float64(0.1)] * 1000, "count": np.int64(3)}})
    assert read_ensemble(tmp_path / "a.h5").statistics["count"] == 3


def test_inconsistent_statistics_and_static_are_refused(tmp_path):
    path = tmp_path / "a.h5"
    with _new(path) as file:
        with pytest.raises(ValueError, match="depth is not a statistic"):
            file.put_statistics({"depth": np.zeros(4)})
        with pytest.raises(ValueError, match=r"depth_mean has the shape \(3,\), expected \(4,\)"):
            file.put_statistics({"depth_mean": np.zeros(3)})
    static = some_static()
    for broken in (static | {"record_time": np.zeros(2)}, {"y": static["y"]}):
        with pytest.raises(ValueError, match=r"record_time|static arrays"):
            EnsembleFile.create(tmp_path / "b.h5", some_header(), broken)
    assert list(tmp_path.iterdir()) == [path]


def test_examples_contain_all_variables(tmp_path):
    """Otherwise the tests above would not cover the missing variables."""
    outcome = some_outcome(0)
    assert outcome.observables.keys() == OBSERVABLES.keys()
    assert set(outcome.scalars) == set(SCALARS)
