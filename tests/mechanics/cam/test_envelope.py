"""Kinematics of the roller against direct differentiation of the envelope of its positions."""

from __future__ import annotations

import numpy as np
import pytest
from cams import MM, Waves, random_follower

STEP = np.longdouble("0.02")
#: central differences of order 8: weights of f(theta + k h), over h, for k = -4 to 4 without 0
_HALF = [np.longdouble(a) / np.longdouble(b) for a, b in ((4, 5), (-1, 5), (4, 105), (-1, 280))]
WEIGHTS = np.array([-w for w in _HALF[::-1]] + _HALF) / STEP
OFFSETS = STEP * np.array([-4, -3, -2, -1, 1, 2, 3, 4])


def derivative(function, theta):
    """Return the derivative of a function of the angle in extended precision."""
    return (function(theta[..., None] + OFFSETS) * WEIGHTS).sum(axis=-1)


class Envelope:
    """Positions of a roller in the ground and in the cam, which turns counter-clockwise."""

    def __init__(self, follower, lift, inner):
        self.follower, self.lift = follower, lift
        self.radius = -follower.roller_radius if inner else follower.roller_radius
        # the same as a cam that turns clockwise, seen from behind
        self.sense = -1.0 if follower.towards else 1.0

    def ground(self, theta):
        """Return the roller's centre in the ground."""
        position = self.follower.rest + self.lift(theta)[0]
        if not self.follower.swings:
            return np.stack([np.full_like(position, self.follower.offset), position])
        c, arm = self.follower.centre_distance, self.follower.arm_length
        return np.stack([c - arm * np.cos(position), arm * np.sin(position)])

    def pitch(self, theta):
        """Return the roller's centre in the cam."""
        x, y = self.ground(theta)
        cosine, sine = np.cos(self.sense * theta), np.sin(self.sense * theta)
        return np.stack([cosine * x + sine * y, -sine * x + cosine * y])

    def to_ground(self, theta, vector):
        """Return a vector of the cam in the ground."""
        cosine, sine = np.cos(self.sense * theta), np.sin(self.sense * theta)
        return np.stack(
            [cosine * vector[0] - sine * vector[1], sine * vector[0] + cosine * vector[1]]
        )

    def normal(self, theta):
        """Return the outward normal of the pitch curve in the cam."""
        x, y = self.sense * derivative(self.pitch, theta)
        return np.stack([-y, x]) / np.hypot(x, y)

    def surface(self, theta):
        """Return the point of contact in the cam."""
        return self.pitch(theta) - self.radius * self.normal(theta)


@pytest.mark.parametrize("inner", [False, True], ids=["outer", "inner"])
@pytest.mark.parametrize("kind", ["translating", "swinging"])
def test_kinematics_agree_with_the_envelope_in_random_cams(kind, inner):
    theta = np.linspace(0.0, 5.0, 3).astype(np.longdouble)
    for seed in range(20):
        generator = np.random.default_rng([seed, len(kind)])
        follower = random_follower(generator, kind)
        lift = Waves(generator, 0.02 if follower.swings else 1.0 * MM)
        found = follower.kinematics(lift(theta.astype(np.float64)), inner)
        envelope = Envelope(follower, lift, inner)
        first = derivative(envelope.surface, theta)
        second = derivative(lambda at, e=envelope: derivative(e.surface, at), theta)
        normal, travel = envelope.normal(theta), np.hypot(*first)
        bend = -(second * normal).sum(axis=0) / travel**2
        assert found.travel == pytest.approx(np.sign(found.travel) * travel, rel=1e-8)
        assert found.curvature == pytest.approx(bend, rel=1e-8, abs=1e-7)

        # the roller's centre moves along its path at the pressure angle to the normal
        ground = derivative(envelope.ground, theta)
        turned = envelope.to_ground(theta, normal)
        along = (ground * turned).sum(axis=0)
        rate = follower.lever * found.lift_per_rad * np.cos(found.pressure_angle)
        assert along == pytest.approx(rate, abs=1e-8 * float(np.hypot(*ground).max()))

        # surfaces roll: the roller turns by the travel, less the turn of the normal in the ground
        swing = derivative(lambda at, e=envelope: e.to_ground(at, e.normal(at)), theta)
        turn = envelope.sense * (turned[0] * swing[1] - turned[1] * swing[0])
        spin = found.travel / envelope.radius - turn
        assert found.spin == pytest.approx(spin, rel=1e-8, abs=1e-8)
        speed = derivative(lambda at, e=envelope: np.hypot(*derivative(e.pitch, at)), theta)
        assert found.spin_per_rad * envelope.radius == pytest.approx(speed, rel=1e-7, abs=1e-9)
