"""Half-lengths of strips that feel each other: longer or shorter than their own load makes them.

A strip without end, under the line load q, has a^2 = 4 q / (pi E* kappa), kappa being the relative
curvature along rolling. In a patch the neighbours curve a strip too, and its half-length is the one
at which the surface in its middle takes the curvature of the bodies:

    a_j^2 = s_j 4 q_j / (pi E* kappa),   s_j = s_j K_j,   K_j = (1/4) sum_k C_jk(a_k) / s_k,

K_j being the curvature there over kappa (see `influence`). In a Hertzian ellipse of any axis ratio
the pressure is semi-elliptic in every strip and s the same for all, so that the condition is exact;
elsewhere it is as good as a semi-ellipse is. For s are taken the first `SWEEPS` evaluations of s K
from s = 1. Two leave 2e-3 of p0 on a circle and 1e-4 at b/a = 3; to iterate to the end would gain
little, and s would be ill-determined: the curvature in the middle hardly feels how a varies from
one strip to the next.

Where strips are wider than long, C_0 tends to 4, the other C_k to 0 and s to 1. The first sweep
lies between 0 and 2 by itself. The bounds on s are met only by strips that are alone and far
narrower than long, or that carry next to nothing beside others that carry much.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.slender.influence import HIGHEST, read_influence, read_values
from wearsim.types import FloatArray, IntArray

SWEEPS = 2
LOWEST_FACTOR = 0.1
HIGHEST_FACTOR = 4.0
REACH = 4  # strips on either side whose loads are known to change s where contacts are followed
NEWTON_REACH = 3  # the same in Newton's method, whose last steps then shrink a hundred times


class Lengths(NamedTuple):
    """Half-lengths of several contacts, and the work space for them.

    From `curvature_table`, or `no_table` where every strip is taken by itself; ln(a/dy) of such a
    strip at 1 N/m; s and ln(a/dy) as last found (contacts, strips); the derivative of ln s_j by
    ln q of the strip c - reach further (contacts, strips, c); work space.
    """

    table: FloatArray
    log_scale: float
    factor: FloatArray
    found: FloatArray
    slope: FloatArray
    fresh: FloatArray
    lengthening: FloatArray
    work: FloatArray


@kernel
def new_lengths(contacts: int, table: FloatArray, log_scale: float, reach: int) -> Lengths:
    """Return the `Lengths` of contacts whose every strip is taken by itself so far.

    `reach` is `REACH` or `NEWTON_REACH`.
    """
    n = table.shape[2]
    return Lengths(
        table,
        log_scale,
        np.ones((contacts, n)),
        np.zeros((contacts, n)),
        np.zeros((contacts, n, 2 * reach + 1)),
        np.zeros((n, 4 * reach + 1)),
        np.zeros((n, 4 * reach + 1)),
        np.empty((3, n)),
    )


@kernel
def log_length(k: int, j: int, line_load: FloatArray, lengths: Lengths) -> float:
    """Return ln(a/dy) of strip `j` of contact `k`, which carries load."""
    tau: float = lengths.log_scale + 0.5 * np.log(line_load[k, j] * lengths.factor[k, j])
    return tau


@kernel
def fill_half_lengths(
    spacing: float, line_load: FloatArray, lengths: Lengths, half_length: FloatArray
) -> None:
    """Fill the half-length a [m] of every strip, (contacts, strips)."""
    for k in range(line_load.shape[0]):
        for j in range(line_load.shape[1]):
            half_length[k, j] = 0.0
            if line_load[k, j] > 0.0:
                half_length[k, j] = spacing * np.exp(log_length(k, j, line_load, lengths))


@kernel
def add_around(
    j: int, first: int, last: int, weight: float, value: FloatArray, total: FloatArray
) -> None:
    """Add what strip `j` does to all strips from `first` to `last`, `value` by distance."""
    here = np.uint64(j)  # unsigned numbers let the loops be vectorised, see `linear`
    for d in range(np.uint64(0), np.uint64(last - j + 1)):
        total[here + d] += weight * value[d]
    for d in range(np.uint64(1), np.uint64(j - first + 1)):
        total[here - d] += weight * value[d]


@kernel
def _add_slope(
    j: int,
    weight: float,
    value: FloatArray,
    tangent: FloatArray,
    chained: bool,
    slope: FloatArray,
    fresh: FloatArray,
) -> None:
    """Add how the curvature that strip `j` causes nearby follows the loads.

    It follows ln q_j through a and, once s has a `slope`, ln s_j through a and 1/s.
    """
    wide = slope.shape[1]
    reach = wide // 2
    for i in range(max(0, j - reach), min(slope.shape[0], j + reach + 1)):
        by_length = weight * (tangent[abs(i - j)] - value[abs(i - j)])
        fresh[i, j - i + 2 * reach] += by_length
        if chained:
            by_factor, start = by_length - weight * value[abs(i - j)], j - i + reach
            for c in range(wide):
                fresh[i, start + c] += by_factor * slope[j, c]


@kernel
def _take_slope(
    k: int,
    first: int,
    last: int,
    line_load: FloatArray,
    total: FloatArray,
    slope: FloatArray,
    fresh: FloatArray,
) -> None:
    """Add the slope of ln K to that of ln s, and empty it; what lies beyond reach is let go."""
    wide = slope.shape[1]
    for j in range(max(0, first - wide // 2), min(slope.shape[0], last + wide // 2 + 1)):
        if line_load[k, j] > 0.0:
            scale = 1.0 / total[j]
            for c in range(wide):
                slope[j, c] += fresh[j, c + wide // 2] * scale
        for c in range(2 * wide - 1):
            fresh[j, c] = 0.0


@kernel
def _find_span(k: int, line_load: FloatArray) -> tuple[int, int]:
    """Return the first and the last strip with load; the last is before the first if none has."""
    first, last = 0, line_load.shape[1] - 1
    while last >= 0 and not line_load[k, last] > 0.0:
        last -= 1
    while first < last and not line_load[k, first] > 0.0:
        first += 1
    return first, last


@kernel
def _take_sweep(
    k: int, first: int, last: int, line_load: FloatArray, total: FloatArray, lengths: Lengths
) -> float:
    """Multiply s by the curvature found, between its bounds; return the greatest ln(a/dy)."""
    widest, factor = -np.inf, lengths.factor
    for j in range(first, last + 1):
        if line_load[k, j] > 0.0:
            before = factor[k, j]
            after = min(max(before * total[j], LOWEST_FACTOR), HIGHEST_FACTOR)
            factor[k, j] = after
            lengths.found[k, j] += 0.5 * np.log(after / before)
            widest = max(widest, lengths.found[k, j])
    return widest


@kernel
def find_factors(k: int, line_load: FloatArray, sloped: bool, lengths: Lengths) -> float:
    """Fill s and ln(a/dy) of contact `k`, and the slope of s if asked.

    Parameters
    ----------
    k : int
        Which contact.
    line_load : ndarray, shape (contacts, strips)
        q [N/m]; strips without load take no part.
    sloped : bool
        Whether the slope is wanted as well.
    lengths : Lengths

    Returns
    -------
    float
        The greatest ln(a/dy) met; past HIGHEST nothing more is found.
    """
    total, value, tangent = lengths.work[0], lengths.work[1], lengths.work[2]
    slope, n = lengths.slope[k], line_load.shape[1]
    first, last = _find_span(k, line_load)
    widest = -np.inf
    for j in range(n):
        lengths.factor[k, j] = 1.0
        for c in range(slope.shape[1]):
            slope[j, c] = 0.0
        if line_load[k, j] > 0.0:
            lengths.found[k, j] = log_length(k, j, line_load, lengths)
            widest = max(widest, lengths.found[k, j])
    if lengths.table.shape[0] == 0:
        return widest
    for sweep in range(SWEEPS):
        if widest > HIGHEST:
            break
        for j in range(n):
            total[j] = 0.0
        for j in range(first, last + 1):
            if not line_load[k, j] > 0.0:
                continue
            far, weight = max(last - j, j - first) + 1, 0.25 / lengths.factor[k, j]
            if sloped:
                count = min(n, max(far, slope.shape[1]))
                read_influence(lengths.table, lengths.found[k, j], count, value, tangent)
                _add_slope(j, weight, value, tangent, sweep > 0, slope, lengths.fresh)
            else:
                read_values(lengths.table, lengths.found[k, j], far, value)
            add_around(j, first, last, weight, value, total)
        widest = max(widest, _take_sweep(k, first, last, line_load, total, lengths))
        if sloped:
            _take_slope(k, first, last, line_load, total, slope, lengths.fresh)
    return widest


@kernel
def lengthen(
    k: int, j: int, push: float, value: FloatArray, tangent: FloatArray, lengths: Lengths
) -> None:
    """Add how the loads near strip `j` of contact `k` move the surface around it through s_j.

    `value` and `tangent` are those of F_k (see `read_influence`), and `push` is the displacement
    that F_k = 1 stands for.
    """
    slope, lengthening = lengths.slope[k], lengths.lengthening
    wide = slope.shape[1]
    reach = wide // 2
    for i in range(max(0, j - reach), min(slope.shape[0], j + reach + 1)):
        moved, start = push * (tangent[abs(i - j)] - value[abs(i - j)]), j - i + reach
        for c in range(wide):
            lengthening[i, start + c] += moved * slope[j, c]


@kernel
def add_lengthening(
    k: int, line_load: FloatArray, index: IntArray, lengths: Lengths, matrix: FloatArray
) -> None:
    """Add what `lengthen` has gathered to the Jacobian of contact `k`, by columns, and empty it.

    `index` holds the row of each strip in contact, and -1 of the others, (contacts, strips).
    """
    lengthening = lengths.lengthening
    n, wide = lengthening.shape
    half = wide // 2
    first, last = _find_span(k, line_load)
    for j in range(first, last + 1):
        column = index[k, j]
        if column < 0:
            continue
        scale = 1.0 / line_load[k, j]
        for i in range(max(0, j - half), min(n, j + half + 1)):
            if index[k, i] >= 0:
                matrix[column, index[k, i]] += lengthening[i, j - i + half] * scale
    for i in range(max(0, first - half), min(n, last + half + 1)):
        for c in range(wide):
            lengthening[i, c] = 0.0
