"""Shared types: materials, grids, operating points and contact solutions, in SI units."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.errors import ScenarioError, mistake_in

FloatArray: TypeAlias = npt.NDArray[np.float64]

SingleArray: TypeAlias = npt.NDArray[np.float32]

IntArray: TypeAlias = npt.NDArray[np.int64]

BoolArray: TypeAlias = npt.NDArray[np.bool_]

#: A number for all realisations, or one per realisation, shape (realisations,).
Number: TypeAlias = float | FloatArray
_MOST_Y = 4.0  # m: a wider profile is in other units


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
        Indentation hardness [Pa], for wear laws and warnings.
    yield_stress : float, optional
        Yield stress [Pa], for warnings.
    """

    youngs_modulus: float
    poisson_ratio: float
    hardness: float | None = None
    yield_stress: float | None = None


@dataclass(frozen=True, eq=False)
class Grid:
    """Strips of equal width across the track.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of each strip's centre [m], increasing, equally spaced.
    spacing : float
        Width of a strip [m].

    Attributes
    ----------
    strips : int
        Number of strips.
    """

    y: FloatArray
    spacing: float
    strips: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "strips", self.y.size)

    @classmethod
    def spanning(cls, start: float, stop: float, strips: int) -> Grid:
        """Return the interval from `start` to `stop` [m] divided into `strips` equal strips."""
        spacing = (stop - start) / strips
        # offsets from the middle: a symmetric interval gives a grid symmetric to the bit
        offsets = np.arange(strips, dtype=np.float64) - 0.5 * (strips - 1)
        return cls(y=0.5 * (start + stop) + offsets * spacing, spacing=spacing)

    @property
    def edges(self) -> tuple[float, float]:
        """Positions of the outer edges of the first and the last strip [m]."""
        return float(self.y[0]) - 0.5 * self.spacing, float(self.y[-1]) + 0.5 * self.spacing


@dataclass(frozen=True, eq=False)
class Profile:
    """A measured or computed surface height across the track.

    Parameters
    ----------
    y : ndarray, shape (points,)
        Axial position [m], increasing.
    height : ndarray, shape (points,)
        Height of the surface above its nominal shape [m]; worn material is negative.

    Raises
    ------
    ScenarioError
        If these are not two sequences of as many finite numbers, y does not increase, or the
        numbers cannot be metres.

    Examples
    --------
    >>> import numpy as np
    >>> y = np.linspace(-8e-3, 8e-3, 101)
    >>> worn = wearsim.Profile(y, -20e-6 * np.exp(-((y / 3e-3) ** 2)))
    >>> solution = wearsim.solve_contact("rig.toml", worn)
    >>> bool(solution.peak_pressure < wearsim.solve_contact("rig.toml").peak_pressure)
    True
    """

    y: FloatArray
    height: FloatArray

    def __post_init__(self) -> None:
        for name in ("y", "height"):
            try:
                given: Any = np.ma.array(getattr(self, name))
                if np.iscomplexobj(given):
                    raise TypeError("complex numbers")
                values = given.astype(np.float64).filled(np.nan)
            except (TypeError, ValueError) as error:
                raise _profile_error(name, "is not a sequence of numbers") from error
            object.__setattr__(self, name, values)
            if values.ndim != 1 or len(values) < 2:
                raise _profile_error(
                    name, "is not a sequence of points", f"shape {values.shape}", "two or more"
                )
            for point in np.flatnonzero(~np.isfinite(values)):  # the first one
                raise _profile_error(name, f"is not finite at point {point}", f"{values[point]}")
        if len(self.y) != len(self.height):
            raise _profile_error(
                "",
                "y and height have different lengths",
                f"{len(self.y)} values of y and {len(self.height)} of height",
            )
        steps = np.diff(self.y)
        if not (steps > 0.0).all():
            remedy = "increasing y; reverse both arrays" if (steps < 0.0).all() else "increasing y"
            place = int(np.flatnonzero(steps <= 0.0)[0])
            got = f"{self.y[place]:g} m, then {self.y[place + 1]:g} m"
            raise _profile_error("y", "does not increase", got, remedy)
        for name, most in (("y", _MOST_Y), ("height", 0.5 * np.ptp(self.y))):
            span = float(np.ptp(getattr(self, name)))
            if span > most:
                over = "" if name == "y" else f" over {np.ptp(self.y):.4g} m of y"
                remedy = "metres: multiply mm by 1e-3, um by 1e-6"
                raise _profile_error(
                    name, "has a range that cannot be", f"{span:.4g} m{over}", remedy
                )

    def __repr__(self) -> str:
        y, height = self.y * 1e3, self.height * 1e6
        return (
            f"<Profile: {len(y)} points, y {y[0]:.4g} to {y[-1]:.4g} mm,"
            f" height {height.min():.4g} to {height.max():.4g} um>"
        )


