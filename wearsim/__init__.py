"""wearsim: the wear of rolling contacts, stepped through millions of roller passes.

The names below are loaded when they are first used, so that importing wearsim is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.results import DissipationResult, Result, open_dissipation, open_results
    from wearsim.scenario import Scenario, load_scenario
    from wearsim.studies.contact import ContactStudy, solve_contact, study_contact
    from wearsim.studies.dissipation import dissipation
    from wearsim.studies.replay import resume, run
    from wearsim.types import ContactSolution, Profile

__all__ = [
    "ContactSolution",
    "ContactStudy",
    "DissipationResult",
    "Profile",
    "Result",
    "Scenario",
    "dissipation",
    "load_scenario",
    "open_dissipation",
    "open_results",
    "resume",
    "run",
    "solve_contact",
    "study_contact",
]

_HOMES = {
    "ContactSolution": "wearsim.types",
    "ContactStudy": "wearsim.studies.contact",
    "DissipationResult": "wearsim.results",
    "Profile": "wearsim.types",
    "Result": "wearsim.results",
    "Scenario": "wearsim.scenario",
    "dissipation": "wearsim.studies.dissipation",
    "load_scenario": "wearsim.scenario",
    "open_dissipation": "wearsim.results",
    "open_results": "wearsim.results",
    "resume": "wearsim.studies.replay",
    "run": "wearsim.studies.replay",
    "solve_contact": "wearsim.studies.contact",
    "study_contact": "wearsim.studies.contact",
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415

        return version("wearsim")
    if name not in _HOMES:
        raise AttributeError(f"module 'wearsim' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
