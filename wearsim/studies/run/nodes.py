"""Inputs drawn at every pass: draws of single passes, and a quadrature over passes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import ContactInputs, Redraw
from wearsim.scenario import RandomInput, Scenario
from wearsim.studies.run.inputs import contact_values
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray
from wearsim.uq.sampling.sampler import GaussianCopula, Sampler
from wearsim.uq.sampling.sobol import Stream

MAX_NODES = 128
REFERENCE_POINTS = 2**15  # Sobol points of the exact means
LEAST_WEIGHT = 0.1  # of an equal weight; a negative weight would add material
_OTHERS = (0.7, 1.4, 2.0)  # saturations relative to the unworn bodies; grooves have greater ones
_ACROSS, _SHARES = np.polynomial.legendre.leggauss(24)  # points across half of a Hertz contact
_ROOT = np.sqrt(1.0 - (0.5 * _ACROSS + 0.5) ** 2)  # half-length of its strips over the greatest one
_SHARES = 0.75 * _SHARES * _ROOT**2  # of its load


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
    return GaussianCopula(
        [row for row in scenario.sampling.correlation if row[0] in dimensions], dimensions
    )


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


class PassQuadrature:
    """Quadrature over the inputs that are drawn at every pass.

    The nodes are scrambled Sobol points. Their weights are the nearest to equal ones that integrate
    exactly the wear of the unworn bodies by Carter's theory of partial slip, and its moments in the
    tilt. The quadrature error is then that of the difference between the wear and these functions.
    One part of it is found from other functions whose exact means are known, see `_functions`.

    Parameters
    ----------
    problem : WearProblem
        With one contact for each roller.
    setup : Setup
        With the inputs that are drawn at every pass.
    """

    def __init__(self, problem: WearProblem, setup: Setup) -> None:
        self.problem, self.setup, items = problem, setup, setup.passes
        self._sampler = Sampler(
            setup.scenario.seed, [(item.name, item.dimension) for item in items], "sobol"
        )
        self._copula = _copula(setup.scenario, items)
        (load,) = problem.loads
        # the load is 0 in a pause
        self._force = float(load.force(np.zeros(1))[0]) or float(problem.greatest_load[0])
        curvatures = np.maximum(np.ravel(problem.kinematics.track.longitudinal_curvature), 1e-3)
        patches = [(at, setup.fresh_patch(abs(self._force), at)) for at in curvatures]
        # creepage of full slip over friction, in the middle of the unworn bodies' contact: by
        # Carter's theory the half-length times the curvature along rolling; of a cam, the mean
        self._full_slip = float(np.mean([at * patch.a for at, patch in patches]))

    def _inputs(self, count: int) -> ContactInputs:
        uniforms = self._copula.correlate(self._sampler.uniforms(0, count))
        rollers = np.repeat(np.arange(self.problem.rollers), count)
        return _with_values(self.problem.inputs.at(rollers), self.setup.passes, uniforms)

    def _values(self, inputs: ContactInputs, count: int) -> list[tuple[FloatArray, FloatArray]]:
        """Return the values of `_functions` at the points of each roller."""
        parts = (slice(r * count, (r + 1) * count) for r in range(self.problem.rollers))
        return [_functions(inputs, part, self._force, self._full_slip) for part in parts]

    @cached_property
    def _means(self) -> list[tuple[FloatArray, FloatArray]]:
        """Exact means of these functions for each roller."""
        values = self._values(self._inputs(REFERENCE_POINTS), REFERENCE_POINTS)
        return [(wear.mean(axis=1), others.mean(axis=1)) for wear, others in values]

    def with_nodes(self, count: int) -> WearProblem:
        """Return the problem with `count` contacts for each roller, a multiple of 4."""
        inputs, weights, error = self._inputs(count), [], 0.0
        for (wear, others), (means, exact) in zip(
            self._values(inputs, count), self._means, strict=True
        ):
            # both halves of the points are quadratures too
            halves = wear[:, : count // 2], wear[:, count // 2 :]
            weight = np.concatenate([0.5 * _calibrated(half, means) for half in halves])
            weights.append(weight)
            calibrated, seen = others @ weight, exact > 0.0
            error = max(error, float(np.abs(calibrated[seen] / exact[seen] - 1.0).max(initial=0.0)))
        per_turn = any(item.persistence == "per-turn" for item in self.setup.passes)
        return replace(
            self.problem,
            inputs=inputs,
            roller=np.repeat(np.arange(self.problem.rollers, dtype=np.int64), count),
            weight=np.concatenate(weights),
            quadrature_error=error,
            passes_per_draw=float(max(per_turn * self.setup.scenario.operation.rollers, 1)),
        )


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


def _functions(
    inputs: ContactInputs, part: slice, force: float, full_slip: float
) -> tuple[FloatArray, FloatArray]:
    """Return functions of the inputs that approximate wear, shape (functions, draws).

    The first ones are integrated exactly by the weights, the others are not: wear in the middle of
    a Hertz contact, where the line load is proportional to the power 2/3 of the load, and that with
    other creepages of full slip, as on a groove.
    """
    wear, tilt = _wear(inputs, part, force, full_slip), inputs.tilt[part, 0]
    load = np.maximum(force + inputs.normal_force_offset[part, 0], 1e-9 * force)
    others = [_wear(inputs, part, force, full_slip / factor) for factor in _OTHERS]
    ones = np.ones_like(tilt)
    return (
        np.array([ones, wear, wear * tilt, wear * tilt**2, tilt, tilt**2, wear * tilt**3]),
        np.array([wear / np.cbrt(load / force), *others]),
    )


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
        weights: FloatArray = equal + rows.T @ (np.linalg.pinv(rows @ rows.T, 1e-10) @ missing)
        if weights.min() > LEAST_WEIGHT / nodes:
            return weights
    return equal
