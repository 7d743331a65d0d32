"""`wearsim check`: all mistakes of a scenario, or a table of what will run."""

from __future__ import annotations

from wearsim.cli.shared import ScenarioFile, Settings, read_scenario, write_notes, write_table


def check(scenario: ScenarioFile, settings: Settings = None) -> None:
    """Check a scenario: print all mistakes, or what will run."""
    loaded = read_scenario(scenario, settings)
    from wearsim.studies.dry_run import plan

    write_table(f"ok: {loaded.title}", plan(loaded))
    write_notes(loaded.notes)
