"""The JSON Schema of a scenario, for editors that check and complete TOML."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic.json_schema import GenerateJsonSchema, models_json_schema

from wearsim.plugins import ContactModelSpec, LoadSpec, Spec, WearLawSpec, registry
from wearsim.scenario.parse.key_index import REQUIRED, TABLES
from wearsim.scenario.random.model import RandomInputTable
from wearsim.scenario.schema.random_inputs import (
    admit_random,
    models_within,
    random_definitions,
    random_specs,
)
from wearsim.scenario.tables.plain import TopTable
from wearsim.scenario.tables.plugin import ContactTable, LoadTable, WearTable

if TYPE_CHECKING:
    from pydantic import BaseModel
    from pydantic_core import core_schema

    from wearsim.scenario.parse.mistakes import Table

Schema = dict[str, Any]

_CHOICES: dict[str, tuple[type[Table], str, type[Spec]]] = {
    "contact": (ContactTable, "model", ContactModelSpec),
    "load": (LoadTable, "kind", LoadSpec),
    "wear": (WearTable, "law", WearLawSpec),
}


class _ScenarioSchema(GenerateJsonSchema):
    """As pydantic's, but with defaults as a user writes them and without nulls, unknown to TOML."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> Schema:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> Schema:
        result = super().default_schema(schema)
        default = schema.get("default")
        write = schema["schema"].get("serialization", {}).get("function")
        if default is None:
            result.pop("default", None)
        elif write is not None:
            result["default"] = write(default)
        return result


def scenario_schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of a scenario with the installed plugins.

    Returns
    -------
    dict
    """
    specs = {table: _specs(kind) for table, (_, _, kind) in _CHOICES.items()}
    models: list[type[BaseModel]] = [TopTable, *TABLES.values()]
    models += [spec.options for found in specs.values() for spec in found]
    models += [RandomInputTable, *(spec.options for spec in random_specs())]
    models = [part for model in models for part in models_within(model)]
    refs, definitions = models_json_schema(
        [(model, "validation") for model in dict.fromkeys(models)],
        schema_generator=_ScenarioSchema,
    )
    shared = definitions.get("$defs", {})

    def resolve(model: type[BaseModel]) -> Schema:
        found: Schema = shared[refs[model, "validation"]["$ref"].rsplit("/", 1)[-1]]
        return found

    shared |= random_definitions(resolve)
    for model, table in _homes(specs):
        admit_random(model, table, shared, resolve)
    tables = {
        table: _choice(table, specs[table], resolve)
        if table in _CHOICES
        else {**resolve(model), "title": table}
        for table, model in TABLES.items()
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "wearsim scenario",
        "description": "A rolling contact that wears, for wearsim.",
        "type": "object",
        "properties": {**resolve(TopTable)["properties"], **tables},
        "required": list(REQUIRED),
        "additionalProperties": False,
        "$defs": _needed(shared, tables),
    }


def _homes(specs: dict[str, list[Any]]) -> list[tuple[type[BaseModel], str]]:
    """Return the models of tables and options, each with the table that they stand in."""
    homes: dict[type[BaseModel], str] = {model: table for table, model in TABLES.items()}
    for table, found in specs.items():
        for spec in found:
            term = getattr(spec, "role", "base") == "term"
            homes.setdefault(spec.options, f"{table}.{spec.name}" if term else table)
    return list(homes.items())


def _needed(shared: Schema, *users: object) -> Schema:
    """Return the definitions that `users` refer to, and those that these refer to in turn."""
    found: Schema = {}
    open_ends: list[object] = list(users)
    while open_ends:
        item = open_ends.pop()
        if isinstance(item, dict):
            name = str(item.get("$ref", "")).rsplit("/", 1)[-1]
            if name in shared and name not in found:
                found[name] = shared[name]
                open_ends.append(shared[name])
            open_ends += item.values()
        elif isinstance(item, list):
            open_ends += item
    return dict(sorted(found.items()))


def _specs(kind: type[Spec]) -> list[Any]:
    return [registry().get(kind, name) for name in registry().names(kind)]


def _choice(table: str, specs: list[Any], resolve: Any) -> Schema:
    """Return the schema of a table that chooses a plugin: one alternative for each."""
    own, key, _ = _CHOICES[table]
    base = resolve(own)
    terms = {
        spec.name: {**resolve(spec.options), "description": spec.summary}
        for spec in specs
        if getattr(spec, "role", "base") == "term"
    }
    alternatives = []
    for spec in specs:
        if spec.name in terms:
            continue
        options = resolve(spec.options)
        choice = {**base["properties"][key], "const": spec.name}
        default = own.model_fields[key].default
        alternatives.append(
            {
                "title": spec.name,
                "description": spec.summary,
                "type": "object",
                "properties": {
                    **terms,
                    **options.get("properties", {}),
                    **base["properties"],
                    key: choice,
                },
                "required": options.get("required", []) + ([key] if spec.name != default else []),
                "additionalProperties": False,
            }
        )
    return {"title": table, "description": own.__doc__, "anyOf": alternatives}
