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
"""

from __future__ import annotations

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.mechanics.numerics.edge_strips import SETTLED, EdgeStrips, start_edges
from wearsim.mechanics.numerics.jit import kernel_input
from wearsim.types import FloatArray


def resolves_edges(problem: WearProblem, contacts: ContactBatchSolution) -> bool:
    """Return whether steps resolve the edges of contacts within a strip.

    The contact model must return the separation, and every contact its own body or station.
    """
    stations, each, _ = problem.shape
    varies = problem.constant_load is None or len(problem.varying) > 0
    apart = not problem.has_nodes and (stations == 1 or each == 1)
    wanted = problem.resolve_edges and contacts.separation is not None
    return wanted and apart and not varies


def starting_edges(problem: WearProblem, contacts: ContactBatchSolution) -> dict[str, FloatArray]:
    """Return `separation`, `part` and `whole_steps` of a state from its contacts."""
    loaded = problem.values_of(contacts, "line_load") > 0.0
    return {
        "separation": np.where(loaded, 0.0, problem.values_of(contacts, "separation")),
        "part": np.where(loaded, 1.0, 0.0),
        "whole_steps": np.where(loaded, SETTLED, 0.0),
    }


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
