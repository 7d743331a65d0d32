"""Kinematics and load of a roller follower on a cam.

theta is the angle by which the cam has turned, and a prime is the derivative by theta. s is the
lift of a translating follower [m], or the angle of a swinging arm above its rest position [rad].
The pitch curve is the path of the roller's centre in the cam. All equations are in angles, so that
the cam's speed omega is a factor: the rolling speed is omega times `travel`.

Translating, offset e: u = sqrt(R_p^2 - e^2) + s, v = s' - e, g^2 = u^2 + v^2,
kappa_p = (g^2 + v s' - u s'')/g^3, alpha = atan2(v, u), with R_p = R_base + R_roller.

Swinging, distance c of the axes, arm l at the angle psi to the line of centres, q = 1 + psi', or
1 - psi' where the cam's surface runs towards the pivot: g^2 = c^2 + l^2 q^2 - 2 c l q cos psi,
kappa_p = (c^2 + l^2 q^3 - c l q (1 + q) cos psi - c l sin psi psi'')/g^3,
alpha = +-atan2(l q - c cos psi, c sin psi).

Any follower, with R = R_roller, or -R_roller on the inner flank of a groove:
kappa_c = kappa_p/(1 - R kappa_p), V = omega g (1 - R kappa_p), Omega = omega (g/R - 1).

The curvatures are those of a plane curve and of the curve parallel to it, with the velocity of the
roller's centre against the cam: Norton, Cam Design and Manufacturing Handbook (2009), chapter 7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from wearsim.types import BoolArray, FloatArray

FollowerKind: TypeAlias = Literal["translating", "swinging"]


@dataclass(frozen=True)
class RollerKinematics:
    """Motion of the follower and rolling of its roller at some angles, arrays of one shape.

    Parameters
    ----------
    lift, lift_per_rad, lift_per_rad2 : ndarray
        Lift and its derivatives by the cam's angle [m or rad].
    pressure_angle : ndarray
        Angle alpha between the common normal and the motion of the roller's centre [rad].
    pitch_speed : ndarray
        Speed g of the roller's centre against the cam, per speed of the cam [m].
    pitch_curvature : ndarray
        Curvature of the pitch curve, positive where it is convex [1/m].
    curvature : ndarray
        Curvature of the cam's surface, positive where it is convex [1/m].
    relative_curvature : ndarray
        Relative curvature of cam and roller along rolling [1/m].
    travel : ndarray
        Length of surface that passes the contact per angle; rolling speed per speed of the cam [m].
    spin : ndarray
        Speed of the rolling roller against the ground, per speed of the cam.
    spin_per_rad : ndarray
        Its derivative by the cam's angle.
    """

    lift: FloatArray
    lift_per_rad: FloatArray
    lift_per_rad2: FloatArray
    pressure_angle: FloatArray
    pitch_speed: FloatArray
    pitch_curvature: FloatArray
    curvature: FloatArray
    relative_curvature: FloatArray
    travel: FloatArray
    spin: FloatArray
    spin_per_rad: FloatArray


@dataclass(frozen=True)
class Follower:
    """A roller follower: its geometry and the radii of roller and base circle.

    Parameters
    ----------
    base_radius, roller_radius : float
        Radii [m].
    kind : {"translating", "swinging"}
        Path of the roller's centre.
    offset : float
        Offset of a translating follower, positive where it lowers the pressure angle of the rise
        [m].
    centre_distance, arm_length : float
        Distance of the axes of cam and arm, and length of the arm [m].
    towards : bool
        Whether the cam's surface at the roller runs towards the pivot of the arm.

    Raises
    ------
    ValueError
        If the roller cannot rest on the base circle.

    Examples
    --------
    An involute cam, whose lift is proportional to the angle, with the offset for which its
    pressure angle is zero.

    >>> follower = Follower(base_radius=20e-3, roller_radius=20e-3, offset=6e-3)
    >>> found = follower.kinematics(np.array([6e-3 * np.pi / 6.0, 6e-3, 0.0]))
    >>> print(f"{found.pressure_angle:.6f} {found.travel:.9f} m {found.spin:.6f}")
    0.000000 0.022689033 m 1.134452
    """

    base_radius: float
    roller_radius: float
    kind: FollowerKind = "translating"
    offset: float = 0.0
    centre_distance: float = 0.0
    arm_length: float = 0.0
    towards: bool = False

    def __post_init__(self) -> None:
        radius, c, arm = self.pitch_radius, self.centre_distance, self.arm_length
        if self.kind == "translating" and abs(self.offset) >= radius:
            raise ValueError(
                f"an offset of {1e3 * self.offset:.6g} mm does not reach the pitch circle, whose"
                f" radius is {1e3 * radius:.6g} mm"
            )
        if self.kind == "swinging" and not abs(c - arm) < radius < c + arm:
            raise ValueError(
                f"an arm of {1e3 * arm:.6g} mm at {1e3 * c:.6g} mm does not reach the pitch"
                f" circle, whose radius is {1e3 * radius:.6g} mm"
            )

    @cached_property
    def swings(self) -> bool:
        """Whether the follower is an arm."""
        return self.kind == "swinging"

    @property
    def pitch_radius(self) -> float:
        """Radius of the pitch circle, base and roller radius together [m]."""
        return self.base_radius + self.roller_radius

    @cached_property
    def rest(self) -> float:
        """Position u of the roller's centre [m] or angle psi of the arm [rad] without lift."""
        radius, c, arm = self.pitch_radius, self.centre_distance, self.arm_length
        if self.swings:
            return math.acos((c * c + arm * arm - radius * radius) / (2.0 * c * arm))
        return math.sqrt(radius * radius - self.offset * self.offset)

    @cached_property
    def sense(self) -> float:
        """Sense in which the cam turns: -1 where its surface at the roller runs to the pivot."""
        return -1.0 if self.swings and self.towards else 1.0

    @cached_property
    def lever(self) -> float:
        """Displacement of the roller's centre per lift: 1, or the length of the arm [m]."""
        return self.arm_length if self.swings else 1.0

    def kinematics(self, lift: FloatArray, inner: BoolArray | bool = False) -> RollerKinematics:
        """Return the kinematics at given lifts.

        Parameters
        ----------
        lift : ndarray, shape (3, ...)
            Lift and its first and second derivative by the cam's angle [m or rad].
        inner : ndarray of bool or bool
            Where the roller touches the inner flank of a groove.
        """
        s, slope, second = lift
        speed, curvature, angle, speed_rate = (self._arm if self.swings else self._slide)(lift)
        side = np.where(inner, -1.0, 1.0)
        ratio = 1.0 - side * self.roller_radius * curvature
        with np.errstate(divide="ignore"):
            surface = curvature / ratio
        shape = np.broadcast(s, side).shape
        columns = {
            "lift": s,
            "lift_per_rad": slope,
            "lift_per_rad2": second,
            "pressure_angle": angle,
            "pitch_speed": speed,
            "pitch_curvature": curvature,
            "curvature": surface,
            "relative_curvature": side * surface + 1.0 / self.roller_radius,
            "travel": speed * ratio,
            "spin": side * speed / self.roller_radius - 1.0,
            "spin_per_rad": side * speed_rate / self.roller_radius,
        }
        return RollerKinematics(
            **{n: a if a.shape == shape else np.broadcast_to(a, shape) for n, a in columns.items()}
        )

    def _slide(self, lift: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return g, kappa_p, alpha and g' of a translating follower."""
        s, slope, second = lift
        u, v = self.rest + s, slope - self.offset
        speed = np.hypot(u, v)
        curvature = (speed**2 + v * slope - u * second) / speed**3
        return speed, curvature, np.arctan2(v, u), (u * slope + v * second) / speed

    def _arm(self, lift: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return g, kappa_p, alpha and g' of a swinging follower."""
        s, slope, second = lift
        c, arm, sense = self.centre_distance, self.arm_length, self.sense
        psi, q = self.rest + s, 1.0 + sense * slope
        cosine, sine = np.cos(psi), np.sin(psi)
        speed = np.sqrt(c * c + arm * arm * q * q - 2.0 * c * arm * q * cosine)
        curvature = (
            c * c + arm * arm * q**3 - c * arm * q * (1.0 + q) * cosine - c * arm * sine * second
        ) / speed**3
        change = sense * second
        rate = arm * (arm * q * change - c * change * cosine + c * q * sine * slope) / speed
        return speed, curvature, sense * np.arctan2(arm * q - c * cosine, c * sine), rate

    def normal_force(self, kinematics: RollerKinematics, effort: FloatArray) -> FloatArray:
        """Return the normal force N [N] under the force [N] or torque [N m] on the follower."""
        return effort / (self.lever * np.cos(kinematics.pressure_angle))
