"""Elastic constants of two bodies, width of their fresh contact, and lengths of its strips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wearsim.types import FloatArray, Material


def combined(materials: Sequence[Material]) -> tuple[float, float]:
    """Return shear modulus [Pa] and Poisson's ratio of two bodies combined.

    1/G = (1/G_1 + 1/G_2)/2 and nu/G = (nu_1/G_1 + nu_2/G_2)/2 (Kalker 1990, section 1.7).
    """
    softness = [(1.0 + m.poisson_ratio) / m.youngs_modulus for m in materials]
    shear_modulus = 1.0 / sum(softness)
    ratios = (part * m.poisson_ratio for part, m in zip(softness, materials, strict=True))
    return shear_modulus, shear_modulus * sum(ratios)


def difference(materials: Sequence[Material]) -> float:
    """Return Kalker's constant of two different bodies, zero for quasi-identical ones.

    K = G/4 ((1 - 2 nu_1)/G_1 - (1 - 2 nu_2)/G_2) (Kalker 1990, section 1.7). Dundurs' second
    constant is K/(1 - nu) in size.
    """
    first, second = (
        (1.0 + m.poisson_ratio) * (1.0 - 2.0 * m.poisson_ratio) / m.youngs_modulus
        for m in materials
    )
    return 0.5 * combined(materials)[0] * (first - second)


def half_width(along: float, across: float, force: float, modulus: float) -> float:
    """Return the half-width of the contact of Hertz across rolling [m].

    Parameters
    ----------
    along, across : float
        A and B of the gap ``A x^2 + B y^2`` [1/m], both positive.
    force : float
        Normal force [N].
    modulus : float
        Contact modulus E* [Pa].

    References
    ----------
    .. [1] K.L. Johnson, Contact Mechanics (1985), section 4.2.
    """
    # both are slow to load
    from scipy.optimize import brentq  # noqa: PLC0415
    from scipy.special import elliprd  # noqa: PLC0415

    def integrals(logarithm: float) -> tuple[float, float]:
        """Return the shares of A and B for b/a, up to a common factor."""
        square = np.exp(2.0 * logarithm)
        return float(elliprd(0.0, square, 1.0)), float(elliprd(0.0, 1.0, square))

    def excess(logarithm: float) -> float:
        share_along, share_across = integrals(logarithm)
        return float(np.log(share_along / share_across) - np.log(along / across))

    logarithm = float(brentq(excess, -12.0, 12.0))
    # A = p0 a b/(2 E*) times the integral of ds/((a^2 + s) sqrt((a^2 + s)(b^2 + s) s))
    ratio = float(np.exp(logarithm))
    cube = force * integrals(logarithm)[0] / (2.0 * np.pi * modulus * along)
    return float(ratio * np.cbrt(cube))


def elliptic_pressure(load: FloatArray, half_length: FloatArray, x: FloatArray) -> FloatArray:
    """Return the pressure of strips with elliptic distributions [Pa]."""
    length = np.where(load > 0.0, np.maximum(half_length, x[1] - x[0]), 1.0)[:, None]
    shape = np.sqrt(np.maximum(1.0 - (x / length) ** 2, 0.0))
    return np.asarray(2.0 * load[:, None] / (np.pi * length) * shape)


def half_lengths(pressure: FloatArray, x: FloatArray) -> FloatArray:
    """Return the half-length of each row [m].

    The square of the pressure is linear near an edge; its zero is extrapolated from the two
    outermost elements of both ends.
    """
    lengths, dx = np.zeros(len(pressure)), float(x[1] - x[0])
    for row, values in enumerate(pressure):
        touching = np.flatnonzero(values > 0.0)
        if len(touching) == 0:
            continue
        ends = 0.5 * dx * (len(touching) - 1)
        for outer, inner in ((touching[0], touching[0] + 1), (touching[-1], touching[-1] - 1)):
            square, rise = values[outer] ** 2, values[inner] ** 2 - values[outer] ** 2
            ends += 0.5 * dx * (min(square / rise, 1.0) if rise > 0.0 else 0.5)
        lengths[row] = ends
    return lengths
