"""Inputs of contacts: those of a scenario, drawn values, and draws at every pass."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from wearsim.errors import Mistake, ScenarioError
from wearsim.evolution.contacts import unworn_contacts
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import ContactInputs, Redraw
from wearsim.models.loads import FollowerLoad
from wearsim.plugins import Load
from wearsim.quantities import InputFile
from wearsim.scenario import RandomInput, Scenario
from wearsim.scenario.parse.fields import CONTACT_FIELDS
from wearsim.studies.cam.turn import turn_of
from wearsim.types import FloatArray
from wearsim.uq.sampling.sampler import GaussianCopula, Sampler
from wearsim.uq.sampling.sobol import Stream

LOAD, FRICTION, LONGITUDINAL = "load.normal_force", "friction.coefficient", "creepage.longitudinal"
YAW, TILT, OFFSET = "creepage.yaw", "creepage.tilt", "roller.offset"
#: Inputs of one contact: name in `contact_inputs`, by scenario key.
FIELDS = {**CONTACT_FIELDS, OFFSET: "offset"}


def origin(key: str, mean: float) -> float:
    """Return the origin of the values of a key: the mean for a load, which is an offset."""
    return mean if key == LOAD else 0.0


def contact_values(
    items: Iterable[RandomInput], values: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return the drawn inputs of contacts by the names of `contact_inputs`.

    Parameters
    ----------
    items : iterable of RandomInput
        The inputs that were drawn.
    values : mapping of str to ndarray
        Their values by the scenario's key [SI]; keys that are missing are left out.
    """
    return {
        FIELDS[key]: values[key] - origin(key, mean)
        for item in items
        for key, mean in zip(item.keys, item.mean, strict=True)
        if key in values
    }


def contact_inputs(
    scenario: Scenario, rollers: Sequence[int], drawn: Mapping[str, FloatArray] | None = None
) -> dict[str, FloatArray]:
    """Return the inputs of the contacts of rollers: drawn values, or those of the scenario.

    Parameters
    ----------
    scenario : Scenario
    rollers : sequence of int
        Numbers of the rollers.
    drawn : mapping of str to ndarray, optional
        Drawn inputs from `contact_values`; they broadcast to (rollers, realisations).

    Returns
    -------
    dict of str to ndarray
        By field of `ContactInputs`, and "offset" of the roller [SI]; those that are not drawn have
        the shape (rollers, 1).
    """
    creepage = scenario.creepage
    values = {
        "offset": scenario.roller.offset,
        "yaw": creepage.yaw,
        "tilt": creepage.tilt,
        "friction": scenario.friction.coefficient,
        "longitudinal": creepage.longitudinal or 0.0,
        "bearing_torque": creepage.bearing_torque or 0.0,
    }
    columns = {
        name: np.array(scenario.per_roller(value))[list(rollers), None]
        for name, value in values.items()
    }
    return {**columns, **(drawn or {})}


def load_range(scenario: Scenario, load: Load, stop: float) -> tuple[float, float]:
    """Return the least and greatest load up to `stop` [s], before any feedback [N].

    Raises
    ------
    ScenarioError
        If the load is not defined for the whole time, or is not positive outside of pauses.
    """
    if load.span is not None and (load.span[0] > 0.0 or load.span[1] < stop * (1.0 - 1e-9)):
        got = f"{load.span[0] / 60.0:.6g} to {load.span[1] / 60.0:.6g} min"
        expected = f"0 to {stop / 60.0:.6g} min: a longer log or a shorter operation.duration"
        raise _load_mistake(scenario, "the log does not cover the test", got, expected)
    low, high = load.extremes(0.0, stop)
    if isinstance(load, FollowerLoad):
        low, high = turn_of(scenario).normal_range
        return (low if low > 0.0 else high), high  # where N changes sign, the flank changes
    if scenario.load.terms:
        return low, high
    if high <= 0.0:
        when = f"never above zero up to {stop / 60.0:.6g} min" if stop else "zero at the start"
        what = f"the load is {when}, and there is no contact"
        raise _load_mistake(scenario, what, f"{high:.6g} N", "a load above zero")
    if low < 0.0 or (low == 0.0 and not len(load.pauses)):
        before, after = 0.0, stop
        for _ in range(60):  # the first time of the least load, of any kind of load
            middle = 0.5 * (before + after)
            reached = load.extremes(0.0, middle)[0] <= low
            before, after = (before, middle) if reached else (middle, after)
        what = "the load falls to zero or below, and contact is lost"
        got = f"{low:.6g} N at {after / 60.0:.6g} min"
        expected = "a load above zero at all times, or zero for a pause in a log"
        raise _load_mistake(scenario, what, got, expected)
    return low, high


