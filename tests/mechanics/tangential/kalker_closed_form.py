"""Closed form of FASTSIM on Kalker's ellipse with the parabolic traction bound."""

import math

import numpy as np

from wearsim.mechanics.tangential.fastsim import closed_form


def closed_form_parabolic(
    semi_axis_x, semi_axis_y, normal_force, friction, creepage, flexibility, half_length
):
    """Return the magnitude of the force of every strip under one creepage [N/m].

    With kappa = v a^2/(L mu pp), pp = 2N/(pi a b), equal for all strips of half-length A:
    F = (v/L)(2 A^2 - A kappa + kappa^2/6) where kappa < 2A, else (4/3) mu pp A^3/a^2.
    """
    peak = friction * 2.0 * normal_force / (math.pi * semi_axis_x * semi_axis_y)
    bound_peak = peak * (half_length / semi_axis_x) ** 2
    gradient = np.full_like(half_length, creepage / flexibility)
    return -closed_form(half_length, bound_peak, False, gradient, 0.0)[0]
