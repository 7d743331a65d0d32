"""Base class of tangential theories: strips, equivalent ellipse, creepage, torque and sums."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.hertz.ellipse import HertzContact
from wearsim.models.tangential.torque_balance import balanced_creepage
from wearsim.types import ContactFields, ContactSolution, FloatArray, OperatingPoint

# below this coverage the load of a strip is round-off and the square of its half-length zero
_SLIVER = 1e-12


@dataclass(frozen=True)
class Strips:
    """Solved normal contact.

    Parameters
    ----------
    y, half_length, line_load : ndarray, shape (strips,)
        Position [m], half-length a(y) [m] and line load q(y) [N/m]; a = q = 0 outside the contact.
    spacing : float
        Width of a strip [m].
    longitudinal_curvature : float
        Relative curvature along rolling [1/m].
    approach, peak_pressure : float
        Approach [m] and maximum pressure [Pa].
    iterations : int
        Iterations of the normal problem.
    """

    y: FloatArray
    half_length: FloatArray
    line_load: FloatArray
    spacing: float
    longitudinal_curvature: float
    approach: float
    peak_pressure: float
    iterations: int


@dataclass(frozen=True)
class LocalSlip:
    """Rigid slip of each strip per unit of rolling velocity.

    Parameters
    ----------
    longitudinal : ndarray, shape (strips,)
        Local longitudinal creepage xi(y), including the contribution of spin.
    spin_part : ndarray, shape (strips,)
        Contribution of spin, for theories with a separate flexibility for spin.
    lateral, spin : float
        Lateral creepage eta, and spin phi [1/m], which adds phi x to it.
    """

    longitudinal: FloatArray
    spin_part: FloatArray
    lateral: float
    spin: float


@dataclass(frozen=True)
class Tractions:
    """Solution of the tangential problem per strip; forces act on body 1.

    Parameters
    ----------
    force_x, force_y : ndarray, shape (strips,)
        Integral of the traction along the strip [N/m].
    moment : ndarray, shape (strips,)
        Integral of x times the lateral traction along the strip [N].
    dissipation : ndarray, shape (strips,)
        Dissipated power per unit of axial length P_l [W/m].
    adhesion_length : ndarray, shape (strips,)
        Length of the adhesion zone along rolling [m].
    """

    force_x: FloatArray
    force_y: FloatArray
    moment: FloatArray
    dissipation: FloatArray
    adhesion_length: FloatArray


class TangentialTheory(ABC):
    """Solver of the tangential problem on given strips.

    Attributes
    ----------
    knows_ellipses : bool
        Whether `EllipseStrips` with partly covered strips are supported.
    """

    knows_ellipses: ClassVar[bool] = False

    @abstractmethod
    def tractions(
        self,
        strips: Strips,
        pair: ElasticPair,
        slip: LocalSlip,
        friction: FloatArray,
        rolling_speed: float,
    ) -> Tractions:
        """Return the tractions for a local slip and `friction`, shape (strips,)."""

    @abstractmethod
    def fields(
        self,
        strips: Strips,
        pair: ElasticPair,
        slip: LocalSlip,
        friction: FloatArray,
        rolling_speed: float,
        points_along: int,
    ) -> ContactFields:
        """Return pressure, traction and slip in the contact, (points_along, strips)."""


def load_weighted_mean(strips: Strips, values: FloatArray) -> float:
    """Return the mean of `values`, shape (strips,), weighted with the line load."""
    return float(np.dot(values, strips.line_load) / strips.line_load.sum())


def local_slip(strips: Strips, point: OperatingPoint, longitudinal: float) -> LocalSlip:
    """Return the local creepage for the mean creepage `longitudinal`; see `Creepage`."""
    creepage, zero = point.creepage, np.zeros_like(strips.y)
    if creepage.variation is None and creepage.spin == 0.0:
        return LocalSlip(zero + longitudinal, zero, creepage.lateral, 0.0)
    by_spin = creepage.variation is None
    variation = -creepage.spin * strips.y if creepage.variation is None else creepage.variation
    variation = variation - load_weighted_mean(strips, variation)
    spin_part = variation if by_spin else zero
    return LocalSlip(longitudinal + variation, spin_part, creepage.lateral, creepage.spin)


def friction_per_strip(strips: Strips, point: OperatingPoint) -> FloatArray:
    """Return the friction coefficient of each strip, shape (strips,)."""
    if np.ndim(point.friction) > 1:
        raise CapabilityError(
            "this contact model takes one friction coefficient per strip, not one per point;"
            " use contact.model = 'hertz-fastsim'"
        )
    friction = np.empty_like(strips.y)
    friction[:] = point.friction
    if not np.isfinite(friction).all():  # a closed form would return zero traction
        raise power_not_finite(point, line_load=strips.line_load)
    return friction


def _free_creepage(
    theory: TangentialTheory, strips: Strips, pair: ElasticPair, point: OperatingPoint
) -> float:
    """Return the mean creepage at which the tractions balance the bearing torque."""
    radius, torque = point.rolling_radius, point.bearing_torque
    if radius is None or torque is None:
        raise ValueError("a bearing torque needs the rolling radius of each strip")
    friction = friction_per_strip(strips, point)

    def torque_of(creepage: FloatArray) -> FloatArray:
        slip = local_slip(strips, point, float(creepage[0]))
        tractions = theory.tractions(strips, pair, slip, friction, point.rolling_speed)
        return np.array([-float(np.dot(tractions.force_x, radius)) * strips.spacing])

    variation = local_slip(strips, point, 0.0).longitudinal
    full_slip = float(friction.max() * strips.half_length.max()) * strips.longitudinal_curvature
    added_creepage = float(np.abs(variation).max()) + 100.0 * abs(point.creepage.lateral)
    state = {"line_load": strips.line_load, "half_length": strips.half_length}
    creepage = balanced_creepage(
        torque_of,
        np.array([torque]),
        np.zeros(1),
        np.zeros(1),
        np.array([full_slip / pair.creep_factor]),
        np.array([added_creepage]),
        lambda _: {"normal_force": point.normal_force, **state},
    )
    return float(creepage[0])


def spread_work(work: FloatArray) -> FloatArray:
    """Return a dissipation without negative values that has the sum of the work.

    Parameters
    ----------
    work : ndarray, shape (strips,)
        Work of the traction of each strip on the rigid slip. If a theory's flexibilities are not
        those of one surface, the stored elastic energy is not recovered strip by strip, and the
        work of a strip with little slip may be negative.

    Returns
    -------
    ndarray, shape (strips,)
        The work if it is negative nowhere. Otherwise negative values are set to zero and the others
        scaled by a common factor that preserves the sum; all zero if the sum is negative.
    """
    if not (work < 0.0).any():
        return work
    positive, total = np.maximum(work, 0.0), max(float(work.sum()), 0.0)
    return positive * (total / positive.sum()) if total > 0.0 else 0.0 * positive


def power_not_finite(point: OperatingPoint, **state: FloatArray) -> ContactError:
    """Return the error of a contact whose dissipated power is not finite, with its state."""
    return ContactError(
        "the dissipated power is not finite; check creepage, friction and rolling speed",
        {"point": point, **state},
    )


def complete(
    theory: TangentialTheory, strips: Strips, pair: ElasticPair, point: OperatingPoint
) -> ContactSolution:
    """Solve the tangential problem of `strips` and return the complete contact solution."""
    longitudinal = point.creepage.longitudinal
    if point.bearing_torque is not None and not math.isnan(point.bearing_torque):
        longitudinal = _free_creepage(theory, strips, pair, point)
    slip = local_slip(strips, point, longitudinal)
    friction = friction_per_strip(strips, point)
    tractions = theory.tractions(strips, pair, slip, friction, point.rolling_speed)
    power = float(tractions.dissipation.sum()) * strips.spacing
    if not math.isfinite(power):
        raise power_not_finite(point, line_load=strips.line_load)
    arm = strips.y - load_weighted_mean(strips, strips.y)
    return ContactSolution(
        y=strips.y,
        half_length=strips.half_length,
        line_load=strips.line_load,
        dissipation=tractions.dissipation,
        force_x=float(tractions.force_x.sum()) * strips.spacing,
        force_y=float(tractions.force_y.sum()) * strips.spacing,
        spin_moment=float((tractions.moment - arm * tractions.force_x).sum()) * strips.spacing,
        approach=strips.approach,
        peak_pressure=strips.peak_pressure,
        adhesion_fraction=float(tractions.adhesion_length.sum() / (2.0 * strips.half_length.sum())),
        power=power,
        longitudinal_creepage=longitudinal,
        iterations=strips.iterations,
    )


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


def covered_tractions(
    strips: Strips, slip: LocalSlip, rolling_speed: float, integrals: FloatArray
) -> Tractions:
    """Return the tractions from integrals of a march, (4, strips), with the work of the slip.

    Integrals over a strip are weighted by the fraction of it in contact.
    """
    if isinstance(strips, EllipseStrips):
        integrals[:3] *= strips.coverage
    force_x, force_y, moment, adhesion = integrals
    work = slip.longitudinal * force_x + slip.lateral * force_y + slip.spin * moment
    return Tractions(force_x, force_y, moment, spread_work(-rolling_speed * work), adhesion)


def equivalent_ellipse(strips: Strips) -> tuple[float, float]:
    """Return the semi-axes a and b [m] of the ellipse that gives the flexibilities of strips.

    a is the largest half-length of the strips, and the area is theirs: b = area/(pi a). Hence b
    changes smoothly as strips come into contact, and a gap between two patches has no effect. The
    equivalent ellipse of an ellipse is the ellipse itself.
    """
    if isinstance(strips, EllipseStrips):
        return strips.ellipse.a, strips.ellipse.b
    a = float(strips.half_length.max())
    return a, 2.0 * float(strips.half_length.sum()) * strips.spacing / (math.pi * a)


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


def touching(strips: Strips) -> slice:
    """Return the slice from the first to the last strip in contact."""
    inside = np.flatnonzero(strips.half_length > 0.0)
    return slice(int(inside[0]), int(inside[-1]) + 1)
