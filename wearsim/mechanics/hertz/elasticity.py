"""Combined elastic constants of two bodies in contact."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.types import Material


@dataclass(frozen=True)
class ElasticPair:
    """Combined elastic constants of two bodies.

    Parameters
    ----------
    shear_modulus : float
        Combined shear modulus G [Pa], 1/G = 1/(2 G1) + 1/(2 G2).
    poisson_ratio : float
        Combined Poisson's ratio, nu/G = nu1/(2 G1) + nu2/(2 G2).
    contact_modulus : float
        E* [Pa], 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; equals G/(1 - nu).
    dundurs : float
        Dundurs' second constant beta, a measure of the coupling of pressure and traction.
    """

    shear_modulus: float
    poisson_ratio: float
    contact_modulus: float
    dundurs: float


def combine(first: Material, second: Material) -> ElasticPair:
    """Return the combined constants of two bodies (eq. 6 of DOI 10.1016/j.wear.2004.11.012).

    Parameters
    ----------
    first, second : Material
        The two bodies.

    Returns
    -------
    ElasticPair
    """
    nu1, nu2 = first.poisson_ratio, second.poisson_ratio
    g1 = first.youngs_modulus / (2.0 * (1.0 + nu1))
    g2 = second.youngs_modulus / (2.0 * (1.0 + nu2))
    shear = 1.0 / (0.5 / g1 + 0.5 / g2)
    poisson = shear * (0.5 * nu1 / g1 + 0.5 * nu2 / g2)
    difference = 0.5 * (g1 * (1.0 - 2.0 * nu2) - g2 * (1.0 - 2.0 * nu1))
    dundurs = difference / (g1 * (1.0 - nu2) + g2 * (1.0 - nu1))
    return ElasticPair(shear, poisson, shear / (1.0 - poisson), dundurs)
