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

from dataclasses import dataclass

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.types import BoolArray, FloatArray, IntArray

FLAT = 1e-12  # least rise of a gap across a strip, over the greatest gap


def resolves_edges(problem: WearProblem, contacts: ContactBatchSolution) -> bool:
    """Return whether steps resolve the edges of contacts within a strip.

    The contact model must return the separation, and every contact its own body or station.
    """
    stations, each, _ = problem.shape
    varies = problem.constant_load is None or len(problem.varying) > 0
    apart = not problem.has_nodes and (stations == 1 or each == 1)
    return contacts.separation is not None and apart and not varies


def starting_edges(
    problem: WearProblem, contacts: ContactBatchSolution
) -> tuple[FloatArray, BoolArray]:
    """Return `separation` and `whole` of a state from its contacts."""
    loaded = problem.values_of(contacts, "line_load") > 0.0
    separation = np.where(loaded, 0.0, problem.values_of(contacts, "separation"))
    return separation, loaded


def separated_bodies(state: WearState) -> FloatArray:
    """Return the separation of the contacts as parts of the bodies, as `WearState.stacked` [m].

    The sum of the two bodies of a contact is its separation.
    """
    separation, wear = state.separation, state.past_wear
    assert separation is not None
    assert wear is not None
    stations, contacts, realisations, strips = separation.shape
    parts = np.zeros((stations + state.roller_depth.shape[1], realisations, strips))
    parts[:stations] = separation.min(axis=1)
    if stations == 1:  # the remainder, and everything where the cylinder does not wear
        wears = wear[0, :stations].any(axis=(0, 2))
        parts[:stations] *= wears[:, None]
        parts[stations:] = separation[0] - parts[:stations]
    return parts


@dataclass(frozen=True)
class Edges:
    """The strips of all contacts in a step, with the quantities of the module's docstring.

    All arrays have the shape (contacts, strips), contact number c * realisations + v.

    Parameters
    ----------
    bodies : ndarray of int, shape (contacts each, 2)
        As `WearProblem.body_rows`.
    gap : ndarray
        Gap before wear [m].
    base : ndarray
        Depth l_0 of the formula [m].
    depth, level : ndarray
        Mean depth u and depth l at the start of the step [m].
    first : ndarray
        Depth u_0 [m].
    rise : ndarray
        Rise r of the gap across each strip [m].
    part : ndarray
        Part f at the start.
    whole : ndarray of bool
        Strips wholly in contact at the start, and so throughout the step unless they lose it.
    """

    bodies: IntArray
    gap: FloatArray
    base: FloatArray
    depth: FloatArray
    level: FloatArray
    first: FloatArray
    rise: FloatArray
    part: FloatArray
    whole: BoolArray

    @classmethod
    def of(cls, problem: WearProblem, state: WearState, base: FloatArray) -> Edges:
        """Return the strips of a step from a state; `base` is that of the bodies [m]."""
        bodies = problem.body_rows
        depth = of_contacts(state.stacked, bodies)
        shape = depth.shape
        separation = np.asarray(state.separation).reshape(shape)
        gap = np.broadcast_to(problem.nominal_gap, (*problem.shape, shape[-1])).reshape(shape)
        whole = np.asarray(state.whole).reshape(shape)
        slope = np.empty_like(gap)
        slope[:, 1:-1] = 0.5 * (gap[:, 2:] - gap[:, :-2])
        slope[:, 0], slope[:, -1] = gap[:, 1] - gap[:, 0], gap[:, -1] - gap[:, -2]
        least = FLAT * gap.max(axis=1, keepdims=True)
        rise = np.maximum(np.abs(slope), least)
        part = _part_of(separation, rise, whole)
        first = depth - 0.5 * rise * part**2
        # worn surfaces ahead of the edge
        change = np.diff(first, axis=1)
        outward = np.zeros_like(gap)
        outward[:, :-1] = np.where(slope[:, :-1] > 0.0, change, 0.0)
        outward[:, 1:] += np.where(slope[:, 1:] < 0.0, -change, 0.0)
        rise = np.maximum(rise + np.where(whole, 0.0, outward), least)
        part = _part_of(separation, rise, whole)
        first = depth - 0.5 * rise * part**2
        return cls(
            bodies,
            gap,
            of_contacts(base, bodies),
            depth,
            depth - separation,
            first,
            rise,
            part,
            whole,
        )

    def parts(self, level: FloatArray) -> FloatArray:
        """Return f at a depth l."""
        part = np.clip(0.5 + (level - self.first) / self.rise, 0.0, 1.0)
        return np.where(self.whole, 1.0, part)

    def mean_wear(self, level: FloatArray) -> FloatArray:
        """Return f (l - l_0), the mean wear at a depth l that agrees with the formula [m]."""
        part = self.parts(level)
        return np.where(part < 1.0, np.maximum(part * (level - self.base), 0.0), level - self.base)

    def linearised(self, level: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return gap without wear [m] and slope of the mean wear, both about a depth l."""
        part, worn = self.parts(level), np.maximum(level - self.base, 0.0)
        inside = (part > 0.0) & (part < 1.0)
        slope = np.where(inside, part + worn / self.rise, part)
        tangent = level - np.divide(part * worn, slope, out=np.zeros_like(level), where=slope > 0.0)
        tangent = np.where(part < 1.0, tangent, self.base)
        apart = slope <= 0.0
        gap = self.gap + np.where(apart, np.maximum(level, self.depth), tangent)
        return gap, np.where(apart, np.inf, slope)

    def growth(self, level: FloatArray, loaded: BoolArray) -> FloatArray:
        """Return the increase of the mean depth in the step, which ends at a depth l [m]."""
        part = self.parts(level)
        cut = 0.5 * self.rise * (part**2 - self.part**2)
        grown = np.where(part < 1.0, cut, level - self.depth)
        return np.where(loaded, np.maximum(grown, 0.0), 0.0)

    def separation(
        self, level: FloatArray, depth: FloatArray, loaded: BoolArray
    ) -> tuple[FloatArray, BoolArray]:
        """Return the mean separation at a depth l [m], and which strips are wholly in contact.

        Parameters
        ----------
        level, depth : ndarray
            Depth l and mean depth at the end of the step [m].
        loaded : ndarray of bool
            Strips with a load.
        """
        part = self.parts(level)
        whole = loaded & (part >= 1.0)
        cut = 0.5 * self.rise * (1.0 - part) ** 2
        apart = np.where(loaded & (part > 0.0), cut, np.maximum(depth - level, 0.0))
        return np.where(whole, 0.0, apart), whole


def _part_of(separation: FloatArray, rise: FloatArray, whole: BoolArray) -> FloatArray:
    """Return the part of each strip that is in contact from its mean separation."""
    part = np.maximum(1.0 - np.sqrt(2.0 * separation / rise), 0.0)
    return np.where(whole, 1.0, part)


def of_contacts(rows: FloatArray, bodies: IntArray) -> FloatArray:
    """Return the sum of both bodies of each contact, (contacts, strips), from rows of bodies."""
    both = rows[bodies[:, 0]] + rows[bodies[:, 1]]
    return both.reshape(-1, rows.shape[-1])
