"""Wear of rolling contacts over millions of roller passes.

Scenarios
    load_scenario(path, overrides)      read a scenario from a TOML file
    Scenario                            all inputs of a test: from_toml, from_dict, changed
    scenario_schema()                   its JSON Schema, with the installed plugins
    explore(scenario)                   a page on which its values are changed
    Profile(y, height)                  a measured profile of the cylinder

One contact
    solve_contact(scenario)             solve the contact of the first roller
    study_contact(scenario)             the same, with its problem, fields and error estimate
    dissipation(scenario, n)            solve it for n realisations of the random inputs
    study_cam(scenario, angles)         motion, loads and contact of a cam along its angle

Wear tests
    run(scenario, output)               run a wear test from start to end
    resume(file, until)                 continue or extend a run from its file
    sweep(scenario, key, values)        run tests or ensembles for several values of one key
    compare(results, labels)            compare runs and ensembles at their ends

Ensembles
    ensemble(scenario, n, output)       run a wear test for each of n realisations
    resume_ensemble(file)               continue or extend an ensemble or lives from their file

Identification
    identify(scenario, profiles)        wear factor K/H of measured tests, and its scatter

Lives
    life(scenario, n, output)           run n tests to the first limit that they reach
    sweep_life(scenario, key, values)   lives for several values of one key

Designs, of the extra ``wearsim[optimise]``
    optimise(scenario, vary)            best values of design variables
    resume_optimise(file)               continue an optimisation from its file

Results
    open_results(file)                  open a results file of any kind
    Result                              of a wear test: depth, profiles, normal_force, ...
    DissipationResult                   of a dissipation study: power, summaries, convergence
    EnsembleResult                      of an ensemble: estimate, course, band, sensitivity
    IdentificationResult                of an identification: tests, verdict, posterior
    LifeResult                          of a study of lives: b, survival, compare
    ContactSolution, ContactStudy       of one contact: dissipation, line_load, approach, ...
    CamStudy                            of a cam: kinematics, loads and contact at its stations
    save_report(results, path)          one page on results for a browser
    to_dataframe(), to_xarray(), plot() of every result of a test or a study

Errors
    WearsimError                        base class of all others
    ScenarioError, CapabilityError      a scenario, or a model for it, that cannot be used
    InfeasibleCamError                  a cam that its roller cannot follow
    ResultsFileError                    a file that cannot be read, or must not be replaced
    SolverError                         a failed computation: ContactError, StepError
    Interrupted, WorkerError            a study that was stopped, or lost its workers
    PluginError, UnknownNameError       a plugin that is missing or broken; an unknown name

A scenario is a `Scenario` or the path of its file. All numbers are in SI. Functions that take
``output`` write a results file, which is replaced only with ``force=True``; without it the result
is kept in memory. ``progress=True`` shows the progress on a terminal or in a notebook. Errors of
scenarios, files and solutions are subclasses of `WearsimError`; a wrong argument is a `TypeError`
or a `ValueError`.

Examples
--------
The examples of this package use a file ``rig.toml``, written by ``wearsim new scenario rig.toml``,
an ensemble of 16 tests with random friction, ``rig-ensemble.h5``, and a study of 16 lives with
random friction and K/H, ``rig-life.h5``.

>>> import wearsim
>>> result = wearsim.run("rig.toml", "rig.h5")
>>> print(f"{result.depth[-1] * 1e6:.1f} um deep, {result.width[-1] * 1e3:.1f} mm wide")
48.1 um deep, 13.8 mm wide
>>> wearsim.open_results("rig.h5")
<Result 'a wear test': 1350000 roller passes, depth 48.11 um>
>>> random = wearsim.load_scenario(
...     "rig.toml",
...     {"friction.coefficient": {"distribution": "uniform", "low": 0.08, "high": 0.12}},
... )
>>> tests = wearsim.ensemble(random, 4, "tests.h5", scheduler="serial")
>>> print(f"{tests.at_end('depth').min() * 1e6:.0f} to {tests.at_end('depth').max() * 1e6:.0f} um")
42 to 48 um
"""

