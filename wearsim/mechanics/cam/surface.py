"""Points of a cam's surface and of its pitch curve, in the coordinates of the cam.

The polar angle of a point is about the angle of the cam at which it passes the roller: a cam that
turns clockwise below a roller on the axis x.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.cam.follower import Follower, RollerKinematics
from wearsim.types import FloatArray


def surface_points(
    follower: Follower,
    kinematics: RollerKinematics,
    theta: FloatArray,
    depth: FloatArray | float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Return the roller's centre, and the point of contact on the cam worn by a depth.

    Parameters
    ----------
    follower : Follower
    kinematics : RollerKinematics
        At the angles, arrays of shape (points,).
    theta : ndarray, shape (points,)
        Angles of the cam [rad].
    depth : ndarray, shape (points,), or float
        Worn depth, along the normal [m].

    Returns
    -------
    centre, contact : ndarray, shape (2, points)
        [m].
    """
    turned = np.exp(1j * np.asarray(theta))
    position = follower.rest + kinematics.lift
    if follower.swings:
        c, arm, sense = follower.centre_distance, follower.arm_length, follower.sense
        q = 1.0 + sense * kinematics.lift_per_rad
        x, y = c - arm * np.cos(position), arm * np.sin(position)
        normal_x, normal_y = c - q * arm * np.cos(position), q * arm * np.sin(position)
        centre = (x - 1j * sense * y) * turned
        normal = (normal_x - 1j * sense * normal_y) / kinematics.pitch_speed * turned
    else:
        centre = (position + 1j * follower.offset) * turned
        normal = np.exp(-1j * kinematics.pressure_angle) * turned
    radius = np.where(kinematics.spin < -1.0, -1.0, 1.0) * follower.roller_radius
    contact = centre - (radius + depth) * normal
    return np.stack([centre.real, centre.imag]), np.stack([contact.real, contact.imag])
