"""Installs away from the checkout: wheels of all distributions, oldest and newest dependencies."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PLUGINS = sorted(path.parent for path in (ROOT / "plugins").glob("*/pyproject.toml"))
PUBLISHED = [path for path in PLUGINS if path.name != "wearsim-template"]
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
    """Return a folder with the wheels of wearsim and all its plugins, also of `make release`."""
    if made := os.environ.get("WEARSIM_DIST"):
        return ROOT / made
    folder = tmp_path_factory.mktemp("wheels")
    options = ("--no-deps", "--no-build-isolation", "--no-index", "-q", "-w", folder)
    call(sys.executable, "-m", "pip", "wheel", *options, ROOT, *PLUGINS, folder=folder)
    return folder


def test_constraints_name_every_dependency():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    # the plugins need some more, those of reports among them
    needed = [*project["dependencies"], *project["optional-dependencies"]["report"]]
    least = dict(item.split(">=") for item in needed)
    for name in CONSTRAINTS:
        assert set(pinned(name)) == set(least)
    for plugin in PUBLISHED:
        metadata = tomllib.loads((plugin / "pyproject.toml").read_text())["project"]
        for item in metadata["dependencies"]:
            own, _, version = item.partition(">=")
            assert own.startswith("wearsim") or least[own] == version, plugin.name
    for name, version in pinned("oldest").items():
        assert version.removesuffix(".0") == least[name].removesuffix(".0"), name


@pytest.mark.slow
def test_wheels_run_without_the_checkout(wheels: Path, tmp_path: Path):
    python = tmp_path / "venv" / "bin" / "python"
    call(sys.executable, "-m", "venv", "--without-pip", python.parents[1], folder=tmp_path)
    install = ("-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-index")
    names = ["wearsim", *(path.name for path in PUBLISHED)]
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
    names = ["wearsim", *(path.name.replace("-", "_") for path in PUBLISHED)]
    paths = [path for name in names for path in wheels.glob(f"{name}-*.whl")]
    constraints = ROOT / "constraints" / f"{name}.txt"
    install = ("install", "-q", "--disable-pip-version-check", "-c", constraints)
    call(python, "-m", "pip", *install, *paths, folder=tmp_path)
    call(python, "-m", "pip", "check", folder=tmp_path)
    listed = json.loads(call(python, "-m", "pip", "list", "--format", "json", folder=tmp_path))
    found = {item["name"].lower(): item["version"] for item in listed}
    assert pinned(name).items() <= found.items()

    def wearsim(*arguments: object) -> str:
        return call(python, "-m", "wearsim", *arguments, folder=tmp_path)

    is_that_of_the_tests = pinned(name)["numba"] == metadata.version("numba")
    short = (*SHORT, *FEW_KERNELS) if is_that_of_the_tests else SHORT
    assert {"bench", "explore", "optimise", "validate"} < set(wearsim("--help").split())
    assert "halfspace" in wearsim("plugins")
    wearsim("check", ROOT / "scenarios" / "rig-ensemble.toml")
    end = json.loads(wearsim("run", ROOT / "scenarios" / "rig-450min.toml", *short, "--json"))
    assert end["depth_m"] > 0.0
    wearsim("run", ROOT / "scenarios" / "rig-450min.toml", *short, "-o", "run.h5")
    wearsim("plot", "run.h5", "-o", "run.png")
    wearsim("show", "run.h5")
    wearsim("report", "run.h5", "-o", "run.html")
    assert json.loads(wearsim("schema"))["properties"]
