"""Tractions of several contacts by strip theory, and creepages of the free rollers of a cam."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.numerics.jit import kernel_input
from wearsim.mechanics.numerics.roots import bracketed_roots, secant_roots
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import SUMS, strip_contacts
from wearsim.models.tangential.base import skidding
from wearsim.types import FloatArray, Grid


def strip_tractions(
    line_load: FloatArray,
    half_length: FloatArray,
    batch: ContactBatch,
    grid: Grid,
    pair: ElasticPair,
) -> tuple[FloatArray, FloatArray]:
    """Return dissipation, (contacts, strips) [W/m], and `SUMS`, (6, contacts), by strip theory.

    Parameters
    ----------
    line_load, half_length : ndarray, shape (contacts, strips)
        Solution of the normal problems [N/m], [m].
    batch : ContactBatch
        The contacts, with at most one friction value per strip.
    grid : Grid
    pair : ElasticPair
    """
    contacts, variation = len(line_load), batch.variation
    dissipation, sums = np.empty(line_load.shape), np.empty((len(SUMS), contacts))
    strip_contacts(
        line_load,
        half_length,
        grid.y,
        grid.spacing,
        strip_elasticity(pair.contact_modulus, pair.shear_modulus),
        kernel_input(batch.rolling_speed),
        kernel_input(batch.longitudinal),
        kernel_input(batch.lateral),
        kernel_input(batch.spin),
        np.empty((contacts, 0)) if variation is None else kernel_input(variation),
        kernel_input(batch.friction).reshape(contacts, -1),
        dissipation,
        sums,
    )
    return dissipation, sums


def with_balanced_creepage(
    batch: ContactBatch,
    line_load: FloatArray,
    half_length: FloatArray,
    grid: Grid,
    pair: ElasticPair,
    guess: ContactBatchSolution | None,
) -> ContactBatch:
    """Return the contacts with the creepages at which the tractions balance the torques.

    The lever arm is the mean rolling radius, weighted by the line load.

    Parameters
    ----------
    batch : ContactBatch
        With a bearing torque, not a number where a roller skids at the given creepage.
    line_load, half_length : ndarray, shape (contacts, strips)
        Solution of the normal problem [N/m], [m].
    grid : Grid
    pair : ElasticPair
    guess : ContactBatchSolution, optional
        Solution with the first guesses of the creepage.

    Raises
    ------
    ContactError
        If friction cannot transmit a torque.
    """
    first = np.zeros(len(batch))
    if guess is not None:
        first = np.nan_to_num(guess.longitudinal_creepage)
    creepage, converged = secant_roots(
        _excess_torque(batch, line_load, half_length, grid, pair),
        first,
        # of the order of the creepage of saturation
        batch.friction.reshape(len(batch), -1).max(axis=1)
        * half_length.max(axis=1)
        * batch.longitudinal_curvature
        / pair.creep_factor,
    )
    others = np.flatnonzero(~converged)
    if others.size:
        part = batch.at(others), line_load[others], half_length[others]
        creepage[others] = _bracketed_creepage(*part, grid, pair, first[others])
    return replace(batch, longitudinal=creepage)


def _excess_torque(
    batch: ContactBatch,
    line_load: FloatArray,
    half_length: FloatArray,
    grid: Grid,
    pair: ElasticPair,
) -> Callable[[FloatArray], FloatArray]:
    """Return the function from creepages to torques of the tractions, less those needed [N m].

    It increases with the creepage. Of a roller that skids it is the excess of the creepage.
    """
    if batch.bearing_torque is None or batch.rolling_radius is None:
        raise ValueError("a bearing torque needs the rolling radius of each strip")
    radius = (line_load * batch.rolling_radius).sum(axis=1) / line_load.sum(axis=1)
    rolls = np.isfinite(batch.bearing_torque)
    torque = np.where(rolls, batch.bearing_torque, 0.0)

    def excess(creepage: FloatArray) -> FloatArray:
        trial = replace(batch, longitudinal=creepage)
        force = strip_tractions(line_load, half_length, trial, grid, pair)[1][0]
        excess = -force * radius - torque
        return np.where(rolls, excess, creepage - batch.longitudinal)

    return excess


def _bracketed_creepage(
    batch: ContactBatch,
    line_load: FloatArray,
    half_length: FloatArray,
    grid: Grid,
    pair: ElasticPair,
    first: FloatArray,
) -> FloatArray:
    """Return the creepages of `with_balanced_creepage` within brackets, from guesses `first`."""
    excess = _excess_torque(batch, line_load, half_length, grid, pair)
    # a creepage of gross sliding, many times that of saturation
    friction = batch.friction.reshape(len(batch), -1).max(axis=1)
    saturation = friction * half_length.max(axis=1) * batch.longitudinal_curvature
    saturation /= pair.creep_factor
    reach = 100.0 * (saturation + np.abs(batch.lateral)) + np.abs(batch.longitudinal)
    if batch.variation is not None:
        reach = reach + np.abs(batch.variation).max(axis=1)
    low, high = excess(-reach), excess(reach)
    torque = np.asarray(batch.bearing_torque)
    lost = np.flatnonzero(np.isfinite(torque) & ((low >= 0.0) | (high <= 0.0)))
    if len(lost):
        k = int(lost[0])
        carried = torque[k] + (high[k] if torque[k] > 0.0 else low[k])
        raise skidding(
            float(torque[k]),
            abs(float(carried)),
            float(batch.normal_force[k]),
            {"line_load": line_load[k], "half_length": half_length[k]},
        )
    return bracketed_roots(excess, -reach, reach, first)
