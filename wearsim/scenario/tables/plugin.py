"""Tables that choose a plugin: [contact], [load] and [wear]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

from pydantic import Field

from wearsim.errors import ScenarioError
from wearsim.plugins import (
    ContactModel,
    ContactModelSpec,
    Load,
    LoadSpec,
    LoadTerm,
    Options,
    WearLaw,
    WearLawSpec,
    registry,
)
from wearsim.quantities import Length, PositiveLength
from wearsim.scenario.parse.mistakes import Mistakes, Table
from wearsim.scenario.parse.pydantic_errors import key_of_file, split_keys
from wearsim.scenario.parse.validate import validate
from wearsim.units import shown


class ContactTable(Table):
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


class LoadTable(Table):
    """Load on a roller; other keys are options of the chosen load, sub-tables are added terms."""

    kind: str = Field(default="constant", description="Name of the load.")


class WearTable(Table):
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
    """

    model: str
    options: Options
    strips: int | None = None
    width: float | None = None
    centre: float | None = None

    @property
    def spec(self) -> ContactModelSpec:
        """Registered specification of the contact model."""
        return registry().get(ContactModelSpec, self.model)

    def build(self) -> ContactModel:
        """Return a new contact model, not yet prepared."""
        return self.spec.factory(self.options)


@dataclass(frozen=True)
class TermChoice:
    """A term added to the load: its name and options."""

    name: str
    options: Options

    def build(self) -> LoadTerm:
        """Return a new term."""
        return cast("LoadTerm", registry().get(LoadSpec, self.name).factory(self.options))


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

    def build(self) -> Load:
        """Return a new load, without its terms."""
        return cast("Load", registry().get(LoadSpec, self.kind).factory(self.options))


@dataclass(frozen=True)
class WearChoice:
    """A wear law with its options."""

    law: str
    options: Options

    @property
    def spec(self) -> WearLawSpec:
        """Registered specification of the wear law."""
        return registry().get(WearLawSpec, self.law)

    def build(self) -> WearLaw:
        """Return a new wear law."""
        return self.spec.factory(self.options)


def _default_model(mistakes: Mistakes) -> str:
    """Return the model of a scenario that names none: one for a friction field if there is any."""
    default = str(ContactTable.model_fields["model"].default)
    field = next((item for item in mistakes.random if item.role == "field"), None)
    if field is None:
        return default
    known = [registry().get(ContactModelSpec, n) for n in registry().names(ContactModelSpec)]
    name = next((spec.name for spec in known if spec.capabilities.friction_field), None)
    if name is None:
        return default
    mistakes.notes.append(
        f"contact.model is '{name}': {field.name} is a field, {field.kind}, which '{default}' does"
        " not support"
    )
    return name


def read_contact(raw: Mapping[str, object], mistakes: Mistakes) -> ContactChoice | None:
    """Return the contact model, or None after adding the mistakes of the table [contact]."""
    own, rest = split_keys(raw, ContactTable)
    if "model" not in own:
        own["model"] = _default_model(mistakes)
    name = own["model"]
    table = validate(mistakes, ContactTable, own, "contact")
    spec = None
    if isinstance(name, str):
        spec = mistakes.find_plugin(ContactModelSpec, name, "contact", "model")
    options = validate(mistakes, spec.options, rest, "contact", ContactTable) if spec else None
    if table is None or options is None:
        return None
    return ContactChoice(table.model, options, table.strips, table.width, table.centre)


def read_wear(raw: Mapping[str, object], mistakes: Mistakes) -> WearChoice | None:
    """Return the wear law, or None after adding the mistakes of the table [wear]."""
    own, rest = split_keys(raw, WearTable)
    table = validate(mistakes, WearTable, own, "wear")
    spec = mistakes.find_plugin(WearLawSpec, table.law, "wear", "law") if table else None
    options = validate(mistakes, spec.options, rest, "wear", WearTable) if spec else None
    return WearChoice(table.law, options) if table and options is not None else None


def read_load(raw: Mapping[str, object], mistakes: Mistakes) -> LoadChoice | None:
    """Return the load with its terms, or None after adding the mistakes of the table [load]."""
    own, rest = split_keys(raw, LoadTable)
    table = validate(mistakes, LoadTable, own, "load")
    spec = mistakes.find_plugin(LoadSpec, table.kind, "load", "kind") if table else None
    tables = {
        key: value
        for key, value in rest.items()
        if isinstance(value, dict)
        and ("distribution" not in value or _is_term(key))
        and (key not in spec.options.model_fields if spec else key in registry().names(LoadSpec))
    }
    terms = [_read_term(name, options, mistakes) for name, options in tables.items()]
    if table is None or spec is None:
        return None
    if spec.role == "term":
        what = f"'{spec.name}' is a term, added by a table [load.{spec.name}]"
        mistakes.add("load", "kind", what)
        return None
    rest = {key: value for key, value in rest.items() if key not in tables}
    for name in [key for key in rest if key not in spec.options.model_fields and _is_term(key)]:
        expected = f"a table [load.{name}]"
        mistakes.add("load", name, "is a term of the load", shown(rest.pop(name)), expected)
    options = validate(mistakes, spec.options, rest, "load", LoadTable)
    if options is None:
        return None
    try:
        spec.factory(options)  # for the mistakes of a file that the load reads
    except ScenarioError as error:
        mistakes.add_file(error, "load", key_of_file(rest, error.file))
        return None
    if None in terms:
        return None
    return LoadChoice(table.kind, options, tuple(term for term in terms if term is not None))


def _is_term(name: str) -> bool:
    return name in registry().names(LoadSpec) and registry().get(LoadSpec, name).role == "term"


def _read_term(name: str, raw: dict[str, object], mistakes: Mistakes) -> TermChoice | None:
    table = f"load.{name}"
    spec = mistakes.find_plugin(LoadSpec, name, table, "")
    if spec and spec.role == "base":
        mistakes.add(table, "", f"'{name}' is a load, chosen by load.kind, not a term")
        return None
    options = validate(mistakes, spec.options, raw, table) if spec else None
    return TermChoice(name, options) if options is not None else None
