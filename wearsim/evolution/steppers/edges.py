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
from typing import NamedTuple

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.single_step import REALISATION
from wearsim.mechanics.numerics.multistep import ROWS
from wearsim.types import BoolArray, FloatArray, IntArray

SETTLED = float(ROWS)  # steps after which all points of a formula lie in contact
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
) -> dict[str, FloatArray]:
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
        parts[0] *= _cylinder_share(problem)[:, None]
        parts[1:] = separation[0] - parts[0]
    return parts


def _cylinder_share(problem: WearProblem) -> FloatArray:
    """Return the part of the wear of a contact with a cylinder that is the cylinder's, (N,)."""
    if not problem.linear_wear:
        return np.full(problem.shape[REALISATION], 0.5)
    factors, shares = problem.wear_factors, problem.wear_shares
    cylinder, rollers = (
        shares[body].sum() * np.asarray(factors[body]) for body in ("cylinder", "roller")
    )
    return cylinder / np.maximum(cylinder + rollers / problem.rollers, np.finfo(float).tiny)


class Others(NamedTuple):
    """Wear of the strips of each contact by the other contacts of its bodies.

    Parameters
    ----------
    wear : ndarray, shape (contacts, strips)
        Wear at the end of the step, which l_0 leaves out [m].
    growth : ndarray
        Increase of the depth in the step [m].
    """

    wear: FloatArray
    growth: FloatArray


ALONE = Others(np.zeros(()), np.zeros(()))


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
    before : ndarray, shape (stations + rollers, realisations, strips)
        Increase of the depths in the step without the wear at its end [m].
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
    settled : ndarray of bool
        Strips in which all points of the formula lie in contact.
    """

    bodies: IntArray
    gap: FloatArray
    before: FloatArray
    base: FloatArray
    depth: FloatArray
    level: FloatArray
    first: FloatArray
    rise: FloatArray
    part: FloatArray
    settled: BoolArray

    @classmethod
    def of(cls, problem: WearProblem, state: WearState, base: FloatArray) -> Edges:
        """Return the strips of a step from a state; `base` is that of the bodies [m]."""
        assert state.separation is not None
        assert state.part is not None
        assert state.whole_steps is not None
        bodies = problem.body_rows
        depth = of_contacts(state.stacked, bodies)
        separation, part = state.separation.reshape(depth.shape), state.part.reshape(depth.shape)
        rise = _rises(separation, part)
        gap = np.broadcast_to(problem.nominal_gap, state.separation.shape).reshape(depth.shape)
        return cls(
            bodies,
            gap,
            base - state.stacked + separated_bodies(problem, state),
            of_contacts(base, bodies),
            depth,
            depth - separation,
            depth - 0.5 * rise * part**2,
            rise,
            part,
            state.whole_steps.reshape(depth.shape) >= SETTLED,
        )

    def parts(self, level: FloatArray, others: Others) -> FloatArray:
        """Return f at a depth l."""
        part = np.clip(0.5 + (level - self.first - others.growth) / self.rise, 0.0, 1.0)
        return np.where(self.part < 1.0, part, 1.0)

    def mean_wear(self, level: FloatArray, others: Others) -> FloatArray:
        """Return f (l - l_0), the mean wear at a depth l that agrees with the formula [m]."""
        return self.parts(level, others) * (level - self.base - others.wear)

    def linearised(self, level: FloatArray, others: Others) -> tuple[FloatArray, FloatArray]:
        """Return depth without any wear [m] and slope of the mean wear, both about a depth l.

        The slope is infinite where the strip is not in contact, and the depth then is l.
        """
        part, worn = self.parts(level, others), level - self.base - others.wear
        inside = (part > 0.0) & (part < 1.0)
        slope = np.where(inside, part + np.maximum(worn, 0.0) / self.rise, part)
        apart = slope <= 0.0
        cut = level - np.divide(part * worn, slope, out=np.zeros_like(level), where=~apart)
        tangent = np.where(part < 1.0, cut - others.wear, self.base)
        apart_at = np.maximum(level, self.depth)
        return np.where(apart, apart_at, tangent), np.where(apart, np.inf, slope)

    def by_others(self, wear: FloatArray) -> Others:
        """Return the wear of each contact's bodies by other contacts.

        Parameters
        ----------
        wear : ndarray, shape (2, contacts, strips)
            Contributions of the contacts to the wear of their bodies [m].
        """
        if len(self.bodies) == 1:
            return ALONE
        each = wear.reshape(2, len(self.bodies), -1, wear.shape[-1])
        rows, found = np.zeros_like(self.before), np.zeros((2, *each.shape[1:]))
        for contact, both in enumerate(self.bodies.tolist()):
            for side, row in enumerate(both):
                rows[row] += each[side, contact]
        for contact, both in enumerate(self.bodies.tolist()):
            for side, row in enumerate(both):
                of_others = rows[row] - each[side, contact]
                found[0, contact] += of_others
                share = np.divide(
                    of_others, rows[row], out=np.zeros_like(of_others), where=rows[row] > 0.0
                )
                found[1, contact] += share * (self.before[row] + rows[row])
        return Others(*found.reshape(2, *wear.shape[1:]))

    def growth(self, level: FloatArray, others: Others, loaded: BoolArray) -> FloatArray:
        """Return what each contact wears in the step, which ends at a depth l [m]."""
        part = self.parts(level, others)
        cut = 0.5 * self.rise * (part**2 - self.part**2)
        grown = np.where(part < 1.0, cut, level - self.depth - others.growth)
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
