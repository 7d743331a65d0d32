"""The command `wearsim life`."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from cli_examples import Command

from tests.studies.life.test_life import design
from wearsim.report.page import plots
from wearsim.report.panels import Panel, Sheet
from wearsim.studies.life.api import life
from wearsim.studies.life.result import LifeResult
from wearsim.studies.opening import open_results

HERE = ("--scheduler", "serial", "-q")


@pytest.fixture
def slim(tmp_path: Path) -> Path:
    """A scenario with a limit."""
    path = tmp_path / "slim.toml"
    path.write_text(design().text)
    return path


@pytest.fixture
def wide(tmp_path: Path) -> Path:
    """The same with a wider crown."""
    path = tmp_path / "wide.toml"
    path.write_text(design(roller__crown_radius="600 mm").text)
    return path


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the lives of both designs."""
    folder = tmp_path_factory.mktemp("pair")
    for name, radius in (("wide", "600 mm"), ("slim", "500 mm")):
        scenario = folder / f"{name}.toml"
        scenario.write_text(design(roller__crown_radius=radius).text)
        life(scenario, 8, folder / f"{name}-life.h5", scheduler="serial")
    return folder


def life_of(command: Command, *words: object) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(command("life", *words, "--json", *HERE).stdout)
    return found


def test_json_has_the_life_of_a_design(command: Command, slim: Path) -> None:
    found = life_of(command, slim, "-n", 10, "--target", 2000, "--b", "10,50")
    assert (found["unit"], found["realisations"], found["censored"], found["failed"]) == (
        "passes",
        10,
        0,
        0,
    )
    assert found["b"].keys() == {"10", "50"}
    for one in found["b"].values():
        assert one["low"] < one["value"] < one["high"]
        assert one["numerical_low"] < one["value"] < one["numerical_high"]
    probability = found["probability_before_target"]
    assert 0.0 < probability["low"] < probability["value"] < probability["high"] < 1.0
    assert found["first_limits"] == {"depth": 1.0}
    assert {fit["family"] for fit in found["fits"]} == {"log-normal", "Weibull"}


def test_two_designs_are_compared(command: Command, slim: Path, wide: Path) -> None:
    found = life_of(command, wide, slim, "-n", 8)
    assert found["labels"] == ["wide", "slim"]
    for name in ("b10_ratio", "same_machine", "two_specimens"):
        assert found[name]["low"] <= found[name]["value"] <= found[name]["high"]
    assert found["b10_ratio"]["value"] == pytest.approx((6.0 / 5.0) ** 0.5, rel=0.02)
    again = life_of(command, "wide-life.h5", "slim-life.h5")
    assert again["b10_ratio"] == found["b10_ratio"]
    compared = command("compare", "wide-life.h5", "slim-life.h5", "--json")
    assert json.loads(compared.stdout)["b10_ratio"] == found["b10_ratio"]
    text = command("life", "wide-life.h5", "slim-life.h5", *HERE).stdout
    assert "wide outlives slim on 100.0 %" in " ".join(text.split())
    assert "a specimen of wide outlives a specimen of slim" in " ".join(text.split())


