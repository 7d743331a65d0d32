"""Grooves of a worn cam at any angle, and its depth and lift error along the angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wearsim.studies.cam.observables import CURVE_ANGLES
from wearsim.studies.cam.turn import unchecked_turn_of
from wearsim.types import FloatArray

if TYPE_CHECKING:
    import xarray

    from wearsim.studies.run.result import Result


def grooves_at(result: Result, angle: float | None = None) -> tuple[FloatArray, float]:
    """Return the worn depth of a cam at every record, shape (records, strips) [m], and its angle.

    Parameters
    ----------
    result : Result
        Of a cam.
    angle : float, optional
        Angle of the cam [rad]; by default where it is worn deepest.
    """
    depth = np.asarray(result.raw.records["cylinder_depth_profile"])[:, :, 0]
    if angle is None:
        place = int(depth[-1].max(axis=1).argmax())
        return depth[:, place], float(result.raw.static["station_angle"][place])
    stations, turned = (
        unchecked_turn_of(result.scenario).stations,
        np.array([np.mod(angle, 2.0 * np.pi)]),
    )
    rows = stations.values_at_angles(depth.transpose(1, 0, 2), turned)[0]
    return np.maximum(rows, 0.0), float(angle)


def along_angle(result: Result) -> tuple[FloatArray, FloatArray]:
    """Return depth and lift error of a cam at `CURVE_ANGLES` at every record.

    Returns
    -------
    depth, lift_error : ndarray, shape (angles, records)
        Greatest depth across the track, and change of the lift by wear, which is the mean over the
        rollers [m].
    """
    records, stations = result.raw.records, unchecked_turn_of(result.scenario).stations
    deepest = np.asarray(records["cylinder_depth_profile"])[:, :, 0].max(axis=-1).T
    curves = np.asarray(records["lift_error_curve"])[..., 0].mean(axis=-1).T
    depth = np.maximum(stations.values_at_angles(deepest, CURVE_ANGLES), 0.0)
    return depth, stations.values_at_angles(curves, CURVE_ANGLES)


def with_angles(dataset: xarray.Dataset, result: Result) -> xarray.Dataset:
    """Return the dataset of a cam with depth and lift error along a coordinate "angle"."""
    depth, lift_error = along_angle(result)
    texts = {
        "depth_along_angle": (depth, "m", "greatest depth across the track"),
        "lift_error_along_angle": (lift_error, "m", "change of the lift by wear"),
    }
    follower = unchecked_turn_of(result.scenario).cam.follower
    if follower.swings:
        angle = lift_error / follower.lever
        texts["arm_error_along_angle"] = angle, "rad", "change of the angle of the arm by wear"
    return (
        dataset.assign_coords(
            angle=("angle", CURVE_ANGLES, {"units": "rad", "long_name": "angle of the cam"})
        )
        .assign(
            {
                name: (("record", "angle"), values.T, {"units": unit, "long_name": text})
                for name, (values, unit, text) in texts.items()
            }
        )
        .set_coords(["station_angle"])
    )
