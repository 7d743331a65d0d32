"""Scenarios of one contact with random inputs of all kinds."""

from __future__ import annotations

from pathlib import Path

from tests.rig_text import BODIES, RUBBING
from wearsim.scenario import Scenario, load_scenario, parse_scenario

PAPER = Path(__file__).parents[2] / "scenarios" / "paper-monte-carlo.toml"
COARSE: dict[str, object] = {"contact__mx": 16, "contact__my": 24}
NO_ANGLES: dict[str, object] = {"creepage__yaw": "0 rad"}  # replaces the misalignment

CONTACT = (
    'title = "a contact"\n\n'
    + BODIES
    + """
[operation]
speed = "1000 rpm"

[load]
normal_force = {distribution = "maxent", support = ["0 N", "inf"], mean = "300 N", std = "30 N"}

"""
    + RUBBING
    + """
[contact]
model = "hertz-fastsim"
mx = 16
my = 24
"""
)


def paper(**overrides: object) -> Scenario:
    """Return the paper's Monte Carlo scenario; `__` in a name is the dot of a key."""
    return load_scenario(PAPER, _dotted(overrides))


def contact(*, files: dict[str, str] | None = None, **overrides: object) -> Scenario:
    """Return a contact with a random load, and overrides."""
    return parse_scenario(CONTACT, "contact.toml", (files or {}).__getitem__, _dotted(overrides))


def normal(mean: object, std: object, **more: object) -> dict[str, object]:
    """Return the table of a normal random input."""
    return {"distribution": "normal", "mean": mean, "std": std, **more}


def positive(mean: object, std: object) -> dict[str, object]:
    """Return the table of a random input that is above zero."""
    zero = mean.replace(mean.split()[0], "0") if isinstance(mean, str) else 0
    return {"distribution": "maxent", "support": [zero, "inf"], "mean": mean, "std": std}


def field(kind: str, std: float = 0.01, **options: object) -> dict[str, object]:
    """Return the table of a friction field about 0.1."""
    return {"distribution": kind, "marginal": positive(0.1, std), **options}


def _dotted(overrides: dict[str, object]) -> dict[str, object]:
    return {key.replace("__", "."): value for key, value in overrides.items()}
