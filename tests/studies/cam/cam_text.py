"""Scenarios of cams for tests."""

from __future__ import annotations

from pathlib import Path

from wearsim.scenario import Scenario, load_scenario

SCENARIOS = Path(__file__).parents[3] / "scenarios"


def cam(name: str = "cycloidal", **changes: object) -> Scenario:
    """Return a shipped scenario of a cam with values changed, "table__key"."""
    overrides = {key.replace("__", "."): value for key, value in changes.items()}
    return load_scenario(SCENARIOS / f"cam-{name}.toml", overrides)


def prescribed(name: str = "cycloidal", **changes: object) -> Scenario:
    """Return a shipped scenario with a prescribed creepage of 0.001 and no yaw."""
    drive = {"creepage": {"drive": "creepage", "longitudinal": 1e-3}}
    return cam(name, **drive, **changes)
