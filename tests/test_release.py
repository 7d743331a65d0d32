"""What a release consists of: one version, a recipe and workflows that agree with the package."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
CONDA_NAMES = {"matplotlib": "matplotlib-base"}


def test_all_distributions_have_one_version():
    command = [sys.executable, ROOT / "release" / "version.py", "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_change_log_begins_with_this_version():
    heads = re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert heads[0] == PROJECT["version"]


def test_conda_recipe_requires_what_the_package_requires():
    recipe = yaml.safe_load((ROOT / "release" / "recipe.yaml").read_text("utf-8"))
    needed = [re.match(r"([\w-]+)(.*)", item).groups() for item in PROJECT["dependencies"]]
    expected = [f"python {PROJECT['requires-python']}"]
    expected += [f"{CONDA_NAMES.get(name, name)} {least}" for name, least in needed]
    assert recipe["requirements"]["run"] == expected
    (script,) = PROJECT["scripts"].items()
    assert recipe["build"]["python"]["entry_points"] == [" = ".join(script)]
    assert "${{ version }}" in recipe["source"]["path"]


@pytest.mark.skipif(not WORKFLOWS, reason="a source distribution has none")
def test_actions_of_workflows_are_pinned_to_a_commit():
    for path in WORKFLOWS:
        uses = re.findall(r"uses: (\S+)", path.read_text("utf-8"))
        assert uses, path
        for action in uses:
            assert re.fullmatch(r"[\w.-]+/[\w.-]+@[0-9a-f]{40}", action), f"{path.name}: {action}"


@pytest.mark.skipif(not WORKFLOWS, reason="a source distribution has none")
def test_only_the_job_that_publishes_may_sign():
    release = yaml.safe_load((ROOT / ".github" / "workflows" / "release.yml").read_text("utf-8"))
    assert release["permissions"] == {"contents": "read"}
    assert "permissions" not in release["jobs"]["build"]
    assert release["jobs"]["publish"]["permissions"] == {"id-token": "write"}
