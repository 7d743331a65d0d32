"""What the wear of one step does to the bodies, and how it yields under the contacts."""

from __future__ import annotations

from functools import cached_property
from typing import TypeAlias

import numpy as np

from wearsim.evolution.scene import Scene
from wearsim.mechanics.wear_of_strips import learn_exponents, ratio_to_load
from wearsim.plugins import SharedWear
from wearsim.types import ContactSolution, FloatArray

Contacts: TypeAlias = tuple[ContactSolution, ...]

SLIDING = 1.0  # exponent of dissipation in full sliding, the greatest there is
STEEPEST = 50.0  # where catastrophic wear begins, T gamma's law goes as the power 44


class Wearing:
    """What a step of `passes` passes with given contacts wears off the bodies.

    Near the contacts' line loads the wear of each strip is taken as linear in its line load:
    u = (1 - e) u_0 + e (u_0/q_0) q, with the exponent e of u ~ q^e. The second term is a
    compliance, the first a wear that does not yield.

    Parameters
    ----------
    scene : Scene
    contacts : tuple of ContactSolution
    passes : float
        Length of the step.

    Attributes
    ----------
    cylinder, roller : ndarray
        Depth the step adds, shapes as in `WearState` [m].
    exponents : ndarray, shape (stations, contacts, realisations, strips), optional
        e of every strip, to be set before compliance or offset are first asked for; 1 where left
        out, which full sliding makes exact.
    """

    def __init__(self, scene: Scene, contacts: Contacts, passes: float) -> None:
        cylinder, roller = scene.wear_per_pass(contacts)
        rates = scene.shared_wear(cylinder, roller)
        self.cylinder, self.roller = rates[0] * passes, rates[1] * passes
        self.exponents: FloatArray | None = None
        self.scene, self.contacts = scene, contacts
        # each contact's own part in the wear of the bodies
        share = passes * scene.cylinder_share[None, :, None, None]
        own = passes * scene.kinematics.roller_share / scene.shape[0]
        self._parts = cylinder * share, roller * own * scene.weight[None, :, None, None]

    @property
    def per_contact(self) -> FloatArray:
        """Depth that each contact wears off both bodies, shape (contacts, strips) [m]."""
        worn: FloatArray = (self._parts[0] + self._parts[1]).reshape(len(self.contacts), -1)
        return worn

    @cached_property
    def compliance(self) -> list[SharedWear]:
        """How the step's wear yields, one per realisation; contacts are (station, contact)."""
        parts = self._parts
        if self.exponents is not None:
            parts = self.exponents * parts[0], self.exponents * parts[1]
        scene = self.scene
        stations, contacts, realisations = scene.shape
        station, contact = np.divmod(np.arange(stations * contacts), contacts)
        bodies = np.stack([station, scene.roller[contact]], axis=1)
        # to (realisations, stations, contacts, sides, strips)
        ratios = np.stack([_ratio(part, self.contacts) for part in parts])
        ratios = ratios.transpose(3, 1, 2, 0, 4).reshape(realisations, -1, 2, scene.grid.strips)
        return [SharedWear(bodies, ratio) for ratio in ratios]

    @cached_property
    def offset(self) -> FloatArray | float:
        """Gap that opens whatever the line load, (stations, contacts, realisations, strips) [m]."""
        if self.exponents is None:
            return 0.0
        kept = 1.0 - self.exponents
        on_cylinder, on_roller = self._parts
        on_cylinder = (kept * on_cylinder).sum(axis=1, keepdims=True)
        on_roller = self.scene.sum_of_roller((kept * on_roller).sum(axis=0, keepdims=True))
        opening: FloatArray = on_cylinder + on_roller[:, self.scene.roller]
        return opening

    @property
    def opening(self) -> FloatArray:
        """Gap that the step opens at every contact, (stations, contacts, realisations, strips)."""
        return self.cylinder + self.roller[:, self.scene.roller]

    def foreseen(self, line_load: FloatArray) -> FloatArray:
        """Return the opening that compliance and offset make of a line load, shape as `opening`."""
        stations, contacts, realisations, strips = line_load.shape
        flat = line_load.transpose(2, 0, 1, 3).reshape(realisations, -1, strips)
        yielding = [wear.opening(q) for wear, q in zip(self.compliance, flat, strict=True)]
        shaped = np.reshape(yielding, (realisations, stations, contacts, strips))
        opening: FloatArray = shaped.transpose(1, 2, 0, 3) + self.offset
        return opening


def _column(contacts: Contacts, name: str) -> FloatArray:
    """Return a field of all contacts, shape (contacts, strips)."""
    return np.array([getattr(contact, name) for contact in contacts])


def _ratio(wear: FloatArray, contacts: Contacts) -> FloatArray:
    """Return wear over line load, carried on into strips without load, last axis strips."""
    flat = np.ascontiguousarray(wear).reshape(len(contacts), -1)
    return ratio_to_load(flat, _column(contacts, "line_load")).reshape(wear.shape)


def exponents_between(old: Wearing, new: Wearing) -> FloatArray:
    """Return the exponents with which wear followed the line load from `old` to `new`.

    Parameters
    ----------
    old, new : Wearing
        The wear of two solutions of the same contacts.

    Returns
    -------
    ndarray, shape (stations, contacts, realisations, strips)
        Where a strip tells nothing that of `old`, or 1.
    """
    scene, known = old.scene, old.exponents
    exponents = np.ones((*scene.shape, scene.grid.strips)) if known is None else known.copy()
    linear = scene.law.depth_per_dissipation("cylinder", scene.kinematics.rolling_speed)
    learn_exponents(
        _column(old.contacts, "line_load"),
        _column(new.contacts, "line_load"),
        old.per_contact,
        new.per_contact,
        SLIDING if linear is not None else STEEPEST,
        exponents.reshape(len(new.contacts), -1),
    )
    return exponents
