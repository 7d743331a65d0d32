"""The words every room shares: materials, grids, operating points and contact solutions, in SI."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]

IntArray: TypeAlias = npt.NDArray[np.int64]

BoolArray: TypeAlias = npt.NDArray[np.bool_]

Number: TypeAlias = float | FloatArray
"""One number for all realisations, or one for each, shape (realisations,)."""


@dataclass(frozen=True)
class Material:
    """An isotropic elastic body.

    Parameters
    ----------
    youngs_modulus : float
        Young's modulus [Pa].
    poisson_ratio : float
        Poisson's ratio, 0 to 0.5.
    hardness : float, optional
        Indentation hardness [Pa], for wear laws that need it.
    """

    youngs_modulus: float
    poisson_ratio: float
    hardness: float | None = None


@dataclass(frozen=True)
class Grid:
    """Strips of equal width across the track; `y` holds their centres.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of each strip's centre [m], rising, equally spaced.
    spacing : float
        Width of a strip [m].
    """

    y: FloatArray
    spacing: float

    @classmethod
    def spanning(cls, start: float, stop: float, strips: int) -> Grid:
        """Cut the interval from `start` to `stop` [m] into `strips` equal strips."""
        spacing = (stop - start) / strips
        centre = 0.5 * (start + stop)
        # counted from the middle, so that a symmetric interval gives a grid symmetric to the bit
        offsets = np.arange(strips, dtype=np.float64) - 0.5 * (strips - 1)
        return cls(y=centre + offsets * spacing, spacing=spacing)

    @property
    def strips(self) -> int:
        """Number of strips."""
        return len(self.y)


@dataclass(frozen=True)
class Profile:
    """A measured or computed surface height across the track.

    Parameters
    ----------
    y : ndarray, shape (points,)
        Axial position [m], rising.
    height : ndarray, shape (points,)
        Height of the surface above its nominal shape [m]; worn material is negative.
    """

    y: FloatArray
    height: FloatArray


@dataclass(frozen=True)
class Creepage:
    """Rigid slip of body 1 (the cylinder) on body 2 (the roller), per unit of rolling velocity.

    The local longitudinal creepage of a strip is ``longitudinal + g(y) - <g>``, where ``<g>`` is
    the mean of g weighted by the line load, so that `longitudinal` is always the mean creepage of
    the contact. g is `variation` where it is given and ``-spin * y`` otherwise; either way `spin`
    times x is the lateral part that varies along rolling.

    Parameters
    ----------
    longitudinal : float
        Mean longitudinal creepage xi.
    lateral : float
        Lateral creepage eta.
    spin : float
        Spin phi [1/m].
    variation : ndarray, shape (strips,), optional
        Variation g of the longitudinal creepage across the strips, spin's part included.
    """

    longitudinal: float
    lateral: float = 0.0
    spin: float = 0.0
    variation: FloatArray | None = None


@dataclass(frozen=True)
class OperatingPoint:
    """What is asked of one contact.

    Parameters
    ----------
    normal_force : float
        Load N [N].
    rolling_speed : float
        Rolling velocity V [m/s].
    creepage : Creepage
        Prescribed creepage; under a bearing torque its longitudinal value is only a first guess.
    friction : float or ndarray, shape (strips,) or (points, strips)
        Friction coefficient mu: one value, one per strip, or one for each of a strip's points,
        from the leading edge on, which the model names (`ContactModel.friction_points`).
    bearing_torque : float, optional
        Torque [N m] that the contact must carry to the roller's bearing. When given, the mean
        longitudinal creepage follows from the balance of torque.
    rolling_radius : ndarray, shape (strips,), optional
        Arm of each strip's longitudinal traction about the roller's axis [m]; needed with a
        bearing torque.
    friction_carried : bool
        Each of a strip's points is a particle that keeps its friction while it crosses the contact,
        as where the pattern is fixed to a body; what is solved is the mean over the particles.
    """

    normal_force: float
    rolling_speed: float
    creepage: Creepage
    friction: float | FloatArray
    bearing_torque: float | None = None
    rolling_radius: FloatArray | None = None
    friction_carried: bool = False

    @property
    def kind(self) -> tuple[object, ...]:
        """What points must have in common to be columns of `OperatingPoints`."""
        return (
            self.rolling_speed,
            self.bearing_torque,
            np.shape(self.friction),
            self.friction_carried,
            self.creepage.variation is None,
        )


@dataclass(frozen=True)
class ContactSolution:
    """One solved contact, strip by strip; tractions act on body 1 and oppose positive creepage.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of the strips [m].
    half_length : ndarray, shape (strips,)
        Half-length a(y) of the contact along rolling [m]; 0 outside it.
    line_load : ndarray, shape (strips,)
        Normal force per unit of axial length q(y) [N/m].
    dissipation : ndarray, shape (strips,)
        Dissipated power per unit of axial length P_l(y) [W/m].
    force_x, force_y : float
        Longitudinal and lateral force on body 1 [N].
    spin_moment : float
        Moment of the tractions on body 1 about the contact normal through the load's centre [N m].
    approach : float
        Approach of the bodies delta, measured from gap zero [m].
    peak_pressure : float
        Greatest normal pressure [Pa].
    adhesion_fraction : float
        Part of the contact's area that adheres, 0 to 1.
    power : float
        Dissipated power P_d, the sum of `dissipation` over the strips [W].
    longitudinal_creepage : float
        Mean longitudinal creepage, found by torque balance where a bearing torque is given.
    iterations : int
        Iterations the normal problem took.
    """

    y: FloatArray
    half_length: FloatArray
    line_load: FloatArray
    dissipation: FloatArray
    force_x: float
    force_y: float
    spin_moment: float
    approach: float
    peak_pressure: float
    adhesion_fraction: float
    power: float
    longitudinal_creepage: float
    iterations: int


@dataclass(frozen=True)
class ContactFields:
    """The inside of one contact, on points that follow each strip from trailing to leading edge.

    Parameters
    ----------
    x : ndarray, shape (points, strips)
        Position along rolling [m].
    y : ndarray, shape (strips,)
        Axial position [m].
    pressure, traction_x, traction_y : ndarray, shape (points, strips)
        Normal pressure and tangential traction on body 1 [Pa].
    slip_x, slip_y : ndarray, shape (points, strips)
        Slip of body 1 on body 2 per unit of rolling velocity.
    adhesion : ndarray of bool, shape (points, strips)
        Where the surfaces adhere.
    power_density : ndarray, shape (points, strips)
        Dissipated power per unit of area [W/m^2].
    """

    x: FloatArray
    y: FloatArray
    pressure: FloatArray
    traction_x: FloatArray
    traction_y: FloatArray
    slip_x: FloatArray
    slip_y: FloatArray
    adhesion: BoolArray
    power_density: FloatArray
