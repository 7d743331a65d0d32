"""Reference solver for the normal contact of elastic half-spaces, exact up to its grid.

Rectangles of constant pressure, whose displacement is Love's closed form (Love 1929, DOI
10.1098/rsta.1929.0009; Johnson, Contact Mechanics, 3.26), convolved by FFT; the pressure by
conjugate gradients on the rectangles in contact (Polonsky and Keer 1999, DOI
10.1016/S0043-1648(99)00113-1). It uses no strips, no semi-elliptic pressures and no code of
`wearsim`.
"""

from dataclasses import dataclass

import numpy as np

TOLERANCE = 1e-8  # change of the pressure in one iteration, relative
ITERATIONS = 1000


@dataclass(frozen=True)
class Solution:
    """Line load [N/m] and half-length [m] over y [m]; approach [m]; peak pressure [Pa]."""

    y: np.ndarray
    line_load: np.ndarray
    half_length: np.ndarray
    approach: float
    peak_pressure: float


def under_rectangle(x, y, width, depth):
    """Return displacement times pi E* over pressure at (x, y) from the centre of a rectangle."""

    def corner(u, v):
        return u * np.arcsinh(v / np.abs(u)) + v * np.arcsinh(u / np.abs(v))

    right, left, up, down = x + 0.5 * width, x - 0.5 * width, y + 0.5 * depth, y - 0.5 * depth
    return corner(right, up) + corner(left, down) - corner(right, down) - corner(left, up)


class HalfSpace:
    """Displacement under pressures on a grid, by FFT on a grid twice as large."""

    def __init__(self, shape, width, depth, modulus):
        self.shape, self._padded = shape, (2 * shape[0], 2 * shape[1])
        indices = [np.fft.fftfreq(n, 1.0 / n) for n in self._padded]
        x, y = indices[0][:, None] * width, indices[1] * depth
        self._response = np.fft.rfft2(under_rectangle(x, y, width, depth) / (np.pi * modulus))

    def displacement(self, pressure):
        """Return the displacement at the centre of every rectangle."""
        found = np.fft.irfft2(np.fft.rfft2(pressure, self._padded) * self._response, self._padded)
        return found[: self.shape[0], : self.shape[1]]


def pressure_of(gap, load, width, depth, modulus):
    """Return pressure [Pa] and approach [m] of a gap [m] on a grid under a load [N]."""
    space, unit = HalfSpace(gap.shape, width, depth, modulus), load / (width * depth)
    pressure = np.where(gap <= np.quantile(gap, 0.2), 1.0, 0.0)
    pressure *= unit / pressure.sum()
    direction, squared, conjugate = np.zeros_like(gap), 1.0, False
    for _ in range(ITERATIONS):
        touching = pressure > 0.0
        residual = space.displacement(pressure) + gap
        approach = residual[touching].mean()
        residual -= approach
        before, squared = squared, float((residual[touching] ** 2).sum())
        direction = np.where(touching, residual + conjugate * squared / before * direction, 0.0)
        response = space.displacement(direction)
        response -= response[touching].mean()
        step = (residual * direction)[touching].sum() / (response * direction)[touching].sum()
        old, pressure = pressure, np.maximum(0.0, pressure - step * direction)
        penetrated = (pressure == 0.0) & (residual < 0.0)
        conjugate = not penetrated.any()
        pressure[penetrated] -= step * residual[penetrated]
        pressure *= unit / pressure.sum()
        if np.abs(pressure - old).sum() < TOLERANCE * pressure.sum():
            return pressure, float(approach)
    raise RuntimeError("conjugate gradients did not converge")


def half_lengths(pressure, x):
    """Return a(y), where p^2, linear in x^2 near the edge, extrapolates to zero.

    The outermost rectangle, which the edge intersects, is not used. A column of fewer than four
    rectangles ends at the edge of its last one.
    """
    found = np.zeros(pressure.shape[1])
    for j, column in enumerate(pressure[len(x) // 2 :].T):
        count = int((column > 0.0).sum())
        if count > 3:
            inner = slice(count - 4, count - 1)
            slope, level = np.polyfit(x[len(x) // 2 :][inner] ** 2, column[inner] ** 2, 1)
            found[j] = np.sqrt(-level / slope)
        elif count > 0:
            found[j] = x[len(x) // 2 + count - 1] + 0.5 * (x[1] - x[0])
    return found


def solve(gap, y, curvature, load, modulus, reach, points_along=64):
    """Solve a contact whose gap is ``curvature x^2 / 2 + gap(y)``.

    Parameters
    ----------
    gap, y : ndarray, shape (points,)
        Gap on the line x = 0 [m], at the evenly spaced centres y [m] of the rectangles.
    curvature, load, modulus : float
        Relative curvature in rolling direction [1/m], load [N], E* [Pa].
    reach : float
        Half-length of the grid in rolling direction [m], greater than that of the contact.
    points_along : int
        Number of rectangles in rolling direction, even.
    """
    width, depth = 2.0 * reach / points_along, y[1] - y[0]
    x = (np.arange(points_along) + 0.5) * width - reach
    pressure, approach = pressure_of(
        0.5 * curvature * x[:, None] ** 2 + gap, load, width, depth, modulus
    )
    if pressure[0].any() or pressure[:, [0, -1]].any():
        raise ValueError("the contact reaches the edge of the grid")
    return Solution(
        y=y,
        line_load=pressure.sum(axis=0) * width,
        half_length=half_lengths(pressure, x),
        approach=approach,
        peak_pressure=float(pressure.max()),
    )
