"""Measured profiles against the computed one: levelling and residuals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from wearsim.errors import Mistake, ScenarioError, WearsimError
from wearsim.report.text import count, shown, sufficient_for
from wearsim.results import EnsembleResult, Result
from wearsim.studies.cam.turn import CamTurn
from wearsim.types import FloatArray


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
        Height above the nominal surface, of an ensemble that of the mean [m].
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


_BAND = 0.025  # probability below the band of an ensemble


def grooves_at(result: Result, angle: float | None = None) -> tuple[FloatArray, float]:
    """Return the worn depth of a cam at every record, shape (records, strips) [m], and its angle.

    Parameters
    ----------
    result : Result
        Of a cam.
    angle : float, optional
        Angle of the cam [rad]; by default that at which it is worn deepest.
    """
    depth = np.asarray(result.raw.records["cylinder_depth_profile"])[:, :, 0]
    if angle is None:
        place = int(depth[-1].max(axis=1).argmax())
        return depth[:, place], float(result.raw.static["station_angle"][place])
    stations, turned = CamTurn(result.scenario).stations, np.array([np.mod(angle, 2.0 * np.pi)])
    rows = stations.values_at_angles(depth.transpose(1, 0, 2), turned)[0]
    return np.maximum(rows, 0.0), float(angle)


def computed_profile(
    result: Result | EnsembleResult, angle: float | None = None
) -> ComputedProfile:
    """Return the profile at the end of a run or an ensemble.

    Parameters
    ----------
    result : Result or EnsembleResult
    angle : float, optional
        Angle of a run's cam [rad]; by default, and of ensembles, where it is worn deepest.
    """
    if isinstance(result, Result):
        start, cam = result.start_height, "station_angle" in result.raw.static
        worn = grooves_at(result, angle)[0][-1] if cam else np.asarray(result.profiles[-1])
        height = start - worn
        return ComputedProfile(result.y, height, height, height, start)
    band, start = result.band(), _start_height(result)
    low, high, label = band.low, band.high, ""
    if band.kept > 1:
        label = "2.5 % to 97.5 %"
        if not sufficient_for(band.kept, _BAND):
            kept = result.profiles
            low, high, label = kept.min(axis=0), kept.max(axis=0), "least to greatest"
    height = start - band.mean
    return ComputedProfile(band.y, height, start - high, start - low, start, label, band.kept)


def _start_height(result: EnsembleResult) -> FloatArray:
    """Return the height at the start of the tests, which the scenario gives [m]."""
    y = result.raw.variables["y"]
    try:
        profile = result.scenario.cylinder.profile
    except WearsimError:  # a plugin of the scenario is not installed
        profile = None
    return np.zeros_like(y) if profile is None else np.interp(y, profile.y, profile.height)


def _residual(
    measured: Measured, computed: ComputedProfile
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return position, height and residual of the points on the strips [m]."""
    inside = (measured.y >= computed.y[0]) & (measured.y <= computed.y[-1])
    y, height = measured.y[inside], measured.height[inside]
    return y, height, height - np.interp(y, computed.y, computed.height)


def rms(measured: Measured, computed: ComputedProfile) -> float:
    """Return the root mean square of measured minus computed heights, nan without points [m]."""
    residual = _residual(measured, computed)[2]
    return float(np.sqrt(np.mean(residual**2))) if residual.size else float("nan")


def residual_text(measured: Measured, computed: ComputedProfile) -> str:
    """Return the root mean square of measured minus computed heights, and their mean.

    Points beyond the strips are not compared. With a band, the part of the points within it is
    added.

    Parameters
    ----------
    measured : Measured
    computed : ComputedProfile
    """
    y, height, residual = _residual(measured, computed)
    if len(y) == 0:
        return "no point on the strips, no residual"
    text = (
        f"residual rms {shown(rms(measured, computed), 'um', 3)},"
        f" mean {shown(float(residual.mean()), 'um', 3)}, {count(len(y))} points"
    )
    if computed.label:
        low, high = (np.interp(y, computed.y, end) for end in (computed.low, computed.high))
        text += f", {shown(float(((height >= low) & (height <= high)).mean()), '%', 3)} in the band"
    return text


_WORN = 0.01  # part of the greatest depth above which a strip counts as worn
_DEEP = 0.3  # part of the greatest depth above which points give the middle of a groove
_FEWEST = 8  # unworn points on each side


def levelled(measured: Measured, computed: ComputedProfile) -> Measured:
    """Return a measured profile without offset, inclination and axial shift.

    Offset and inclination are those of the straight line through the points outside the computed
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
            what = "cannot be levelled: there is no unworn surface on both sides of the groove"
            raise ScenarioError(
                measured.label, [Mistake("", "", what, None, "a longer profile, or a levelled one")]
            )
        unworn = left | right
        start = np.interp(y - shift, computed.y, computed.start)
        line = np.polyfit(y[unworn], (height - start)[unworn], 1)
    return replace(measured, y=y - shift, height=height - np.polyval(line, y))


def _middle(y: FloatArray, depth: FloatArray) -> float:
    """Return the centroid of the deep part of a groove [m]."""
    deep = np.maximum(depth - _DEEP * depth.max(), 0.0)
    return float((deep * y).sum() / deep.sum())
