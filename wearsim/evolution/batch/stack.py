"""Tests side by side as the realisations of one scene: joined, and taken apart again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from wearsim.evolution.contact_inputs import ContactInputs
from wearsim.evolution.problem import Scene
from wearsim.evolution.state import Separate, WearState
from wearsim.plugins import BODIES
from wearsim.types import FloatArray, IntArray

#: axis of the realisations in the arrays of a `WearState`
_AXES = {
    "cylinder_depth": 2,
    "roller_depth": 2,
    "terms": 2,
    "energy": 0,
    "depth_error": 0,
    "volume_error": 0,
    "quadrature": 1,
    "scatter": 1,
}
_SAME_ARRAYS = ("from_apex", "roller", "weight", "half", "slip_profile")


def can_be_joined(scene: Scene) -> bool:
    """Tell whether a test can be stepped together with others that are like it.

    Load terms, a bearing torque, inputs drawn at every pass, several stations and wear laws that
    are not linear in the dissipation take one test at a time.
    """
    linear = all(scene.wear_factors[body] is not None for body in BODIES)
    plain = not (scene.free or scene.terms or scene.has_nodes or scene.redraw)
    return linear and plain and scene.shape[0] == scene.shape[2] == 1


def alike(one: Scene, other: Scene) -> bool:
    """Tell whether two tests that can be joined can be so with each other."""
    first, second = one.kinematics, other.kinematics
    radii = ("cylinder_radius", "roller_radius", "crown_radius", "rolling_speed")
    varying = [[(item.name, item.rollers) for item in scene.varying] for scene in (one, other)]
    return (
        all(getattr(one, name) is getattr(other, name) for name in ("grid", "model"))
        and all(getattr(one, name) == getattr(other, name) for name in ("tilt_shifts", "settled"))
        and all(_equal(getattr(one, name), getattr(other, name)) for name in _SAME_ARRAYS)
        and all(getattr(first, name) == getattr(second, name) for name in radii)
        and _equal(first.multiplicity, second.multiplicity)
        and varying[0] == varying[1]
    )


def _equal(one: FloatArray | None, other: FloatArray | None) -> bool:
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)


def joined_scene(scenes: Sequence[Scene]) -> Scene:
    """Return one scene of which the tests, which are alike, are the realisations."""
    inputs = [scene.inputs for scene in scenes]
    joined = ContactInputs(
        *(
            np.concatenate([getattr(one, item.name) for one in inputs], axis=1)
            for item in fields(ContactInputs)
        )
    )
    gaps = np.concatenate([scene.flat_gap for scene in scenes], axis=2)
    return replace(scenes[0], flat_gap=gaps, inputs=joined, members=tuple(scenes))


def scene_of(scene: Scene, numbers: IntArray) -> Scene:
    """Return the scene with some of its realisations, in that order."""
    inputs = ContactInputs(
        *(
            np.take(getattr(scene.inputs, item.name), numbers, axis=1)
            for item in fields(ContactInputs)
        )
    )
    members = tuple(scene.members[number] for number in numbers) if scene.members else ()
    gap = np.take(scene.flat_gap, numbers, axis=2)
    return replace(scene, flat_gap=gap, inputs=inputs, members=members)


def state_of(state: WearState, numbers: IntArray) -> WearState:
    """Return the state of some realisations, in that order."""
    taken: dict[str, Any] = {
        name: np.take(getattr(state, name), numbers, axis=axis) for name, axis in _AXES.items()
    }
    shadow = state.shadow
    return replace(
        state,
        **taken,
        contacts=state.batch.at(numbers),
        shadow=None if shadow is None else state_of(shadow, numbers),
        each=None if state.each is None else state.each.at(numbers),
    )


def joined_states(states: Sequence[WearState]) -> WearState:
    """Return the states of tests that go each its own way as the realisations of one."""
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(state, name) for state in states], axis=axis)
        for name, axis in _AXES.items()
    }
    first, *others = (state.batch for state in states)
    each = [state.each for state in states if state.each is not None]
    shadows = [state.shadow for state in states if state.shadow is not None]
    return replace(
        states[0],
        **joined,
        contacts=first.joined_with(*others),
        shadow=joined_states(shadows) if len(shadows) == len(states) else None,
        each=Separate(
            np.concatenate([one.passes for one in each]),
            np.concatenate([one.solves for one in each]),
        ),
    )


@dataclass(frozen=True)
class Flock:
    """Some tests, as the realisations of one scene.

    Parameters
    ----------
    numbers : ndarray of int, shape (tests,)
        Which they are.
    scene : Scene
    state : WearState
        Theirs; each goes its own way.
    """

    numbers: IntArray
    scene: Scene
    state: WearState

    @property
    def progress(self) -> list[tuple[int, float]]:
        """Number and roller passes done of each test."""
        passes: list[float] = np.asarray(self.state.now).tolist()
        return list(zip(self.numbers.tolist(), passes, strict=True))

    def at(self, places: IntArray) -> Flock:
        """Return the tests at some places, in that order."""
        if np.array_equal(places, np.arange(len(self.numbers))):
            return self
        scene, state = scene_of(self.scene, places), state_of(self.state, places)
        return Flock(self.numbers[places], scene, state)

    def moved_to(self, state: WearState) -> Flock:
        """Return the same tests at another state."""
        return replace(self, state=state)

    def with_others(self, others: Flock) -> Flock:
        """Return these tests, some of them at the state that they have in another flock."""
        if np.array_equal(self.numbers, others.numbers):
            return self.moved_to(others.state)
        order, place = np.arange(len(self.numbers)), np.argsort(self.numbers)
        at = place[np.searchsorted(self.numbers, others.numbers, sorter=place)]
        order[at] = len(order) + np.arange(len(at))
        return self.moved_to(state_of(joined_states([self.state, others.state]), order))
