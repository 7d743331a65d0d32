"""Half-lengths of interacting strips.

An infinitely wide strip under the line load q has a^2 = 4 q / (pi E* kappa) with the relative
curvature along rolling kappa. In a patch the neighbouring strips curve the surface of a strip too,
and its half-length is the one at which the surface in its middle has the curvature of the bodies:

    a_j^2 = s_j 4 q_j / (pi E* kappa),   s_j = s_j K_j,   K_j = (1/4) sum_k C_jk(a_k) / s_k,

where K_j is that curvature over kappa (see `influence`). In a Hertzian ellipse of any axis ratio
the pressure is semi-elliptic in every strip and s is the same for all, so that the condition is
exact; elsewhere it is as accurate as the semi-ellipse. s is the result of `SWEEPS` evaluations of
s K from s = 1. Two leave an error of 2e-3 of p0 on a circle and 1e-4 at b/a = 3. Iterating to
convergence would gain little and s would be ill-conditioned, as the curvature in the middle hardly
depends on the variation of a from one strip to the next.

Where strips are wider than long, C_0 tends to 4, the other C_k to 0 and s to 1. The first sweep
always lies between 0 and 2. The bounds on s are reached only by isolated strips that are far
narrower than long, and by strips with a very small load next to strips with a great one.
"""

from __future__ import annotations

import math
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine, subroutine_of
from wearsim.mechanics.numerics.lu import whole_panels
from wearsim.mechanics.slender.influence import HIGHEST, interpolation
from wearsim.types import FloatArray, IntArray

SWEEPS = 2
LOWEST_FACTOR = 0.1
HIGHEST_FACTOR = 4.0
REACH = 2  # neighbours on either side in the derivative of s with respect to the line loads


class HalfLengths(NamedTuple):
    """Half-lengths of several contacts and their work space.

    `table` is from `curvature_table`, or from `no_table` for strips without interaction, and
    `log_scale` is ln(a/dy) of such a strip at 1 N/m, (contacts,). `factor` is s and `log_ratio` is
    ln(a/dy), (contacts, strips). `slope[k, REACH + c, i + 2 REACH]` is the derivative of ln s of
    strip i by ln q of strip i + c, and `near[d, i + 2 REACH]` is the derivative by the ln s
    of strip i of its influence on the strips i + d and i - d; both are zero beyond the strips.
    `chained`, `gathered` and `work` are work space.
    """

    table: FloatArray
    log_scale: FloatArray
    factor: FloatArray
    log_ratio: FloatArray
    slope: FloatArray
    near: FloatArray
    chained: FloatArray
    gathered: FloatArray
    work: FloatArray


@subroutine
def new_half_lengths(table: FloatArray, contacts: int) -> HalfLengths:
    """Return the `HalfLengths` of contacts, to be filled."""
    n = (table.shape[2] + 1) // 2
    slopes = np.empty((contacts + 2, 2 * REACH + 1, n + 4 * REACH))
    flat = slopes.reshape(slopes.size)
    for i in range(slopes.size):  # numba compiles a loop faster than np.zeros
        flat[i] = 0.0
    return HalfLengths(
        table,
        np.empty(contacts),
        np.empty((contacts, n)),
        np.empty((contacts, n)),
        slopes[:contacts],
        slopes[contacts],
        slopes[contacts + 1],
        np.empty((4 * REACH + 1, n)),
        np.empty((2, n)),
    )


@subroutine
def log_half_length(k: int, j: int, line_load: FloatArray, lengths: HalfLengths) -> float:
    """Return ln(a/dy) of the loaded strip `j` of contact `k`."""
    return float(lengths.log_scale[k] + 0.5 * math.log(line_load[k, j] * lengths.factor[k, j]))


@subroutine
def fill_factor_growth(
    k: int, first: int, last: int, growth: FloatArray, lengths: HalfLengths, result: FloatArray
) -> None:
    """Fill the growth of ln s of the strips `first` to `last` from that of ln q, to first order.

    Parameters
    ----------
    growth : ndarray
        Growth of ln q of strip i in element ``i + 2 * REACH``, zero beyond the strips.
    result : ndarray, shape (strips,)
        Filled.
    """
    for i in range(first, last + 1):
        result[i] = 0.0
    for c in range(2 * REACH + 1):
        shift = np.uint64(c + REACH)
        for i in range(np.uint64(first), np.uint64(last + 1)):
            result[i] += lengths.slope[k, c, i + np.uint64(2 * REACH)] * growth[i + shift]


