"""The JSON Schema of a scenario."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from scenario_examples import GOOD

from wearsim.errors import ScenarioError
from wearsim.scenario import parse_scenario
from wearsim.scenario.examples import scenario_schema

SCENARIOS = sorted((Path(__file__).parents[2] / "scenarios").glob("*.toml"))
Schema = dict[str, Any]


def _fits(value: object, schema: Schema, defs: Schema) -> bool:
    """Validate a value by the JSON Schema keywords that the schema uses."""
    if "$ref" in schema:
        return _fits(value, defs[schema["$ref"].rsplit("/", 1)[-1]], defs)
    if "anyOf" in schema:
        return any(_fits(value, item, defs) for item in schema["anyOf"])
    if "const" in schema and value != schema["const"]:
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    kind = schema.get("type")
    if isinstance(kind, list):
        return any(_fits(value, {**schema, "type": item}, defs) for item in kind)
    if kind == "object":
        known = schema["properties"]
        return (
            isinstance(value, dict)
            and set(schema.get("required", ())) <= set(value) <= set(known)
            and all(_fits(item, known[key], defs) for key, item in value.items())
        )
    if kind == "array" and "prefixItems" in schema:
        items = schema["prefixItems"]
        same = isinstance(value, list) and len(value) == len(items)
        return same and all(map(_fits, value, items, [defs] * len(items)))
    if kind == "array":
        return isinstance(value, list) and all(_fits(i, schema["items"], defs) for i in value)
    if kind == "string":
        return isinstance(value, str) and bool(re.search(schema.get("pattern", ""), value))
    if kind == "boolean":
        return isinstance(value, bool)
    numbers: Any = int if kind == "integer" else (int, float)
    return isinstance(value, numbers) and not isinstance(value, bool)


def _resolved(node: Schema, schema: Schema) -> Schema:
    """Return a node with the definition that it refers to."""
    name = node.get("$ref", "").rsplit("/", 1)[-1]
    return {**schema["$defs"][name], **node} if name else node


RANDOM = """
[load]
normal_force = {distribution = "maxent", support = ["0 N", "inf"], mean = "307 N", std = "32 N"}
[load.thermal]
gain = {distribution = "uniform", low = "1 N/W", high = "3 N/W"}
time_constant = "20 min"
[friction.coefficient]
distribution = "gaussian-field"
correlation_length = "50 um"
marginal = {distribution = "maxent", support = [0, "inf"], mean = 0.1, std = 0.02}
[creepage]
longitudinal = {distribution = "normal", mean = 1e-3, std = 4e-4, persistence = "per-pass"}
misalignment = {distribution = "disc", radius = "2 mrad", persistence = "per-roller"}
[wear]
cylinder.k_over_h = {distribution = "lognormal", median = "1.1e-11 1/Pa", factor = 1.5}
roller.k_over_h = "0 1/Pa"
[sampling]
plan = "sobol"
realisation = 3
correlation = [["load.normal_force", "load.thermal.gain", 0.5]]
"""


def _nodes(item: object) -> list[Schema]:
    if isinstance(item, list):
        return [node for part in item for node in _nodes(part)]
    if not isinstance(item, dict):
        return []
    return [item, *(node for part in item.values() for node in _nodes(part))]


@pytest.fixture
def schema(small_registry: object) -> Schema:
    return scenario_schema()


@pytest.fixture(scope="module")
def schema_with_installed_plugins() -> Schema:
    return scenario_schema()


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_schema_accepts_every_shipped_scenario(
    schema_with_installed_plugins: Schema, path: Path
) -> None:
    schema = schema_with_installed_plugins
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    assert _fits(data, schema, schema["$defs"])


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ('"20 mm"', "20"),
        ("coefficient", "coeficient"),
        ('model = "slender"', 'model = "slender"\nmx = 3'),
        ('model = "slender"', 'model = "slendr"'),
        ("[friction]", "[fricton]"),
    ],
)
def test_schema_rejects_what_the_parser_rejects(schema: Schema, good: str, bad: str) -> None:
    assert _fits(tomllib.loads(GOOD), schema, schema["$defs"])
    assert not _fits(tomllib.loads(GOOD.replace(good, bad)), schema, schema["$defs"])


def _random() -> str:
    """Return a scenario with installed random inputs in every table that takes them."""
    bodies = GOOD[: GOOD.index("[load]")]
    offset = 'offset = {distribution = "normal", mean = "0 mm", std = "1 mm"}'
    return bodies.replace("[roller]", f"[roller]\n{offset}") + RANDOM


def test_schema_accepts_random_inputs_like_the_parser(
    schema_with_installed_plugins: Schema,
) -> None:
    schema = schema_with_installed_plugins
    assert _fits(tomllib.loads(_random()), schema, schema["$defs"])
    scenario = parse_scenario(_random(), "rig.toml", {}.__getitem__)
    assert len(scenario.random) == 7


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ('"maxent", support = ["0', '"maxnt", support = ["0'),
        ('std = "32 N"', 'sdt = "32 N"'),
        ('persistence = "per-pass"', 'persistence = "per-pas"'),
        ('"uniform", low = "1 N/W", ', '"uniform", '),
        ("marginal =", "margin ="),
        ('"disc", radius = "2 mrad"', '"normal", mean = "0 rad", std = "2 mrad"'),
        ('plan = "sobol"', 'plan = "halton"'),
        ('radius = "20 mm"', 'radius = {distribution = "uniform", low = "1 mm", high = "2 mm"}'),
        (
            '{distribution = "uniform", low = "1 N/W", high = "3 N/W"}',
            '{distribution = "white", marginal = {distribution = "constant", value = "3 N/W"}}',
        ),
    ],
)
def test_schema_rejects_random_inputs_like_the_parser(
    schema_with_installed_plugins: Schema, good: str, bad: str
) -> None:
    text = _random()
    assert good in text
    text = text.replace(good, bad, 1)
    schema = schema_with_installed_plugins
    assert not _fits(tomllib.loads(text), schema, schema["$defs"])
    with pytest.raises(ScenarioError):
        parse_scenario(text, "rig.toml", {}.__getitem__)


def test_every_key_has_a_description(schema_with_installed_plugins: Schema) -> None:
    schema = schema_with_installed_plugins
    for node in _nodes(schema):
        if node.get("type") == "object":
            for key, field in node.get("properties", {}).items():  # a map has none
                assert _resolved(field, schema).get("description"), key


def test_all_definitions_are_referenced_and_defined(schema: Schema) -> None:
    used = {node["$ref"].rsplit("/", 1)[-1] for node in _nodes(schema) if "$ref" in node}
    assert used == set(schema["$defs"])


def test_defaults_are_written_as_in_a_scenario(schema: Schema) -> None:
    tables = {key: _resolved(node, schema) for key, node in schema["properties"].items()}
    assert tables["roller"]["properties"]["offset"]["default"] == "0 m"
    assert tables["outputs"]["properties"]["checkpoint_every"]["default"] == "30 s"
    assert "default" not in tables["operation"]["properties"]["duration"]
    assert not any(node.get("type") == "null" for node in _nodes(schema))


def _alternatives(schema: Schema, table: str) -> list[Schema]:
    nodes = _resolved(schema["properties"][table], schema)["anyOf"]
    return [_resolved(node, schema) for node in nodes]


def test_plugins_are_alternatives_by_name(schema: Schema) -> None:
    contact = _alternatives(schema, "contact")
    assert [item["properties"]["model"]["const"] for item in contact] == [
        "hertz-fastsim",
        "slender",
        "auto",
    ]
    assert "mx" in contact[0]["properties"]
    loads = _alternatives(schema, "load")
    assert [item["properties"]["kind"]["const"] for item in loads] == [
        "constant",
        "recorded",
        "spring",
    ]
    assert all("thermal" in item["properties"] for item in loads)
