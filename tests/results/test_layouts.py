"""Result files of all layouts: those of this wearsim open, others are refused with a remedy."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from ensemble_examples import some_outcome
from layout_files import FOLDER, LAYOUTS, run_of_file, study_of_file

from tests.results_compared import differences
from wearsim.errors import ResultsFileError
from wearsim.studies.dissipation.result import read_dissipation
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.opening import kind_of
from wearsim.studies.run.result import read_results

READERS = {
    "run": read_results,
    "dissipation": read_dissipation,
    "ensemble": read_ensemble,
    "unfinished": read_ensemble,
}


def _file(name: str) -> Path:
    return FOLDER / f"{name}-{LAYOUTS[name]}.h5"


def test_file_of_every_kind_is_kept_for_the_present_layout():
    for name in READERS:
        assert _file(name).is_file(), "python tests/results/layout_files.py writes it"
    assert Path(f"{_file('unfinished')}.parts").is_dir()
    assert not Path(f"{_file('ensemble')}.parts").exists()


def test_run_of_this_layout_opens():
    assert differences(read_results(_file("run")), run_of_file()) == []


def test_dissipation_study_of_this_layout_opens():
    found, expected = read_dissipation(_file("dissipation")), study_of_file()
    stored, known = (dict(data.attributes) for data in (found, expected))
    numbers, computed = stored.pop("statistics"), known.pop("statistics")
    assert stored == known
    # estimates may be added within a layout, and sums differ in round-off between processors
    for name, estimates in numbers.items():
        for estimate, value in estimates.items():
            known = computed[name][estimate]
            number = isinstance(known, float)
            assert value == (pytest.approx(known, rel=1e-12, abs=0.0) if number else known)
    for name, array in expected.variables.items():
        assert found.variables[name].tobytes() == array.tobytes()


@pytest.mark.parametrize("name", ["ensemble", "unfinished"])
def test_ensemble_of_this_layout_opens(name):
    data = read_ensemble(_file(name))
    assert data.finished == (name == "ensemble")
    assert data.done.tolist() == [0, 1]
    assert data.errors == {2: "lost"}
    for number in data.done:
        for variable, value in some_outcome(number, 3).values.items():
            assert data.variables[variable][number].tobytes() == np.asarray(value).tobytes()


@pytest.mark.parametrize(
    ("name", "layout"),
    [
        ("run", 9),
        ("dissipation", 2),
        ("ensemble", 2),
    ],
)
def test_file_of_an_earlier_layout_is_refused_with_a_remedy(name, layout):
    path = FOLDER / f"{name}-{layout}.h5"
    assert kind_of(path).name == name
    with pytest.raises(ResultsFileError) as caught:
        READERS[name](path)
    assert str(caught.value) == (
        f"{path}: has layout {layout} of wearsim-{name}, and this wearsim reads layout"
        f" {LAYOUTS[name]}; repeat the computation, or read it with the version of wearsim that"
        " wrote it"
    )


def test_part_of_another_layout_is_refused(tmp_path):
    import h5py

    shutil.copytree(FOLDER, tmp_path / "data")
    path = tmp_path / "data" / _file("unfinished").name
    part = Path(f"{path}.parts") / "000001.h5"
    with h5py.File(part, "r+") as file:
        file.attrs["format_version"] = 9
    with pytest.raises(ResultsFileError) as caught:
        read_ensemble(path)
    assert str(caught.value) == (
        f"{part}: has layout 9 of wearsim-ensemble-part, and this wearsim reads layout"
        f" {LAYOUTS['unfinished']}; update wearsim to read it"
    )
