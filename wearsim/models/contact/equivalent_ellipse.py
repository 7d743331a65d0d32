"""The ellipse in strips of any shape, for theories that take flexibility from Kalker's ellipse."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.mechanics.hertz.ellipse import HertzContact
from wearsim.mechanics.tangential.kalker_coefficients import Flexibilities, one_flexibility
from wearsim.models.tangential.base import LocalSlip, Strips, load_weighted_mean
from wearsim.types import FloatArray

# covered less than this, a strip's load is all round-off and the square of its half-length zero
_SLIVER = 1e-12


@dataclass(frozen=True)
class EllipseStrips(Strips):
    """Strips cut from a Hertzian ellipse.

    `half_length` holds a(y) at the middle of the covered part of each strip, and `line_load` the
    mean of q(y) over the whole strip.

    Parameters
    ----------
    ellipse : HertzContact
        The patch.
    from_centre : ndarray, shape (strips,)
        Distance of the middle of each strip's covered part from the patch's centre [m].
    coverage : ndarray, shape (strips,)
        Part of each strip that the patch covers, 0 to 1; sums over a strip are weighted with it.
    """

    ellipse: HertzContact
    from_centre: FloatArray
    coverage: FloatArray

    def whole(self) -> Strips:
        """Return strips that carry their loads over their whole width.

        Where the patch covers a part of a strip the half-length falls as its root, which is what
        the strip's load presses together. A strip that the patch hardly reaches carries nothing.
        """
        reached = (self.coverage > _SLIVER) & (self.half_length > 0.0) & (self.line_load > 0.0)
        return Strips(
            y=self.y,
            half_length=np.where(reached, self.half_length * np.sqrt(self.coverage), 0.0),
            line_load=np.where(reached, self.line_load, 0.0),
            spacing=self.spacing,
            longitudinal_curvature=self.longitudinal_curvature,
            approach=self.approach,
            peak_pressure=self.peak_pressure,
            iterations=self.iterations,
        )


def covered_share(strips: Strips) -> FloatArray | float:
    """Return the part of each strip that is in contact, which weights sums over a strip."""
    return strips.coverage if isinstance(strips, EllipseStrips) else 1.0


def equivalent_ellipse(strips: Strips) -> tuple[float, float]:
    """Return the semi-axes a and b [m] of the ellipse whose flexibilities the strips get.

    Its half-length a is the greatest of the strips', and its area is theirs: b = area/(pi a). So
    b changes smoothly as strips come into contact, and a gap between two patches counts for
    nothing. An ellipse gives itself.
    """
    if isinstance(strips, EllipseStrips):
        return strips.ellipse.a, strips.ellipse.b
    a = float(strips.half_length.max())
    area = 2.0 * float(strips.half_length.sum()) * strips.spacing
    return a, area / (math.pi * a)


def peak_pressure(strips: Strips, *, elliptic: bool) -> FloatArray:
    """Return the elliptic or parabolic pressure at x = 0, shape (strips,) [Pa].

    On an ellipse the parabolic one is Kalker's paraboloid; on other strips both carry the strip's
    own line load.
    """
    if isinstance(strips, EllipseStrips):
        patch = strips.ellipse
        t = strips.from_centre / patch.b
        section = np.where(strips.coverage > 0.0, np.maximum((1.0 - t) * (1.0 + t), 0.0), 0.0)
        if elliptic:
            return patch.peak_pressure * np.sqrt(section)
        return 2.0 * patch.normal_force / (math.pi * patch.a * patch.b) * section
    inside = strips.half_length > 0.0
    mean = strips.line_load / np.where(inside, strips.half_length, 1.0)
    return np.where(inside, (2.0 / math.pi if elliptic else 0.75) * mean, 0.0)


def single_flexibility(strips: Strips, flexibility: Flexibilities, slip: LocalSlip) -> float:
    """Return the one flexibility [m/Pa] that stands for three under the strips' creepage.

    Longitudinal creepage counts with its mean magnitude, spin with sqrt(ab) of the equivalent
    ellipse.
    """
    a, b = equivalent_ellipse(strips)
    return one_flexibility(
        flexibility.longitudinal,
        flexibility.lateral,
        flexibility.spin,
        load_weighted_mean(strips, np.abs(slip.longitudinal - slip.spin_part)),
        float(slip.lateral),
        float(slip.spin) * math.sqrt(a * b),
    )


def touching(strips: Strips) -> slice:
    """Return the strips from the first to the last in contact."""
    inside = np.flatnonzero(strips.half_length > 0.0)
    return slice(int(inside[0]), int(inside[-1]) + 1)
