"""Hertz contact of two bodies with paraboloidal gap, exact, for any ratio of curvatures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.mechanics.jit import kernel
from wearsim.types import FloatArray

CONVERGED, NOT_CONVERGED, NO_CURVATURE, TOO_FEW_STRIPS, LEAVES_STRIPS = range(5)

ROUND_OFF = 4e-15  # of the gap's greatest height: how far a parabola may lie from its own fit
HOLLOW = 1.0  # what ln(b'/b) counts for at most, and in the hollow of a groove


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
        peak = 0.75 * self.normal_force / self.b
        return peak * np.maximum((1.0 - t) * (1.0 + t), 0.0)

    def load_below(self, y: FloatArray) -> FloatArray:
        """Return the load [N] carried from the patch's lower end up to `y` [m]: q integrated."""
        t = np.clip(np.asarray(y) / self.b, -1.0, 1.0)
        return 0.25 * self.normal_force * (1.0 + t) ** 2 * (2.0 - t)


@kernel
def elliptic_integrals(complement: float) -> tuple[float, float]:
    """Return K(e) and D(e) = (K(e) - E(e))/e^2 by the arithmetic-geometric mean.

    Parameters
    ----------
    complement : float
        Complementary modulus k' = sqrt(1 - e^2), 0 < k' <= 1.

    Returns
    -------
    first, d_integral : float
        K and D; E follows as K - e^2 D. Neither loses digits towards the circle, where e = 0.

    Notes
    -----
    Abramowitz and Stegun, 17.6; D is Jahnke and Emde's.
    """
    mean, root = 1.0, complement
    # sum of 2^(n-1) c_n^2/e^2 with c_0 = e and c_1 = (1 - k')/2, where e^2 = (1 - k')(1 + k')
    total = 0.5
    weight = 1.0
    half_difference_squared = 0.25 * (1.0 - complement) / (1.0 + complement)  # over e^2
    for _ in range(40):
        total += weight * half_difference_squared
        mean, root = 0.5 * (mean + root), math.sqrt(mean * root)
        # the two may stay one rounding apart for ever
        if abs(mean - root) <= 4e-16 * mean:
            break
        weight *= 2.0
        squared_modulus = (1.0 - complement) * (1.0 + complement)
        half_difference_squared = (0.5 * (mean - root)) ** 2 / squared_modulus
    first = 0.5 * math.pi / (0.5 * (mean + root))
    return first, first * total


@kernel
def axis_ratio(curvature_ratio: float) -> float:
    """Return b/a of the patch, major axis below, from the ratio of the greater curvature to it.

    Parameters
    ----------
    curvature_ratio : float
        Curvature along the minor axis over curvature along the major axis, at least 1.

    Returns
    -------
    float
        Minor over major semi-axis k', solving (K - D)/(k'^2 D) = `curvature_ratio` by secants.

    Notes
    -----
    Johnson, Contact Mechanics (1985), eq. 4.26, DOI 10.1017/CBO9781139171731.
    """
    target = math.log(curvature_ratio)
    if target <= 0.0:
        return 1.0
    old, new = 0.0, -0.6 * target  # logarithms of k'; the slope is -1.5 at the circle, -2 far off
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


@kernel
def hertz_ellipse(
    curvature_x: float, curvature_y: float, normal_force: float, contact_modulus: float
) -> tuple[float, float, float, float]:
    """Return a, b [m], p0 [Pa] and approach [m] of the gap ``A x^2 + B y^2``, as `hertz` does.

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


@kernel
def ellipse_shape(curvature_x: float, curvature_y: float) -> tuple[float, float, float]:
    """Return what the curvatures alone decide: b/a with the major axis below, and its K and D.

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


@kernel
def ellipse_under(
    curvature_x: float,
    curvature_y: float,
    shape: tuple[float, float, float],
    normal_force: float,
    contact_modulus: float,
) -> tuple[float, float, float, float]:
    """Return a, b [m], p0 [Pa] and approach [m] of an ellipse whose shape is known.

    Parameters
    ----------
    curvature_x, curvature_y, normal_force, contact_modulus : float
        As for `hertz`.
    shape : tuple of float
        As `ellipse_shape` returns it.

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
    a, b, peak, approach = hertz_ellipse(
        float(curvature_x), float(curvature_y), float(normal_force), float(contact_modulus)
    )
    return HertzContact(a, b, peak, approach, float(normal_force))


def given_ellipse(a: float, b: float, normal_force: float, contact_modulus: float) -> HertzContact:
    """Return the Hertz pressure and approach of a patch whose semi-axes are prescribed.

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
    major, minor = max(a, b), min(a, b)
    first, _ = elliptic_integrals(minor / major)
    peak = 1.5 * normal_force / (math.pi * major * minor)
    approach = 1.5 * normal_force * first / (math.pi * contact_modulus * major)
    return HertzContact(a, b, peak, approach, normal_force)


