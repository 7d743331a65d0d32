"""Kalker's creepage coefficients of the linear theory, for any ellipse and Poisson's ratio."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.types import FloatArray

# Table of Kalker (1990), Three-Dimensional Elastic Bodies in Rolling Contact: one row per ratio,
# C11, C22, C23 and C33, each for nu = 0, 1/4 and 1/2.
_RATIOS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_SHORT = """
2.51 3.31 4.85  2.51 2.52 2.53  .334 .473 .731  6.42 8.28 11.7
2.59 3.37 4.81  2.59 2.63 2.66  .483 .603 .809  3.46 4.27 5.66
2.68 3.44 4.80  2.68 2.75 2.81  .607 .715 .889  2.49 2.96 3.72
2.78 3.53 4.82  2.78 2.88 2.98  .720 .823 .977  2.02 2.32 2.77
2.88 3.62 4.83  2.88 3.01 3.14  .827 .929 1.07  1.74 1.93 2.22
2.98 3.72 4.91  2.98 3.14 3.31  .930 1.03 1.18  1.56 1.68 1.86
3.09 3.81 4.97  3.09 3.28 3.48  1.03 1.14 1.29  1.43 1.50 1.60
3.19 3.91 5.05  3.19 3.41 3.65  1.13 1.25 1.40  1.34 1.37 1.42
3.29 4.01 5.12  3.29 3.54 3.82  1.23 1.36 1.51  1.27 1.27 1.27
3.40 4.12 5.20  3.40 3.67 3.98  1.33 1.47 1.63  1.21 1.19 1.16
"""
_LONG = """
10.7 11.7 12.9  10.7 12.8 16.0  12.2 14.6 18.0  .795 .526 .228
6.96 7.78 8.82  6.96 8.14 9.79  5.72 6.63 7.89  .828 .601 .341
5.57 6.34 7.34  5.57 6.40 7.51  3.79 4.32 5.01  .868 .674 .446
4.84 5.57 6.57  4.84 5.48 6.31  2.88 3.24 3.70  .912 .747 .549
4.37 5.10 6.11  4.37 4.90 5.56  2.35 2.62 2.96  .958 .819 .650
4.06 4.78 5.80  4.06 4.50 5.04  2.01 2.23 2.50  1.01 .892 .751
3.82 4.54 5.58  3.82 4.21 4.67  1.76 1.95 2.18  1.05 .965 .852
3.65 4.36 5.42  3.65 3.99 4.39  1.58 1.75 1.94  1.10 1.04 .954
3.51 4.22 5.30  3.51 3.81 4.16  1.44 1.59 1.77  1.16 1.11 1.06
"""
# C33 at b/a = 1/20, where the error of the limit for a long contact is 12 %: from the exact linear
# theory (CONTACT), with an error of 4 %
_C33_AT_20 = (0.787, 0.491, 0.167)

_NODES = (0.0, 0.25, 0.5)  # Poisson's ratio of the table's columns
# exponent of a/b with which the deviation of the table from its limit decays below 0.1
_FADE = (1.5, 1.5, 2.5, 1.5)


class CreepageCoefficients(NamedTuple):
    """Kalker's creepage coefficients, dimensionless.

    Longitudinal, lateral, lateral and spin, and spin coefficient.
    """

    c11: float
    c22: float
    c23: float
    c33: float


class Spline(NamedTuple):
    """Cubic splines of ln C over ln(a/b), one column per Poisson's ratio 0, 1/4, 1/2.

    Knots (knots,); values and slopes (knots, 3).
    """

    knots: FloatArray
    values: FloatArray
    slopes: FloatArray


class Flexibilities(NamedTuple):
    """FASTSIM's flexibilities: displacement over traction [m/Pa].

    L1 = 8a/(3 C11 G), L2 = 8a/(3 C22 G) and L3 = pi a sqrt(a/b)/(4 C23 G).
    """

    longitudinal: float
    lateral: float
    spin: float


@subroutine
def short_limit(ratio: float, nu: float) -> tuple[float, float, float, float]:
    """Return C11, C22, C23 and C33 for a/b -> 0, a contact that is long across rolling.

    Parameters
    ----------
    ratio : float
        a/b, small.
    nu : float
        Poisson's ratio.
    """
    slender = math.pi * math.sqrt(ratio) / (3.0 * (1.0 - nu))
    return (
        math.pi**2 / (4.0 * (1.0 - nu)),
        math.pi**2 / 4.0,
        slender * (1.0 + nu * (math.log(16.0 / ratio) - 5.0)),
        math.pi**2 / (16.0 * (1.0 - nu) * ratio),
    )


@subroutine
def long_limit(ratio: float, nu: float) -> tuple[float, float, float, float]:
    """Return C11, C22, C23 and C33 for b/a -> 0, a contact that is long in the rolling direction.

    Parameters
    ----------
    ratio : float
        b/a, small.
    nu : float
        Poisson's ratio.
    """
    log = math.log(16.0 / (ratio * ratio))
    rest = 3.0 - math.log(4.0)
    along, across = log - 2.0 * nu, (1.0 - nu) * log + 2.0 * nu
    turning = (1.0 - nu) * log - 2.0 + 4.0 * nu
    return (
        2.0 * math.pi / (ratio * along) * (1.0 + rest / along),
        2.0 * math.pi / (ratio * across) * (1.0 + (1.0 - nu) * rest / across),
        2.0 * math.pi / (3.0 * ratio**1.5 * turning),
        0.25 * math.pi * (1.0 - nu * (log - 2.0) / turning),
    )


@lru_cache(maxsize=4)
def spline(which: int) -> Spline:
    """Return the spline of a coefficient, whose end slopes are those of the limits.

    Parameters
    ----------
    which : int
        0 to 3 for C11, C22, C23 and C33.
    """
    short, long = (
        np.array(table.split(), dtype=np.float64).reshape(-1, 4, 3)[:, which]
        for table in (_SHORT, _LONG)
    )
    ratios = [*_RATIOS, *(1.0 / ratio for ratio in _RATIOS[-2::-1])]
    known = np.vstack([short, long[::-1]])
    if which == 3:
        ratios.append(20.0)
        known = np.vstack([known, _C33_AT_20])
    knots, values = np.log(ratios), np.log(known)
    # outside the knots a coefficient does not depend on the slopes
    table = Spline(knots, values, np.zeros_like(values))
    small = 1e-5
    matrix, right = np.eye(len(knots)), np.zeros_like(values)
    for k, nu in enumerate(_NODES):
        below = coefficient(which, math.exp(knots[0] - small), nu, table)
        above = coefficient(which, math.exp(knots[-1] + small), nu, table)
        right[0, k] = (values[0, k] - math.log(below)) / small
        right[-1, k] = (math.log(above) - values[-1, k]) / small
    step = np.diff(knots)
    rise = np.diff(values, axis=0) / step[:, None]
    for i in range(1, len(knots) - 1):
        matrix[i, i - 1 : i + 2] = step[i], 2.0 * (step[i - 1] + step[i]), step[i - 1]
        right[i] = 3.0 * (step[i] * rise[i - 1] + step[i - 1] * rise[i])
    return Spline(knots, values, np.asarray(np.linalg.solve(matrix, right)))


@subroutine
def _at(knots: FloatArray, values: FloatArray, slopes: FloatArray, k: int, place: float) -> float:
    """Return C at ``ln(a/b) = place`` for the Poisson's ratio of column k."""
    i = 0
    while i < len(knots) - 2 and place > knots[i + 1]:
        i += 1
    step = knots[i + 1] - knots[i]
    t = (place - knots[i]) / step
    h00, h01 = (1.0 + 2.0 * t) * ((1.0 - t) * (1.0 - t)), t * t * (3.0 - 2.0 * t)
    h10, h11 = step * t * ((1.0 - t) * (1.0 - t)), step * t * t * (t - 1.0)
    logarithm = h00 * values[i, k] + h01 * values[i + 1, k]
    return math.exp(logarithm + h10 * slopes[i, k] + h11 * slopes[i + 1, k])


