"""Grooves of a worn cam at any angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wearsim.studies.cam.turn import CamTurn
from wearsim.types import FloatArray

if TYPE_CHECKING:
    from wearsim.studies.run.result import Result


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
