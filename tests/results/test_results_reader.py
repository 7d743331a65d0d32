"""Reading of run files: round trip, xarray, and messages on missing, foreign or damaged files."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray
from hypothesis import HealthCheck, given, settings, strategies as st
from run_examples import some_run

from tests.results_compared import differences
from wearsim.errors import ResultsFileError
from wearsim.results.io.files import write_results
from wearsim.studies.run.result import read_results
from wearsim.studies.run.schema import AXES, RUN, VARIABLES

TEXT = st.text(max_size=40)
PATH = st.text(st.characters(exclude_characters="\0"), min_size=1, max_size=10)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("written") / "run.h5"
    write_results(path, some_run(seed=5))
    return path


@pytest.fixture
def run_file(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(written, tmp_path))


def _error_of(path: Path) -> str:
    with pytest.raises(ResultsFileError) as caught:
        read_results(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
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
def test_run_is_read_back_bit_for_bit(
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


def test_texts_longer_than_an_attribute_are_read_back(tmp_path: Path) -> None:
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


def test_numpy_scalars_are_stored_as_numbers(tmp_path: Path) -> None:
    data = some_run(
        total_passes=np.float64(0.1), finished=np.True_, seed=np.int64(3), tolerance=np.float32(0.5)
    )
    write_results(tmp_path / "run.h5", data)
    assert differences(data, read_results(tmp_path / "run.h5")) == []


@pytest.mark.parametrize("rollers", [1, 3])
def test_xarray_opens_run_with_named_dimensions(tmp_path: Path, rollers: int) -> None:
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


@pytest.mark.parametrize("locking", [None, True, False, "best-effort"])
@pytest.mark.parametrize("mode", ["r", "r+"])
def test_file_open_in_another_library_is_read(
    run_file: Path, mode: str, locking: bool | str | None
) -> None:
    with h5py.File(run_file, mode, locking=locking):
        assert differences(some_run(seed=5), read_results(run_file)) == []


def test_file_that_xarray_holds_open_is_read(run_file: Path) -> None:
    with xarray.open_dataset(run_file, engine="h5netcdf") as dataset:
        assert differences(some_run(seed=5), read_results(run_file)) == []
        assert dataset["depth"].size


def test_all_dimensions_have_names(run_file: Path) -> None:
    with h5netcdf.File(run_file, "r") as file:  # raises on a dimension with no name
        assert set(file.dimensions) == {*AXES, "y"}
        assert all(variable.dimensions for variable in file.variables.values())


def test_reading_leaves_the_file_unchanged(run_file: Path) -> None:
    before = run_file.read_bytes()
    run_file.chmod(0o444)
    read_results(run_file)
    assert run_file.read_bytes() == before


def test_missing_file_is_refused(tmp_path: Path) -> None:
    assert _error_of(tmp_path / "no.h5") == "there is no such file"
    assert _error_of(tmp_path) == "cannot be read (Is a directory)"


@pytest.mark.parametrize("content", [b"y [mm],z [um]\n0,1\n", b"\x89PNG\r\n\x1a\n" + bytes(99)])
def test_foreign_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "foreign.h5"
    path.write_bytes(content)
    assert _error_of(path) == "is not a results file of wearsim, not even HDF5"


def test_file_truncated_at_any_length_is_refused(run_file: Path) -> None:
    content = run_file.read_bytes()
    size = len(content)
    run_file.write_bytes(b"")
    assert _error_of(run_file) == "is empty"
    near = {1, 7, 8, 9, 47, 48, 95, 96, 97, 511, 512, 513, 2048, size - 4096, size - 8, size - 1}
    for length in sorted(near | set(range(100, size, size // 40))):
        run_file.write_bytes(content[:length])
        assert _error_of(run_file).startswith("is truncated"), length


def test_hdf5_of_another_program_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.h5"
    with h5py.File(path, "w") as file:
        file["depth"] = [1.0]
    assert _error_of(path) == "is HDF5, but not a results file of wearsim"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = [1, 2]
    assert _error_of(path) == "is HDF5, but not a results file of wearsim"


def _newer(file: h5py.File) -> None:
    file.attrs["format_version"] = RUN.version + 1
    del file["depth"]


def _older(file: h5py.File) -> None:
    file.attrs["format_version"] = RUN.version - 1


def _incomplete(file: h5py.File) -> None:
    del file["depth"], file["checkpoint"], file["inputs/about"]


def _with_wrong_shape(file: h5py.File) -> None:
    del file["depth"]
    file["depth"] = np.zeros((2, 1))


def _with_about(text: str) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file["inputs/about"]
        file["inputs"].create_dataset("about", data=[np.bytes_(text + " ")])

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            _newer,
            (
                f"has layout {RUN.version + 1} of wearsim-run, and this wearsim reads layout"
                f" {RUN.version}; update wearsim to"
                " read it"
            ),
        ),
        (
            _older,
            (
                f"has layout {RUN.version - 1} of wearsim-run, and this wearsim reads layout"
                f" {RUN.version}; repeat the"
                " computation, or read it with the version of wearsim that wrote it"
            ),
        ),
        (_incomplete, "is damaged (lacks depth, inputs/about, checkpoint)"),
        (_with_wrong_shape, "is damaged (depth has 2 along step, others have 5)"),
        (_with_about("{"), "is damaged (Expecting property name"),
        (_with_about("[]"), "is damaged (lacks scenario_file, title"),
    ],
)
def test_altered_file_is_refused(
    run_file: Path, change: Callable[[h5py.File], None], message: str
) -> None:
    with h5py.File(run_file, "r+") as file:
        change(file)
    assert _error_of(run_file).startswith(message)


def test_results_package_imports_without_h5py() -> None:
    code = "import sys, wearsim.results; sys.exit('h5py' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
