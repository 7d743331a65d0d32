"""Studies of many realisations: the paper's Monte Carlo of one contact."""

from __future__ import annotations

from pathlib import Path

from tests.benchmarks.table import Effort, Row, best
from wearsim.scenario import Scenario, load_scenario
from wearsim.studies.dissipation import dissipation

PAPER = Path(__file__).parents[2] / "scenarios" / "paper-monte-carlo.toml"
MEAN_POWER = 0.1058  # W, of the paper's inputs


def paper() -> Scenario:
    """Return the paper's Monte Carlo, 50 x 50."""
    return load_scenario(PAPER)


def dissipation_rows(effort: Effort) -> list[Row]:
    """Time the paper's Monte Carlo: its contacts, and all of it but its file."""
    scenario, count = paper(), 100 if effort.quick else 1000
    found = [dissipation(scenario, count) for _ in range(effort.repetitions)]
    power = found[0].summaries["power"]
    away = (power.mean - MEAN_POWER) / power.mean_error
    error = f"mean {power.mean:.4g} W, {away:+.1f} standard errors from {MEAN_POWER} W"
    whole = best(lambda: dissipation(scenario, count), effort.repetitions)
    what = f"the paper's Monte Carlo, {count} realisations, 50 x 50 with spin"
    solving = min(result.raw.solve_seconds for result in found)
    return [
        Row(f"{what}: the contacts", solving, "0.1 s, aim 0.02 s", error),
        Row(f"{what}: draws, contacts and statistics", whole, "", error),
    ]
