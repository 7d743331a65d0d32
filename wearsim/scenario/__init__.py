"""A scenario: TOML with units, validated as a whole, frozen, in SI."""

from wearsim.scenario.bodies import Cylinder, Roller, read_profile
from wearsim.scenario.choices import ContactChoice, LoadChoice, TermChoice, WearChoice
from wearsim.scenario.describing import described_model
from wearsim.scenario.overrides import parse_override
from wearsim.scenario.random_inputs import Persistence, RandomInput
from wearsim.scenario.reading import load_scenario, parse_scenario
from wearsim.scenario.realising import realise
from wearsim.scenario.sampling import SamplingTable
from wearsim.scenario.scenario import Drawn, Scenario, require_run
from wearsim.scenario.schema import scenario_schema
from wearsim.scenario.sections import (
    CreepageTable,
    EvolutionTable,
    FrictionTable,
    OperationTable,
    OutputsTable,
)

__all__ = [
    "ContactChoice",
    "CreepageTable",
    "Cylinder",
    "Drawn",
    "EvolutionTable",
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
    "described_model",
    "load_scenario",
    "parse_override",
    "parse_scenario",
    "read_profile",
    "realise",
    "require_run",
    "scenario_schema",
]
