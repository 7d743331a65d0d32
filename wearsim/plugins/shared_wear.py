"""How the contacts of an implicit step wear the bodies that they share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from wearsim.types import FloatArray, IntArray

NO_BODY = -1


@dataclass(frozen=True)
class SharedWear:
    """The wear compliance of several contacts, body by body.

    A contact touches two bodies, and whatever any contact wears off a body opens the gap of all
    that touch it. Contact k meets the gap

        gap[k] + sum over its bodies b of sum_l compliance[l, side of b] * line_load[l],

    the inner sum running over the contacts that touch b.

    Parameters
    ----------
    bodies : ndarray of int, shape (contacts, 2)
        Number of the cylinder's station, and of the roller, that each contact touches; either
        column counts by itself.
    compliance : ndarray, shape (contacts, 2, strips)
        Depth that a contact wears off either body per unit of its line load [m/(N/m)].
    """

    bodies: IntArray
    compliance: FloatArray

    @classmethod
    def of_one(cls, compliance: FloatArray) -> SharedWear:
        """Return the wear of a single contact that opens its gap by `compliance`, (strips,)."""
        both = np.stack([compliance, np.zeros_like(compliance)])
        return cls(np.zeros((1, 2), dtype=np.int64), both[None])

    @property
    def total(self) -> FloatArray:
        """Gap that a contact opens for itself per unit of its line load, (contacts, strips)."""
        own: FloatArray = self.compliance.sum(axis=1)
        return own

    def opening(self, line_load: FloatArray) -> FloatArray:
        """Return the gap that line loads, (contacts, strips), open at every contact [m]."""
        gap = np.zeros_like(line_load)
        for side in (0, 1):
            numbers = self.bodies[:, side]
            depth = np.zeros((int(numbers.max()) + 1, line_load.shape[1]))
            np.add.at(depth, numbers, self.compliance[:, side] * line_load)
            gap += depth[numbers]
        return gap

    @cached_property
    def reduced(self) -> tuple[FloatArray, IntArray, FloatArray]:
        """The same wear with as few shared bodies as there need be.

        A body that one contact touches alone is a compliance of that contact's own; a cylinder and
        a roller that the same contacts touch are one body; a body that does not wear is none.

        Returns
        -------
        own : ndarray, shape (contacts, strips)
        members : ndarray of int, shape (contacts, 2)
            Number of each contact's shared bodies, counted over both columns, or -1.
        shared : ndarray, shape (contacts, 2, strips)
        """
        if len(self.bodies) == 1:
            return self.total, np.full((1, 2), NO_BODY), np.zeros_like(self.compliance)
        shared = self.compliance.copy()
        merged, members = _membership(self.bodies.tobytes(), len(self.bodies))
        if merged:
            shared[:, 0] += shared[:, 1]
            shared[:, 1] = 0.0
        idle = np.logical_not(shared.any(axis=(0, 2)))
        members = np.where(idle, NO_BODY, members)
        alone = (members == NO_BODY)[:, :, None]
        own: FloatArray = np.where(alone, shared, 0.0).sum(axis=1)
        shared[alone[:, :, 0]] = 0.0
        return own, _counted(members) if idle[0] else members, shared


@lru_cache(maxsize=64)
def _membership(bodies: bytes, contacts: int) -> tuple[bool, IntArray]:
    """Return whether both sides are one, and which shared bodies each contact has.

    Parameters
    ----------
    bodies : bytes
        The array `bodies` of a `SharedWear`.
    contacts : int
        Its length.
    """
    members = np.frombuffer(bodies, dtype=np.int64).reshape(contacts, 2).copy()
    merged = _same_groups(members)
    if merged:
        members[:, 1] = NO_BODY
    for side in (0, 1):
        numbers, place, count = np.unique(members[:, side], return_inverse=True, return_counts=True)
        members[(count == 1)[place] | (numbers[place] == NO_BODY), side] = NO_BODY
    members[:, 1] += (members[:, 0].max() + 1) * (members[:, 1] != NO_BODY)
    return merged, _counted(members)


def _counted(members: IntArray) -> IntArray:
    """Return the numbers of bodies counted from 0 without gaps."""
    counted, kept = members.copy(), members != NO_BODY
    counted[kept] = np.unique(members[kept], return_inverse=True)[1]
    return counted


def _same_groups(members: IntArray) -> bool:
    """Tell whether both columns sort the contacts into the same groups."""
    pairs = len(np.unique(members, axis=0))
    return all(len(np.unique(members[:, side])) == pairs for side in (0, 1))
