"""Steps of Newton's method for the strips of one contact."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine, subroutine_of
from wearsim.mechanics.numerics.lu import factor_in_place, solve_factored, whole_panels
from wearsim.mechanics.slender.half_length import (
    REACH,
    HalfLengths,
    add_influences,
    add_length_slopes,
)
from wearsim.mechanics.slender.influence import HIGHEST, interpolation
from wearsim.types import BoolArray, FloatArray, IntArray, SingleArray

MANIFOLD = 3.0  # ratio of new to old load of a strip up to which the Jacobian may be reused
REUSED = 0.1  # change over the greatest line load up to which it may be reused
# relative change since the Jacobian up to which its nonlinear part is neglected, and change of an
# iteration up to which unloaded strips are not tested before the end
SMALL = 1e-3
MAX_CORRECTED = 0.5  # relative change of a load up to which the residual is corrected


class NewtonState(NamedTuple):
    """Jacobian, residual and step of the contacts; the first axis is the contact.

    A row is a strip in contact. `fresh` marks contacts that need a new Jacobian, `size` is the
    number of rows, `place` the strip of each row, `rows` the row of each strip, -1 outside the
    contact. Strips from `left` to before `right` are followed, the others only at the end.
    `matrix` is the Jacobian by columns, replaced by its factors or, where contacts wear shared
    bodies, by S of `body_wear`.
    `unit_load` are the loads per unit of approach [N/m^2] and `unit_load_sum` is their sum.
    `diagonal` is the derivative of the displacement of each strip by its own load, `missing` the
    residual relative to `level`, the mean of the surface [m], `step` the step by row [N/m] and
    `change` the applied change of load by strip [N/m]. `surface` is the sum of gap and displacement
    above the least gap `lowest` [m], complete for the followed strips. `softness` is the wear
    compliance of the strips of each contact, including that of shared bodies where no other contact
    touches them [m/(N/m)]; `weight` is work space.
    """

    fresh: BoolArray
    size: IntArray
    place: IntArray
    rows: IntArray
    left: IntArray
    right: IntArray
    matrix: SingleArray
    unit_load: SingleArray
    unit_load_sum: FloatArray
    diagonal: FloatArray
    missing: FloatArray
    level: FloatArray
    step: SingleArray
    change: FloatArray
    surface: FloatArray
    softness: FloatArray
    lowest: FloatArray
    weight: FloatArray


@subroutine
def new_newton_state(contacts: int, n: int) -> NewtonState:
    """Return an empty `NewtonState`."""
    m = whole_panels(n)
    return NewtonState(
        np.empty(contacts, np.bool_),
        np.empty(contacts, np.int64),
        np.empty((contacts, n), np.int64),
        np.empty((contacts, n), np.int64),
        np.empty(contacts, np.int64),
        np.empty(contacts, np.int64),
        np.empty((contacts, m, m), np.float32),
        np.empty((contacts, m), np.float32),
        np.empty(contacts),
        np.empty((contacts, n)),
        np.empty((contacts, n)),
        np.empty(contacts),
        np.empty((contacts, m), np.float32),
        np.empty((contacts, n)),
        np.empty((contacts, n)),
        np.empty((contacts, n)),
        np.empty(contacts),
        np.empty(n),
    )


@subroutine
def number_strips(k: int, line_load: FloatArray, margin: int, state: NewtonState) -> None:
    """Assign rows to the loaded strips of contact `k`, and follow these and a margin of others.

    All strips are followed where none is loaded.
    """
    count, n = 0, line_load.shape[1]
    for i in range(n):
        state.rows[k, i] = -1
        if line_load[k, i] > 0.0:
            state.rows[k, i] = count
            state.place[k, count] = i
            count += 1
    state.size[k] = count
    state.left[k], state.right[k] = 0, n
    if count > 0:
        state.left[k] = max(0, state.place[k, 0] - margin)
        state.right[k] = min(n, state.place[k, count - 1] + 1 + margin)


@subroutine
def add_missing_load(load: float, line_load: FloatArray) -> float:
    """Distribute the load that a contact's strips lack evenly, and return its ratio to `load`.

    On a Hertzian ellipse the line load of all strips changes with the load by the same amount.

    Parameters
    ----------
    load : float
        Sum of the line loads [N/m].
    line_load : ndarray, shape (strips,)
        Line load, changed where it is positive [N/m].
    """
    count, missing = 0, load
    for i in range(line_load.shape[0]):
        if line_load[i] > 0.0:
            count, missing = count + 1, missing - line_load[i]
    for i in range(line_load.shape[0]):
        if line_load[i] > 0.0:
            line_load[i] = max(line_load[i] + missing / count, 0.0)
    return abs(missing) / load


@subroutine
def rest_on_foundation(
    k: int,
    gap: FloatArray,
    compliance: FloatArray,
    soft: float,
    load: float,
    left: int,
    right: int,
    line_load: FloatArray,
    approach: FloatArray,
) -> None:
    """Fill the line load of contact `k` on strips that are displaced by their own loads only.

    Parameters
    ----------
    k : int
        Number of the contact.
    left, right : int
        The first strip that may be loaded, and the one after the last.
    gap, line_load : ndarray, shape (contacts, strips)
        Gap [m]; line load [N/m].
    compliance : ndarray, shape (contacts, strips)
        Wear compliance of the separate contacts [m/(N/m)].
    soft : float
        Elastic compliance of each strip [m/(N/m)].
    load : float
        Sum of the line loads [N/m].
    approach : ndarray, shape (contacts,)
        Approach, filled [m].
    """
    highest, softest = gap[k, left], 0.0
    for i in range(left, right):
        highest = max(highest, gap[k, i])
        softest = max(softest, compliance[k, i])
    level = load * (soft + softest) + highest
    for _ in range(60):  # from above, Newton's method converges monotonically: convex function
        total, stiffness = -load, 0.0
        for i in range(left, right):
            if level > gap[k, i]:
                total += (level - gap[k, i]) / (soft + compliance[k, i])
                stiffness += 1.0 / (soft + compliance[k, i])
        level -= total / stiffness
        if not total > 1e-9 * load:
            break
    for i in range(left, right):
        line_load[k, i] = max(0.0, level - gap[k, i]) / (soft + compliance[k, i])
    approach[k] = level


@subroutine
def add_displacement(
    k: int,
    first: int,
    last: int,
    table: FloatArray,
    unit: float,
    line_load: FloatArray,
    lengths: HalfLengths,
    state: NewtonState,
) -> None:
    """Add the displacement by line loads of contact `k` to `surface` from `first` to `last`."""
    weight = state.weight
    for i in range(line_load.shape[1]):
        weight[i] = unit * line_load[k, i]
    add_influences(table, k, first, last, weight, lengths.log_ratio, state.surface[k])


Weights = tuple[float, float, float, float, float]  # a factor, and those of `interpolation`


def _interpolate_rows(
    table: FloatArray,
    node: int,
    shift: int,
    left: int,
    right: int,
    values: Weights,
    slopes: Weights,
    surface: FloatArray,
    by_load: FloatArray,
) -> None:
    (push, v0, v1, w0, w1), (unit, d0, d1, e0, e1) = values, slopes
    (a, b), (c, e) = table[node : node + 2, :, left + shift : right + shift]
    surface[left:right] += push * (v0 * a + v1 * b + w0 * c + w1 * e)
    by_load[left:right] = unit * (d0 * a + d1 * b + e0 * c + e1 * e)


@subroutine_of(_interpolate_rows)
def interpolate(
    table: FloatArray,
    node: int,
    shift: int,
    left: int,
    right: int,
    values: Weights,
    slopes: Weights,
    surface: FloatArray,
    by_load: FloatArray,
) -> None:
    """Add the displacement by a strip to `surface`, and fill its derivative by the load."""
    (push, v0, v1, w0, w1), (unit, d0, d1, e0, e1) = values, slopes
    for i in range(np.uint64(left), np.uint64(right)):
        place = i + np.uint64(shift)
        a, b = table[node, 0, place], table[node, 1, place]
        c, e = table[node + 1, 0, place], table[node + 1, 1, place]
        surface[i] += push * (v0 * a + v1 * b + w0 * c + w1 * e)
        by_load[i] = unit * (d0 * a + d1 * b + e0 * c + e1 * e)


@subroutine
def fill_jacobian(
    k: int,
    table: FloatArray,
    unit: float,
    own: FloatArray,
    line_load: FloatArray,
    lengths: HalfLengths,
    state: NewtonState,
) -> None:
    """Fill the Jacobian of contact `k`, and add the displacement to `surface`.

    The displacement is that of the followed strips.

    Parameters
    ----------
    own : ndarray, shape (contacts, strips)
        Wear compliance [m/(N/m)].
    """
    n, size, coupled = line_load.shape[1], state.size[k], lengths.table.shape[0] > 0
    place, matrix, by_load = state.place, state.matrix[k], state.weight
    surface, middle = state.surface[k], table.shape[2] // 2
    nodes, log_ratio = table.shape[0], lengths.log_ratio
    near, near_strips = lengths.near, min(n, REACH + 1) if coupled else 0
    first, left, right = np.uint64(place[k, 0]), state.left[k], state.right[k]
    contiguous = place[k, size - 1] - place[k, 0] == size - 1
    for column in range(size):
        j = place[k, column]
        push = unit * line_load[k, j]
        node, (v0, v1, w0, w1), (d0, d1, e0, e1) = interpolation(nodes, log_ratio[k, j])
        values, slopes = (push, v0, v1, w0, w1), (unit, d0, d1, e0, e1)
        interpolate(table, node, middle - j, left, right, values, slopes, surface, by_load)
        if contiguous:  # without the indices, in a third of the time
            for row in range(np.uint64(0), np.uint64(size)):
                matrix[column, row] = by_load[first + row]
        for row in range(0 if contiguous else size):
            matrix[column, row] = by_load[place[k, row]]
        state.diagonal[k, column] = matrix[column, column]
        for d in range(near_strips):
            a, b = table[node, 0, middle + d], table[node, 1, middle + d]
            c, e = table[node + 1, 0, middle + d], table[node + 1, 1, middle + d]
            value = v0 * a + v1 * b + w0 * c + w1 * e
            near[d, j + 2 * REACH] = push * (d0 * a + d1 * b + e0 * c + e1 * e - value)
    if coupled:
        add_length_slopes(k, line_load, state.rows, lengths, matrix)
    for row in range(size):
        matrix[row, row] += own[k, place[k, row]]


@subroutine
def factor_jacobian(k: int, state: NewtonState) -> bool:
    """Factor the Jacobian of contact `k` and fill `unit_load`; False if it is singular."""
    size, total = state.size[k], 0.0
    for row in range(size):
        state.unit_load[k, row] = 1.0
    if not factor_in_place(state.matrix[k], size):
        return False
    solve_factored(state.matrix[k], size, state.unit_load[k])
    for row in range(size):
        total += float(state.unit_load[k, row])
    state.unit_load_sum[k] = total
    return True


@subroutine
def fill_missing(k: int, state: NewtonState) -> None:
    """Fill the residual of contact `k` and the mean height of its surface, from `surface`.

    The residual is relative to that mean: steps in single precision would otherwise be the
    difference of two line loads of the size of the whole.
    """
    size, place, surface, total = state.size[k], state.place, state.surface, 0.0
    for row in range(size):
        total += surface[k, place[k, row]]
    state.level[k] = total / size
    for row in range(size):
        state.missing[k, row] = state.level[k] - surface[k, place[k, row]]


@subroutine
def add_approach(
    k: int, load: float, line_load: FloatArray, state: NewtonState, approach: FloatArray
) -> None:
    """Add the approach at which contact `k`'s strips carry `load` [N/m] to its step."""
    size, step = state.size[k], state.step[k]
    lacking = load
    for row in range(size):
        lacking -= line_load[k, state.place[k, row]] + step[row]
    rise = lacking / state.unit_load_sum[k]
    approach[k] = state.level[k] + rise
    for row in range(size):
        step[row] += state.unit_load[k, row] * rise


