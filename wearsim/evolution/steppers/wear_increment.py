"""Wear of the bodies in one step, and its compliance under the contacts."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.problem import WearProblem
from wearsim.mechanics.numerics.wear_exponent import estimate_exponents, ratio_to_load
from wearsim.plugins import SharedWear
from wearsim.types import FloatArray

MAX_LINEAR_EXPONENT = 1.0  # of dissipation as a power of line load; 1 in full sliding
MAX_EXPONENT = 50.0  # T gamma's wear law goes as the power 44 where catastrophic wear begins


class WearIncrement:
    """Depth worn off the bodies in a step of `passes` passes with given contacts.

    The wear u of each strip is linearised about the contact's line load q_0:
    u = (1 - e) u_0 + e (u_0/q_0) q, with the exponent e of u ~ q^e. The second term is a
    compliance, the first an offset independent of the line load.

    Parameters
    ----------
    problem : WearProblem
    contacts : ContactBatchSolution
    passes : float or ndarray, shape (realisations,)
        Length of the step.

    Attributes
    ----------
    depths : tuple of ndarray
        Depths of cylinder and rollers worn in the step, shapes as in `WearState` [m].
    cylinder, roller : ndarray
        The two depths.
    exponents : ndarray, shape (stations, contacts, realisations, strips), optional
        Exponent e of every strip, to be set before the first use of compliance or offset. If
        absent it is 1, which is exact in full sliding.
    """

    def __init__(
        self, problem: WearProblem, contacts: ContactBatchSolution, passes: FloatArray | float
    ) -> None:
        self._parts = problem.wear_parts(contacts, passes)
        self.depths = problem.sum_of_parts(*self._parts)
        self.cylinder, self.roller = self.depths
        self.exponents: FloatArray | None = None
        self.problem, self.contacts = problem, contacts

    @cached_property
    def compliance(self) -> SharedWear:
        """Wear compliance of the step, per realisation; contacts in the problem's order."""
        parts = self._parts
        if self.exponents is not None:
            parts = self.exponents * parts[0], self.exponents * parts[1]
        stations, contacts, realisations = self.problem.shape
        shape = realisations, stations * contacts, self.problem.grid.strips
        compliance = np.zeros((*shape[:2], 2, shape[2]))
        line_load = self.contacts.line_load
        for side, part in enumerate(parts):
            if np.count_nonzero(part):
                wear = np.ascontiguousarray(part).reshape(line_load.shape)
                ratio = ratio_to_load(wear, line_load).reshape(part.shape)
                compliance[:, :, side] = ratio.transpose(2, 0, 1, 3).reshape(shape)
        return SharedWear(self.problem.bodies, compliance)

    @cached_property
    def offset(self) -> FloatArray | float:
        """Opening independent of the line load, (stations, contacts, realisations, strips) [m]."""
        if self.exponents is None:
            return 0.0
        constant = 1.0 - self.exponents
        cylinder, roller = self.problem.sum_of_parts(*(constant * part for part in self._parts))
        return cylinder + self.problem.at_contacts(roller)

    @property
    def opening(self) -> FloatArray:
        """Gap that the step opens, shape (stations, contacts, realisations, strips) [m]."""
        return self.cylinder + self.problem.at_contacts(self.roller)

    def predicted_opening(self, line_load: FloatArray) -> FloatArray:
        """Return the opening of the linearised wear at a line load, shape as `opening` [m]."""
        stations, contacts, realisations, strips = line_load.shape
        flat = line_load.transpose(2, 0, 1, 3).reshape(realisations, -1, strips)
        opening = self.compliance.opening(flat)
        opening = opening.reshape(realisations, stations, contacts, strips).transpose(1, 2, 0, 3)
        return opening if self.exponents is None else opening + self.offset

    def estimate_exponents(self, old: WearIncrement) -> None:
        """Set the exponents from the changes of wear and line load since another increment.

        Strips without a change keep the exponent of the other increment, or 1.

        Parameters
        ----------
        old : WearIncrement
            Wear of another solution of the same contacts.
        """
        problem = self.problem
        if old.exponents is None:
            self.exponents = np.ones((*problem.shape, problem.grid.strips))
        else:
            self.exponents = old.exponents.copy()
        load, new_load = old.contacts.line_load, self.contacts.line_load
        linear = problem.wear_factors["cylinder"] is not None
        estimate_exponents(
            load,
            new_load,
            (old._parts[0] + old._parts[1]).reshape(load.shape),
            (self._parts[0] + self._parts[1]).reshape(load.shape),
            MAX_LINEAR_EXPONENT if linear else MAX_EXPONENT,
            self.exponents.reshape(load.shape),
        )