@subroutine
def fill_half_lengths(
    spacing: float, line_load: FloatArray, lengths: HalfLengths, half_length: FloatArray
) -> None:
    """Fill the half-length a [m] of every strip, (contacts, strips)."""
    for k in range(line_load.shape[0]):
        one_newton = spacing * math.exp(lengths.log_scale[k])
        for j in range(line_load.shape[1]):
            half_length[k, j] = one_newton * np.sqrt(line_load[k, j] * lengths.factor[k, j])


@subroutine
def add_around(
    j: int, first: int, last: int, weight: float, value: FloatArray, total: FloatArray
) -> None:
    """Add the influence of strip `j`, `value` by distance, to the strips `first` to `last`."""
    here = np.uint64(j)  # unsigned indices allow vectorised loops, see `numerics.lu`
    for d in range(np.uint64(0), np.uint64(last - j + 1)):
        total[here + d] += weight * value[d]
    for d in range(np.uint64(1), np.uint64(j - first + 1)):
        total[here - d] += weight * value[d]


def _add_pairs(
    table: FloatArray,
    k: int,
    left: int,
    right: int,
    weight: FloatArray,
    log_ratio: FloatArray,
    total: FloatArray,
) -> None:
    nodes, middle, part = table.shape[0], table.shape[2] // 2, total[left : right + 1]
    loaded = weight.nonzero()[0].tolist()
    for first, second in zip_longest(loaded[::2], loaded[1::2]):
        added = []
        for j, u in (first, weight[first]), (second, 0.0 if second is None else weight[second]):
            strip = first if j is None else j
            node, (a0, a1, b0, b1), _ = interpolation(nodes, log_ratio[k, strip])
            rows = table[node : node + 2, :, middle + left - strip : middle + right + 1 - strip]
            low = (a0 * u) * rows[0, 0] + (a1 * u) * rows[0, 1]
            added.append((low, (b0 * u) * rows[1, 0] + (b1 * u) * rows[1, 1]))
        (low, high), (low_of_second, high_of_second) = added
        part += (low + low_of_second) + (high + high_of_second)


@subroutine_of(_add_pairs)
def add_influences(
    table: FloatArray,
    k: int,
    left: int,
    right: int,
    weight: FloatArray,
    log_ratio: FloatArray,
    total: FloatArray,
) -> None:
    """Add the influence of the loaded strips of contact `k` to the strips `left` to `right`.

    Parameters
    ----------
    table : ndarray, shape (nodes, 2, 2 * strips - 1)
        Of F_k or C_k.
    weight : ndarray, shape (strips,)
        Factors of the influence of each strip; 0 for strips without load.
    log_ratio : ndarray, shape (contacts, strips)
        ln(a/dy).
    total : ndarray, shape (strips,)
        Increased.
    """
    nodes, middle, strips = table.shape[0], table.shape[2] // 2, weight.shape[0]
    start, stop, first = np.uint64(left), np.uint64(right + 1), -1
    for j in range(strips + 1):  # two strips at once, so that `total` is read half as often
        if j < strips and weight[j] == 0.0:
            continue
        if first < 0:
            first = j
            continue
        second, v = (j, weight[j]) if j < strips else (first, 0.0)  # the last one alone
        p, (a0, a1, b0, b1), _ = interpolation(nodes, log_ratio[k, first])
        q, (c0, c1, d0, d1), _ = interpolation(nodes, log_ratio[k, second])
        u = weight[first]
        a0, a1, b0, b1 = a0 * u, a1 * u, b0 * u, b1 * u
        c0, c1, d0, d1 = c0 * v, c1 * v, d0 * v, d1 * v
        to_first, to_second = np.uint64(middle - first), np.uint64(middle - second)
        for i in range(start, stop):
            m, n = i + to_first, i + to_second
            low = a0 * table[p, 0, m] + a1 * table[p, 1, m]
            low += c0 * table[q, 0, n] + c1 * table[q, 1, n]
            high = b0 * table[p + 1, 0, m] + b1 * table[p + 1, 1, m]
            high += d0 * table[q + 1, 0, n] + d1 * table[q + 1, 1, n]
            total[i] += low + high
        first = -1


