"""What every tangential theory shares: local creepage, balance of torque, sums over strips."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.types import ContactFields, ContactSolution, FloatArray, Grid, OperatingPoint


@dataclass(frozen=True)
class Strips:
    """A solved normal contact.

    Parameters
    ----------
    y, half_length, line_load : ndarray, shape (strips,)
        Position [m], half-length a(y) [m] and line load q(y) [N/m]; a = q = 0 outside the contact.
    spacing : float
        Width of a strip [m].
    longitudinal_curvature : float
        Relative curvature along rolling [1/m].
    approach, peak_pressure : float
        Approach [m] and greatest pressure [Pa].
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


def semi_elliptic_strips(
    grid: Grid,
    line_load: FloatArray,
    half_length: FloatArray,
    longitudinal_curvature: float,
    approach: float,
    iterations: int,
) -> Strips:
    """Return a solved contact whose pressure is semi-elliptic along rolling in every strip.

    Parameters
    ----------
    grid : Grid
        The strips.
    line_load, half_length : ndarray, shape (strips,)
        q [N/m] and a [m], of which some are loaded.
    longitudinal_curvature, approach : float
        Relative curvature along rolling [1/m], approach [m].
    iterations : int
        Iterations of the normal problem.
    """
    loaded = line_load > 0.0
    peak = 2.0 * (line_load[loaded] / (np.pi * half_length[loaded])).max()
    return Strips(
        y=grid.y,
        half_length=half_length,
        line_load=line_load,
        spacing=grid.spacing,
        longitudinal_curvature=longitudinal_curvature,
        approach=float(approach),
        peak_pressure=float(peak),
        iterations=iterations,
    )


@dataclass(frozen=True)
class LocalSlip:
    """The rigid slip each strip sees, per unit of rolling velocity.

    Parameters
    ----------
    longitudinal : ndarray, shape (strips,)
        The whole local longitudinal creepage xi(y), spin's part included.
    spin_part : ndarray, shape (strips,)
        The part of it that comes from spin, for theories whose flexibility differs for spin.
    lateral, spin : float
        Lateral creepage eta, and spin phi [1/m] whose phi x adds to it.
    """

    longitudinal: FloatArray
    spin_part: FloatArray
    lateral: float
    spin: float


@dataclass(frozen=True)
class Tractions:
    """What the tangential problem yields, per strip; forces act on body 1.

    Parameters
    ----------
    force_x, force_y : ndarray, shape (strips,)
        Integral of the traction along the strip [N/m].
    moment : ndarray, shape (strips,)
        Integral of x times the lateral traction along the strip [N].
    dissipation : ndarray, shape (strips,)
        Dissipated power per unit of axial length P_l [W/m].
    adhesion_length : ndarray, shape (strips,)
        Length of the strip that adheres [m].
    """

    force_x: FloatArray
    force_y: FloatArray
    moment: FloatArray
    dissipation: FloatArray
    adhesion_length: FloatArray


