"""The tangential problem of the model `slender` by strip theory, many contacts in one call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.contact_batch import OperatingPoints
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.numerics.jit import own_array
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import SUMS, strip_contacts
from wearsim.types import FloatArray, Grid, OperatingPoint


class Asked(NamedTuple):
    """What is asked of contacts, in the order and of the kind that `strip_contacts` takes it.

    Parameters
    ----------
    rolling_speed : float
        V [m/s].
    longitudinal, lateral, spin : ndarray, shape (contacts,)
        Mean longitudinal, and lateral creepage, and spin [1/m].
    variation, friction : ndarray, shape (contacts, strips)
        How the longitudinal creepage varies; friction coefficient.
    """

    rolling_speed: float
    longitudinal: FloatArray
    lateral: FloatArray
    spin: FloatArray
    variation: FloatArray
    friction: FloatArray

    @classmethod
    def of(cls, points: OperatingPoints, grid: Grid) -> Asked:
        """Return what columns of operating points ask, with friction no finer than the strips."""
        friction, variation = points.friction, points.variation
        per_strip = np.empty((len(friction), grid.strips))
        per_strip[:] = friction if friction.ndim > 1 else friction[:, None]
        return cls(
            points.rolling_speed,
            own_array(points.longitudinal),
            own_array(points.lateral),
            own_array(points.spin),
            -points.spin[:, None] * grid.y if variation is None else own_array(variation),
            per_strip,
        )

    @classmethod
    def of_one(cls, point: OperatingPoint, grid: Grid) -> Asked:
        """Return what one operating point asks: as `of`, without the columns between."""
        creepage, variation = point.creepage, point.creepage.variation
        friction = np.empty((1, grid.strips))
        friction[:] = point.friction
        return cls(
            point.rolling_speed,
            np.array([creepage.longitudinal], dtype=np.float64),
            np.array([creepage.lateral], dtype=np.float64),
            np.array([creepage.spin], dtype=np.float64),
            (-creepage.spin * grid.y if variation is None else own_array(variation))[None],
            friction,
        )


def strip_tractions(
    line_load: FloatArray, half_length: FloatArray, asked: Asked, grid: Grid, pair: ElasticPair
) -> tuple[FloatArray, FloatArray]:
    """Return dissipation, (contacts, strips) [W/m], and `SUMS`, (6, contacts).

    Parameters
    ----------
    line_load, half_length : ndarray
        q [N/m] and a [m], of contacts in the order of `asked`.
    asked : Asked
    grid : Grid
    pair : ElasticPair
    """
    shape = asked.friction.shape
    dissipation, sums = np.empty(shape), np.empty((len(SUMS), shape[0]))
    strip_contacts(
        line_load.reshape(shape),
        half_length.reshape(shape),
        grid.y,
        grid.spacing,
        strip_elasticity(pair.contact_modulus, pair.shear_modulus),
        *asked,
        dissipation,
        sums,
    )
    return dissipation, sums


def first_not_finite(sums: FloatArray) -> int | None:
    """Return the first contact of which a sum is not finite, from (sums, contacts), if any."""
    sound = np.isfinite(sums)
    if np.count_nonzero(sound) == sums.size:
        return None
    return int(np.argmin(sound.all(axis=0)))
