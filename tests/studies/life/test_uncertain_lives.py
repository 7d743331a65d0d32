"""Lives with the posterior of an identification: from tests to life, with both levels."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtri
from typer.testing import CliRunner, Result

import wearsim
from tests.studies.identify.grooves import TEXT
from wearsim.cli.app import app
from wearsim.errors import ScenarioError
from wearsim.studies.identify.measurements import Measurement
from wearsim.studies.life.factor import with_posterior

FRICTION = {"distribution": "lognormal", "median": 0.1, "factor": 1.2}
LOAD = {"distribution": "lognormal", "median": "300 N", "factor": 1.1}
HEADER, ROW = "median [1/Pa],scatter,weight\n", "1e-11,0.2,1\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a rig, an identification of its grooves, and lives of the rig."""
    found = tmp_path_factory.mktemp("posterior")
    (found / "rig.toml").write_text(TEXT + '\n[limit]\ndepth = "50 um"\n')
    random = wearsim.load_scenario(found / "rig.toml", {"friction.coefficient": FRICTION})
    depths = [Measurement(f"test {d}", depth=d * 1e-6, depth_std=1e-6) for d in (41, 46, 50, 56)]
    tests = wearsim.identify(random, depths, found / "K.h5", fix={"load": "300 N"}, draws=32)
    (found / "K.csv").write_text(tests.posterior_csv())
    (found / "K.toml").write_text(tests.posterior_toml())
    return found


def scenario(folder: Path, **changed: object) -> wearsim.Scenario:
    """Return the rig with the posterior of K/H, and other values by key with two underscores."""
    overrides = {key.replace("__", "."): value for key, value in changed.items()}
    table = {"distribution": "posterior", "file": "K.csv"}
    return wearsim.load_scenario(
        folder / "rig.toml", {"wear.cylinder.k_over_h": table, **overrides}
    )


def test_life_states_predictive_and_plug_in_lives(folder: Path):
    lives = wearsim.life(scenario(folder), 1, scheduler="serial")
    found = lives.uncertain_life(10)
    levels = wearsim.open_results(folder / "K.h5").levels
    assert found is not None
    (kappa,) = lives.distribution.kappa
    # with K/H alone the life is kappa/K
    plug_in = kappa / np.exp(levels.plug_in[0] + levels.plug_in[1] * ndtri(0.9))
    assert found.plug_in == pytest.approx(plug_in, rel=2e-3)
    predictive = kappa / float(levels.quantile(np.array([0.9]))[0])
    assert lives.b(10).value == pytest.approx(predictive, rel=1e-3)
    assert found.predictive < found.plug_in
    assert lives.b(10).low < 0.8 * found.plug_in
    assert found.by_realisations == 0.0
    spread = np.log(found.high / found.low) / 3.92
    assert np.sqrt(found.by_tests) == pytest.approx(spread, rel=0.25)


def test_lives_with_other_inputs_name_what_would_help(folder: Path):
    path = folder / "continued.h5"
    wearsim.life(scenario(folder, friction__coefficient=FRICTION), 10, path, scheduler="serial")
    lives = wearsim.resume_ensemble(path, realisations=16, scheduler="serial")
    unbroken = wearsim.life(
        scenario(folder, friction__coefficient=FRICTION), 16, scheduler="serial"
    )
    found = lives.uncertain_life(10)
    assert found == unbroken.uncertain_life(10)
    assert found is not None
    assert 0.0 < found.by_realisations < found.by_tests
    table = lives.view.details()[0]
    assert "given these 4 specimens" in table.heads[0]
    assert lives.view.data()["b"]["10"]["given_tests"]["plug_in"] == found.plug_in
    survival = lives.survival(600_000)
    assert survival.high - survival.low > 0.05


