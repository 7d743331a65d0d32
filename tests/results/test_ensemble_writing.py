"""An ensemble's file as it grows: any order, killed at any moment, one writer, many readers."""

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
ASKED = 12
FAILED = {2, 3, 9}


def _outcomes(numbers, failed=FAILED):
    return [some_outcome(n, error=f"{n} failed" if n in failed else "") for n in numbers]


def _new(path: Path, **changes: object) -> EnsembleFile:
    return EnsembleFile.create(path, some_header(ASKED, **changes), some_static())


def test_that_order_and_batches_leave_no_trace_in_the_file(tmp_path):
    contents = set()
    for seed, size in ((0, ASKED), (1, 1), (2, 3), (3, 5), (4, 2)):
        path = tmp_path / f"{seed}.h5"
        order = np.random.default_rng(seed).permutation(ASKED)
        with _new(path) as file:
            for start in range(0, ASKED, size):
                file.put(_outcomes(order[start : start + size].tolist()))
                file.put_state({"wall_seconds": float(start)})
        with EnsembleFile.open(path) as file:
            file.put_statistics(some_statistics_of(tmp_path))
        contents.add(hashlib.sha256(without_state(path)).hexdigest())
    assert len(contents) == 1


def some_statistics_of(folder: Path):
    path = folder / "shapes.h5"
    if not path.exists():
        _new(path).close()
    return some_statistics(path)


def test_that_a_failed_realisation_done_again_leaves_no_trace(tmp_path):
    once, twice = tmp_path / "once.h5", tmp_path / "twice.h5"
    with _new(once) as file:
        file.put(_outcomes(range(ASKED), failed={9}))
    with _new(twice) as file:
        file.put(_outcomes(range(ASKED)))
    with EnsembleFile.open(twice) as file:
        file.clear([3, 2])
        assert np.flatnonzero(file.status == PENDING).tolist() == [2, 3]
        file.put(_outcomes([2, 3], failed=set()))
    assert read_ensemble(twice).errors == {9: "9 failed"}
    is_same = without_state(once) == without_state(twice)
    assert is_same


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")
@pytest.mark.parametrize("extent", ["each stage", pytest.param("all", marks=pytest.mark.slow)])
def test_file_of_killed_ensemble_goes_on_bit_for_bit(tmp_path, extent):
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
    counts, is_there = set(), False
    for name, _, stage in lines:
        path = tmp_path / name
        is_there = is_there or stage == "before fsync folder" or name.startswith("rows")
        assert path.exists() == is_there
        if not is_there:
            killed.create(path)  # what the kill left behind is in nobody's way
        counts.add(_check_rows(path))
        killed.go_on(path)
        is_same = without_state(path) == whole  # pytest takes long to show how files differ
        assert is_same, name
    found = {(0, 0), (1, 1), (2, 1), (2, 0), (3, 0)}  # done and failed, as they were put
    assert counts == found if extent == "all" else {(0, 0)} < counts <= found


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


def test_that_a_state_torn_at_any_byte_leaves_the_one_before(tmp_path):
    path = tmp_path / "a.h5"
    with _new(path) as file:
        file.put_state({"wall_seconds": 1.0})
    before = path.read_bytes()
    with EnsembleFile.open(path) as file:
        file.put_state({"wall_seconds": 2.0, "finished": True})
    after = path.read_bytes()
    changed = np.flatnonzero(np.frombuffer(before, "u1") != np.frombuffer(after, "u1"))
    for at in (*changed[:20], *changed[20::9]):  # the bytes before it are new, the rest is old
        path.write_bytes(after[:at] + before[at:])
        data = read_ensemble(path)
        assert (data.wall_seconds, data.finished) == (1.0, False), at
        assert data.notes == some_header().notes
    path.write_bytes(after[: changed[5]] + before[changed[5] :])
    with EnsembleFile.open(path) as file:  # goes on over the torn one
        file.put_state({"wall_seconds": 3.0})
    assert read_ensemble(path).wall_seconds == 3.0


