"""Killed runs: the file can be read, and the resumed run is bitwise identical."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from killed_scripts import ROOT, rows_of
from study_examples import RIG, run_differences

import wearsim
from tests.faulty_storage import STAGES
from tests.interruptible import interruptible
from wearsim.scenario import Scenario
from wearsim.studies.opening import open_results

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")


@pytest.mark.parametrize("extent", ["each stage", pytest.param("sixths", marks=pytest.mark.slow)])
def test_run_killed_while_writing_resumes_bit_for_bit(tmp_path: Path, extent: str) -> None:
    head, *rows = rows_of("killed_run.py", "stages", tmp_path, extent)
    stages = head["stages"]
    # initial state, two steps, and the end: four writes through all stages
    assert {stage.split(maxsplit=1)[1] for stage in stages} == set(STAGES)
    assert stages.count("before rename") == stages.count("after rename") == 4
    assert stages.count("before write") > 4
    killed_at = [row["number"] for row in rows]
    kinds = {stage for stage in stages if extent == "sixths" or stage.startswith("before")}
    assert {stages[number] for number in killed_at} == kinds | {stages[-1]}
    assert extent == "each stage" or set(killed_at) >= set(range(0, len(stages), 6))
    for row in rows:
        assert row["killed"][0] == signal.SIGKILL
        assert row["differences"] == []
        if len(row["killed"]) == 1:  # the file is that of the last rename
            renamed = stages[: row["number"] + 1].count("after rename")
            assert row["resumed_from"] == [-1.0, 0.0, 3000.0, 6000.0, 6000.0][renamed]
    twice = sum(row["killed"][1:] == [signal.SIGKILL] for row in rows)
    assert twice >= (3 if extent == "sixths" else 2)


@pytest.mark.slow
def test_run_killed_at_any_moment_resumes_bit_for_bit(tmp_path: Path) -> None:
    rows = rows_of("killed_run.py", "moments", tmp_path, 20)
    assert len(rows) == 20
    for row in rows:
        assert row["differences"] == []
        assert set(row["killed"]) <= {signal.SIGPROF, 0}
    assert sum(signal.SIGPROF in row["killed"] for row in rows) >= 10
    assert (
        sum(0.0 <= row["resumed_from"] < 6000.0 for row in rows) >= 3
    )  # some between start and end


@pytest.fixture(scope="module")
def long_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Scenario, wearsim.Result]:
    path = tmp_path_factory.mktemp("long") / "rig.toml"
    path.write_text(
        RIG.replace("passes = 6000", "passes = 120_000").replace("5 mm", "8 mm")
        + '[evolution]\nstepper = "per-pass"\n'
    )
    scenario = wearsim.load_scenario(str(path))
    return path, scenario, wearsim.run(scenario)


# the shell is sent both signals too
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(15, marks=pytest.mark.slow)])
def test_run_stopped_by_signal_resumes_bit_for_bit(
    number: signal.Signals,
    long_run: tuple[Path, Scenario, wearsim.Result],
    path: Path,
) -> None:
    source, _, unbroken = long_run
    arguments = interruptible("-m", "wearsim", "run", source, "-o", path, "-q")
    with subprocess.Popen(arguments, cwd=ROOT, stderr=subprocess.PIPE, text=True) as running:
        while not path.exists() and running.poll() is None:
            time.sleep(0.005)
        running.send_signal(number)
        output = running.communicate()[1]
    assert running.returncode == 130, output
    assert f"wearsim resume {path}" in output
    stopped = open_results(path)
    assert 0.0 < stopped.passes[-1] < 120_000
    assert not stopped.finished
    assert run_differences(wearsim.resume(path), unbroken) == []
