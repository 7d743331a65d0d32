"""The tables of a scenario and their keys, including the options of plugins."""

from __future__ import annotations

from wearsim.plugins import ContactModelSpec, LoadSpec, RandomInputSpec, WearLawSpec, registry
from wearsim.scenario.parse.mistakes import Table
from wearsim.scenario.random.model import RandomInputTable
from wearsim.scenario.tables.bodies import CylinderTable, RollerTable
from wearsim.scenario.tables.plain import (
    CreepageTable,
    EvolutionTable,
    FrictionTable,
    OperationTable,
    OutputsTable,
    TopTable,
)
from wearsim.scenario.tables.plugin import ContactTable, LoadTable, WearTable
from wearsim.scenario.tables.sampling import SamplingTable

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
    "sampling": SamplingTable,
}
REQUIRED = ("roller", "cylinder", "operation", "load", "friction", "creepage")


def keys_by_place() -> dict[str, set[str]]:
    """Return the keys of every table and of every plugin, by their place in words."""
    keys = {"the top of the file": set(TopTable.model_fields)}
    keys |= {f"[{table}]": set(model.model_fields) for table, model in TABLES.items()}
    for kind, table, key in (
        (ContactModelSpec, "contact", "model"),
        (LoadSpec, "load", "kind"),
        (WearLawSpec, "wear", "law"),
    ):
        for name in registry().names(kind):
            spec = registry().get(kind, name)
            term = isinstance(spec, LoadSpec) and spec.role == "term"
            place = f"[load.{name}]" if term else f'[{table}] with {key} = "{name}"'
            keys[place] = set(spec.options.model_fields)
    keys["a random input"] = set(RandomInputTable.model_fields)
    for name in registry().names(RandomInputSpec):
        options = registry().get(RandomInputSpec, name).options
        keys[f'a random input with distribution = "{name}"'] = set(options.model_fields)
    return keys