def load_file(scenario: Scenario) -> tuple[str, str] | None:
    """Return the key and the name of the file that the load reads, if any."""
    options = scenario.load.options
    return next(((key, item.path) for key, item in options if isinstance(item, InputFile)), None)


def _load_mistake(scenario: Scenario, what: str, got: str, expected: str) -> ScenarioError:
    """Return the error of a load, which names the file that the load reads."""
    key, file = load_file(scenario) or ("kind", scenario.load.kind)
    mistake = Mistake("load", key, f"{file}: {what}", got, expected)
    return ScenarioError(scenario.file, [mistake])


MAX_NODES = 128
REFERENCE_POINTS = 2**15  # Sobol points of the exact means
LEAST_WEIGHT = 0.1  # of an equal weight; a negative weight would add material
_OTHERS = (0.7, 1.4, 2.0)  # full-slip creepages, over that of the unworn bodies, of the error
_ACROSS, _SHARES = np.polynomial.legendre.leggauss(24)  # points across half of a Hertz contact
_ROOT = np.sqrt(1.0 - (0.5 * _ACROSS + 0.5) ** 2)  # half-length of its strips over the greatest one
_SHARES = 0.75 * _SHARES * _ROOT**2  # of its load
_MEAN_LENGTH = float(_SHARES @ _ROOT)  # mean half-length by load over the greatest one


def _with_values(
    inputs: ContactInputs, items: Sequence[RandomInput], uniforms: Mapping[str, FloatArray]
) -> ContactInputs:
    """Return inputs with drawn values, the same for every roller; loads are added to the load."""
    values: dict[str, FloatArray] = {}
    for item in items:
        drawn = item.values(uniforms[item.name])
        rollers = len(inputs.friction) // len(drawn)
        values |= zip(item.keys, np.tile(drawn, (rollers, 1)).T[..., None], strict=True)
    columns = contact_values(items, values)
    if "normal_force_offset" in columns:
        columns["normal_force_offset"] = inputs.normal_force_offset + columns["normal_force_offset"]
    return inputs.with_values(columns)


def _copula(scenario: Scenario, items: Sequence[RandomInput]) -> GaussianCopula:
    dimensions = {item.name: item.dimension for item in items}
    rows = [row for row in scenario.sampling.correlation if row[0] in dimensions]
    return GaussianCopula(rows, dimensions)


def redrawing(scenario: Scenario, items: Sequence[RandomInput]) -> Redraw:
    """Return a function that draws the inputs of single passes by the number of the pass."""
    streams = {item: Stream(scenario.seed, item.name, "pass") for item in items}
    copula, realisation = _copula(scenario, items), scenario.sampling.realisation

    def redraw(inputs: ContactInputs, first: int) -> ContactInputs:
        count = len(inputs.friction)
        uniforms = {}
        for item, stream in streams.items():
            rollers = scenario.operation.rollers if item.persistence == "per-turn" else 1
            draws = (first + np.arange(count)) // rollers
            rows = stream.rows(int(draws[0]), int(np.ptp(draws)) + 1, item.dimension, realisation)
            uniforms[item.name] = rows[draws - draws[0]]
        return _with_values(inputs, items, copula.correlate(uniforms))

    return redraw


def minimum_nodes(items: Sequence[RandomInput]) -> int:
    """Return the minimum number of nodes of a roller: 8 in one dimension, 64 in several."""
    return 8 if sum(item.dimension for item in items) == 1 else 64


