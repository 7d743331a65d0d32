"""Variables and constraints: their texts, bounds and units, and the public imports."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

import pytest

from wearsim.scenario.examples import shipped_scenario
from wearsim_optimise.goals import parse_constraint
from wearsim_optimise.variables import numbers_at, parse_variable, places_of, start_of

ROOT = Path(__file__).parents[3]
MODULES = sorted((ROOT / "plugins" / "wearsim-optimise" / "src").rglob("*.py"))


def test_bounds_are_read_with_their_units():
    variable = parse_variable("roller.crown_radius=200mm:2m")
    assert (variable.kind, variable.unit, variable.low, variable.high) == (
        "continuous",
        "m",
        0.2,
        2,
    )
    assert variable.is_log
    assert variable.written(variable.number(1.0)) == "2.0 m"


def test_whole_numbers_and_lists_are_told_from_continuous_ones():
    assert parse_variable("operation.rollers=1:4").kind == "integer"
    assert parse_variable("friction.coefficient=0.05:0.2").kind == "continuous"
    laws = parse_variable("cam.motion.2.law+cam.motion.4.law=cycloidal,modified-sine")
    assert (laws.kind, laws.keys) == ("list", ("cam.motion.2.law", "cam.motion.4.law"))
    assert laws.choices == ("cycloidal", "modified-sine")
    assert parse_variable("cam.base_radius=25mm,30mm").choices == ("25 mm", "30 mm")


@pytest.mark.parametrize("text", ["a.b=2mm:20mm", "a.b=0.1:0.2", "a.b=1:9", "a.b=x,y,z"])
def test_places_lead_back_to_their_numbers(text):
    variable = parse_variable(text)
    for place in (0.0, 0.137, 0.5, 0.93, 1.0):
        numbers = numbers_at([variable], [place])
        assert numbers_at([variable], places_of([variable], numbers)) == numbers


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("cam.base_radius", "not a variable"),
        ("cam.base_radius=60mm:35mm", "upper bound 35mm is not above"),
        ("cam.base_radius=35mm:60s", "is not a length|seconds|35"),
        ("cam.base_radius=35mm:tall", "not numbers"),
        ("cam.material=steel", "one value"),
        ("cam.material=steel,steel", "twice"),
    ],
)
def test_wrong_variables_are_refused(text, message):
    with pytest.raises(ValueError, match=message):
        parse_variable(text)


def test_start_is_the_scenario_within_the_bounds():
    scenario = shipped_scenario("cam-cycloidal")
    texts = [
        "cam.base_radius=2cm:6cm",
        "roller.crown_radius=600mm:2m",
        "cam.motion.2.law=harmonic,cycloidal",
    ]
    assert start_of(scenario, list(map(parse_variable, texts))) == (2.5, 0.6, 1.0)


def test_constraints_have_a_quantity_a_sign_and_a_limit():
    found = parse_constraint("ensemble.depth.p95<=50um")
    assert (found.name, found.sign, found.limit) == ("ensemble.depth.p95", "<", "50um")
    with pytest.raises(ValueError, match="not a constraint"):
        parse_constraint("peak_pressure 900 MPa")


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.name)
def test_only_public_modules_are_imported(path):
    page = (ROOT / "docs" / "plugins.md").read_text(encoding="utf-8")
    public = set(
        re.findall(r"`(wearsim[\w.]*)`", page.split("## Public modules")[1].split("## ")[0])
    )
    assert len(public) > 15
    for node in ast.walk(ast.parse(path.read_text())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
        for name in names:
            outside = name.split(".")[0] in {
                *sys.stdlib_module_names,
                "numpy",
                "scipy",
                "typer",
                "cmaes",
            }
            assert outside or name.startswith("wearsim_optimise") or name in public, name
