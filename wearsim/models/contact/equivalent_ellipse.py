"""Equivalent ellipse of strips, for theories whose flexibilities are those of an ellipse."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.mechanics.hertz.ellipse import HertzContact
from wearsim.mechanics.tangential.kalker_coefficients import Flexibilities, one_flexibility
from wearsim.models.tangential.base import LocalSlip, Strips, load_weighted_mean
from wearsim.types import FloatArray

# below this coverage the load of a strip is round-off and the square of its half-length zero
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
        Distance of the middle of the covered part from the centre of the patch [m].
    coverage : ndarray, shape (strips,)
        Fraction of each strip covered by the patch, the weight of integrals over a strip.
    """

    ellipse: HertzContact
    from_centre: FloatArray
    coverage: FloatArray

    def whole(self) -> Strips:
        """Return strips that carry their loads over their whole width.

        The half-length of a partly covered strip is reduced by the square root of its coverage,
        which is the half-length that its load produces. A coverage of round-off counts as zero.
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
    """Return the fraction of each strip in contact, the weight of integrals over a strip."""
    return strips.coverage if isinstance(strips, EllipseStrips) else 1.0


def equivalent_ellipse(strips: Strips) -> tuple[float, float]:
    """Return the semi-axes a and b [m] of the ellipse whose flexibilities the strips have.

    a is the largest half-length of the strips, and the area is theirs: b = area/(pi a). Hence b
    changes smoothly as strips come into contact, and a gap between two patches has no effect. The
    equivalent ellipse of an ellipse is the ellipse itself.
    """
    if isinstance(strips, EllipseStrips):
        return strips.ellipse.a, strips.ellipse.b
    a = float(strips.half_length.max())
    area = 2.0 * float(strips.half_length.sum()) * strips.spacing
    return a, area / (math.pi * a)


def peak_pressure(strips: Strips, *, elliptic: bool) -> FloatArray:
    """Return the elliptic or parabolic pressure at x = 0, shape (strips,) [Pa].

    On an ellipse the parabolic pressure is Kalker's paraboloid; otherwise both pressures have the
    line load of each strip.
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
    """Return the single flexibility [m/Pa] that replaces Kalker's three at this creepage.

    The weights are the mean magnitude of the longitudinal creepage, the lateral creepage and the
    spin times sqrt(ab) of the equivalent ellipse.
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
    """Return the slice from the first to the last strip in contact."""
    inside = np.flatnonzero(strips.half_length > 0.0)
    return slice(int(inside[0]), int(inside[-1]) + 1)
