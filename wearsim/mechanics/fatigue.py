"""Contact fatigue: damage that a step adds, and stresses below a line contact."""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.types import FloatArray

#: depth of the greatest shear stress below a line contact, over its half-length: the root of
#: u^2 + u - 1 for its square u
SHEAR_DEPTH = math.sqrt(0.5 * (math.sqrt(5.0) - 1.0))
ORTHOGONAL = 0.25, 0.5  # greatest orthogonal shear stress over p0, and its depth over a
_DEPTHS = np.linspace(0.0, 3.0, 3001)  # over the half-length, of which one has the greatest stress
PARABOLA = 1.0 / 6.0  # integral of x (1 - x) between 0 and 1
PART = 0.5  # error of the parabola over what it differs from the line
BEND = 2.0  # greatest coefficient of the parabola, where the damage per pass is not smooth
#: distance of the outer nodes of Gauss's quadrature from the middle, and their weights
NODE, WEIGHT = 0.5 * math.sqrt(0.6), 5.0 / 18.0


@kernel
def damage_of_step(
    old: FloatArray,
    first_rates: FloatArray,
    last_rates: FloatArray,
    removed: FloatArray,
    start: FloatArray,
    lengths: FloatArray,
    points: FloatArray,
    slope: float,
) -> tuple[FloatArray, FloatArray]:
    """Add the damage of a step to that of the bodies.

    The damage per pass r is nearly a power of the passes plus a constant, the passes that wear off
    the elastic approach. The parabola through ln r at the start of the step, at its end and at the
    point before, over the logarithm of this sum, is integrated by Gauss's quadrature. The error is
    a part of what it differs from the line. Where a contact begins or ends within the step, it is
    the mean of both ends.

    Parameters
    ----------
    old : ndarray, shape (4, bodies, strips)
        Damage, its error, and damage per pass, last at the point before the step; row number
        b * realisations + v.
    first_rates, last_rates : ndarray, shape (bodies, strips)
        Damage per pass at the start and at the end of the step.
    removed : ndarray, shape (bodies, strips)
        Worn depth of the step over the thickness of the damaged layer; without rows if wear takes
        no damage.
    start, lengths : ndarray, shape (realisations,)
        Passes at the start of the step, and of the step.
    points : ndarray, shape (2, realisations)
        Passes at the point before, not a number if there is none, and the constant.
    slope : float
        Exponent of the damage in the sums of the strips; 0 for the greatest damage instead.

    Returns
    -------
    damage : ndarray, shape (4, bodies, strips)
        Damage, its error, damage per pass at the end and at the start of the step.
    sums : ndarray, shape (3, bodies)
        Sums of the damage before and after the step, and of the latter with the error of the step.
    """
    _, bodies, strips = old.shape
    realisations = points.shape[1]
    damage, sums = np.empty((4, bodies, strips)), np.empty((3, bodies))
    for b in range(bodies):
        v = b % realisations
        done, passes, past, scale = start[v], lengths[v], points[0, v], points[1, v]
        behind, low, middle, high = 0.0, 0.0, 0.5, 1.0
        if passes > 0.0:
            span = math.log1p(passes / (done + scale))
            low = math.log1p((0.5 - NODE) * passes / (done + scale)) / span
            middle = math.log1p(0.5 * passes / (done + scale)) / span
            high = math.log1p((0.5 + NODE) * passes / (done + scale)) / span
            if past < done:
                behind = math.log1p((done - past) / (past + scale)) / span
        for k in range(3):
            sums[k, b] = 0.0
        for i in range(strips):
            before, first, last = old[3, b, i], first_rates[b, i], last_rates[b, i]
            mean = 0.5 * (first + last)
            error = 0.5 * abs(last - first)
            if first > 0.0 and last > 0.0:
                begin, change, bend = math.log(first), math.log(last / first), 0.0
                curved = before > 0.0 and behind > 0.0
                if curved:
                    bend = (change - math.log(first / before) / behind) / (1.0 + behind)
                    bend = min(max(bend, -BEND), BEND)
                ends = mean
                mean = WEIGHT * (
                    math.exp(begin + low * (change + bend * (low - 1.0)))
                    + math.exp(begin + high * (change + bend * (high - 1.0)))
                )
                middle_rate = math.exp(begin + middle * (change + bend * (middle - 1.0)))
                mean += (1.0 - 2.0 * WEIGHT) * middle_rate
                error = PART * PARABOLA * abs(bend) * mean if curved else abs(mean - ends)
            added, error, kept = passes * mean, passes * error, old[0, b, i]
            if len(removed) and added + kept > 0.0:
                part = removed[b, i]
                uneven = abs(last - first) / (first + last) if mean > 0.0 else 0.0
                error += added * min(part, 1.0) * uneven * PARABOLA
                kept *= math.exp(-part)
                # of what the step adds, its later part removes what it would of an even addition
                added *= -math.expm1(-part) / part if part > 1e-6 else 1.0 - 0.5 * part
            damage[0, b, i], damage[1, b, i] = kept + added, old[1, b, i] + error
            damage[2, b, i], damage[3, b, i] = last, first
            if slope == 0.0:
                sums[0, b] = max(sums[0, b], old[0, b, i])
                sums[1, b] = max(sums[1, b], kept + added)
                sums[2, b] = max(sums[2, b], kept + added + error)
            elif kept + added > 0.0:
                sums[0, b] += old[0, b, i] ** slope
                sums[1, b] += (kept + added) ** slope
                sums[2, b] += (kept + added + error) ** slope
    return damage, sums


def greatest_von_mises(poisson_ratio: float) -> tuple[float, float]:
    """Return the greatest stress of von Mises below a line contact without traction.

    Parameters
    ----------
    poisson_ratio : float
        Of the body.

    Returns
    -------
    (float, float)
        The stress over the greatest pressure, and its depth over the half-length. In plane strain
        it is in the middle plane (Johnson, Contact Mechanics, eqs. 4.46).
    """
    depth = _DEPTHS
    root = np.sqrt(1.0 + depth**2)
    along, normal = 2.0 * depth - (1.0 + 2.0 * depth**2) / root, -1.0 / root
    across = poisson_ratio * (along + normal)
    stress = np.sqrt(0.5 * ((along - normal) ** 2 + (normal - across) ** 2 + (across - along) ** 2))
    place = int(stress.argmax())
    return float(stress[place]), float(depth[place])
