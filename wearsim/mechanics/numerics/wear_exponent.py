"""How the wear of strips follows their line load: ratios and exponents, contact by contact."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.types import FloatArray

LEAST_EXPONENT = 0.4  # wear goes as q^(1/2) in adhesion, and where its rate is at rest
MIN_LOG_CHANGE = 1e-7  # relative change of a line load from which an exponent can be read


@kernel
def ratio_to_load(wear: FloatArray, line_load: FloatArray) -> FloatArray:
    """Return wear over line load, carried on into strips without load.

    Parameters
    ----------
    wear, line_load : ndarray, shape (contacts, strips)
        Depth [m] and line load [N/m].

    Returns
    -------
    ndarray, shape (contacts, strips)
        Linear between loaded strips, and constant beyond them [m/(N/m)].
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
    """Read from two solutions of the same contacts with which exponent wear follows the line load.

    Parameters
    ----------
    load, new_load : ndarray, shape (contacts, strips)
        Line loads of the two [N/m].
    wear, new_wear : ndarray, shape (contacts, strips)
        Wear of the two, in one unit.
    greatest : float
        The greatest exponent that is believed.
    exponents : ndarray, shape (contacts, strips)
        Changed where the load did.
    """
    for k in range(load.shape[0]):
        for i in range(load.shape[1]):
            if not (wear[k, i] > 0.0 and new_wear[k, i] > 0.0):
                continue
            rise = np.log(new_load[k, i] / load[k, i])
            if abs(rise) > MIN_LOG_CHANGE:
                slope = np.log(new_wear[k, i] / wear[k, i]) / rise
                exponents[k, i] = min(max(slope, LEAST_EXPONENT), greatest)