@subroutine
def coefficient(which: int, ratio: float, nu: float, table: Spline) -> float:
    """Return one creepage coefficient, interpolated as described in `creepage_coefficients`.

    Parameters
    ----------
    which : int
        0 to 3 for C11, C22, C23 and C33.
    ratio, nu : float
        a/b and Poisson's ratio.
    table : Spline
        Spline of the coefficient.
    """
    place = math.log(ratio)
    low, high = table.knots[0], table.knots[-1]
    inside = min(max(place, low), high)
    # parabola in nu through the columns, for quantities that are nearly linear in nu
    total = 0.0
    for k in range(len(_NODES)):
        column = _at(table.knots, table.values, table.slopes, k, inside)
        node, second, third = _NODES[k], _NODES[(k + 1) % 3], _NODES[(k + 2) % 3]
        weight = (nu - second) * (nu - third) / ((node - second) * (node - third))  # Lagrange
        total += weight * (column * (1.0 - node) if which == 3 else 1.0 / column)
    value = total / (1.0 - nu) if which == 3 else 1.0 / total
    if place < low:  # continued towards the limit at a/b = 0
        edge = math.exp(low)
        excess = (value / short_limit(edge, nu)[which] - 1.0) * math.pow(ratio / edge, _FADE[which])
        return short_limit(ratio, nu)[which] * (1.0 + excess)
    if place > high:  # continued towards the limit at b/a = 0
        slenderness, edge = 1.0 / ratio, math.exp(-high)
        excess = value / long_limit(edge, nu)[which] - 1.0
        decay = math.log(16.0 / (edge * edge)) / math.log(16.0 / (slenderness * slenderness))
        return long_limit(slenderness, nu)[which] * (1.0 + excess * (decay * decay))
    return value


