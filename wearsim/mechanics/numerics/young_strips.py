"""Formulas of strips that have come into contact lately; see `evolution.steppers.edges`."""

from __future__ import annotations

from wearsim.mechanics.numerics.edge_strips import SETTLED, own_side
from wearsim.mechanics.numerics.jit import subroutine
from wearsim.types import BoolArray, FloatArray, IntArray

YOUNG_STEPS = 2.0  # steps for which a strip is young, over the order
# strips that follow the formula of the order, young ones that have been wholly in contact for
# `FIRST_STEPS`, in which their wear rises from zero, and other young ones
OLD, WHOLE, PARTIAL = 0, 1, 2
FIRST_STEPS = 2.0
# part of a step in which a young strip wears at the rate of the step's start: a half, as in the
# trapezoidal rule, would make the pressure at an edge alternate
AT_START = 0.4


@subroutine
def mark_strips(
    bodies: IntArray,
    resolved: BoolArray,
    part: FloatArray,
    whole_steps: FloatArray,
    orders: IntArray,
    wear: FloatArray,
    young: IntArray,
    crossed: BoolArray,
    parts: FloatArray,
) -> None:
    """Fill which strips of the bodies are young, which an edge has crossed, and their parts.

    Young strips take steps of first order. Points of formulas of the state's order would lie ahead
    of the edge or close to it, until as many steps again have been taken. There the surfaces close
    as the power 3/2 of the distance from it, and higher orders would overshoot. After
    `FIRST_STEPS`, where edges are resolved, the rates at both ends of a step are weighted by
    `AT_START`.

    Both bodies of a contact wear by the same formula, so that their wear keeps its ratio. Where
    several rollers wear a cylinder, or several stations of a cam wear a roller, all of them take
    that of the youngest contact of the strip.

    Parameters
    ----------
    bodies, resolved
        As in `EdgeStrips`.
    part, whole_steps : ndarray, shape (contacts, strips)
        As in `WearState`.
    orders : ndarray of int, shape (realisations,)
        Orders of the steps.
    wear : ndarray, shape (bodies, realisations, strips)
        Wear per roller pass [m].
    young : ndarray of int, shape as `wear`
        Result: `OLD` in strips that follow the formula of the state's order, `WHOLE` in young ones
        after their first steps, `PARTIAL` in other young ones.
    crossed : ndarray of bool, shape as `wear`
        Result: strips that an edge is crossing or has crossed lately.
    parts : ndarray, shape as `wear`
        Result: greatest part in contact, 0 without wear; 1 in tests that do not resolve edges.
    """
    rows, realisations, n = wear.shape
    side = own_side(bodies)
    for v in range(realisations):
        for b in range(rows):
            for i in range(n):
                young[b, v, i], crossed[b, v, i] = OLD, False
                parts[b, v, i] = 0.0 if resolved[v] else 1.0
        for c in range(len(bodies) if resolved[v] else 0):
            k = c * realisations + v
            for i in range(n):
                formula = OLD
                if whole_steps[k, i] < YOUNG_STEPS * orders[v]:
                    formula = WHOLE if whole_steps[k, i] >= FIRST_STEPS else PARTIAL
                for b in bodies[c, : 2 if part[k, i] > 0.0 else 0]:
                    parts[b, v, i] = max(parts[b, v, i], part[k, i])
                    young[b, v, i] = max(young[b, v, i], formula)
                    crossed[b, v, i] = crossed[b, v, i] or whole_steps[k, i] < SETTLED
        for c in range(len(bodies) if resolved[v] else 0):
            own, shared = bodies[c, side], bodies[c, 1 - side]
            for i in range(n):
                if parts[own, v, i] > 0.0 and wear[shared, v, i] > 0.0:
                    young[own, v, i] = max(young[own, v, i], young[shared, v, i])
        for b in range(rows if resolved[v] else 0):
            for i in range(n):
                if not parts[b, v, i] > 0.0:
                    young[b, v, i] = PARTIAL
                parts[b, v, i] = parts[b, v, i] if wear[b, v, i] > 0.0 else 0.0
