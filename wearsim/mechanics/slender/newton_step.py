"""Newton step of slender contacts: displacements, Jacobian and step.

The Jacobian is exact except for the dependence of s on the loads of strips further away than
`NEWTON_REACH` (see `half_length`). It may be reused for several steps, which then shrink about
twentyfold instead of quadratically; most of the error is the nonlinearity of a strip's displacement
under its own load. Each step is therefore taken twice, the second time with the residual corrected
for that nonlinearity (`correct_residual`). A new Jacobian is then rarely needed unless strips leave
or enter the contact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.mechanics.slender.half_length import HalfLengths
from wearsim.mechanics.slender.influence import HIGHEST, read_value
from wearsim.types import BoolArray, FloatArray, IntArray

MANIFOLD = 3.0  # ratio of new to old load of a strip up to which the Jacobian may be reused
MAX_CORRECTED = 0.5  # relative change of a load up to which the residual is corrected


class NewtonState(NamedTuple):
    """Jacobian, residual and step of the contacts; the first axis is the contact.

    A row is a strip in contact. `fresh` marks contacts that need a new Jacobian, `size` is the
    number of rows, `place` the strip of each row, `rows` the row of each strip, -1 outside the
    contact. `outer` is the displacement of all strips per load of each row, `matrix` the factored
    Jacobian by columns and `order` the order of its equations. `unit_load` are the loads per unit
    of approach [N/m^2] and `unit_load_sum` is their sum. `pressed` is the displacement of each
    strip under its own load [m], `diagonal` its derivative, `missing` the residual [m], `step` the
    step by row [N/m] and `change` the applied change of load by strip [N/m].
    """

    fresh: BoolArray
    size: IntArray
    place: IntArray
    rows: IntArray
    outer: FloatArray
    matrix: FloatArray
    order: IntArray
    unit_load: FloatArray
    unit_load_sum: FloatArray
    pressed: FloatArray
    diagonal: FloatArray
    missing: FloatArray
    step: FloatArray
    change: FloatArray


@subroutine
def new_newton_state(contacts: int, n: int) -> NewtonState:
    """Return the `NewtonState` of contacts without a Jacobian."""
    return NewtonState(
        np.ones(contacts, np.bool_),
        np.zeros(contacts, np.int64),
        np.empty((contacts, n), np.int64),
        np.empty((contacts, n), np.int64),
        np.empty((contacts, n, n)),
        np.empty((contacts, n, n)),
        np.empty((contacts, n), np.int64),
        np.empty((contacts, n)),
        np.empty(contacts),
        np.empty((contacts, n)),
        np.empty((contacts, n)),
        np.empty((contacts, n)),
        np.empty((contacts, n)),
        np.empty((contacts, n)),
    )


@subroutine
def number_strips(k: int, line_load: FloatArray, state: NewtonState) -> None:
    """Assign rows to the loaded strips of contact `k`."""
    count = 0
    for i in range(line_load.shape[1]):
        state.rows[k, i] = -1
        if line_load[k, i] > 0.0:
            state.rows[k, i] = count
            state.place[k, count] = i
            count += 1
    state.size[k] = count


@subroutine
def add_approach(
    k: int, load: float, line_load: FloatArray, state: NewtonState, approach: FloatArray
) -> None:
    """Add the approach at which contact `k`'s strips carry `load` [N/m] to its step."""
    size, step = state.size[k], state.step[k]
    lacking = load
    for row in range(size):
        lacking -= line_load[k, state.place[k, row]] + step[row]
    approach[k] = lacking / state.unit_load_sum[k]
    for row in range(size):
        step[row] += state.unit_load[k, row] * approach[k]


@subroutine
def correct_residual(
    k: int,
    table: FloatArray,
    unit: float,
    line_load: FloatArray,
    lengths: HalfLengths,
    state: NewtonState,
) -> None:
    """Subtract the nonlinear part of each strip's displacement by its own load from the residual.

    Strips whose load changes by more than `MAX_CORRECTED` are skipped, as the correction must be
    far smaller than the step.
    """
    for row in range(state.size[k]):
        j = state.place[k, row]
        old, step = line_load[k, j], state.step[k, row]
        if abs(step) > MAX_CORRECTED * old:
            continue
        tau = min(lengths.log_ratio[k, j] + 0.5 * np.log1p(step / old), HIGHEST)
        pressed = unit * (old + step) * read_value(table, tau, 0)
        state.missing[k, row] -= pressed - state.pressed[k, row] - state.diagonal[k, row] * step


@subroutine
def predict_surface(k: int, surface: FloatArray, state: NewtonState) -> None:
    """Add the first-order displacement by contact `k`'s change of load to `surface`."""
    for row in range(state.size[k]):
        change = state.change[k, state.place[k, row]]
        for i in range(surface.shape[1]):
            surface[k, i] += change * state.outer[k, row, i]


@subroutine
def update_loads(line_load: FloatArray, state: NewtonState, cautious: bool) -> tuple[float, bool]:
    """Add the step to the line loads and remove strips in tension from the active set.

    A contact whose strips leave or change much is marked for a new Jacobian. Returns the greatest
    change relative to the greatest line load, and whether strips left.
    """
    contacts, n = line_load.shape
    change, left = 0.0, False
    for k in range(contacts):
        peak, greatest = 0.0, 0.0
        for i in range(n):
            state.change[k, i] = 0.0
            peak = max(peak, line_load[k, i])
        for row in range(state.size[k]):
            i = state.place[k, row]
            old = line_load[k, i]
            new = old + state.step[k, row]
            if not new > 0.0:
                if np.isnan(new):
                    return np.inf, left
                # while cautious, the load of a strip is reduced before the strip is removed
                new = 0.1 * old if cautious and old > 1e-6 * peak else 0.0
                left = True
            if new * MANIFOLD < old or new > MANIFOLD * old:
                state.fresh[k] = True
            greatest = max(greatest, abs(new - old))
            line_load[k, i], state.change[k, i] = new, new - old
        change = max(change, greatest / peak)
    return change, left
