"""Checks before a study, and its provenance."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from wearsim.errors import Mistake, ResultsFileError, mistake_in
from wearsim.plugins import (
    ContactModelSpec,
    FatigueLawSpec,
    LoadSpec,
    RandomInputSpec,
    Spec,
    WearLawSpec,
    registry,
)
from wearsim.results.content import StudyData
from wearsim.scenario import Scenario

#: Memory limit for the results of a study.
MOST_BYTES = 4_000_000_000

# measured while the file is written: numbers per realisation, and per random input of a realisation
_NUMBERS, _NUMBERS_OF_A_DRAW = 17, 2
SOFTWARE = ("wearsim", "numpy", "scipy", "numba", "h5py")


def checked_count(scenario: Scenario, realisations: int) -> int:
    """Return the number of realisations as an int.

    Parameters
    ----------
    scenario : Scenario
    realisations : int
        As requested.

    Raises
    ------
    TypeError
        If `scenario` is not a Scenario, or `realisations` not a whole number.
    ValueError
        If `realisations` is below 1.
    ScenarioError
        If the results would not fit into memory.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(
            f"scenario must be a Scenario, got {scenario!r}; wearsim.load_scenario reads one"
        )
    from wearsim.studies.execution.factory import whole_number  # noqa: PLC0415

    count = whole_number("realisations", realisations, 1000)
    size = bytes_per_realisation(scenario)
    if count * size > MOST_BYTES:
        raise mistake_in(
            scenario.file,
            f"would take {count * size / 1e9:,.4g} GB of memory, {size} bytes each",
            str(count),
            f"at most {MOST_BYTES // size}, which take {MOST_BYTES / 1e9:g} GB",
            key="realisations",
        )
    return count


def bytes_per_realisation(scenario: Scenario) -> int:
    """Return the memory of a realisation without P_l(y), which is kept for some of them only."""
    drawn = sum(len(item.keys) for item in scenario.random if item.role != "field")
    return 8 * (_NUMBERS + _NUMBERS_OF_A_DRAW * drawn)


def nothing_random(what: str) -> Mistake:
    """Return the mistake of a scenario without effective random inputs."""
    return Mistake(
        "",
        "",
        what,
        None,
        "a distribution instead of a value, such as friction.coefficient ="
        ' {distribution = "maxent", support = [0, "inf"], mean = 0.1, std = 0.02}',
    )


@cache
def software() -> Mapping[str, str]:
    """Return the versions of the packages that results may depend on, by name."""
    versions = {}
    for name in SOFTWARE:
        try:  # a module that is loaded states its version without a search for its metadata
            versions[name] = getattr(sys.modules.get(name), "__version__", "") or version(name)
        except PackageNotFoundError:
            versions[name] = "unknown"
    return versions


def plugins_in_use(scenario: Scenario) -> list[dict[str, str]]:
    """Return kind, name, distribution and version of every plugin that a scenario uses."""
    laws = scenario.fatigue.laws.values() if scenario.fatigue else ()
    random = [name for item in scenario.random for name in (item.kind, item.marginal) if name]
    used: list[tuple[type[Spec], str]] = [
        (ContactModelSpec, scenario.contact.model),
        (LoadSpec, scenario.load.kind),
        *((LoadSpec, term.name) for term in scenario.load.terms),
        *([(WearLawSpec, scenario.wear.law)] if scenario.wear else []),
        *((FatigueLawSpec, name) for name in dict.fromkeys(law.law for law in laws)),
        *((RandomInputSpec, name) for name in dict.fromkeys(random)),
    ]
    return [
        {
            "kind": kind.kind,
            "name": name,
            "distribution": item.distribution,
            "version": item.version,
        }
        for kind, name in used
        for item in (registry().registered(kind, name),)
    ]


def origin_of(scenario: Scenario) -> dict[str, Any]:
    """Return the fields of `StudyData` about the scenario and the software."""
    return {
        "scenario_text": scenario.text,
        "scenario_file": scenario.file,
        "title": scenario.title,
        "sha256": scenario.sha256,
        "files": dict(scenario.files),
        "seed": scenario.seed,
        "software": dict(software()),
        "plugins": plugins_in_use(scenario),
        "model": scenario.contact.model,
    }


def check_plugins(path: Path, data: StudyData) -> None:
    """Check that the plugins of a study that is to be resumed are installed.

    Raises
    ------
    ResultsFileError
        If one is not.
    """
    known = ContactModelSpec, LoadSpec, WearLawSpec, FatigueLawSpec, RandomInputSpec
    kinds = {kind.kind: kind for kind in known}
    missing = [
        f"the {row['kind']} '{row['name']}' of {row['distribution']} {row['version']}"
        for row in data.plugins
        if row["name"] not in registry().names(kinds[row["kind"]])
    ]
    if missing:
        raise ResultsFileError(
            f"{path}: needs {' and '.join(missing)}, not installed here; install it and resume"
            " again"
        )


def changed_origins(data: StudyData, scenario: Scenario) -> list[str]:
    """Return a warning for every software version that differs from a file's.

    Parameters
    ----------
    data : StudyData
        Content of the file.
    scenario : Scenario
        Its scenario.
    """
    before = _origins(data.software, data.plugins)
    now = _origins(software(), plugins_in_use(scenario))
    return [
        f"this file was written with {name} {before[name]} and continues with {now[name]}: the last"
        " digits may differ from those of an unbroken run"
        for name in now
        if before.get(name, now[name]) != now[name]
    ]


def _origins(versions: Mapping[str, str], plugins: list[dict[str, str]]) -> dict[str, str]:
    """Return the version of every package and the origin of every plugin in use, by name."""
    origins = dict(versions)
    for row in plugins:
        known = row["distribution"] in versions
        origin = row["distribution"] if known else f"{row['distribution']} {row['version']}"
        origins[f"the {row['kind']} '{row['name']}' of"] = origin
    return origins
