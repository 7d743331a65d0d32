"""Normal contacts of the model `slender`, many at once: arrays that its kernels fill."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearsim.contact_batch import BatchSolution, rows_of
from wearsim.mechanics.numerics.jit import own_array
from wearsim.mechanics.slender.newton import CONVERGED, NOT_FINITE, solve_each
from wearsim.plugins import SharedWear
from wearsim.plugins.shared_wear import NO_BODY
from wearsim.types import ContactSolution, FloatArray, IntArray, Number

_NONE = np.zeros(0, dtype=np.int64)


def start_of(warm: Sequence[ContactSolution] | None) -> tuple[FloatArray, FloatArray] | None:
    """Return line loads and approaches of solutions nearby, if there are any."""
    if isinstance(warm, BatchSolution):
        return warm.stack("line_load"), warm.stack("approach")
    return None if warm is None else (rows_of(warm, "line_load"), rows_of(warm, "approach"))


class Medium(NamedTuple):
    """What all contacts share: as of `mechanics.slender.solve_slender`."""

    spacing: float
    contact_modulus: float
    longitudinal_curvature: float
    table: FloatArray
    bend: FloatArray


class NormalContacts(NamedTuple):
    """Sets of contacts; those of one set may wear bodies that they share.

    Parameters
    ----------
    gap : ndarray, shape (sets, contacts, strips)
        Gap [m].
    loads : ndarray, shape (sets, contacts)
        Loads [N].
    line_load, half_length : ndarray, shape (sets, contacts, strips)
        Filled: q [N/m], from what it holds as a start, and a [m].
    approach : ndarray, shape (sets, contacts)
        Filled: delta [m].
    status, iterations : ndarray of int, shape (sets,)
        Filled: whether Newton's method has converged, and when.
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
        """Return contacts that start from solutions nearby, or from nothing."""
        each = gap.shape[:-1]
        if start is None:
            line_load, approach = np.zeros(gap.shape), np.zeros(each)
        else:
            line_load = own_array(start[0]).reshape(gap.shape)
            approach = np.array(start[1], dtype=np.float64).reshape(each)
        own = own_array(gap), np.array(loads, dtype=np.float64).reshape(each)
        status, iterations = np.zeros(len(gap), np.int64), np.zeros(len(gap), np.int64)
        return cls(*own, line_load, approach, np.zeros(gap.shape), status, iterations)

    @property
    def strips(self) -> tuple[FloatArray, FloatArray]:
        """Line load and half-length."""
        return self.line_load, self.half_length

    @property
    def failed(self) -> IntArray:
        """Sets that have no solution, or a contact that reaches its first or last strip."""
        # counted, which takes a third of the time of any() on so few
        first, last = self.line_load[..., 0], self.line_load[..., -1]
        if not sum(map(np.count_nonzero, (self.status, first, last))):
            return _NONE
        ends = (first != 0.0) | (last != 0.0)
        return np.flatnonzero((self.status != CONVERGED) | ends.any(axis=1))

    def solve_apart(self, own: FloatArray, medium: Medium) -> None:
        """Solve sets whose contacts wear no body together, in place.

        Parameters
        ----------
        own : ndarray, shape (sets, contacts, strips)
            Gap that a contact opens for itself per unit of line load [m/(N/m)].
        medium : Medium
        """
        found = self.line_load, self.approach, self.half_length, self.status, self.iterations
        solve_each(self.gap, own_array(own), self.loads, *medium, *found)
        self._refuse_wrong_gaps()

    def solve(self, wear: SharedWear, medium: Medium) -> None:
        """Solve all of them in place; the axis of the sets is the first of the compliance."""
        for numbers, own, members, shared in wear.groups:
            if len(numbers) == len(self.gap):
                self._solve(own, members, shared, medium)
                continue
            part = NormalContacts._make(array[numbers] for array in self)
            part._solve(own, members, shared, medium)
            for whole, solved in zip(self, part, strict=True):
                whole[numbers] = solved

    def _solve(
        self, own: FloatArray, members: IntArray, shared: FloatArray, medium: Medium
    ) -> None:
        if (members == NO_BODY).all():
            self.solve_apart(own, medium)
            return
        from wearsim.mechanics.slender.coupled import solve_each_coupled  # noqa: PLC0415  (rarely needed)

        found = self.line_load, self.approach, self.half_length, self.status, self.iterations
        solve_each_coupled(self.gap, own, members, shared, self.loads, *medium, *found)
        self._refuse_wrong_gaps()

    def _refuse_wrong_gaps(self) -> None:
        """Mark sets with a gap that is not finite: the kernels leave such strips out."""
        sound = np.isfinite(self.gap)
        if np.count_nonzero(sound) < sound.size:
            self.status[~sound.all(axis=(1, 2))] = NOT_FINITE
