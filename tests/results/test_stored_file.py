"""Files from anyone: damaged, altered or made to harm whoever opens them."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from run_examples import some_run

from wearsim.cli.shared import write_table
from wearsim.errors import ResultsFileError
from wearsim.results.io.files import write_results
from wearsim.results.kinds import kind_of
from wearsim.studies.opening import open_results
from wearsim.studies.run.result import read_results

if sys.platform == "linux":
    from tests.damaged_files import HOSTILE, failures, opened
else:
    HOSTILE = ()


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("written") / "run.h5"
    write_results(path, some_run())
    return path


@pytest.fixture
def run_file(written: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(written, tmp_path))


def _error_of(path: Path) -> str:
    with pytest.raises(ResultsFileError) as caught:
        read_results(path)
    return str(caught.value).removeprefix(f"{path}: is damaged ")


@pytest.mark.parametrize("change", HOSTILE, ids=lambda change: change.__name__.strip("_"))
def test_object_that_no_file_of_wearsim_holds_is_refused(run_file, tmp_path, change):
    (tmp_path / "other.gz").write_bytes(b"x")
    with h5py.File(run_file, "r+") as file:
        del file["depth"]
        change(file, "depth", tmp_path / "other.h5")
    assert _error_of(run_file).startswith("(")


def test_array_of_which_nothing_is_stored_is_refused_by_its_size(run_file):
    with h5py.File(run_file, "r+") as file:
        del file["checkpoint"]
        file.create_dataset("checkpoint/depth", (10**12,), "<f8", chunks=(1 << 15,))
    assert _error_of(run_file).startswith("(checkpoint/depth is given as 8e+12 bytes, and the file")


@pytest.mark.parametrize("name", ["cylinder_depth_profile", "inputs/scenario"])
def test_block_of_zeros_has_a_right_checksum_and_is_damage(run_file, name):
    with h5py.File(run_file) as file:
        chunk = file[name].id.get_chunk_info(0)
        size = chunk.size
    content = bytearray(run_file.read_bytes())
    content[chunk.byte_offset : chunk.byte_offset + size] = bytes(size)
    run_file.write_bytes(content)
    with h5py.File(run_file) as file:
        assert not np.any(file[name][()].view(np.uint8))
    assert _error_of(run_file) == f"({name} has a block of zeros, which was not written)"


def test_array_of_zeros_is_no_damage(tmp_path):
    data = some_run()
    data.records["cylinder_depth_profile"][:] = 0.0
    write_results(tmp_path / "run.h5", data)
    assert not read_results(tmp_path / "run.h5").records["cylinder_depth_profile"].any()


def test_field_of_another_type_is_refused(tmp_path):
    write_results(tmp_path / "run.h5", some_run(warnings=["narrow", 3]))
    assert _error_of(tmp_path / "run.h5") == "(warnings is a list of unknown content)"


def test_file_without_a_format_has_no_kind(run_file):
    with h5py.File(run_file, "r+") as file:
        file.attrs["format"] = np.array(["", ""], "S9")
    with pytest.raises(ResultsFileError, match="is HDF5, but not a results file of wearsim"):
        kind_of(run_file)


def test_terminal_is_not_controlled_by_texts_of_a_file(tmp_path, capsys):
    path = tmp_path / "run.h5"
    write_results(path, some_run(title="\x1b]0;other\x07", scenario_text='title = "\x1b[31m"'))
    opened_run = open_results(path)
    write_table(opened_run.title, [("title", opened_run.title)])
    with pytest.raises(ResultsFileError) as caught:
        _ = opened_run.scenario
    assert "\x1b" not in capsys.readouterr().out + str(caught.value)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits of processes")
def test_damaged_and_hostile_files_of_every_kind_are_refused_or_unchanged(tmp_path):
    found = list(opened(176, seed=7, folder=tmp_path))
    assert len({(item.kind, item.change) for item in found}) >= 60
    assert failures(found) == []
    assert {item.outcome for item in found} > {"refused", "same"}
