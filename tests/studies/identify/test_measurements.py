"""Tests files: tables of tests, and all of their mistakes at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from wearsim.errors import ScenarioError
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.identify.api import identify
from wearsim.studies.identify.inputs import fixed
from wearsim.studies.identify.measurements import read_tests


def test_tests_file_is_read(tmp_path: Path):
    path = tmp_path / "tests.toml"
    path.write_text(
        """
[[test]]
profile = "t1.csv"
before = "b1.csv"
columns = ["y", "-z"]
at = "100 min"
group = "A"
set = {load.normal_force = "310 N", creepage = 1e-3}
std = {load.normal_force = "10 N"}
shoulders = "9 mm"

[[test]]
depth = "48 um"
depth_std = "1 um"
"""
    )
    first, second = read_tests(path)
    assert first.profile == tmp_path / "t1.csv"
    assert first.before == tmp_path / "b1.csv"
    assert first.choice.columns == ("y", "-z")
    assert (first.at, first.group, first.shoulders) == ("100 min", "A", 9e-3)
    assert first.values == {"load.normal_force": "310 N", "creepage.longitudinal": 1e-3}
    assert first.errors == {"load.normal_force": "10 N"}
    assert (second.depth, second.depth_std) == pytest.approx((48e-6, 1e-6))


def test_all_mistakes_of_a_tests_file_are_reported(tmp_path: Path):
    path = tmp_path / "tests.toml"
    path.write_text(
        """
[[test]]
profile = "t1.csv"
depth = "48 um"
depht_std = "1 um"

[[test]]
depth = "48 N"

[[test]]
profile = "t.csv"
std = {friction.coefficient = 0.1}
body = "disc"
"""
    )
    with pytest.raises(ScenarioError) as caught:
        read_tests(path)
    message = str(caught.value)
    for part in (
        "[test 1] depht_std: is unknown",
        "[test 1] profile, depth or lift: exactly one",
        "[test 2] depth: ",
        "[test 2] depth_std: is needed with depth",
        "[test 3] std.friction.coefficient: has no measured value in set",
        "[test 3] body: is unknown",
    ):
        assert part in message


@pytest.mark.parametrize("text", ["", "test = 3", "[test]\nprofile = 't.csv'", "x = ["])
def test_file_without_tests_is_refused(tmp_path: Path, text: str):
    path = tmp_path / "tests.toml"
    path.write_text(text)
    with pytest.raises(ScenarioError, match=r"tests.toml: "):
        read_tests(path)


def test_fixed_inputs_have_short_names():
    found = fixed("friction=0.1,load=310 N")
    assert found == {"friction.coefficient": 0.1, "load.normal_force": "310 N"}
    with pytest.raises(ValueError, match="is not an input with a value"):
        fixed("friction")


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            "set = {friction = 0.1}\nstd = {friction = -0.003}",
            "std.friction.coefficient: must be above 0, got -0.003, expected a number above 0",
        ),
        (
            "set = {friction = -0.12}",
            "set.friction.coefficient: is out of range, got -0.12, expected a number above 0",
        ),
        (
            'set = {creepage = 7e-4}\nstd = {creepage = "abc"}',
            'std.creepage.longitudinal: is not a number, got "abc", expected a number above 0',
        ),
        (
            "set = {creepag = 7e-4}",
            "set.creepag: is unknown (did you mean 'creepage'?), got 0.0007, expected a key of",
        ),
        (
            "set = {friction = 0.1}\nstd = {frction = 0.003}",
            "std.frction: has no measured value in set (did you mean 'friction'?), got 0.003, exp",
        ),
        (
            'set = {load = "310 N"}\nstd = {load = "10 mm"}',
            'std.load.normal_force: wrong dimension, got "10 mm", expected a force above zero',
        ),
        (
            'set = {yaw = "1 mrad"}\nstd = {yaw = "1 mrad"}',
            "std.creepage.yaw: cannot be random alone, since creepage.misalignment sets",
        ),
        (
            'set = {roller.radius = "20 mm"}\nstd = {roller.radius = "1 mm"}',
            'std.roller.radius: cannot be random, got "1 mm", expected only a known value in set',
        ),
        ('at = "soon"', 'at: is not a quantity, got "soon", expected a time such as "100 min", or'),
        ('at = "999 min"', "at: is not within the test, got 999 min, expected up to 450 min"),
    ],
)
def test_mistake_of_an_input_names_the_tests_file_and_the_test(
    tmp_path: Path, lines: str, message: str
):
    path = tmp_path / "tests.toml"
    known = '[[test]]\ndepth = "48 um"\ndepth_std = "1 um"\n'
    path.write_text(f"{known}\n{known}{lines}\n")
    with pytest.raises(ScenarioError) as caught:
        identify(shipped_scenario("rig-identify"), path)
    assert str(caught.value).startswith(f"{path}: [test 2] {message}")
    assert "\n" not in str(caught.value)
