"""Normal problems of slender contacts, coupled where contacts wear common bodies."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np

from wearsim.contact_batch import NO_BODY, ContactBatch, ContactBatchSolution
from wearsim.mechanics.numerics.jit import kernel_input, kernel_inputs
from wearsim.mechanics.slender import newton as kernels
from wearsim.plugins import SharedWear
from wearsim.types import FloatArray, IntArray

#: Strip width [m], E* [Pa] and the two tables of `mechanics.slender.newton.solve_slender`.
Constants: TypeAlias = tuple[float, float, FloatArray, FloatArray]


@lru_cache(maxsize=64)
def _coupled_contacts(members: bytes, contacts: int) -> list[tuple[IntArray, IntArray | None]]:
    """Return the systems of contacts that shared bodies couple, equal systems in one array.

    Parameters
    ----------
    members : bytes
        The shared bodies of each contact, as in `SharedWear.groups`.
    contacts : int
        Number of contacts.

    Returns
    -------
    list of (numbers, bodies)
        Numbers of the contacts, shape (systems, contacts of each), and the shared bodies of the
        contacts of one system, counted from 0; None for a contact that shares none.
    """
    bodies, label = np.frombuffer(members, np.int64).reshape(contacts, 2), np.arange(contacts)
    touching = [(bodies == body).any(axis=1) for body in range(bodies.max() + 1)]
    for _ in touching:  # a chain of bodies is joined after as many rounds as it has bodies
        before = label.copy()
        for contact in touching:
            label[contact] = label[contact].min()
        if np.array_equal(before, label):
            break
    systems: dict[tuple[int, bytes], tuple[list[IntArray], IntArray | None]] = {}
    for number in np.unique(label):
        coupled = np.flatnonzero(label == number)
        part = bodies[coupled]
        shared = part != NO_BODY
        part[shared] = np.unique(part[shared], return_inverse=True)[1]
        shared_bodies = part if shared.any() else None
        systems.setdefault((len(coupled), part.tobytes()), ([], shared_bodies))[0].append(coupled)
    return [(np.stack(numbers), shared_bodies) for numbers, shared_bodies in systems.values()]


class NormalContacts(NamedTuple):
    """Normal problems of sets of contacts; the contacts of a set may wear common bodies.

    Parameters
    ----------
    gap : ndarray, shape (sets, contacts, strips)
        Gap [m].
    longitudinal_curvature, loads : ndarray, shape (sets, contacts)
        Relative curvature along rolling [1/m] and loads [N].
    line_load, half_length, separation : ndarray, shape (sets, contacts, strips)
        Output: q [N/m], whose values on entry are the initial guess, a [m], and the distance
        between the surfaces in strips without load [m].
    approach : ndarray, shape (sets, contacts)
        Output: approach [m], whose values on entry are the initial guess.
    status, iterations : ndarray of int, shape (sets, contacts)
        Output: status and number of iterations of Newton's method.
    """

    gap: FloatArray
    longitudinal_curvature: FloatArray
    loads: FloatArray
    line_load: FloatArray
    approach: FloatArray
    half_length: FloatArray
    separation: FloatArray
    status: IntArray
    iterations: IntArray

    @classmethod
    def starting(
        cls, batch: ContactBatch, size: int, start: ContactBatchSolution | None
    ) -> NormalContacts:
        """Return the normal problems of sets of `size` contacts, with an initial guess if any."""
        shape = batch.gap.shape[0] // size, size
        wide = *shape, batch.gap.shape[1]
        line_load, half_length, separation = np.zeros((3, *wide))
        approach = np.zeros(shape)
        if start is not None:
            line_load[:] = start.line_load.reshape(wide)
            approach[:] = start.approach.reshape(shape)
        status, iterations = np.zeros((2, *shape), np.int64)
        return cls(
            batch.gap.reshape(wide),
            batch.longitudinal_curvature.reshape(shape),
            batch.normal_force.reshape(shape),
            line_load,
            approach,
            half_length,
            separation,
            status,
            iterations,
        )

    @property
    def failed(self) -> IntArray:
        """Sets without a solution, or with a contact that reaches its first or last strip."""
        first, last = self.line_load[..., 0], self.line_load[..., -1]
        ends = (first != 0.0) | (last != 0.0)
        return np.flatnonzero(((self.status != kernels.CONVERGED) | ends).any(axis=1))

    def solve(self, wear: SharedWear | FloatArray | None, constants: Constants) -> int:
        """Solve all sets in place, and return the number of contacts that fail, see `failed`.

        Contacts that wear no common body are solved separately.

        Parameters
        ----------
        wear : SharedWear or ndarray, shape (sets, strips), optional
            Wear compliance, with the sets as leading axis; an array where each set is one contact.
        constants : Constants
        """
        if not isinstance(wear, SharedWear):
            compliance = np.zeros(self.gap.shape) if wear is None else wear
            return self._solve(compliance.reshape(self.gap.shape), None, None, constants)
        failed, (sets, contacts) = 0, self.gap.shape[:2]
        for numbers, compliance, members, shared in wear.groups:
            for coupled, bodies in _coupled_contacts(members.tobytes(), contacts):
                chosen, size = coupled.ravel(), coupled.shape[1]
                every = size == contacts or np.array_equal(chosen, np.arange(contacts))
                whole = len(numbers) == sets and every
                places = numbers[:, None], chosen
                taken = self if whole else NormalContacts._make(array[places] for array in self)
                systems = taken
                if size < contacts:
                    systems = NormalContacts._make(a.reshape(-1, size, *a.shape[2:]) for a in taken)
                softness = compliance if whole else compliance[:, chosen]
                worn = None
                if bodies is not None:
                    worn = (shared if whole else shared[:, chosen]).reshape(
                        -1, size, *shared.shape[2:]
                    )
                failed += systems._solve(
                    softness.reshape(systems.gap.shape), bodies, worn, constants
                )
                for array, solved in () if whole else zip(self[3:], taken[3:], strict=True):
                    array[places] = solved
        return failed

    def _solve(
        self,
        compliance: FloatArray,
        members: IntArray | None,
        shared: FloatArray | None,
        constants: Constants,
    ) -> int:
        """Solve sets in place, as `solve`; `members` and `shared` are those of `SharedWear.groups`.

        Contacts chosen from sets have arrays of another layout, for which numba would compile.
        """
        status, iterations = np.zeros((2, self.gap.shape[0]), np.int64)
        gap, softness, loads, curvature = kernel_inputs(
            self.gap, compliance, self.loads, self.longitudinal_curvature
        )
        failed = kernels.solve_slender(
            gap,
            softness,
            members,
            None if shared is None else kernel_input(shared),
            loads,
            curvature,
            *constants,
            self.line_load,
            self.approach,
            self.half_length,
            self.separation,
            status,
            iterations,
        )
        self.status.T[:], self.iterations.T[:] = status, iterations
        return failed
