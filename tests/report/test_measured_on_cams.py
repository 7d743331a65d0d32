"""Measured grooves of cams in figures and on pages, and the notes on them."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import wearsim
from tests.studies.cam.cam_text import prescribed
from wearsim.cli.app import app
from wearsim.levelling import Measured
from wearsim.report.measured import residual_text
from wearsim.studies.cam.grooves import grooves_at
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.run.result import Result


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of a run of a cam, with a trace at 112 deg beside it."""
    folder = tmp_path_factory.mktemp("cam")
    scenario = prescribed(operation__turns=20_000, evolution__tolerance=1e-2)
    result = wearsim.run(scenario, folder / "cam.h5")
    worn, _ = grooves_at(result, math.radians(112.0))
    table = np.column_stack([1e3 * result.y, -1e6 * worn[-1]])
    head = "y [mm],height [um]"
    np.savetxt(folder / "t112.csv", table, delimiter=",", header=head, comments="", fmt="%.9f")
    return folder / "cam.h5"


def test_groove_at_an_angle_is_between_those_of_the_stations(file):
    result = wearsim.open_results(file)
    assert isinstance(result, Result)
    stations = turn_of(result.scenario).stations
    depth = np.asarray(result.raw.records["cylinder_depth_profile"])[:, :, 0]
    number = stations.count // 3
    at_station, angle = grooves_at(result, float(stations.angle[number]))
    assert angle == stations.angle[number]
    assert at_station == pytest.approx(np.maximum(depth[:, number], 0.0), abs=1e-15)
    deepest, _ = grooves_at(result)
    assert deepest[-1].max() == depth[-1].max()
    assert 0.0 < grooves_at(result, 1.0)[0][-1].max() <= depth[-1].max()


def test_residual_of_a_trace_is_that_of_its_angle(file):
    result = wearsim.open_results(file)
    worn, angle = grooves_at(result, math.radians(112.0))
    trace = Measured("t", result.y, -worn[-1], angle)
    assert residual_text(trace, result.worn_profile(angle)).startswith("residual rms 0 ")
    elsewhere = result.worn_profile(math.radians(225.0))
    assert not residual_text(trace, elsewhere).startswith("residual rms 0 ")


@pytest.mark.parametrize(("verb", "output"), [("plot", "f.png"), ("report", "p.html")])
def test_trace_at_an_angle_is_plotted_and_reported(file, tmp_path, verb, output):
    trace, path = file.parent / "t112.csv", tmp_path / output
    options = ["--measured", str(trace), "--angle", "112 deg", "-o", str(path)]
    done = CliRunner().invoke(app, [verb, str(file), *options])
    assert done.exit_code == 0, done.output
    assert path.stat().st_size > 10_000
    assert "t112: residual rms" in done.output
    if verb == "report":
        page = path.read_text()
        assert "Groove at 112 deg" in page
    rms = float(re.search(r"t112: residual rms (\S+) um", done.output)[1])
    assert rms < 1e-3
    other = tmp_path / f"other-{output}"
    done = CliRunner().invoke(app, [verb, str(file), "--angle", "1 deg", "-o", str(other)])
    assert done.exit_code == 2
    assert "needs a measured profile" in done.output
