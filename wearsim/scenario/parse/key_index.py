"""The tables of a scenario and their keys, including the options of plugins."""

from __future__ import annotations

from wearsim.plugins import LoadSpec, RandomInputSpec
from wearsim.scenario.parse.mistakes import Table, installed
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
from wearsim.scenario.tables.plugin import PLUGIN_TABLES, ContactTable, LoadTable, WearTable
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
    for table, (_, key, kind) in PLUGIN_TABLES.items():
        for spec in installed(kind):
            term = isinstance(spec, LoadSpec) and spec.role == "term"
            place = f"[load.{spec.name}]" if term else f'[{table}] with {key} = "{spec.name}"'
            keys[place] = set(spec.options.model_fields)
    keys["a random input"] = set(RandomInputTable.model_fields)
    for spec in installed(RandomInputSpec):
        place = f'a random input with distribution = "{spec.name}"'
        keys[place] = set(spec.options.model_fields)
    return keys
