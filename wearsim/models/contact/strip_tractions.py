"""Tractions of several contacts by strip theory."""

from __future__ import annotations

import numpy as np

from wearsim.contact_batch import ContactBatch
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.numerics.jit import kernel_input, kernel_inputs
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import SUMS, strip_contacts
from wearsim.types import FloatArray, Grid

_SUMS = len(SUMS)


def strip_tractions(
    line_load: FloatArray,
    half_length: FloatArray,
    batch: ContactBatch,
    grid: Grid,
    pair: ElasticPair,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return dissipation, `SUMS`, and the torques on free rollers, by strip theory.

    Parameters
    ----------
    line_load, half_length : ndarray, shape (contacts, strips)
        Solution of the normal problems [N/m], [m].
    batch : ContactBatch
        The contacts, with at most one friction value per strip.
    grid : Grid
    pair : ElasticPair

    Returns
    -------
    dissipation : ndarray, shape (contacts, strips)
        [W/m].
    sums : ndarray, shape (6, contacts)
    torque : ndarray, shape (contacts,)
        Torques of the longitudinal tractions on the rollers [N m]; zero without rolling radii.
    """
    contacts, variation, radius = line_load.shape[0], batch.variation, batch.rolling_radius
    dissipation, none = np.empty(line_load.shape), line_load[:, :0]
    of_contacts = np.empty((_SUMS + 1, contacts))
    sums, torque = of_contacts[:_SUMS], of_contacts[_SUMS]
    speed, longitudinal, lateral, spin, friction = kernel_inputs(
        *(batch.rolling_speed, batch.longitudinal, batch.lateral, batch.spin, batch.friction)
    )
    strip_contacts(
        line_load,
        half_length,
        grid.y,
        grid.spacing,
        strip_elasticity(pair.contact_modulus, pair.shear_modulus),
        speed,
        longitudinal,
        lateral,
        spin,
        none if variation is None else kernel_input(variation),
        friction.reshape(contacts, -1),
        none if radius is None else kernel_input(radius),
        dissipation,
        sums,
        torque,
    )
    return dissipation, sums, torque
