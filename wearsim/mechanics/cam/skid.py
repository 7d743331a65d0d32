"""Skid of a free roller over a turn of the cam.

The rolling roller turns at omega times `spin`. Traction and bearing give it the acceleration
I dOmega/dt = F_t R - T_b, and F_t is at most mu N. Where rolling would need more, the roller skids:
the slip w = spin - Omega/omega grows as

    dw/dtheta = spin' + drag - s reach,   drag = T_b/(I omega^2),   reach = mu N R/(I omega^2),

with the sign s of w, until w returns to zero and rolling needs less than mu N. T_b opposes the
roller's rotation. The slip dissipates mu N R |w| per angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearsim.mechanics.cam.motion import Panel
from wearsim.types import FloatArray

_POINTS = 513  # of a panel, every second one is the middle of an interval
_MOST_TURNS = 90


class Rolling(NamedTuple):
    """Requirements of rolling at some angles, arrays of one shape.

    Parameters
    ----------
    spin, spin_per_rad : ndarray
        Speed of the rolling roller per speed of the cam, and its derivative by the angle.
    drag, reach : ndarray
        Bearing torque, and greatest torque of the traction, over I omega^2; not negative.
    """

    spin: FloatArray
    spin_per_rad: FloatArray
    drag: FloatArray
    reach: FloatArray

    def demand(self) -> FloatArray:
        """Return the torque that rolling needs, over the greatest of the traction."""
        needed = self.spin_per_rad + np.sign(self.spin) * self.drag
        return np.asarray(needed / np.where(self.reach > 0.0, self.reach, 1e-300))


@dataclass(frozen=True)
class SkidArc:
    """Part of a panel in which the roller skids.

    Parameters
    ----------
    panel : int
        Number of the panel.
    theta, slip, slip_per_rad : ndarray, shape (points,)
        Angles [rad], slip w and its derivative.
    """

    panel: int
    theta: FloatArray
    slip: FloatArray
    slip_per_rad: FloatArray

    def slip_at(self, theta: FloatArray) -> FloatArray:
        """Return the slip at angles of the arc [rad]."""
        return np.asarray(self._spline(np.clip(theta, self.theta[0], self.theta[-1])))

    @cached_property
    def _spline(self) -> Callable[[FloatArray], FloatArray]:
        from scipy.interpolate import CubicHermiteSpline  # noqa: PLC0415  (slow to import)

        return CubicHermiteSpline(self.theta, self.slip, self.slip_per_rad)


def skid_arcs(
    panels: Sequence[Panel], rolling: Callable[[Sequence[Panel], FloatArray], Rolling]
) -> list[SkidArc]:
    """Return the arcs of a turn in which the roller skids, in the order of the angle.

    Parameters
    ----------
    panels : sequence of Panel
        Smooth parts of the turn.
    rolling : callable
        Requirements of rolling at angles within panels, arrays of shape (panels, points).

    Raises
    ------
    ValueError
        If the roller rolls nowhere, or its skid does not repeat from turn to turn.
    """
    grids = np.stack([np.linspace(panel.start, panel.stop, _POINTS) for panel in panels])
    values = [Rolling(*rows) for rows in zip(*rolling(panels, grids), strict=True)]
    demands = [np.abs(value.demand()) for value in values]
    jumps = [float(values[k].spin[0] - values[k - 1].spin[-1]) for k in range(len(panels))]
    size = max(float(np.abs(value.spin).max()) for value in values)
    jumps = [jump if abs(jump) > 1e-9 * size else 0.0 for jump in jumps]
    if max(demand.max() for demand in demands) <= 1.0 and not any(jumps):
        return []
    first = int(np.argmin([demand.min() for demand in demands]))
    if demands[first].min() >= 1.0:
        raise ValueError("the roller rolls nowhere: the traction never suffices")
    start = int(np.argmin(demands[first])) // 2 * 2
    slip, passed = 0.0, list[float]()
    for _ in range(_MOST_TURNS):
        before = slip
        passed.append(slip)
        if len(passed) == 3:  # the skid of a heavy roller becomes periodic slowly: Aitken's method
            bend = passed[2] - 2.0 * passed[1] + passed[0]
            if bend != 0.0 and abs(passed[2] - passed[1]) < abs(passed[1] - passed[0]):
                before = slip = passed[2] - (passed[2] - passed[1]) ** 2 / bend
            passed.clear()
        skids: list[SkidArc] = []
        for number in range(len(panels) + 1):
            k = (first + number) % len(panels)
            low = start if number == 0 else 0
            high = start if number == len(panels) else _POINTS - 1
            if number > 0:
                slip += jumps[k]
            part = slice(low, high + 1)
            slip, arcs = _followed(grids[k][part], Rolling(*(a[part] for a in values[k])), slip)
            skids += [SkidArc(k, *arc) for arc in arcs]
        if abs(slip - before) <= 1e-9 * size:
            return sorted(skids, key=lambda arc: float(arc.theta[0]))
    raise ValueError("the roller skids on through whole turns")


def _followed(
    theta: FloatArray, values: Rolling, slip: float
) -> tuple[float, list[tuple[FloatArray, ...]]]:
    """Return the slip at the end of a part of a panel, from that at its start, and its arcs.

    Every second point is the middle of an interval.
    """
    # Python floats, which are faster than arrays one at a time
    angle, demand = theta.tolist(), values.demand().tolist()
    spin, rise, drag, reach = (column.tolist() for column in values)
    arcs: list[list[tuple[float, float, float]]] = []

    def rate_from_rest(place: int) -> float:
        braking = math.copysign(1.0, spin[place]) * drag[place]
        return float(rise[place] + braking - math.copysign(1.0, demand[place]) * reach[place])

    for place in range(0, len(angle) - 1, 2):
        low, high = angle[place], angle[place + 2]
        if slip == 0.0:
            if abs(demand[place + 2]) <= 1.0:
                continue
            start = low
            if abs(demand[place]) < 1.0:  # rolling ends within the interval
                near, far = abs(demand[place]), abs(demand[place + 2])
                start = low + (1.0 - near) / (far - near) * (high - low)
            rate = rate_from_rest(place + 2)
            slip = 0.5 * rate * (high - start) if start > low else rate * (high - start)
            arcs.append([(start, 0.0, 0.0 if start > low else rate), (high, slip, rate)])
            continue
        sign = math.copysign(1.0, slip)
        first, middle, last = (
            # as of rate_from_rest, without calls: this takes most of the time of a turn
            (rise[k] + (drag[k] if spin[k] >= slip else -drag[k]) - sign * reach[k])
            for k in (place, place + 1, place + 2)
        )
        if not arcs:
            arcs.append([(low, slip, first)])
        after = slip + (high - low) / 6.0 * (first + 4.0 * middle + last)
        if after * sign > 0.0:
            slip = after
            arcs[-1].append((high, slip, last))
            continue
        # the roller catches up within the interval
        part = slip / (slip - after)
        stop = low + part * (high - low)
        arcs[-1].append((stop, 0.0, first + part * (last - first)))
        slip = 0.0
        if abs(demand[place]) > 1.0 >= abs(demand[place + 2]):
            # rolling begins somewhere in the rest of the interval
            arcs[-1].append((high, 0.0, 0.0))
        elif abs(demand[place + 2]) > 1.0:
            rate = rate_from_rest(place + 2)
            slip = rate * (high - stop)
            arcs.append([(stop, 0.0, rate), (high, slip, rate)])
    return slip, [tuple(np.array(arc).T) for arc in arcs if arc[-1][0] > arc[0][0]]