def test_stopped_comparison_states_how_to_go_on(
    command: Command, slim: Path, wide: Path, pair: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = life_of(command, pair / "wide-life.h5", pair / "slim-life.h5")
    with monkeypatch.context() as patch:
        patch.setattr(Event, "is_set", lambda _: True)
        stopped = command("life", wide, slim, "-n", 8, *HERE)
    assert stopped.exit_code == 130
    refused = command("life", wide, slim, "-n", 8, *HERE)
    assert refused.exit_code == 2
    unfinished = (
        "error: wide-life.h5: already exists and is unfinished; `wearsim resume wide-life.h5`"
    )
    assert refused.stderr.startswith(unfinished)
    assert len(refused.stderr.splitlines()) == 1
    for text in (stopped.stderr, refused.stderr):
        resumed, other, both = re.findall(r"wearsim (resume [\w.-]+|life [^`\n]+)", text)
        assert resumed == "resume wide-life.h5"
    assert command(*shlex.split(resumed), *HERE).exit_code == 0
    assert command(*shlex.split(other), "-n", 8, *HERE).exit_code == 0
    again = json.loads(command(*shlex.split(both), "--json").stdout)
    assert again["b10_ratio"] == whole["b10_ratio"]


def test_wrong_limit_is_refused_before_an_existing_file(command: Command, slim: Path) -> None:
    Path("slim-life.h5").write_text("kept")
    refused = command("life", slim, "--limit", "depht=50um", *HERE)
    assert "is not a limit of a life" in refused.stderr
    assert "exists" not in refused.stderr


def test_results_file_is_named_after_the_scenario(command: Command, slim: Path) -> None:
    again = slim.with_name("slim-life.toml")
    again.write_text(slim.read_text())
    assert command("life", again, "-n", 2, *HERE).exit_code == 0
    assert sorted(path.name for path in again.parent.glob("*.h5")) == ["slim-life.h5"]


def test_table_states_limits_and_reason(command: Command, slim: Path) -> None:
    logged = ("--set", "evolution.stepper=per-pass", "--set", "limit.depth=1 um")
    text = command("life", slim, "-n", 2, *logged, *HERE).stdout
    assert "depth 1.000 um" in text
    assert "lives are counted: every pass is solved separately" in text
    assert "too few lives" in text
    assert "takes 69 lives" in text
    assert "lives passes" not in text


def test_sweep_compares_with_the_first_value(command: Command, slim: Path) -> None:
    done = command("life", slim, "-n", 2, "--sweep", "roller.crown_radius=500mm,600mm", *HERE)
    assert "500 mm has" in " ".join(done.stdout.split())
    assert sorted(path.name for path in Path().glob("*.h5")) == [
        "slim-life-500mm.h5",
        "slim-life-600mm.h5",
    ]


@pytest.fixture
def swept_panel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw on pages only the panel of lives against the design; see tests/report for others."""

    def panels_of(sheet: Sheet) -> tuple[dict[str, Panel], list[str]]:
        panels, steps = of_all(sheet)
        return {name: panel for name, panel in panels.items() if name == "against"}, steps

    of_all = plots.panels_of
    monkeypatch.setattr(plots, "panels_of", panels_of)


@pytest.mark.usefixtures("swept_panel")
def test_sweep_states_lives_against_the_design(command: Command, slim: Path) -> None:
    radii = "roller.crown_radius=600mm,500mm"
    found = life_of(command, slim, "-n", 6, "--sweep", radii, "--figure", "sweep.svg")
    against = found["against"]
    assert (against["key"], against["unit"]) == ("roller.crown_radius", "m")
    assert against["values"] == [0.6, 0.5]
    lives = [one["b"]["10"] for one in found["designs"]]
    assert [life["value"] for life in against["b"]["10"]] == [life["value"] for life in lives]
    figure = Path("sweep.svg").read_text()
    assert "roller.crown_radius [mm]" in figure
    files = [f"slim-life-{value}mm.h5" for value in (600, 500)]
    again = life_of(command, *files)
    assert again["against"] == against
    assert again["labels"] == ["600 mm", "500 mm"]
    command("report", *files, "-o", "sweep.html")
    assert "against roller.crown_radius" in Path("sweep.html").read_text()


def test_sweep_of_words_has_no_lives_against_the_design(command: Command, slim: Path) -> None:
    found = life_of(command, slim, "-n", 2, "--sweep", "contact.model=slender,winkler")
    assert "against" not in found
    assert found["designs"][0]["variable"] is None


def test_file_answers_another_target(command: Command, pair: Path) -> None:
    file = pair / "slim-life.h5"
    one, other = (
        life_of(command, file, "--target", target)["probability_before_target"]["value"]
        for target in ("1800", "40 s")
    )
    assert 0.0 < one < other


def test_extended_study_is_resumed(command: Command, slim: Path) -> None:
    command("life", slim, "-n", 4, "-o", "one.h5", *HERE)
    command("resume", "one.h5", "-n", 6, *HERE)
    result = open_results("one.h5")
    assert isinstance(result, LifeResult)
    assert result.count == 6
    again = command("resume", "one.h5", *HERE)
    assert "B10" in again.stdout
    assert again.stderr.startswith("note: nothing to do: the study of lives is finished")


def test_figure_is_written(command: Command, pair: Path) -> None:
    files = pair / "wide-life.h5", pair / "slim-life.h5"
    command("life", *files, "--figure", "lives.png", *HERE)
    assert Path("lives.png").stat().st_size > 20_000
    command("plot", files[1], "-o", "one.svg")
    assert Path("one.svg").is_file()


def test_effects_have_sign_and_interval(command: Command, pair: Path) -> None:
    found = life_of(command, pair / "slim-life.h5")["effects_on_life"]
    factor, *others = found
    assert factor["input"] == "wear.cylinder.k_over_h"
    assert factor["sign"] == -1
    ends = factor["factor_at_90_percent"]
    assert ends["low"] == ends["value"] == ends["high"] == pytest.approx(1.5**-1.2815516)
    for other in others:
        assert other["factor_at_90_percent"]["low"] < other["factor_at_90_percent"]["high"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--limit", "dept=5um"], "is not a limit of a life, expected depth, roller_depth,"),
        (["--limit", "depth=-5um"], "must be above zero"),
        (["--limit", "lift_error=5um"], "is a quantity of cams"),
        (["--target", "5 kg"], "is not a life"),
        (["--target", "1e9", "--max", "1e6"], "beyond the maximum"),
        (["--b", "10,x"], "is not a list of percentages"),
        (["--precision", "depth"], "cannot read the target"),
    ],
)
def test_bad_input_has_exit_code_2(
    command: Command, slim: Path, words: list[str], message: str
) -> None:
    done = command("life", slim, *words, *HERE)
    assert done.exit_code == 2
    assert message in " ".join(done.output.split())
    assert not list(Path().glob("*.h5"))


@pytest.mark.parametrize(
    ("words", "option"),
    [
        ((), "--max"),  # a test without a length needs one
        (("--max", "x"), "--max"),
        (("--max", "1e6", "--target", "x"), "--target"),
        (("--max", "1e6", "--target", "2e6"), "--max"),
        (("--max", "1e6", "--rare", "300"), "--rare"),
        (("--max", "1e6", "--limit", "x=1um"), "--limit"),
        (("--max", "1e6", "--precision", "x"), "--precision"),
    ],
)
def test_wrong_option_is_named(
    command: Command, slim: Path, words: tuple[str, ...], option: str
) -> None:
    endless = re.sub(r"^(duration|passes) = .*$", "", slim.read_text(), flags=re.MULTILINE)
    slim.write_text(endless)
    done = command("life", slim, *words, *HERE)
    assert done.exit_code == 2
    assert f"Invalid value for {option}" in done.output


def test_limit_that_is_never_reached_is_stated(command: Command, slim: Path) -> None:
    never = ["--limit", "depth=5mm", "--max", "3000", "--figure", "never.svg"]
    text = " ".join(command("life", slim, "-n", 3, *never, *HERE).output.split())
    assert "3 censored at 3,000 passes" in text
    assert "B50 above 3,000" in text
    assert "no realisation reaches a limit within 3,000 passes" in text
    assert "nothing, no two lives differ" in text
    figure = Path("never.svg").read_text()
    assert "no limit was reached" in figure
    assert "friction.coefficient" not in figure


def test_limit_that_is_reached_at_once_is_stated(command: Command, slim: Path) -> None:
    fresh = ["--limit", "peak_pressure=100MPa", "--figure", "fresh.svg"]
    text = " ".join(command("life", slim, "-n", 3, *fresh, *HERE).output.split())
    assert "3 reached a limit at once, when fresh" in text
    assert "every life is 0" in text
    assert "nothing, no two lives differ" in text
    assert "RuntimeWarning" not in text
    assert "every life is 0" in Path("fresh.svg").read_text()


def test_all_failed_has_exit_code_1(command: Command, slim: Path) -> None:
    done = command("life", slim, "-n", 3, "--set", "evolution.max_steps=2", *HERE)
    assert done.exit_code == 1
    assert "all realisations failed" in done.output
