"""The file of a dissipation study: round trip, statistics, refused files."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from run_examples import some_run

from wearsim.errors import ResultsFileError
from wearsim.results.content import with_random_inputs
from wearsim.results.io.files import write_results
from wearsim.studies.dissipation.result import (
    DISSIPATION,
    VARIABLES,
    DissipationData,
    DissipationResult,
    as_numbers,
    read_dissipation,
    summaries,
)
from wearsim.studies.opening import kind_of, open_dissipation
from wearsim.studies.run.result import read_results

INPUTS = [{"key": "load.normal_force", "unit": "N"}, {"key": "friction.coefficient", "unit": "1"}]


def some_study(count: int = 40, kept: int = 30, **changes: object) -> DissipationData:
    """Return a study with random arrays; `changes` replaces fields."""
    rng = np.random.default_rng(count)
    lengths = {"realisation": count, "kept": kept, "y": 9}
    variables = {
        name: rng.random([lengths[dim] for dim in variable.dims])
        for name, variable in with_random_inputs(DISSIPATION, INPUTS).variables.items()
    }
    values: dict[str, object] = {
        "scenario_text": 'title = "µ"\n',
        "scenario_file": "a.toml",
        "title": "a contact",
        "sha256": "ab" * 32,
        "seed": 2**63 - 1,
        "files": {"profile.csv": "y [mm],height [um]\n"},
        "software": {"wearsim": "0.1.0"},
        "plugins": [],
        "model": "hertz-fastsim",
        "plan": "sobol",
        "inputs": INPUTS,
        "requested": 50,
        "finished": False,
        "strip_width": 6e-5,
        "friction_grid": "",
        "mean_problem_power": 0.1 + 0.2,
        "variables": variables,
        "statistics": as_numbers(summaries(variables)),
        "solve_seconds": 0.02,
        "wall_seconds": 0.1,
        "created": "2030-01-02T03:04:05+00:00",
        "notes": ["a note"],
        "warnings": [],
    }
    return DissipationData(**(values | changes))  # type: ignore[arg-type]


@pytest.fixture
def study_file(tmp_path: Path) -> Path:
    path = tmp_path / "study.h5"
    write_results(path, some_study())
    return path


@pytest.mark.parametrize(("count", "kept"), [(40, 30), (1, 1)])
def test_study_is_read_back_bit_for_bit(tmp_path, count, kept):
    path, data = tmp_path / "study.h5", some_study(count, kept)
    write_results(path, data)
    found = read_dissipation(path)
    for item in fields(DissipationData):
        if item.name != "variables":
            assert getattr(found, item.name) == getattr(data, item.name), item.name
    assert found.variables.keys() == data.variables.keys()
    for name, array in data.variables.items():
        assert found.variables[name].tobytes() == array.tobytes(), name
    assert kind_of(path).name == "dissipation"


def test_equal_studies_give_equal_files(tmp_path):
    one, other = tmp_path / "one.h5", tmp_path / "other.h5"
    write_results(one, some_study())
    write_results(other, some_study())
    assert one.read_bytes() == other.read_bytes()


def test_xarray_opens_study_with_dimensions_and_units(study_file):
    with xarray.open_dataset(study_file, engine="h5netcdf") as dataset:
        assert dataset.sizes == {"realisation": 40, "kept": 30, "y": 9}
        assert dataset["power"].attrs["units"] == "W"
        assert dataset["load.normal_force"].attrs["units"] == "N"
        assert dataset["dissipation"].dims == ("kept", "y")
        assert dataset["realisation"].values[0] == 0
        assert dataset.attrs["format"] == "wearsim-dissipation"
        assert dataset.attrs["mean_problem_power"] == 0.1 + 0.2


def test_statistics_are_stored_in_the_file(study_file):
    with h5py.File(study_file) as file:
        about = json.loads(file["inputs/about"][0])
        power = file["power"][()]
    assert about["statistics"]["power"]["mean"] == pytest.approx(power.mean(), rel=1e-14)
    quantiles = {item["probability"]: item for item in about["statistics"]["power"]["quantiles"]}
    assert quantiles.keys() == {0.025, 0.05, 0.5, 0.95, 0.975}
    assert quantiles[0.025]["low"] is None  # 40 realisations are too few


def test_wrong_kind_of_file_raises_one_line_error(study_file, tmp_path):
    run_file = tmp_path / "run.h5"
    write_results(run_file, some_run())
    assert kind_of(run_file).name == "run"
    with pytest.raises(ResultsFileError) as caught:
        read_results(study_file)
    assert str(caught.value) == (
        f"{study_file}: holds realisations of one contact, from `wearsim dissipation`; what is"
        " needed is a wear test, from `wearsim run`. In Python, wearsim.open_results opens it"
    )
    with pytest.raises(ResultsFileError, match="holds a wear test, from `wearsim run`; what is"):
        open_dissipation(run_file)


def _newer(file: h5py.File) -> None:
    file.attrs["format_version"] = 4


def _without_power(file: h5py.File) -> None:
    del file["power"]


def _without_drawn_values(file: h5py.File) -> None:
    del file["load.normal_force"]


def _with_wrong_shape(file: h5py.File) -> None:
    del file["power"]
    file["power"] = np.zeros(3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_newer, "has layout 4 of wearsim-dissipation, and this wearsim reads layout 3; update"),
        (_without_power, "is damaged (lacks power)"),
        (_without_drawn_values, "is damaged (lacks load.normal_force)"),
        (_with_wrong_shape, "is damaged ("),
    ],
)
def test_altered_study_is_refused(study_file, change, message):
    with h5py.File(study_file, "r+") as file:
        change(file)
    with pytest.raises(ResultsFileError) as caught:
        open_dissipation(study_file)
    assert str(caught.value).startswith(f"{study_file}: {message}")


def test_truncated_study_is_refused(study_file):
    study_file.write_bytes(study_file.read_bytes()[:-100])
    with pytest.raises(ResultsFileError, match="is truncated"):
        kind_of(study_file)


def test_study_properties_return_their_variables(study_file):
    result = open_dissipation(study_file)
    for name in ("power", "y", "dissipation"):
        assert getattr(result, name).tobytes() == result.values(name).tobytes()
    assert list(result.inputs) == ["load.normal_force", "friction.coefficient"]
    assert (result.count, result.finished, result.raw.requested) == (40, False, 50)
    assert set(VARIABLES) < set(result.raw.variables)


def test_convergence_ends_at_the_summary():
    result = DissipationResult(some_study(count=500, kept=1))
    found, power = result.convergence(50), result.summaries["power"]
    assert found.count[0] == 1
    assert found.count[-1] == 500
    assert (np.diff(found.count) > 0).all()
    assert found.mean[-1] == pytest.approx(power.mean, rel=1e-13)
    np.testing.assert_equal(found.std_error[-1], power.std_error)


def test_repr_of_study():
    assert re.fullmatch(
        r"<DissipationResult 'a contact': 40 of 50 realisations, power [\d.]+ W, std [\d.]+ W>",
        repr(DissipationResult(some_study())),
    )
    one = DissipationResult(some_study(count=1, kept=1, requested=1, finished=True))
    assert repr(one) == (
        f"<DissipationResult 'a contact': 1 realisation, power {one.power[0]:.4g} W>"
    )
