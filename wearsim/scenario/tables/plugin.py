"""The tables that choose a plugin: [contact], [load] and [wear]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar, cast

from pydantic import Field

from wearsim.errors import PluginError, ScenarioError
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
from wearsim.quantities import Length, PositiveLength
from wearsim.scenario.parse.mistakes import Report, Table
from wearsim.scenario.parse.pydantic_errors import key_of_file
from wearsim.scenario.parse.validate import validate
from wearsim.units import shown

S = TypeVar("S", bound=Spec)


class ContactTable(Table):
    """How a contact is solved; the model's own options stand beside these keys."""

    model: str = Field(default="slender", description="Name of the contact model.")
    strips: int | None = Field(
        default=None, ge=3, description="Number of strips across the track; chosen if left out."
    )
    width: PositiveLength | None = Field(
        default=None, description="Width that the strips cover; chosen if left out."
    )
    centre: Length | None = Field(
        default=None, description="Axial position of the strips' middle; chosen if left out."
    )


class LoadTable(Table):
    """The load on a roller; the kind's own options stand beside this key, terms in sub-tables."""

    kind: str = Field(default="constant", description="Name of the load.")


class WearTable(Table):
    """What wears; the law's own options stand beside this key."""

    law: str = Field(default="archard-dissipation", description="Name of the wear law.")


@dataclass(frozen=True)
class ContactChoice:
    """A contact model with its options, and the strips asked for.

    Parameters
    ----------
    model : str
        Name of the contact model.
    options : Options
        The model's options.
    strips : int, optional
        Number of strips.
    width, centre : float, optional
        Width of the strip grid, and its middle [m].
    """

    model: str
    options: Options
    strips: int | None = None
    width: float | None = None
    centre: float | None = None

    @property
    def spec(self) -> ContactModelSpec:
        """What the plugin registered."""
        return registry().get(ContactModelSpec, self.model)

    def build(self) -> ContactModel:
        """Return a new contact model, not yet prepared."""
        return self.spec.factory(self.options)


@dataclass(frozen=True)
class TermChoice:
    """A term added to the load: its name and options."""

    name: str
    options: Options

    @property
    def spec(self) -> LoadSpec:
        """What the plugin registered."""
        return registry().get(LoadSpec, self.name)

    def build(self) -> LoadTerm:
        """Return a new term."""
        return cast("LoadTerm", self.spec.factory(self.options))


@dataclass(frozen=True)
class LoadChoice:
    """A load with its options, and the terms added to it.

    Parameters
    ----------
    kind : str
        Name of the load.
    options : Options
        Its options.
    terms : tuple of TermChoice
        The terms, in the order of the scenario.
    """

    kind: str
    options: Options
    terms: tuple[TermChoice, ...] = ()

    @property
    def spec(self) -> LoadSpec:
        """What the plugin registered."""
        return registry().get(LoadSpec, self.kind)

    def build(self) -> Load:
        """Return a new load, without its terms."""
        return cast("Load", self.spec.factory(self.options))


@dataclass(frozen=True)
class WearChoice:
    """A wear law with its options."""

    law: str
    options: Options

    @property
    def spec(self) -> WearLawSpec:
        """What the plugin registered."""
        return registry().get(WearLawSpec, self.law)

    def build(self) -> WearLaw:
        """Return a new wear law."""
        return self.spec.factory(self.options)


def _find(kind: type[S], name: str, table: str, key: str, report: Report) -> S | None:
    try:
        return registry().get(kind, name)
    except PluginError as error:
        report.add(table, key, str(error))
        return None


def _split(
    raw: Mapping[str, object], own: type[Table]
) -> tuple[dict[str, object], dict[str, object]]:
    """Split a table into the scenario's own keys and the plugin's options."""
    ours = {key: value for key, value in raw.items() if key in own.model_fields}
    return ours, {key: value for key, value in raw.items() if key not in ours}