def _check(ratio: float, poisson_ratio: float) -> None:
    if not (ratio > 0.0 and math.isfinite(ratio)):
        raise ValueError(f"a/b must be positive and finite, got {ratio!r}")
    if not 0.0 <= poisson_ratio <= 0.5:
        raise ValueError(f"Poisson's ratio must lie in 0 to 0.5, got {poisson_ratio!r}")


@lru_cache(maxsize=1024)
def creepage_coefficients(ratio: float, poisson_ratio: float) -> CreepageCoefficients:
    """Interpolate Kalker's table, continued to its limits at both ends.

    Parameters
    ----------
    ratio : float
        a/b, half-length of the patch along rolling over that across; any positive value.
    poisson_ratio : float
        Combined Poisson's ratio, 0 to 0.5.

    Returns
    -------
    CreepageCoefficients
        Continuous in both arguments.

    Raises
    ------
    ValueError
        If an argument is out of its range.

    Notes
    -----
    Kalker (1990), Three-Dimensional Elastic Bodies in Rolling Contact,
    DOI 10.1007/978-94-015-7889-9. Cubic splines of ln C over ln(a/b) for each column of the table;
    in nu a parabola of 1/C11, 1/C22, 1/C23 and (1 - nu) C33, which are nearly linear.
    """
    _check(ratio, poisson_ratio)
    return CreepageCoefficients(
        *(coefficient(k, float(ratio), float(poisson_ratio), spline(k)) for k in range(4))
    )


def line_limit_coefficients(ratio: float, poisson_ratio: float) -> CreepageCoefficients:
    """Return the limits for a contact that is long across rolling, evaluated at any ratio.

    Parameters
    ----------
    ratio : float
        a/b, half-length of the patch along rolling over that across.
    poisson_ratio : float
        Combined Poisson's ratio, 0 to 0.5.

    Returns
    -------
    CreepageCoefficients

    Raises
    ------
    ValueError
        If an argument is out of its range, or the ratio is too large for the limit (C23 is not
        positive).
    """
    _check(ratio, poisson_ratio)
    limits = CreepageCoefficients(*short_limit(float(ratio), float(poisson_ratio)))
    if limits.c23 <= 0.0:
        raise ValueError(f"a/b = {ratio:.3g} is too large for the limit of a long contact")
    return limits


@subroutine
def flexibilities(
    coefficients: CreepageCoefficients,
    semi_axis_x: float,
    semi_axis_y: float,
    shear_modulus: float,
) -> Flexibilities:
    """Return FASTSIM's three flexibilities.

    Parameters
    ----------
    coefficients : CreepageCoefficients
        Kalker's coefficients.
    semi_axis_x, semi_axis_y : float
        Half-lengths a along rolling and b across it [m].
    shear_modulus : float
        Combined shear modulus G [Pa].

    Returns
    -------
    Flexibilities

    Notes
    -----
    Kalker (1982), DOI 10.1080/00423118208968684.
    """
    return Flexibilities(
        8.0 * semi_axis_x / (3.0 * coefficients.c11 * shear_modulus),
        8.0 * semi_axis_x / (3.0 * coefficients.c22 * shear_modulus),
        math.pi
        * semi_axis_x
        * math.sqrt(semi_axis_x / semi_axis_y)
        / (4.0 * coefficients.c23 * shear_modulus),
    )


@subroutine
def one_flexibility(
    longitudinal: float,
    lateral: float,
    turning: float,
    creepage_x: float,
    creepage_y: float,
    creepage_spin: float,
) -> float:
    """Return the single flexibility of FASTSIM: the mean of the three, weighted by creepage.

    Parameters
    ----------
    longitudinal, lateral, turning : float
        L1, L2 and L3 [m/Pa].
    creepage_x, creepage_y, creepage_spin : float
        Longitudinal and lateral creepage, and spin times sqrt(ab); if all are zero, L1 is returned.

    Notes
    -----
    Kalker (1982), DOI 10.1080/00423118208968684.
    """
    x, y, spin = abs(creepage_x), abs(creepage_y), abs(creepage_spin)
    largest = max(x, y, spin)
    if not largest > 0.0:
        return longitudinal
    x, y, spin = x / largest, y / largest, spin / largest
    weighted = x * longitudinal + y * lateral + spin * turning
    return weighted / math.sqrt(x * x + y * y + spin * spin)
