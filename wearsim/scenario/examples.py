"""Help for authors of scenarios: shipped scenarios, and JSON Schema for editors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, TypeAlias, Union

from pydantic import BaseModel, Field, RootModel, create_model
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

from wearsim.plugins import (
    BODIES,
    AxialProfileSpec,
    FatigueLawSpec,
    MotionLawSpec,
    Options,
    RandomInputSpec,
    TableSpec,
)
from wearsim.scenario.parse.fields import (
    FRICTION,
    RandomInputTable,
    can_be_random,
    model_at,
    target_of,
)
from wearsim.scenario.parse.mistakes import installed
from wearsim.scenario.parse.toml import REQUIRED, TABLES
from wearsim.scenario.scenario import Scenario, load_scenario
from wearsim.scenario.tables.axial import AxialTable
from wearsim.scenario.tables.cam_motion import MotionTable
from wearsim.scenario.tables.fatigue import FatigueOfBody
from wearsim.scenario.tables.plain import TopTable
from wearsim.scenario.tables.plugin import AUTO, PLUGIN_TABLES, AutoTable

_PACKAGE = Path(__file__).parents[1]

# inside an installed package; next to the package in the source tree
_FOLDERS = (_PACKAGE / "scenarios", _PACKAGE.parent / "scenarios")
Model: TypeAlias = type[BaseModel]
RandomInputs: TypeAlias = tuple[Model | None, Model | None, Model | None]


def shipped_scenario(name: str, overrides: Mapping[str, object] | None = None) -> Scenario:
    """Read a scenario shipped with wearsim.

    Parameters
    ----------
    name : str
        File name without the suffix, "mean-contact".
    overrides : mapping of str to object, optional
        Values by dotted key, as for `load_scenario`.

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        As `load_scenario`.
    """
    folder = next((folder for folder in _FOLDERS if folder.is_dir()), _FOLDERS[0])
    return load_scenario(folder / f"{name}.toml", overrides)


def starter_scenario(name: Literal["starter", "starter_cam"] = "starter") -> str:
    """Return the TOML of a complete scenario, of a cam if named so, with alternatives."""
    return Path(__file__).with_name(f"{name}.toml").read_text(encoding="utf-8")


class _ScenarioSchema(GenerateJsonSchema):
    """Pydantic's schema with defaults as a scenario holds them, without null, which TOML lacks."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> dict[str, Any]:
        result = super().default_schema(schema)
        default, value = schema.get("default"), schema["schema"]
        if value["type"] == "union":  # a number or a random input
            value = value["choices"][0]
        write = value.get("serialization", {}).get("function")
        if default is None:
            result.pop("default", None)
        elif write is not None:
            result["default"] = write(default)
        return result


