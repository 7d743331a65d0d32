"""Distributions found on the Python path by their entry points, in separate processes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from plugin_examples import DATA, RIG, TABLES


def wearsim(*arguments: object, plugins: tuple[str, ...]) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join(str(DATA / name) for name in plugins)
    return subprocess.run(
        [sys.executable, "-m", "wearsim", *map(str, arguments)],
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )


def write_rig(folder: Path, contact: str) -> Path:
    tables = TABLES | {"contact": contact}
    text = RIG + "".join(f"\n[{name}]\n{body}\n" for name, body in tables.items())
    path = folder / "rig.toml"
    path.write_text(text)
    return path


def test_installed_plugin_is_listed_with_its_distribution():
    done = wearsim("plugins", "--json", plugins=("tiny",))
    assert done.returncode == 0, done.stderr
    listed = json.loads(done.stdout)
    own = {
        item["name"]: item for item in listed["plugins"] if item["distribution"] == "wearsim-tiny"
    }
    assert set(own) == {"foundation", "abrasion", "drift"}
    assert own["foundation"]["kind"] == "contact model"
    assert own["foundation"]["capabilities"] == []
    assert own["drift"]["capabilities"] == ["term"]
    assert {item["version"] for item in own.values()} == {"1.2"}
    assert listed["broken"] == []


def test_broken_distribution_is_listed_with_its_cause():
    done = wearsim("plugins", "--json", plugins=("broken", "tiny"))
    assert done.returncode == 0, done.stderr
    listed = json.loads(done.stdout)
    assert "foundation" in {item["name"] for item in listed["plugins"]}
    (broken,) = listed["broken"]
    assert (broken["distribution"], broken["version"]) == ("wearsim-broken", "0.3")
    assert broken["cause"] == "ModuleNotFoundError: No module named 'a_library_nobody_has'"


def test_run_stores_the_name_of_the_plugin_it_uses(tmp_path):
    path = write_rig(tmp_path, 'model = "foundation"\nwidth = "8 mm"\nstrips = 81')
    done = wearsim("run", path, "-o", tmp_path / "rig.h5", "--json", plugins=("tiny",))
    assert done.returncode == 0, done.stderr
    output = json.loads(done.stdout)
    assert (output["model"], output["stepper"]) == ("foundation", "stabilised")
    shown = wearsim("show", tmp_path / "rig.h5", plugins=("tiny",))
    assert "wearsim-tiny" in shown.stdout
    resumed = wearsim("resume", tmp_path / "rig.h5", "--until", "2 min", plugins=())
    assert resumed.returncode == 2
    assert "needs the contact model 'foundation' of wearsim-tiny 1.2" in resumed.stderr
    assert "install it and resume again" in resumed.stderr


def test_missing_plugin_error_names_what_failed_to_load(tmp_path):
    path = write_rig(tmp_path, 'model = "sparse"')
    done = wearsim("check", path, plugins=("broken",))
    assert done.returncode == 2
    assert "'sparse'" in done.stderr
    assert "wearsim-broken 0.3 failed to load" in done.stderr
    assert "a_library_nobody_has" in done.stderr
