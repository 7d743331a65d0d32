"""Wear of rolling contacts over millions of roller passes.

The public names are imported at their first use, so that importing wearsim is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.results import (
        DissipationResult,
        EnsembleResult,
        Result,
        open_dissipation,
        open_ensemble,
        open_results,
    )
    from wearsim.scenario import Scenario, load_scenario
    from wearsim.studies.contact.monte_carlo import dissipation
    from wearsim.studies.contact.single import ContactStudy, solve_contact, study_contact
    from wearsim.studies.ensemble.api import ensemble, resume_ensemble
    from wearsim.studies.ensemble.compare import compare
    from wearsim.studies.run.run import resume, run
    from wearsim.types import ContactSolution, Profile

__all__ = [
    "ContactSolution",
    "ContactStudy",
    "DissipationResult",
    "EnsembleResult",
    "Profile",
    "Result",
    "Scenario",
    "compare",
    "dissipation",
    "ensemble",
    "load_scenario",
    "open_dissipation",
    "open_ensemble",
    "open_results",
    "resume",
    "resume_ensemble",
    "run",
    "solve_contact",
    "study_contact",
]

_MODULES = {
    "ContactSolution": "wearsim.types",
    "ContactStudy": "wearsim.studies.contact.single",
    "DissipationResult": "wearsim.results",
    "EnsembleResult": "wearsim.results",
    "Profile": "wearsim.types",
    "Result": "wearsim.results",
    "Scenario": "wearsim.scenario",
    "compare": "wearsim.studies.ensemble.compare",
    "dissipation": "wearsim.studies.contact.monte_carlo",
    "ensemble": "wearsim.studies.ensemble.api",
    "load_scenario": "wearsim.scenario",
    "open_dissipation": "wearsim.results",
    "open_ensemble": "wearsim.results",
    "open_results": "wearsim.results",
    "resume": "wearsim.studies.run.run",
    "resume_ensemble": "wearsim.studies.ensemble.api",
    "run": "wearsim.studies.run.run",
    "solve_contact": "wearsim.studies.contact.single",
    "study_contact": "wearsim.studies.contact.single",
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415

        return version("wearsim")
    if name not in _MODULES:
        raise AttributeError(f"module 'wearsim' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
