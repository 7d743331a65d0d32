"""Strips at the edge of a contact, which grows across them.

Where a groove grows, a strip comes into contact little by little: the edge of the contact crosses
it in several steps. Ahead of the edge the surfaces are apart, and behind it they touch. With the
mean depth u that both bodies have lost in a strip, and the mean separation s of the deformed
surfaces in it, u - s is smooth in time before, while and after the strip comes into contact. The
depth alone has a corner there, at which a multistep formula would give a wrong rate of wear, and
thus a wrong pressure. The formulas are therefore applied to u - s.

Across a strip of width dy the gap of the surfaces that have not touched rises by r. If the edge has
crossed the part f of the strip, the surfaces are in contact at the depth

    l = u_0 + (f - 1/2) r,   and   u = u_0 + r f^2 / 2,   s = r (1 - f)^2 / 2,

where u_0 is the depth when the edge reached the strip: l = u - s, and du = f dl. A step with the
formula l = l_0 + w then solves f(l) (l - l_0) = f w, where f w is the mean wear of the strip.

Where edges are not resolved, as under loads that vary, strips are in contact or not as wholes. Past
points of the depth of a strip that has just come into contact lie before the corner, so that it
takes steps of first order there too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import sum_in_order
from wearsim.evolution.state import WearState, separated
from wearsim.evolution.steppers.loads import with_feedback
from wearsim.evolution.steppers.single_step import carried_loads
from wearsim.mechanics.numerics.edge_strips import (
    SETTLED,
    EdgeStrips,
    mark_strips,
    start_edges,
)
from wearsim.mechanics.numerics.jit import kernel_input
from wearsim.mechanics.numerics.multistep import MAX_ORDER, next_steps
from wearsim.types import BoolArray, FloatArray, IntArray

# greatest order where edges are resolved within a strip: beyond the first derivative the wear of
# strips that the edge has just crossed is not smooth, and pressures would overshoot
EDGE_ORDER = 3
YOUNG_STEPS = 2.0  # steps for which a strip is young, over the order
YOUNG = 0.2  # part of the difference in young strips that counts as error of a step
LEAST_LOAD = 0.2  # load of a spring over that of the unworn bodies
GROOVE = 4.0  # worn descent over the elastic approach from which edges are resolved
# part of a contact that adheres up to which edges are resolved: where most of it adheres, wear is
# greatest at the edge, and the line load is not uniform up to the layer in which it falls
MOST_ADHESION = 0.5
#: fields of a state about the edges of contacts; not a number in tests that do not resolve them
FIELDS = "separation", "part", "whole_steps"


def resolves_edges(problem: WearProblem, contacts: ContactBatchSolution) -> bool:
    """Return whether steps resolve the edges of contacts within a strip once there is a groove.

    The contact model must return the separation, every contact must have its own body or station,
    and load and inputs must be constant: where they vary, an edge also retreats. The load of a
    spring falls, and wear advances the edge until the spring has almost no load, see `_unloaded`.
    The rise of the gap across a strip must be that of crowned bodies.
    """
    stations, each, _ = problem.shape
    varies = problem.constant_load is None or len(problem.varying) > 0
    varies |= stations == 1 and bool(problem.terms)
    apart = not problem.has_nodes and (stations == 1 or each == 1)
    possible = contacts.separation is not None and apart and not varies
    return possible and problem.has_crowned_gap


def unresolved_edges(problem: WearProblem) -> dict[str, FloatArray]:
    """Return `FIELDS` of a state that does not resolve edges yet."""
    return dict.fromkeys(FIELDS, np.full((*problem.shape, problem.grid.strips), np.nan))


def without_edges(state: WearState) -> WearState:
    """Return a state that steps advance on whole strips."""
    assert state.past_sums is not None
    sums = kernel_input(state.past_sums[:, -1:])
    return state.replaced(**dict.fromkeys(FIELDS), past_sums=sums)


def with_whole_strips(problem: WearProblem, state: WearState) -> WearState:
    """Return a state that counts for how many steps each strip has been in contact as a whole."""
    assert state.past_sums is not None
    assert state.past_wear is not None
    loaded = state.contacts.line_load.reshape(*problem.shape, problem.grid.strips) > 0.0
    sums = np.concatenate([over_strips(state.past_wear), state.past_sums[:, -1:]], axis=1)
    counts = np.where(loaded, SETTLED, 0.0)
    return state.replaced(separation=None, part=1.0 * loaded, whole_steps=counts, past_sums=sums)


def count_whole_strips(
    problem: WearProblem, start: WearState, end: WearState
) -> tuple[WearState, FloatArray]:
    """Return the end of a step of `with_whole_strips`, and `Solved.parts`."""
    assert start.whole_steps is not None
    rows, parts = problem.body_rows, np.zeros_like(end.stacked)
    loaded = 1.0 * (end.contacts.line_load.reshape(start.whole_steps.shape) > 0.0)
    each = loaded.reshape(len(rows), *parts.shape[1:])
    for side in (0, 1):
        np.maximum.at(parts, rows[:, side], each)
    counts = loaded * np.minimum(start.whole_steps + 1.0, SETTLED)
    return end.replaced(part=loaded, whole_steps=counts), parts


def on_strips(problem: WearProblem, state: WearState) -> WearState:
    """Return a state without edges, of first order, where strips now reach the end of a roller."""
    if state.separation is None or problem.has_crowned_gap:
        return state
    assert state.order is not None
    return without_edges(state).replaced(order=np.ones_like(state.order))


def with_unresolved_edges(problem: WearProblem, state: WearState) -> WearState:
    """Return the result of a step on whole strips with the fields of other tests."""
    assert state.past_sums is not None
    bodies = np.full((len(state.past_sums), len(state.stacked), len(state.passes)), np.nan)
    sums = np.concatenate([bodies, state.past_sums], axis=1)
    return state.replaced(**unresolved_edges(problem), past_sums=sums)


def unresolved(state: WearState) -> BoolArray:
    """Return which tests do not resolve edges, of a state with `FIELDS`."""
    assert state.part is not None
    return np.asarray(np.isnan(state.part[0, 0, :, 0]))


def by_resolution(
    problem: WearProblem, state: WearState
) -> list[tuple[IntArray, WearProblem, WearState]]:
    """Return the places of tests that resolve edges and of those that do not, with their states.

    Edges are resolved from the step on at whose start the bodies have worn to a groove: wear, not
    elasticity, then gives the contact its shape.
    """
    every = np.arange(len(state.passes))
    if state.part is None:
        return [(every, problem, state)]
    whole, low = unresolved(state), _unloaded(problem, state)
    if (low & ~whole).any():
        assert state.order is not None
        fields = unresolved_edges(problem)
        ended = {n: np.where(low[:, None], one, getattr(state, n)) for n, one in fields.items()}
        state = state.replaced(**ended, order=np.where(low & ~whole, 1, state.order))
        whole = unresolved(state)
    if (whole & ~low).any():
        state = _with_new_edges(problem, state, whole & ~low)
        whole = unresolved(state)
    parts = []
    if not whole.any():
        return [(every, problem, state)]
    for kind in (False, True):
        places = np.flatnonzero(whole == kind)
        if places.size:
            part = state.at(places)
            parts.append((places, problem.at(places), without_edges(part) if kind else part))
    return parts


def _unloaded(problem: WearProblem, state: WearState) -> BoolArray:
    """Return which tests have a roller whose spring has lost most of its load."""
    if not problem.has_spring or problem.shape[0] > 1:
        return np.zeros(len(state.passes), dtype=np.bool_)
    force = problem.force(problem.time(state.passes))
    free = with_feedback(problem, force, np.zeros(()), ())
    return np.asarray((carried_loads(problem, state.contacts) < LEAST_LOAD * free).any(axis=(0, 1)))


def have_groove(problem: WearProblem, state: WearState) -> BoolArray:
    """Return which tests have worn to a groove, whose contacts slip."""
    least = problem.gap(*state.depths).min(axis=-1)
    worn, elastic = (
        least - problem.nominal_least_gap,
        problem.values_of(state.contacts, "approach") - least,
    )
    adhering = problem.values_of(state.contacts, "adhesion_fraction").max(axis=(0, 1))
    deep = sum_in_order(worn, 0).min(axis=0) >= GROOVE * sum_in_order(elastic, 0).max(axis=0)
    return np.asarray(deep & (adhering <= MOST_ADHESION))


def _with_new_edges(problem: WearProblem, state: WearState, whole: BoolArray) -> WearState:
    """Return a state in which tests that have worn to a groove resolve edges."""
    shape = (*problem.shape, problem.grid.strips)
    assert state.contacts.separation is not None
    assert state.past_sums is not None
    assert state.past_wear is not None
    separation = state.contacts.separation.reshape(shape)
    begins = whole & ~np.isnan(separation).any(axis=(0, 1, 3)) & have_groove(problem, state)
    if not begins.any():
        return state
    loaded = state.contacts.line_load.reshape(shape) > 0.0
    found = {
        "separation": np.where(loaded, 0.0, separation),
        "part": np.where(loaded, 1.0, 0.0),
        "whole_steps": np.where(loaded, SETTLED, 0.0),
    }
    column, sums = begins[:, None], state.past_sums.copy()
    fields = {n: np.where(column, one, getattr(state, n)) for n, one in found.items()}
    sums[:, :-1] = np.where(begins, over_strips(state.past_wear), sums[:, :-1])
    return state.replaced(**fields, past_sums=sums)


def separated_bodies(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the separation of the contacts as parts of the bodies, as `WearState.stacked` [m].

    The sum of the two bodies of a contact is its separation, which their wear closes together.
    """
    separation = state.separation
    assert separation is not None
    stations, _, realisations, strips = separation.shape
    parts = np.zeros((stations + problem.rollers, realisations, strips))
    parts[:stations] = separation.min(axis=1)
    if stations == 1:
        parts[0] *= problem.cylinder_wear_share
        parts[1:] = separation[0] - parts[0]
    return parts