@subroutine
def _fill_near(
    k: int, first: int, last: int, table: FloatArray, weight: FloatArray, lengths: HalfLengths
) -> None:
    """Fill the derivatives of the influence of each strip by its ln q and by its ln s.

    The influence of a strip on those up to the reach away is `weight` times F_k or C_k; it depends
    on ln q through a (`near`), and where it is divided by s, on ln s through a and 1/s (`chained`).
    Both are 0 for strips without weight, between the strips `first` and `last` and up to the reach
    away from them, where the slope is 0 too.
    """
    near, chained, log_ratio = lengths.near, lengths.chained, lengths.log_ratio
    for side in range(2):
        start = last + 1 if side else first - REACH
        for c in range(2 * REACH + 1):
            for i in range(start + 2 * REACH, start + 3 * REACH):
                near[c, i] = chained[c, i] = lengths.slope[k, c, i] = 0.0
    for j in range(first, last + 1):
        tau = log_ratio[k, j] if weight[j] != 0.0 else 0.0
        node, (v0, v1, w0, w1), (d0, d1, e0, e1) = interpolation(table.shape[0], tau)
        middle = table.shape[2] // 2
        for d in range(min(weight.shape[0], REACH + 1)):
            by_length = by_factor = 0.0
            if weight[j] != 0.0:
                a, b = table[node, 0, middle + d], table[node, 1, middle + d]
                c, e = table[node + 1, 0, middle + d], table[node + 1, 1, middle + d]
                value = v0 * a + v1 * b + w0 * c + w1 * e
                by_length = weight[j] * (d0 * a + d1 * b + e0 * c + e1 * e - value)
                by_factor = by_length - weight[j] * value
            near[d, j + 2 * REACH], chained[d, j + 2 * REACH] = by_length, by_factor


@subroutine
def _gather(
    k: int, first: int, last: int, far: int, part: FloatArray, lengths: HalfLengths
) -> None:
    """Fill `gathered` with the derivatives by ln q of the influence on strips, through s.

    Parameters
    ----------
    k, first, last : int
        Contact, and the strips concerned.
    far : int
        Greatest distance between a strip and that of q.
    part : ndarray
        `near` or `chained`: derivative of the influence of each strip by its ln s.
    """
    slope, gathered = lengths.slope, lengths.gathered
    start, stop = np.uint64(first), np.uint64(last + 1)
    for c in range(-far, far + 1):
        for i in range(start, stop):
            gathered[far + c, i] = 0.0
        for d in range(max(-REACH, c - REACH), min(REACH, c + REACH) + 1):
            shift = np.uint64(2 * REACH + d)
            for i in range(start, stop):
                gathered[far + c, i] += part[abs(d), i + shift] * slope[k, REACH + c - d, i + shift]


@subroutine
def _add_slopes(
    k: int, first: int, last: int, total: FloatArray, chained: bool, lengths: HalfLengths
) -> None:
    """Add the derivative of ln K, with K in `total`, to that of ln s."""
    near, slope, gathered = lengths.near, lengths.slope, lengths.gathered
    if chained:
        _gather(k, first, last, REACH, lengths.chained, lengths)
    for c in range(2 * REACH + 1):
        shift, distance = np.uint64(c + REACH), abs(c - REACH)
        for i in range(np.uint64(first), np.uint64(last + 1)):
            here = i + np.uint64(2 * REACH)
            if chained:
                slope[k, c, here] += (gathered[c, i] + near[distance, i + shift]) / total[i]
            else:
                slope[k, c, here] = near[distance, i + shift] / total[i]


@subroutine
def _find_span(k: int, line_load: FloatArray) -> tuple[int, int]:
    """Return the first and the last loaded strip; last < first if no strip is loaded."""
    first, last = 0, line_load.shape[1] - 1
    while last >= 0 and not line_load[k, last] > 0.0:
        last -= 1
    while first < last and not line_load[k, first] > 0.0:
        first += 1
    return first, last


