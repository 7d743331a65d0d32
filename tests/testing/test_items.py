"""The kit in an author's pytest: one item per promise, and what fails or is left out is told."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from wearsim.testing import contact_model_tests, load_tests, loads, random_inputs
from wearsim.testing.kit import CONTACT_MODEL
from wearsim.testing.wear_laws import WEAR_LAW

AUTHORS = """
from wearsim.plugins import LoadSpec, Load, Options
from wearsim.testing import load_tests


class Heavy(Load):
    def force(self, time):
        return 300.0 + 0.0 * time

    def mean(self, start, stop):
        return 301.0


SPEC = LoadSpec("heavy", Options, "a load that says its mean wrongly", factory=lambda o: Heavy())
test_heavy = load_tests(SPEC, without={"extremes-hold-the-force": "they are sampled"})
"""


def collected(path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments, str(path)]
    return subprocess.run(command, capture_output=True, text=True, cwd=path.parent, check=False)


def test_that_an_author_sees_one_item_per_promise(tmp_path):
    path = tmp_path / "test_heavy.py"
    path.write_text(AUTHORS)
    done = collected(path, "-v", "-rs")
    assert "test_heavy[span-is-a-stretch-of-time] PASSED" in done.stdout
    assert "test_heavy[mean-is-that-of-the-force] FAILED" in done.stdout
    assert "load 'heavy': the mean from 0 to 3600 s" in done.stdout
    assert "is 301, expected 300" in done.stdout
    assert "(wearsim.plugins.Load.mean)" in done.stdout
    assert "they are sampled" in done.stdout
    assert done.returncode == 1
    # where in the kit it was found is of no use to an author
    assert "agree(" not in done.stdout


def test_that_every_promise_is_an_item():
    marks = contact_model_tests("slender").pytestmark
    (parameters,) = [mark.args[1] for mark in marks if mark.name == "parametrize"]
    assert [item.id for item in parameters] == list(CONTACT_MODEL.names)


def test_that_leaving_out_what_does_not_exist_is_refused():
    with pytest.raises(ValueError, match="no check is named 'loads'; there are: spec-says"):
        load_tests("constant", {"normal_force": "300 N"}, without={"loads": "why not"})


def test_that_the_kit_is_imported_without_pytest():
    code = "import sys, wearsim.testing; assert 'pytest' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


ALL = [CONTACT_MODEL, WEAR_LAW, *loads.BY_ROLE.values(), *random_inputs.BY_ROLE.values()]


@pytest.mark.parametrize("check", [check for checks in ALL for check in checks])
def test_that_promises_are_written_where_the_message_says(check):
    room, _, rest = check.promised_in.partition(".")
    place = importlib.import_module(room)
    for name in rest.split("."):
        place = getattr(place, name)
    assert place.__doc__
    assert check.promise.endswith(".")
