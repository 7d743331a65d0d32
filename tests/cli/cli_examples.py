"""Type of the command under test, and a short scenario."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from typer.testing import Result

from tests.rig_text import BODIES, RUBBING

Command = Callable[..., Result]
SCENARIOS = Path(__file__).parents[2] / "scenarios"
SHORT = (
    'title = "a short [test]"\n\n'
    + BODIES
    + """
[operation]
speed = "1000 rpm"
duration = "2 min"
rollers = 3

[load]
normal_force = "300 N"

"""
    + RUBBING
    + """
[wear]
[wear.cylinder]
k_over_h = "1.1e-11 1/Pa"

[wear.roller]
k_over_h = "0 1/Pa"
"""
)