def edges_of_step(
    problem: WearProblem, state: WearState, base: FloatArray, added: FloatArray
) -> EdgeStrips | None:
    """Return the strips of all contacts at the start of a step, None if its state has no edges.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    base, added : ndarray
        Depths l_0 of the formula, and their increase without the wear at the end, of the bodies as
        in `WearState.stacked` [m].
    """
    if state.separation is None or state.part is None or state.whole_steps is None:
        return None
    strips = problem.grid.strips
    gap = np.broadcast_to(problem.nominal_gap, state.separation.shape)
    arrays = (gap, state.part, state.separation, state.whole_steps)
    gap, part, separation, whole_steps = (
        kernel_input(array).reshape(-1, strips) for array in arrays
    )
    rows = state.stacked
    edges = EdgeStrips(
        problem.body_rows,
        gap,
        kernel_input(state.contacts.approach),
        rows,
        added,
        base,
        part,
        separation,
        whole_steps,
        np.empty_like(gap),
        np.empty_like(gap),
        np.empty_like(rows),
    )
    start_edges(edges)
    return edges


def most(state: WearState) -> int:
    """Return the greatest order of steps from a state."""
    return MAX_ORDER if state.separation is None else EDGE_ORDER


class MarkedStrips(NamedTuple):
    """Strips of the bodies about the edges of their contacts, each an array as `WearState.stacked`.

    Parameters
    ----------
    young : ndarray of bool
        Strips that take steps of first order. Points of formulas of the state's order would lie
        ahead of the edge or close to it, until as many steps again have been taken. There the
        surfaces close as the power 3/2 of the distance from it, and higher orders would overshoot.
        A worn roller of a cam meets the edges at all stations at different times. Its wear by one
        of them has no past points, and both bodies of a contact must wear by the same formula: no
        strip is young then.
    crossed : ndarray of bool
        Strips that an edge is crossing or has crossed lately.
    parts : ndarray
        Greatest part in contact, 0 without wear.
    """

    young: BoolArray
    crossed: BoolArray
    parts: FloatArray

    @property
    def weights(self) -> FloatArray:
        """Part of each strip's error that counts.

        The formulas also continue the separation of strips that are not in contact. Young strips
        are not smooth enough for an estimate, which is too great, see `first_order_errors`.
        """
        return np.where(self.young, YOUNG * self.parts, self.parts)


