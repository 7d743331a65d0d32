"""JSON Schema of a scenario, for editors that check and complete TOML."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, models_json_schema
from pydantic_core import core_schema

from wearsim.plugins import RandomInputSpec
from wearsim.scenario.parse.field_wording import model_at
from wearsim.scenario.parse.key_index import REQUIRED, TABLES
from wearsim.scenario.parse.mistakes import installed
from wearsim.scenario.random.model import (
    FRICTION,
    WITH_MARGINAL,
    RandomInputTable,
    can_be_random,
)
from wearsim.scenario.random.targets import JointTarget, target_of
from wearsim.scenario.tables.plain import TopTable
from wearsim.scenario.tables.plugin import PLUGIN_TABLES

Schema: TypeAlias = dict[str, Any]
Resolve: TypeAlias = Callable[[type[BaseModel]], Schema]

_MARGINAL, _RANDOM, _FIELD, _JOINT = (
    "MarginalDistribution",
    "RandomInput",
    "RandomFriction",
    "JointRandomInput",
)
_DEFINITIONS = {"scalar": _RANDOM, "process": _RANDOM, "field": _FIELD, "joint": _JOINT}


class _ScenarioSchema(GenerateJsonSchema):
    """Pydantic's schema with defaults as a scenario holds them, without null, which TOML lacks."""

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
    specs = {table: installed(kind) for table, (_, _, kind) in PLUGIN_TABLES.items()}
    models: list[type[BaseModel]] = [TopTable, *TABLES.values()]
    models += [spec.options for listed in specs.values() for spec in listed]
    models += [RandomInputTable, *(spec.options for spec in installed(RandomInputSpec))]
    models = [part for model in models for part in _models_within(model)]
    refs, definitions = models_json_schema(
        [(model, "validation") for model in dict.fromkeys(models)],
        schema_generator=_ScenarioSchema,
    )
    shared = definitions.get("$defs", {})

    def resolve(model: type[BaseModel]) -> Schema:
        schema: Schema = shared[refs[model, "validation"]["$ref"].rsplit("/", 1)[-1]]
        return schema

    shared |= _random_definitions(resolve)
    tables_of: dict[type[BaseModel], str] = {model: table for table, model in TABLES.items()}
    for table, listed in specs.items():
        for spec in listed:
            term = getattr(spec, "role", "base") == "term"
            tables_of.setdefault(spec.options, f"{table}.{spec.name}" if term else table)
    for model, table in tables_of.items():
        _admit_random(model, table, shared, resolve)
    tables = {
        table: _choice(table, specs[table], resolve)
        if table in PLUGIN_TABLES
        else {**resolve(model), "title": table}
        for table, model in TABLES.items()
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "wearsim scenario",
        "description": "Scenario of a wear simulation of a rolling contact, for wearsim.",
        "type": "object",
        "properties": {**resolve(TopTable)["properties"], **tables},
        "required": list(REQUIRED),
        "additionalProperties": False,
        "$defs": _referenced(shared, tables),
    }


def _models_within(model: type[BaseModel]) -> list[type[BaseModel]]:
    """Return a model and those of the tables within it."""
    inner = [model_at(model, (key,)) for key in model.model_fields]
    return [model, *(part for item in inner if item for part in _models_within(item))]


def _referenced(shared: Schema, *users: object) -> Schema:
    """Return the definitions that `users` refer to, directly or through other definitions."""
    used: Schema = {}
    pending: list[object] = list(users)
    while pending:
        item = pending.pop()
        if isinstance(item, dict):
            name = str(item.get("$ref", "")).rsplit("/", 1)[-1]
            if name in shared and name not in used:
                used[name] = shared[name]
                pending.append(shared[name])
            pending += item.values()
        elif isinstance(item, list):
            pending += item
    return dict(sorted(used.items()))


def _choice(table: str, specs: list[Any], resolve: Resolve) -> Schema:
    """Return the schema of a table that chooses a plugin: one alternative per plugin."""
    model, key, _ = PLUGIN_TABLES[table]
    base = resolve(model)
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
        named = [key] if spec.name != model.model_fields[key].default else []
        alternatives.append(
            {
                "title": spec.name,
                "description": spec.summary,
                "type": "object",
                "properties": {
                    **terms,
                    **options.get("properties", {}),
                    **base["properties"],
                    key: {**base["properties"][key], "const": spec.name},
                },
                "required": options.get("required", []) + named,
                "additionalProperties": False,
            }
        )
    return {"title": table, "description": model.__doc__, "anyOf": alternatives}


def _random_definitions(resolve: Resolve) -> Schema:
    """Return the definitions of the random inputs by name; those without plugins are left out."""
    made: dict[str, list[Schema]] = {name: [] for name in (_MARGINAL, _RANDOM, _FIELD, _JOINT)}
    specs = installed(RandomInputSpec)
    scalars = any(spec.role == "scalar" for spec in specs)
    for spec in specs:
        if not scalars and spec.role in WITH_MARGINAL:
            continue
        made[_DEFINITIONS[spec.role]].append(_random_input(spec, resolve))
        if spec.role == "scalar":
            made[_MARGINAL].append(_random_input(spec, resolve, marginal=True))
    if made[_FIELD] and made[_RANDOM]:
        made[_FIELD].insert(0, _reference(_RANDOM))
    return {name: {"title": name, "anyOf": items} for name, items in made.items() if items}


def _reference(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _random_input(spec: RandomInputSpec, resolve: Resolve, marginal: bool = False) -> Schema:
    """Return the schema of one random input, or of one that is the marginal of another."""
    own, options = resolve(RandomInputTable)["properties"], resolve(spec.options)
    keys: Schema = {"distribution": {**own["distribution"], "const": spec.name}}
    needed = ["distribution", *options.get("required", [])]
    if not marginal:
        keys["persistence"] = own["persistence"]
    if spec.role in WITH_MARGINAL:
        described = own["marginal"]["description"]
        keys["marginal"] = {"description": described, **_reference(_MARGINAL)}
        needed.append("marginal")
    return {
        "title": spec.name,
        "description": spec.summary,
        "type": "object",
        "properties": {**keys, **options.get("properties", {})},
        "required": needed,
        "additionalProperties": False,
    }


def _admit_random(
    model: type[BaseModel], table: str, definitions: Schema, resolve: Resolve
) -> None:
    """Extend the schema of a table, in place, by random inputs for the values that take them."""
    properties = resolve(model).get("properties", {})
    for key, field in model.model_fields.items():
        name, inner = f"{table}.{key}", model_at(model, (key,))
        definition = _FIELD if name == FRICTION and _FIELD in definitions else _RANDOM
        if isinstance(target_of(field), JointTarget):
            described = properties.pop(key)["description"]
            if _JOINT in definitions:
                properties[key] = {"description": described, **_reference(_JOINT)}
        elif inner is not None:
            _admit_random(inner, name, definitions, resolve)
        elif can_be_random(name) and target_of(field) and definition in definitions:
            properties[key] = _or_random(properties[key], definition)


def _or_random(schema: Schema, definition: str) -> Schema:
    """Return the schema of a value that may also be a random input."""
    about = {
        key: item for key, item in schema.items() if key in {"title", "description", "default"}
    }
    value = {key: item for key, item in schema.items() if key not in about}
    alternatives = value["anyOf"] if set(value) == {"anyOf"} else [value]
    if _reference(definition) in alternatives:  # the model of several tables
        return schema
    return {**about, "anyOf": [*alternatives, _reference(definition)]}
