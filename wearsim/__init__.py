"""Wear of rolling contacts over millions of roller passes.

The public names are imported at their first use, so that importing wearsim is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.errors import (
        CapabilityError,
        ContactError,
        Interrupted,
        PluginError,
        ResultsFileError,
        ScenarioError,
        SolverError,
        StepError,
        UnknownNameError,
        WearsimError,
        WorkerError,
    )
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
    from wearsim.studies.ensemble.sweep import sweep
    from wearsim.studies.run.run import resume, run
    from wearsim.types import ContactSolution, Profile

# names by the module that defines them
_NAMES = {
    "wearsim.errors": [
        "CapabilityError",
        "ContactError",
        "Interrupted",
        "PluginError",
        "ResultsFileError",
        "ScenarioError",
        "SolverError",
        "StepError",
        "UnknownNameError",
        "WearsimError",
        "WorkerError",
    ],
    "wearsim.results": [
        "DissipationResult",
        "EnsembleResult",
        "Result",
        "open_dissipation",
        "open_ensemble",
        "open_results",
    ],
    "wearsim.scenario": ["Scenario", "load_scenario"],
    "wearsim.studies.contact.monte_carlo": ["dissipation"],
    "wearsim.studies.contact.single": ["ContactStudy", "solve_contact", "study_contact"],
    "wearsim.studies.ensemble.api": ["ensemble", "resume_ensemble"],
    "wearsim.studies.ensemble.compare": ["compare"],
    "wearsim.studies.ensemble.sweep": ["sweep"],
    "wearsim.studies.run.run": ["resume", "run"],
    "wearsim.types": ["ContactSolution", "Profile"],
}
_MODULES = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "CapabilityError",
    "ContactError",
    "ContactSolution",
    "ContactStudy",
    "DissipationResult",
    "EnsembleResult",
    "Interrupted",
    "PluginError",
    "Profile",
    "Result",
    "ResultsFileError",
    "Scenario",
    "ScenarioError",
    "SolverError",
    "StepError",
    "UnknownNameError",
    "WearsimError",
    "WorkerError",
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
    "sweep",
]


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415

        return version("wearsim")
    if name not in _MODULES:
        known = "" if name.startswith("_") else f"; it has {', '.join(__all__)}"
        raise AttributeError(f"module 'wearsim' has no attribute '{name}'{known}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
