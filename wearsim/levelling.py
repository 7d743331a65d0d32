"""Measured profiles against the computed one: levelling and residuals [m]."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from wearsim.errors import mistake_in
from wearsim.types import FloatArray

_WORN = 0.01  # part of the greatest depth above which a strip counts as worn
_DEEP = 0.3  # part of the greatest depth above which points give the middle of a groove
_FEWEST = 8  # unworn points on each side


@dataclass(frozen=True)
class Measured:
    """A measured profile.

    Parameters
    ----------
    label : str
        Label in the figure.
    y : ndarray, shape (points,)
        Axial position [m].
    height : ndarray, shape (points,)
        Height above the nominal surface [m]; worn material is negative.
    angle : float, optional
        Angle of the cam at which it was measured [rad]; by default where it is deepest.
    """

    label: str
    y: FloatArray
    height: FloatArray
    angle: float | None = None


class ComputedProfile(NamedTuple):
    """Profile of the cylinder at the end of a run or an ensemble.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position [m].
    height : ndarray, shape (strips,)
        Height above the nominal surface, of an ensemble its mean [m].
    low, high : ndarray, shape (strips,)
        Ends of the band of an ensemble, which are equal for a run [m].
    start : ndarray, shape (strips,)
        Height at the start of the test [m].
    label : str
        Description of the band; empty if there is none.
    kept : int
        Number of profiles.
    """

    y: FloatArray
    height: FloatArray
    low: FloatArray
    high: FloatArray
    start: FloatArray
    label: str = ""
    kept: int = 1


def residuals(
    measured: Measured, computed: ComputedProfile
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return position, height and residual of the points on the strips [m]."""
    inside = (measured.y >= computed.y[0]) & (measured.y <= computed.y[-1])
    y, height = measured.y[inside], measured.height[inside]
    return y, height, height - np.interp(y, computed.y, computed.height)


def rms(measured: Measured, computed: ComputedProfile) -> float:
    """Return the root mean square of measured minus computed heights, nan without points [m]."""
    residual = residuals(measured, computed)[2]
    return float(np.sqrt(np.mean(residual**2))) if residual.size else float("nan")


def levelled(measured: Measured, computed: ComputedProfile) -> Measured:
    """Return a measured profile without offset, inclination and axial shift.

    A straight line gives offset and inclination, fitted to the points outside the computed
    groove, the shift makes the middles of both grooves equal. The depth is not fitted.

    Parameters
    ----------
    measured : Measured
    computed : ComputedProfile

    Raises
    ------
    ScenarioError
        If there are less than 8 unworn points on either side of the groove.
    """
    worn = computed.start - computed.height
    limits = computed.y[np.flatnonzero(worn > _WORN * worn.max())[[0, -1]]]
    middle, y, height = _middle(computed.y, worn), measured.y, measured.height
    line = np.polyfit(y, height, 1)
    for _ in range(10):
        depth = np.interp(y, computed.y, computed.start) - height + np.polyval(line, y)
        shift = _middle(y, depth) - middle
        left, right = y < limits[0] + shift, y > limits[1] + shift
        if min(left.sum(), right.sum()) < _FEWEST:
            raise mistake_in(
                measured.label,
                "cannot be levelled: there is no unworn surface on both sides of the groove",
                expected="a longer profile, or a levelled one",
            )
        unworn = left | right
        start = np.interp(y - shift, computed.y, computed.start)
        line = np.polyfit(y[unworn], (height - start)[unworn], 1)
    return replace(measured, y=y - shift, height=height - np.polyval(line, y))


def _middle(y: FloatArray, depth: FloatArray) -> float:
    """Return the centroid of the deep part of a groove [m]."""
    deep = np.maximum(depth - _DEEP * depth.max(), 0.0)
    return float((deep * y).sum() / deep.sum())
