"""What the wear of one step does to the bodies, and how it yields under the contacts."""

from __future__ import annotations

from functools import cached_property
from typing import TypeAlias

import numpy as np

from wearsim.evolution.scene import Scene
from wearsim.plugins import SharedWear
from wearsim.types import ContactSolution, FloatArray

Contacts: TypeAlias = tuple[ContactSolution, ...]

LEAST_EXPONENT, GREATEST_EXPONENT = 0.4, 1.0  # wear goes as q^(1/2) in adhesion, as q in sliding
FELT = 1e-7  # relative change of a line load from which an exponent can be read


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
        self._scene, self._contacts = scene, contacts
        # each contact's own part in the wear of the bodies
        share = passes * scene.cylinder_share[None, :, None, None]
        own = passes * scene.kinematics.roller_share / scene.shape[0]
        self._parts = cylinder * share, roller * own * scene.weight[None, :, None, None]

    @cached_property
    def compliance(self) -> list[SharedWear]:
        """How the step's wear yields, one per realisation; contacts are (station, contact)."""
        parts = self._parts
        if self.exponents is not None:
            parts = self.exponents * parts[0], self.exponents * parts[1]
        scene = self._scene
        stations, contacts, realisations = scene.shape
        station, contact = np.divmod(np.arange(stations * contacts), contacts)
        bodies = np.stack([station, scene.roller[contact]], axis=1)
        # to (realisations, stations, contacts, sides, strips)
        ratios = np.stack([_ratio(scene, part, self._contacts) for part in parts])
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
        on_roller = self._scene.of_roller((kept * on_roller).sum(axis=0, keepdims=True), np.add)
        opening: FloatArray = on_cylinder + on_roller[:, self._scene.roller]
        return opening

    @property
    def opening(self) -> FloatArray:
        """Gap that the step opens at every contact, (stations, contacts, realisations, strips)."""
        return self.cylinder + self.roller[:, self._scene.roller]

    def foreseen(self, line_load: FloatArray) -> FloatArray:
        """Return the opening that compliance and offset make of a line load, shape as `opening`."""
        stations, contacts, realisations, strips = line_load.shape
        flat = line_load.transpose(2, 0, 1, 3).reshape(realisations, -1, strips)
        yielding = [wear.opening(q) for wear, q in zip(self.compliance, flat, strict=True)]
        shaped = np.reshape(yielding, (realisations, stations, contacts, strips))
        opening: FloatArray = shaped.transpose(1, 2, 0, 3) + self.offset
        return opening


def _ratio(scene: Scene, wear: FloatArray, contacts: Contacts) -> FloatArray:
    """Return wear over line load, carried on into strips without load, last axis strips."""
    ratio = np.zeros_like(wear)
    if not wear.any():
        return ratio
    places = np.arange(wear.shape[-1], dtype=np.float64)
    for index, contact in zip(scene.contacts, contacts, strict=True):
        loaded = contact.line_load > 0.0
        ratio[index] = np.interp(
            places, places[loaded], wear[index][loaded] / contact.line_load[loaded]
        )
    return ratio


def exponents_between(
    scene: Scene, old: Contacts, new: Contacts, known: FloatArray | None
) -> FloatArray:
    """Return the exponents with which dissipation followed the line load from `old` to `new`.

    Parameters
    ----------
    scene : Scene
    old, new : tuple of ContactSolution
        Two solutions of the same contacts.
    known : ndarray, shape (stations, contacts, realisations, strips), optional
        What to take where a strip tells nothing; 1 where left out.

    Returns
    -------
    ndarray, shape (stations, contacts, realisations, strips)
    """
    exponents = np.ones((*scene.shape, scene.grid.strips)) if known is None else known.copy()
    for index, before, after in zip(scene.contacts, old, new, strict=True):
        both = (before.dissipation > 0.0) & (after.dissipation > 0.0)
        load = np.log(after.line_load[both] / before.line_load[both])
        power = np.log(after.dissipation[both] / before.dissipation[both])
        felt = np.abs(load) > FELT
        strips = np.flatnonzero(both)[felt]
        slopes = power[felt] / load[felt]
        exponents[index][strips] = np.clip(slopes, LEAST_EXPONENT, GREATEST_EXPONENT)
    return exponents
