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

FLAT = 1e-15  # least rise of a gap across a strip [m]


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
) -> tuple[FloatArray, FloatArray]:
    """Return `separation` and `part` of a state from its contacts."""
    loaded = problem.values_of(contacts, "line_load") > 0.0
    separation = np.where(loaded, 0.0, problem.values_of(contacts, "separation"))
    return separation, np.where(loaded, 1.0, 0.0)


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
    """

    bodies: IntArray
    gap: FloatArray
    base: FloatArray
    depth: FloatArray
    level: FloatArray
    first: FloatArray
    rise: FloatArray
    part: FloatArray

    @classmethod
    def of(cls, problem: WearProblem, state: WearState, base: FloatArray) -> Edges:
        """Return the strips of a step from a state; `base` is that of the bodies [m]."""
        assert state.separation is not None
        assert state.part is not None
        bodies = problem.body_rows
        depth = of_contacts(state.stacked, bodies)
        separation, part = state.separation.reshape(depth.shape), state.part.reshape(depth.shape)
        rise = _rises(separation, part)
        gap = np.broadcast_to(problem.nominal_gap, state.separation.shape).reshape(depth.shape)
        return cls(
            bodies,
            gap,
            of_contacts(base, bodies),
            depth,
            depth - separation,
            depth - 0.5 * rise * part**2,
            rise,
            part,
        )

    def parts(self, level: FloatArray) -> FloatArray:
        """Return f at a depth l."""
        part = np.clip(0.5 + (level - self.first) / self.rise, 0.0, 1.0)
        return np.where(self.part < 1.0, part, 1.0)

    def mean_wear(self, level: FloatArray, others: FloatArray) -> FloatArray:
        """Return f (l - l_0), the mean wear at a depth l that agrees with the formula [m].

        `others` is the mean wear of the same strips by other contacts, which l_0 leaves out.
        """
        return self.parts(level) * (level - self.base - others)

    def linearised(self, level: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return depth without any wear [m] and slope of the mean wear, both about a depth l.

        The slope is infinite where the strip is not in contact, and the depth then is l.
        """
        part, worn = self.parts(level), level - self.base - others
        inside = (part > 0.0) & (part < 1.0)
        slope = np.where(inside, part + np.maximum(worn, 0.0) / self.rise, part)
        apart = slope <= 0.0
        cut = level - np.divide(part * worn, slope, out=np.zeros_like(level), where=~apart)
        tangent = np.where(part < 1.0, cut - others, self.base)
        apart_at = np.maximum(level, self.depth)
        return np.where(apart, apart_at, tangent), np.where(apart, np.inf, slope)

    def by_others(self, wear: FloatArray) -> FloatArray:
        """Return the wear of each contact's bodies by other contacts, (contacts, strips) [m].

        Parameters
        ----------
        wear : ndarray, shape (2, contacts, strips)
            Contributions of the contacts to the wear of their bodies [m].
        """
        if len(self.bodies) == 1:
            return np.zeros(())
        each = wear.reshape(2, len(self.bodies), -1, wear.shape[-1])
        rows = np.zeros((self.bodies.max() + 1, *each.shape[2:]))
        for contact, both in enumerate(self.bodies.tolist()):
            for side, row in enumerate(both):
                rows[row] += each[side, contact]
        return of_contacts(rows, self.bodies) - wear.sum(axis=0)

    def growth(self, level: FloatArray, loaded: BoolArray) -> FloatArray:
        """Return the increase of the mean depth in the step, which ends at a depth l [m]."""
        part = self.parts(level)
        cut = 0.5 * self.rise * (part**2 - self.part**2)
        grown = np.where(part < 1.0, cut, level - self.depth)
        return np.where(loaded, np.maximum(grown, 0.0), 0.0)

    def separation(self, level: FloatArray, depth: FloatArray, part: FloatArray) -> FloatArray:
        """Return the mean separation at a depth l, a mean depth and a part f [m]."""
        cut = 0.5 * self.rise * (1.0 - part) ** 2
        return np.where(part > 0.0, cut, np.maximum(depth - level, 0.0))


def _rises(separation: FloatArray, part: FloatArray) -> FloatArray:
    """Return r of each strip from separation and f.

    Ahead of an edge the deformed surfaces of a strip touch at its inner end, or not yet.
    """
    ahead = np.full_like(separation, -np.inf)
    ahead[:, :-1] = separation[:, 1:]
    np.maximum(ahead[:, 1:], separation[:, :-1], out=ahead[:, 1:])
    apart = np.clip(ahead - separation, 0.0, 2.0 * separation)
    cut = np.divide(2.0 * separation, (1.0 - part) ** 2, out=np.ones_like(part), where=part < 1.0)
    return np.maximum(np.where(part > 0.0, cut, apart), FLAT)


def of_contacts(rows: FloatArray, bodies: IntArray) -> FloatArray:
    """Return the sum of both bodies of each contact, (contacts, strips), from rows of bodies."""
    both = rows[bodies[:, 0]] + rows[bodies[:, 1]]
    return both.reshape(-1, rows.shape[-1])
