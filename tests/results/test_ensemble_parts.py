"""Part files of an ensemble: copies, missing and foreign parts, merging, growth."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from ensemble_examples import differences, finish, some_header, some_outcome, some_static

from wearsim.errors import ResultsFileError
from wearsim.studies.ensemble.file import writer
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.ensemble.file.schema import DONE, PENDING
from wearsim.studies.ensemble.file.writer import EnsembleFile

COUNT = 12


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with three parts of two realisations each."""
    folder = tmp_path_factory.mktemp("written")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "PART_BYTES", 1)
        with EnsembleFile.create(folder / "rig.h5", some_header(COUNT), some_static()) as file:
            for first in (4, 0, 2):
                file.put([some_outcome(first), some_outcome(first + 1)])
    return folder


@pytest.fixture
def in_parts(written: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the three parts."""
    monkeypatch.setattr(writer, "PART_BYTES", 1)
    shutil.copytree(written, tmp_path, dirs_exist_ok=True)
    return tmp_path / "rig.h5"


def _parts(path: Path) -> list[str]:
    return sorted(part.name for part in Path(f"{path}.parts").glob("*"))


def _error_of(path: Path) -> str:
    with pytest.raises(ResultsFileError) as caught:
        read_ensemble(path)
    with pytest.raises(ResultsFileError) as opened:
        EnsembleFile.open(path)
    assert str(caught.value) == str(opened.value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_rows_are_in_a_folder_beside_the_file_until_it_is_finished(in_parts):
    assert _parts(in_parts) == ["000001.h5", "000002.h5", "000003.h5"]
    assert not read_ensemble(in_parts).finished
    size = in_parts.stat().st_size
    with EnsembleFile.open(in_parts) as file:
        finish(file)
    assert not Path(f"{in_parts}.parts").exists()
    assert in_parts.stat().st_size > size
    data = read_ensemble(in_parts)
    assert data.finished
    assert data.done.tolist() == list(range(6))


def test_last_part_grows_until_it_is_large_enough(tmp_path, monkeypatch):
    monkeypatch.setattr(writer, "PART_BYTES", 8000)
    path = tmp_path / "rig.h5"
    with EnsembleFile.create(path, some_header(COUNT), some_static()) as file:
        for number in range(COUNT):
            file.put([some_outcome(number)])
            assert read_ensemble(path).done.tolist() == list(range(number + 1))
    assert 1 < len(_parts(path)) < COUNT


def test_parts_move_and_are_copied_with_their_file(in_parts, tmp_path):
    moved, linked = tmp_path / "moved.h5", tmp_path / "linked.h5"
    shutil.copy(in_parts, moved)
    shutil.copytree(f"{in_parts}.parts", f"{moved}.parts")
    linked.symlink_to(in_parts)
    assert differences(in_parts, moved) == []
    assert differences(in_parts, linked) == []


def test_missing_folder_of_parts_is_an_error(in_parts, tmp_path):
    copy = tmp_path / "copy.h5"
    shutil.copy(in_parts, copy)
    assert _error_of(copy) == (
        f"{copy}: is unfinished, and part of it is missing: there is no {copy}.parts; move it"
        " there, or repeat the ensemble with force=True"
    )


@pytest.mark.parametrize("number", [1, 2])
def test_missing_part_is_an_error(in_parts, number):
    missing = Path(f"{in_parts}.parts") / f"00000{number}.h5"
    missing.unlink()
    assert f"{in_parts}: is unfinished, and part of it is missing: there is no {missing};" in (
        _error_of(in_parts)
    )


def test_part_of_another_ensemble_is_an_error(in_parts, tmp_path):
    other = tmp_path / "other.h5"
    EnsembleFile.create(other, some_header(COUNT), some_static()).close()
    part = Path(f"{other}.parts") / "000001.h5"
    shutil.copy(Path(f"{in_parts}.parts") / "000002.h5", part)
    assert _error_of(other) == (
        f"{part}: belongs to another ensemble than {other}; move the parts of this one there, or"
        " repeat the ensemble with force=True"
    )


def test_foreign_file_among_the_parts_is_an_error(in_parts):
    part = Path(f"{in_parts}.parts") / "000004.h5"
    shutil.copy(in_parts, part)
    assert _error_of(in_parts) == f"{part}: is not a part of an ensemble; remove it"
    part.write_bytes(b"")
    assert _error_of(in_parts).startswith(f"{part}: is empty; copy it again, or remove it and all")


@pytest.mark.parametrize("damaged", [True, False])
def test_tests_of_removed_parts_are_repeated(in_parts, tmp_path, damaged):
    whole = tmp_path / "whole.h5"
    shutil.copy(in_parts, whole)
    shutil.copytree(f"{in_parts}.parts", f"{whole}.parts")
    second, third = (Path(f"{in_parts}.parts") / f"00000{number}.h5" for number in (2, 3))
    if damaged:
        second.write_bytes(second.read_bytes()[:-100])
    else:
        second.unlink()
    assert "remove" in _error_of(in_parts)
    assert "resume then repeats the tests that are lost" in _error_of(in_parts)
    second.unlink(missing_ok=True)
    third.unlink()
    with EnsembleFile.open(in_parts) as file:
        lost = set(read_ensemble(whole).done.tolist()) - set(file.data.done.tolist())
        assert 0 < len(lost) < len(read_ensemble(whole).done)
        file.put([some_outcome(number) for number in sorted(lost)])
    assert differences(in_parts, whole) == []


def test_part_with_unknown_realisations_is_an_error(in_parts, tmp_path):
    data = read_ensemble(in_parts)
    from wearsim.atomic_write import DISK
    from wearsim.studies.ensemble.file.parts import blank_rows, part_path, write_part

    rows = blank_rows([COUNT], data)
    write_part(part_path(in_parts, 4), data.run_id, rows, {}, DISK)
    assert "000004.h5: is damaged (a realisation has an unknown number" in _error_of(in_parts)


def test_new_ensemble_ignores_and_deletes_parts_of_the_one_it_replaces(in_parts):
    with EnsembleFile.create(in_parts, some_header(COUNT), some_static()) as file:
        assert (file.status == PENDING).all()
        assert _parts(in_parts) == []
        file.put([some_outcome(7)])
    assert read_ensemble(in_parts).done.tolist() == [7]


def test_parts_that_were_merged_before_a_kill_are_ignored_and_deleted(in_parts, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(f"{in_parts}.parts", copy)
    with EnsembleFile.open(in_parts) as file:
        finish(file)
    whole = read_ensemble(in_parts)
    shutil.copytree(copy, f"{in_parts}.parts")
    assert read_ensemble(in_parts).finished
    with EnsembleFile.open(in_parts) as file:
        assert _parts(in_parts) == []
        file.clear([3])  # the number of its part is larger than those that were merged
        assert not read_ensemble(in_parts).finished
        file.put([some_outcome(3)])
        finish(file)
    assert read_ensemble(in_parts).done.tolist() == whole.done.tolist()
    assert not Path(f"{in_parts}.parts").exists()


def test_files_of_others_in_the_folder_are_kept(in_parts):
    other = Path(f"{in_parts}.parts") / "notes.txt"
    other.write_text("mine")
    with EnsembleFile.open(in_parts) as file:
        finish(file)
    assert other.read_text() == "mine"
    assert read_ensemble(in_parts).finished


@pytest.mark.parametrize("merged", [False, True])
def test_grown_ensemble_equals_a_larger_one(in_parts, tmp_path, merged):
    whole = tmp_path / "whole.h5"
    with EnsembleFile.create(whole, some_header(2 * COUNT), some_static()) as file:
        file.put([some_outcome(number) for number in range(2 * COUNT)])
        finish(file)
    with EnsembleFile.open(in_parts) as file:
        if merged:
            finish(file)
            assert read_ensemble(in_parts).finished
        file.grow(2 * COUNT)
        data = read_ensemble(in_parts)
        assert not data.finished
        assert data.requested == len(data.status) == 2 * COUNT
        assert data.done.tolist() == list(range(6))
        file.put([some_outcome(number) for number in range(6, 2 * COUNT)])
    with EnsembleFile.open(in_parts) as file:
        finish(file)
    assert differences(in_parts, whole) == []


def test_merge_of_more_realisations_than_a_chunk(tmp_path, monkeypatch):
    from wearsim.results.io import hdf5_write

    monkeypatch.setattr(hdf5_write, "CHUNK_ROWS", 5)
    monkeypatch.setattr(writer, "PART_BYTES", 3000)
    path = tmp_path / "rig.h5"
    order = np.random.default_rng(1).permutation(23)
    with EnsembleFile.create(path, some_header(23), some_static()) as file:
        for number in order.tolist():
            file.put([some_outcome(number)])
        finish(file)
    data = read_ensemble(path)
    assert (data.status == DONE).all()
    for number in range(23):
        for name, value in some_outcome(number).values.items():
            assert data.variables[name][number].tobytes() == np.asarray(value).tobytes(), name


@pytest.mark.skipif(os.name == "nt", reason="a file that is open cannot be replaced on Windows")
def test_reader_sees_a_whole_ensemble_while_it_is_merged(in_parts):
    data = read_ensemble(in_parts)
    depth = data.variables["depth"].copy()
    with EnsembleFile.open(in_parts) as file:
        finish(file)
    with pytest.raises(ResultsFileError, match="was replaced by another; open it again"):
        data.variables["depth"]
    np.testing.assert_array_equal(read_ensemble(in_parts).variables["depth"], depth)