def marked_strips(problem: WearProblem, state: WearState) -> MarkedStrips | None:
    """Return the strips of a state about the edges; None where there is no groove."""
    if state.whole_steps is None or state.part is None or state.past_wear is None:
        return None
    assert state.order is not None
    in_groove = None
    if state.separation is None:  # edges are not resolved
        in_groove = have_groove(problem, state)
        if not in_groove.any():
            return None
    wear = kernel_input(state.past_wear[0])
    young, crossed = np.empty((2, *wear.shape), dtype=np.bool_)
    marked = MarkedStrips(young, crossed, np.empty_like(wear))
    steps = (YOUNG_STEPS * state.order).astype(np.float64)
    mark_strips(kernel_input(state.part), kernel_input(state.whole_steps), steps, wear, *marked)
    if in_groove is not None:
        np.logical_and(young, in_groove[:, None], out=young)
    return marked


def with_sum(end: WearState, errors: FloatArray, marked: MarkedStrips) -> FloatArray:
    """Return errors of the depths that a step adds, which agree with those of their sums.

    `with_volume` keeps the sums.
    """
    past, spans, orders = end.past_sums, end.past_spans, end.order
    assert past is not None
    assert spans is not None
    assert orders is not None
    parts = np.where(marked.crossed, 0.0, marked.weights)
    errors = np.where(marked.crossed, 0.0, errors)
    sums = kernel_input(past[:, :-1, :, None])
    ones, of_sums, order = np.ones(sums.shape[1:]), np.empty(sums.shape[1:]), orders.copy()
    scale = np.ones(len(orders))
    next_steps(sums, spans, ones, orders, scale, 1.0, 1.0, 1, ones, of_sums, order)
    missing, width = of_sums - over_strips(errors)[..., None], over_strips(parts)[..., None]
    shift = np.divide(missing, width, out=np.zeros_like(width), where=width > 0.0)
    return np.asarray(errors + parts * shift)


