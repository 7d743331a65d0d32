"""Normal and tangential problems of the model `slender` as arrays for its kernels."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.numerics.jit import own_array
from wearsim.mechanics.slender.newton import CONVERGED, NOT_FINITE, solve_slender
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import SUMS, strip_contacts
from wearsim.plugins import SharedWear
from wearsim.plugins.shared_wear import NO_BODY
from wearsim.types import FloatArray, Grid, IntArray

_NONE = np.zeros(0, dtype=np.int64)


Constants: TypeAlias = tuple[float, float, FloatArray, FloatArray]
"""Strip width [m], E* [Pa] and the two tables of `mechanics.slender.newton.solve_slender`."""


class NormalContacts(NamedTuple):
    """Normal problems of sets of contacts; the contacts of a set may wear common bodies.

    Parameters
    ----------
    gap : ndarray, shape (sets, contacts, strips)
        Gap [m].
    longitudinal_curvature, loads : ndarray, shape (sets, contacts)
        Relative curvature along rolling [1/m] and loads [N].
    line_load, half_length : ndarray, shape (sets, contacts, strips)
        Output: q [N/m], whose values on entry are the initial guess, and a [m].
    approach : ndarray, shape (sets, contacts)
        Output: approach [m], whose values on entry are the initial guess.
    status, iterations : ndarray of int, shape (sets,)
        Output: status and number of iterations of Newton's method.
    """

    gap: FloatArray
    longitudinal_curvature: FloatArray
    loads: FloatArray
    line_load: FloatArray
    approach: FloatArray
    half_length: FloatArray
    status: IntArray
    iterations: IntArray

    @classmethod
    def starting(
        cls, batch: ContactBatch, size: int, start: ContactBatchSolution | None
    ) -> NormalContacts:
        """Return the normal problems of sets of `size` contacts, with an initial guess if any."""
        shape = len(batch) // size, size
        wide = *shape, batch.gap.shape[1]
        if start is None:
            line_load, approach = np.zeros(wide), np.zeros(shape)
        else:
            line_load = own_array(start.line_load).reshape(wide)
            approach = own_array(start.approach).reshape(shape)
        status, iterations = np.zeros((2, shape[0]), np.int64)
        return cls(
            own_array(batch.gap).reshape(wide),
            own_array(batch.longitudinal_curvature).reshape(shape),
            own_array(batch.normal_force).reshape(shape),
            line_load,
            approach,
            np.zeros(wide),
            status,
            iterations,
        )

    @property
    def failed(self) -> IntArray:
        """Sets without a solution, or with a contact that reaches its first or last strip."""
        # counted, since any() takes three times as long on short arrays
        first, last = self.line_load[..., 0], self.line_load[..., -1]
        if not sum(map(np.count_nonzero, (self.status, first, last))):
            return _NONE
        ends = (first != 0.0) | (last != 0.0)
        return np.flatnonzero((self.status != CONVERGED) | ends.any(axis=1))

    def solve(self, wear: SharedWear | FloatArray | None, constants: Constants) -> None:
        """Solve all sets in place.

        Parameters
        ----------
        wear : SharedWear or ndarray, shape (sets, strips), optional
            Wear compliance, with the sets as leading axis; an array where each set is one contact.
        constants : Constants
        """
        if not isinstance(wear, SharedWear):
            own = np.zeros(self.gap.shape) if wear is None else own_array(wear)
            self._solve(own.reshape(self.gap.shape), None, None, constants)
            return
        for numbers, own, members, shared in wear.groups:
            part = self
            if len(numbers) < len(self.gap):
                part = NormalContacts._make(array[numbers] for array in self)
            if (members == NO_BODY).all():
                part._solve(own, None, None, constants)
            else:
                part._solve(own, members, shared, constants)
            if part is not self:
                for array, solved in zip(self, part, strict=True):
                    array[numbers] = solved

    def _solve(
        self,
        own: FloatArray,
        members: IntArray | None,
        shared: FloatArray | None,
        constants: Constants,
    ) -> None:
        """Solve sets in place; `members` and `shared` are those of `SharedWear.groups`."""
        solve_slender(
            self.gap,
            own,
            members,
            shared,
            self.loads,
            self.longitudinal_curvature,
            *constants,
            self.line_load,
            self.approach,
            self.half_length,
            self.status,
            self.iterations,
        )
        # the kernels skip strips with a gap that is not finite
        finite = np.isfinite(self.gap)
        if np.count_nonzero(finite) < finite.size:
            self.status[~finite.all(axis=(1, 2))] = NOT_FINITE


def strip_tractions(
    line_load: FloatArray,
    half_length: FloatArray,
    batch: ContactBatch,
    grid: Grid,
    pair: ElasticPair,
) -> tuple[FloatArray, FloatArray]:
    """Return dissipation, (contacts, strips) [W/m], and `SUMS`, (6, contacts), by strip theory.

    Parameters
    ----------
    line_load, half_length : ndarray, shape (contacts, strips)
        Solution of the normal problems [N/m], [m].
    batch : ContactBatch
        The contacts, with at most one friction value per strip.
    grid : Grid
    pair : ElasticPair
    """
    friction, variation = np.empty(line_load.shape), batch.variation
    friction[:] = batch.friction if batch.friction.ndim > 1 else batch.friction[:, None]
    dissipation, sums = np.empty(line_load.shape), np.empty((len(SUMS), len(line_load)))
    strip_contacts(
        line_load,
        half_length,
        grid.y,
        grid.spacing,
        strip_elasticity(pair.contact_modulus, pair.shear_modulus),
        own_array(batch.rolling_speed),
        own_array(batch.longitudinal),
        own_array(batch.lateral),
        own_array(batch.spin),
        -batch.spin[:, None] * grid.y if variation is None else own_array(variation),
        friction,
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
