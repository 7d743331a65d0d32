"""Returns from the field: files, refusals, results of one and two designs, and the shell."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import wearsim
from tests.studies.identify.grooves import TEXT
from wearsim.cli.app import app
from wearsim.errors import ScenarioError
from wearsim.studies.returns.table import UnitsOf, read_returns

RIG = UnitsOf("rig", "passes", 50.0, ("depth", "worn_volume"))
HEAD = "life,state\n"
POSTERIOR = {"distribution": "posterior", "file": "K.csv"}
KNOWN = 'wear.cylinder.k_over_h={distribution="lognormal", median="1e-11 1/Pa", factor=1.5}'
UNITS = """life [passes],low [passes],high [passes],state,limit,unit
400000,,,failed,depth,A1
,500000,600000,failed,depth,A2
700000,,,suspended,,A3
800000,,,suspended,,A4
650000,,,failed,crack,A5
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a posterior of K/H, returns, and lives of a rig."""
    found = tmp_path_factory.mktemp("returns")
    m, t = np.meshgrid(np.linspace(-25.6, -24.8, 9), np.linspace(0.1, 0.7, 13))
    weight = np.exp(-0.5 * ((m + 25.2) / 0.2) ** 2 - 0.5 * (t / 0.3) ** 2)
    rows = zip(np.exp(m).ravel(), t.ravel(), weight.ravel(), strict=True)
    lines = [f"{median:.6e},{scatter:g},{share:.6e}" for median, scatter, share in rows]
    text = ["# specimens: 8", "median [1/Pa],scatter,weight", *lines]
    (found / "K.csv").write_text("\n".join(text))
    (found / "returns.csv").write_text(UNITS)
    (found / "rig.toml").write_text(TEXT + '\n[limit]\ndepth = "50 um"\n')
    scenario = wearsim.load_scenario(found / "rig.toml", {"wear.cylinder.k_over_h": POSTERIOR})
    wearsim.life(scenario, 1, found / "rig.h5", scheduler="serial", target=600_000)
    return found


def test_columns_are_read_with_their_units(tmp_path: Path):
    path = tmp_path / "r.csv"
    path.write_text("life [h];state;low [h];high [h]\n2;failed;;\n;failed;0;3\n5;suspended;;\n")
    found = read_returns(path, [RIG])
    per_hour = 3600.0 * RIG.rate
    assert found.fleet.low.tolist() == [2 * per_hour, 0.0, 5 * per_hour]
    assert found.fleet.high.tolist() == [2 * per_hour, 3 * per_hour, np.inf]
    assert found.units == ["line 2", "line 3", "line 4"]
    assert found.running.tolist() == [False, False, True]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("life,stat\n4e5,failed\n", "unknown column 'stat' (is it 'state'?)"),
        (HEAD + "-4e5,failed\n", "line 2: column 'life': must be above 0, got -4e5"),
        (HEAD + "4e5,failed\n,suspended\n", "line 3: is suspended without its age"),
        (HEAD + ",failed\n", "line 2: failed without a life"),
        (HEAD + "4e5,broken\n", "line 2: column 'state', got 'broken'"),
        (HEAD + "many,failed\n", "column 'life': is not a number, got 'many'"),
        ("life [kg],state\n4e5,failed\n", "column 'life' has an unknown unit, got [kg]"),
        ("low,high,state\n5e5,4e5,failed\n", "'low' must be below 'high'"),
        ("life,low,state\n5e5,4e5,failed\n", "has a life, and low or high"),
        ("life,state,design\n5e5,failed,rigg\n", "unknown design (is it 'rig'?)"),
        (HEAD, "has no units"),
    ],
)
def test_wrong_rows_are_one_clear_error(tmp_path: Path, text: str, words: str):
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    with pytest.raises(ScenarioError, match=r"wrong\.csv: ") as caught:
        read_returns(path, [RIG])
    assert words in str(caught.value)


def test_returns_update_the_life(folder: Path):
    lives = wearsim.open_results(folder / "rig.h5")
    field = wearsim.field_returns(lives, folder / "returns.csv")
    # with a life factor of 1 and K/H alone, the prior is that of the lives
    none = wearsim.field_returns(lives, folder / "returns.csv", life_factor=1.0)
    assert none.before(10).predictive == pytest.approx(lives.b(10).value, rel=1e-3)
    assert field.after(10).by_tests < field.before(10).by_tests
    assert [unit.name for unit in field.running] == ["A3", "A4"]
    assert field.returns.others == {"crack": 1}
    assert field.check.observed[-1] == 2.0
    assert field.factor.low < 1.0 < field.factor.high
    assert "1 unit withdrawn by another cause, crack" in field.view.notes[0]
    older, younger = (unit.remaining.lives[1].value for unit in field.running[::-1])
    assert older < younger


def test_two_designs_share_what_is_not_known(folder: Path):
    lives = wearsim.open_results(folder / "rig.h5")
    rows = ["life,state,design", "4e5,failed,old", "9e5,suspended,new"]
    (folder / "both.csv").write_text("\n".join(rows))
    field = wearsim.field_returns([lives, lives], folder / "both.csv", labels=["old", "new"])
    assert field.b(10, 0) == field.b(10, 1)
    assert field.view.rows()[0].label == "B10 after of old"


def test_lives_without_a_posterior_are_refused(folder: Path):
    lives = wearsim.open_results(folder / "rig.h5")
    known = lives.with_wear_factor(
        {"distribution": "lognormal", "median": "1e-11 1/Pa", "factor": 1.5}
    )
    with pytest.raises(ValueError, match="takes a posterior of wear tests"):
        wearsim.field_returns(known, folder / "returns.csv")
    (folder / "K2.csv").write_text((folder / "K.csv").read_text().replace("0.7,", "0.75,"))
    both = [lives, lives.with_posterior(folder / "K2.csv")]
    with pytest.raises(ValueError, match="different units of life or posteriors"):
        wearsim.field_returns(both, folder / "returns.csv")
    with pytest.raises(ValueError, match="must be from 1 on"):
        wearsim.field_returns(lives, folder / "returns.csv", life_factor=0.5)


def test_shell_shows_and_writes_returns(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(folder)

    def run(*arguments: str) -> Result:
        return CliRunner().invoke(app, ["life", *arguments])

    given = ("rig.h5", "--returns", "returns.csv")
    found = run(*given, "--json", "--table", "units.csv", "--page", "field.html")
    assert found.exit_code == 0, found.stderr
    data = json.loads(found.stdout)
    b10 = data["designs"][0]["b"]["10"]
    assert b10["after"]["high"] / b10["after"]["low"] < b10["before"]["high"] / b10["before"]["low"]
    assert (
        (folder / "units.csv").read_text().startswith("unit,design,age [passes],further life B10")
    )
    assert "goodness of fit after" in (folder / "field.html").read_text()
    again = run(*given, "--table", "units.csv")
    assert again.exit_code == 2
    (folder / "wrong.csv").write_text(HEAD + ",suspended\n")
    for arguments, words in (
        ((*given, "--life-factor", "0.5"), "Invalid value for '--life-factor'"),
        (("rig.h5", "--returns", "none.csv"), "none.csv: the file cannot be read"),
        (("rig.h5", "--returns", "wrong.csv"), "is suspended without its age"),
        (("rig.h5", "--life-factor", "2"), "goes with --returns"),
        (("rig.h5", "--table", "t.csv"), "goes with --returns or --demonstrate"),
        ((*given, "--page", "page.txt"), "has no known format of a page, expected .html"),
        (("rig.toml", "--set", KNOWN, "--returns", "returns.csv"), "give --posterior"),
    ):
        refused = run(*arguments)
        assert refused.exit_code == 2, arguments
        assert words in " ".join(refused.stderr.replace("│", " ").split())
