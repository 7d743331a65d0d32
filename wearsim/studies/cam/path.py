"""Motion of a roller on its cam, computed once for the turns of all loads."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import lru_cache
from typing import TypeVar

import numpy as np

from wearsim.mechanics.cam import Panel, RollerKinematics
from wearsim.scenario.tables.cam import Cam
from wearsim.types import BoolArray, FloatArray

_Fact = TypeVar("_Fact")
MOST_KNOWN = 200_000  # angles of a cam at which the motion of the roller is kept


class RollerPath:
    """Motion of the roller of a cam, with the facts that follow from it alone.

    Parameters
    ----------
    cam : Cam
    """

    def __init__(self, cam: Cam) -> None:
        self._cam = cam
        self._known: dict[tuple[bytes, ...], RollerKinematics] = {}
        self._kept = 0  # angles of these
        self._facts: dict[Hashable, object] = {}

    def once(self, name: Hashable, compute: Callable[[], _Fact]) -> _Fact:
        """Return a fact about the motion by its name, computed when it is first needed."""
        if name not in self._facts:
            self._facts[name] = compute()
        return self._facts[name]  # type: ignore[return-value]

    def at(self, panels: Sequence[Panel], theta: FloatArray, inner: BoolArray) -> RollerKinematics:
        """Return the motion at angles within panels, arrays of shape (panels, points).

        Parameters
        ----------
        panels : sequence of Panel
        theta : ndarray, shape (panels, points)
            Angles [rad].
        inner : ndarray of bool, shape (panels, 1)
            Whether the roller touches the inner flank of a groove.
        """
        segments = np.array([[panel.segment] for panel in panels])
        key = segments.tobytes(), inner.tobytes(), theta.tobytes()
        kinematics = self._known.get(key)
        if kinematics is None:
            lift = self._cam.motion.lift_in(segments, theta)
            kinematics = self._cam.follower.kinematics(lift, inner)
            if self._kept < MOST_KNOWN:
                self._known[key] = kinematics
                self._kept += theta.size
        return kinematics


path_of = lru_cache(maxsize=4)(RollerPath)
