"""Export of runs as CSV: engineering units, no overwriting, no files outside the folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from run_examples import LOG, SCENARIO, some_run

from wearsim.csv_tables import read_columns
from wearsim.errors import ResultsFileError
from wearsim.results import Result, export_csv


def _header(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8").splitlines()[0].split(",")


def test_run_is_exported_in_engineering_units(tmp_path: Path) -> None:
    folder = tmp_path / "made" / "here"
    result = Result(some_run())
    files = export_csv(result, folder)
    assert [str(path.relative_to(folder)) for path in files] == [
        "history.csv",
        "cylinder_depth_profiles.csv",
        "roller_depth_profiles.csv",
        "line_load.csv",
        "dissipation.csv",
        "scenario.toml",
        "load.csv",
    ]
    assert sorted(files) == sorted(folder.iterdir())
    assert _header(folder / "history.csv") == [
        "passes",
        "time [min]",
        "step_passes",
        "depth [um]",
        "width [mm]",
        "width_error [mm]",
        "worn_volume [mm^3]",
        "roller_depth [um]",
        "roller_depth_error [um]",
        "roller_worn_volume [mm^3]",
        "roller_worn_volume_error [mm^3]",
        "dissipated_energy [J]",
        "dissipated_energy_error [J]",
        "power [W]",
        "power_error [W]",
        "normal_force [N]",
        "normal_force_error [N]",
        "peak_pressure [MPa]",
        "peak_pressure_error [MPa]",
        "approach [um]",
        "descent [um]",
        "descent_error [um]",
        "elastic_approach [um]",
        "elastic_approach_error [um]",
        "longitudinal_creepage",
        "adhesion_fraction",
        "depth_error [um]",
        "volume_error [mm^3]",
        "profile_error",
        "depth_error_by_steps [um]",
        "volume_error_by_steps [mm^3]",
        "profile_error_by_steps",
        "depth_error_by_strips [um]",
        "volume_error_by_strips [mm^3]",
        "profile_error_by_strips",
        "rejected",
        "solves",
        "full_solves",
    ]
    depth = ["y [mm]", *(f"depth at {passes} passes [um]" for passes in (0, 2000, 4000))]
    assert _header(folder / "cylinder_depth_profiles.csv") == depth
    assert _header(folder / "roller_depth_profiles.csv") == depth
    assert _header(folder / "line_load.csv")[1] == "line_load at 0 passes [N/mm]"
    assert _header(folder / "dissipation.csv")[1] == "dissipation at 0 passes [W/m]"
    assert (folder / "scenario.toml").read_text(encoding="utf-8") == SCENARIO
    assert (folder / "load.csv").read_text(encoding="utf-8") == LOG


def test_exported_columns_are_read_back_in_si(tmp_path: Path) -> None:
    result = Result(some_run(steps=9))
    export_csv(result, tmp_path)
    wanted = {"time": "s", "depth": "m", "worn_volume": "m^3", "peak_pressure": "Pa"}
    columns = read_columns((tmp_path / "history.csv").read_text(), "history.csv", wanted)
    for name, column in columns.items():
        np.testing.assert_allclose(column, getattr(result, name), rtol=1e-11)
    wanted = {"y": "m", "depth at 4000 passes": "m"}
    columns = read_columns((tmp_path / "cylinder_depth_profiles.csv").read_text(), "p.csv", wanted)
    np.testing.assert_allclose(columns["y"], result.y, rtol=1e-11, atol=1e-18)
    np.testing.assert_allclose(columns["depth at 4000 passes"], result.profiles[-1], rtol=1e-11)


def test_each_roller_has_a_column(tmp_path: Path) -> None:
    result = Result(some_run(rollers=2, realisations=2))
    export_csv(result, tmp_path)
    header = _header(tmp_path / "history.csv")
    forces = [f"normal_force roller {r} realisation {n} [N]" for r in (1, 2) for n in (1, 2)]
    assert [title for title in header if title.startswith("normal_force ")] == forces
    assert "depth realisation 2 [um]" in header
    values = np.loadtxt(tmp_path / "history.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(
        values[:, header.index(forces[1])], result.raw.history["normal_force"][:, 0, 1], rtol=1e-11
    )
    header = _header(tmp_path / "line_load.csv")
    assert header[:2] == ["y [mm]", "line_load at 0 passes roller 1 realisation 1 [N/mm]"]
    values = np.loadtxt(tmp_path / "line_load.csv", delimiter=",", skiprows=1)
    loads = np.moveaxis(result.raw.records["line_load"], -1, 0).reshape(7, -1)
    np.testing.assert_allclose(values[:, 1:], loads / 1e3, rtol=1e-11)


def test_profiles_of_unworn_rollers_are_not_exported(tmp_path: Path) -> None:
    data = some_run()
    data.records["roller_depth_profile"][:] = 0.0
    assert tmp_path / "roller_depth_profiles.csv" not in export_csv(Result(data), tmp_path)


def test_existing_files_are_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "line_load.csv").write_text("precious")
    with pytest.raises(ResultsFileError, match=r"line_load\.csv: already exists"):
        export_csv(Result(some_run()), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["line_load.csv"]
    with pytest.raises(ResultsFileError, match="cannot be made"):
        export_csv(Result(some_run()), tmp_path / "line_load.csv" / "folder")


def test_input_files_stay_inside_the_folder_under_new_names(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    names = [
        "data/load.csv",
        "../load.csv",
        "/tmp/load.csv",
        "history.csv",
        "..",
        "c:\\x\\load.csv",
    ]
    data = some_run(files={name: name for name in names})
    found = {
        path.read_text(): str(path.relative_to(folder))
        for path in export_csv(Result(data), folder)[-len(names) :]
    }
    assert found == {
        "data/load.csv": "data/load.csv",
        "../load.csv": "inputs/load.csv",
        "/tmp/load.csv": "inputs/2-load.csv",
        "history.csv": "inputs/history.csv",
        "..": "inputs/_",
        "c:\\x\\load.csv": "inputs/3-load.csv",
    }
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