def with_nodes(
    problem: WearProblem, scenario: Scenario, items: Sequence[RandomInput], count: int
) -> WearProblem:
    """Return the problem with `count` contacts for each roller, a quadrature over its passes.

    The nodes are scrambled Sobol points. Their weights are the nearest to equal ones that integrate
    exactly the wear of the unworn bodies by Carter's theory of partial slip, and its moments in the
    tilt. The quadrature error is then that of the difference between the wear and these functions.
    One part of it, as where the saturation changes with the groove, is found from wear by the same
    theory at other full-slip creepages; its exact means are known too.

    Parameters
    ----------
    problem : WearProblem
        With one contact for each roller.
    scenario : Scenario
        Scenario with seed and correlations.
    items : sequence of RandomInput
        Inputs that are drawn at every pass.
    count : int
        Nodes of each roller, a multiple of 4.
    """
    names = [(item.name, item.dimension) for item in items]
    per_turn = any(item.persistence == "per-turn" for item in items)
    sampler, copula = Sampler(scenario.seed, names, "sobol"), _copula(scenario, items)
    rollers = np.arange(problem.rollers, dtype=np.int64)

    def inputs_of(points: int) -> ContactInputs:
        uniforms = copula.correlate(sampler.uniforms(0, points))
        return _with_values(problem.inputs.at(np.repeat(rollers, points)), items, uniforms)

    (load,) = problem.loads
    force = float(load.force(np.zeros(1))[0]) or float(problem.greatest_load[0])  # 0 in a pause
    inputs, reference = inputs_of(count), inputs_of(REFERENCE_POINTS)
    weights, error = [], 0.0
    for number, full_slip in enumerate(_full_slip_creepages(problem)):
        points, others = (
            slice(number * points, (number + 1) * points) for points in (count, REFERENCE_POINTS)
        )
        functions = partial(_wear_functions, force=force, full_slip=full_slip)
        values, means = functions(inputs, points), functions(reference, others).mean(axis=1)
        # both halves of the points are quadratures too
        halves = values[:, : count // 2], values[:, count // 2 :]
        weight = np.concatenate([0.5 * _calibrated(half, means) for half in halves])
        weights.append(weight)
        for factor in _OTHERS:
            functions = partial(_wear, force=force, full_slip=factor * full_slip)
            mean = float(functions(reference, others).mean())
            if mean > 0.0:
                error = max(error, abs(float(weight @ functions(inputs, points)) / mean - 1.0))
    return replace(
        problem,
        inputs=inputs,
        roller=np.repeat(rollers, count),
        weight=np.concatenate(weights),
        quadrature_error=error,
        passes_per_draw=float(max(per_turn * scenario.operation.rollers, 1)),
    )


def _full_slip_creepages(problem: WearProblem) -> list[float]:
    """Return the creepage of full slip over friction, of each roller on the unworn bodies.

    By Carter's theory it is the half-length times the curvature along rolling. It is that at the
    middle of a Hertz contact with the same mean half-length, and the mean over the stations.
    """
    batch = unworn_contacts(problem)
    solution = problem.model.solve(batch)
    load, length = solution.line_load, solution.half_length
    mean = (load * length).sum(axis=1) / np.maximum(load.sum(axis=1), 1e-300) / _MEAN_LENGTH
    each = (mean * np.abs(batch.longitudinal_curvature)).reshape(problem.shape)
    return list(map(float, each.mean(axis=(0, 2))))


def _wear(inputs: ContactInputs, part: slice, force: float, full_slip: float) -> FloatArray:
    """Return wear in partial slip by Carter's theory, to a factor, shape (draws,).

    The strips of a Hertz contact slip fully from the creepage on that is friction times half-length
    times curvature (Carter, Proc. R. Soc. A 112 (1926), DOI 10.1098/rspa.1926.0100); below it, the
    traction is smaller.
    """
    load = np.maximum(force + inputs.normal_force_offset[part, 0], 0.0)
    slip, friction = (
        np.hypot(inputs.longitudinal[part, 0], inputs.yaw[part, 0]),
        inputs.friction[part, 0],
    )
    middle = np.maximum(friction * full_slip * np.cbrt(load / force), 1e-300)
    saturation = np.minimum((slip / middle)[:, None] / _ROOT, 1.0)
    return np.asarray(load * friction * slip * ((saturation * (2.0 - saturation)) @ _SHARES))


def _wear_functions(
    inputs: ContactInputs, part: slice, force: float, full_slip: float
) -> FloatArray:
    """Return functions of the inputs that approximate wear, shape (functions, draws)."""
    wear, tilt = _wear(inputs, part, force, full_slip), inputs.tilt[part, 0]
    one = np.ones_like(tilt)
    return np.array([one, wear, wear * tilt, wear * tilt**2, tilt, tilt**2, wear * tilt**3])


def _calibrated(values: FloatArray, means: FloatArray) -> FloatArray:
    """Return the positive weights nearest to equal ones that integrate functions exactly.

    Parameters
    ----------
    values : ndarray, shape (functions, nodes)
        Functions at the nodes, in the order of their importance; the last ones are left out if a
        weight would be too small.
    means : ndarray, shape (functions,)
        Exact means.
    """
    nodes = values.shape[1]
    equal = np.full(nodes, 1.0 / nodes)
    scale = np.abs(values).max(axis=1)
    used = np.flatnonzero(scale > 0.0)[: max(nodes // 4, 2)]
    for count in range(len(used), 1, -1):
        rows = values[used[:count]] / scale[used[:count], None]
        missing = means[used[:count]] / scale[used[:count]] - rows @ equal
        found: FloatArray = equal + rows.T @ (np.linalg.pinv(rows @ rows.T, 1e-10) @ missing)
        if found.min() > LEAST_WEIGHT / nodes:
            return found
    return equal