class TangentialTheory(ABC):
    """Solves the tangential problem on given strips.

    Attributes
    ----------
    knows_ellipses : bool
        Whether it takes strips that an ellipse covers in part as what they are.
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
        """Return the tractions for a local slip; `friction` has shape (strips,)."""

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
        """Return pressure, traction and slip inside the contact, (points_along, strips)."""


def load_weighted_mean(strips: Strips, values: FloatArray) -> float:
    """Return the mean of `values`, shape (strips,), weighted by the line load."""
    return float(np.dot(values, strips.line_load) / strips.line_load.sum())


def local_slip(strips: Strips, point: OperatingPoint, longitudinal: float) -> LocalSlip:
    """Spread the mean creepage `longitudinal` over the strips, as `Creepage` says."""
    creepage = point.creepage
    if creepage.variation is None and creepage.spin == 0.0:
        zero = np.zeros_like(strips.y)
        return LocalSlip(zero + longitudinal, zero, creepage.lateral, 0.0)
    if creepage.variation is None:
        variation = -creepage.spin * strips.y
        spin_part = variation - load_weighted_mean(strips, variation)
        return LocalSlip(longitudinal + spin_part, spin_part, creepage.lateral, creepage.spin)
    variation = creepage.variation - load_weighted_mean(strips, creepage.variation)
    zero = np.zeros_like(variation)
    return LocalSlip(longitudinal + variation, zero, creepage.lateral, creepage.spin)


def friction_per_strip(strips: Strips, point: OperatingPoint) -> FloatArray:
    """Return the friction coefficient of every strip, shape (strips,)."""
    if np.ndim(point.friction) > 1:
        raise CapabilityError(
            "this contact model takes one friction coefficient per strip, and not one per point;"
            " use contact.model = 'hertz-fastsim', without a bearing torque"
        )
    friction = np.empty_like(strips.y)
    friction[:] = point.friction
    if not np.isfinite(friction).all():  # a closed form would take it for none
        raise power_not_finite(point, line_load=strips.line_load)
    return friction


def _balanced_creepage(
    theory: TangentialTheory, strips: Strips, pair: ElasticPair, point: OperatingPoint
) -> float:
    """Find the mean creepage whose tractions carry the bearing torque."""
    from scipy.optimize import brentq  # noqa: PLC0415  (slow to import, and rarely needed)

    radius, torque = point.rolling_radius, point.bearing_torque
    if radius is None or torque is None:
        raise ValueError("a bearing torque needs the rolling radius of every strip")
    friction = friction_per_strip(strips, point)

    def excess(longitudinal: float) -> float:
        slip = local_slip(strips, point, longitudinal)
        found = theory.tractions(strips, pair, slip, friction, point.rolling_speed)
        return -float(np.dot(found.force_x, radius)) * strips.spacing - torque

    # creepage that surely slides everywhere: beyond the variation, several times saturation
    variation = local_slip(strips, point, 0.0).longitudinal
    saturation = float(friction.max() * strips.half_length.max()) * strips.longitudinal_curvature
    reach = float(np.abs(variation).max()) + 100.0 * (saturation + abs(point.creepage.lateral))
    low, high = excess(-reach), excess(reach)
    if low >= 0.0 or high <= 0.0:
        carried = torque + (high if torque > 0.0 else low)
        raise ContactError(
            f"the roller skids: its bearing torque of {torque:.4g} N m is more than the"
            f" {abs(carried):.4g} N m that friction can carry at a load of"
            f" {point.normal_force:.4g} N; lower creepage.bearing_torque or raise the friction",
            {"line_load": strips.line_load, "half_length": strips.half_length},
        )
    return float(brentq(excess, -reach, reach, xtol=1e-16, rtol=1e-14))


def inside(
    theory: TangentialTheory,
    strips: Strips,
    pair: ElasticPair,
    point: OperatingPoint,
    longitudinal: float,
    points_along: int,
    friction: FloatArray | None = None,
) -> ContactFields:
    """Return pressure, traction and slip inside a contact whose mean creepage is `longitudinal`.

    `friction` is in the theory's own form; without it that of every strip is taken.
    """
    return theory.fields(
        strips,
        pair,
        local_slip(strips, point, longitudinal),
        friction_per_strip(strips, point) if friction is None else friction,
        point.rolling_speed,
        points_along,
    )


def spread_work(work: FloatArray) -> FloatArray:
    """Return the dissipation of strips that do some work, negative nowhere and the same in all.

    Parameters
    ----------
    work : ndarray, shape (strips,)
        Work of every strip's traction on the rigid slip. Where a theory's flexibilities are not
        those of one surface, what elasticity stores need not come back to the same strip, and the
        work of one that hardly slips may be negative.

    Returns
    -------
    ndarray, shape (strips,)
        The work, where it is negative nowhere. Else such strips get nothing, and the others give
        alike what makes the sum that of the work; nothing if that is negative.
    """
    if not (work < 0.0).any():
        return work
    positive = np.maximum(work, 0.0)
    total = max(float(work.sum()), 0.0)
    return positive * (total / positive.sum()) if total > 0.0 else 0.0 * positive


def power_not_finite(point: OperatingPoint, **state: FloatArray) -> ContactError:
    """Return the error of a contact whose tractions make no sense, with the state it was in."""
    return ContactError(
        "the dissipated power is not finite; check creepage, friction and rolling speed",
        {"point": point, **state},
    )


def complete(
    theory: TangentialTheory, strips: Strips, pair: ElasticPair, point: OperatingPoint
) -> ContactSolution:
    """Solve the tangential problem of `strips` and sum it up as a `ContactSolution`."""
    longitudinal = point.creepage.longitudinal
    if point.bearing_torque is not None:
        longitudinal = _balanced_creepage(theory, strips, pair, point)
    slip = local_slip(strips, point, longitudinal)
    friction = friction_per_strip(strips, point)
    found = theory.tractions(strips, pair, slip, friction, point.rolling_speed)
    power = float(found.dissipation.sum()) * strips.spacing
    if not math.isfinite(power):
        raise power_not_finite(point, line_load=strips.line_load)
    arm = strips.y - load_weighted_mean(strips, strips.y)
    length = 2.0 * strips.half_length.sum()
    return ContactSolution(
        y=strips.y,
        half_length=strips.half_length,
        line_load=strips.line_load,
        dissipation=found.dissipation,
        force_x=float(found.force_x.sum()) * strips.spacing,
        force_y=float(found.force_y.sum()) * strips.spacing,
        spin_moment=float((found.moment - arm * found.force_x).sum()) * strips.spacing,
        approach=strips.approach,
        peak_pressure=strips.peak_pressure,
        adhesion_fraction=float(found.adhesion_length.sum() / length),
        power=power,
        longitudinal_creepage=longitudinal,
        iterations=strips.iterations,
    )
