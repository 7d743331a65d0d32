"""`wearsim schema`: JSON Schema of a scenario, for editors."""

from __future__ import annotations

from wearsim.cli.shared import write_json


def schema() -> None:
    """Write the JSON Schema of a scenario, for editors."""
    from wearsim.scenario import scenario_schema

    write_json(scenario_schema())
