"""`wearsim identify`: table, JSON, posterior, figures, planning and exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_examples import Command

from tests.studies.identify.grooves import RANDOM, TEXT, groove, write
from wearsim.studies.identify import planning

DEPTHS = """
[[test]]
depth = "28 um"
depth_std = "1 um"
[[test]]
depth = "48 um"
depth_std = "1 um"
[[test]]
depth = "62 um"
depth_std = "1 um"
"""


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """The scenario with random inputs."""
    text = TEXT
    for key, table in RANDOM.items():
        inner = ", ".join(f"{name} = {json.dumps(value)}" for name, value in table.items())
        old = {
            "friction.coefficient": "coefficient = 0.1",
            "creepage.longitudinal": "longitudinal = 1e-3",
        }[key]
        text = text.replace(old, f"{old.partition(' ')[0]} = {{{inner}}}")
    (tmp_path / "rig.toml").write_text(text)
    (tmp_path / "depths.toml").write_text(DEPTHS)
    return tmp_path / "rig.toml"


@pytest.fixture
def traces(tmp_path: Path) -> list[Path]:
    """Coarse grooves of three tests."""
    rng = np.random.default_rng(7)
    return [
        write(tmp_path / f"t{number}.csv", *(values[::3] for values in groove(rng, k)))
        for number, k in enumerate((0.9e-11, 1.1e-11, 1.3e-11), 1)
    ]


def test_profiles_give_table_posterior_and_figure(
    command: Command, rig: Path, traces: list[Path], tmp_path: Path
):
    options = ("-o", "o.h5", "--posterior", "K.toml", "--figure", "f.png", "--draws", 16, "-q")
    done = command("identify", rig, *traces, *options)
    assert done.exit_code == 0, done.output
    for part in ("t1.csv", "(found)", "verdict", "Bayes factor of t = 0", "what would decide"):
        assert part in done.stdout
    assert (tmp_path / "f.png").stat().st_size > 50_000
    assert "[wear.cylinder.k_over_h]" in (tmp_path / "K.toml").read_text()
    assert command("show", "o.h5").stdout.splitlines()[:5] == done.stdout.splitlines()[:5]
    assert command("plot", "o.h5", "-o", "g.png").exit_code == 0
    assert command("export", "o.h5", "-o", "csv").exit_code == 0
    assert (tmp_path / "csv" / "tests.csv").read_text().count("\n") == 4
    again = command("identify", rig, *traces, "-o", "o.h5", "-q")
    assert again.exit_code == 2
    assert "--force replaces it" in again.stderr


def test_json_has_the_named_keys(command: Command, rig: Path):
    done = command("identify", rig, "--tests", "depths.toml", "--json", "-q", "--draws", 32)
    assert done.exit_code == 0, done.output
    data = json.loads(done.stdout)
    assert [test["depth_m"] for test in data["tests"]] == pytest.approx([28e-6, 48e-6, 62e-6])
    assert {"file", "depth_m", "k_over_h_per_Pa"} <= set(data["tests"][0])
    k = data["tests"][1]["k_over_h_per_Pa"]
    assert k["low"] < k["value"] < k["high"]
    assert data["scatter_seen"] == pytest.approx(0.61, abs=0.02)
    assert 0.2 < data["scatter_from_inputs"] < 0.4
    assert data["scatter_of_k"]["low"] < data["scatter_of_k"]["value"]
    assert data["bayes_factor"] > 0.0
    assert data["verdict"] in {"explained", "random", "undecided"}
    assert data["to_decide"]["tests"] > 3


def test_fixed_inputs_do_not_scatter(command: Command, rig: Path):
    options = ("--fix", "friction=0.1,creepage=1e-3", "--json", "-q")
    data = json.loads(command("identify", rig, "--tests", "depths.toml", *options).stdout)
    assert data["scatter_from_inputs"] == pytest.approx(1.5 / 48.0, rel=0.5)
    assert data["verdict"] == "random"


def test_plan_gives_power_by_tests_and_measured_inputs(
    command: Command, rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    options = ("--plan", rig, "--measured", "creepage=0.05", "-q", "--draws", 64, "-n", "3,8")
    planned, plan_tests = [], planning.plan_tests

    def plan_once(*arguments: object, **others: object) -> object:
        planned[:] = planned or [plan_tests(*arguments, **others)]
        return planned[0]

    monkeypatch.setattr(planning, "plan_tests", plan_once)  # takes seconds
    done = command("identify", *options, "--figure", "p.png")
    assert done.exit_code == 0, done.output
    assert "inputs as in the scenario" in done.stdout
    assert "creepage.longitudinal measured to 0.05" in done.stdout
    assert (tmp_path / "p.png").exists()
    data = json.loads(command("identify", *options, "--json").stdout)
    plain, measured = data["designs"]
    assert measured["scatter_from_inputs"] < plain["scatter_from_inputs"]
    assert measured["power"]["0.4"][0] > plain["power"]["0.4"][0]
    assert max(plain["false_random"]) <= 0.07


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "give the profiles of the tests"),
        (("t.csv", "--tests", "depths.toml"), "not both"),
        (("--plan",), "is needed for --plan"),
        (("--plan", "-n", "1:3"), "no range of 2 to 1000"),
        (("--plan", "-n", "3", "--measured", "load"), "standard deviation above 0"),
        (("--plan", "-n", "3", "--measured", "load=0.1"), "is not a random number"),
        (("--tests", "depths.toml", "-n", "3"), "is for --plan"),
        (("--tests", "depths.toml", "--share", "k=both"), "expected k=cylinder,roller"),
        (("--tests", "depths.toml", "--fix", "friction"), "is not an input with a value"),
        (("missing.csv",), "the file cannot be read"),
        (("t.csv", "--before", "a.csv,b.csv"), "2 profiles before the tests for 1"),
        (("--tests", "depths.toml", "--shoulders", "9 mm"), "in the tests file"),
    ],
)
def test_bad_arguments_exit_with_two(
    command: Command, rig: Path, arguments: tuple[str, ...], message: str
):
    done = command("identify", rig, *arguments)
    assert done.exit_code == 2, done.output
    assert message in " ".join(done.stderr.replace("│", " ").split())
