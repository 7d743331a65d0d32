"""Provenance of results: versions of the software and the plugins in use."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from wearsim.errors import ResultsFileError
from wearsim.plugins import (
    ContactModelSpec,
    LoadSpec,
    RandomInputSpec,
    Spec,
    WearLawSpec,
    registry,
)
from wearsim.results.content import StudyData
from wearsim.scenario import Scenario

SOFTWARE = ("wearsim", "numpy", "scipy", "numba", "h5py")


@cache
def software() -> Mapping[str, str]:
    """Return the versions of the packages that results may depend on, by name."""
    found = {}
    for name in SOFTWARE:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def plugins_in_use(scenario: Scenario) -> list[dict[str, str]]:
    """Return kind, name, distribution and version of every plugin that a scenario uses."""
    used: list[tuple[type[Spec], str]] = [
        (ContactModelSpec, scenario.contact.model),
        (LoadSpec, scenario.load.kind),
    ]
    used += [(LoadSpec, term.name) for term in scenario.load.terms]
    if scenario.wear is not None:
        used.append((WearLawSpec, scenario.wear.law))
    random = [name for item in scenario.random for name in (item.kind, item.marginal) if name]
    used += [(RandomInputSpec, name) for name in dict.fromkeys(random)]
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
    kinds = {kind.kind: kind for kind in (ContactModelSpec, LoadSpec, WearLawSpec, RandomInputSpec)}
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
    """Return a warning for every software version that differs from that of a file.

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
    found = dict(versions)
    for row in plugins:
        known = row["distribution"] in versions
        origin = row["distribution"] if known else f"{row['distribution']} {row['version']}"
        found[f"the {row['kind']} '{row['name']}' of"] = origin
    return found
