"""Motion of a roller on its cam, computed once for the turns of all loads."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import lru_cache
from typing import TypeVar

from wearsim.mechanics.cam import RollerKinematics
from wearsim.scenario.tables.cam import Cam
from wearsim.types import FloatArray

_Fact = TypeVar("_Fact")
MOST_KNOWN = 1000  # sets of angles of a cam at which the motion of the roller is kept


class RollerPath:
    """Motion of the roller of a cam, with the facts that follow from it alone.

    Parameters
    ----------
    cam : Cam
    """

    def __init__(self, cam: Cam) -> None:
        self._cam = cam
        self._known: dict[tuple[int, bool, bytes], RollerKinematics] = {}
        self._facts: dict[Hashable, object] = {}

    def once(self, name: Hashable, compute: Callable[[], _Fact]) -> _Fact:
        """Return a fact about the motion by its name, computed when it is first needed."""
        if name not in self._facts:
            self._facts[name] = compute()
        return self._facts[name]  # type: ignore[return-value]

    def at(self, segment: int, theta: FloatArray, inner: bool) -> RollerKinematics:
        """Return the motion at angles within a segment [rad], on the inner flank of a groove."""
        key = segment, inner, theta.tobytes()
        kinematics = self._known.get(key)
        if kinematics is None:
            kinematics = self._cam.follower.kinematics(
                self._cam.motion.lift_in(segment, theta), inner
            )
            if len(self._known) < MOST_KNOWN:
                self._known[key] = kinematics
        return kinematics


path_of = lru_cache(maxsize=4)(RollerPath)
