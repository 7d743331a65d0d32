"""Python as good as the shell: scenarios from texts, tables and paths; remedies; any file."""

from __future__ import annotations

import pickle
import tomllib
from pathlib import Path

import numpy as np
import pytest
from rig_text import short_rig

import wearsim
from wearsim import Scenario
from wearsim.errors import Interrupted, ResultsFileError, ScenarioError

RANDOM = {"friction.coefficient": {"distribution": "uniform", "low": 0.08, "high": 0.12}}


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a scenario file in the current folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "rig.toml"
    path.write_text(short_rig())
    return path


def test_scenario_from_a_text_equals_that_of_a_file(rig: Path) -> None:
    text = rig.read_text()
    assert Scenario.from_toml(text).sha256 == wearsim.load_scenario(rig).sha256
    changed = Scenario.from_toml(text, {"load.normal_force": "350 N"}, name="b")
    assert changed.title == "b"
    assert changed.load.options.normal_force == 350.0


def test_scenario_from_tables_equals_that_of_their_text(rig: Path) -> None:
    tables = tomllib.loads(rig.read_text())
    tables["friction"] = {"coefficient": np.float64(tables["friction"]["coefficient"])}
    made, read = Scenario.from_dict(tables), wearsim.load_scenario(rig)
    for name in ("roller", "operation", "friction", "creepage", "contact", "evolution", "outputs"):
        assert getattr(made, name) == getattr(read, name)
    assert Scenario.from_toml(made.text).sha256 == made.sha256
    with pytest.raises(ScenarioError, match=r"scenario: friction\.coefficient: has a value that"):
        Scenario.from_dict({**tables, "friction": {"coefficient": None}})


def test_files_of_a_scenario_from_a_text_are_in_its_folder(rig: Path, tmp_path: Path) -> None:
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / "worn.csv").write_text("y [mm],height [um]\n-9,0\n0,-1\n9,0\n")
    profile = {"cylinder.profile": Path("worn.csv")}
    made = Scenario.from_toml(rig.read_text(), profile, folder=tmp_path / "files")
    assert made.cylinder.profile.height.min() == -1e-6
    with pytest.raises(ScenarioError, match=r"worn\.csv"):
        Scenario.from_toml(rig.read_text(), profile)


@pytest.mark.parametrize("number", [np.float64(0.2), np.float32(0.25), np.array(0.5), 1])
def test_overrides_take_numbers_of_numpy(rig: Path, number: object) -> None:
    overrides = {"friction.coefficient": number, "operation.rollers": np.int64(2)}
    scenario = wearsim.load_scenario(rig, overrides)
    assert scenario.friction.coefficient == float(number)
    assert scenario.operation.rollers == 2
    offsets = {"roller.offset": np.array(["1 mm", "2 mm"]), **overrides}
    assert wearsim.load_scenario(rig, offsets).roller.offset == (1e-3, 2e-3)


def test_scenario_has_a_short_repr(rig: Path) -> None:
    text = repr(wearsim.load_scenario(rig, RANDOM))
    assert text.startswith("<Scenario '")
    assert "1500 passes" in text
    assert "1 random" in text
    assert len(text) < 120


@pytest.mark.parametrize("kind", [str, Path])
def test_paths_are_accepted_as_scenarios(rig: Path, kind: type) -> None:
    path, scenario = kind(rig), wearsim.load_scenario(rig)
    assert wearsim.solve_contact(path).power == wearsim.solve_contact(scenario).power
    assert wearsim.run(path).depth[-1] == wearsim.run(scenario).depth[-1]
    with pytest.raises(ScenarioError, match="no random input"):
        wearsim.dissipation(path, 2)
    with pytest.raises(ScenarioError, match="no random input"):
        wearsim.ensemble(path, 2, "a.h5")


def test_something_else_than_a_scenario_is_refused(rig: Path) -> None:
    with pytest.raises(
        TypeError, match="scenario must be a Scenario or the path of its file, got a dict"
    ):
        wearsim.run({})  # type: ignore[arg-type]
    with pytest.raises(ScenarioError, match=r"is a text.*Scenario\.from_toml reads it"):
        wearsim.run(rig.read_text())


def test_results_of_every_kind_are_opened(rig: Path) -> None:
    random = wearsim.load_scenario(rig, RANDOM)
    wearsim.run(rig, "a.h5")
    wearsim.dissipation(random, 2, "b.h5")
    wearsim.ensemble(random, 2, "c.h5", scheduler="serial")
    found = [wearsim.open_results(name) for name in ("a.h5", Path("b.h5"), "c.h5")]
    kinds = [wearsim.Result, wearsim.DissipationResult, wearsim.EnsembleResult]
    assert [type(result) for result in found] == kinds


def test_remedies_name_arguments_and_not_options(rig: Path) -> None:
    random = wearsim.load_scenario(rig, RANDOM)
    wearsim.run(rig, "a.h5")
    messages = []
    for call in (
        lambda: wearsim.run(rig, "a.h5"),
        lambda: wearsim.run(rig, "no/a.h5"),
        lambda: wearsim.run(rig, "a.png"),
        lambda: wearsim.run(rig, "b.h5", stop_requested=lambda: True),
        lambda: wearsim.load_scenario("a.h5"),
        lambda: wearsim.dissipation(random, 2000, "c.h5", stop_requested=lambda: True),
        lambda: wearsim.ensemble(
            random, 9, "d.h5", scheduler="serial", stop_requested=lambda: True
        ),
        lambda: wearsim.ensemble(
            random, 9, "e.h5", plan="latin-hypercube", precision="depth.mean 1%"
        ),
    ):
        with pytest.raises((ResultsFileError, ScenarioError, Interrupted)) as caught:
            call()
        messages.append(str(caught.value))
        copy = pickle.loads(pickle.dumps(caught.value))
        assert (str(copy), copy.at_shell) == (messages[-1], caught.value.at_shell)
    assert not [text for text in messages if " -" in text or "wearsim " in text]
    assert "force=True replaces it" in messages[0]
    assert 'wearsim.resume("b.h5")' in messages[3]
    assert 'wearsim.resume_ensemble("d.h5")' in messages[6]
