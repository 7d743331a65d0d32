"""Checks before a study, its provenance, and the description of a run without running it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from wearsim.errors import Mistake, ResultsFileError, ScenarioError
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.plugins import (
    ContactModelSpec,
    LoadSpec,
    RandomInputSpec,
    Spec,
    WearLawSpec,
    registry,
)
from wearsim.results.content import StudyData
from wearsim.scenario import Scenario, described_model
from wearsim.studies.contact.single import study_contact
from wearsim.studies.execution.factory import whole_number
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import fresh_patch
from wearsim.studies.run.inputs import load_range

#: Memory limit for the results of a study.
MOST_BYTES = 4_000_000_000

# measured while the file is written: numbers per realisation, and per random input of a realisation
_NUMBERS, _NUMBERS_OF_A_DRAW = 17, 2


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
    count = whole_number("realisations", realisations, 1000)
    size = bytes_per_realisation(scenario)
    if count * size > MOST_BYTES:
        what = f"would take {count * size / 1e9:,.4g} GB of memory, {size} bytes each"
        most = f"at most {MOST_BYTES // size}, which take {MOST_BYTES / 1e9:g} GB"
        raise ScenarioError(scenario.file, [Mistake("", "realisations", what, str(count), most)])
    return count


def bytes_per_realisation(scenario: Scenario) -> int:
    """Return the memory of a realisation without P_l(y), which is kept for some of them only."""
    drawn = sum(len(item.keys) for item in scenario.random if item.role != "field")
    return 8 * (_NUMBERS + _NUMBERS_OF_A_DRAW * drawn)


def nothing_random(what: str) -> Mistake:
    """Return the mistake of a scenario without effective random inputs."""
    expected = (
        "a distribution instead of a value, such as friction.coefficient ="
        ' {distribution = "maxent", support = [0, "inf"], mean = 0.1, std = 0.02}'
    )
    return Mistake("", "", what, None, expected)


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


TableRows = list[tuple[str, str]]


def _creepage(scenario: Scenario) -> str:
    creepage = scenario.creepage
    if creepage.drive == "free":
        text = f"free, bearing torque {(creepage.bearing_torque or 0.0) * 1e3:.4g} N mm"
    else:
        text = f"longitudinal {creepage.longitudinal:.4g}"
    for name, value in (("yaw", creepage.yaw), ("tilt", creepage.tilt)):
        angles = scenario.per_roller(value)
        if any(angles):
            text += f", {name} " + " / ".join(f"{angle * 1e3:.4g}" for angle in angles) + " mrad"
    return text + (", differential slip" if creepage.differential_slip else "")


def _random(scenario: Scenario) -> TableRows:
    """Return a row per random input and, where there are any, one for the sampling."""
    if not scenario.random:
        return []
    table = scenario.sampling
    pairs = [f"{first} with {second} {rank:g}" for first, second, rank in table.correlation]
    words = [table.plan, f"realisation {table.realisation}"]
    words += [f"rank correlation of {', '.join(pairs)}"] if pairs else []
    rows = [(f"random {item.name}", item.describe()) for item in scenario.random]
    return [*rows, ("sampling", ", ".join(words))]


def _test(scenario: Scenario) -> TableRows:
    problem, _, stepper = assemble_problem(draw(scenario))
    grid, law = problem.grid, scenario.wear
    counts = problem.kinematics.multiplicity
    identical = ", all identical" if len(counts) == 1 and counts[0] > 1 else ""
    rollers = f"{counts.sum():.0f} ({len(counts)} solved{identical})"
    strips = (
        f"{grid.strips} of {grid.spacing * 1e3:.4g} mm,"
        f" {grid.y[0] * 1e3:.4g} to {grid.y[-1] * 1e3:.4g} mm"
    )
    return [
        ("rollers", rollers if counts.sum() > 1 else "1"),
        (
            "duration",
            f"{scenario.total_time / 60.0:.6g} min, {scenario.total_passes:,} roller passes",
        ),
        ("wear law", "" if law is None else f"{law.law} ({law.spec.summary})"),
        ("strips", strips),
        ("stepper", f"{stepper}, tolerance {scenario.evolution.tolerance:.1e}"),
    ]


def plan(scenario: Scenario) -> TableRows:
    """Return the description of a scenario's run as rows of name and value.

    Parameters
    ----------
    scenario : Scenario
        A scenario of a run or of a single contact.

    Returns
    -------
    list of (str, str)

    Raises
    ------
    ScenarioError, CapabilityError
        If it cannot run.
    """
    load, operation = scenario.load.build(), scenario.operation
    has_end = operation.duration is not None or operation.passes is not None
    is_run = has_end and scenario.wear is not None
    low, high = load_range(scenario, load, scenario.total_time if is_run else 0.0)
    values = f"{low:.4g} N" if low == high else f"{low:.4g} to {high:.4g} N"
    if load.stiffness > 0.0:
        values += f", less {load.stiffness / 1e3:.4g} N/mm of descent"
    values += "".join(f", plus {term.name}" for term in scenario.load.terms)
    roller, cylinder, choice = scenario.roller, scenario.cylinder, scenario.contact
    pair, patch = combine(cylinder.material, roller.material), fresh_patch(scenario, high)
    radii = f"radius {roller.radius * 1e3:.6g} mm, crown radius {roller.crown_radius * 1e3:.6g} mm"
    moduli = (
        f"contact modulus {pair.contact_modulus / 1e9:.4g} GPa,"
        f" shear modulus {pair.shear_modulus / 1e9:.4g} GPa"
    )
    size = (
        f"{2e3 * patch.a:.4g} x {2e3 * patch.b:.4g} mm,"
        f" peak pressure {patch.peak_pressure / 1e6:.4g} MPa"
    )
    rows = [
        ("roller", radii),
        ("cylinder", f"radius {cylinder.radius * 1e3:.6g} mm"),
        ("elasticity", moduli),
        ("rolling speed", f"{scenario.rolling_speed:.4g} m/s"),
        ("load", f"{scenario.load.kind}, {values}"),
        ("friction", f"{scenario.friction.coefficient:.4g}"),
        ("creepage", _creepage(scenario)),
        *_random(scenario),
        ("contact model", f"{described_model(choice.model, scenario.text)}: {choice.spec.summary}"),
        ("initial patch (Hertz)", size),
    ]
    if is_run:
        return rows + _test(scenario)
    strips = study_contact(scenario).grid.strips
    return [*rows, ("runs as", f"one contact, {strips} strips (no duration or no wear law)")]