# the public names are imported at their first use, so that importing wearsim is quick
from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.errors import (
        CapabilityError as CapabilityError,
        ContactError as ContactError,
        InfeasibleCamError as InfeasibleCamError,
        Interrupted as Interrupted,
        PluginError as PluginError,
        ResultsFileError as ResultsFileError,
        ScenarioError as ScenarioError,
        SolverError as SolverError,
        StepError as StepError,
        UnknownNameError as UnknownNameError,
        WearsimError as WearsimError,
        WorkerError as WorkerError,
    )
    from wearsim.scenario import Scenario, load_scenario
    from wearsim.scenario.examples import scenario_schema
    from wearsim.scenario.exploration import explore
    from wearsim.studies.cam.study import CamStudy, study_cam
    from wearsim.studies.comparison.compare import compare
    from wearsim.studies.contact.single import ContactStudy, solve_contact, study_contact
    from wearsim.studies.demonstration.result import Demonstration, demonstration
    from wearsim.studies.dissipation.monte_carlo import dissipation
    from wearsim.studies.dissipation.result import DissipationResult
    from wearsim.studies.ensemble.api import ensemble, resume_ensemble
    from wearsim.studies.ensemble.result import EnsembleResult
    from wearsim.studies.ensemble.sweep import sweep
    from wearsim.studies.identify.api import identify
    from wearsim.studies.identify.result import IdentificationResult
    from wearsim.studies.life.api import life, sweep_life
    from wearsim.studies.life.result import LifeResult
    from wearsim.studies.opening import (
        open_dissipation,
        open_ensemble,
        open_results,
        save_report,
    )
    from wearsim.studies.returns.result import FieldReturns, field_returns
    from wearsim.studies.run.result import Result
    from wearsim.studies.run.run import resume, run
    from wearsim.studies.start.export import export_running_in
    from wearsim.types import ContactSolution, Profile

# names by the module that defines them
_NAMES = {
    "wearsim.errors": [
        "CapabilityError",
        "ContactError",
        "InfeasibleCamError",
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
    "wearsim.studies.demonstration.result": ["Demonstration", "demonstration"],
    "wearsim.studies.dissipation.result": ["DissipationResult"],
    "wearsim.studies.ensemble.result": ["EnsembleResult"],
    "wearsim.studies.identify.result": ["IdentificationResult"],
    "wearsim.studies.life.result": ["LifeResult"],
    "wearsim.studies.returns.result": ["FieldReturns", "field_returns"],
    "wearsim.studies.run.result": ["Result"],
    "wearsim.scenario.exploration": ["explore"],
    "wearsim.studies.opening": ["open_dissipation", "open_ensemble", "open_results", "save_report"],
    "wearsim.scenario": ["Scenario", "load_scenario"],
    "wearsim.scenario.examples": ["scenario_schema"],
    "wearsim.studies.cam.study": ["CamStudy", "study_cam"],
    "wearsim.studies.dissipation.monte_carlo": ["dissipation"],
    "wearsim.studies.contact.single": ["ContactStudy", "solve_contact", "study_contact"],
    "wearsim.studies.ensemble.api": ["ensemble", "resume_ensemble"],
    "wearsim.studies.comparison.compare": ["compare"],
    "wearsim.studies.ensemble.sweep": ["sweep"],
    "wearsim.studies.identify.api": ["identify"],
    "wearsim.studies.life.api": ["life", "sweep_life"],
    "wearsim.studies.run.run": ["resume", "run"],
    "wearsim.studies.start.export": ["export_running_in"],
    "wearsim.types": ["ContactSolution", "Profile"],
}
_MODULES = {name: module for module, names in _NAMES.items() for name in names}
# names of first-party distributions: module and extra
_OF_PLUGINS = {
    "optimise": ("wearsim_optimise.api", "optimise"),
    "resume_optimise": ("wearsim_optimise.api", "optimise"),
}

# without the errors, which fill pages of `help(wearsim)`
__all__ = [
    "CamStudy",
    "ContactSolution",
    "ContactStudy",
    "Demonstration",
    "DissipationResult",
    "EnsembleResult",
    "FieldReturns",
    "IdentificationResult",
    "LifeResult",
    "Profile",
    "Result",
    "Scenario",
    "compare",
    "demonstration",
    "dissipation",
    "ensemble",
    "explore",
    "export_running_in",
    "field_returns",
    "identify",
    "life",
    "load_scenario",
    "open_dissipation",
    "open_ensemble",
    "open_results",
    "resume",
    "resume_ensemble",
    "run",
    "save_report",
    "scenario_schema",
    "solve_contact",
    "study_cam",
    "study_contact",
    "sweep",
    "sweep_life",
]


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415

        return version("wearsim")
    if name in _OF_PLUGINS:
        module, extra = _OF_PLUGINS[name]
        try:
            return getattr(import_module(module), name)
        except ModuleNotFoundError as error:
            if error.name != module.partition(".")[0]:
                raise
            raise AttributeError(
                f"wearsim.{name} is part of wearsim-{extra}, which is not installed:"
                f" pip install 'wearsim[{extra}]'"
            ) from error
    if name not in _MODULES:
        known = "" if name.startswith("_") else f"; it has {', '.join(sorted(_MODULES))}"
        raise AttributeError(f"module 'wearsim' has no attribute '{name}'{known}")
    # kept, so that it is looked up once
    return globals().setdefault(name, getattr(import_module(_MODULES[name]), name))


def __dir__() -> list[str]:
    return [*_MODULES, "__version__"]