def scenario_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a scenario with the installed plugins.

    Returns
    -------
    dict

    Examples
    --------
    >>> schema = wearsim.scenario_schema()
    >>> schema["required"]
    ['roller', 'operation', 'load', 'friction', 'creepage']
    """
    random = _random_inputs()
    tables: dict[str, Any] = {}
    for table, model in TABLES.items():
        keys = _fields(model, table, random)
        if "motion" in keys:
            motion, names = model.model_fields["motion"], ("motion", "MotionLaw")
            laws = _chosen(MotionLawSpec, MotionTable, "law", names, _fields(MotionTable))
            described = Field(None, description=motion.description)
            kind: Any = tuple[laws, ...]  # type: ignore[valid-type]
            keys |= {"motion": (kind, described)} if laws else {}
            keys = keys if laws else {key: kept for key, kept in keys.items() if key != "motion"}
        if table == "fatigue":
            names, base = ("fatigue", "FatigueLaw"), _fields(FatigueOfBody)
            fatigue = _chosen(FatigueLawSpec, FatigueOfBody, "law", names, base)
            given = {body: model.model_fields[body].description for body in BODIES}
            keys |= {body: (fatigue, Field(None, description=t)) for body, t in given.items()}
            keys = (
                keys if fatigue else {key: kept for key, kept in keys.items() if key not in given}
            )
        if "axial_profile" in keys:
            described = Field(None, description=model.model_fields["axial_profile"].description)
            names, of = (table, f"{table} axial profile"), {"table": f"{table}.axial_profile"}
            forms = _chosen(AxialProfileSpec, AxialTable, "form", names, {}, **of, random=random)
            keys["axial_profile"] = str | forms, described
        kind = _one_of(table, _choices(table, random) if table in PLUGIN_TABLES else [])
        kind = kind or _model(table, model.__doc__, keys)
        tables[table] = kind, Field(... if table in REQUIRED else None, description=model.__doc__)
    tables |= {
        spec.name: (
            _model(spec.name, spec.summary, _fields(spec.options)),
            Field(None, description=spec.summary),
        )
        for spec in installed(TableSpec)
    }
    scenario = _model(
        "wearsim scenario",
        "Scenario of a wear simulation of a rolling contact, for wearsim.",
        {**_fields(TopTable), **tables},
    )
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **scenario.model_json_schema(schema_generator=_ScenarioSchema),
    }


def _chosen(
    kind: Any, chooser: Model, key: str, names: tuple[str, str], base: Mapping[str, Any], **of: Any
) -> Any:
    """Return the model of a table with a key that chooses a plugin, for each plugin of a kind.

    Parameters
    ----------
    kind : type of Spec
    chooser, key : type of Options, and str
        Model with the key, and the key.
    names : tuple of str
        Begin of the names of the models, and name of all of them together.
    base : mapping of str to object
        Fields besides the options of the plugin.
    **of : object
        Table and random inputs, as of `_fields`.
    """
    named, models = chooser.model_fields[key], []
    for spec in installed(kind):
        fields = {**base, **_fields(spec.options, **of)}
        fields[key] = Literal[spec.name], Field(..., description=named.description)
        if getattr(spec, "rise", "required") != "required":
            del fields["rise"]
        models.append(_model(f"{names[0]} {spec.name}", spec.summary, fields))
    return _one_of(names[1], models)


def _model(name: str, description: str | None, fields: dict[str, Any]) -> Model:
    return create_model(name, __base__=Options, __doc__=description, **fields)


def _one_of(name: str, models: list[Model]) -> Model | None:
    """Return a model of one of several tables, or None if there are none."""
    kind: Any = Union[tuple(models)] if models else None  # noqa: UP007
    return create_model(name, __base__=RootModel, root=(kind, ...)) if models else None


def _random_inputs() -> RandomInputs:
    """Return the models of what may replace a number, the friction and several numbers."""
    table_fields, specs = RandomInputTable.model_fields, installed(RandomInputSpec)

    def models(role: str, keys: dict[str, Any], name: str = "{}") -> list[Model]:
        return [
            _model(
                name.format(spec.name),
                spec.summary,
                {
                    "distribution": (Literal[spec.name], table_fields["distribution"]),
                    **keys,
                    **_fields(spec.options),
                },
            )
            for spec in specs
            if spec.role == role
        ]

    marginal = _one_of("MarginalDistribution", models("scalar", {}, "{} as marginal"))
    drawn = {"persistence": (table_fields["persistence"].annotation, table_fields["persistence"])}
    full = {
        **drawn,
        "marginal": (marginal, Field(description=table_fields["marginal"].description)),
    }
    processes = models("process", full) if marginal else []
    number = _one_of("RandomInput", models("scalar", drawn) + processes)
    friction = _one_of("RandomFriction", [number, *models("field", full)] if number else [])
    return number, friction, _one_of("JointRandomInput", models("joint", drawn))


def _choices(table: str, random: RandomInputs) -> list[Model]:
    """Return the model of a table for each plugin that it may choose."""
    base, key, kind = PLUGIN_TABLES[table]
    named, specs = base.model_fields[key], installed(kind)
    terms: dict[str, Any] = {}
    options: dict[str, Any] = {}
    for spec in specs:
        fields = _fields(spec.options, table, random)
        if getattr(spec, "role", "base") == "term":
            model = _model(f"{table} {spec.name}", spec.summary, fields)
            terms[spec.name] = model, Field(None, description=spec.summary)
        else:
            described = Field(
                spec.name if spec.name == named.default else ..., description=named.description
            )
            options[spec.name] = {**fields, **_fields(base), key: (Literal[spec.name], described)}
    models = [
        _model(f"{table} {spec.name}", spec.summary, {**terms, **options[spec.name]})
        for spec in specs
        if spec.name in options
    ]
    if table == "contact":
        chosen = Literal["auto"], Field(..., description=named.description)
        fields = {**_fields(AutoTable), **_fields(base), key: chosen}
        models.append(_model(f"{table} {AUTO}", AutoTable.__doc__, fields))
    return models


def _fields(
    model: Model, table: str = "", random: RandomInputs = (None, None, None)
) -> dict[str, Any]:
    """Return a table's fields, with the type "number or random input" where that is possible."""
    number, friction, joint = random
    fields: dict[str, Any] = {}
    for key, field in model.model_fields.items():
        name, inner, target = f"{table}.{key}", model_at(model, (key,)), target_of(field)
        kind: Any = field.annotation
        described: Any = field
        if target and target.components:
            kind, described = joint, Field(None, description=field.description)
        elif target and number and can_be_random(name):
            kind = Union[field.rebuild_annotation(), friction if name == FRICTION else number]  # noqa: UP007
            described = Field(field.get_default(), description=field.description)
        elif inner and can_be_random(name):
            kind = _model(
                f"{inner.__name__} of {key}", inner.__doc__, _fields(inner, table, random)
            )
        if kind:
            fields[key] = kind, described
    return fields
