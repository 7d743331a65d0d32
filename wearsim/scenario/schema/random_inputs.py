"""The JSON Schema of random inputs, and where a scenario may have them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

from wearsim.plugins import RandomInputSpec, registry
from wearsim.scenario.parse.field_wording import model_at
from wearsim.scenario.random.model import FRICTION, RandomInputTable, can_be_random
from wearsim.scenario.random.targets import host_of, joint_of

if TYPE_CHECKING:
    from pydantic import BaseModel

Schema: TypeAlias = dict[str, Any]
Resolve: TypeAlias = "Callable[[type[BaseModel]], Schema]"

_MARGINAL, _RANDOM, _FIELD, _JOINT = (
    "MarginalDistribution",
    "RandomInput",
    "RandomFriction",
    "JointRandomInput",
)
_ABOUT = {"title", "description", "default"}
_WITH_MARGINAL = {"field", "process"}


def random_specs() -> list[RandomInputSpec]:
    """Return the registered random inputs."""
    names = registry().names(RandomInputSpec)
    return [registry().get(RandomInputSpec, name) for name in names]


def random_definitions(resolve: Resolve) -> Schema:
    """Return the definitions of the random inputs, by name; one with no plugin is left out."""
    made: dict[str, list[Schema]] = {name: [] for name in (_MARGINAL, _RANDOM, _FIELD, _JOINT)}
    homes = {"scalar": _RANDOM, "process": _RANDOM, "field": _FIELD, "joint": _JOINT}
    specs = random_specs()
    if not any(spec.role == "scalar" for spec in specs):
        specs = [spec for spec in specs if spec.role not in _WITH_MARGINAL]
    for spec in specs:
        made[homes[spec.role]].append(_random_input(spec, resolve))
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
    if spec.role in _WITH_MARGINAL:
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


def admit_random(model: type[BaseModel], table: str, definitions: Schema, resolve: Resolve) -> None:
    """Let the values of a table's schema be random where a scenario takes it.

    Parameters
    ----------
    model : type of BaseModel
        The table's model; its schema is changed in place.
    table : str
        Dotted name of the table.
    definitions : dict
        What `random_definitions` returned.
    resolve : callable
        Returns the schema of a model.
    """
    properties = resolve(model).get("properties", {})
    for key, field in model.model_fields.items():
        name, inner = f"{table}.{key}", model_at(model, (key,))
        definition = _FIELD if name == FRICTION and _FIELD in definitions else _RANDOM
        if joint_of(field):
            described = properties.pop(key)["description"]
            if _JOINT in definitions:
                properties[key] = {"description": described, **_reference(_JOINT)}
        elif inner is not None:
            admit_random(inner, name, definitions, resolve)
        elif can_be_random(name) and host_of(field) and definition in definitions:
            properties[key] = _or_random(properties[key], definition)


def _or_random(schema: Schema, definition: str) -> Schema:
    """Return the schema of a value that may also be a random input."""
    about = {
        key: item for key, item in schema.items() if key in {"title", "description", "default"}
    }
    value = {key: item for key, item in schema.items() if key not in about}
    alternatives = value["anyOf"] if set(value) == {"anyOf"} else [value]
    if _reference(definition) in alternatives:  # a model that stands at several places
        return schema
    return {**about, "anyOf": [*alternatives, _reference(definition)]}


def models_within(model: type[BaseModel]) -> list[type[BaseModel]]:
    """Return a model and those of the tables within it."""
    inner = [model_at(model, (key,)) for key in model.model_fields]
    return [model, *(part for item in inner if item for part in models_within(item))]
