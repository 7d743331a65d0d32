"""Conformance tests of tables of the scenario that a plugin owns."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from wearsim import Scenario
from wearsim.errors import ScenarioError
from wearsim.plugins import TableSpec
from wearsim.scenario.examples import shipped_scenario
from wearsim.testing.checks import Checks, Fixture, require, spec_checks

_SPEC = "wearsim.plugins.TableSpec"
_UNKNOWN = "key-of-no-table"
TABLE: Checks[TableFixture] = spec_checks()


class TableFixture(Fixture[TableSpec]):
    """A table under test, as a part of a scenario of this project."""

    def scenario(self, **further: object) -> Scenario:
        """Return a scenario with the table."""
        table = {**self.configured.raw, **further}
        return shipped_scenario("rig-450min", {self.configured.spec.name: table})


@TABLE.specified_in(_SPEC)
def scenario_has_the_options(fixture: TableFixture) -> None:
    """The options are in the scenario under the name of the table, with its values."""
    name, tables = fixture.configured.spec.name, fixture.scenario().tables
    require(name in tables, f"the scenario has no table '{name}': the plugin is not installed")
    require(tables[name] == fixture.configured.options, f"the options are {tables[name]}")


@TABLE.specified_in(_SPEC)
def mistake_names_table_and_key(fixture: TableFixture) -> None:
    """A key that the table does not have is an error with the names of table and key."""
    name = fixture.configured.spec.name
    try:
        fixture.scenario(**{_UNKNOWN: 1})
    except ScenarioError as error:
        places = [(mistake.table, mistake.key) for mistake in error.mistakes]
        require(places == [(name, _UNKNOWN)], f"the mistakes are at {places}")
    else:
        require(False, f"the key {_UNKNOWN} is no mistake")


@TABLE.specified_in(_SPEC)
def other_studies_are_unchanged(fixture: TableFixture) -> None:
    """All other fields of the scenario are those of a scenario without the table."""
    without_table: dict[str, Any] = {"text": "", "tables": {}}
    with_plugin = replace(fixture.scenario(), **without_table)
    plain = replace(shipped_scenario("rig-450min"), **without_table)
    differ = [
        item.name
        for item in fields(plain)
        if item.repr and repr(getattr(with_plugin, item.name)) != repr(getattr(plain, item.name))
    ]
    require(not differ, f"{', '.join(differ)} of the scenario are others")
