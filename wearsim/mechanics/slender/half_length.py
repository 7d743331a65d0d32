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

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.mechanics.slender.influence import HIGHEST, read_influence
from wearsim.types import FloatArray, IntArray

SWEEPS = 2
LOWEST_FACTOR = 0.1
HIGHEST_FACTOR = 4.0
REACH = 4  # strips on either side whose loads enter the derivative of s in the chord method
NEWTON_REACH = 3  # the same in Newton's method, whose last steps then shrink a hundredfold


class HalfLengths(NamedTuple):
    """Half-lengths of several contacts and their work space.

    `table` is from `curvature_table`, or from `no_table` for strips without interaction, and
    `log_scale` is ln(a/dy) of such a strip at 1 N/m, (contacts,). `factor` is s and `log_ratio` is
    ln(a/dy), (contacts, strips); `slope` is the derivative of ln s_j by ln q of strip
    j + c - reach, (contacts, strips, c). `slope_part`, `gathered` and `work` are work space.
    """

    table: FloatArray
    log_scale: FloatArray
    factor: FloatArray
    log_ratio: FloatArray
    slope: FloatArray
    slope_part: FloatArray
    gathered: FloatArray
    work: FloatArray


@subroutine
def new_half_lengths(table: FloatArray, log_scale: FloatArray, reach: int) -> HalfLengths:
    """Return the `HalfLengths` of contacts, to be filled; `reach` is `REACH` or `NEWTON_REACH`."""
    contacts, n = log_scale.shape[0], table.shape[2]
    lengths = HalfLengths(
        table,
        log_scale,
        np.empty((contacts, n)),
        np.empty((contacts, n)),
        np.empty((contacts, n, 2 * reach + 1)),
        np.empty((n, 4 * reach + 1)),
        np.empty((n, 4 * reach + 1)),
        np.empty((3, n)),
    )
    # numba compiles a loop faster than np.zeros
    for i in range(n):
        for c in range(4 * reach + 1):
            lengths.slope_part[i, c] = lengths.gathered[i, c] = 0.0
    return lengths


@subroutine
def log_half_length(k: int, j: int, line_load: FloatArray, lengths: HalfLengths) -> float:
    """Return ln(a/dy) of the loaded strip `j` of contact `k`."""
    return float(lengths.log_scale[k] + 0.5 * np.log(line_load[k, j] * lengths.factor[k, j]))


@subroutine
def factor_growth(k: int, j: int, growth: FloatArray, lengths: HalfLengths) -> float:
    """Return the growth of ln s of strip `j` from that of ln q, (strips,), to first order."""
    n, total, reach = growth.shape[0], 0.0, lengths.slope_part.shape[1] // 4
    for c in range(max(0, reach - j), min(2 * reach + 1, n + reach - j)):
        total += lengths.slope[k, j, c] * growth[j + c - reach]
    return total


@subroutine
def fill_half_lengths(
    spacing: float, line_load: FloatArray, lengths: HalfLengths, half_length: FloatArray
) -> None:
    """Fill the half-length a [m] of every strip, (contacts, strips)."""
    for k in range(line_load.shape[0]):
        for j in range(line_load.shape[1]):
            half_length[k, j] = 0.0
            if line_load[k, j] > 0.0:
                half_length[k, j] = spacing * np.exp(log_half_length(k, j, line_load, lengths))


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


