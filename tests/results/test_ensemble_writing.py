"""Writing of an ensemble file: any order, kills at any moment, one writer, many readers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import h5py
import killed_ensemble_writer as killed
import numpy as np
import pytest
import xarray
from ensemble_examples import (
    SCALARS,
    contents,
    differences,
    finish,
    some_header,
    some_outcome,
    some_static,
    some_statistics,
)
from run_examples import some_run

from tests.faulty_storage import full_disk
from wearsim.atomic_write import DISK
from wearsim.errors import ResultsFileError
from wearsim.results.io.files import write_results
from wearsim.results.io.outputs import check_output
from wearsim.studies.ensemble.file import writer
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.ensemble.file.schema import DONE, OBSERVABLES, PENDING
from wearsim.studies.ensemble.file.writer import EnsembleFile

HERE = Path(__file__).parent
COUNT = 12
FAILED = {2, 3, 9}


def _outcomes(numbers, failed=FAILED):
    return [some_outcome(n, error=f"{n} failed" if n in failed else "") for n in numbers]


def _new(path: Path, storage=DISK, **changes: object) -> EnsembleFile:
    return EnsembleFile.create(path, some_header(COUNT, **changes), some_static(), storage)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the content of an ensemble that is written at once, in the order of its numbers."""
    path = tmp_path_factory.mktemp("whole") / "whole.h5"
    with _new(path) as file:
        file.put(_outcomes(range(COUNT)))
        finish(file)
    return contents(path)


QUICK = {(1, COUNT), (1, 5), (5000, 1), (5000, 3), (1 << 21, 2)}
"""Sizes of parts and batches that are tested quickly: each size of either occurs."""


@pytest.mark.parametrize(
    ("part_bytes", "size"),
    [
        pytest.param(*sizes, marks=[] if sizes in QUICK else pytest.mark.slow)
        for sizes in product((1, 5000, 1 << 21), (COUNT, 1, 3, 5, 2))
    ],
)
def test_content_does_not_depend_on_order_batches_and_parts(
    tmp_path, monkeypatch, whole, part_bytes, size
):
    monkeypatch.setattr(writer, "PART_BYTES", part_bytes)
    path = tmp_path / "a.h5"
    order = np.random.default_rng(size).permutation(COUNT)
    with _new(path) as file:
        for start in range(0, COUNT, size):
            file.put(_outcomes(order[start : start + size].tolist()))
            file.put_state(wall_seconds=float(start))
    with EnsembleFile.open(path) as file:
        finish(file)
    assert differences(path, whole) == []
    assert not Path(f"{path}.parts").exists()


def test_repeated_failed_realisation_gives_the_same_file(tmp_path):
    once, twice, merged = (tmp_path / f"{name}.h5" for name in ("once", "twice", "merged"))
    with _new(once) as file:
        file.put(_outcomes(range(COUNT), failed={9}))
        finish(file)
    for path in (twice, merged):
        with _new(path) as file:
            file.put(_outcomes(range(COUNT)))
            if path == merged:
                finish(file)
        with EnsembleFile.open(path) as file:
            file.clear([3, 2])
            assert np.flatnonzero(file.status == PENDING).tolist() == [2, 3]
            assert not read_ensemble(path).finished
            file.put(_outcomes([2, 3], failed=set()))
            assert read_ensemble(path).errors == {9: "9 failed"}
            finish(file)
        assert read_ensemble(path).errors == {9: "9 failed"}
        assert differences(once, path) == []


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
    assert "before remove" in {stage for _, _, stage in lines}
    whole, fresh = (contents(tmp_path / f"{name}.h5") for name in ("whole", "fresh"))
    counts, exists = set(), False
    for name, _, stage in lines:
        path = tmp_path / name
        exists = exists or stage == "before fsync folder" or not name.startswith("create")
        assert path.exists() == exists
        if not exists:
            killed.create(path)  # remains of the killed process do not matter
            assert differences(path, fresh) == [], name
            if extent != "all":  # what follows is as from a new ensemble
                assert list(tmp_path.glob(f"{name}.*")) == [tmp_path / f"{name}.parts"]
                continue
        if name.startswith("merge"):
            data = read_ensemble(path)
            assert len(data.done) == killed.COUNT  # finished or not, with or without parts
        else:
            counts.add(_check_rows(path))
        killed.complete(path)
        assert differences(path, whole) == [], name
        assert not list(tmp_path.glob(f"{name}.*"))
    expected = {(0, 0), (2, 1), (2, 0), (3, 0)}  # done and failed, after each operation
    assert counts == expected if extent == "all" else {(0, 0)} < counts <= expected


