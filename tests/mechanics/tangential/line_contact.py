"""Numerical solution of steady rolling of one strip, the reference of the closed form.

Lengths are in half-lengths, tractions in mu p0 and slip in 2 mu p0 / E_x. Tractions are constant
over n elements; stick and slip are found by Newton's method on the projection onto Coulomb's disc.
"""

import numpy as np


def _differences(n):
    """Return the strain by unit tractions between an element and the next one ahead."""
    width = 2.0 / n
    place = np.arange(-n - 1, n + 2) * width

    def integral(z):
        return z * np.log(np.abs(z)) - z

    moved = -(integral(place + 0.5 * width) - integral(place - 0.5 * width)) / np.pi
    offset = np.arange(n)[:, None] - np.arange(n)[None, :] + n + 1
    return (moved[offset + 1] - moved[offset]) / width


def _bound(n):
    edge = np.linspace(-1.0, 1.0, n + 1)
    return np.diff(0.5 * (edge * np.sqrt(1.0 - edge * edge) + np.arcsin(edge))) * 0.5 * n


def _solve(d_x, d_y, psi, stiffness, n):
    strain, bound, width = _differences(n), _bound(n), 2.0 / n
    x = -1.0 + width * (np.arange(n) + 0.5)
    rigid = np.array([np.full(n, d_x), stiffness * (d_y + psi * (x + 0.5 * width))])
    scale = np.array([1.0, stiffness])[:, None]
    reach = 1.0 / (stiffness * abs(strain[0, 0]))
    traction = -bound * np.array([[d_x], [d_y]]) / np.hypot(d_x, d_y)
    for iteration in range(80):
        trial = traction - reach * (rigid - scale * (traction @ strain.T))
        size = np.hypot(*trial)
        sticks = size <= bound
        factor = np.where(sticks, 1.0, bound / size)
        residual = traction - factor * trial
        if np.abs(residual).max() < 1e-9:
            force = traction.sum(axis=1) * width
            return np.array([*force, (x * traction[1]).sum() * width]) / (0.5 * np.pi)
        along = trial / size
        blocks = [[None, None], [None, None]]
        for i in range(2):
            for j in range(2):
                turned = np.where(sticks, float(i == j), factor * ((i == j) - along[i] * along[j]))
                back = np.eye(n) + reach * scale[j] * strain
                blocks[i][j] = (i == j) * np.eye(n) - turned[:, None] * back
        step = np.linalg.solve(np.block(blocks), residual.ravel()).reshape(2, n)
        # undamped steps may cycle because of elements that alternate between stick and slip
        traction = traction - (step if iteration < 12 else 0.5 * step)
    raise AssertionError("Newton's method did not converge")


def rolling_strip(d_x, d_y, psi, stiffness, n=64):
    """Return both forces over mu q and their moment over mu q a, extrapolated to zero width.

    Parameters
    ----------
    d_x, d_y, psi : float
        Creepage and spin as in `wearsim.mechanics.tangential.carter`, over the half-length.
    stiffness : float
        E_x / G_y.
    n : int
        Number of elements; the extrapolation also uses half as many.
    """
    return 2.0 * _solve(d_x, d_y, psi, stiffness, n) - _solve(d_x, d_y, psi, stiffness, n // 2)
