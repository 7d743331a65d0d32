"""The glossary against the schemas of scenario and files, the labels and the JSON output."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from wearsim import load_scenario, run
from wearsim.report.text import OBSERVABLES as LABELS, si_key
from wearsim.scenario.examples import scenario_schema
from wearsim.studies.dissipation.result import VARIABLES as DISSIPATION
from wearsim.studies.ensemble.file.schema import ensemble_schema
from wearsim.studies.run.schema import ALL_VARIABLES as RUN

ROOT = Path(__file__).parents[1]
HEAD = ["quantity", "symbol", "scenario key", "name in code", "file variable", "label"]
UNITS = r"_(m|m2|m3|N|Nm|Pa|W|J|s|um|rad)$"


def rows() -> list[list[str]]:
    """Return the cells of every row of the tables of quantities."""
    found, inside = [], False
    for line in (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if cells[:6] == HEAD:
            inside = True
        elif not line.startswith("|"):
            inside = False
        elif inside and not set(line) <= set("|- "):
            found.append(cells)
    return found


ROWS = rows()


def names(column: str) -> list[str]:
    """Return the names in a column."""
    number = HEAD.index(column)
    return [name for row in ROWS for name in re.findall(r"`([^`]+)`", row[number])]


def keys_of(schema: dict[str, Any], definitions: dict[str, Any]) -> set[str]:
    """Return the dotted keys of a JSON Schema."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].rsplit("/", 1)[-1]]
    found: set[str] = set()
    for name, part in schema.get("properties", {}).items():
        found |= {name} | {f"{name}.{key}" for key in keys_of(part, definitions)}
    for part in (*schema.get("anyOf", ()), *schema.get("oneOf", ()), *schema.get("allOf", ())):
        found |= keys_of(part, definitions)
    return found


def test_glossary_has_all_tables():
    assert len(ROWS) > 40
    assert all(len(row) == 7 for row in ROWS), [row for row in ROWS if len(row) != 7]


def test_scenario_keys_of_the_glossary_exist():
    schema = scenario_schema()
    known = keys_of(schema, schema.get("$defs", {}))
    assert "load.normal_force" in known
    missing = [key for key in names("scenario key") if key not in known]
    assert not missing


def test_file_variables_and_glossary_agree():
    ensemble = ensemble_schema([], {"mean": 0.0}, {"exact": ""}, cam=True, fatigue=True).variables
    stored = {*RUN, *DISSIPATION} | {
        name for name, variable in ensemble.items() if variable.kind != "statistic"
    }
    stored -= {name for name in DISSIPATION if name.startswith("dissipation_")}
    assert stored == set(names("file variable"))


def test_file_variable_is_in_one_row():
    found = names("file variable")
    assert len(found) == len(set(found))


@pytest.mark.parametrize("name", sorted(LABELS))
def test_label_of_an_observable_is_in_the_glossary(name: str):
    (row,) = [row for row in ROWS if f"`{name}`" in row[HEAD.index("file variable")]]
    assert row[HEAD.index("label")] == LABELS[name].label


def test_json_keys_are_variables_with_their_unit():
    path = ROOT / "scenarios" / "rig-450min.toml"
    result = run(load_scenario(path, {"operation.duration": "1 min"}))
    known = {*names("file variable"), *names("name in code")}
    for key in result.final:
        name = re.sub(UNITS, "", key).removeprefix("relative_")
        assert name in known, key
    for name in LABELS:
        assert re.sub(UNITS, "", si_key(name)) == name
