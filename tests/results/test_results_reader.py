"""Reading: every bit back, by us and by xarray; and every way a file can be wrong."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from run_examples import some_run

from wearsim.errors import ResultsFileError
from wearsim.results import read_results, write_results
from wearsim.results.run.data import differences
from wearsim.results.run.schema import AXES, VARIABLES

TEXT = st.text(max_size=40)
PATH = st.text(st.characters(exclude_characters="\0"), min_size=1, max_size=10)


@pytest.fixture
def run_file(tmp_path: Path) -> Path:
    path = tmp_path / "run.h5"
    write_results(path, some_run(seed=5))
    return path


def _complaint(path: Path) -> str:
    with pytest.raises(ResultsFileError) as caught:
        read_results(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    lengths=st.fixed_dictionaries(
        {
            name: st.integers(0 if name in {"steps", "records"} else 1, 3)
            for name in ("seed", "steps", "records", "stations", "rollers", "realisations")
        }
    ),
    texts=st.fixed_dictionaries({"scenario_text": TEXT, "title": TEXT, "scenario_file": TEXT}),
    files=st.dictionaries(PATH, TEXT, max_size=12),
    lists=st.fixed_dictionaries({"notes": st.lists(TEXT), "warnings": st.lists(TEXT)}),
    numbers=st.fixed_dictionaries(
        {"tolerance": st.floats(allow_nan=False), "finished": st.booleans()}
    ),
)
def test_that_every_bit_comes_back(
    tmp_path: Path,
    lengths: dict[str, int],
    texts: dict[str, str],
    files: dict[str, str],
    lists: dict[str, list[str]],
    numbers: dict[str, float],
) -> None:
    data = some_run(**lengths, **texts, files=files, **lists, **numbers)  # type: ignore[arg-type]
    path = tmp_path / "run.h5"
    write_results(path, data)
    found = read_results(path)
    assert differences(data, found) == []
    assert list(found.files) == list(data.files)


def test_that_texts_beyond_the_limit_of_an_attribute_come_back(tmp_path: Path) -> None:
    long = "0,300\n" * 50_000
    data = some_run(
        scenario_text=long,
        title=long,
        scenario_file=long,
        notes=[long],
        files={"load.csv": long, "../../profile.csv": "", "c": "\0", "d": "lone \ud800 half"},
    )
    write_results(tmp_path / "run.h5", data)
    assert differences(data, read_results(tmp_path / "run.h5")) == []


def test_that_numpy_numbers_may_stand_for_plain_ones(tmp_path: Path) -> None:
    data = some_run(
        total_passes=np.float64(0.1), finished=np.True_, seed=np.int64(3), tolerance=np.float32(0.5)
    )
    write_results(tmp_path / "run.h5", data)
    assert differences(data, read_results(tmp_path / "run.h5")) == []


@pytest.mark.parametrize("rollers", [1, 3])
def test_that_xarray_opens_a_file_with_named_dimensions(tmp_path: Path, rollers: int) -> None:
    path = tmp_path / "run.h5"
    data = some_run(rollers=rollers, realisations=2)
    write_results(path, data)
    with xarray.open_dataset(path, engine="h5netcdf") as dataset:
        assert set(dataset.sizes) == {*AXES, "y"}
        assert set(dataset.variables) == {*VARIABLES, *AXES}
        for name, variable in VARIABLES.items():
            found = dataset[name]
            assert found.dims == variable.dims
            assert found.attrs == {"units": variable.unit, "long_name": variable.long_name}
            np.testing.assert_array_equal(found.values, data.variables[name])
        assert dataset["step"].values.tolist() == [0, 1, 2, 3, 4]
        assert dataset["roller"].values.tolist() == list(range(1, rollers + 1))
        assert all({"units", "long_name"} <= set(found.attrs) for found in dataset.values())
        assert dataset.attrs["format"] == "wearsim-run"
        assert dataset.attrs["title"] == "a rig"


def test_that_no_dimension_is_phony(run_file: Path) -> None:
    with h5netcdf.File(run_file, "r") as file:  # raises on a dimension with no name
        assert set(file.dimensions) == {*AXES, "y"}
        assert all(variable.dimensions for variable in file.variables.values())


def test_that_reading_a_file_changes_nothing(run_file: Path) -> None:
    before = run_file.read_bytes()
    run_file.chmod(0o444)
    read_results(run_file)
    assert run_file.read_bytes() == before


def test_that_a_missing_file_is_told(tmp_path: Path) -> None:
    assert _complaint(tmp_path / "no.h5") == "there is no such file"
    assert _complaint(tmp_path) == "cannot be read (Is a directory)"


@pytest.mark.parametrize("content", [b"y [mm],z [um]\n0,1\n", b"\x89PNG\r\n\x1a\n" + bytes(99)])
def test_that_a_foreign_file_is_told(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "foreign.h5"
    path.write_bytes(content)
    assert _complaint(path) == "is not a results file of wearsim, not even HDF5"


def test_that_a_truncated_file_is_told_at_any_length(run_file: Path) -> None:
    content = run_file.read_bytes()
    size = len(content)
    run_file.write_bytes(b"")
    assert _complaint(run_file) == "is empty"
    near = {1, 7, 8, 9, 47, 48, 95, 96, 97, 511, 512, 513, 2048, size - 4096, size - 8, size - 1}
    for length in sorted(near | set(range(100, size, size // 40))):
        run_file.write_bytes(content[:length])
        assert _complaint(run_file).startswith("is truncated"), length


def test_that_hdf5_of_another_kind_is_told(tmp_path: Path) -> None:
    path = tmp_path / "other.h5"
    with h5py.File(path, "w") as file:
        file["depth"] = [1.0]
    assert _complaint(path) == "is HDF5, but not a results file of wearsim"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = [1, 2]
    assert _complaint(path) == "is HDF5, but not a results file of wearsim"


def _newer(file: h5py.File) -> None:
    file.attrs["format_version"] = 2
    del file["depth"]


def _lacking(file: h5py.File) -> None:
    del file["depth"], file["checkpoint"], file["inputs/about"]


def _of_wrong_shape(file: h5py.File) -> None:
    del file["depth"]
    file["depth"] = np.zeros((2, 1))


def _about(text: str) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file["inputs/about"]
        file["inputs"].create_dataset("about", data=np.bytes_(text + " "))

    return change


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (_newer, "was written by a newer wearsim (format 2, this one reads up to 1)"),
        (_lacking, "is damaged (lacks depth, inputs/about, checkpoint)"),
        (_of_wrong_shape, "is damaged (depth has 2 along step, others have 5)"),
        (_about("{"), "is damaged (Expecting property name"),
        (_about("[]"), "is damaged (lacks scenario_file, title"),
    ],
)
def test_that_a_file_that_is_not_as_written_is_told(
    run_file: Path, change: Callable[[h5py.File], None], complaint: str
) -> None:
    with h5py.File(run_file, "r+") as file:
        change(file)
    assert _complaint(run_file).startswith(complaint)


def test_that_the_results_room_loads_without_hdf5() -> None:
    code = "import sys, wearsim.results; sys.exit('h5py' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
