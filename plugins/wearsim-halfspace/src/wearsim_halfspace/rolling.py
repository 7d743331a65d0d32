"""Tangential contact of half-spaces in steady rolling: stick, slip and traction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.plugins import ContactError
from wearsim.types import BoolArray, FloatArray
from wearsim_halfspace.influence import Elements

MAX_ITERATIONS = 60  # of Newton's method
MOST_PRODUCTS = 180  # in the solution of a linear system
RESTART = 60
REUSED_UP_TO = 8  # products for which the preconditioner is kept
FIRST_RATE, SLOWER, PATIENCE = 0.3, 0.3, 15  # rate r, its ratio, and iterations between changes
LOOSEST, TIGHTEST = 0.1, 1e-4  # relative residual of the linear systems


class RollingSolution(NamedTuple):
    """Traction on body 1 [Pa] and slip per distance rolled, shape (2, rows, columns).

    The slip is also that of elements outside the contact; `sticks` is true in adhesion.
    """

    traction: FloatArray
    slip: FloatArray
    sticks: BoolArray


def solve_rolling(
    elements: Elements, bound: FloatArray, rigid_slip: FloatArray, tolerance: float
) -> RollingSolution:
    """Return traction and slip of half-spaces that roll steadily.

    With the traction p, the slip s = w + B p and the traction bound g, the law of Coulomb is
    p = projection of (p - r s) on the disc of radius g, for any r > 0. Newton's method for this
    equation (semi-smooth), with its iterates projected on the discs, determines the elements in
    adhesion as it converges; each linear system is solved by GMRES, with the blocks of the rows
    along rolling as preconditioner.

    Parameters
    ----------
    elements : Elements
    bound : ndarray, shape (rows, columns)
        Friction coefficient times pressure, zero outside the contact [Pa].
    rigid_slip : ndarray, shape (2, rows, columns)
        Rigid slip of body 1 on body 2 per distance rolled.
    tolerance : float
        Greatest residual of the equation relative to the greatest bound.

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
    from scipy.sparse.linalg import LinearOperator, gmres  # noqa: PLC0415  (slow to load)

    places = np.flatnonzero(bound > 0.0)
    limit, rigid = bound.ravel()[places], rigid_slip.reshape(2, -1)[:, places]
    rolling, count = elements.rolling, len(places)
    own = float(rolling.middle[:2, elements.columns - 1].max())  # of an element on itself
    field, products = np.zeros((2, *bound.shape)), 0

    def slip_of(traction: FloatArray) -> FloatArray:
        field.reshape(2, -1)[:, places] = traction
        return rolling.of_vector(field).reshape(2, -1)[:, places]

    rows = _rows(elements, places)
    size = np.maximum(np.hypot(*rigid), 1e-300)
    traction, inverses = -limit * rigid / size, None
    for iteration in range(MAX_ITERATIONS):
        # a smaller rate keeps tractions from changing their direction back and forth
        rate = FIRST_RATE * SLOWER ** (iteration // PATIENCE) / own
        slip = rigid + slip_of(traction)
        trial = traction - rate * slip
        size = np.maximum(np.hypot(*trial), 1e-300)
        sticks = size <= limit
        residual = traction - np.where(sticks, trial, limit * trial / size)
        error = float(np.abs(residual).max()) / float(limit.max())
        if error <= tolerance:
            field.reshape(2, -1)[:, places] = traction
            everywhere = np.zeros(bound.shape, dtype=np.bool_)
            everywhere.ravel()[places] = sticks
            slip = np.where(everywhere, 0.0, rigid_slip + rolling.of_vector(field))
            return RollingSolution(field, slip, everywhere)
        unit, part = trial / size, np.where(sticks, 1.0, limit / size)

        def product(
            vector: FloatArray,
            rate: float = rate,
            sticks: BoolArray = sticks,
            unit: FloatArray = unit,
            part: FloatArray = part,
        ) -> FloatArray:
            nonlocal products
            products += 1
            given = vector.reshape(2, count)
            change = given - rate * slip_of(given)
            along = np.where(sticks, 0.0, (unit * change).sum(axis=0))
            return np.asarray((given - part * (change - unit * along)).ravel())

        if inverses is None or products > REUSED_UP_TO or iteration % PATIENCE == 0:
            # the components of a row are decoupled, and the rows are
            diagonals = np.where(sticks, 1.0, part * (1.0 - unit**2))
            inverses = [
                _inverses(diagonals[:, chosen], rate * along, rate * across)
                for chosen, along, across in rows
            ]

        def preconditioned(vector: FloatArray, inverses: list[FloatArray] = inverses) -> FloatArray:
            given, found = vector.reshape(2, count), np.empty((2, count))
            for (chosen, *_), inverse in zip(rows, inverses, strict=True):
                found[:, chosen] = (inverse @ given[:, chosen, None])[..., 0]
            return found.ravel()

        products, shape = 0, (2 * count, 2 * count)
        change, _ = gmres(
            LinearOperator(shape, product, dtype=np.float64),
            -residual.ravel(),
            rtol=max(min(LOOSEST, error), TIGHTEST),
            restart=RESTART,
            maxiter=MOST_PRODUCTS // RESTART,
            M=LinearOperator(shape, preconditioned, dtype=np.float64),
        )
        traction = traction + change.reshape(2, count)
        traction *= np.minimum(1.0, limit / np.maximum(np.hypot(*traction), 1e-300))
    raise ContactError(
        f"the tangential contact of half-spaces has not converged in {MAX_ITERATIONS} iterations"
        f" (last relative residual {error:.1e})"
    )


def _rows(elements: Elements, places: np.ndarray) -> list[tuple[np.ndarray, ...]]:
    """Return the elements of each row, and the influence within the row of both components."""
    row, column = np.divmod(places, elements.columns)
    starts = np.flatnonzero(np.diff(row, prepend=-1))
    found = []
    for chosen in np.split(np.arange(len(places)), starts[1:]):
        distance = column[chosen][:, None] - column[chosen] + elements.columns - 1
        found.append((chosen, *elements.rolling.middle[:2][:, distance]))
    return found


def _inverses(diagonals: FloatArray, along: FloatArray, across: FloatArray) -> FloatArray:
    """Return the inverses of the blocks ``I - D (I - r B)`` of a row, one per component."""
    identity, blocks = np.eye(diagonals.shape[1]), np.stack([along, across])
    return np.asarray(np.linalg.inv(identity - diagonals[..., None] * (identity - blocks)))
