"""Plugin written by `wearsim new`, installed in a separate environment, used from the shell."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow  # creates an environment and installs into it

SCENARIO = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"


def run(*command: object, folder: Path) -> str:
    """Return the output of a command that must succeed."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with an environment `venv` in which the new plugin `sponge` is installed.

    The environment sees the packages of the one that runs the tests, and nothing is fetched.
    """
    folder = tmp_path_factory.mktemp("author")
    run(sys.executable, "-m", "venv", "--without-pip", folder / "venv", folder=folder)
    python = folder / "venv" / "bin" / "python"
    # addsitedir, since a path in sys.path does not process the .pth files of editable installs
    packages = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    own = run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", folder=folder)
    lines = [f"import site; site.addsitedir({path!r})" for path in sorted(packages)]
    (Path(own.strip()) / "packages_of_the_tests.pth").write_text("\n".join(lines))
    run(sys.executable, "-m", "wearsim", "new", "plugin", "sponge", folder=folder)
    run(
        *(sys.executable, "-m", "pip", "--python", python, "install", "--quiet"),
        *("--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check"),
        folder / "wearsim-sponge",
        folder=folder,
    )
    return folder


def wearsim(folder: Path, *arguments: object) -> str:
    return run(folder / "venv" / "bin" / "python", "-m", "wearsim", *arguments, folder=folder)


def test_plugin_is_listed_with_its_distribution(folder: Path) -> None:
    listed = json.loads(wearsim(folder, "plugins", "--json"))
    (own,) = (item for item in listed["plugins"] if item["name"] == "sponge")
    assert (own["distribution"], own["version"]) == ("wearsim-sponge", "0.1.0")
    assert own["capabilities"] == ["creepage_variation", "local_friction"]
    assert listed["broken"] == []


def test_plugin_is_absent_from_the_outer_environment(folder: Path) -> None:
    listed = json.loads(run(sys.executable, "-m", "wearsim", "plugins", "--json", folder=folder))
    assert "sponge" not in {item["name"] for item in listed["plugins"]}


def test_scenario_with_the_plugin_is_checked(folder: Path) -> None:
    output = wearsim(folder, "check", SCENARIO, "--set", "contact.model=sponge")
    assert "sponge: elastic foundation in gross sliding" in " ".join(output.split())


def test_whole_rig_test_runs_and_stores_the_plugin_name(folder: Path) -> None:
    model = ["--set", "contact.model=sponge"]
    output = wearsim(folder, "run", SCENARIO, *model, "-o", "sponge.h5", "--json", "--quiet")
    result = json.loads(output)
    assert (result["model"], result["stepper"], result["finished"]) == (
        "sponge",
        "stabilised",
        True,
    )
    assert result["passes"] == 1_350_000
    assert "wearsim-sponge" in wearsim(folder, "show", "sponge.h5")


def test_tests_of_the_plugin_pass(folder: Path) -> None:
    python = folder / "venv" / "bin" / "python"
    output = run(
        *(python, "-m", "pytest", "-q", "-p", "no:cacheprovider"),
        *("-W", "error", folder / "wearsim-sponge" / "tests"),
        folder=folder,
    )
    assert " passed" in output
    assert "skipped" not in output
