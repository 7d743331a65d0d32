"""One contact on a grid of elements, started from and extrapolated with coarser grids."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearsim.types import FloatArray
from wearsim_halfspace.influence import Elements
from wearsim_halfspace.normal import NormalSolution, solve_normal
from wearsim_halfspace.tangential import TangentialSolution, solve_tangential

FEWEST = 16  # rows or columns of a grid that is started from a coarser one
LOOSE = 1e-4  # tolerance on coarser grids
#: of the difference of two grids, added in an extrapolation: that of the order 1.08
FURTHER = 0.9
AHEAD = 1.0 / 6.0  # of an element: where the rigid slip is taken, see `Problem.slip_ahead`


@dataclass(frozen=True, eq=False)
class Problem:
    """A contact on a grid of elements.

    Parameters
    ----------
    dx, dy : float
        Sizes of an element along (x) and across (y) [m].
    shear_modulus, poisson_ratio : float
        See `Elements`.
    gap : ndarray, shape (rows, columns)
        Gap before deformation [m].
    force : float
        Normal force [N].
    compliance : ndarray, shape (rows,)
        Gap opened by wear per line load of a row [m/(N/m)].
    friction : ndarray, shape (rows,)
        Friction coefficient.
    rigid_slip : ndarray, shape (2, rows, columns)
        Rigid slip of body 1 on body 2 per distance rolled, at the middle of the elements.
    spin : float
        [1/m].
    x, y : ndarray, shapes (columns,) and (rows,)
        Positions of the elements about the centre of the spin moment [m].
    """

    dx: float
    dy: float
    shear_modulus: float
    poisson_ratio: float
    gap: FloatArray
    force: float
    compliance: FloatArray
    friction: FloatArray
    rigid_slip: FloatArray
    spin: float
    x: FloatArray
    y: FloatArray

    @cached_property
    def elements(self) -> Elements:
        """Influence coefficients."""
        rows, columns = self.gap.shape
        return Elements(rows, columns, self.dx, self.dy, self.shear_modulus, self.poisson_ratio)

    @property
    def slip_ahead(self) -> FloatArray:
        """Rigid slip a sixth of an element ahead, where particles come from.

        CONTACT takes it there too. With a sixth, the error of the lateral force by spin is
        smallest; with a half, that of the spin moment would be.
        """
        slip = self.rigid_slip.copy()
        slip[1] += AHEAD * self.spin * self.dx
        return slip

    def coarser(self, across: bool) -> Problem:
        """Return the problem on elements of twice the length along, and also across if asked."""
        rows = (0,) if across else ()
        return Problem(
            2.0 * self.dx,
            2.0 * self.dy if across else self.dy,
            self.shear_modulus,
            self.poisson_ratio,
            halved(self.gap, (*rows, 1)),
            self.force,
            halved(self.compliance, rows),
            halved(self.friction, rows),
            halved(self.rigid_slip, (1, 2) if across else (2,)),
            self.spin,
            halved(self.x, (0,)),
            halved(self.y, rows),
        )


class Work(NamedTuple):
    """Power over rolling velocity [N], forces [N], moment [N m], power of each row [N/m].

    The power is the work of the rigid slip, to which the elastic energy contributes nothing.
    """

    power: float
    force_x: float
    force_y: float
    moment: float
    rows: FloatArray


class Solution(NamedTuple):
    """Solution on a grid, and that on a coarser one, if there is one."""

    problem: Problem
    normal: NormalSolution
    rolling: TangentialSolution
    coarser: Solution | None

    def work(self) -> Work:
        """Return forces and power on this grid."""
        problem, traction = self.problem, self.rolling.traction
        area = problem.dx * problem.dy
        power = -float(np.vdot(traction, problem.rigid_slip)) * area
        force_x, force_y = (float(part.sum()) * area for part in traction)
        moment = float((problem.x * traction[1] - problem.y[:, None] * traction[0]).sum()) * area
        rows = densities(self.rolling).sum(axis=1) * problem.dx
        return Work(power, force_x, force_y, moment, rows)

    def extrapolated(self) -> Work:
        """Return forces and power extrapolated from this grid and the coarser one.

        The rows are not: where single elements enter adhesion, they vary irregularly.
        """
        fine = self.work()
        if self.coarser is None:
            return fine
        coarse = self.coarser.work()
        return Work(
            power=_further(fine.power, coarse.power),
            force_x=_further(fine.force_x, coarse.force_x),
            force_y=_further(fine.force_y, coarse.force_y),
            moment=_further(fine.moment, coarse.moment),
            rows=fine.rows,
        )


def _further(fine: float, coarse: float) -> float:
    """Return a value extrapolated from two grids."""
    return fine + FURTHER * (fine - coarse)


def densities(rolling: TangentialSolution) -> FloatArray:
    """Return the power that each element dissipates per area and rolling velocity [Pa].

    While a particle moves over an element, its traction is the mean of those before and after.
    """
    before = np.zeros_like(rolling.traction)
    before[..., :-1] = rolling.traction[..., 1:]
    return np.asarray(-(0.5 * (rolling.traction + before) * rolling.slip).sum(axis=0))


def solve(
    problem: Problem, normal: NormalSolution, tolerance: float, *, below: bool = False
) -> Solution:
    """Return tractions and slip of a contact with known pressure.

    The grids are made coarser until they are small; the tractions of each are the initial guess on
    the next.

    Parameters
    ----------
    problem : Problem
    normal : NormalSolution
        Solution of its normal problem.
    tolerance : float
        Of the tractions, see `solve_tangential`.
    below : bool
        Whether this is a coarser grid itself.

    Raises
    ------
    ContactError
        If an iteration does not converge.
    """
    bound, finest = problem.friction[:, None] * normal.pressure, normal.pressure.shape
    if not bound.any() or not problem.rigid_slip.any():
        nothing = np.zeros_like(problem.rigid_slip)
        return Solution(
            problem, normal, TangentialSolution(nothing, nothing, normal.pressure > 0.0), None
        )
    coarser, start = None, None
    if min(finest) >= FEWEST:
        # the first coarser grid has the same rows, for the extrapolation
        coarse, loose = problem.coarser(across=below), max(LOOSE, tolerance)
        pressure = halved(normal.pressure, (0, 1) if below else (1,))
        found = solve_normal(
            coarse.elements, coarse.gap, coarse.force, pressure, loose, coarse.compliance
        )
        coarser = solve(coarse, found, loose, below=True)
        rows, columns = finest
        start = doubled(coarser.rolling.traction, 2, columns)
        start = doubled(start, 1, rows) if below else start
    rolling = solve_tangential(
        problem.elements.rolling, bound, problem.slip_ahead, tolerance, start
    )
    return Solution(problem, normal, rolling, coarser)


def halved(field: FloatArray, axes: tuple[int, ...]) -> FloatArray:
    """Return means over elements of twice the size along axes.

    An even number of elements is taken in pairs. With an odd number the larger elements have the
    same middle; they are centred on every second one, and contain half of its neighbours.
    """
    for axis in axes:
        fine = np.moveaxis(field, axis, 0)
        if len(fine) % 2:
            # continued along a straight line
            ends = 2.0 * fine[:1] - fine[1:2], 2.0 * fine[-1:] - fine[-2:-1]
            wider = np.concatenate([ends[0], fine, ends[1]])
            means = 0.25 * (wider[:-2:2] + wider[2::2]) + 0.5 * fine[::2]
        else:
            means = 0.5 * (fine[::2] + fine[1::2])
        field = np.moveaxis(means, 0, axis)
    return field


def doubled(field: FloatArray, axis: int, length: int) -> FloatArray:
    """Return a field interpolated linearly between means over elements of twice the size.

    The arrangement is that of `halved`; `length` is the number of elements along the axis.
    """
    means = np.moveaxis(field, axis, 0)
    found = np.empty((length, *means.shape[1:]))
    if length % 2:
        found[::2] = means
        found[1::2] = 0.5 * (means[:-1] + means[1:])
    else:
        found[::2] = 0.75 * means + 0.25 * np.concatenate([means[:1], means[:-1]])
        found[1::2] = 0.75 * means + 0.25 * np.concatenate([means[1:], means[-1:]])
    return np.moveaxis(found, 0, axis)
