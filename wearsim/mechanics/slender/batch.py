"""Many slender contacts one by one: what `slender` solves, again and again in one call."""

from __future__ import annotations

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.slender.newton import CONVERGED, solve_slender
from wearsim.types import FloatArray, IntArray


@kernel
def attempts(line_load: FloatArray) -> int:
    """Return how often to try: twice where there is a start, as that can mislead Newton.

    The second time is from the foundation's guess, which is always near.
    """
    for k in range(line_load.shape[0]):
        for i in range(line_load.shape[1]):
            if line_load[k, i] != 0.0:
                return 2
    return 1


@kernel
def forget_start(line_load: FloatArray) -> None:
    """Zero line loads, (contacts, strips)."""
    for k in range(line_load.shape[0]):
        for i in range(line_load.shape[1]):
            line_load[k, i] = 0.0


@kernel
def solve_each(
    gap: FloatArray,
    own: FloatArray,
    loads: FloatArray,
    spacing: float,
    contact_modulus: float,
    longitudinal_curvature: float,
    table: FloatArray,
    bend: FloatArray,
    line_load: FloatArray,
    approach: FloatArray,
    half_length: FloatArray,
    status: IntArray,
    iterations: IntArray,
) -> None:
    """Solve sets of contacts that share nothing; parameters as of `solve_slender`, sets first.

    Parameters
    ----------
    status, iterations : ndarray of int, shape (sets,)
        Filled with what `solve_slender` returns.
    """
    for m in range(gap.shape[0]):
        for attempt in range(attempts(line_load[m])):
            if attempt > 0:
                forget_start(line_load[m])
            status[m], iterations[m] = solve_slender(
                gap[m],
                own[m],
                loads[m],
                spacing,
                contact_modulus,
                longitudinal_curvature,
                table,
                bend,
                line_load[m],
                approach[m],
                half_length[m],
            )
            if status[m] == CONVERGED:
                break
