"""Tangential contact of half-spaces in rolling or in a shift: stick, slip and traction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearsim.plugins import ContactError
from wearsim.types import BoolArray, FloatArray, IntArray
from wearsim_halfspace.influence import Convolution, inner

MAX_ITERATIONS = 60  # of Newton's method
MOST_PRODUCTS = 80  # matrix-vector products in the solution of a linear system
REUSED_UP_TO = 8  # products of a solution up to which its preconditioner is used again
#: first rate r over its scale, ratio of a rate to the one before, and iterations with each rate
FIRST_RATE, SLOWER, PATIENCE = 0.3, 0.3, 15
TINY = 1e-300  # against division by zero
LOOSEST, TIGHTEST = 0.1, 1e-4  # relative residual of the linear systems


class TangentialSolution(NamedTuple):
    """Traction on body 1 [Pa] and slip, shape (2, rows, columns).

    The slip is also that of elements outside the contact; `sticks` is true in adhesion.
    """

    traction: FloatArray
    slip: FloatArray
    sticks: BoolArray


@dataclass(frozen=True, eq=False)
class Within:
    """Positions within elements, with which steady rolling is of second order in their length.

    Parameters
    ----------
    entry : ndarray, shape (2, rows, columns)
        Factors of the slip one and two elements ahead, whose sum is the slip of the first element
        of a row in adhesion; zero elsewhere. Particles touch for a part of this element only.
    exit : ndarray, shape (rows, columns)
        Slip of the elements that particles leave last, over that of the elements behind them.
        It does not hold for elements that slide, see `solve_rolling`.
    turn : ndarray, shape (rows, columns)
        Angle from the slip at the leading end of an element to that in its middle [rad].
    """

    entry: FloatArray
    exit: FloatArray
    turn: FloatArray

    def __call__(self, slip: FloatArray) -> FloatArray:
        """Return the slip that Coulomb's law opposes to the traction of each element."""
        rows, first, (near, far) = self._first
        slip[:, rows, first] -= near * slip[:, rows, first + 1] + far * slip[:, rows, first + 2]
        rows, last, ratio = self._last
        slip[:, rows, last] -= ratio * slip[:, rows, last - 1]
        cosine, sine = self._rotation
        rotated = cosine * slip
        rotated[0] -= sine * slip[1]
        rotated[1] += sine * slip[0]
        return np.asarray(rotated)

    @cached_property
    def _first(self) -> tuple[IntArray, IntArray, FloatArray]:
        rows, columns = np.nonzero(self.entry[0])
        return rows, columns, self.entry[:, rows, columns]

    @cached_property
    def _last(self) -> tuple[IntArray, IntArray, FloatArray]:
        rows, columns = np.nonzero(self.exit)
        return rows, columns, self.exit[rows, columns]

    @cached_property
    def _rotation(self) -> tuple[FloatArray, FloatArray]:
        return np.cos(self.turn), np.sin(self.turn)


