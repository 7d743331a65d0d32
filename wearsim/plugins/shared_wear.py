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
        Depth that a contact wears off either body per unit of its line load [m/(N/m)]. One more
        axis before these may count sets of contacts that share nothing with each other.
    """

    bodies: IntArray
    compliance: FloatArray

    @classmethod
    def of_one(cls, compliance: FloatArray) -> SharedWear:
        """Return the wear of a single contact that opens its gap by `compliance`, (strips,)."""
        both = np.stack([compliance, np.zeros_like(compliance)])
        return cls(np.zeros((1, 2), dtype=np.int64), both[None])

    def at(self, numbers: int | IntArray) -> SharedWear:
        """Return the wear of one set of contacts, or of some."""
        return SharedWear(self.bodies, self.compliance[numbers])

    @property
    def total(self) -> FloatArray:
        """Gap that a contact opens for itself per unit of its line load, (contacts, strips)."""
        own: FloatArray = self.compliance.sum(axis=-2)
        return own

    def opening(self, line_load: FloatArray) -> FloatArray:
        """Return the gap that line loads, (contacts, strips), open at every contact [m]."""
        if len(self.bodies) == 1:
            alone: FloatArray = (self.compliance * line_load[..., None, :]).sum(axis=-2)
            return alone
        gap = np.zeros_like(line_load)
        for side in (0, 1):
            worn = self.compliance[..., side, :] * line_load
            if not np.count_nonzero(worn):
                continue
            numbers: list[int] = self.bodies[:, side].tolist()
            depth: dict[int, FloatArray] = {}
            for contact, number in enumerate(numbers):
                own = worn[..., contact, :]
                depth[number] = depth[number] + own if number in depth else own
            for contact, number in enumerate(numbers):
                gap[..., contact, :] += depth[number]
        return gap

    @property
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
        _, own, members, shared = self.groups[0]
        return own[0], members, shared[0]

    @cached_property
    def groups(self) -> list[tuple[IntArray, FloatArray, IntArray, FloatArray]]:
        """The wear of many as `reduced` has it, in groups of those in which the same bodies wear.

        Returns
        -------
        list of tuple
            Numbers of those that a group holds, and `own`, `members` and `shared` of `reduced`,
            of which `own` and `shared` have a first axis more.
        """
        bodies, contacts = self.bodies.tobytes(), len(self.bodies)
        wear = self.compliance.reshape(-1, *self.compliance.shape[-3:])
        if contacts == 1:
            alone = np.full((1, 2), NO_BODY)
            return [(np.arange(len(wear)), wear.sum(axis=2), alone, np.zeros_like(wear))]
        if _merged(bodies, contacts):
            both = wear.sum(axis=2)
            wear = np.stack([both, np.zeros_like(both)], axis=2)
        idle = np.logical_not(wear.any(axis=(1, 3)))
        kinds: list[tuple[bool, bool]] = [(left, right) for left, right in idle.tolist()]
        groups = []
        for kind in sorted(set(kinds)):
            numbers = np.array([number for number, other in enumerate(kinds) if other == kind])
            some = wear if len(numbers) == len(wear) else wear[numbers]
            members = _membership(bodies, contacts, kind)
            alone = (members == NO_BODY)[:, :, None]
            own = np.where(alone, some, 0.0).sum(axis=2)
            groups.append((numbers, own, members, np.where(alone, 0.0, some)))
        return groups


@lru_cache(maxsize=64)
def _merged(bodies: bytes, contacts: int) -> bool:
    """Tell whether a cylinder and a roller that the same contacts touch are one body."""
    return _same_groups(np.frombuffer(bodies, dtype=np.int64).reshape(contacts, 2))


@lru_cache(maxsize=64)
def _membership(bodies: bytes, contacts: int, idle: tuple[bool, bool]) -> IntArray:
    """Return which shared bodies each contact has.

    Parameters
    ----------
    bodies : bytes
        The array `bodies` of a `SharedWear`.
    contacts : int
        Its length.
    idle : tuple of bool
        Whether the bodies of either column do not wear.
    """
    members = np.frombuffer(bodies, dtype=np.int64).reshape(contacts, 2).copy()
    if _merged(bodies, contacts):
        members[:, 1] = NO_BODY
    for side in (0, 1):
        numbers, place, count = np.unique(members[:, side], return_inverse=True, return_counts=True)
        members[(count == 1)[place] | (numbers[place] == NO_BODY), side] = NO_BODY
    members[:, 1] += (members[:, 0].max() + 1) * (members[:, 1] != NO_BODY)
    return _counted(np.where(idle, NO_BODY, members))


def _counted(members: IntArray) -> IntArray:
    """Return the numbers of bodies counted from 0 without gaps."""
    counted, kept = members.copy(), members != NO_BODY
    counted[kept] = np.unique(members[kept], return_inverse=True)[1]
    return counted


def _same_groups(members: IntArray) -> bool:
    """Tell whether both columns sort the contacts into the same groups."""
    pairs = len(np.unique(members, axis=0))
    return all(len(np.unique(members[:, side])) == pairs for side in (0, 1))
