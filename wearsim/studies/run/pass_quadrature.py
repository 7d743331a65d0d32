"""Inputs that are drawn anew at every pass: the draws themselves, and nodes that stand for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from wearsim.evolution.contact_inputs import ContactInputs, Redraw
from wearsim.evolution.problem import WearProblem
from wearsim.scenario import RandomInput, Scenario
from wearsim.scenario.random.model import CONTACT_FIELDS
from wearsim.studies.run.draws import origin
from wearsim.types import FloatArray
from wearsim.uq.sampling.gaussian_copula import GaussianCopula
from wearsim.uq.sampling.philox import Stream
from wearsim.uq.sampling.sampler import Sampler

MOST_NODES = 128
GUIDING_POINTS = 2**15
LEAST_WEIGHT = 0.1  # of an equal weight; a negative one would wear metal on


def _values(
    items: Sequence[RandomInput], uniforms: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return what draws of the inputs set, by field of `ContactInputs`, shape (draws,)."""
    values = {}
    for item in items:
        drawn = item.values(uniforms[item.name])
        for column, (key, mean) in enumerate(zip(item.keys, item.mean, strict=True)):
            values[CONTACT_FIELDS[key]] = drawn[:, column] - origin(key, mean)
    return values


def _placed(inputs: ContactInputs, values: Mapping[str, FloatArray]) -> ContactInputs:
    """Return inputs with values drawn for each contact, shape (contacts,); loads are added."""
    columns = {name: array[:, None] for name, array in values.items()}
    if "normal_force_offset" in columns:
        columns["normal_force_offset"] = inputs.normal_force_offset + columns["normal_force_offset"]
    return inputs.with_values(columns)


def _copula(scenario: Scenario, items: Sequence[RandomInput]) -> GaussianCopula:
    dimensions = {item.name: item.dimension for item in items}
    rows = [row for row in scenario.sampling.correlation if row[0] in dimensions]
    return GaussianCopula(rows, dimensions)


def redrawing(scenario: Scenario, items: Sequence[RandomInput]) -> Redraw:
    """Return what draws the inputs of single passes, each by the number of its pass."""
    streams = {item: Stream(scenario.seed, item.name, "pass") for item in items}
    copula, realisation = _copula(scenario, items), scenario.sampling.realisation

    def redraw(inputs: ContactInputs, first: int) -> ContactInputs:
        count = len(inputs.friction)
        uniforms = {
            item.name: stream.rows(first, count, item.dimension, realisation)
            for item, stream in streams.items()
        }
        return _placed(inputs, _values(items, copula.correlate(uniforms)))

    return redraw


def fewest_nodes(items: Sequence[RandomInput]) -> int:
    """Return how many nodes a roller has at least: one number needs few, a plane many."""
    return 8 if sum(item.dimension for item in items) == 1 else 64


def with_nodes(
    problem: WearProblem, scenario: Scenario, items: Sequence[RandomInput], count: int
) -> WearProblem:
    """Return the problem with `count` contacts for each roller, a quadrature over its passes.

    The nodes are scrambled Sobol points. Their weights are the nearest to equal ones that give
    what the wear would be in full slip, and its moments in the tilt, their exact means: what is
    left to the points is how wear departs from that.

    Parameters
    ----------
    problem : WearProblem
        With one contact for each roller.
    scenario : Scenario
        Gives seed and correlations.
    items : sequence of RandomInput
        What is drawn at every pass.
    count : int
        Nodes of each roller, a multiple of 4.
    """
    names = [(item.name, item.dimension) for item in items]
    sampler, copula = Sampler(scenario.seed, names, "sobol"), _copula(scenario, items)

    def inputs_of(points: int) -> ContactInputs:
        values = _values(items, copula.correlate(sampler.uniforms(0, points)))
        roller = np.repeat(np.arange(problem.rollers, dtype=np.int64), points)
        everywhere = {name: np.tile(array, problem.rollers) for name, array in values.items()}
        return _placed(problem.inputs.at(roller), everywhere)

    force = float(problem.load.force(np.zeros(1))[0])
    inputs, many = inputs_of(count), inputs_of(GUIDING_POINTS)
    weights = []
    for number in range(problem.rollers):
        here = _guides(inputs, force, slice(number * count, (number + 1) * count))
        mean = _guides(
            many, force, slice(number * GUIDING_POINTS, (number + 1) * GUIDING_POINTS)
        ).mean(axis=1)
        # the first points of a Sobol sequence are a quadrature by themselves, as are the others
        halves = here[:, : count // 2], here[:, count // 2 :]
        weights += [0.5 * _calibrated(half, mean) for half in halves]
    return replace(
        problem,
        inputs=inputs,
        roller=np.repeat(np.arange(problem.rollers, dtype=np.int64), count),
        weight=np.concatenate(weights),
        half=np.tile(np.arange(count, dtype=np.int64) >= count // 2, problem.rollers).astype(
            np.int64
        ),
    )


def _guides(inputs: ContactInputs, force: float, part: slice) -> FloatArray:
    """Return functions of the inputs that wear nearly follows, shape (functions, draws)."""
    load = np.maximum(force + inputs.normal_force_offset[part, 0], 0.0)
    slip = np.hypot(inputs.longitudinal[part, 0], inputs.yaw[part, 0])
    wear, tilt = load * inputs.friction[part, 0] * slip, inputs.tilt[part, 0]
    one = np.ones_like(tilt)
    return np.array([one, wear, wear * tilt, wear * tilt**2, tilt, tilt**2, wear * tilt**3])


def _calibrated(guides: FloatArray, means: FloatArray) -> FloatArray:
    """Return the positive weights nearest to equal ones that give the guides their means.

    Parameters
    ----------
    guides : ndarray, shape (functions, nodes)
        In the order of their importance.
    means : ndarray, shape (functions,)
    """
    nodes = guides.shape[1]
    equal = np.full(nodes, 1.0 / nodes)
    scale = np.abs(guides).max(axis=1)
    felt = np.flatnonzero(scale > 0.0)[: max(nodes // 4, 2)]
    for count in range(len(felt), 1, -1):
        rows = guides[felt[:count]] / scale[felt[:count], None]
        missing = means[felt[:count]] / scale[felt[:count]] - rows @ equal
        found: FloatArray = equal + rows.T @ (np.linalg.pinv(rows @ rows.T, 1e-10) @ missing)
        if found.min() > LEAST_WEIGHT / nodes:
            return found
    return equal
