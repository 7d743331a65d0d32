"""Tables that choose a plugin: [contact], [load] and [wear]."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from pydantic import Field

from wearsim.errors import ScenarioError
from wearsim.plugins import (
    ContactModel,
    ContactModelSpec,
    Load,
    LoadSpec,
    LoadTerm,
    Options,
    Spec,
    WearLaw,
    WearLawSpec,
    registry,
)
from wearsim.plugins.checked_laws import CheckedWearLaw
from wearsim.plugins.checked_loads import CheckedLoad, CheckedLoadTerm
from wearsim.plugins.checked_model import CheckedModel
from wearsim.plugins.manager import built_plugin
from wearsim.quantities import Length, PositiveLength
from wearsim.scenario.parse.mistakes import Mistakes, installed, key_of_file, split_keys
from wearsim.scenario.parse.random_inputs import choose, validate
from wearsim.types import Grid, Material
from wearsim.units import as_written
from wearsim.uq.distributions.mixture import Mixture
from wearsim.uq.distributions.two_levels import TwoLevels

AUTO = "auto"
#: a volume or an area per force: mm^3/(N m), mm^2/N, also with kN or MN
_PER_LOAD = re.compile(
    r"m(?:\^|\*\*)?[23²³]\s*/\s*\(?\s*[kM]?N(?![A-Za-z])|m[23²³^*]*\s*/\s*\(?[kM]?Nm\b"
)


class ContactTable(Options):
    """Contact model; the keys of the chosen model are its options."""

    model: str = Field(default="slender", description="Name of the contact model.")
    strips: int | None = Field(
        default=None,
        ge=3,
        description="Number of strips across the track; chosen automatically by default.",
    )
    width: PositiveLength | None = Field(
        default=None, description="Width of the strip grid; chosen automatically by default."
    )
    centre: Length | None = Field(
        default=None,
        description="Axial position of the strip grid's centre; chosen automatically by default.",
    )


class ChosenTable(Options):
    """Contact model that a study has chosen."""

    model: str = Field(description="Name of the contact model.")
    options: dict[str, Any] = Field(default_factory=dict, description="Options of the model.")
    why: str = Field(default="", description="Reason of the choice.")
    warning: str = Field(
        default="", description="Warning, if its estimated error is not within the tolerance."
    )


class AutoTable(Options):
    """Options of `model = "auto"`: the cheapest model whose estimated error is small enough."""

    tolerance: float = Field(
        default=0.03,
        gt=0.0,
        lt=1.0,
        description="Estimated error of P_l(y) that is accepted, L2 over the strips.",
    )
    chosen: ChosenTable | None = Field(
        default=None, description="The choice, written by the study that has made it."
    )


class LoadTable(Options):
    """Load on a roller; other keys are options of the chosen load, sub-tables are added terms."""

    kind: str = Field(default="constant", description="Name of the load.")


class WearTable(Options):
    """Wear law; the other keys are its options."""

    law: str = Field(default="archard-dissipation", description="Name of the wear law.")


@dataclass(frozen=True)
class ContactChoice:
    """A contact model with its options, and the strip grid.

    Parameters
    ----------
    model : str
        Name of the contact model.
    options : Options
        Options of the model.
    strips : int, optional
        Number of strips.
    width, centre : float, optional
        Width and centre of the strip grid [m].
    auto : AutoTable, optional
        Options of the automatic choice that has taken this model, with the choice. Before it,
        `model` is "auto" and `options` are these.
    """

    model: str
    options: Options
    strips: int | None = None
    width: float | None = None
    centre: float | None = None
    auto: AutoTable | None = None

    @property
    def spec(self) -> ContactModelSpec:
        """Registered specification of the contact model."""
        return registry().get(ContactModelSpec, self.model)

    def build(self, grid: Grid, materials: tuple[Material, Material]) -> ContactModel:
        """Return a new contact model for strips, and for the materials of cylinder and roller."""
        return built_plugin(self.spec, ContactModel, CheckedModel, self.options, grid, materials)


@dataclass(frozen=True)
class TermChoice:
    """A term added to the load: its name and options."""

    name: str
    options: Options

    @cached_property
    def built(self) -> LoadTerm:
        """The term."""
        return built_plugin(
            registry().get(LoadSpec, self.name), LoadTerm, CheckedLoadTerm, self.options
        )


@dataclass(frozen=True)
class LoadChoice:
    """A load with its options, and the terms added to it.

    Parameters
    ----------
    kind : str
        Name of the load.
    options : Options
        Options of the load.
    terms : tuple of TermChoice
        The terms, in the order of the scenario.
    """

    kind: str
    options: Options
    terms: tuple[TermChoice, ...] = ()

    @cached_property
    def built(self) -> Load:
        """The load, without its terms."""
        return built_plugin(registry().get(LoadSpec, self.kind), Load, CheckedLoad, self.options)


@dataclass(frozen=True)
class WearChoice:
    """A wear law with its options."""

    law: str
    options: Options

    @property
    def spec(self) -> WearLawSpec:
        """Registered specification of the wear law."""
        return registry().get(WearLawSpec, self.law)

    @cached_property
    def built(self) -> WearLaw:
        """The wear law."""
        return built_plugin(self.spec, WearLaw, CheckedWearLaw, self.options)


#: model of the table's own keys, key with the name of the plugin, kind of plugin
PLUGIN_TABLES: dict[str, tuple[type[Options], str, type[Spec]]] = {
    "contact": (ContactTable, "model", ContactModelSpec),
    "load": (LoadTable, "kind", LoadSpec),
    "wear": (WearTable, "law", WearLawSpec),
}


def _default_model(mistakes: Mistakes) -> str:
    """Return the model of a scenario that names none: one for a friction field if there is any."""
    default = str(ContactTable.model_fields["model"].default)
    fields = [item for item in mistakes.random_inputs if item.role == "field"]
    # a reference model, which takes far longer, last
    models = sorted(installed(ContactModelSpec), key=lambda spec: spec.reference) if fields else []
    for spec in models:
        if spec.capabilities.friction_field:
            mistakes.notes.append(
                f"contact.model is '{spec.name}': {fields[0].name} is a field, {fields[0].kind},"
                f" which '{default}' does not support"
            )
            return spec.name
    return default


def read_contact(mistakes: Mistakes, raw: Mapping[str, object]) -> ContactChoice | None:
    """Return the contact model, or None after adding the mistakes of the table [contact]."""
    raw = {"model": _default_model(mistakes), **raw} if "model" not in raw else raw
    if raw["model"] == AUTO:
        return _read_auto(mistakes, raw)
    keys, spec, rest = choose(mistakes, *PLUGIN_TABLES["contact"], raw, "contact")
    options = validate(mistakes, spec.options, rest, "contact", ContactTable) if spec else None
    strips = (keys.strips, keys.width, keys.centre) if keys else ()
    return ContactChoice(keys.model, options, *strips) if keys and options else None


def _read_auto(mistakes: Mistakes, raw: Mapping[str, object]) -> ContactChoice | None:
    """Return the automatic choice of a contact model, or the model that a study has chosen."""
    given, rest = split_keys(raw, ContactTable)
    keys = validate(mistakes, ContactTable, given, "contact")
    auto = validate(mistakes, AutoTable, rest, "contact", ContactTable)
    if keys is None or auto is None:
        return None
    strips, chosen = (keys.strips, keys.width, keys.centre), auto.chosen
    if chosen is None:
        return ContactChoice(AUTO, auto, *strips)
    spec = mistakes.find_plugin(ContactModelSpec, chosen.model, "contact.chosen", "model")
    options = validate(mistakes, spec.options, chosen.options, "contact.chosen") if spec else None
    if options is None:
        return None
    mistakes.notes += [chosen.why] if chosen.why else []
    return ContactChoice(chosen.model, options, *strips, auto)


def read_wear(mistakes: Mistakes, raw: Mapping[str, object]) -> WearChoice | None:
    """Return the wear law, or None after adding the mistakes of the table [wear]."""
    keys, spec, rest = choose(mistakes, *PLUGIN_TABLES["wear"], raw, "wear")
    options = validate(mistakes, spec.options, rest, "wear", WearTable) if spec else None
    mistakes.notes += _rate_notes(rest)
    if {"wear.factor", "wear.cylinder.k_over_h"} <= mistakes.random.keys():
        mistakes.add(
            "wear",
            "factor",
            "is random, and so is wear.cylinder.k_over_h: the scatter of K/H counts twice",
            None,
            "one of them: delete factor under [wear], or [wear.factor], if the distribution of"
            " k_over_h holds the scatter between specimens, as that of identify --posterior does",
        )
    return WearChoice(keys.law, options) if keys and options is not None else None


def check_contained(mistakes: Mistakes) -> None:
    """Add the mistakes of random inputs whose scatter a posterior of K/H contains already."""
    for factor in mistakes.random_inputs:
        if not isinstance(factor.distribution, TwoLevels | Mixture):
            continue
        for item in mistakes.random_inputs:
            for key in set(item.keys) & set(factor.distribution.contained):
                mistakes.add(
                    item.name,
                    "",
                    f"is random, and the posterior of {factor.name} contains the scatter of {key},"
                    " which was neither random nor known in the identification: it counts twice",
                    item.describe(),
                    f"a fixed value; or identify K/H again with {key} random, or with --fix if it"
                    " was equal in all tests",
                )


def _rate_notes(raw: Mapping[str, object]) -> list[str]:
    """Return a note for each wear factor in a unit of specific wear rates, such as mm^3/(N m)."""
    values = {body: keys.get("k_over_h") for body, keys in raw.items() if isinstance(keys, dict)}
    texts = {b: list(v.values()) if isinstance(v, dict) else [v] for b, v in values.items()}
    return [
        f"wear.{body}.k_over_h is in a unit of specific wear rates, and is a volume per"
        " dissipated energy; a volume per load and sliding distance is"
        f" wear.{body}.specific_wear_rate, which is divided by measured_friction"
        for body, given in texts.items()
        if any(isinstance(text, str) and _PER_LOAD.search(text) for text in given)
    ]


def read_load(mistakes: Mistakes, raw: Mapping[str, object]) -> LoadChoice | None:
    """Return the load with its terms, or None after adding the mistakes of the table [load]."""
    keys, spec, rest = choose(mistakes, *PLUGIN_TABLES["load"], raw, "load")
    kinds = {known.name: known.role for known in installed(LoadSpec)}
    tables = {
        key: value
        for key, value in rest.items()
        if isinstance(value, dict)
        and ("distribution" not in value or kinds.get(key) == "term")
        and (key not in spec.options.model_fields if spec else key in kinds)
    }
    terms = [_read_term(mistakes, name, options) for name, options in tables.items()]
    if keys is None or spec is None:
        return None
    if spec.role == "term":
        mistakes.add(
            "load", "kind", f"'{spec.name}' is a term, added by a table [load.{spec.name}]"
        )
        return None
    rest = {key: value for key, value in rest.items() if key not in tables}
    for name in [key for key in rest if key not in spec.options.model_fields]:
        if kinds.get(name) == "term":
            got = as_written(rest.pop(name))
            mistakes.add("load", name, "is a term of the load", got, f"a table [load.{name}]")
    options = validate(mistakes, spec.options, rest, "load", LoadTable)
    if options is None:
        return None
    load = LoadChoice(keys.kind, options, tuple(term for term in terms if term is not None))
    check_load(mistakes, load)
    return load


def check_load(mistakes: Mistakes, load: LoadChoice) -> None:
    """Add the mistakes of a file that the load reads."""
    try:
        load.built  # noqa: B018  (reads its file)
    except ScenarioError as error:
        mistakes.add_file(error, "load", key_of_file(dict(load.options), error.file))


def _read_term(mistakes: Mistakes, name: str, raw: dict[str, object]) -> TermChoice | None:
    table = f"load.{name}"
    spec = mistakes.find_plugin(LoadSpec, name, table, "")
    if spec and spec.role == "base":
        mistakes.add(table, "", f"'{name}' is a load, chosen by load.kind, not a term")
        return None
    options = validate(mistakes, spec.options, raw, table) if spec else None
    return TermChoice(name, options) if options is not None else None


def described_model(model: str, scenario_text: str) -> str:
    """Return the label of a contact model, ``slender (tangential = "fastsim")``.

    Parameters
    ----------
    model : str
        Name of the model.
    scenario_text : str
        TOML of the scenario; the model's plugin need not be installed.

    Returns
    -------
    str
        Only the name if the scenario gives no option.
    """
    table = tomllib.loads(scenario_text).get("contact", {})
    automatic = table.get("model") == AUTO and "chosen" in table
    given = [
        f"{key} = {as_written(value)}"
        for key, value in (table["chosen"].get("options", {}) if automatic else table).items()
        if key not in ContactTable.model_fields
    ]
    given += [AUTO] if automatic else []
    return f"{model} ({', '.join(given)})" if given else model