@subroutine
def find_factors(
    k: int, line_load: FloatArray, sloped: bool, sweeps: int, lengths: HalfLengths
) -> float:
    """Fill s and ln(a/dy) of contact `k`, and the slope of s if `sloped`.

    Parameters
    ----------
    k : int
        Number of the contact.
    line_load : ndarray, shape (contacts, strips)
        q [N/m]; strips without load are ignored.
    sloped : bool
        Whether the slope is computed.
    sweeps : int
        Evaluations of s: `SWEEPS`, or fewer where an estimate is sufficient.
    lengths : HalfLengths
        Filled.

    Returns
    -------
    float
        The greatest ln(a/dy) encountered; where it exceeds HIGHEST the results are incomplete.
    """
    total, weight = lengths.work[0], lengths.work[1]
    factor, log_ratio = lengths.factor, lengths.log_ratio
    first, last = _find_span(k, line_load)
    end = min(first + whole_panels(last + 1 - first), line_load.shape[1]) - 1  # of whole vectors
    widest, log_scale = -np.inf, lengths.log_scale[k]
    for j in range(line_load.shape[1]):
        factor[k, j], weight[j] = 1.0, 0.0
        if line_load[k, j] > 0.0:
            log_ratio[k, j] = log_scale + 0.5 * math.log(line_load[k, j])
            widest = max(widest, log_ratio[k, j])
    if lengths.table.shape[0] == 0:
        return widest
    for sweep in range(sweeps):
        if widest > HIGHEST:
            break
        for j in range(first, end + 1):
            total[j] = 0.0
            if line_load[k, j] > 0.0:
                weight[j] = 0.25 / factor[k, j]
        add_influences(lengths.table, k, first, end, weight, log_ratio, total)
        if sloped:
            _fill_near(k, first, last, lengths.table, weight, lengths)
            _add_slopes(k, first, last, total, sweep > 0, lengths)
        for j in range(first, last + 1):
            if line_load[k, j] > 0.0:
                after = min(max(factor[k, j] * total[j], LOWEST_FACTOR), HIGHEST_FACTOR)
                factor[k, j] = after
                log_ratio[k, j] = log_scale + 0.5 * math.log(line_load[k, j] * after)
                widest = max(widest, log_ratio[k, j])
    return widest


@subroutine
def add_length_slopes(
    k: int, line_load: FloatArray, index: IntArray, lengths: HalfLengths, matrix: FloatArray
) -> None:
    """Add the derivative of the displacements by the loads, through s, to a Jacobian.

    Parameters
    ----------
    k : int
        Number of the contact.
    line_load : ndarray, shape (contacts, strips)
        q [N/m].
    index : ndarray of int, shape (contacts, strips)
        Row of each strip in contact, -1 for the others.
    lengths : HalfLengths
        From `find_factors`, with slopes; `near` is the derivative of the displacements by ln s.
    matrix : ndarray
        Jacobian of contact `k`, by columns.
    """
    gathered = lengths.gathered
    first, last = _find_span(k, line_load)
    _gather(k, first, last, 2 * REACH, lengths.near, lengths)
    for j in range(first, last + 1):
        column, scale = index[k, j], 1.0 / max(line_load[k, j], 1e-300)
        start, stop = max(first, j - 2 * REACH), min(last, j + 2 * REACH) + 1
        here = np.uint64(j + 2 * REACH)
        for i in range(np.uint64(start), np.uint64(stop if column >= 0 else start)):
            row = index[k, i]
            if row >= 0:
                matrix[np.uint64(column), np.uint64(row)] += scale * gathered[here - i, i]


@subroutine
def fill_log_scales(
    contact_modulus: float,
    longitudinal_curvature: FloatArray,
    spacing: float,
    log_scale: FloatArray,
) -> None:
    """Fill ln(a/dy) of a strip of each contact under 1 N/m without interaction (s = 1)."""
    for k in range(longitudinal_curvature.shape[0]):
        scale = 4.0 / (np.pi * contact_modulus * longitudinal_curvature[k])
        log_scale[k] = 0.5 * math.log(scale) - math.log(spacing)
