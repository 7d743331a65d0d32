"""Plugins defined in tests, and a scenario that uses them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace

from tests.rig_text import BODIES, RUBBING
from wearsim.plugins import LoadSpec, Options, hookimpl
from wearsim.scenario import Scenario, parse_scenario

DATA = Path(__file__).parent / "data"
HOOKS = (
    "wearsim_contact_models",
    "wearsim_wear_laws",
    "wearsim_loads",
    "wearsim_random_inputs",
    "wearsim_motion_laws",
    "wearsim_axial_profiles",
    "wearsim_study_kinds",
    "wearsim_tables",
)
RIG = (
    BODIES
    + """
[operation]
speed = "1000 rpm"
duration = "2 min"
rollers = 3

"""
    + RUBBING
)
TABLES = {
    "contact": 'model = "slender"',
    "load": 'kind = "constant"\nnormal_force = "300 N"',
    "wear": 'cylinder = { k_over_h = "1.1e-11 1/Pa" }\nroller = { k_over_h = "0 1/Pa" }',
}


class Point:
    """Entry point of a distribution that is not installed."""

    def __init__(
        self,
        load: Callable[[], ModuleType],
        name: str = "made-up",
        distribution: str = "wearsim-made-up",
        version: str = "0.1",
    ) -> None:
        self.load, self.name, self.value = load, name, name
        self.dist = SimpleNamespace(name=distribution, version=version)


def module(**hooks: Callable[..., object]) -> Callable[[], ModuleType]:
    """Return a loader of a module that implements hooks."""
    made = ModuleType("made_up")
    for name, function in hooks.items():
        function.__name__ = name
        setattr(made, name, hookimpl(function))
    return lambda: made


def load_named(name: str) -> Callable[[], list[LoadSpec]]:
    """Return a hook that yields a load of this name."""
    return lambda: [LoadSpec(name, Options, "a load", factory=lambda options: None, protocol=2)]


def rig(
    overrides: dict[str, object] | None = None,
    read: Callable[[str], str] = {}.__getitem__,
    **tables: str,
) -> Scenario:
    """Return a short test of the rig, with some of its tables replaced."""
    text = RIG + "".join(f"\n[{name}]\n{body}\n" for name, body in (TABLES | tables).items())
    return parse_scenario(text, "rig.toml", read, overrides)