def _check_rows(path: Path) -> tuple[int, int]:
    """Check what a killed writer left; return how many are done and failed."""
    data = read_ensemble(path)
    assert data.wall_seconds in (0.0, 3.0)
    assert data.status[[2, 4]].tolist() == [PENDING, PENDING]
    done = {number: killed.outcome(number, fails=False).values for number in data.done.tolist()}
    for name in next(iter(done.values()), {}):
        stored = data.variables[name]
        for number, values in done.items():
            assert stored[number].tobytes() == np.asarray(values[name]).tobytes(), name
    for number in data.failed.tolist():
        assert data.errors[number] == killed.outcome(number, fails=True).error
    return len(data.done), len(data.failed)


def test_second_writer_is_refused(tmp_path):
    path = tmp_path / "a.h5"
    busy = f"{path}: is being written by another process; wait until it ends, or stop it"
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
    assert read_ensemble(path).requested == COUNT


@pytest.mark.parametrize("stage", ["open", "rename", "fsync folder"])
def test_replaced_ensemble_is_whole_before_and_after(tmp_path, stage):
    path = tmp_path / "a.h5"
    with _new(path) as file:
        file.put(_outcomes([1, 2]))
    with pytest.raises(ResultsFileError, match="cannot be written"):
        _new(path, storage=full_disk(stage), title="another")
    data = read_ensemble(path)
    replaced = stage == "fsync folder"
    assert data.title == ("another" if replaced else some_header().title)
    assert np.flatnonzero(data.status).tolist() == ([] if replaced else [1, 2])
    with EnsembleFile.open(path) as file:
        file.put(_outcomes([0]))
    assert np.flatnonzero(read_ensemble(path).status).tolist() == ([0] if replaced else [0, 1, 2])


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere HDF5 waits for the lock")
def test_ensemble_is_readable_while_it_is_written(tmp_path):
    path = tmp_path / "a.h5"
    with _new(path) as file:
        for number in range(2):
            file.put(_outcomes([number], failed=set()))
            data = read_ensemble(path)
            assert data.done.tolist() == list(range(number + 1))
            with h5py.File(f"{path}.parts/000001.h5") as plain:
                assert plain["status"][number] == DONE
                expected = some_outcome(number).values["depth"]
                np.testing.assert_array_equal(plain["depth"][number], expected)
            with xarray.open_dataset(path, engine="h5netcdf") as dataset:
                assert np.isnan(dataset["depth"].values).all()
        finish(file)
        assert read_ensemble(path).done.tolist() == [0, 1]


@pytest.mark.parametrize("full_at", ["write", "fsync", "open", "rename"])
def test_full_disk_raises_one_line_error_and_loses_no_row(tmp_path, full_at):
    path, other = tmp_path / "a.h5", tmp_path / "b.h5"
    with pytest.raises(ResultsFileError) as caught:
        _new(other, full_disk(full_at))
    assert str(caught.value) == f"{other}: cannot be written (No space left on device)"
    assert list(tmp_path.iterdir()) == []
    with _new(path) as file:
        file.put(_outcomes([1]))
    with EnsembleFile.open(path, full_disk(full_at)) as file:
        for attempt in (
            lambda: file.put(_outcomes([0, 2])),
            lambda: file.clear([1]),
            lambda: file.put_state(wall_seconds=2.0),
            lambda: finish(file),
            lambda: file.grow(2 * COUNT),
        ):
            with pytest.raises(ResultsFileError) as caught:
                attempt()
            assert str(caught.value).startswith(f"{path}")
            assert str(caught.value).endswith(": cannot be written (No space left on device)")
        assert np.flatnonzero(file.status).tolist() == [1]
    assert np.flatnonzero(read_ensemble(path).status).tolist() == [1]
    with EnsembleFile.open(path) as file:
        file.put(_outcomes([0, 2]))
        data = read_ensemble(path)
        assert np.flatnonzero(data.status).tolist() == [0, 1, 2]
        assert not data.finished
        finish(file)
    assert np.flatnonzero(read_ensemble(path).status).tolist() == [0, 1, 2]


