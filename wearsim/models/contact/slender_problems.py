"""Normal and tangential problems of the model `slender` as arrays for its kernels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearsim.contact_batch import BatchSolution, OperatingPoints, rows_of
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.numerics.jit import own_array
from wearsim.mechanics.slender.newton import CONVERGED, NOT_FINITE, solve_each
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import SUMS, strip_contacts
from wearsim.plugins import SharedWear
from wearsim.plugins.shared_wear import NO_BODY
from wearsim.types import ContactSolution, FloatArray, Grid, IntArray, Number, OperatingPoint

_NONE = np.zeros(0, dtype=np.int64)


def start_of(warm: Sequence[ContactSolution] | None) -> tuple[FloatArray, FloatArray] | None:
    """Return line loads and approaches of an initial guess, if there is one."""
    if isinstance(warm, BatchSolution):
        return warm.stack("line_load"), warm.stack("approach")
    return None if warm is None else (rows_of(warm, "line_load"), rows_of(warm, "approach"))


class Constants(NamedTuple):
    """Constants of all contacts; see `mechanics.slender.newton.solve_slender`."""

    spacing: float
    contact_modulus: float
    longitudinal_curvature: float
    table: FloatArray
    bend: FloatArray


class NormalContacts(NamedTuple):
    """Normal problems of sets of contacts; the contacts of a set may wear common bodies.

    Parameters
    ----------
    gap : ndarray, shape (sets, contacts, strips)
        Gap [m].
    loads : ndarray, shape (sets, contacts)
        Loads [N].
    line_load, half_length : ndarray, shape (sets, contacts, strips)
        Output: q [N/m], whose values on entry are the initial guess, and a [m].
    approach : ndarray, shape (sets, contacts)
        Output: approach [m], whose values on entry are the initial guess.
    status, iterations : ndarray of int, shape (sets,)
        Output: status and number of iterations of Newton's method.
    """

    gap: FloatArray
    loads: FloatArray
    line_load: FloatArray
    approach: FloatArray
    half_length: FloatArray
    status: IntArray
    iterations: IntArray

    @classmethod
    def starting(
        cls, gap: FloatArray, loads: Number, start: tuple[FloatArray, Number] | None
    ) -> NormalContacts:
        """Return contacts with an initial guess of line loads and approaches, by default zero."""
        shape = gap.shape[:-1]
        if start is None:
            line_load, approach = np.zeros(gap.shape), np.zeros(shape)
        else:
            line_load = own_array(start[0]).reshape(gap.shape)
            approach = np.array(start[1], dtype=np.float64).reshape(shape)
        own = own_array(gap), np.array(loads, dtype=np.float64).reshape(shape)
        status, iterations = np.zeros((2, len(gap)), np.int64)
        return cls(*own, line_load, approach, np.zeros(gap.shape), status, iterations)

    @property
    def failed(self) -> IntArray:
        """Sets without a solution, or with a contact that reaches its first or last strip."""
        # counted, since any() takes three times as long on short arrays
        first, last = self.line_load[..., 0], self.line_load[..., -1]
        if not sum(map(np.count_nonzero, (self.status, first, last))):
            return _NONE
        ends = (first != 0.0) | (last != 0.0)
        return np.flatnonzero((self.status != CONVERGED) | ends.any(axis=1))

    def solve_independent(self, own: FloatArray, constants: Constants) -> None:
        """Solve contacts that wear no common body, in place.

        Parameters
        ----------
        own : ndarray, shape (sets, contacts, strips)
            Increase of each contact's gap by its wear per unit of line load [m/(N/m)].
        constants : Constants
        """
        solve_each(self.gap, own_array(own), self.loads, *constants, *self._outputs)
        self._refuse_infinite_gaps()

    def solve(self, wear: SharedWear, constants: Constants) -> None:
        """Solve all sets in place; the sets are the leading axis of the wear compliance."""
        for numbers, own, members, shared in wear.groups:
            part = self
            if len(numbers) < len(self.gap):
                part = NormalContacts._make(array[numbers] for array in self)
            if (members == NO_BODY).all():
                part.solve_independent(own, constants)
            else:
                part._solve_coupled(own, members, shared, constants)
            if part is not self:
                for array, solved in zip(self, part, strict=True):
                    array[numbers] = solved

    def _solve_coupled(
        self, own: FloatArray, members: IntArray, shared: FloatArray, constants: Constants
    ) -> None:
        from wearsim.mechanics.slender.coupled import solve_each_coupled  # noqa: PLC0415  (rarely needed)

        arrays = (self.gap, own, members, shared, self.loads)
        solve_each_coupled(*arrays, *constants, *self._outputs)
        self._refuse_infinite_gaps()

    @property
    def _outputs(self) -> tuple[FloatArray, FloatArray, FloatArray, IntArray, IntArray]:
        return self.line_load, self.approach, self.half_length, self.status, self.iterations

    def _refuse_infinite_gaps(self) -> None:
        """Mark sets with a gap that is not finite, since the kernels skip such strips."""
        finite = np.isfinite(self.gap)
        if np.count_nonzero(finite) < finite.size:
            self.status[~finite.all(axis=(1, 2))] = NOT_FINITE


class TangentialInputs(NamedTuple):
    """Creepages and friction of contacts, in the order of the arguments of `strip_contacts`.

    Parameters
    ----------
    rolling_speed : float
        V [m/s].
    longitudinal, lateral, spin : ndarray, shape (contacts,)
        Mean longitudinal creepage, lateral creepage and spin [1/m].
    variation, friction : ndarray, shape (contacts, strips)
        Variation of the longitudinal creepage; friction coefficient.
    """

    rolling_speed: float
    longitudinal: FloatArray
    lateral: FloatArray
    spin: FloatArray
    variation: FloatArray
    friction: FloatArray

    @classmethod
    def of(cls, points: OperatingPoints, grid: Grid) -> TangentialInputs:
        """Return the inputs of operating points with at most one friction value per strip."""
        friction, variation = points.friction, points.variation
        per_strip = np.empty((len(friction), grid.strips))
        per_strip[:] = friction if friction.ndim > 1 else friction[:, None]
        return cls(
            points.rolling_speed,
            own_array(points.longitudinal),
            own_array(points.lateral),
            own_array(points.spin),
            -points.spin[:, None] * grid.y if variation is None else own_array(variation),
            per_strip,
        )

    @classmethod
    def of_one(cls, point: OperatingPoint, grid: Grid) -> TangentialInputs:
        """Return the inputs of one operating point; faster than `of`."""
        creepage, variation = point.creepage, point.creepage.variation
        friction = np.empty((1, grid.strips))
        friction[:] = point.friction
        return cls(
            point.rolling_speed,
            np.array([creepage.longitudinal], dtype=np.float64),
            np.array([creepage.lateral], dtype=np.float64),
            np.array([creepage.spin], dtype=np.float64),
            (-creepage.spin * grid.y if variation is None else own_array(variation))[None],
            friction,
        )


def strip_tractions(
    normal: NormalContacts, inputs: TangentialInputs, grid: Grid, pair: ElasticPair
) -> tuple[FloatArray, FloatArray]:
    """Return dissipation, (contacts, strips) [W/m], and `SUMS`, (6, contacts), by strip theory.

    Parameters
    ----------
    normal : NormalContacts
        Solved normal problems, of as many contacts as the inputs.
    inputs : TangentialInputs
    grid : Grid
    pair : ElasticPair
    """
    shape = inputs.friction.shape
    dissipation, sums = np.empty(shape), np.empty((len(SUMS), shape[0]))
    strip_contacts(
        normal.line_load.reshape(shape),
        normal.half_length.reshape(shape),
        grid.y,
        grid.spacing,
        strip_elasticity(pair.contact_modulus, pair.shear_modulus),
        *inputs,
        dissipation,
        sums,
    )
    return dissipation, sums


def first_not_finite(sums: FloatArray) -> int | None:
    """Return the first contact whose sums, (sums, contacts), are not all finite, or None."""
    finite = np.isfinite(sums)
    if np.count_nonzero(finite) == sums.size:
        return None
    return int(np.argmin(finite.all(axis=0)))