def over_strips(values: FloatArray) -> FloatArray:
    """Return sums over the last axis, with the same round-off for any layout in memory."""
    return np.asarray(kernel_input(values).sum(axis=-1))


def relative_size(errors: FloatArray, depths: FloatArray) -> FloatArray:
    """Return the Euclidean norm of errors of all depths over that of the depths, shape (N,)."""
    size, whole = (sum_in_order(over_strips(values**2), 0) for values in (errors, depths))
    return np.asarray(np.sqrt(size / np.where(whole > 0.0, whole, np.inf)))


def first_order_errors(end: WearState, young: BoolArray) -> FloatArray:
    """Return the errors that a step adds to young strips in contact, as `WearState.stacked` [m]."""
    past, spans = end.past_wear, end.past_spans
    assert past is not None
    assert spans is not None
    factor = spans[0] / (1.0 / spans[0] + 1.0 / spans[1])
    factor = np.where(np.isfinite(spans[1]), factor, 0.0)
    return np.where(young & (past[0] > 0.0), factor[:, None] * past[2], 0.0)


def with_volume(end: WearState, parts: FloatArray, missing: FloatArray) -> WearState:
    """Return the end of a step with the volume that the formula gives.

    The depths of strips partly in contact follow from their shape, which keeps no volume. What is
    missing is added evenly where the bodies are in contact, which changes no pressure.

    Parameters
    ----------
    end : WearState
    parts : ndarray
        Part of each strip that is in contact, as `WearState.stacked`.
    missing : ndarray, shape (stations + rollers, realisations)
        Sum over the strips of the depths to be added [m].
    """
    width = over_strips(parts)
    added = np.divide(missing, width, out=np.zeros_like(missing), where=width > 0.0)
    cylinder, roller = separated(end.stacked + added[..., None] * parts, len(end.cylinder_depth))
    return end.replaced(cylinder_depth=cylinder, roller_depth=roller)


def sums_per_pass(wear: FloatArray | None, energy: FloatArray) -> FloatArray:
    """Return row 0 of `WearState.past_sums` as (sums, N, 1), from wear and energy per pass."""
    sums = energy[None] if wear is None else np.concatenate([over_strips(wear), energy[None]])
    return np.asarray(sums[..., None])
