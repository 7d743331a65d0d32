"""One contact on a grid of elements, started from and extrapolated with coarser grids."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearsim.types import Creepage, FloatArray, IntArray
from wearsim_halfspace.influence import Elements, inner
from wearsim_halfspace.normal import NormalSolution, solve_normal
from wearsim_halfspace.tangential import (
    TangentialSolution,
    Within,
    solve_rolling,
    solve_tangential,
)

FEWEST = 16  # rows or columns of a grid that is started from a coarser one
LOOSE = 1e-4  # tolerance on coarser grids
#: Part of the difference of two grids that is added in an extrapolation, by the order of elements;
#: the observed orders of convergence are 1.08 and 2.
FURTHER = {1: 0.9, 2: 1.0 / 3.0}
#: Distance ahead of the middle at which the rigid slip is taken, in elements, by their order.
AHEAD = {1: 1.0 / 6.0, 2: 0.5}


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
        Gap before deformation by pressure [m].
    force : float
        Normal force [N].
    compliance : ndarray, shape (rows,)
        Gap opened by wear per line load of a row [m/(N/m)].
    friction : ndarray, shape (rows, columns)
        Friction coefficient.
    rigid_slip : ndarray, shape (2, rows, columns)
        Rigid slip of body 1 on body 2 per distance rolled, at the middle of the elements.
    spin : float
        Spin [1/m].
    x, y : ndarray, shapes (columns,) and (rows,)
        Positions of the elements about the centre of the spin moment [m].
    order : int
        Order of the elements along rolling: 1 as in CONTACT, or 2 by positions within elements.
    difference : float
        K of different bodies, see `Elements`. The opening of the gap by traction is part of `gap`.
    creep_factor : float
        See `Elements`.
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
    order: int = 2
    difference: float = 0.0
    creep_factor: float = 1.0

    @cached_property
    def elements(self) -> Elements:
        """Influence coefficients."""
        rows, columns = self.gap.shape
        constants = self.shear_modulus, self.poisson_ratio, self.difference, self.creep_factor
        return Elements(rows, columns, self.dx, self.dy, *constants)

    @property
    def slip_ahead(self) -> FloatArray:
        """Rigid slip a part of an element ahead, where particles come from.

        The slip is that on the way from one element to the next, and its place half an element
        ahead. CONTACT takes a sixth; with elements of the first order, the error of the lateral
        force by spin is smallest there.
        """
        slip = self.rigid_slip.copy()
        slip[1] += AHEAD[self.order] * self.spin * self.dx
        return slip

    def coarser(self, across: bool) -> Problem:
        """Return the problem on elements of twice the length, and width if `across`."""
        rows = (0,) if across else ()
        return Problem(
            2.0 * self.dx,
            2.0 * self.dy if across else self.dy,
            self.shear_modulus,
            self.poisson_ratio,
            halved(self.gap, (*rows, 1)),
            self.force,
            halved(self.compliance, rows),
            halved(self.friction, (*rows, 1)),
            halved(self.rigid_slip, (1, 2) if across else (2,)),
            self.spin,
            halved(self.x, (0,)),
            halved(self.y, rows),
            self.order,
            self.difference,
            self.creep_factor,
        )


def with_slip(
    problem: Problem, creepage: Creepage, y: FloatArray, load: FloatArray, strips: slice
) -> Problem:
    """Return a problem with its rigid slip; spin is about the centre of the line load."""
    varies = -creepage.spin * y if creepage.variation is None else creepage.variation
    along = creepage.longitudinal + varies - float(load @ varies) / float(load.sum())
    rigid = np.empty_like(problem.rigid_slip)
    rigid[0] = along[strips, None]
    rigid[1] = creepage.lateral + creepage.spin * problem.x
    centre = float(load @ y) / float(load.sum())
    return replace(problem, rigid_slip=rigid, y=y[strips] - centre)


class Work(NamedTuple):
    """Power over rolling velocity [N], forces [N], moment [N m], power of each row [N/m].

    The power is the work of the tractions on the rigid slip and on the slip by pressure. Elastic
    slip by traction contributes nothing.
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
        slip = problem.rigid_slip
        if problem.difference:
            slip = slip + problem.elements.pressed_in_middle.each(self.normal.pressure)
        power = -inner(traction, slip) * area
        force_x, force_y = (float(part.sum()) * area for part in traction)
        moment = float((problem.x * traction[1] - problem.y[:, None] * traction[0]).sum()) * area
        rows = densities(self.rolling).sum(axis=1) * problem.dx
        return Work(power, force_x, force_y, moment, rows)

    def extrapolated(self) -> Work:
        """Return forces and power extrapolated from this grid and the coarser one.

        The powers of the rows are not extrapolated, since they vary irregularly where single
        elements enter adhesion.
        """
        fine = self.work()
        if self.coarser is None:
            return fine
        coarse, factor = self.coarser.work(), FURTHER[self.problem.order]
        return Work(
            power=fine.power + factor * (fine.power - coarse.power),
            force_x=fine.force_x + factor * (fine.force_x - coarse.force_x),
            force_y=fine.force_y + factor * (fine.force_y - coarse.force_y),
            moment=fine.moment + factor * (fine.moment - coarse.moment),
            rows=fine.rows,
        )


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
        Tolerance of the tractions, see `solve_tangential`.
    below : bool
        Whether this is a coarser grid itself.

    Raises
    ------
    ContactError
        If an iteration does not converge.
    """
    bound, finest = problem.friction * normal.pressure, normal.pressure.shape
    slip = problem.slip_ahead
    if problem.difference:
        slip += problem.elements.pressed.each(normal.pressure)
    if not bound.any() or not slip.any():
        nothing = np.zeros_like(problem.rigid_slip)
        return Solution(
            problem, normal, TangentialSolution(nothing, nothing, normal.pressure > 0.0), None
        )
    coarser, start, turn = None, None, np.zeros_like(bound)
    if min(finest) >= FEWEST:
        # the first coarser grid has the same rows, for the extrapolation
        coarse, loose = problem.coarser(across=below), max(LOOSE, tolerance)
        pressure = halved(normal.pressure, (0, 1) if below else (1,))
        coarse_normal = solve_normal(
            coarse.elements, coarse.gap, coarse.force, pressure, loose, coarse.compliance
        )
        coarser = solve(coarse, coarse_normal, loose, below=True)
        rows, columns = finest
        start = doubled(coarser.rolling.traction, 2, columns)
        turn = doubled(_turn(coarser.rolling, coarse_normal.pressure), 1, columns)
        if below:
            start, turn = doubled(start, 1, rows), doubled(turn, 0, rows)
    arguments = bound, slip, tolerance, start
    if problem.order == 2:
        within = Within(*edges(normal), turn)
        rolling = solve_rolling(problem.elements.rolling_averaged, *arguments, within)
    else:
        rolling = solve_tangential(problem.elements.rolling, *arguments)
    return Solution(problem, normal, rolling, coarser)


def edges(normal: NormalSolution) -> tuple[FloatArray, FloatArray]:
    """Return `Within.entry` and `Within.exit`, shapes (2, rows, columns) and (rows, columns).

    Particles that adhere touch for a part of the first element only. Next to this edge tractions
    are a smooth function times the pressure, and slip ahead of it is a smooth function times the
    increase of the separation from one element to the next. The ratio of the two is continued
    linearly from the two elements ahead to the first one.

    Where particles leave in adhesion, the traction is singular. If the slip of a whole row of
    elements is zero, the computed contact ends 0.326 elements behind the middle of the last one.
    For other places of the edge the last element needs a slip. Its ratio to that of the element
    behind is a function of the place, computed for line contacts on many elements, and the place
    follows from the increase of the separation behind the last element, over that behind the next
    one. The polynomial below is this function, within 0.01.
    """
    touches = normal.pressure > 0.0
    columns = touches.shape[1]
    rows = np.flatnonzero(touches.sum(axis=1) > 1)
    first = columns - 1 - np.argmax(touches[rows, ::-1], axis=1)
    last = np.argmax(touches[rows], axis=1)
    ahead, behind = np.zeros((2, *touches.shape)), np.zeros(touches.shape)
    near, far = _increases(normal.separation, rows, first, 1)
    # where the grid ends, the ratio of the nearest element alone is used
    ahead[:, rows, first] = np.where(far > 0.0, 2.0 * near, near), -far
    near, _ = _increases(normal.separation, rows, last, -1)
    root = np.sqrt(np.maximum(0.63 - near, 0.0067))
    behind[rows, last] = np.where(last > 1, 0.777 - 1.667 * root + 0.187 * root**2, 0.0)
    return ahead, behind


def _increases(
    separation: FloatArray, rows: IntArray, ends: IntArray, step: int
) -> tuple[FloatArray, FloatArray]:
    """Return ratios of the increases of the separation outside the ends of rows.

    It is the increase of the separation to the first element outside, over that to the second one
    and over that to the third one, and zero where the grid ends before these.
    """
    places = np.clip(ends[:, None] + step * np.arange(4), 0, separation.shape[1] - 1)
    increases = np.maximum(np.diff(separation[rows[:, None], places], axis=1), 0.0)
    nearest, farther = increases[:, :1], increases[:, 1:]
    ratio = np.divide(nearest, farther, out=np.zeros_like(farther), where=farther > nearest)
    return ratio[:, 0], ratio[:, 1]


def _turn(rolling: TangentialSolution, pressure: FloatArray) -> FloatArray:
    """Return `Within.turn` for elements of half the length.

    It is a quarter of the change of the slip's direction from one element to the next.
    """
    slides = (pressure > 0.0) & ~rolling.sticks
    ahead, behind = rolling.slip[..., 1:], rolling.slip[..., :-1]
    sine = ahead[0] * behind[1] - ahead[1] * behind[0]
    cosine = (ahead * behind).sum(axis=0)
    smooth = slides[:, 1:] & slides[:, :-1] & (cosine > 0.0)
    turn = np.zeros_like(pressure)
    turn[:, 1:] = np.where(smooth, 0.25 * np.arctan2(sine, cosine), 0.0)
    return turn


def halved(field: FloatArray, axes: tuple[int, ...]) -> FloatArray:
    """Return means over elements of twice the size along axes.

    An even number of elements is taken in pairs. With an odd number the larger elements have the
    same middle; they are centred on every second one, and contain half of its neighbours.
    """
    for axis in axes:
        fine = np.moveaxis(field, axis, 0)
        if len(fine) % 2:
            # extrapolated linearly beyond both ends
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
    fine = np.empty((length, *means.shape[1:]))
    if length % 2:
        fine[::2] = means
        fine[1::2] = 0.5 * (means[:-1] + means[1:])
    else:
        fine[::2] = 0.75 * means + 0.25 * np.concatenate([means[:1], means[:-1]])
        fine[1::2] = 0.75 * means + 0.25 * np.concatenate([means[1:], means[-1:]])
    return np.moveaxis(fine, 0, axis)
