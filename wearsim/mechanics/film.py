"""Film thickness of an elastohydrodynamic contact.

Hamrock, Dowson, Isothermal elastohydrodynamic lubrication of point contacts, part 3, J. Lubrication
Technology 99 (1977), DOI 10.1115/1.3453074: H_min = 3.63 U^0.68 G^0.49 W^-0.073 (1 - exp(-0.68 k)),
with U = eta u/(E' R_x), G = alpha E', W = N/(E' R_x^2), k = 1.03 (R_y/R_x)^0.64 and E' = 2 E*.
"""

from __future__ import annotations

import numpy as np

from wearsim.types import FloatArray


def minimum_film(
    entrainment_speed: FloatArray,
    normal_force: FloatArray,
    curvature_x: FloatArray,
    curvature_y: float,
    contact_modulus: float,
    viscosity: float,
    pressure_viscosity: float,
) -> FloatArray:
    """Return the least film thickness of fully flooded, isothermal contacts [m].

    Parameters
    ----------
    entrainment_speed : ndarray, shape (contacts,)
        Mean speed of the surfaces against the contact; the rolling speed [m/s].
    normal_force, curvature_x : ndarray, shape (contacts,)
        Load [N], and relative curvature along rolling [1/m].
    curvature_y, contact_modulus : float
        Relative curvature across rolling [1/m], and E* [Pa].
    viscosity, pressure_viscosity : float
        Dynamic viscosity at ambient pressure [Pa s], and its exponent of the pressure [1/Pa].
    """
    modulus, radius = 2.0 * contact_modulus, 1.0 / curvature_x
    speed = viscosity * entrainment_speed / (modulus * radius)
    load = normal_force / (modulus * radius**2)
    shape = 1.0 - np.exp(-0.68 * (1.03 * (curvature_x / curvature_y) ** 0.64))
    material = (pressure_viscosity * modulus) ** 0.49
    return np.asarray(3.63 * speed**0.68 * material * load**-0.073 * shape * radius)
