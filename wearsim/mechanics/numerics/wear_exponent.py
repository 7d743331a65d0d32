"""Dependence of wear on the line load: ratios and exponents of every strip."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.types import FloatArray

LEAST_EXPONENT = 0.4  # wear is proportional to q^(1/2) in adhesion and at a steady wear rate
MIN_LOG_CHANGE = 1e-7  # least relative change of a line load for the estimate of an exponent


@kernel
def ratio_to_load(wear: FloatArray, line_load: FloatArray) -> FloatArray:
    """Return wear over line load, interpolated and extrapolated to strips without load.

    Parameters
    ----------
    wear, line_load : ndarray, shape (contacts, strips)
        Depth [m] and line load [N/m].

    Returns
    -------
    ndarray, shape (contacts, strips)
        Ratio [m/(N/m)], linear between loaded strips and constant beyond them.
    """
    contacts, n = wear.shape
    ratio = np.empty((contacts, n))
    for k in range(contacts):
        last = -1
        for i in range(n):
            if not line_load[k, i] > 0.0:
                continue
            here = wear[k, i] / line_load[k, i]
            start = ratio[k, last] if last >= 0 else here
            for j in range(last + 1, i):
                part = (j - last) / (i - last) if last >= 0 else 1.0
                ratio[k, j] = start + (here - start) * part
            ratio[k, i] = here
            last = i
        for j in range(last + 1, n):
            ratio[k, j] = ratio[k, last] if last >= 0 else 0.0
    return ratio


@kernel
def estimate_exponents(
    load: FloatArray,
    new_load: FloatArray,
    wear: FloatArray,
    new_wear: FloatArray,
    greatest: float,
    exponents: FloatArray,
) -> None:
    """Estimate the exponent of wear as a power of the line load from two solutions.

    Parameters
    ----------
    load, new_load : ndarray, shape (contacts, strips)
        Line loads of the two solutions [N/m].
    wear, new_wear : ndarray, shape (contacts, strips)
        Wear of the two solutions, in the same unit.
    greatest : float
        Upper bound of the exponents.
    exponents : ndarray, shape (contacts, strips)
        Updated in strips whose load has changed.
    """
    for k in range(load.shape[0]):
        for i in range(load.shape[1]):
            if not (wear[k, i] > 0.0 and new_wear[k, i] > 0.0):
                continue
            rise = np.log(new_load[k, i] / load[k, i])
            if abs(rise) > MIN_LOG_CHANGE:
                slope = np.log(new_wear[k, i] / wear[k, i]) / rise
                exponents[k, i] = min(max(slope, LEAST_EXPONENT), greatest)