def _profile_error(
    key: str, what: str, got: str | None = None, expected: str | None = None
) -> ScenarioError:
    return mistake_in("profile", what, got, expected, key=key)


@dataclass(frozen=True, eq=False)
class Creepage:
    """Rigid slip of body 1 (the cylinder) on body 2 (the roller), per unit of rolling velocity.

    The local longitudinal creepage of a strip is ``longitudinal + g(y) - <g>``, where ``<g>`` is
    the mean of g weighted by the line load, so that `longitudinal` is always the mean creepage of
    the contact. g is `variation` if given and ``-spin * y`` otherwise. In both cases the lateral
    creepage varies by ``spin * x`` along rolling.

    Parameters
    ----------
    longitudinal : float
        Mean longitudinal creepage xi.
    lateral : float
        Lateral creepage eta.
    spin : float
        Spin phi [1/m].
    variation : ndarray, shape (strips,), optional
        Variation g of the longitudinal creepage across the strips, including that due to spin.
    """

    longitudinal: float
    lateral: float = 0.0
    spin: float = 0.0
    variation: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """Load, speed, creepage and friction of one contact.

    Parameters
    ----------
    normal_force : float
        Load N [N].
    rolling_speed : float
        Rolling velocity V [m/s].
    creepage : Creepage
        Prescribed creepage; with a bearing torque its longitudinal value is an initial guess.
    friction : float or ndarray, shape (strips,) or (points, strips)
        Friction coefficient mu: one value, one per strip, or one per point of each strip from the
        leading edge on, at the points of `ContactModel.friction_points`.
    bearing_torque : float, optional
        Torque [N m] of the roller's bearing. If given, the mean longitudinal creepage follows from
        the torque balance of the roller.
    rolling_radius : ndarray, shape (strips,), optional
        Lever arm of each strip's longitudinal traction about the roller's axis [m]; required with
        a bearing torque.
    friction_carried : bool
        Each point of a strip is a particle that keeps its friction while it crosses the contact,
        as for a friction pattern fixed to a body; the solution is the mean over the particles.
    """

    normal_force: float
    rolling_speed: float
    creepage: Creepage
    friction: float | FloatArray
    bearing_torque: float | None = None
    rolling_radius: FloatArray | None = None
    friction_carried: bool = False


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Solution of one contact; tractions act on body 1 and oppose positive creepage.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of the strips [m].
    half_length : ndarray, shape (strips,)
        Half-length a(y) of the contact along rolling [m]; 0 outside the contact.
    line_load : ndarray, shape (strips,)
        Normal force per unit of axial length q(y) [N/m].
    dissipation : ndarray, shape (strips,)
        Dissipated power per unit of axial length P_l(y) [W/m].
    force_x, force_y : float
        Longitudinal and lateral force on body 1 [N].
    spin_moment : float
        Moment of the tractions on body 1 about the contact normal through the load's centre [N m].
    approach : float
        Approach delta of the bodies, measured from gap zero [m].
    peak_pressure : float
        Greatest normal pressure [Pa].
    adhesion_fraction : float
        Adhesion area over contact area, 0 to 1.
    power : float
        Dissipated power P_d, the sum of `dissipation` over the strips [W].
    longitudinal_creepage : float
        Mean longitudinal creepage; result of the torque balance if a bearing torque is given.
    iterations : int
        Iterations of the normal problem.

    Examples
    --------
    >>> solution = wearsim.solve_contact("rig.toml")
    >>> spacing = solution.y[1] - solution.y[0]
    >>> print(f"{solution.line_load.sum() * spacing:.1f} N")
    300.0 N
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

    def __repr__(self) -> str:
        return (
            f"<ContactSolution: {len(self.y)} strips, approach {self.approach * 1e6:.4g} um, peak"
            f" pressure {self.peak_pressure / 1e6:.4g} MPa, power {self.power:.4g} W>"
        )


@dataclass(frozen=True, eq=False)
class ContactFields:
    """Fields within one contact, at points along each strip from trailing to leading edge.

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
        Whether the surfaces adhere.
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
