"""Many contacts of `hertz-fastsim` at once: columns into the kernels and out of them."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from wearsim.contact_batch import BatchSolution, OperatingPoints
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.hertz.parabola_fit import CONVERGED
from wearsim.mechanics.hertz.patches import Bodies, Patches, find_patches, half_lengths
from wearsim.mechanics.tangential.hertz_fastsim_batch import ContactInputs, ContactResults, solve_contacts
from wearsim.models.tangential.fastsim import FastsimTheory
from wearsim.types import FloatArray, Grid, IntArray

Failed: TypeAlias = int | None


class HertzFastsimBatch:
    """The contacts of one model, solved together.

    Parameters
    ----------
    grid : Grid
        The strips.
    pair : ElasticPair
        The bodies' elastic constants.
    theory : FastsimTheory
        How tractions are found.
    given_patch : tuple of float
        Semi-axes of a prescribed patch [m], zeros for Hertz's own.
    tolerance, limit : float, int
        When the fit of a parabola has settled, and how many patches it may try.
    """

    def __init__(
        self,
        grid: Grid,
        pair: ElasticPair,
        theory: FastsimTheory,
        given_patch: tuple[float, float],
        tolerance: float,
        limit: int,
    ) -> None:
        self._y = np.require(grid.y, np.float64, ["C", "W"])
        self._spacing = float(grid.spacing)
        self._modulus = pair.contact_modulus
        self._given, self._tolerance, self._limit = given_patch, tolerance, limit
        self._points = theory.mx
        self._theory = theory.compiled(pair)

    def solve(
        self, gap: FloatArray, longitudinal_curvature: float, points: OperatingPoints
    ) -> tuple[BatchSolution, Failed]:
        """Return the solved batch, and the first contact that failed, if any."""
        shape, strips = gap.shape[:-1], len(self._y)
        gaps, row = _rows(gap)
        forces = _loads(points.normal_force, longitudinal_curvature)
        self._check(len(row), points)
        patches = _patches(len(row))
        found = ContactResults(*np.zeros((3, len(row), strips)), *np.zeros((5, len(row))))
        first_failed = solve_contacts(
            self._bodies(longitudinal_curvature),
            self._theory,
            gaps,
            row,
            ContactInputs(
                forces,
                _column(points.longitudinal),
                _column(points.lateral),
                _column(points.spin),
                self._friction(points.friction),
                points.friction_carried,
                np.zeros((0, strips)) if points.variation is None else _column(points.variation),
                float(points.rolling_speed),
            ),
            patches,
            found,
        )
        columns = found._asdict() | {
            "approach": patches.approach,
            "peak_pressure": patches.peak_pressure,
            "longitudinal_creepage": np.array(points.longitudinal, dtype=np.float64),
            "iterations": patches.iterations,
        }
        shaped = {name: value.reshape(shape + value.shape[1:]) for name, value in columns.items()}
        failed = first_failed if first_failed < len(row) else None
        return BatchSolution(shape, self._y, shaped), failed

    def half_lengths(
        self, gap: FloatArray, longitudinal_curvature: float, forces: FloatArray
    ) -> tuple[FloatArray, Failed]:
        """Return a(y) of every contact, (contacts, strips), and the first that failed, if any."""
        gaps, row = _rows(gap)
        bodies, patches = self._bodies(longitudinal_curvature), _patches(len(row))
        loads = _loads(forces, longitudinal_curvature)
        find_patches(bodies, gaps, row, loads, patches)
        failed = np.flatnonzero(patches.status != CONVERGED)
        return half_lengths(bodies, patches, loads), int(failed[0]) if len(failed) else None

    def _bodies(self, longitudinal_curvature: float) -> Bodies:
        half = 0.5 * float(longitudinal_curvature)
        return Bodies(
            self._y, self._spacing, half, self._modulus, *self._given, self._tolerance, self._limit
        )

    def _friction(self, friction: FloatArray) -> FloatArray:
        """Return it as (contacts, points, strips), a single one where it is the same for all."""
        contacts = len(friction)
        shape = {1: (contacts, 1, 1), 2: (contacts, 1, len(self._y))}
        return _column(friction).reshape(shape.get(friction.ndim, friction.shape))

    def _check(self, contacts: int, points: OperatingPoints) -> None:
        if len(points) != contacts:
            raise ValueError(f"{len(points)} operating points for a batch of {contacts} contacts")
        strips, given = len(self._y), points.friction.shape[1:]
        if given not in {(), (strips,), (self._points, strips)}:
            raise ValueError(
                f"friction has the shape {given} per contact, and may have (), (strips,) = "
                f"({strips},) or (mx, strips) = ({self._points}, {strips}); take it at"
                " `friction_points`"
            )
        if points.variation is not None and points.variation.shape[1:] != (strips,):
            raise ValueError(
                f"creepage varies over {points.variation.shape[1:]} strips, and there are {strips}"
            )


def _loads(forces: FloatArray, curvature: float) -> FloatArray:
    """Return the loads, none of them usable where the curvature along rolling is not."""
    usable = curvature > 0.0 and math.isfinite(curvature)
    return _column(forces if usable else np.full(len(forces), math.nan))


def _column(values: FloatArray) -> FloatArray:
    """Return the values as the kernels take them: contiguous, and with one type for all callers."""
    return np.require(values, np.float64, ["C", "W"])


def _patches(contacts: int) -> Patches:
    return Patches(*np.zeros((6, contacts)), *np.zeros((2, contacts), dtype=np.int64))


def _rows(gap: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the gaps that differ, (rows, strips), and the row of every contact.

    An axis of stride 0 holds one and the same gap over and over, and none of it is copied.
    """
    shape = gap.shape[:-1]
    kept = tuple(slice(0, 1) if step == 0 else slice(None) for step in gap.strides[:-1])
    own = gap[kept]
    rows = np.arange(math.prod(own.shape[:-1])).reshape(own.shape[:-1])
    return _column(own).reshape(-1, gap.shape[-1]), np.broadcast_to(rows, shape).flatten()
