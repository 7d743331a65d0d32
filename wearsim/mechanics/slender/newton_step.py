"""Steps of Newton's method: strips of one contact, and elimination of shared bodies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.mechanics.numerics.lu import factor_in_place, invert_factored, solve_factored
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
    step by row [N/m] and `change` the applied change of load by strip [N/m]. `surface` is the sum
    of gap and displacement above the least gap `lowest` [m]; `value` and `tangent` are work space.
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
    surface: FloatArray
    lowest: FloatArray
    value: FloatArray
    tangent: FloatArray


@subroutine
def new_newton_state(contacts: int, n: int) -> NewtonState:
    """Return the `NewtonState` of contacts without a Jacobian."""
    state = NewtonState(
        np.empty(contacts, np.bool_),
        np.empty(contacts, np.int64),
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
        np.empty((contacts, n)),
        np.empty(contacts),
        np.empty(n),
        np.empty(n),
    )
    for k in range(contacts):  # numba compiles a loop faster than np.ones
        state.fresh[k] = True
    return state


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


SIDES = 2  # a contact touches a cylinder and a roller


class DepthSystem(NamedTuple):
    """Factored linear system of the bodies' worn depths.

    `number` is the unknown of each body's strip, -1 for none, (bodies, strips). `matrix` is stored
    by columns, `order` is the order of its equations, `right` its right-hand side and `depth` its
    solution [m]. `response` is S of each contact by columns: decrease of the line load, by row, per
    increase of the gap, by row, at constant load (contacts, strips, strips) [N/m^2], and
    `approach_slope` the increase of the approach per increase of the gap (contacts, strips).
    """

    number: IntArray
    matrix: FloatArray
    order: IntArray
    right: FloatArray
    depth: FloatArray
    response: FloatArray
    approach_slope: FloatArray


@subroutine
def new_depth_system(bodies: IntArray, n: int) -> DepthSystem:
    """Return an empty `DepthSystem` for the shared `bodies`, (contacts, 2), with `n` strips."""
    count = bodies.max() + 1
    size = count * n
    return DepthSystem(
        np.empty((count, n), np.int64),
        np.empty((size, size)),
        np.empty(size, np.int64),
        np.empty(size),
        np.empty(size),
        np.empty((len(bodies), n, n)),
        np.empty((len(bodies), n)),
    )


@subroutine
def fill_responses(k: int, state: NewtonState, system: DepthSystem) -> None:
    """Fill the derivatives of contact `k`'s step and approach by its gap at constant load."""
    size, response, approach_slope = state.size[k], system.response, system.approach_slope
    invert_factored(state.matrix[k], size, state.order[k], response[k])
    for column in range(size):
        total = 0.0
        for row in range(size):
            total += response[k, column, row]
        approach_slope[k, column] = total / state.unit_load_sum[k]
        for row in range(size):
            response[k, column, row] -= state.unit_load[k, row] * approach_slope[k, column]


@subroutine
def add_depths(
    bodies: IntArray, shared: FloatArray, line_load: FloatArray, surface: FloatArray
) -> None:
    """Add the depth that all contacts wear off the shared bodies to `surface`.

    Parameters
    ----------
    bodies : ndarray of int, shape (contacts, 2)
        The shared bodies of each contact, -1 for none.
    shared : ndarray, shape (contacts, 2, strips)
        Depth of those bodies per unit of line load [m/(N/m)].
    line_load, surface : ndarray, shape (contacts, strips)
        Line load [N/m]; gap of each contact, updated [m].
    """
    contacts, n = line_load.shape
    depth = np.zeros((bodies.max() + 1, n))
    for k in range(contacts):
        for side in range(SIDES):
            b = bodies[k, side]
            if b >= 0:
                for i in range(n):
                    depth[b, i] += shared[k, side, i] * line_load[k, i]
    for k in range(contacts):
        for side in range(SIDES):
            b = bodies[k, side]
            if b >= 0:
                for i in range(n):
                    surface[k, i] += depth[b, i]


