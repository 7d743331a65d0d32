"""Influence coefficients of rectangular elements on elastic half-spaces, and their convolution."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from wearsim.types import FloatArray


def _integrals(columns: int, rows: int, dx: float, dy: float) -> FloatArray:
    """Return the integrals of x^2/r^3, y^2/r^3 and xy/r^3 over elements.

    Parameters
    ----------
    columns, rows : int
        Numbers of distances along and across, from 0 in steps of an element.
    dx, dy : float
        Sizes of an element [m].

    Returns
    -------
    ndarray, shape (3, rows, columns)

    References
    ----------
    .. [1] A.E.H. Love, Phil. Trans. R. Soc. A 228 (1929), DOI 10.1098/rsta.1929.0009.
    """
    # corners of the elements; the antiderivatives differ from Love's by terms that cancel
    a = ((np.arange(columns + 1) - 0.5) * dx)[None, :]
    b = ((np.arange(rows + 1) - 0.5) * dy)[:, None]
    corners = np.stack([b * np.arcsinh(a / np.abs(b)), a * np.arcsinh(b / np.abs(a)),
                        -np.hypot(a, b)])  # fmt: skip
    return np.asarray(np.diff(np.diff(corners, axis=1), axis=2))


def _odd_integrals(columns: int, rows: int, dx: float, dy: float) -> FloatArray:
    """Return the integrals of x/r^2 and y/r^2 over elements, shape (2, rows, columns).

    Parameters are those of `_integrals`.
    """
    a = ((np.arange(columns + 1) - 0.5) * dx)[None, :]
    b = ((np.arange(rows + 1) - 0.5) * dy)[:, None]
    logarithm = np.log(np.hypot(a, b))
    corners = np.stack([b * logarithm + a * np.arctan(b / a), a * logarithm + b * np.arctan(a / b)])
    return np.asarray(np.diff(np.diff(corners, axis=1), axis=2))


def _mean_along(columns: int, rows: int, dx: float, dy: float) -> FloatArray:
    """Return the mean of the last kernel of `_integrals` over positions along one element.

    See `_integrals` for the parameters; shape (rows, columns).
    """
    a = (np.arange(-1, columns + 1) * dx)[None, :]
    b = ((np.arange(rows + 1) - 0.5) * dy)[:, None]
    corners = -0.5 * (a * np.hypot(a, b) + b**2 * np.arcsinh(a / np.abs(b)))
    return np.asarray(np.diff(np.diff(corners, axis=0), n=2, axis=1) / dx)


def inner(first: FloatArray, second: FloatArray) -> float:
    """Return the sum of the products of two fields.

    Libraries of linear algebra start threads for fields of this size, and wait for them where
    another process is busy; this takes one thread.
    """
    return float(np.einsum("i,i->", first.ravel(), second.ravel()))


class Convolution:
    """Convolution of fields on a grid with influence coefficients, by fast Fourier transforms.

    Parameters
    ----------
    coefficients : ndarray, shape (kernels, 2 rows - 1, 2 columns - 1)
        Influence coefficients for all distances of two elements, with distance zero in the middle.

    Attributes
    ----------
    middle : ndarray, shape (kernels, 2 columns - 1)
        Coefficients of elements in one row.
    quarter : ndarray, shape (rows, columns)
        Coefficients of the first kernel for distances that are not negative.
    """

    def __init__(self, coefficients: FloatArray) -> None:
        from scipy import fft  # noqa: PLC0415  (slow to load)

        self._fft = fft
        kernels, high, wide = coefficients.shape
        self.rows, self.columns = (high + 1) // 2, (wide + 1) // 2
        self.middle = coefficients[:, self.rows - 1, :]
        self.quarter = coefficients[0, self.rows - 1 :, self.columns - 1 :]
        self._high = fft.next_fast_len(high)
        self._wide = fft.next_fast_len(wide, real=True)
        periodic = np.zeros((kernels, self._high, self._wide))
        rows = np.arange(1 - self.rows, self.rows) % self._high
        columns = np.arange(1 - self.columns, self.columns) % self._wide
        periodic[:, rows[:, None], columns] = coefficients
        self._transforms = fft.rfft2(periodic)

    def __call__(self, field: FloatArray) -> FloatArray:
        """Return the convolution of a field, shape (rows, columns), with the first kernel."""
        return self._back(self._transforms[0] * self._forward(field))

    def each(self, field: FloatArray) -> FloatArray:
        """Return the convolutions of a field with all kernels, shape (kernels, rows, columns)."""
        return self._back(np.asarray(self._transforms * self._forward(field)))

    def total(self, fields: FloatArray) -> FloatArray:
        """Return the sum of the convolutions of fields with one kernel each."""
        parts = self._transforms * self._forward(fields)
        return self._back(np.asarray(parts.sum(axis=0)))

    def of_vector(self, field: FloatArray) -> FloatArray:
        """Return the convolution of a vector field (2, rows, columns), kernels xx, yy and xy."""
        transform = self._forward(field)
        xx, yy, xy = self._transforms
        along, across = transform
        convolved = np.empty_like(transform)
        np.multiply(xx, along, out=convolved[0])
        np.multiply(yy, across, out=convolved[1])
        across *= xy
        along *= xy
        convolved[0] += across
        convolved[1] += along
        return self._back(convolved)

    def _forward(self, field: FloatArray) -> FloatArray:
        # the rows of the padding are not transformed
        along = self._fft.rfft(field, n=self._wide, axis=-1)
        return np.asarray(self._fft.fft(along, n=self._high, axis=-2))

    def _back(self, transform: FloatArray) -> FloatArray:
        across = self._fft.ifft(transform, axis=-2, overwrite_x=True)[..., : self.rows, :]
        return np.asarray(self._fft.irfft(across, n=self._wide, axis=-1)[..., : self.columns])


class Elements:
    """Rectangular elements on two half-spaces of one material each.

    Of quasi-identical bodies (K = 0), pressure causes no relative tangential displacement, and
    traction no normal one.

    Parameters
    ----------
    rows, columns : int
        Numbers of elements across (y) and along (x).
    dx, dy : float
        Sizes of an element [m].
    shear_modulus, poisson_ratio : float
        Constants of both bodies combined: 1/G = (1/G_1 + 1/G_2)/2,
        nu/G = (nu_1/G_1 + nu_2/G_2)/2.
    difference : float
        K = G/4 ((1 - 2 nu_1)/G_1 - (1 - 2 nu_2)/G_2), zero for quasi-identical bodies.
    creep_factor : float
        Kalker's reduction factor: tangential displacements by traction are divided by it.

    Attributes
    ----------
    normal : Convolution
        Approach of the surfaces by pressure [m/Pa].
    """

    def __init__(
        self,
        rows: int,
        columns: int,
        dx: float,
        dy: float,
        shear_modulus: float,
        poisson_ratio: float,
        difference: float = 0.0,
        creep_factor: float = 1.0,
    ) -> None:
        self.rows, self.columns, self.dx, self.dy = rows, columns, dx, dy
        self._scale, self._poisson_ratio = 1.0 / (np.pi * shear_modulus), poisson_ratio
        self._difference, self._creep_factor = self._scale * difference, creep_factor
        # for distances from 0 to one element more than there are columns
        self._integrals = self._scale * _integrals(columns + 1, rows, dx, dy)
        normal = (1.0 - poisson_ratio) * (self._integrals[0] + self._integrals[1])
        self.normal = Convolution(_mirrored(normal[None, :, :-1]))

    @cached_property
    def shift(self) -> Convolution:
        """Relative displacement by traction [m/Pa]."""
        return Convolution(self._displacements()[..., 1:-1])

    @cached_property
    def rolling(self) -> Convolution:
        """Slip by traction in steady rolling, per distance rolled [1/Pa].

        It is the decrease of the displacement along x over one element.
        """
        displacements = self._displacements()
        return Convolution((displacements[..., 1:-1] - displacements[..., 2:]) / self.dx)

    @cached_property
    def rolling_averaged(self) -> Convolution:
        """`rolling`, with the mean of the mixed kernel over the length of an element.

        Taken at the middle only, lateral tractions next to an edge oblique to rolling, which
        change from one element to the next, add a longitudinal slip that decreases slowly.
        """
        rows, columns = self._integrals.shape[1:]
        displacements = self._displacements(
            _mean_along(columns, rows, self.dx, self.dy) * self._scale
        )
        return Convolution((displacements[..., 1:-1] - displacements[..., 2:]) / self.dx)

    @cached_property
    def opening(self) -> Convolution:
        """Gap opened by traction [m/Pa]; applied by `Convolution.total`."""
        return Convolution(self._coupling()[..., 1:-1])

    @cached_property
    def pressed(self) -> Convolution:
        """Slip by pressure in steady rolling [1/Pa], over the same elements as `rolling`.

        It is applied by `Convolution.each`.
        """
        gap = self._coupling()
        return Convolution((gap[..., 2:] - gap[..., 1:-1]) / self.dx)

    @cached_property
    def pressed_in_middle(self) -> Convolution:
        """`pressed` in the middle of elements [1/Pa]."""
        gap = self._coupling()
        return Convolution((gap[..., 2:] - gap[..., :-2]) / (2.0 * self.dx))

    def _coupling(self) -> FloatArray:
        """Return the kernels x and y of the gap opened by traction [m/Pa].

        Those of the displacement by pressure have the opposite sign.
        """
        shape = self.columns + 1, self.rows, self.dx, self.dy
        kernels = _mirrored(self._difference * _odd_integrals(*shape))
        kernels[0, :, : self.columns] *= -1.0  # odd along
        kernels[1, : self.rows - 1] *= -1.0  # odd across
        return kernels

    def _displacements(self, mixed: FloatArray | None = None) -> FloatArray:
        """Return displacements by traction, kernels xx, yy and xy (Cerruti) [m/Pa]."""
        along, across, middle = self._integrals / self._creep_factor
        mixed = middle if mixed is None else mixed / self._creep_factor
        every = (1.0 - self._poisson_ratio) * (along + across)
        kernels = _mirrored(np.stack([every + self._poisson_ratio * along,
                                    every + self._poisson_ratio * across,
                                    self._poisson_ratio * mixed]))  # fmt: skip
        kernels[2, :, : self.columns] *= -1.0  # odd along and across
        kernels[2, : self.rows - 1] *= -1.0
        return kernels


def _mirrored(quarter: FloatArray) -> FloatArray:
    """Return coefficients for all distances from those for distances that are not negative."""
    half = np.concatenate([quarter[..., :0:-1], quarter], axis=-1)
    return np.concatenate([half[:, :0:-1], half], axis=-2)