def test_posterior_is_used_without_new_tests(folder: Path):
    before = wearsim.life(
        scenario(folder, wear__cylinder__k_over_h=FRICTION | {"median": "1.1e-11 1/Pa"}),
        1,
        scheduler="serial",
    )
    assert before.uncertain_life(10) is None
    after = before.with_posterior(folder / "K.csv")
    direct = wearsim.life(scenario(folder), 1, scheduler="serial")
    # the two tests have other wear factors, and other steps
    assert after.b(10).value == pytest.approx(direct.b(10).value, rel=1e-3)
    assert after.levels is not None
    assert after.levels.specimens == 4


def test_inputs_that_the_posterior_contains_are_refused(folder: Path):
    # the load was fixed as known, the creepage was not drawn
    scenario(folder, load__normal_force=LOAD)
    creepage = {"distribution": "lognormal", "median": 1e-3, "factor": 1.3}
    with pytest.raises(ScenarioError, match=r"\[creepage.longitudinal\].*counts twice"):
        scenario(folder, creepage__longitudinal=creepage)
    misaligned = {"distribution": "disc", "radius": "1 mrad"}
    with pytest.raises(ScenarioError, match=r"contains the scatter of creepage\.(yaw|tilt)"):
        scenario(folder, creepage__misalignment=misaligned)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEADER.replace("weight", "w") + ROW + ROW, "weight"),
        (HEADER + "1e-11,0,1\n" + ROW, "column 'scatter' must be above 0, got 0 in row 1"),
        (HEADER + "-1e-11,0.2,1\n" + ROW, "column 'median' must be above 0"),
        (HEADER.replace(" [1/Pa]", "") + ROW + ROW, "column 'median' has no unit"),
    ],
)
def test_wrong_tables_are_refused(folder: Path, text: str, words: str):
    (folder / "wrong.csv").write_text(text)
    table = {"distribution": "posterior", "file": "wrong.csv"}
    with pytest.raises(ScenarioError, match=r"wrong\.csv") as caught:
        scenario(folder, wear__cylinder__k_over_h=table)
    assert words in str(caught.value)


def test_table_is_read_again_where_its_content_changes(folder: Path):
    table = {"distribution": "posterior", "file": "changed.csv"}

    def read(median: str) -> wearsim.Scenario:
        (folder / "changed.csv").write_text(f"{HEADER}{median},0.2,1\n{median},0.3,1\n")
        return scenario(folder, wear__cylinder__k_over_h=table)

    first, again, other = read("1e-11"), read("1e-11"), read("2e-11")
    assert again.random[0].scalar._table is first.random[0].scalar._table
    assert other.random[0].mean[0] == pytest.approx(2.0 * first.random[0].mean[0], rel=1e-12)


def test_shell_goes_from_tests_to_lives(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(folder)

    def run(*arguments: str) -> Result:
        return CliRunner().invoke(app, list(arguments))

    options = ("-n", "1", "--limit", "depth=50um", "--json", "-q")
    found = run("life", "rig.toml", *options, "--posterior", "K.csv", "-o", "l.h5")
    assert found.exit_code == 0, found.stderr
    given = json.loads(found.stdout)["b"]["10"]["given_tests"]
    assert given["low"] < given["predictive"] < given["plug_in"] < given["high"]
    again = run("life", "l.h5", "--posterior", "K.csv", "--json")
    assert json.loads(again.stdout)["b"]["10"]["given_tests"] == given
    missing = run("life", "rig.toml", *options, "--posterior", "none.csv")
    assert missing.exit_code == 2
    assert "none.csv" in missing.stderr


def test_factor_of_both_bodies_has_the_posterior_of_the_cylinder(folder: Path):
    both = wearsim.load_scenario(
        folder / "rig.toml",
        {"wear.factor": FRICTION | {"median": 1.0}, "wear.roller.k_over_h": "2e-12 1/Pa"},
    )

    (item,) = with_posterior(both, folder / "K.csv").random
    alone = scenario(folder).random[0]
    assert item.name == "wear.factor"
    assert 1.1e-11 * item.mean[0] == pytest.approx(alone.mean[0], rel=1e-12)
