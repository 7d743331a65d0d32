"""State of follower and roller at angles of a cam."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.mechanics.cam import RollerKinematics
from wearsim.types import BoolArray, FloatArray


@dataclass(frozen=True)
class Point:
    """State of follower and roller at some angles, arrays of one shape.

    Parameters
    ----------
    angle : ndarray
        Angle of the cam [rad].
    kinematics : RollerKinematics
        Motion and rolling.
    inner : ndarray of bool
        Whether the roller touches the inner flank of a groove.
    normal_force : ndarray
        Normal force N on the flank in contact; not positive where an outer roller loses it [N].
    drive_torque : ndarray
        Torque on the cam without losses [N m].
    stiffness : ndarray
        Decrease of N per displacement of the roller along the normal [N/m].
    """

    angle: FloatArray
    kinematics: RollerKinematics
    inner: BoolArray
    normal_force: FloatArray
    drive_torque: FloatArray
    stiffness: FloatArray
