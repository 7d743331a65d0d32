"""What the wear of one step does to the bodies, and how it yields under the contacts."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from wearsim.contact_batch import rows_of
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Contacts
from wearsim.mechanics.numerics.wear_exponent import estimate_exponents, ratio_to_load
from wearsim.plugins import SharedWear
from wearsim.types import FloatArray, Number

SLIDING = 1.0  # exponent of dissipation in full sliding, the greatest there is
STEEPEST = 50.0  # where catastrophic wear begins, T gamma's law goes as the power 44


class WearIncrement:
    """What a step of `passes` passes with given contacts wears off the bodies.

    Near the contacts' line loads the wear of each strip is taken as linear in its line load:
    u = (1 - e) u_0 + e (u_0/q_0) q, with the exponent e of u ~ q^e. The second term is a
    compliance, the first a wear that does not yield.

    Parameters
    ----------
    problem : WearProblem
    contacts : sequence of ContactSolution
    passes : float or ndarray, shape (realisations,)
        Length of the step.

    Attributes
    ----------
    cylinder, roller : ndarray
        Depth the step adds, shapes as in `WearState` [m].
    exponents : ndarray, shape (stations, contacts, realisations, strips), optional
        e of every strip, to be set before compliance or offset are first asked for; 1 where left
        out, which full sliding makes exact.
    """

    def __init__(self, problem: WearProblem, contacts: Contacts, passes: Number) -> None:
        self._parts = problem.wear_parts(contacts, passes)
        self.cylinder, self.roller = problem.sum_of_parts(*self._parts)
        self.exponents: FloatArray | None = None
        self.problem, self.contacts = problem, contacts

    @property
    def per_contact(self) -> FloatArray:
        """Depth that each contact wears off both bodies, shape (contacts, strips) [m]."""
        worn: FloatArray = (self._parts[0] + self._parts[1]).reshape(len(self.contacts), -1)
        return worn

    @cached_property
    def compliance(self) -> SharedWear:
        """How the step's wear yields, realisation by realisation; contacts as in the problem."""
        parts = self._parts
        if self.exponents is not None:
            parts = self.exponents * parts[0], self.exponents * parts[1]
        stations, contacts, realisations = self.problem.shape
        strips, together = self.problem.grid.strips, stations * contacts
        each = np.zeros((realisations, together, 2, strips))
        line_load = rows_of(self.contacts, "line_load")
        for side, part in enumerate(parts):
            if not np.count_nonzero(part):
                continue
            ratio = _ratio(part, line_load).transpose(2, 0, 1, 3)
            each[:, :, side] = ratio.reshape(realisations, together, strips)
        return SharedWear(self.problem.bodies, each)

    @cached_property
    def offset(self) -> FloatArray | float:
        """Gap that opens whatever the line load, (stations, contacts, realisations, strips) [m]."""
        if self.exponents is None:
            return 0.0
        kept = 1.0 - self.exponents
        return self._opening(*self.problem.sum_of_parts(*(kept * part for part in self._parts)))

    @property
    def opening(self) -> FloatArray:
        """Gap that the step opens at every contact, (stations, contacts, realisations, strips)."""
        return self._opening(self.cylinder, self.roller)

    def _opening(self, cylinder: FloatArray, roller: FloatArray) -> FloatArray:
        return cylinder + self.problem.at_contacts(roller)

    def foreseen(self, line_load: FloatArray) -> FloatArray:
        """Return the opening that compliance and offset make of a line load, shape as `opening`."""
        stations, contacts, realisations, strips = line_load.shape
        flat = line_load.transpose(2, 0, 1, 3).reshape(realisations, -1, strips)
        yielding = self.compliance.opening(flat)
        shaped = yielding.reshape(realisations, stations, contacts, strips)
        opening = shaped.transpose(1, 2, 0, 3)
        return opening if self.exponents is None else opening + self.offset


def _ratio(wear: FloatArray, line_load: FloatArray) -> FloatArray:
    """Return wear over line load, carried on into strips without load, last axis strips."""
    flat = np.ascontiguousarray(wear).reshape(line_load.shape)
    return ratio_to_load(flat, line_load).reshape(wear.shape)


def exponents_between(old: WearIncrement, new: WearIncrement) -> FloatArray:
    """Return the exponents with which wear followed the line load from `old` to `new`.

    Parameters
    ----------
    old, new : WearIncrement
        The wear of two solutions of the same contacts.

    Returns
    -------
    ndarray, shape (stations, contacts, realisations, strips)
        Where a strip tells nothing that of `old`, or 1.
    """
    problem, known = old.problem, old.exponents
    exponents = np.ones((*problem.shape, problem.grid.strips)) if known is None else known.copy()
    linear = problem.wear_factors["cylinder"]
    estimate_exponents(
        rows_of(old.contacts, "line_load"),
        rows_of(new.contacts, "line_load"),
        old.per_contact,
        new.per_contact,
        SLIDING if linear is not None else STEEPEST,
        exponents.reshape(len(new.contacts), -1),
    )
    return exponents
