"""A Gaussian field in the contact: white noise on a lattice of its own, smoothed."""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.types import FloatArray

REACH = 5  # cells to either side that a point takes in: 2.5 correlation lengths
CELLS = 2 * REACH


@kernel
def smooth(
    x: FloatArray,
    y: FloatArray,
    noise: FloatArray,
    first_row: int,
    first_column: int,
    spacing: float,
) -> FloatArray:
    """Smooth lattice noise at given points into a field of unit variance.

    Every node weighs exp(-2 r^2/l^2), l being two spacings; noise smoothed by that has the
    correlation exp(-r^2/l^2). The sum of the squared weights normalises it at each point.

    Parameters
    ----------
    x : ndarray, shape (points, strips)
        Position along rolling [m].
    y : ndarray, shape (strips,)
        Axial position [m].
    noise : ndarray, shape (rows, columns)
        Independent normal scores at the nodes: rows across the track, columns along rolling,
        with `REACH` cells to spare on all sides.
    first_row, first_column : int
        Index of the first row and column on the endless lattice, whose node 0, 0 is the origin.
    spacing : float
        Distance of neighbouring nodes [m].

    Returns
    -------
    ndarray, shape (points, strips)
    """
    points, strips = x.shape
    columns = noise.shape[1]
    decay = np.empty(CELLS)
    for k in range(CELLS):
        offset = k - (REACH - 1)
        decay[k] = math.exp(-0.5 * offset * offset)
    across = np.zeros((columns, strips))
    weight = np.empty(CELLS)
    for i in range(strips):
        place = y[i] / spacing
        row = math.floor(place)
        # exp(-(t - k)^2/2) but for a factor exp(-t^2/2), which the normalisation cancels
        growth = math.exp(place - row)
        power, squares = growth ** (1 - REACH), 0.0
        for k in range(CELLS):
            weight[k] = power * decay[k]
            squares += weight[k] * weight[k]
            power *= growth
        start = int(row) - (REACH - 1) - first_row
        scale = 1.0 / math.sqrt(squares)
        for k in range(CELLS):
            for c in range(columns):
                across[c, i] += scale * weight[k] * noise[start + k, c]
    field = np.empty((points, strips))
    for p in range(points):
        for i in range(strips):
            place = x[p, i] / spacing
            column = math.floor(place)
            growth = math.exp(place - column)
            start = int(column) - (REACH - 1) - first_column
            power, total, squares = growth ** (1 - REACH), 0.0, 0.0
            for k in range(CELLS):
                w = power * decay[k]
                total += w * across[start + k, i]
                squares += w * w
                power *= growth
            field[p, i] = total / math.sqrt(squares)
    return field