@kernel
def fit_parabola(
    y: FloatArray, gap: FloatArray, centre: float, half_width: float
) -> tuple[float, float, float, int]:
    """Fit ``gap = w0 + B (y - yc)^2`` by least squares weighted with ``1 - ((y - centre)/b)^2``.

    Parameters
    ----------
    y, gap : ndarray, shape (strips,)
        Position and gap [m].
    centre, half_width : float
        Centre and half-width b [m] of the stretch that counts.

    Returns
    -------
    curvature, vertex, height : float
        B [1/m], yc [m] and w0 [m]; the last two are nan where B is not positive.
    used : int
        Strips with weight; fewer than three fix no parabola.
    """
    m0 = m1 = m2 = m3 = m4 = 0.0
    s0 = s1 = s2 = 0.0
    used = 0
    nearest = 0
    for i in range(1, len(y)):
        if abs(y[i] - centre) < abs(y[nearest] - centre):
            nearest = i
    shift = gap[nearest]  # the heights' common part would only cost digits
    for i in range(len(y)):
        t = (y[i] - centre) / half_width
        weight = 1.0 - t * t
        if weight <= 1e-12:
            continue
        used += 1
        first, second = weight * t, weight * t * t
        height = gap[i] - shift
        m0 += weight
        m1 += first
        m2 += second
        m3 += second * t
        m4 += second * t * t
        s0 += weight * height
        s1 += first * height
        s2 += second * height
    if used < 3:
        return math.nan, math.nan, math.nan, used
    det = m0 * (m2 * m4 - m3 * m3) - m1 * (m1 * m4 - m2 * m3) + m2 * (m1 * m3 - m2 * m2)
    constant = s0 * (m2 * m4 - m3 * m3) - m1 * (s1 * m4 - s2 * m3) + m2 * (s1 * m3 - s2 * m2)
    slope = m0 * (s1 * m4 - s2 * m3) - s0 * (m1 * m4 - m2 * m3) + m2 * (m1 * s2 - m2 * s1)
    square = m0 * (m2 * s2 - m3 * s1) - m1 * (m1 * s2 - m2 * s1) + s0 * (m1 * m3 - m2 * m2)
    constant, slope, square = constant / det, slope / det, square / det
    if not square > 0.0:
        return square / half_width**2, math.nan, math.nan, used
    vertex = -0.5 * slope / square
    height = shift + constant + 0.5 * slope * vertex
    return square / half_width**2, centre + vertex * half_width, height, used


@kernel
def fit_centred(
    y: FloatArray, gap: FloatArray, centre: float, half_width: float, tolerance: float
) -> tuple[float, float, float, int]:
    """Move the stretch of `fit_parabola` until it is centred on the vertex it finds.

    Parameters and returns are those of `fit_parabola`, with a status in place of the count.
    """
    last, last_shift = centre, 0.0
    for _ in range(100):
        curvature, vertex, height, used = fit_parabola(y, gap, centre, half_width)
        if used < 3:
            return curvature, centre, height, TOO_FEW_STRIPS
        if not curvature > 0.0:
            return curvature, centre, height, NO_CURVATURE
        shift = (vertex - centre) / half_width
        if abs(shift) <= tolerance:
            return curvature, vertex, height, CONVERGED
        # the secant rule: in a hollow groove the vertex moves faster than the stretch, and going
        # after it would run away from the middle
        moved = (centre - last) / half_width
        step = shift if moved == 0.0 else -shift * moved / (shift - last_shift)
        last, last_shift = centre, shift
        centre += min(max(step, -0.5), 0.5) * half_width
    return curvature, centre, height, NOT_CONVERGED


@kernel
def is_parabola(
    y: FloatArray, gap: FloatArray, curvature: float, centre: float, height: float
) -> bool:
    """Return whether the gap is ``height + curvature (y - centre)^2`` to round-off.

    Then any stretch of it fits the same parabola, and one fit serves every patch.

    Parameters
    ----------
    y, gap : ndarray, shape (strips,)
        Position and gap [m].
    curvature, centre, height : float
        B [1/m], yc [m] and w0 [m].
    """
    worst, most = 0.0, 0.0
    for i in range(len(y)):
        rise = curvature * (y[i] - centre) ** 2
        worst = max(worst, abs(gap[i] - height - rise))
        most = max(most, rise)
    return worst <= ROUND_OFF * most


