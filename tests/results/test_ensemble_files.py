"""The file of an ensemble: round trip, xarray, refused files, use of memory and disk."""

from __future__ import annotations

import shutil
import tracemalloc
from dataclasses import fields
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from ensemble_examples import (
    RECORDS,
    ROLLERS,
    SCALARS,
    STRIPS,
    some_header,
    some_outcome,
    some_static,
    some_statistics,
)
from run_examples import some_run
from test_dissipation_files import some_study

from wearsim.errors import ResultsFileError
from wearsim.results.io import files
from wearsim.results.io.files import write_results
from wearsim.studies.dissipation.result import read_dissipation
from wearsim.studies.ensemble.file.data import EnsembleData
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.ensemble.file.schema import (
    DONE,
    ENSEMBLE,
    FAILED,
    OBSERVABLES,
    PENDING,
    QUANTILES,
)
from wearsim.studies.ensemble.file.writer import EnsembleFile
from wearsim.studies.opening import kind_of
from wearsim.studies.run.result import read_results

ERROR = "lost contact at 1.2e6 passes: µ = 0.3"


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with an ensemble, of which realisations 0 to 3 and 17 are done, 5 failed."""
    folder = tmp_path_factory.mktemp("parts")
    path = folder / "ensemble.h5"
    with EnsembleFile.create(path, some_header(), some_static()) as file:
        file.put([some_outcome(number) for number in (2, 0, 1)])
        file.put([some_outcome(5, error=ERROR), some_outcome(17), some_outcome(3)])
        file.put_state(wall_seconds=2.5, warnings=["slow"], statistics={"a": [1.5]})
    return folder


@pytest.fixture(scope="module")
def merged(parts: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the same ensemble, merged."""
    folder = tmp_path_factory.mktemp("merged")
    path = copied(parts, folder)
    with EnsembleFile.open(path) as file:
        file.finish(lambda data: ({"finished": False}, {}))
    assert list(Path(f"{path}.parts").iterdir()) == []
    return folder


def copied(folder: Path, to: Path) -> Path:
    """Copy the ensemble of a folder to another one, and return its file there."""
    shutil.copytree(folder, to, dirs_exist_ok=True)
    return to / "ensemble.h5"


@pytest.fixture
def ensemble_file(parts: Path, tmp_path: Path) -> Path:
    """A copy of the ensemble in parts."""
    return copied(parts, tmp_path)


@pytest.fixture(params=["parts", "merged"])
def any_file(request, tmp_path: Path) -> Path:
    """A copy of the ensemble, in parts or merged."""
    return copied(request.getfixturevalue(request.param), tmp_path)


