"""A changed byte anywhere in a result file is an error or changes nothing."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from layout_files import LAYOUTS, write_all

from wearsim.errors import ResultsFileError
from wearsim.studies.dissipation.result import read_dissipation
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.run.result import read_results

Content = Callable[[Path, str], object]


def _run(path: Path, _: str) -> object:
    data = read_results(path)
    arrays = {**data.variables, **data.checkpoint}
    fixed = {name: (array.tobytes(), array.dtype) for name, array in arrays.items()}
    return data.attributes, data.scenario_text, data.files, fixed


def _study(path: Path, _: str) -> object:
    data = read_dissipation(path)
    arrays = {name: array.tobytes() for name, array in data.variables.items()}
    return data.attributes, data.scenario_text, data.files, arrays


def _ensemble(path: Path, changed: str) -> object:
    """Return some variables, among them the one that has changed: each opens the file anew."""
    data = read_ensemble(path)
    names = {"depth", "depth_profile", changed} & data.variables.keys()
    arrays = {name: data.variables[name].tobytes() for name in names}
    texts = data.attributes, data.scenario_text, data.files
    return texts, data.status.tolist(), data.errors, arrays


UNREAD = {"step", "record", "station", "roller", "realisation", "kept"}

#: name to open, suffix of the file in which a byte is changed, and expected content
CASES: dict[str, tuple[str, str, Content]] = {
    "run": ("run", "", _run),
    "dissipation": ("dissipation", "", _study),
    "ensemble": ("ensemble", "", _ensemble),
    "part": ("unfinished", ".parts/000001.h5", _ensemble),
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a file of each kind."""
    folder = tmp_path_factory.mktemp("files")
    write_all(folder)
    return folder


@pytest.fixture(params=CASES)
def case(request: pytest.FixtureRequest, files: Path, tmp_path: Path) -> tuple[Path, Path, Content]:
    name, ending, content = CASES[request.param]
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    path = tmp_path / f"{name}-{LAYOUTS[name]}.h5"
    return path, Path(f"{path}{ending}"), content


def _objects(file: h5py.File) -> Iterator[h5py.Group | h5py.Dataset]:
    found: list[h5py.Group | h5py.Dataset] = [file]
    file.visititems(lambda _, item: found.append(item))
    yield from found


def _places_of_data(path: Path) -> dict[str, list[int]]:
    """Return the positions of a middle and of the last byte of every chunk, by dataset.

    The last bytes are those of the checksum.
    """
    places: dict[str, list[int]] = {}
    with h5py.File(path) as file:
        for item in _objects(file):
            if isinstance(item, h5py.Dataset) and item.size and item.shape:
                chunks = [item.id.get_chunk_info(k) for k in range(item.id.get_num_chunks())]
                places[item.name] = [
                    chunk.byte_offset + place
                    for chunk in chunks
                    for place in (chunk.size // 2, chunk.size - 1)
                ]
    return places


def _places_of_attributes(path: Path) -> dict[str, list[int]]:
    """Return the positions of the value of every attribute and of every scalar, by name."""
    stored, places = path.read_bytes(), {}
    with h5py.File(path) as file:
        values = {
            f"{item.name} {name}": np.asarray(value)
            for item in _objects(file)
            for name, value in item.attrs.items()
            if name not in {"DIMENSION_LIST", "REFERENCE_LIST"}  # not values, but references
        }
        values |= {
            item.name: item[()]
            for item in _objects(file)
            if isinstance(item, h5py.Dataset) and not item.shape
        }
    for name, value in values.items():
        content = value.tobytes().rstrip(b"\0") or b"\0"
        start, found = 0, []
        while (at := stored.find(content, start)) >= 0 and len(found) < 20:
            found.append(at + len(content) // 2)
            start = at + 1
        assert found, name
        places[name] = found
    return places


def _refused(opened: Callable[[], object], folder: Path, before: object) -> bool:
    """Return whether a file is refused; fail if it opens with another content."""
    try:
        found = opened()
    except ResultsFileError as error:
        return str(error).startswith(str(folder))
    assert found == before
    return False


def _flip(path: Path, stored: bytes, at: int) -> None:
    path.write_bytes(stored[:at] + bytes([stored[at] ^ (1 << at % 8)]) + stored[at + 1 :])


@pytest.mark.parametrize("extent", ["one", pytest.param("all", marks=pytest.mark.slow)])
def test_changed_byte_of_a_dataset_is_an_error(case, extent):
    """Change one byte of each dataset, of data and checksum alternately, or every chosen byte."""
    path, changed, content = case
    stored, places = changed.read_bytes(), _places_of_data(changed)
    assert len(places) > 10
    for turn, (item, numbers) in enumerate(places.items()):
        name = item.removeprefix("/")
        before = content(path, name) if name in UNREAD else None  # the others are refused
        for at in numbers if extent == "all" else numbers[turn % 2 :: 2]:
            _flip(changed, stored, at)
            refused = _refused(lambda name=name: content(path, name), path.parent, before)
            # the numbers of realisations and records are for other programs
            assert refused or name in UNREAD, (name, at)
        changed.write_bytes(stored)


def _of_each_object(places: dict[str, list[int]]) -> dict[str, list[int]]:
    """Return positions of all attributes of the file and of one attribute of each dataset."""
    of_objects: dict[str, list[str]] = {}
    for name in places:
        of_objects.setdefault(name.partition(" ")[0], []).append(name)
    chosen = {names[turn % len(names)] for turn, names in enumerate(of_objects.values())}
    return {name: found for name, found in places.items() if name in {*chosen, *of_objects["/"]}}


@pytest.mark.parametrize("extent", ["one", pytest.param("all", marks=pytest.mark.slow)])
def test_changed_byte_of_an_attribute_is_an_error_or_changes_nothing(case, extent):
    """Change each attribute of the file, and one attribute or all attributes of each dataset."""
    path, changed, content = case
    stored, refused = changed.read_bytes(), 0
    places = _places_of_attributes(changed)
    places = places if extent == "all" else _of_each_object(places)
    before = content(path, "depth")
    for numbers in places.values():
        _flip(changed, stored, numbers[0])
        refused += _refused(lambda: content(path, "depth"), path.parent, before)
    assert refused >= 0.5 * len(places)


def test_changed_byte_is_an_error_in_xarray_too(files, tmp_path):
    path = tmp_path / f"run-{LAYOUTS['run']}.h5"
    shutil.copy(files / path.name, path)
    stored = path.read_bytes()
    for at in _places_of_data(path)["/cylinder_depth_profile"]:
        _flip(path, stored, at)
        with (
            xarray.open_dataset(path, engine="h5netcdf") as dataset,
            pytest.raises(OSError, match="filter returned failure"),
        ):
            dataset["cylinder_depth_profile"].load()
