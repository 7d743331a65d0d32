"""Limits of [limit] in the summaries of runs and in their forecasts."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import wearsim
from tests.report.drawn import page_of
from tests.studies.cam.cam_text import prescribed
from wearsim.cli.app import app
from wearsim.scenario import Scenario
from wearsim.studies.dry_run import dry_run
from wearsim.studies.dry_run_table import plan
from wearsim.studies.run.result import Result

LIMITS = {"depth": "5 um", "lift_error": "1 mm", "volume": "1 mm^3", "peak_pressure": "500 MPa"}


def scenario() -> Scenario:
    changes = {f"limit__{key}": value for key, value in LIMITS.items()}
    return prescribed(operation__turns=100_000, evolution__tolerance=1e-2, **changes)


@pytest.fixture(scope="module")
def result() -> Result:
    return wearsim.run(scenario())


def test_limit_is_reached_when_and_by_how_much_the_history_says(result):
    depth, lift, _, pressure = result.limits
    course = np.asarray(result.values("depth"))
    passes = np.asarray(result.passes)
    assert depth["reached"]
    assert np.interp(depth["reached_at_passes"], passes, course) == pytest.approx(5e-6, rel=1e-6)
    assert depth["excess"] == pytest.approx(course[-1] / 5e-6 - 1.0)
    assert not lift["reached"]
    assert lift["reached_at_passes"] is None
    assert lift["excess"] == pytest.approx(np.max(result.values("lift_error")[-1]) / 1e-3 - 1.0)
    assert pressure["reached_at_passes"] == 0.0  # by the unworn contact
    # a run that stops at this limit agrees
    stopped = wearsim.run(scenario(), until="depth 5 um")
    assert depth["reached_at_passes"] == pytest.approx(stopped.passes[-1], rel=0.05)


def test_rows_and_page_say_reached_or_not(result):
    rows = {row.label: row.text for row in result.view.limit_rows()}
    turns = result.limits[0]["reached_at_passes"]
    assert f"reached after about {turns:,.0f} turns" in rows["limit of depth"]
    assert "of 5.000 um at the end" in rows["limit of depth"]
    assert rows["limit of depth"].endswith("% above")
    assert rows["limit of lift error"].startswith("not reached: ")
    assert rows["limit of lift error"].endswith("% below")
    page = page_of([result])
    assert all(text in page for text in rows.values())


def test_dry_run_forecasts_when_limits_are_reached(result):
    data = dry_run(scenario())
    forecast = {item["quantity"]: item for item in data["forecast"]["limits"]}
    run = {item["quantity"]: item for item in result.limits}
    for name in ("depth", "lift_error", "peak_pressure"):
        assert (forecast[name]["reached_at_passes"] is None) == (not run[name]["reached"])
    ratio = forecast["depth"]["reached_at_passes"] / run["depth"]["reached_at_passes"]
    assert 0.5 < ratio < 2.0
    rows = dict(plan(data))
    assert rows["limit of depth"].startswith("reached after about ")
    assert rows["limit of lift error"].startswith("not reached: about ")


def test_run_and_check_write_the_limits(tmp_path):
    text = scenario().text.replace("turns = 100000", "turns = 2e4")
    file = tmp_path / "cam.toml"
    file.write_text(text)
    done = CliRunner().invoke(app, ["check", str(file)])
    assert done.exit_code == 0, done.output
    assert "limit of lift error" in done.output
    done = CliRunner().invoke(
        app, ["run", str(file), "-q", "--json", "-o", str(Path(tmp_path, "c.h5"))]
    )
    assert done.exit_code == 0, done.output
    limits = json.loads(done.stdout)["limits"]
    assert [item["quantity"] for item in limits] == list(LIMITS)