def _error_of(path: Path) -> str:
    with pytest.raises(ResultsFileError) as caught:
        read_ensemble(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text.removeprefix(f"{path}: ")


def test_ensemble_is_read_back_bit_for_bit(any_file):
    data, header = read_ensemble(any_file), some_header()
    changed = {"wall_seconds": 2.5, "warnings": ["slow"], "statistics": {"a": [1.5]}}
    for item in fields(EnsembleData):
        if item.name not in {"variables", "status", "errors", "run_id", "merged"}:
            expected = changed.get(item.name, getattr(header, item.name))
            assert getattr(data, item.name) == expected, item.name
    assert data.errors == {5: ERROR}
    assert data.done.tolist() == [0, 1, 2, 3, 17]
    assert data.failed.tolist() == [5]
    for name, array in some_static().items():
        assert data.variables[name].tobytes() == array.tobytes(), name
    for number in data.done:
        for name, value in some_outcome(number).values.items():
            assert data.variables[name][number].tobytes() == np.asarray(value).tobytes(), name


def test_rows_of_failed_realisations_keep_only_drawn_values(any_file):
    variables = read_ensemble(any_file).variables
    for name, value in some_outcome(5, error=ERROR).values.items():
        assert variables[name][5].tobytes() == np.asarray(value).tobytes()
    for name in (*OBSERVABLES, *SCALARS, "depth_profile"):
        assert np.isnan(variables[name][5]).all(), name


def test_column_is_one_record_of_every_realisation(any_file):
    data = read_ensemble(any_file)
    depth = data.variables["depth"]
    for record in (0, RECORDS - 1, -1):
        np.testing.assert_array_equal(data.column("depth", record), depth[:, record])
    np.testing.assert_array_equal(data.variables.rows("depth", 3, 6), depth[3:6])


def test_long_error_is_cut_between_two_characters(tmp_path):
    path = tmp_path / "ensemble.h5"
    long, surrogate = "x" + "µ" * 300, "half \ud800"
    with EnsembleFile.create(path, some_header(), some_static()) as file:
        file.put([some_outcome(1, error=long), some_outcome(2, error=surrogate)])
    errors = read_ensemble(path).errors
    assert errors[1].endswith("µ…")
    assert long.startswith(errors[1].removesuffix("…"))
    assert 397 <= len(errors[1].encode()) <= 399
    assert errors[2] == "half ?"


def test_control_variate_is_stored_as_a_variable(tmp_path):
    path, control = tmp_path / "ensemble.h5", {"mean": 1.5, "std": 0.1, "draws": 1000000}
    outcome = some_outcome(0)
    outcome.values["control"] = 1.25
    with EnsembleFile.create(path, some_header(control=control), some_static()) as file:
        file.put([outcome])
    data = read_ensemble(path)
    assert data.control == control
    assert data.variables["control"][0] == 1.25


def test_xarray_opens_ensemble_with_dimensions_and_units(ensemble_file):
    statistics = some_statistics(read_ensemble(ensemble_file))
    with EnsembleFile.open(ensemble_file) as file:
        file.finish(lambda data: ({"finished": True}, statistics))
    with xarray.open_dataset(ensemble_file, engine="h5netcdf") as dataset:
        assert dataset.sizes == {
            "realisation": 20,
            "record": RECORDS,
            "roller": ROLLERS,
            "y": STRIPS,
            "kept": 20,
            "quantile": len(QUANTILES),
        }
        assert tuple(dataset["quantile"].values) == QUANTILES
        assert dataset["depth"].dims == ("realisation", "record")
        assert dataset["depth"].attrs["units"] == "m"
        assert dataset["creepage.yaw"].dims == ("realisation", "roller")
        assert dataset["depth_quantiles"].dims == ("quantile", "record")
        assert dataset["depth_quantiles"].attrs["units"] == "m"
        assert dataset["realisation"].values[0] == 0
        assert dataset["record"].values[0] == 0
        assert dataset["error"].values[5].decode() == ERROR
        assert dataset["status"].values[:7].tolist() == [DONE] * 4 + [PENDING, FAILED, PENDING]
        assert all({"units", "long_name"} <= set(found.attrs) for found in dataset.values())
        assert dataset.attrs["format"] == "wearsim-ensemble"
        assert dataset.attrs["finished"] == 1
        for name, array in statistics.items():
            np.testing.assert_array_equal(dataset[name].values, array)


def test_statistics_are_nan_before_they_are_written(any_file):
    variables = read_ensemble(any_file).variables
    assert np.isnan(variables["width_quantiles"]).all()
    assert np.isnan(variables["depth_profile_low"]).all()


def test_kinds_of_files_are_distinguished(ensemble_file, tmp_path):
    run, study = tmp_path / "run.h5", tmp_path / "study.h5"
    write_results(run, some_run())
    write_results(study, some_study())
    assert [kind_of(path).name for path in (run, study, ensemble_file)] == [
        "run",
        "dissipation",
        "ensemble",
    ]
    for read, needed in ((read_results, "a wear test"), (read_dissipation, "realisations of one")):
        with pytest.raises(ResultsFileError) as caught:
            read(ensemble_file)
        assert str(caught.value).startswith(
            f"{ensemble_file}: holds an ensemble of wear tests, from `wearsim ensemble`; what is"
            f" needed is {needed}"
        )
    assert _error_of(run).startswith("holds a wear test, from `wearsim run`; what is needed is an")
    with pytest.raises(ResultsFileError, match="holds a wear test"):
        EnsembleFile.open(run)


def test_missing_and_foreign_files_are_refused(tmp_path):
    path = tmp_path / "a.h5"
    assert _error_of(path) == "there is no such file"
    path.write_bytes(b"y [mm],z [um]\n0,1\n" * 99)
    assert _error_of(path) == "is not a results file of wearsim, not even HDF5"


def test_ensemble_truncated_at_any_length_is_refused(ensemble_file):
    content = ensemble_file.read_bytes()
    size = len(content)
    near = {1, 95, 96, 97, 2048, size - 4096, size - 8, size - 1}
    for length in sorted(near | set(range(100, size, size // 40))):
        ensemble_file.write_bytes(content[:length])
        assert _error_of(ensemble_file).startswith("is truncated"), length


def _newer(file: h5py.File) -> None:
    file.attrs["format_version"] = ENSEMBLE.version + 1


def _incomplete(file: h5py.File) -> None:
    del file["depth"], file["inputs/about"]


def _without_drawn_values(file: h5py.File) -> None:
    del file["creepage.yaw"]


def _with_wrong_shape(file: h5py.File) -> None:
    del file["depth"]
    file["depth"] = np.zeros((20, 1))


def _with_wrong_type(file: h5py.File) -> None:
    del file["depth"]
    file["depth"] = np.zeros((20, RECORDS), np.float32)


def _with_unknown_status(file: h5py.File) -> None:
    file["status"][7] = 9


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            _newer,
            (
                f"has layout {ENSEMBLE.version + 1} of wearsim-ensemble, and this wearsim reads"
                f" layout {ENSEMBLE.version}; update wearsim"
            ),
        ),
        (_incomplete, "is damaged (lacks depth, inputs/about)"),
        (_without_drawn_values, "is damaged (lacks creepage.yaw)"),
        (_with_wrong_shape, "is damaged (depth has 1 along record, others have 4)"),
        (_with_wrong_type, "is damaged (depth is stored as float32)"),
        (_with_unknown_status, "is damaged (a realisation has the status 9)"),
    ],
)
def test_altered_ensemble_is_refused(ensemble_file, change, message):
    with h5py.File(ensemble_file, "r+") as file:
        change(file)
    assert _error_of(ensemble_file).startswith(message)
    before = ensemble_file.read_bytes()
    with pytest.raises(ResultsFileError):
        EnsembleFile.open(ensemble_file)
    assert ensemble_file.read_bytes() == before


def test_file_changed_after_opening_is_refused(any_file, tmp_path):
    data = read_ensemble(any_file)
    other = tmp_path / "other.h5"
    EnsembleFile.create(other, some_header(), some_static()).close()
    content = any_file.read_bytes()
    any_file.write_bytes(content[:1000])
    with pytest.raises(ResultsFileError, match="is truncated"):
        data.variables["depth"]
    other.replace(any_file)
    with pytest.raises(ResultsFileError, match="was replaced by another"):
        data.column("depth", -1)
    any_file.unlink()
    with pytest.raises(ResultsFileError, match="there is no such file"):
        data.variables["depth"]


def test_small_variables_of_an_unchanged_file_are_read_once(any_file, monkeypatch):
    opened = []

    def counted(path, take):
        opened.append(path)
        return files.read_file(path, take)

    expected = read_ensemble(any_file).variables["depth"]
    monkeypatch.setattr("wearsim.studies.ensemble.file.parts.read_file", counted)
    data = read_ensemble(any_file)
    first = data.variables["depth"]
    assert opened.count(any_file) == 1  # for its content with its small variables
    first[:] = -1.0  # an array that is returned belongs to the caller
    np.testing.assert_array_equal(data.variables["depth"], expected)
    np.testing.assert_array_equal(data.column("depth", -1), expected[:, -1])
    np.testing.assert_array_equal(data.rows("depth", 2, 4), expected[2:4])
    assert data.variables["y"].size > 0
    assert opened.count(any_file) == 1
    any_file.touch()
    np.testing.assert_array_equal(data.variables["depth"], expected)
    assert opened.count(any_file) == 2


def test_pending_realisations_take_no_memory_and_no_disk(tmp_path):
    path, million = tmp_path / "ensemble.h5", 10**6
    header, static = some_header(million), some_static(500)
    EnsembleFile.create(tmp_path / "small.h5", some_header(10), static).close()  # loads h5py
    tracemalloc.start()
    with EnsembleFile.create(path, header, static) as file:
        file.put([some_outcome(number, 500) for number in (3, million - 1)])
    data = read_ensemble(path)
    depth = data.column("depth", 1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    numbers = million * len(OBSERVABLES) * RECORDS
    assert peak < 0.1 * 8 * numbers  # mostly the numbers of the realisations
    stored = sum(item.stat().st_blocks * 512 for item in tmp_path.rglob("*"))
    assert stored < 0.1 * 8 * numbers
    assert data.done.tolist() == [3, million - 1]
    for number in data.done:
        assert depth[number] == some_outcome(number, 500).values["depth"][1]
    assert len(data.variables["depth_profile"]) == 4_000_000 // 500
