"""Installs away from the checkout: wheels of all distributions, oldest and newest dependencies."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PLUGINS = sorted(path.parent for path in (ROOT / "plugins").glob("*/pyproject.toml"))
CONSTRAINTS = ("oldest", "newest")


def call(*command: object, folder: Path) -> str:
    """Return the output of a command, which must succeed."""
    hidden = {"PYTHONPATH", "NUMBA_CACHE_DIR"}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=folder,
        env={key: value for key, value in os.environ.items() if key not in hidden},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


# a numba that compiles the other kernels in the tests of the checkout needs not do it here again
FEW_KERNELS = ("--set", "contact.model=hertz")
SHORT = ("--set", "operation.duration=1 min")


def pinned(name: str) -> dict[str, str]:
    lines = (ROOT / "constraints" / f"{name}.txt").read_text().splitlines()
    return dict(line.split("==") for line in lines if not line.startswith("#"))


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the wheels of wearsim and all its plugins."""
    folder = tmp_path_factory.mktemp("wheels")
    options = ("--no-deps", "--no-build-isolation", "--no-index", "-q", "-w", folder)
    call(sys.executable, "-m", "pip", "wheel", *options, ROOT, *PLUGINS, folder=folder)
    return folder


def test_constraints_name_every_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    names = {re.split("[<>=]", item)[0] for item in project["dependencies"]}
    for name in CONSTRAINTS:
        assert set(pinned(name)) == names
    least = dict(item.split(">=") for item in project["dependencies"])
    for name, version in pinned("oldest").items():
        assert version.removesuffix(".0") == least[name].removesuffix(".0"), name


@pytest.mark.slow
def test_wheels_run_without_the_checkout(wheels: Path, tmp_path: Path):
    python = tmp_path / "venv" / "bin" / "python"
    call(sys.executable, "-m", "venv", "--without-pip", python.parents[1], folder=tmp_path)
    install = ("-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-index")
    names = ["wearsim", *(path.name for path in PLUGINS)]
    call(sys.executable, *install, "--find-links", wheels, *names, folder=tmp_path)
    # a plain path shows the dependencies and not the editable installs next to them
    packages = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    own = call(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", folder=ROOT)
    (Path(own.strip()) / "dependencies.pth").write_text("\n".join(sorted(packages)))

    def wearsim(*arguments: object) -> str:
        return call(python, "-m", "wearsim", *arguments, folder=tmp_path)

    where = call(python, "-c", "import wearsim; print(wearsim.__file__)", folder=tmp_path)
    assert Path(where.strip()).is_relative_to(tmp_path)
    wearsim("new", "scenario")
    wearsim("run", "scenario.toml", *SHORT, "-o", "run.h5")
    wearsim("new", "plugin", "sponge")
    assert (tmp_path / "wearsim-sponge" / "pyproject.toml").exists()
    wearsim("bench", "contact", "--quick", "-o", "bench")
    assert (tmp_path / "bench" / "contact.png").stat().st_size > 10_000
    rows = json.loads(wearsim("reproduce", "-n", "8", "--json"))
    assert rows["realisations"] == 8


@pytest.mark.slow
@pytest.mark.parametrize("name", CONSTRAINTS)
def test_dependencies_of_this_age_work(wheels: Path, tmp_path: Path, name: str):
    python = tmp_path / "venv" / "bin" / "python"
    call(sys.executable, "-m", "venv", python.parents[1], folder=tmp_path)
    (wheel,) = wheels.glob("wearsim-*.whl")
    constraints = ROOT / "constraints" / f"{name}.txt"
    install = ("install", "-q", "--disable-pip-version-check", "-c", constraints)
    call(python, "-m", "pip", *install, wheel, folder=tmp_path)
    listed = json.loads(call(python, "-m", "pip", "list", "--format", "json", folder=tmp_path))
    found = {item["name"].lower(): item["version"] for item in listed}
    assert pinned(name).items() <= found.items()

    def wearsim(*arguments: object) -> str:
        return call(python, "-m", "wearsim", *arguments, folder=tmp_path)

    is_that_of_the_tests = pinned(name)["numba"] == metadata.version("numba")
    short = (*SHORT, *FEW_KERNELS) if is_that_of_the_tests else SHORT
    assert "Commands" in wearsim("--help")
    wearsim("check", ROOT / "scenarios" / "rig-ensemble.toml")
    end = json.loads(wearsim("run", ROOT / "scenarios" / "rig-450min.toml", *short, "--json"))
    assert end["depth_m"] > 0.0
    wearsim("run", ROOT / "scenarios" / "rig-450min.toml", *short, "-o", "run.h5")
    wearsim("plot", "run.h5", "-o", "run.png")
    wearsim("show", "run.h5")
    assert json.loads(wearsim("schema"))["properties"]