@subroutine
def has_large_step(line_load: FloatArray, state: NewtonState) -> bool:
    """Return whether a line load changes by more than `SMALL` of the greatest of its contact."""
    for k in range(line_load.shape[0]):
        peak = greatest = 0.0
        for row in range(state.size[k]):
            peak = max(peak, line_load[k, state.place[k, row]])
            greatest = max(greatest, abs(state.step[k, row]))
        if not greatest <= SMALL * peak:
            return True
    return False


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
    nodes, log_ratio, place, steps = table.shape[0], lengths.log_ratio, state.place, state.step
    missing, diagonal, own = state.missing, state.diagonal, table.shape[2] // 2
    for row in range(state.size[k]):
        j = place[k, row]
        old, step = line_load[k, j], steps[k, row]
        if abs(step) > MAX_CORRECTED * old:
            continue
        tau = log_ratio[k, j]
        node, (v0, v1, w0, w1), _ = interpolation(nodes, tau)
        low = v0 * table[node, 0, own] + v1 * table[node, 1, own]
        before = old * (low + (w0 * table[node + 1, 0, own] + w1 * table[node + 1, 1, own]))
        tau = min(tau + 0.5 * math.log1p(step / old), HIGHEST)
        node, (v0, v1, w0, w1), _ = interpolation(nodes, tau)
        low = v0 * table[node, 0, own] + v1 * table[node, 1, own]
        after = (old + step) * (low + (w0 * table[node + 1, 0, own] + w1 * table[node + 1, 1, own]))
        missing[k, row] -= unit * (after - before) - diagonal[k, row] * step