def _default_model(report: Report) -> str:
    """Return the model of a scenario that names none: the default, or one that can take a field."""
    usual = str(ContactTable.model_fields["model"].default)
    field = next((item for item in report.random if item.role == "field"), None)
    if field is None:
        return usual
    known = [registry().get(ContactModelSpec, n) for n in registry().names(ContactModelSpec)]
    able = [spec.name for spec in known if spec.capabilities.friction_field]
    if not able:
        return usual
    report.notes.append(
        f"contact.model is '{able[0]}': {field.name} is a field, {field.kind}, and '{usual}' takes"
        " none"
    )
    return able[0]


def read_contact(raw: Mapping[str, object], report: Report) -> ContactChoice | None:
    """Return the table [contact], or None after noting its mistakes."""
    ours, rest = _split(raw, ContactTable)
    if "model" not in ours:
        ours["model"] = _default_model(report)
    name = ours["model"]
    table = validate(report, ContactTable, ours, "contact")
    spec = None
    if isinstance(name, str):
        spec = _find(ContactModelSpec, name, "contact", "model", report)
    options = validate(report, spec.options, rest, "contact", ContactTable) if spec else None
    if table is None or options is None:
        return None
    return ContactChoice(table.model, options, table.strips, table.width, table.centre)


def read_wear(raw: Mapping[str, object], report: Report) -> WearChoice | None:
    """Return the table [wear], or None after noting its mistakes."""
    ours, rest = _split(raw, WearTable)
    table = validate(report, WearTable, ours, "wear")
    if table is None:
        return None
    spec = _find(WearLawSpec, table.law, "wear", "law", report)
    options = validate(report, spec.options, rest, "wear", WearTable) if spec else None
    return WearChoice(table.law, options) if options is not None else None


def read_load(raw: Mapping[str, object], report: Report) -> LoadChoice | None:
    """Return the table [load] with its terms, or None after noting its mistakes."""
    ours, rest = _split(raw, LoadTable)
    table = validate(report, LoadTable, ours, "load")
    spec = _find(LoadSpec, table.kind, "load", "kind", report) if table else None
    tables = {
        key: value
        for key, value in rest.items()
        if isinstance(value, dict) and ("distribution" not in value or _is_term(key))
    }
    if spec:
        tables = {k: v for k, v in tables.items() if k not in spec.options.model_fields}
    else:
        tables = {k: v for k, v in tables.items() if k in registry().names(LoadSpec)}
    terms = [_read_term(name, options, report) for name, options in tables.items()]
    if table is None or spec is None:
        return None
    if spec.role == "term":
        report.add("load", "kind", f"'{spec.name}' is a term, added by a table [load.{spec.name}]")
        return None
    rest = {key: value for key, value in rest.items() if key not in tables}
    for name in [key for key in rest if key not in spec.options.model_fields and _is_term(key)]:
        expected = f"a table [load.{name}]"
        report.add("load", name, "is a term of the load", shown(rest.pop(name)), expected)
    options = validate(report, spec.options, rest, "load", LoadTable)
    if options is None or not _builds(spec, options, rest, report) or None in terms:
        return None
    return LoadChoice(table.kind, options, tuple(term for term in terms if term is not None))


def _builds(spec: LoadSpec, options: Options, raw: Mapping[str, object], report: Report) -> bool:
    """Build the load once, so that the mistakes of a file it reads are told with the others."""
    try:
        spec.factory(options)
    except ScenarioError as error:
        report.add_file(error, "load", key_of_file(raw, error.file))
        return False
    return True


def _is_term(name: str) -> bool:
    return name in registry().names(LoadSpec) and registry().get(LoadSpec, name).role == "term"


def _read_term(name: str, raw: dict[str, object], report: Report) -> TermChoice | None:
    table = f"load.{name}"
    spec = _find(LoadSpec, name, table, "", report)
    if spec is None:
        return None
    if spec.role == "base":
        report.add(table, "", f"'{name}' is no term but a load of its own, chosen by load.kind")
        return None
    options = validate(report, spec.options, raw, table)
    return TermChoice(name, options) if options is not None else None