@subroutine
def _add_slope(
    j: int,
    weight: float,
    value: FloatArray,
    tangent: FloatArray,
    chained: bool,
    slope: FloatArray,
    slope_part: FloatArray,
) -> None:
    """Add the derivative by the loads of the curvature that strip `j` causes nearby.

    The curvature depends on ln q_j through a and, if `chained`, on ln s_j through a and 1/s.
    """
    wide, reach = slope.shape[1], slope.shape[1] // 2
    for i in range(max(0, j - reach), min(slope.shape[0], j + reach + 1)):
        by_length = weight * (tangent[abs(i - j)] - value[abs(i - j)])
        slope_part[i, j - i + 2 * reach] += by_length
        if chained:
            by_factor, start = by_length - weight * value[abs(i - j)], j - i + reach
            for c in range(wide):
                slope_part[i, start + c] += by_factor * slope[j, c]


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
def _update_factors(
    k: int,
    first: int,
    last: int,
    line_load: FloatArray,
    total: FloatArray,
    sloped: bool,
    lengths: HalfLengths,
) -> float:
    """Multiply s by the curvature `total` within its bounds; return the greatest ln(a/dy).

    If `sloped`, the slope of ln K is added to that of ln s, truncated to the reach, and
    `slope_part` is cleared.
    """
    widest, factor = -np.inf, lengths.factor
    slope, slope_part = lengths.slope[k], lengths.slope_part
    wide = slope.shape[1]
    for j in range(first, last + 1):
        if line_load[k, j] > 0.0:
            before = factor[k, j]
            after = min(max(before * total[j], LOWEST_FACTOR), HIGHEST_FACTOR)
            factor[k, j] = after
            lengths.log_ratio[k, j] += 0.5 * np.log(after / before)
            widest = max(widest, lengths.log_ratio[k, j])
            if sloped:
                scale = 1.0 / total[j]
                for c in range(wide):
                    slope[j, c] += slope_part[j, c + wide // 2] * scale
    if sloped:
        for j in range(max(0, first - wide // 2), min(slope.shape[0], last + wide // 2 + 1)):
            slope_part[j] = 0.0
    return widest


@subroutine
def find_factors(k: int, line_load: FloatArray, sloped: bool, lengths: HalfLengths) -> float:
    """Fill s and ln(a/dy) of contact `k`, and the slope of s if `sloped`.

    Parameters
    ----------
    k : int
        Number of the contact.
    line_load : ndarray, shape (contacts, strips)
        q [N/m]; strips without load are ignored.
    sloped : bool
        Whether the slope is computed.
    lengths : HalfLengths
        Filled.

    Returns
    -------
    float
        The greatest ln(a/dy) encountered; where it exceeds HIGHEST the results are incomplete.
    """
    total, value, tangent = lengths.work[0], lengths.work[1], lengths.work[2]
    slope, n = lengths.slope[k], line_load.shape[1]
    first, last = _find_span(k, line_load)
    widest = -np.inf
    slope[:] = 0.0
    for j in range(n):
        lengths.factor[k, j] = 1.0
        if line_load[k, j] > 0.0:
            lengths.log_ratio[k, j] = log_half_length(k, j, line_load, lengths)
            widest = max(widest, lengths.log_ratio[k, j])
    if lengths.table.shape[0] == 0:
        return widest
    for sweep in range(SWEEPS):
        if widest > HIGHEST:
            break
        total[:] = 0.0
        for j in range(first, last + 1):
            if not line_load[k, j] > 0.0:
                continue
            count, weight = max(last - j, j - first) + 1, 0.25 / lengths.factor[k, j]
            if sloped:
                count = min(n, max(count, slope.shape[1]))
            read_influence(lengths.table, lengths.log_ratio[k, j], count, sloped, value, tangent)
            if sloped:
                _add_slope(j, weight, value, tangent, sweep > 0, slope, lengths.slope_part)
            add_around(j, first, last, weight, value, total)
        reached = _update_factors(k, first, last, line_load, total, sloped, lengths)
        widest = max(widest, reached)
    return widest


@subroutine
def gather_length_slopes(
    k: int, j: int, push: float, value: FloatArray, tangent: FloatArray, lengths: HalfLengths
) -> None:
    """Add the derivative of the surface around strip `j` of contact `k` by ln q, through s_j.

    `value` and `tangent` are those of F_k (see `read_influence`), and `push` is the displacement
    for F_k = 1.
    """
    slope, gathered = lengths.slope[k], lengths.gathered
    wide, reach = slope.shape[1], slope.shape[1] // 2
    for i in range(max(0, j - reach), min(slope.shape[0], j + reach + 1)):
        moved, start = push * (tangent[abs(i - j)] - value[abs(i - j)]), j - i + reach
        for c in range(wide):
            gathered[i, start + c] += moved * slope[j, c]


@subroutine
def add_length_slopes(
    k: int, line_load: FloatArray, index: IntArray, lengths: HalfLengths, matrix: FloatArray
) -> None:
    """Add the terms of `gather_length_slopes` to the Jacobian of contact `k` and clear them.

    `matrix` is stored by columns; `index` is the row of each strip in contact and -1 for the
    others, (contacts, strips).
    """
    gathered = lengths.gathered
    n, half = gathered.shape[0], gathered.shape[1] // 2
    first, last = _find_span(k, line_load)
    for j in range(first, last + 1):
        column = index[k, j]
        if column < 0:
            continue
        scale = 1.0 / line_load[k, j]
        for i in range(max(0, j - half), min(n, j + half + 1)):
            if index[k, i] >= 0:
                matrix[column, index[k, i]] += gathered[i, j - i + half] * scale
    for i in range(max(0, first - half), min(n, last + half + 1)):
        gathered[i] = 0.0
