"""Combined elastic constants of two bodies in contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

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
    creep_factor : float
        Kalker's reduction factor, by which both moduli have been multiplied.
    """

    shear_modulus: float
    poisson_ratio: float
    contact_modulus: float
    dundurs: float
    creep_factor: float = 1.0

    def reduced(self, creep_factor: float) -> ElasticPair:
        """Return the constants of a tangential problem with a third body between the bodies.

        Their compliance along the surface is divided by the factor, so that the initial slope of
        traction against creepage is multiplied by it (Kalker 1990, DOI 10.1007/978-94-015-7889-9).
        """
        return replace(
            self,
            shear_modulus=creep_factor * self.shear_modulus,
            contact_modulus=creep_factor * self.contact_modulus,
            creep_factor=creep_factor * self.creep_factor,
        )


@lru_cache  # asked for by the scenario and by each contact model
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
