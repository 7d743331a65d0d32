"""Export of an ensemble as CSV: values, units and existing files."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from tests.report.made_up_ensembles import made_up
from wearsim.errors import ResultsFileError
from wearsim.studies.opening import export_csv


def read(path):
    """Return the columns of a table by their titles."""
    with path.open() as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, np.array(rows, dtype=float).T, strict=True))


@pytest.mark.parametrize("count", [30, 16_600])  # the second is written in two blocks
def test_every_realisation_is_a_row(tmp_path, count):
    result = made_up(count, failed=[4, 9], pending=3)
    export_csv(result, tmp_path)
    found = read(tmp_path / "realisations.csv")
    np.testing.assert_array_equal(found["realisation"], np.arange(count - 3))
    failed = np.isin(np.arange(count - 3), [4, 9])
    np.testing.assert_array_equal(found["failed"], failed)
    assert np.isnan(found["depth [um]"][failed]).all()
    good = {title: values[~failed] for title, values in found.items()}
    offsets = result.inputs["roller.offset"]
    for title, values in {
        "load.normal_force [N]": result.inputs["load.normal_force"],
        "friction.coefficient": result.inputs["friction.coefficient"],
        "roller.offset roller 3 [mm]": offsets[:, 2] * 1e3,
        "depth [um]": result.at_end("depth") * 1e6,
        "width [mm]": result.at_end("width") * 1e3,
        "worn_volume [mm^3]": result.at_end("worn_volume") * 1e9,
        "peak_pressure [MPa]": result.at_end("peak_pressure") * 1e-6,
        "depth_error [um]": result.values("depth_error") * 1e6,
    }.items():
        np.testing.assert_allclose(good[title], values, rtol=1e-11)


def test_courses_and_profile_equal_those_of_the_result(tmp_path):
    result = made_up(30)
    export_csv(result, tmp_path)
    found, course = read(tmp_path / "courses.csv"), result.course("width")
    np.testing.assert_allclose(found["passes"], result.record_passes)
    np.testing.assert_allclose(found["time [min]"], result.record_time / 60.0)
    for title, values in {
        "width mean [mm]": course.mean,
        "width mean high [mm]": course.mean_high,
        "width std [mm]": course.std,
        "width 97.5 % [mm]": course.quantiles[0.975],
    }.items():
        np.testing.assert_allclose(found[title], values * 1e3, rtol=1e-11)
    profile, band = read(tmp_path / "profile.csv"), result.band()
    np.testing.assert_allclose(profile["y [mm]"], band.y * 1e3, rtol=1e-11)
    np.testing.assert_allclose(profile["depth low [um]"], band.low * 1e6, rtol=1e-11)


def test_failures_are_exported_with_their_errors(tmp_path):
    result = made_up(3, failed=[0, 1, 2])
    written = [path.name for path in export_csv(result, tmp_path)]
    assert written == ["realisations.csv", "failures.csv", "scenario.toml"]
    with (tmp_path / "failures.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["realisation", "error"]
    assert rows[1:] == [[str(number), text] for number, text in result.errors.items()]


def test_existing_tables_are_not_replaced(tmp_path):
    (tmp_path / "courses.csv").write_text("mine")
    with pytest.raises(ResultsFileError, match=r"courses\.csv: already exists"):
        export_csv(made_up(3), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["courses.csv"]
