"""Exact Hertz contact of two bodies with a paraboloidal gap, for any ratio of curvatures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.types import FloatArray


@dataclass(frozen=True)
class HertzContact:
    """An elliptic contact patch and its pressure ``p0 sqrt(1 - x^2/a^2 - y^2/b^2)``.

    Parameters
    ----------
    a, b : float
        Half-lengths along rolling and across it [m].
    peak_pressure : float
        Greatest pressure p0 [Pa].
    approach : float
        Approach of the bodies [m].
    normal_force : float
        Load N [N].
    """

    a: float
    b: float
    peak_pressure: float
    approach: float
    normal_force: float

    def half_length(self, y: FloatArray) -> FloatArray:
        """Return the half-length a(y) [m] at `y` [m] from the centre, 0 outside the patch."""
        t = np.asarray(y) / self.b
        return self.a * np.sqrt(np.maximum((1.0 - t) * (1.0 + t), 0.0))

    def line_load(self, y: FloatArray) -> FloatArray:
        """Return the load per unit of axial length q(y) [N/m] at `y` [m] from the centre."""
        t = np.asarray(y) / self.b
        return 0.75 * self.normal_force / self.b * np.maximum((1.0 - t) * (1.0 + t), 0.0)

    def load_below(self, y: FloatArray) -> FloatArray:
        """Return the load [N] carried from the patch's lower end up to `y` [m]: q integrated."""
        t = np.clip(np.asarray(y) / self.b, -1.0, 1.0)
        return 0.25 * self.normal_force * (1.0 + t) ** 2 * (2.0 - t)


@subroutine
def elliptic_integrals(complement: float) -> tuple[float, float]:
    """Return K(e) and D(e) = (K(e) - E(e))/e^2 by the arithmetic-geometric mean.

    Parameters
    ----------
    complement : float
        Complementary modulus k' = sqrt(1 - e^2), 0 < k' <= 1.

    Returns
    -------
    first, d_integral : float
        K and D; E = K - e^2 D. Neither loses accuracy near the circle, where e = 0.

    Notes
    -----
    Abramowitz and Stegun, 17.6; D is Jahnke and Emde's.
    """
    mean, root = 1.0, complement
    # sum of 2^(n-1) c_n^2/e^2 with c_0 = e and c_1 = (1 - k')/2, where e^2 = (1 - k')(1 + k')
    total, weight = 0.5, 1.0
    half_difference_squared = 0.25 * (1.0 - complement) / (1.0 + complement)  # over e^2
    for _ in range(40):
        total += weight * half_difference_squared
        mean, root = 0.5 * (mean + root), math.sqrt(mean * root)
        # the difference of the two may never fall below one rounding error
        if abs(mean - root) <= 4e-16 * mean:
            break
        weight *= 2.0
        squared_modulus = (1.0 - complement) * (1.0 + complement)
        half_difference_squared = (0.5 * (mean - root)) ** 2 / squared_modulus
    first = 0.5 * math.pi / (0.5 * (mean + root))
    return first, first * total


