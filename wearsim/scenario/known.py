"""The tables of a scenario and everything that may stand in them, plugins' options included."""

from __future__ import annotations

from wearsim.plugins import ContactModelSpec, LoadSpec, WearLawSpec, registry
from wearsim.scenario.bodies import CylinderTable, RollerTable
from wearsim.scenario.choices import ContactTable, LoadTable, WearTable
from wearsim.scenario.names import Names
from wearsim.scenario.sections import (
    CreepageTable,
    EvolutionTable,
    FrictionTable,
    OperationTable,
    OutputsTable,
    TopTable,
)
from wearsim.scenario.validation import Table

TABLES: dict[str, type[Table]] = {
    "roller": RollerTable,
    "cylinder": CylinderTable,
    "operation": OperationTable,
    "load": LoadTable,
    "friction": FrictionTable,
    "creepage": CreepageTable,
    "contact": ContactTable,
    "wear": WearTable,
    "evolution": EvolutionTable,
    "outputs": OutputsTable,
}
REQUIRED = ("roller", "cylinder", "operation", "load", "friction", "creepage")


def all_names() -> Names:
    """Return the keys of every table and of every plugin."""
    places = {"the top of the file": set(TopTable.model_fields)}
    places |= {f"[{table}]": set(model.model_fields) for table, model in TABLES.items()}
    for kind, table, key in (
        (ContactModelSpec, "contact", "model"),
        (LoadSpec, "load", "kind"),
        (WearLawSpec, "wear", "law"),
    ):
        for name in registry().names(kind):
            spec = registry().get(kind, name)
            term = isinstance(spec, LoadSpec) and spec.role == "term"
            place = f"[load.{name}]" if term else f'[{table}] with {key} = "{name}"'
            places[place] = set(spec.options.model_fields)
    return Names(places)
