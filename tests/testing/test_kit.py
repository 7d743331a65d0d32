"""Test items in the pytest run of a plugin author: one per requirement, with messages."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from wearsim.errors import PluginError
from wearsim.plugins import LoadSpec, registry
from wearsim.testing import contact_model_tests, load_tests, random_inputs
from wearsim.testing.checks import ConfiguredSpec
from wearsim.testing.kit import CONTACT_MODEL
from wearsim.testing.wear_and_loads import LOADS, WEAR_LAW

PLUGIN_TESTS = """
from wearsim.plugins import LoadSpec, Load, Options
from wearsim.testing import load_tests


class Heavy(Load):
    def force(self, time):
        return 300.0 + 0.0 * time

    def mean(self, start, stop):
        return 301.0


SPEC = LoadSpec("heavy", Options, "a load with a wrong mean", factory=lambda o: Heavy(), protocol=2)
test_heavy = load_tests(SPEC, without={"extremes-bound-force": "sampled only"})
"""


def collected(path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments, str(path)]
    environment = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # to load takes a second
    return subprocess.run(
        command, capture_output=True, text=True, cwd=path.parent, check=False, env=environment
    )


def test_each_requirement_is_a_pytest_item(tmp_path):
    path = tmp_path / "test_heavy.py"
    path.write_text(PLUGIN_TESTS)
    done = collected(path, "-v", "-rs")
    assert "test_heavy[span-is-an-interval] PASSED" in done.stdout
    assert "test_heavy[mean-matches-force] FAILED" in done.stdout
    assert "load 'heavy': the mean from 0 to 3600 s" in done.stdout
    assert "is 301, expected 300" in done.stdout
    assert "(wearsim.plugins.Load.mean)" in done.stdout
    assert "sampled only" in done.stdout
    assert done.returncode == 1
    # traceback entries inside the kit are hidden
    assert "agree(" not in done.stdout


def test_items_are_named_after_the_checks():
    marks = contact_model_tests("slender").pytestmark
    (parameters,) = [mark.args[1] for mark in marks if mark.name == "parametrize"]
    assert [item.id for item in parameters] == list(CONTACT_MODEL)


def test_skipping_an_unknown_check_is_refused():
    with pytest.raises(ValueError, match="no check is named 'loads'; there are: spec-is-complete"):
        load_tests("constant", {"normal_force": "300 N"}, without={"loads": "why not"})


def test_kit_does_not_import_pytest():
    code = "import sys, wearsim.testing; assert 'pytest' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


ALL = [CONTACT_MODEL, WEAR_LAW, *LOADS.values(), *random_inputs.BY_ROLE.values()]


@pytest.mark.parametrize("check", [check for checks in ALL for check in checks.values()])
def test_requirements_are_specified_where_stated(check):
    package, _, rest = check.specified_in.partition(".")
    place = importlib.import_module(package)
    for name in rest.split("."):
        place = getattr(place, name)
    assert place.__doc__
    assert check.requirement.endswith(".")


def test_invalid_options_of_a_plugin_are_named() -> None:
    options = ConfiguredSpec(registry().get(LoadSpec, "constant"), {"normal_force": "300"})
    with pytest.raises(PluginError) as caught:
        _ = options.options
    message = str(caught.value)
    assert 'normal_force: needs a unit, got "300", expected a force' in message
    assert "Value error" not in message
