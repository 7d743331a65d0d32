"""What a result was made with: the versions of the software and the plugins in use."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

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
    """Return the version of every package that a number may depend on, by name."""
    found = {}
    for name in SOFTWARE:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def plugins_in_use(scenario: Scenario) -> list[dict[str, str]]:
    """Return kind, name, distribution and version of every plugin that a scenario asks for."""
    used: list[tuple[type[Spec], str]] = [
        (ContactModelSpec, scenario.contact.model),
        (LoadSpec, scenario.load.kind),
    ]
    used += [(LoadSpec, term.name) for term in scenario.load.terms]
    if scenario.wear is not None:
        used.append((WearLawSpec, scenario.wear.law))
    random = [name for item in scenario.random for name in (item.kind, item.marginal) if name]
    used += [(RandomInputSpec, name) for name in dict.fromkeys(random)]
    rows = []
    for kind, name in used:
        item = registry().registered(kind, name)
        rows.append(
            {
                "kind": kind.kind,
                "name": name,
                "distribution": item.distribution,
                "version": item.version,
            }
        )
    return rows


def origin_of(scenario: Scenario) -> dict[str, Any]:
    """Return what every file tells of where it comes from: the fields of `StudyData` about it."""
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


def missing_plugins(rows: list[dict[str, str]]) -> list[str]:
    """Return what is not installed of the `plugins_in_use` of a file, told by its distribution."""
    kinds = {kind.kind: kind for kind in (ContactModelSpec, LoadSpec, WearLawSpec, RandomInputSpec)}
    return [
        f"the {row['kind']} '{row['name']}' of {row['distribution']} {row['version']}"
        for row in rows
        if row["name"] not in registry().names(kinds[row["kind"]])
    ]


def changed_origins(data: StudyData, scenario: Scenario) -> list[str]:
    """Return a warning for everything that is not what a file was written with.

    Parameters
    ----------
    data : StudyData
        What the file holds.
    scenario : Scenario
        Its scenario.
    """
    before = _origins(data.software, data.plugins)
    now = _origins(software(), plugins_in_use(scenario))
    return [
        f"this file was written with {name} {before[name]} and goes on with {now[name]}: the last"
        " digits may differ from those of an unbroken run"
        for name in now
        if before.get(name, now[name]) != now[name]
    ]


def _origins(versions: Mapping[str, str], plugins: list[dict[str, str]]) -> dict[str, str]:
    """Return the version of every package, and where every plugin in use comes from, by name."""
    found = dict(versions)
    for row in plugins:
        known = row["distribution"] in versions
        origin = row["distribution"] if known else f"{row['distribution']} {row['version']}"
        found[f"the {row['kind']} '{row['name']}' of"] = origin
    return found