@subroutine
def predict_surface(
    k: int, table: FloatArray, unit: float, log_ratio: FloatArray, state: NewtonState
) -> None:
    """Add the first-order displacement by contact `k`'s load to the surface of unloaded strips."""
    size, place, surface = state.size[k], state.place, state.surface[k]
    left, right, middle = state.left[k], state.right[k], table.shape[2] // 2
    first, last = place[k, 0], place[k, size - 1]
    if last + 1 - first != size:
        first, last = right, right  # unloaded strips between loaded ones
    for row in range(size):
        j = place[k, row]
        node, _, (d0, d1, e0, e1) = interpolation(table.shape[0], log_ratio[k, j])
        push, shift = unit * state.change[k, j], np.uint64(middle - j)
        d0, d1, e0, e1 = push * d0, push * d1, push * e0, push * e1
        for side in range(2):
            start, stop = (last + 1, right) if side else (left, first)
            for i in range(np.uint64(start), np.uint64(stop)):
                low = d0 * table[node, 0, i + shift] + d1 * table[node, 1, i + shift]
                high = e0 * table[node + 1, 0, i + shift] + e1 * table[node + 1, 1, i + shift]
                surface[i] += low + high


@subroutine
def complete_surface(
    k: int,
    approach: float,
    table: FloatArray,
    unit: float,
    line_load: FloatArray,
    lengths: HalfLengths,
    state: NewtonState,
) -> tuple[int, int]:
    """Add the displacement to the strips that are not followed but may be penetrated.

    A load displaces all strips away from the other body, so that a strip whose gap is greater than
    the approach is not penetrated. Returns the first strip with complete `surface`, and the one
    after the last.
    """
    surface, n = state.surface[k], line_load.shape[1]
    left, right = state.left[k], state.right[k]
    first, last = left, right - 1
    for i in range(left - 1, -1, -1):
        first = i if surface[i] < approach else first
    for i in range(right, n):
        last = i if surface[i] < approach else last
    if first < left:
        add_displacement(k, first, left - 1, table, unit, line_load, lengths, state)
    if last >= right:
        add_displacement(k, right, last, table, unit, line_load, lengths, state)
    return first, last + 1


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
        if greatest >= REUSED * peak:
            state.fresh[k] = True
        change = max(change, greatest / peak)
    return change, left


@subroutine
def fill_separation(
    k: int,
    gap: FloatArray,
    approach: float,
    line_load: FloatArray,
    state: NewtonState,
    separation: FloatArray,
) -> None:
    """Fill the distance between the deformed surfaces of contact `k` in strips without load.

    Strips that are not followed have the displacement of the nearest one that is.

    Parameters
    ----------
    gap, line_load, separation : ndarray, shape (contacts, strips)
        Gap [m], q [N/m] and the result [m].
    approach : float
        Approach relative to the least gap [m].
    """
    first, last = state.left[k], state.right[k] - 1
    for i in range(gap.shape[1]):
        near = min(max(i, first), last)
        beyond = state.surface[k, near] + (gap[k, i] - gap[k, near]) - approach
        separation[k, i] = max(beyond, 0.0) if not line_load[k, i] > 0.0 else 0.0