@kernel
def strips_within(y: FloatArray, centre: float, half_width: float) -> int:
    """Return how many strips lie within `half_width` [m] of `centre` [m].

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Position [m].
    centre, half_width : float
        The stretch [m].
    """
    count = 0
    for i in range(len(y)):
        count += 1 if abs(y[i] - centre) < half_width else 0
    return count


@kernel
def hertz_on_profile(
    y: FloatArray,
    gap: FloatArray,
    curvature_x: float,
    normal_force: float,
    contact_modulus: float,
    tolerance: float,
    limit: int,
) -> tuple[float, float, float, float, int, int]:
    """Find the Hertz patch whose fitted parabola is the one that makes it.

    The parabola fitted over a patch of half-width b, centred on the parabola's own vertex, makes
    a Hertz patch of half-width b'. The b that equals b' is approached from the widest patch inside
    the strips, at most to 0.6 b, and then by regula falsi (Illinois) on ln(b'/b). A gap that is a
    parabola already gives its patch at once.

    Parameters
    ----------
    y, gap : ndarray, shape (strips,)
        Position and gap [m].
    curvature_x : float
        A [1/m].
    normal_force, contact_modulus : float
        N [N] and E* [Pa].
    tolerance : float
        Greatest ln(b'/b), and a tenth of the greatest shift of the centre over b, at which the
        patch is consistent; a shift is felt in second order only.
    limit : int
        Greatest number of patches tried.

    Returns
    -------
    curvature, half_width, centre, height : float
        B [1/m], b [m], yc [m] and the fitted gap at yc [m].
    iterations, status : int
        Status is one of `CONVERGED`, `NOT_CONVERGED`, `NO_CURVATURE`, `TOO_FEW_STRIPS` and
        `LEAVES_STRIPS`.

    Notes
    -----
    Dowell and Jarratt (1971), DOI 10.1007/BF01934364, for the Illinois rule.
    """
    centre = 0.5 * (y[0] + y[-1])
    width = 0.5 * (y[-1] - y[0]) * len(y) / max(len(y) - 1, 1)
    low, low_value = 0.0, 0.0  # ln b, ln(b'/b) where b is too small; value 0 while unknown
    high, high_value = 0.0, 0.0
    side = 0  # the end that moved last
    curvature, height = math.nan, math.nan
    for iteration in range(1, limit + 1):
        curvature, vertex, height, status = fit_centred(y, gap, centre, width, 10.0 * tolerance)
        here = math.log(width)
        if status == CONVERGED:
            centre = vertex
            found = hertz_ellipse(curvature_x, curvature, normal_force, contact_modulus)[1]
            enough = found <= width and strips_within(y, centre, found) >= 3
            if iteration == 1 and enough and is_parabola(y, gap, curvature, centre, height):
                return curvature, found, centre, height, iteration, CONVERGED
            value = min(math.log(found / width), HOLLOW)
        elif status != TOO_FEW_STRIPS and high_value != 0.0:
            # the stretch lies in the hollow of a groove, where no patch would end: it is too narrow
            found, value = math.inf, HOLLOW
        else:
            return curvature, width, vertex, height, iteration, status
        if abs(value) <= tolerance:
            return curvature, found, centre, height, iteration, CONVERGED
        if value > 0.0:
            if high_value == 0.0:
                return curvature, found, centre, height, iteration, LEAVES_STRIPS
            high_value *= 0.5 if side > 0 else 1.0
            low, low_value, side = here, value, 1
        else:
            low_value *= 0.5 if side < 0 else 1.0
            high, high_value, side = here, value, -1
        if low_value != 0.0 and high - low <= tolerance:
            # either b' answers b steeply here, or it jumps and no patch agrees with its parabola
            agrees = status == CONVERGED and abs(value) < 1e4 * tolerance
            status = CONVERGED if agrees else NO_CURVATURE
            return curvature, found, centre, height, iteration, status
        if low_value == 0.0:
            width = max(found, 0.6 * width)
        else:
            width = math.exp(high - high_value * (high - low) / (high_value - low_value))
    return curvature, width, centre, height, limit, NOT_CONVERGED
