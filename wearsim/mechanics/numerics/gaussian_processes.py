"""Correlated Gaussian inputs from white noise: field in the contact, and process in time."""

from __future__ import annotations

import math
from itertools import accumulate

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.types import FloatArray

REACH = 5  # cells on either side within which noise affects a point: 2.5 correlation lengths
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
    """Evaluate a field of unit variance at given points by smoothing noise on a lattice.

    Every node has the weight exp(-2 r^2/l^2) with l of two spacings; the correlation of the field
    is exp(-r^2/l^2). It is normalised by the sum of the squared weights at each point.

    Parameters
    ----------
    x : ndarray, shape (points, strips)
        Position along rolling [m].
    y : ndarray, shape (strips,)
        Axial position [m].
    noise : ndarray, shape (rows, columns)
        Independent standard normal values at the nodes: rows across the track, columns along
        rolling, with a margin of `REACH` cells on all sides.
    first_row, first_column : int
        Index of the first row and column on the infinite lattice, whose node 0, 0 is the origin.
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
        # exp(-(t - k)^2/2) without the factor exp(-t^2/2), which the normalisation cancels
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


def filter_noise(noise: FloatArray, memory: float) -> FloatArray:
    """Return z_0 = w_0, z_k+1 = r z_k + sqrt(1 - r^2) w_k+1, which has unit variance throughout.

    It is not compiled: most paths are short, and processes that only draw inputs need not wait for
    numba.

    Parameters
    ----------
    noise : ndarray, shape (points,)
        Independent standard normal values w.
    memory : float
        Correlation r of neighbouring values.

    Returns
    -------
    ndarray, shape (points,)
    """
    fresh = math.sqrt((1.0 - memory) * (1.0 + memory))
    path = accumulate(noise.tolist(), lambda last, new: memory * last + fresh * new)
    return np.fromiter(path, np.float64, len(noise))


@kernel
def squared_residuals(
    columns: FloatArray,
    decay: FloatArray,
    gain: FloatArray,
    scale: FloatArray,
    lines: FloatArray,
) -> FloatArray:
    """Return sums of squared residuals of columns for several models of their noise.

    Each column is whitened by the filter of each model, and the part along whitened lines is
    removed.

    Parameters
    ----------
    columns : ndarray, shape (columns, points)
        Heights [m].
    decay, gain, scale : ndarray, shape (points, models)
        Filters, see `wearsim.uq.hierarchy.noise.Noise.filter`.
    lines : ndarray, shape (lines, points, models)
        Orthonormal whitened lines of each model.

    Returns
    -------
    ndarray, shape (models, columns)
    """
    count, points = columns.shape
    models, forms = lines.shape[2], lines.shape[0]
    sums = np.empty((models, count))
    mean, squares, residual = np.empty(models), np.empty(models), np.empty(models)
    along = np.empty((forms, models))
    for c in range(count):
        mean[:] = 0.0
        squares[:] = 0.0
        along[:] = 0.0
        for j in range(points):
            for m in range(models):
                error = columns[c, j] - mean[m]
                white = scale[j, m] * error
                mean[m] = decay[j, m] * (mean[m] + gain[j, m] * error)
                squares[m] += white * white
                residual[m] = white
            for k in range(forms):
                for m in range(models):
                    along[k, m] += residual[m] * lines[k, j, m]
        for m in range(models):
            for k in range(forms):
                squares[m] -= along[k, m] * along[k, m]
            sums[m, c] = squares[m]
    return sums