def test_that_a_second_writer_is_refused(tmp_path):
    path = tmp_path / "a.h5"
    busy = f"{path}: is being written by another process"
    with _new(path) as file:
        file.put(_outcomes([1]))
        for _ in range(2):  # reading it here does not let go of the lock
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


def test_that_an_ensemble_takes_the_place_of_a_file_of_another_kind(tmp_path):
    path = tmp_path / "a.h5"
    write_results(path, some_run())
    _new(path).close()
    assert read_ensemble(path).asked == ASKED


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere HDF5 waits for the lock")
def test_that_anyone_reads_a_file_while_it_is_written(tmp_path):
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
def test_that_a_full_disk_is_told_in_a_line_and_costs_no_row(tmp_path, monkeypatch, full_at):
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
def test_that_a_disk_that_is_full_indeed_is_told_in_a_line(tmp_path):
    """A limit on the size of files stands for the disk: HDF5 itself must not meet it."""
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
    told = f"wearsim.errors.ResultsFileError: {path}: cannot be written (File too large)"
    assert done.stderr.splitlines()[-1] == told
    assert "Exception ignored" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_that_a_file_that_may_not_be_written_is_told(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    _new(path).close()

    def refuse(self, *args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("wearsim.results.ensemble.writer.Path.open", refuse)
    monkeypatch.setattr("wearsim.results.ensemble.writer.kind_of", lambda path: "ensemble")
    with pytest.raises(ResultsFileError, match=r"a\.h5: cannot be written \(Permission denied\)"):
        EnsembleFile.open(path)


def _lacking(outcome):
    del outcome.observables["width"]


def _unknown(outcome):
    outcome.scalars["speed"] = 1.0


def _one_number_for_all_records(outcome):
    outcome.observables["depth"] = 1.0


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (_lacking, r"realisation 4: missing values \['width'\], unknown values \[\]"),
        (_unknown, r"realisation 4: missing values \[\], unknown values \['speed'\]"),
        (_one_number_for_all_records, r"realisation 4: depth has the shape \(\), expected \(4,\)"),
    ],
)
def test_that_an_outcome_that_does_not_fit_is_refused_before_anything_is_written(
    tmp_path, spoil, complaint
):
    path, outcome = tmp_path / "a.h5", some_outcome(4)
    spoil(outcome)
    with _new(path) as file:
        before = path.read_bytes()
        with pytest.raises(ValueError, match=complaint):
            file.put([some_outcome(0), outcome])
        assert path.read_bytes() == before


def test_that_a_realisation_is_put_once(tmp_path):
    with _new(tmp_path / "a.h5") as file:
        file.put(_outcomes([1]))
        for again in ([1], [0, 1], [5, 5]):
            with pytest.raises(ValueError, match="are there already"):
                file.put(_outcomes(again))
        for outside in (-1, ASKED):
            with pytest.raises(ValueError, match="there is no realisation"):
                file.put([replace(some_outcome(0), number=outside)])
            with pytest.raises(ValueError, match="there is no realisation"):
                file.clear([outside])
        with pytest.raises(ValueError, match="read-only"):
            file.status[0] = DONE


def test_that_profiles_beyond_those_kept_are_left_out(tmp_path, monkeypatch):
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


def test_that_a_state_that_does_not_fit_is_refused(tmp_path):
    with _new(tmp_path / "a.h5") as file:
        with pytest.raises(ValueError, match="a state has the fields"):
            file.put_state({"depth": 1.0})
        with pytest.raises(ValueError, match="does not fit"):
            file.put_state({"warnings": ["too long " * 20_000]})
        file.put_state({"statistics": {"all": [np.float64(0.1)] * 1000, "count": np.int64(3)}})
    assert read_ensemble(tmp_path / "a.h5").statistics["count"] == 3


def test_that_statistics_and_static_arrays_that_do_not_fit_are_refused(tmp_path):
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


def test_that_the_examples_put_all_there_is(tmp_path):
    """Else the tests above would pass over what they leave out."""
    outcome = some_outcome(0)
    assert outcome.observables.keys() == OBSERVABLES.keys()
    assert set(outcome.scalars) == set(SCALARS)
