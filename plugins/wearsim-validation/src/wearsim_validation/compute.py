"""What wearsim computes for a case: runs, contacts and tests with random inputs."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import wearsim
from wearsim.plugins import BODIES
from wearsim.types import FloatArray
from wearsim_validation.case import Case, Jump, Series, Variant

#: quantities of a run, by name: arrays over its passes
RUN: dict[str, Callable[[wearsim.Result], FloatArray]] = {
    "passes": lambda run: np.asarray(run.passes, dtype=np.float64),
    "depth": lambda run: run.depth,
    "roller depth": lambda run: _greatest(run.roller_depth),
    "both depths": lambda run: run.depth + _greatest(run.roller_depth),
    "width": lambda run: run.width,
    "unworn lines in the groove": lambda run: np.full(len(run.passes), _unworn_lines(run)),
}
#: quantities of a contact, by name
CONTACT: dict[str, Callable[[wearsim.ContactStudy], float]] = {
    "power": lambda contact: contact.solution.power,
    "force over normal force": lambda contact: _force(contact) / contact.point.normal_force,
    "force over friction force": lambda contact: (
        _force(contact) / contact.point.normal_force / float(np.mean(contact.point.friction))
    ),
    "peak pressure": lambda contact: contact.solution.peak_pressure,
    "half-length": lambda contact: float(contact.solution.half_length.max()),
}
#: energy per rolled distance and contact area where full slip begins
FULL_SLIP = "T gamma over A where full slip begins"
_LITTLE = 0.1  # part of the greatest wear below which a place counts as unworn
_ADHERING = 0.01  # fraction below which a contact slides fully: its ends adhere longest


def _greatest(depths: FloatArray) -> FloatArray:
    """Return the depth of the most worn roller."""
    return depths if depths.ndim == 1 else np.asarray(depths.max(axis=1))


def _unworn_lines(run: wearsim.Result) -> float:
    """Return the number of places within the final groove with little of its greatest wear."""
    worn = run.profiles[-1] - run.profiles[0]
    minima = (worn[1:-1] < worn[:-2]) & (worn[1:-1] <= worn[2:]) & (worn[1:-1] > 0.0)
    return float(np.count_nonzero(minima & (worn[1:-1] < _LITTLE * worn.max())))


def _force(contact: wearsim.ContactStudy) -> float:
    return float(np.hypot(contact.solution.force_x, contact.solution.force_y))


#: quantities that a kind of case can compute
KNOWN = {"run": (*RUN,), "contact": (*CONTACT, FULL_SLIP), "ensemble": ("depth",)}


def scenario_of(
    case: Case, series: Series, changes: Mapping[str, Any] | None = None
) -> wearsim.Scenario:
    """Return the scenario of a series, with further changes by dotted key."""
    scenario = wearsim.Scenario.from_dict(
        case.file.scenario, folder=case.folder, name=f"{case.name}.toml"
    )
    overrides = {**series.set, **(changes or {})}
    return scenario.changed(overrides) if overrides else scenario


def computed(
    case: Case, series: Series, variant: Variant | None, changes: Mapping[str, Any] | None = None
) -> FloatArray:
    """Return the computed values of a series in SI, one per row of the CSV.

    Parameters
    ----------
    case : Case
    series : Series
    variant : Variant, optional
        A further computation; by default that of the case.
    changes : mapping, optional
        Further changes of the scenario.
    """
    overrides = {**(variant.set if variant else {}), **(changes or {})}
    x = case.columns[series.x]
    if case.file.kind == "contact":
        return np.array([_contact(case, series, overrides, value) for value in x.values * x.si])
    scenario = scenario_of(case, series, overrides)
    if variant and variant.rigid:
        return rigid_depth(scenario, x.values)
    if variant and variant.jump:
        passes, depth = jumped(scenario, variant.jump)
        return np.interp(x.values, passes, depth)
    run = wearsim.run(scenario)
    return np.interp(x.values * x.si, RUN[series.x](run), RUN[series.computed](run))


def _contact(case: Case, series: Series, changes: Mapping[str, Any], x: float) -> float:
    """Return a quantity of the contact at one x [SI]."""
    overrides = {**changes, case.file.vary: float(x)} if case.file.vary else dict(changes)
    if series.computed == FULL_SLIP:
        return _index_of_full_slip(case, series, changes)
    return CONTACT[series.computed](wearsim.study_contact(scenario_of(case, series, overrides)))


def _index_of_full_slip(case: Case, series: Series, changes: Mapping[str, Any]) -> float:
    """Return T gamma over A at the least creepage of full slip [Pa], by bisection."""
    low, high = 1e-5, 0.2
    while high / low > 1.002:
        middle = float(np.sqrt(low * high))
        contact = wearsim.study_contact(
            scenario_of(case, series, {**changes, "creepage.longitudinal": middle})
        )
        if contact.solution.adhesion_fraction > _ADHERING:
            low = middle
        else:
            high = middle
    solution, speed = contact.solution, contact.point.rolling_speed
    area = 2.0 * float(solution.half_length.sum()) * float(solution.y[1] - solution.y[0])
    return solution.power / speed / area


def rigid_depth(scenario: wearsim.Scenario, passes: FloatArray) -> FloatArray:
    """Return the depth of both bodies if they are rigid and slide fully [m].

    The groove is a parabola of the crown's radius R, and its area grows by c N in each pass with
    c = (K/H) mu xi, so that the depth is (3 c N n / (4 sqrt(2 R)))^(2/3).
    """
    creepage, load = scenario.creepage.longitudinal, scenario.load.built
    rate = wear_rate(scenario) * scenario.friction.coefficient * abs(creepage or 0.0)
    area = rate * float(load.mean(0.0, scenario.total_time)) * passes
    return np.asarray((0.75 * area / np.sqrt(2.0 * scenario.roller.crown_radius)) ** (2.0 / 3.0))


def wear_rate(scenario: wearsim.Scenario) -> float:
    """Return the K/H by which the bodies of a contact wear together in a roller pass [1/Pa].

    A point of a roller is in contact less or more often than a point of the cylinder.
    """
    if scenario.wear is None:
        raise ValueError("a scenario without wear")
    law = scenario.wear.built
    cylinder, roller = (law.depth_per_dissipation(body, 1.0) or 0.0 for body in BODIES)
    touches = scenario.cylinder.radius / scenario.roller.radius / scenario.operation.rollers
    return cylinder + touches * roller


def jumped(scenario: wearsim.Scenario, jump: Jump) -> tuple[FloatArray, FloatArray]:
    """Return passes and the depth of both bodies, by steps that multiply the wear of one pass.

    Parameters
    ----------
    scenario : Scenario
        Scenario with the width and number of the strips, which do not change.
    jump : Jump
        Passes of a step, and the smoothing of the wear across the track.
    """
    contact = wearsim.study_contact(scenario)
    y, rate = contact.solution.y, wear_rate(scenario) / contact.point.rolling_speed
    worn, depths, passes = np.zeros_like(y), [0.0], [0]
    weight = _smoothing(y, jump.smoothing)
    while passes[-1] < (scenario.operation.passes or 0):
        profile = wearsim.Profile(y, -worn) if passes[-1] else None
        solution = wearsim.study_contact(scenario, profile).solution
        worn = worn + jump.passes * rate * (weight @ solution.dissipation)
        passes.append(passes[-1] + jump.passes)
        depths.append(float(worn.max()))
    return np.array(passes, dtype=np.float64), np.array(depths)


def _smoothing(y: FloatArray, width: float) -> FloatArray:
    """Return the matrix of a Gaussian filter that preserves the sum, the unit matrix at 0."""
    if width == 0.0:
        return np.eye(len(y))
    weight = np.exp(-0.5 * ((y[:, None] - y) / width) ** 2)
    return np.asarray(weight / weight.sum(axis=0))


def sampled_depths(case: Case, series: Series) -> FloatArray:
    """Return the final depths of tests with random inputs [m]."""
    with tempfile.TemporaryDirectory() as folder:
        tests = wearsim.ensemble(
            scenario_of(case, series),
            case.file.realisations,
            Path(folder) / "tests.h5",
            plan="sobol",
            workers=1,
        )
        return np.asarray(tests.values("depth"))[:, -1]
