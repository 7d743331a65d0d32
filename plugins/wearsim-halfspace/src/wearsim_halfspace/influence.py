"""Influence coefficients of rectangular elements on elastic half-spaces, and their convolution."""

from __future__ import annotations

import numpy as np
from scipy import fft

from wearsim.types import FloatArray

WORKERS = 1  # one thread: results do not depend on the number of processors


def _log_sum(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return ln(a + sqrt(a^2 + b^2)), without cancellation for negative a."""
    radius = np.hypot(a, b)
    small = np.log(b * b) - np.log(radius - a)
    return np.asarray(np.where(a > 0.0, np.log(radius + a), small))


def _integrals(x: FloatArray, y: FloatArray, dx: float, dy: float) -> tuple[FloatArray, ...]:
    """Return the integrals of x^2/r^3, y^2/r^3 and xy/r^3 over elements about points.

    Parameters
    ----------
    x, y : ndarray, shapes (columns,) and (rows,)
        Distances from the centre of the elements [m].
    dx, dy : float
        Sizes of an element [m].

    Returns
    -------
    tuple of ndarray, shape (rows, columns)

    References
    ----------
    .. [1] A.E.H. Love, Phil. Trans. R. Soc. A 228 (1929), DOI 10.1098/rsta.1929.0009.
    """
    sums = [np.zeros((len(y), len(x))) for _ in range(3)]
    for side_x, side_y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        a, b = np.meshgrid(x + 0.5 * side_x * dx, y + 0.5 * side_y * dy)
        parts = b * _log_sum(a, b), a * _log_sum(b, a), -np.hypot(a, b)
        for number, part in enumerate(parts):
            sums[number] += side_x * side_y * part
    return tuple(sums)


class Convolution:
    """Convolution of fields on a grid with influence coefficients, by fast Fourier transforms.

    Parameters
    ----------
    coefficients : ndarray, shape (kernels, 2 rows - 1, 2 columns - 1)
        For all distances of two elements, zero in the middle.
    """

    def __init__(self, coefficients: FloatArray) -> None:
        _, high, wide = coefficients.shape
        self.rows, self.columns = (high + 1) // 2, (wide + 1) // 2
        self.padded = (fft.next_fast_len(high, real=True), fft.next_fast_len(wide, real=True))
        kernels = np.zeros((len(coefficients), *self.padded))
        rows = np.arange(1 - self.rows, self.rows) % self.padded[0]
        columns = np.arange(1 - self.columns, self.columns) % self.padded[1]
        kernels[:, rows[:, None], columns] = coefficients
        self.transforms = fft.rfft2(kernels)
        self.middle = coefficients[:, self.rows - 1, :]

    def __call__(self, field: FloatArray) -> FloatArray:
        """Return the convolution of a field, shape (rows, columns), with the first kernel."""
        return self._back(self.transforms[0] * self._forward(field))

    def of_vector(self, field: FloatArray) -> FloatArray:
        """Return that of a vector field, shape (2, rows, columns), with the kernels xx, yy, xy."""
        along, across = self._forward(field)
        xx, yy, xy = self.transforms
        return self._back(np.stack([xx * along + xy * across, xy * along + yy * across]))

    def divided(self, field: FloatArray, spectrum: FloatArray) -> FloatArray:
        """Return a field whose transform is divided by a spectrum."""
        return self._back(self._forward(field) / spectrum)

    def _forward(self, field: FloatArray) -> FloatArray:
        return np.asarray(fft.rfft2(field, s=self.padded, workers=WORKERS))

    def _back(self, transform: FloatArray) -> FloatArray:
        found = fft.irfft2(transform, s=self.padded, workers=WORKERS)
        return np.asarray(found[..., : self.rows, : self.columns])


class Elements:
    """Rectangular elements on two half-spaces of one material each.

    The bodies are quasi-identical: normal pressure gives no relative tangential displacement, and
    tangential traction no normal one.

    Parameters
    ----------
    rows, columns : int
        Numbers of elements across (y) and along (x).
    dx, dy : float
        Sizes of an element [m].
    shear_modulus, poisson_ratio : float
        Of both bodies combined: 1/G = (1/G_1 + 1/G_2)/2, nu/G = (nu_1/G_1 + nu_2/G_2)/2.

    Attributes
    ----------
    normal : Convolution
        Approach of the surfaces by pressure [m/Pa].
    rolling : Convolution
        Slip by traction in steady rolling, per distance rolled: the decrease of the displacement
        along x over one element [1/Pa].
    """

    def __init__(
        self, rows: int, columns: int, dx: float, dy: float, shear_modulus: float, poisson: float
    ) -> None:
        self.rows, self.columns, self.dx, self.dy = rows, columns, dx, dy
        x = np.asarray(np.arange(1 - columns, columns) * dx, dtype=np.float64)
        y = np.asarray(np.arange(1 - rows, rows) * dy, dtype=np.float64)
        scale = 1.0 / (np.pi * shear_modulus)

        def displacements(shift: float) -> FloatArray:
            along, across, mixed = _integrals(x + shift, y, dx, dy)
            every = (1.0 - poisson) * (along + across)
            return scale * np.stack([every + poisson * along, every + poisson * across,
                                     poisson * mixed])  # fmt: skip

        along, across, _ = _integrals(x, y, dx, dy)
        self.normal = Convolution(scale * (1.0 - poisson) * (along + across)[None])
        self.rolling = Convolution((displacements(0.0) - displacements(dx)) / dx)
