"""One step of Newton's method for slender contacts: displacements, their Jacobian and the step.

The Jacobian is exact but for what s owes to strips further than `NEWTON_REACH` (see
`half_length`). It may serve for several steps, which then shrink twenty times or so where they
would be squared; most of that is a strip's displacement under its own load, which is not straight.
So each step is taken twice: the second time with what it leaves of that put right (`add_beyond`),
and a new Jacobian is hardly needed unless strips leave or enter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.numerics.lu import factor_in_place, solve_factored
from wearsim.mechanics.slender.half_length import (
    Lengths,
    add_around,
    add_lengthening,
    find_factors,
    lengthen,
)
from wearsim.mechanics.slender.influence import HIGHEST, read_influence, read_value, read_values
from wearsim.types import BoolArray, FloatArray, IntArray

STRAIGHT = 0.5  # relative change of a load up to which the Jacobian is trusted to be put right


class Steps(NamedTuple):
    """What steps are made of, one entry per contact first, then one per strip in contact: its row.

    Whether the Jacobian is to be found anew; the number of rows; the strip of each row; the row of
    each strip, -1 outside the contact; how all strips are displaced by the load of each row; the
    Jacobian by columns, factored, and the order of its equations; the loads that a unit approach
    adds [N/m^2], and their sum; the displacement of each strip under its own load [m] and its
    derivative; what the loads have to press down further [m]; the step [N/m]; and the change of
    load that was made of it, by strip [N/m].
    """

    fresh: BoolArray
    size: IntArray
    place: IntArray
    rows: IntArray
    outer: FloatArray
    matrix: FloatArray
    order: IntArray
    unit_load: FloatArray
    risen: FloatArray
    pressed: FloatArray
    diagonal: FloatArray
    missing: FloatArray
    step: FloatArray
    change: FloatArray


@kernel
def new_steps(contacts: int, n: int) -> Steps:
    """Return the `Steps` of contacts that have no Jacobian yet."""
    return Steps(
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


@kernel
def _number_strips(k: int, line_load: FloatArray, steps: Steps) -> None:
    """Give the strips of contact `k` that carry load their rows."""
    count = 0
    for i in range(line_load.shape[1]):
        steps.rows[k, i] = -1
        if line_load[k, i] > 0.0:
            steps.rows[k, i] = count
            steps.place[k, count] = i
            count += 1
    steps.size[k] = count


@kernel
def _press(
    k: int,
    line_load: FloatArray,
    table: FloatArray,
    unit: float,
    lengths: Lengths,
    work: FloatArray,
    surface: FloatArray,
    steps: Steps,
) -> None:
    """Add contact `k`'s elastic displacement to `surface`, and fill a fresh Jacobian."""
    n, size, fresh = line_load.shape[1], steps.size[k], steps.fresh[k]
    value, tangent, pressed = work[0], work[1], surface[k]
    for column in range(size):
        j = steps.place[k, column]
        push, tau, reach = unit * line_load[k, j], lengths.found[k, j], max(j + 1, n - j)
        if fresh:
            read_influence(table, tau, reach, value, tangent)
            steps.diagonal[k, column] = unit * tangent[0]
            outer = steps.outer[k, column]
            for i in range(n):
                outer[i] = 0.0
            add_around(j, 0, n - 1, unit, tangent, outer)
            for row in range(size):
                steps.matrix[k, column, row] = outer[steps.place[k, row]]
            if lengths.table.shape[0] > 0:
                lengthen(k, j, push, value, tangent, lengths)
        else:
            read_values(table, tau, reach, value)
        steps.pressed[k, column] = push * value[0]
        add_around(j, 0, n - 1, push, value, pressed)


@kernel
def displace(
    k: int,
    own: FloatArray,
    table: FloatArray,
    unit: float,
    lengths: Lengths,
    line_load: FloatArray,
    work: FloatArray,
    surface: FloatArray,
    steps: Steps,
) -> float:
    """Add contact `k`'s displacement and own wear to `surface`; return the greatest ln(a/dy).

    `surface` holds the gap before and equals delta in contact at the solution. A fresh Jacobian is
    filled. Past HIGHEST nothing is complete.
    """
    fresh = steps.fresh[k]
    if fresh:
        _number_strips(k, line_load, steps)
    widest = find_factors(k, line_load, fresh, lengths)
    if widest > HIGHEST:
        return widest
    _press(k, line_load, table, unit, lengths, work, surface, steps)
    if fresh and lengths.table.shape[0] > 0:
        add_lengthening(k, line_load, steps.rows, lengths, steps.matrix[k])
    for row in range(steps.size[k]):
        i = steps.place[k, row]
        surface[k, i] += own[k, i] * line_load[k, i]
        steps.missing[k, row] = -surface[k, i]
        if fresh:
            steps.matrix[k, row, row] += own[k, i]
    return widest


@kernel
def factor_jacobian(k: int, steps: Steps) -> bool:
    """Factor contact `k`'s fresh Jacobian; False where it is singular, or no approach adds load."""
    size = steps.size[k]
    if not factor_in_place(steps.matrix[k], size, steps.order[k]):
        return False
    for row in range(size):
        steps.step[k, row] = 1.0
    solve_factored(steps.matrix[k], size, steps.order[k], steps.step[k], steps.unit_load[k])
    steps.risen[k] = 0.0
    for row in range(size):
        steps.risen[k] += steps.unit_load[k, row]
    steps.fresh[k] = False
    sound: bool = abs(steps.risen[k]) > 0.0
    return sound


@kernel
def take_step(
    k: int, load: float, line_load: FloatArray, steps: Steps, approach: FloatArray
) -> None:
    """Find contact `k`'s step, and the approach with which its strips carry `load` [N/m]."""
    size, step = steps.size[k], steps.step[k]
    solve_factored(steps.matrix[k], size, steps.order[k], steps.missing[k], step)
    lacking = load
    for row in range(size):
        lacking -= line_load[k, steps.place[k, row]] + step[row]
    approach[k] = lacking / steps.risen[k]
    for row in range(size):
        step[row] += steps.unit_load[k, row] * approach[k]


@kernel
def add_beyond(
    k: int,
    table: FloatArray,
    unit: float,
    line_load: FloatArray,
    lengths: Lengths,
    steps: Steps,
) -> None:
    """Take what the step leaves of each strip's displacement by its own load off what is missing.

    Strips whose load changes by more than `STRAIGHT` are left as they are: what is put right must
    stay far smaller than the step.
    """
    for row in range(steps.size[k]):
        j = steps.place[k, row]
        old, step = line_load[k, j], steps.step[k, row]
        if abs(step) > STRAIGHT * old:
            continue
        tau = min(lengths.found[k, j] + 0.5 * np.log1p(step / old), HIGHEST)
        pressed = unit * (old + step) * read_value(table, tau, 0)
        steps.missing[k, row] -= pressed - steps.pressed[k, row] - steps.diagonal[k, row] * step


@kernel
def foresee(k: int, surface: FloatArray, steps: Steps) -> None:
    """Add what the change of contact `k`'s loads displaces to `surface`, to first order."""
    n = surface.shape[1]
    for row in range(steps.size[k]):
        change = steps.change[k, steps.place[k, row]]
        for i in range(n):
            surface[k, i] += change * steps.outer[k, row, i]