def elliptic_integrals_of(complement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the `elliptic_integrals` of an array, bit for bit equal, without compiled code.

    Parameters
    ----------
    complement : ndarray, shape (points,)
        Complementary moduli.

    Returns
    -------
    first, d_integral : ndarray, shape (points,)
        K and D.
    """
    first, d_integral = np.empty_like(complement), np.empty_like(complement)
    places, weight = np.arange(len(complement)), 1.0
    mean, root, total = np.ones_like(complement), complement, np.full_like(complement, 0.5)
    half_difference_squared = 0.25 * (1.0 - complement) / (1.0 + complement)
    squared_modulus = (1.0 - complement) * (1.0 + complement)
    for _ in range(40):
        total = total + weight * half_difference_squared
        mean, root = 0.5 * (mean + root), np.sqrt(mean * root)
        going = np.abs(mean - root) > 4e-16 * mean
        ended = places[~going]
        first[ended] = 0.5 * math.pi / (0.5 * (mean + root))[~going]
        d_integral[ended] = first[ended] * total[~going]
        places, mean, root, total = places[going], mean[going], root[going], total[going]
        squared_modulus = squared_modulus[going]
        weight *= 2.0
        half_difference_squared = (0.5 * (mean - root)) ** 2 / squared_modulus
    return first, d_integral


@subroutine
def axis_ratio(curvature_ratio: float) -> float:
    """Return the ratio of minor to major semi-axis of the patch.

    Parameters
    ----------
    curvature_ratio : float
        Curvature along the minor axis over curvature along the major axis, at least 1.

    Returns
    -------
    float
        k', the solution of (K - D)/(k'^2 D) = `curvature_ratio` by the secant method.

    Notes
    -----
    Johnson, Contact Mechanics (1985), eq. 4.26, DOI 10.1017/CBO9781139171731.
    """
    target = math.log(curvature_ratio)
    if target <= 0.0:
        return 1.0
    old, new = 0.0, -0.6 * target  # ln k'; the slope is -1.5 at the circle and -2 far from it
    old_value = -target
    for _ in range(60):
        first, d_integral = elliptic_integrals(math.exp(new))
        value = math.log(first / d_integral - 1.0) - 2.0 * new - target
        if value == old_value:
            break
        step = -value * (new - old) / (value - old_value)
        old, old_value = new, value
        new = min(new + step, 0.0)
        if abs(step) <= 1e-15 * max(1.0, abs(new)):
            break
    return math.exp(new)


@subroutine
def hertz_ellipse(
    curvature_x: float, curvature_y: float, normal_force: float, contact_modulus: float
) -> tuple[float, float, float, float]:
    """Return a, b [m], p0 [Pa] and approach [m] for the gap ``A x^2 + B y^2``, as `hertz` does.

    Parameters
    ----------
    curvature_x, curvature_y, normal_force, contact_modulus : float
        As for `hertz`.

    Returns
    -------
    a, b, peak_pressure, approach : float
    """
    shape = ellipse_shape(curvature_x, curvature_y)
    return ellipse_under(curvature_x, curvature_y, shape, normal_force, contact_modulus)


@subroutine
def ellipse_shape(curvature_x: float, curvature_y: float) -> tuple[float, float, float]:
    """Return the shape of the ellipse, which depends on the curvatures only: k', K and D.

    Parameters
    ----------
    curvature_x, curvature_y : float
        As for `hertz`.

    Returns
    -------
    ratio, first, d_integral : float
    """
    ratio = axis_ratio(max(curvature_x, curvature_y) / min(curvature_x, curvature_y))
    first, d_integral = elliptic_integrals(ratio)
    return ratio, first, d_integral


@subroutine
def ellipse_under(
    curvature_x: float,
    curvature_y: float,
    shape: tuple[float, float, float],
    normal_force: float,
    contact_modulus: float,
) -> tuple[float, float, float, float]:
    """Return a, b [m], p0 [Pa] and approach [m] of an ellipse of known shape.

    Parameters
    ----------
    curvature_x, curvature_y, normal_force, contact_modulus : float
        As for `hertz`.
    shape : tuple of float
        From `ellipse_shape`.

    Returns
    -------
    a, b, peak_pressure, approach : float
    """
    ratio, first, d_integral = shape
    scale = 1.5 * normal_force / (math.pi * contact_modulus)
    major = (scale * d_integral / min(curvature_x, curvature_y)) ** (1.0 / 3.0)
    minor = ratio * major
    peak = 1.5 * normal_force / (math.pi * major * minor)
    approach = scale * first / major
    if curvature_x <= curvature_y:
        return major, minor, peak, approach
    return minor, major, peak, approach


@kernel
def prescribed_ellipse(
    a: float, b: float, normal_force: float, contact_modulus: float
) -> tuple[float, float]:
    """Return p0 [Pa] and approach [m] of a patch with prescribed semi-axes, as `given_ellipse`.

    Parameters
    ----------
    a, b, normal_force, contact_modulus : float
        As for `given_ellipse`.

    Returns
    -------
    peak_pressure, approach : float
    """
    major, minor = max(a, b), min(a, b)
    first, _ = elliptic_integrals(minor / major)
    peak = 1.5 * normal_force / (math.pi * major * minor)
    return peak, 1.5 * normal_force * first / (math.pi * contact_modulus * major)


def hertz(
    curvature_x: float, curvature_y: float, normal_force: float, contact_modulus: float
) -> HertzContact:
    """Solve the Hertz problem of the gap ``A x^2 + B y^2`` exactly.

    Parameters
    ----------
    curvature_x, curvature_y : float
        A and B [1/m], both positive: half the relative curvatures along and across rolling.
    normal_force : float
        Load N [N].
    contact_modulus : float
        E* [Pa], 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Returns
    -------
    HertzContact

    Raises
    ------
    ValueError
        If a curvature, the load or the modulus is not positive and finite.

    Notes
    -----
    Johnson, Contact Mechanics (1985), eqs. 4.24-4.26, DOI 10.1017/CBO9781139171731.
    """
    for name, value in (
        ("curvature_x", curvature_x),
        ("curvature_y", curvature_y),
        ("normal_force", normal_force),
        ("contact_modulus", contact_modulus),
    ):
        if not (value > 0.0 and math.isfinite(value)):
            raise ValueError(f"{name} must be positive and finite, got {value!r}")
    ellipse = hertz_ellipse(
        float(curvature_x), float(curvature_y), float(normal_force), float(contact_modulus)
    )
    return HertzContact(*ellipse, float(normal_force))


def given_ellipse(a: float, b: float, normal_force: float, contact_modulus: float) -> HertzContact:
    """Return the Hertz contact of a patch with prescribed semi-axes.

    Parameters
    ----------
    a, b : float
        Half-lengths along rolling and across it [m].
    normal_force, contact_modulus : float
        N [N] and E* [Pa].

    Returns
    -------
    HertzContact
    """
    ellipse = prescribed_ellipse(float(a), float(b), float(normal_force), float(contact_modulus))
    return HertzContact(a, b, *ellipse, normal_force)
