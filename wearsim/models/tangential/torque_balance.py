"""Creepages of free rollers, at which the tractions balance the torques of their bearings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import ContactError
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.numerics.roots import bracketed_roots, secant_roots
from wearsim.types import FloatArray, Grid

_SLIDING = 100.0  # creepage of gross sliding, over that of full slip
# last step of the secant method over the creepage of full slip, after which the torques balance to
# 1e-9 of those in full slip
_LAST_STEP = 1e-7


def balanced_creepage(
    torque_of: Callable[[FloatArray], FloatArray],
    bearing_torque: FloatArray,
    given: FloatArray,
    first: FloatArray,
    full_slip: FloatArray,
    added_creepage: FloatArray,
    state_of: Callable[[int], Mapping[str, Any]],
) -> FloatArray:
    """Return the mean longitudinal creepages at which the tractions balance the bearing torques.

    Parameters
    ----------
    torque_of : callable
        Torques of the longitudinal tractions on the rollers at given creepages, both of shape
        (contacts,) [N m]; increasing.
    bearing_torque : ndarray, shape (contacts,)
        Torques needed [N m]; not a number for a roller that skids at its given creepage.
    given, first : ndarray, shape (contacts,)
        Creepages of the rollers that skid, and first guesses of the others.
    full_slip, added_creepage : ndarray, shape (contacts,)
        Order of magnitude of the creepage of full slip, and of the creepages that add to the mean
        longitudinal one: its variation, and the lateral creepage.
    state_of : callable
        Load and state of a contact by number, for the error: "normal_force" and further values.

    Raises
    ------
    ContactError
        If friction cannot transmit a torque.

    Notes
    -----
    The roots are found by a secant method from the guess and, where that does not converge, within
    a bracket between both directions of gross sliding. Each is independent of the other contacts.
    """
    rolls = np.isfinite(bearing_torque)
    needed = np.where(rolls, bearing_torque, 0.0)

    def excess(creepage: FloatArray) -> FloatArray:
        return np.where(rolls, torque_of(creepage) - needed, creepage - given)

    creepage, converged = secant_roots(excess, first, full_slip, _LAST_STEP)
    if converged.all():
        return creepage
    reach = _SLIDING * full_slip + added_creepage + np.abs(given)
    low, high = excess(-reach), excess(reach)
    lost = np.flatnonzero(~converged & rolls & ((low >= 0.0) | (high <= 0.0)))
    if len(lost):
        k = int(lost[0])
        torque, state = float(bearing_torque[k]), state_of(k)
        carried = abs(float(needed[k] + (high[k] if needed[k] > 0.0 else low[k])))
        raise ContactError(
            f"the roller skids: its torque of {1e3 * torque:.4g} N mm exceeds the"
            f" {1e3 * carried:.4g} N mm that friction can transmit at a load of"
            f" {state['normal_force']:.4g} N",
            {"torque": torque, "carried": carried, **state},
            remedy="lower creepage.bearing_torque, or raise friction.coefficient or the load",
            cause="skid",
        )
    return np.where(converged, creepage, bracketed_roots(excess, -reach, reach, first))


def with_balanced_creepage(
    batch: ContactBatch,
    line_load: FloatArray,
    half_length: FloatArray,
    grid: Grid,
    pair: ElasticPair,
    guess: ContactBatchSolution | None,
    torque_of: Callable[[ContactBatch], FloatArray],
) -> ContactBatch:
    """Return the contacts with the creepages at which the tractions balance the torques.

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
    torque_of : callable
        Torques of the tractions of given contacts on their rollers, shape (contacts,) [N m].

    Raises
    ------
    ContactError
        If friction cannot transmit a torque.
    """
    if batch.bearing_torque is None or batch.rolling_radius is None:
        raise ValueError("a bearing torque needs the rolling radius of each strip")
    guesses = np.zeros(len(batch)) if guess is None else guess.longitudinal_creepage
    friction = batch.friction.reshape(len(batch), -1).max(axis=1)
    full_slip = friction * half_length.max(axis=1) * batch.longitudinal_curvature
    variation = (
        np.abs(batch.spin) * np.abs(grid.y).max()
        if batch.variation is None
        else np.abs(batch.variation).max(axis=1)
    )
    creepage = balanced_creepage(
        lambda creepage: torque_of(batch.replaced(longitudinal=creepage)),
        batch.bearing_torque,
        batch.longitudinal,
        np.where(np.isfinite(guesses), guesses, 0.0),
        full_slip / pair.creep_factor,
        100.0 * np.abs(batch.lateral) + variation,
        lambda k: {
            "normal_force": float(batch.normal_force[k]),
            "line_load": line_load[k],
            "half_length": half_length[k],
        },
    )
    return batch.replaced(longitudinal=creepage)
