"""Scenarios: TOML with units, validated as a whole, immutable and in SI once read."""

from wearsim.scenario.parse.fields import Persistence, RandomInput
from wearsim.scenario.parse.overrides import parse_override
from wearsim.scenario.realise import realise
from wearsim.scenario.scenario import (
    Drawn,
    Scenario,
    as_scenario,
    load_scenario,
    parse_scenario,
    require_run,
)
from wearsim.scenario.tables.bodies import Cylinder, Roller
from wearsim.scenario.tables.fatigue import FatigueChoice, FatigueLawChoice
from wearsim.scenario.tables.plain import (
    CreepageTable,
    EvolutionTable,
    FrictionTable,
    OperationTable,
    OutputsTable,
    SamplingTable,
)
from wearsim.scenario.tables.plugin import (
    ContactChoice,
    LoadChoice,
    TermChoice,
    WearChoice,
    described_model,
)

__all__ = [
    "ContactChoice",
    "CreepageTable",
    "Cylinder",
    "Drawn",
    "EvolutionTable",
    "FatigueChoice",
    "FatigueLawChoice",
    "FrictionTable",
    "LoadChoice",
    "OperationTable",
    "OutputsTable",
    "Persistence",
    "RandomInput",
    "Roller",
    "SamplingTable",
    "Scenario",
    "TermChoice",
    "WearChoice",
    "as_scenario",
    "described_model",
    "load_scenario",
    "parse_override",
    "parse_scenario",
    "realise",
    "require_run",
]
