"""Wear compliance of several contacts that wear common bodies in an implicit step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from wearsim.types import FloatArray, IntArray

NO_BODY = -1


@dataclass(frozen=True)
class SharedWear:
    """Wear compliance of several contacts on the bodies that they have in common.

    Each contact touches two bodies, and the wear of a body opens the gaps of all contacts that
    touch it. The gap of contact k is

        gap[k] + sum over its bodies b of sum_l compliance[l, side of b] * line_load[l],

    where the inner sum is over the contacts l that touch b.

    Parameters
    ----------
    bodies : ndarray of int, shape (contacts, 2)
        Number of the cylinder's station and number of the roller of each contact; the columns are
        numbered independently.
    compliance : ndarray, shape (contacts, 2, strips)
        Depth that a contact wears off each of its bodies per unit of line load [m/(N/m)]. A
        leading axis may count independent sets of such contacts, which follow one another in a
        `ContactBatch`.
    """

    bodies: IntArray
    compliance: FloatArray

    def at(self, numbers: int | IntArray) -> SharedWear:
        """Return the wear of one set of contacts, or of several sets."""
        return SharedWear(self.bodies, self.compliance[numbers])

    @property
    def total(self) -> FloatArray:
        """Increase of each contact's gap by its wear per unit of line load, (contacts, strips)."""
        return np.asarray(self.compliance.sum(axis=-2))

    def opening(self, line_load: FloatArray) -> FloatArray:
        """Return the gap that line loads, (contacts, strips), open at each contact [m]."""
        if len(self.bodies) == 1:
            return np.asarray((self.compliance * line_load[..., None, :]).sum(axis=-2))
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

    @cached_property
    def groups(self) -> list[tuple[IntArray, FloatArray, IntArray, FloatArray]]:
        """Equivalent wear with the smallest number of shared bodies, by the bodies that wear.

        A body touched by one contact only becomes a compliance of that contact; a cylinder and a
        roller touched by the same contacts become one body; a body that does not wear is dropped.

        Returns
        -------
        list of (numbers, own, members, shared)
            Numbers of the sets of a group; compliance of separate contacts, (sets, contacts,
            strips); numbers of the shared bodies of each contact, counted over both columns, or
            -1, (contacts, 2); and its wear of them, (sets, contacts, 2, strips).
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
            part = wear if len(numbers) == len(wear) else wear[numbers]
            members = _membership(bodies, contacts, kind)
            alone = (members == NO_BODY)[:, :, None]
            own = np.where(alone, part, 0.0).sum(axis=2)
            groups.append((numbers, own, members, np.where(alone, 0.0, part)))
        return groups


@lru_cache(maxsize=64)
def _merged(bodies: bytes, contacts: int) -> bool:
    """Return whether both columns of `bodies` group the contacts identically."""
    pairs = np.frombuffer(bodies, dtype=np.int64).reshape(contacts, 2)
    count = len(np.unique(pairs, axis=0))
    return all(len(np.unique(pairs[:, side])) == count for side in (0, 1))


@lru_cache(maxsize=64)
def _membership(bodies: bytes, contacts: int, idle: tuple[bool, bool]) -> IntArray:
    """Return the numbers of the shared bodies of each contact, counted from 0 without gaps.

    Parameters
    ----------
    bodies : bytes
        The array `bodies` of a `SharedWear`.
    contacts : int
        Its length.
    idle : tuple of bool
        Whether the bodies of each column do not wear.
    """
    members = np.frombuffer(bodies, dtype=np.int64).reshape(contacts, 2).copy()
    if _merged(bodies, contacts):
        members[:, 1] = NO_BODY
    for side in (0, 1):
        numbers, place, count = np.unique(members[:, side], return_inverse=True, return_counts=True)
        members[(count == 1)[place] | (numbers[place] == NO_BODY), side] = NO_BODY
    members[:, 1] += (members[:, 0].max() + 1) * (members[:, 1] != NO_BODY)
    members[:, list(idle)] = NO_BODY
    shared = members != NO_BODY
    members[shared] = np.unique(members[shared], return_inverse=True)[1]
    return members
