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
formula l = l_0 + w then solves f(l) (l - l_0) = f w, where f w is the mean wear of the strip. Its
iteration begins at the extrapolated l; a strip that is loaded although the edge does not reach it
there continues from f = 1/2.

Strips that the edge has just crossed take steps of first order, see
`mechanics.numerics.young_strips`. Every contact wears its two bodies in a constant ratio. A body
that several contacts wear, as a cylinder under different rollers or the roller of a cam, therefore
wears by the sum of the depths of the other bodies, each times the ratio of its contact.

Where edges are not resolved, as under loads that vary, strips are in contact or not as wholes. Past
points of the depth of a strip that has just come into contact lie before the corner, so that it
takes steps of first order there too.
"""

from __future__ import annotations

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import sum_in_order
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.loads import with_feedback
from wearsim.evolution.steppers.single_step import carried_loads
from wearsim.mechanics.numerics.edge_strips import SETTLED
from wearsim.mechanics.numerics.jit import kernel_input
from wearsim.types import BoolArray, FloatArray

LEAST_LOAD = 0.2  # load of a spring over that of the unworn bodies
GROOVE = 4.0  # worn descent over the elastic approach from which edges are resolved
# part of a contact that adheres up to which edges are resolved, and from which they are not any
# more: where much of it adheres, wear is greatest at the edge, the line load is not uniform up to
# the layer in which it falls, and errors of the power add up
MOST_ADHESION, CEASING_ADHESION = 0.4, 0.5
# strips at an edge that a step may cross, and line load beyond them over the greatest of a roller
CROSSED, MOST_BEYOND = 4, 0.2
LEAST_CROSSED = 0.5  # strips that an edge crosses in a step which is shortened
#: fields of a state about the edges of contacts; not a number in tests that do not resolve them
FIELDS = "separation", "part", "whole_steps"


def resolves_edges(problem: WearProblem, contacts: ContactBatchSolution) -> bool:
    """Return whether steps resolve the edges of contacts within a strip once there is a groove.

    The contact model must return the separation, every contact must have its own body or station,
    and load and inputs must be constant: where they vary, an edge also retreats. The load of a
    spring falls, and wear advances the edge until the spring has almost no load, see
    `at_start_of_step`. The rise of the gap across a strip must be that of crowned bodies.
    """
    stations, contacts_each, _ = problem.shape
    varies = problem.varies or (stations == 1 and bool(problem.terms))
    apart = not problem.has_nodes and (stations == 1 or contacts_each == 1)
    return contacts.separation is not None and apart and not varies and problem.has_crowned_gap


def without_edges(problem: WearProblem, state: WearState) -> WearState:
    """Return a state of tests that do not resolve edges, but may later."""
    fields = dict.fromkeys(FIELDS, np.full((*problem.shape, problem.grid.strips), np.nan))
    sums = state.past.sums[..., 0]
    if state.part is None:
        sums = np.concatenate(
            [np.full((len(sums), len(state.stacked), len(state.passes)), np.nan), sums], axis=1
        )
    return state.replaced(**fields, past_sums=sums)


def with_whole_strips(problem: WearProblem, state: WearState) -> WearState:
    """Return a state that counts for how many steps each strip has been in contact as a whole."""
    loaded = state.contacts.line_load.reshape(*problem.shape, problem.grid.strips) > 0.0
    sums = np.concatenate([state.past.wear.sum(axis=-1), state.past.sums[..., 0]], axis=1)
    counts = np.where(loaded, SETTLED, 0.0)
    return state.replaced(separation=None, part=1.0 * loaded, whole_steps=counts, past_sums=sums)


def beyond_edges(start: WearState, end: WearState) -> BoolArray:
    """Return in which tests a roller has come to carry much load beyond its edges, (N,).

    Where the edge of a roller crosses much of a strip in a step, the strip protrudes until it is
    worn, and the solution may be one in which another roller wears it that is not close to it.
    """
    before, after = np.asarray(start.part), np.asarray(end.part)
    near = start.contacts.line_load.reshape(after.shape) > 0.0
    load = end.contacts.line_load.reshape(after.shape)
    for _ in range(CROSSED):
        near[..., 1:] |= near[..., :-1].copy()
        near[..., :-1] |= near[..., 1:].copy()
    beyond = np.where(near, 0.0, load).max(axis=-1) > MOST_BEYOND * load.max(axis=-1)
    crossed = np.where(near, np.maximum(after - before, 0.0), 0.0).sum(axis=-1)
    return np.asarray(beyond.any(axis=(0, 1)) & (crossed.max(axis=(0, 1)) > LEAST_CROSSED))


def unresolved(state: WearState) -> BoolArray:
    """Return which tests do not resolve edges, of a state with `FIELDS`."""
    assert state.part is not None
    whole: BoolArray = np.isnan(state.part[0, 0, :, 0])
    return whole


def at_start_of_step(problem: WearProblem, state: WearState) -> WearState:
    """Return a state in which tests have begun or ceased to resolve edges.

    They resolve them from the step on at whose start the bodies have worn to a groove: wear, not
    elasticity, then gives the contact its shape. They cease where a spring has lost its load, or
    where the contact adheres: it may have slipped for a moment, after strips have been joined.
    Where strips now reach the end of a roller, edges are never resolved any more. Tests that cease
    take a step of first order.
    """
    if state.separation is None:
        return state
    order = state.order
    assert order is not None
    if not problem.has_crowned_gap:
        return state.replaced(
            **dict.fromkeys(FIELDS),
            past_sums=kernel_input(state.past.sums[:, -1:, :, 0]),
            order=np.ones_like(order),
        )
    whole, ceases = unresolved(state), _adhesion(problem, state) > CEASING_ADHESION
    if problem.has_spring and problem.shape[0] == 1:
        free = with_feedback(problem, problem.force(problem.time(state.passes)), np.zeros(()), ())
        loads = carried_loads(problem, state.contacts)
        ceases |= (loads < LEAST_LOAD * free).any(axis=(0, 1))  # the spring is unloaded
    if not (whole != ceases).nonzero()[0].size:
        return state
    ended = ceases & ~whole
    if ended.nonzero()[0].size:
        fields = {n: np.where(ended[:, None], np.nan, getattr(state, n)) for n in FIELDS}
        state = state.replaced(**fields, order=np.where(ended, 1, order))
    begins = whole & ~ceases
    return _with_new_edges(problem, state, begins) if begins.nonzero()[0].size else state


def have_groove(problem: WearProblem, state: WearState) -> BoolArray:
    """Return which tests have worn to a groove, whose contacts slip."""
    least = np.minimum.reduce(problem.gap(*state.depths), axis=-1)
    worn = np.minimum.reduce(sum_in_order(least - problem.nominal_least_gap, 0))
    elastic = sum_in_order(state.contacts.approach.reshape(problem.shape) - least, 0)
    deep = worn >= GROOVE * np.maximum.reduce(elastic)
    return np.asarray(deep & (_adhesion(problem, state) <= MOST_ADHESION))


def _adhesion(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest part of a contact of each test that adheres, shape (realisations,)."""
    adhesion = state.contacts.adhesion_fraction.reshape(problem.shape)
    greatest: FloatArray = np.maximum.reduce(adhesion, axis=(0, 1))
    return greatest


def _with_new_edges(problem: WearProblem, state: WearState, whole: BoolArray) -> WearState:
    """Return a state in which tests that have worn to a groove resolve edges."""
    shape, begins = (*problem.shape, problem.grid.strips), whole & have_groove(problem, state)
    if not begins.nonzero()[0].size:
        return state
    separation = np.asarray(state.contacts.separation).reshape(shape)
    begins &= ~np.isnan(separation).any(axis=(0, 1, 3))
    if not np.count_nonzero(begins):
        return state
    loaded = state.contacts.line_load.reshape(shape) > 0.0
    started = {
        "separation": np.where(loaded, 0.0, separation),
        "part": np.where(loaded, 1.0, 0.0),
        "whole_steps": np.where(loaded, SETTLED, 0.0),
    }
    column, sums = begins[:, None], state.past.sums[..., 0].copy()
    fields = {n: np.where(column, values, getattr(state, n)) for n, values in started.items()}
    sums[:, :-1] = np.where(begins, state.past.wear.sum(axis=-1), sums[:, :-1])
    return state.replaced(**fields, past_sums=sums)
