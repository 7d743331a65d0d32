"""`wearsim check`: all mistakes of a scenario at once, or a table of what will run."""

from __future__ import annotations

from wearsim.cli.arguments import ScenarioFile, Settings, read_scenario
from wearsim.cli.output import note, write_table


def check(scenario: ScenarioFile, settings: Settings = None) -> None:
    """Tell all mistakes of a scenario at once, or what will run."""
    loaded = read_scenario(scenario, settings)
    from wearsim.studies.run.dry_run import plan

    rows = plan(loaded)
    write_table(f"ok: {loaded.title}", rows)
    for text in loaded.notes:
        note(f"note: {text}")