@subroutine
def _number_unknowns(
    bodies: IntArray, shared: FloatArray, index: IntArray, number: IntArray
) -> int:
    """Assign unknowns to the strips of bodies that wear under a contact, -1 to the others."""
    contacts, n = index.shape
    number[:] = -1
    for k in range(contacts):
        for side in range(SIDES):
            b = bodies[k, side]
            if b >= 0:
                for i in range(n):
                    if index[k, i] >= 0 and shared[k, side, i] > 0.0:
                        number[b, i] = 0
    count = 0
    for b in range(number.shape[0]):
        for i in range(n):
            if number[b, i] >= 0:
                number[b, i] = count
                count += 1
    return count


@subroutine
def factor_depths(
    bodies: IntArray, shared: FloatArray, index: IntArray, system: DepthSystem
) -> bool:
    """Assemble and factor the system of the bodies' depths.

    Parameters
    ----------
    bodies, shared
        As in `add_depths`.
    index : ndarray of int, shape (contacts, strips)
        Row of each strip in its contact, -1 outside the contact.
    system : DepthSystem
        Filled, with the responses of the contacts from `fill_responses`.

    Returns
    -------
    bool
        False if the system is singular.
    """
    count, matrix = _number_unknowns(bodies, shared, index, system.number), system.matrix
    for i in range(count):
        matrix[i, :count] = 0.0
        matrix[i, i] = 1.0
    for k in range(bodies.shape[0]):
        for side in range(SIDES):
            for other in range(SIDES):
                if bodies[k, side] >= 0 and bodies[k, other] >= 0:
                    _add_contact_terms(k, side, other, bodies, shared, index, system)
    return factor_in_place(matrix, count, system.order)


@subroutine
def solve_depths(
    bodies: IntArray,
    shared: FloatArray,
    index: IntArray,
    system: DepthSystem,
    step: FloatArray,
    approach: FloatArray,
) -> None:
    """Turn the separate steps of the contacts into the coupled step.

    Parameters
    ----------
    bodies, shared, index
        As in `factor_depths`.
    system : DepthSystem
        From `factor_depths`.
    step : ndarray, shape (contacts, strips)
        Change of line load by row [N/m]: r of the separate contact, replaced by the coupled one.
    approach : ndarray, shape (contacts,)
        Approach without the bodies' wear, replaced by the one with it [m].
    """
    contacts, n = index.shape
    right, number = system.right, system.number
    count = number.max() + 1
    right[:count] = 0.0
    for k in range(contacts):
        for side in range(SIDES):
            for i in range(n):
                if bodies[k, side] >= 0 and index[k, i] >= 0 and shared[k, side, i] > 0.0:
                    unknown = number[bodies[k, side], i]
                    right[unknown] += shared[k, side, i] * step[k, index[k, i]]
    solve_factored(system.matrix, count, system.order, right, system.depth)
    for k in range(contacts):
        _apply_body_wear(k, bodies, index, system, step, approach)


@subroutine
def _add_contact_terms(
    k: int,
    side: int,
    other: int,
    bodies: IntArray,
    shared: FloatArray,
    index: IntArray,
    system: DepthSystem,
) -> None:
    """Add the wear of contact `k`'s body on `side` per worn depth of its body on side `other`."""
    n, number = index.shape[1], system.number
    worn_body, opening_body = bodies[k, side], bodies[k, other]
    for j in range(n):
        column, unknown = index[k, j], number[opening_body, j]
        if column < 0 or unknown < 0:
            continue
        for i in range(n):
            row = index[k, i]
            if row >= 0 and shared[k, side, i] > 0.0:
                system.matrix[unknown, number[worn_body, i]] += (
                    shared[k, side, i] * system.response[k, column, row]
                )


@subroutine
def _apply_body_wear(
    k: int,
    bodies: IntArray,
    index: IntArray,
    system: DepthSystem,
    step: FloatArray,
    approach: FloatArray,
) -> None:
    """Correct the step and the approach of contact `k` for the worn depths of its bodies."""
    n, size = index.shape[1], index[k].max() + 1
    for i in range(n):
        column, opening = index[k, i], 0.0
        if column < 0:
            continue
        for side in range(SIDES):
            b = bodies[k, side]
            if b >= 0 and system.number[b, i] >= 0:
                opening += system.depth[system.number[b, i]]
        approach[k] += system.approach_slope[k, column] * opening
        for row in range(size):
            step[k, row] -= system.response[k, column, row] * opening