@pytest.mark.skipif(sys.platform == "win32", reason="there is no limit on the size of files")
@pytest.mark.parametrize(
    ("limit", "work"),
    [
        (20_000, "EnsembleFile.create(path, some_header(), some_static())"),
        (80_000, "file = EnsembleFile.open(path); finish(file)"),
    ],
)
def test_limit_on_file_size_raises_one_line_error(tmp_path, limit, work):
    """A limit on the file size represents a full disk, which HDF5 itself must not meet."""
    code = (
        "import resource, sys; from pathlib import Path\n"
        "from ensemble_examples import *\n"
        "path = Path(sys.argv[1])\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))\n{work}"
    )
    path = tmp_path / "a.h5"
    if "open" in work:
        with EnsembleFile.create(path, some_header(1000), some_static()) as file:
            file.put(_outcomes(range(20)))
            file.put(_outcomes([999]))
    before = sorted(tmp_path.rglob("*"))
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
    assert done.returncode == 1  # HDF5 has closed the file, else it crashes at the end
    assert "Exception ignored" not in done.stderr
    assert [item for item in sorted(tmp_path.rglob("*")) if item.suffix != ".lock"] == before


def test_folder_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    _new(path).close()

    def refuse(self, *args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("wearsim.studies.ensemble.file.writer.Path.mkdir", refuse)
    with pytest.raises(ResultsFileError, match=r"a\.h5: cannot be written \(Permission denied\)"):
        EnsembleFile.open(path)


def _incomplete(outcome):
    del outcome.values["width"]


def _with_unknown(outcome):
    outcome.values["speed"] = 1.0


def _with_scalar_depth(outcome):
    outcome.values["depth"] = 1.0


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
        with pytest.raises(ValueError, match=message):
            file.put([some_outcome(0), outcome])
        assert (read_ensemble(path).status == PENDING).all()


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
    monkeypatch.setattr("wearsim.studies.ensemble.file.schema.MOST_KEPT", 27)
    path = tmp_path / "a.h5"
    bare, first = some_outcome(5), some_outcome(0)
    for outcome in (bare, first):
        del outcome.values["depth_profile"]
    with _new(path) as file:
        file.put([some_outcome(number) for number in (1, 2, 3, 4)])
        file.put([bare])
        with pytest.raises(ValueError, match=r"missing values \['depth_profile'\]"):
            file.put([first])
    data = read_ensemble(path)
    assert len(data.variables["depth_profile"]) == 3
    np.testing.assert_array_equal(
        data.variables["depth_profile"][2], some_outcome(2).values["depth_profile"]
    )
    np.testing.assert_array_equal(data.variables["depth"][4], some_outcome(4).values["depth"])


def test_unknown_field_is_refused(tmp_path):
    with _new(tmp_path / "a.h5") as file:
        with pytest.raises(ValueError, match="has no fields"):
            file.put_state(depth=1.0)
        file.put_state(statistics={"all": [np.float64(0.1)] * 1000, "count": np.int64(3)})
    assert read_ensemble(tmp_path / "a.h5").statistics["count"] == 3


def test_inconsistent_statistics_and_static_are_refused(tmp_path):
    path = tmp_path / "a.h5"
    with _new(path) as file:
        for wrong, message in (
            ({"depth": np.zeros(4)}, "depth is not a statistic"),
            ({"depth_mean": np.zeros(3)}, r"depth_mean has the shape \(3,\), expected \(4,\)"),
        ):
            with pytest.raises(ValueError, match=message):
                file.finish(lambda data, wrong=wrong: ({}, wrong))
        assert some_statistics(file.data).keys() > {"depth_mean"}
    static = some_static()
    before = sorted(tmp_path.iterdir())
    for broken in (static | {"record_time": np.zeros(2)}, {"y": static["y"]}):
        with pytest.raises(ValueError, match=r"record_time|static arrays"):
            EnsembleFile.create(tmp_path / "b.h5", some_header(), broken)
    assert sorted(tmp_path.iterdir()) == before


def test_examples_contain_all_variables(tmp_path):
    """Otherwise the tests above would not cover the missing variables."""
    outcome = some_outcome(0)
    drawn = {item["key"] for item in some_header().inputs}
    assert outcome.values.keys() == {*drawn, *OBSERVABLES, *SCALARS, "depth_profile"}