def solve_tangential(
    kernel: Convolution,
    bound: FloatArray,
    rigid_slip: FloatArray,
    tolerance: float,
    start: FloatArray | None = None,
    within: Within | None = None,
) -> TangentialSolution:
    """Return traction and slip of half-spaces in steady rolling, or after a shift.

    With the traction p, the slip s = w + B p and the traction bound g, the law of Coulomb is
    p = projection of (p - r s) on the disc of radius g, for any r > 0. Newton's method for this
    equation (semi-smooth), with its iterates projected on the discs, determines the elements in
    adhesion as it converges; each linear system is solved by GMRES, with the blocks of the rows
    along rolling as preconditioner.

    Parameters
    ----------
    kernel : Convolution
        B: `Elements.rolling` or `Elements.shift`.
    bound : ndarray, shape (rows, columns)
        Friction coefficient times pressure, zero outside the contact [Pa].
    rigid_slip : ndarray, shape (2, rows, columns)
        w: rigid slip of body 1 on body 2 per distance rolled, or the shift [m].
    tolerance : float
        Greatest residual of the equation relative to the greatest bound.
    start : ndarray, shape (2, rows, columns), optional
        Initial guess of the traction [Pa]; by default that of full slip.
    within : Within, optional
        By default the slip is that at the leading ends of elements.

    Raises
    ------
    ContactError
        If Newton's method does not converge.

    References
    ----------
    .. [1] J.J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990),
       DOI 10.1007/978-94-015-7889-9.
    .. [2] P. Alart, A. Curnier, Comput. Methods Appl. Mech. Eng. 92 (1991),
       DOI 10.1016/0045-7825(91)90022-X.
    """
    of_row = kernel.middle[:2]  # influence within a row of both components
    self_influence = float(of_row[:, kernel.columns - 1].max())  # of an element on itself
    touches, greatest_bound = bound > 0.0, float(bound.max())
    if start is None:
        start = -rigid_slip / np.maximum(np.hypot(*rigid_slip), TINY) * bound
    opposed = _unchanged if within is None else within
    traction, preconditioner, products = _projected(start, bound), None, 0
    for iteration in range(MAX_ITERATIONS):
        # a smaller rate keeps tractions from changing their direction back and forth
        rate = FIRST_RATE * SLOWER ** (iteration // PATIENCE) / self_influence
        slip = rigid_slip + kernel.of_vector(traction)
        trial = traction - rate * opposed(slip.copy())
        size = np.maximum(np.hypot(*trial), TINY)
        sticks = (size <= bound) & touches
        unit, part = trial / size, np.where(sticks, 1.0, bound / size)
        residual = part * trial - traction
        error = float(np.abs(residual).max()) / greatest_bound
        if error <= tolerance:
            return TangentialSolution(traction, np.where(sticks, 0.0, slip), sticks)
        if preconditioner is None or products > REUSED_UP_TO or iteration % PATIENCE == 0:
            # the preconditioner neglects the coupling of components and of rows
            diagonal = np.where(sticks, 1.0, part * (1.0 - unit**2))
            preconditioner = _Rows(diagonal, rate * of_row)
        removed = np.where(sticks, 0.0, part)

        def product(
            vector: FloatArray,
            rate: float = rate,
            unit: FloatArray = unit,
            part: FloatArray = part,
            removed: FloatArray = removed,
        ) -> FloatArray:
            change = vector - rate * opposed(kernel.of_vector(vector))
            along = removed * (unit * change).sum(axis=0)
            return np.asarray(vector - part * change + unit * along)

        change, products = _gmres(
            product, preconditioner, residual, max(min(LOOSEST, error), TIGHTEST)
        )
        traction = _projected(traction + change, bound)
    raise ContactError(
        f"the tangential contact of half-spaces has not converged in {MAX_ITERATIONS} iterations"
        f" (last relative residual {error:.1e})"
    )


def solve_rolling(
    kernel: Convolution,
    bound: FloatArray,
    rigid_slip: FloatArray,
    tolerance: float,
    start: FloatArray | None,
    within: Within,
) -> TangentialSolution:
    """Return traction and slip of steady rolling, of second order in the length of elements.

    Particles usually slide before they leave the contact. `Within.exit` is therefore applied only
    to elements that adhere both without and with it.

    Parameters
    ----------
    kernel, bound, rigid_slip, tolerance, start
        See `solve_tangential`.
    within : Within

    Raises
    ------
    ContactError
        If Newton's method does not converge.
    """
    applied, exits = np.zeros_like(within.exit), within.exit
    while True:
        solution = solve_tangential(
            kernel, bound, rigid_slip, tolerance, start, replace(within, exit=applied)
        )
        exits = np.where(solution.sticks, exits, 0.0)
        if np.array_equal(exits, applied):
            return solution
        applied, start = exits, solution.traction


def _unchanged(slip: FloatArray) -> FloatArray:
    return slip


def _projected(traction: FloatArray, bound: FloatArray) -> FloatArray:
    """Return tractions with their sizes limited by the bound."""
    size = np.maximum(np.maximum(np.hypot(*traction), bound), TINY)
    return np.asarray(traction * (bound / size))


class _Rows:
    """Approximate inverse of a linear system: that of each row and component alone.

    Parameters
    ----------
    diagonal : ndarray, shape (2, rows, columns)
        D in the system ``I - D (I - r B)``.
    influence : ndarray, shape (2, 2 columns - 1)
        r B within a row, for all distances.
    """

    def __init__(self, diagonal: FloatArray, influence: FloatArray) -> None:
        from wearsim_halfspace import rows  # noqa: PLC0415  (loads numba)

        inside = np.any(diagonal, axis=0)
        self._touching = np.flatnonzero(inside.any(axis=1))
        inside, columns = inside[self._touching], diagonal.shape[2]
        self._ends = np.argmax(inside, axis=1), columns - 1 - np.argmax(inside[:, ::-1], axis=1)
        # single precision suffices for a preconditioner
        parts = diagonal[:, self._touching].astype(np.float32)
        size = int(np.ptp(self._ends, axis=0).max(initial=0)) + 1
        self._factors = np.empty((2, len(self._touching), size, size), dtype=np.float32)
        rows.factor(parts, influence.astype(np.float32), *self._ends, self._factors)
        self._solve = rows.solve

    def __call__(self, field: FloatArray) -> FloatArray:
        rows = field[:, self._touching].astype(np.float32)
        self._solve(self._factors, rows, *self._ends)
        solution = field.copy()
        solution[:, self._touching] = rows
        return solution


def _gmres(
    product: Callable[[FloatArray], FloatArray],
    preconditioner: _Rows,
    right: FloatArray,
    tolerance: float,
) -> tuple[FloatArray, int]:
    """Return an approximate solution of a linear system, and the number of products.

    Generalised minimal residuals with the preconditioner on the right; the tolerance is that of
    the residual relative to the right-hand side.
    """
    length = float(np.sqrt(inner(right, right)))
    basis = np.empty((MOST_PRODUCTS + 1, right.size))
    basis[0] = right.ravel() / length
    hessenberg = np.zeros((MOST_PRODUCTS + 1, MOST_PRODUCTS))
    # vector normal to the columns of the Hessenberg matrix; its length gives the residual
    normal = np.zeros(MOST_PRODUCTS + 1)
    normal[0], directions = 1.0, []
    for count in range(1, MOST_PRODUCTS + 1):
        directions.append(preconditioner(basis[count - 1].reshape(right.shape)))
        new, known = product(directions[-1]).ravel(), basis[:count]
        for _ in range(2):  # orthogonalised twice, against round-off
            # in one thread, see `inner`
            parts = np.einsum("ij,j->i", known, new)
            new -= np.einsum("i,ij->j", parts, known)
            hessenberg[:count, count - 1] += parts
        norm = float(np.sqrt(inner(new, new)))
        hessenberg[count, count - 1] = norm
        normal[count] = -float(normal[:count] @ hessenberg[:count, count - 1]) / max(norm, TINY)
        basis[count] = new / max(norm, TINY)
        if tolerance * float(np.linalg.norm(normal)) >= 1.0:
            break
    right_side = np.zeros(count + 1)
    right_side[0] = length
    weights = np.linalg.lstsq(hessenberg[: count + 1, :count], right_side, rcond=None)[0]
    return np.einsum("i,i...->...", weights, np.stack(directions)), count
