"""Designs as TOML with comments, as options of the shell and as scenarios."""

from __future__ import annotations

import shlex
import tomllib
from pathlib import Path

import pytest

import wearsim
from wearsim.scenario import parse_override
from wearsim_explore.design import Design

CAM = Path(__file__).parents[3] / "scenarios" / "cam-life.toml"


def test_saved_scenario_keeps_comments_and_has_the_changes(rig: Path) -> None:
    text = rig.read_text()
    design = Design(text, rig).with_change("roller.radius", "22 mm")
    design = design.with_change("wear.cylinder.k_over_h", "2e-11 1/Pa")
    lines = design.toml().splitlines()
    assert 'radius = "22 mm"          # of the rig' in lines
    assert 'k_over_h = "2e-11 1/Pa" # measured' in lines
    changed = [new for new, old in zip(lines, text.splitlines(), strict=True) if new != old]
    assert len(changed) == 2


def test_part_of_a_list_is_changed_in_its_place() -> None:
    text = CAM.read_text()
    design = Design(text, CAM).with_change("cam.motion.1.rise", "9 mm")
    design = design.with_change("cam.motion.3.rise", "-9 mm")
    different = set(design.toml().splitlines()) - set(text.splitlines())
    assert {line.strip() for line in different} == {
        '{law = "cycloidal", angle = "90 deg", rise = "9 mm"},',
        '{law = "cycloidal", angle = "90 deg", rise = "-9 mm"},',
    }


def test_options_give_the_same_scenario_at_the_shell() -> None:
    design = Design(CAM.read_text(), CAM)
    for key, value in {
        "title": "1 = 2",
        "cam.motion.1.rise": "8.5 mm",
        "cam.motion.3.rise": "-8.5 mm",
        "friction.coefficient.factor": 1.3,
        "limit.lift_error": None,
        "roller.radius": "21 mm",
    }.items():
        design = design.with_change(key, value)
    words = shlex.split(design.options())
    again = wearsim.load_scenario(CAM, dict(map(parse_override, words[1::2])))
    assert tomllib.loads(again.text) == tomllib.loads(design.toml()) == design.tables


def test_value_of_the_file_is_no_change(rig: Path) -> None:
    design = Design(rig.read_text(), rig).with_change("friction.coefficient", 0.2)
    assert design.options() == "--set friction.coefficient=0.2"
    assert design.with_change("friction.coefficient", 0.1).changes == {}


def test_key_that_excludes_another_replaces_it(rig: Path) -> None:
    design = Design(rig.read_text(), rig).with_change("operation.passes", 1000)
    assert "duration" not in tomllib.loads(design.toml())["operation"]
    assert design.scenario().total_passes == 1000


@pytest.mark.parametrize("name", ["../load.csv", "/etc/hostname", "inner/../../load.csv"])
def test_files_outside_the_folder_are_not_read(rig: Path, name: str) -> None:
    (rig.parents[1] / "load.csv").write_text("y [mm],height [um]\n-9,0\n9,0\n")
    design = Design(rig.read_text(), rig).with_change("cylinder.profile", name)
    with pytest.raises(wearsim.ScenarioError, match="outside the folder of the scenario") as caught:
        design.scenario()
    assert caught.value.mistakes[0].key == "profile"
