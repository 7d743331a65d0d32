"""The contact model `slender`, coupled where contacts wear common bodies."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from pydantic import Field

from wearsim.contact_batch import NO_BODY, ContactBatch, ContactBatchSolution
from wearsim.errors import ContactError
from wearsim.mechanics.numerics.jit import compile_alongside, kernel_input, kernel_inputs
from wearsim.mechanics.slender import newton as kernels
from wearsim.mechanics.slender.influence import HIGHEST, curvature_table, no_table
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import SUMS
from wearsim.models.contact.strip_model import (
    StripModel,
    TangentialOptions,
    check_edges,
    grid_about_hertz,
    normal_failure,
    tangential_theory,
)
from wearsim.models.contact.strip_tractions import strip_tractions
from wearsim.models.tangential.base import TangentialTheory, power_not_finite
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.models.tangential.torque_balance import with_balanced_creepage
from wearsim.plugins import (
    Capabilities,
    ContactModelSpec,
    PassLoop,
    SharedWear,
    refuse_unclaimed,
)
from wearsim.plugins.contact_model import naming_contact, solved_one_by_one
from wearsim.types import FloatArray, Grid, IntArray, Material

# strips of a test that Python solves while the kernel is compiled, and of its records together
INTERPRETED, TOGETHER = 250, 5000
#: Strip width [m], E* [Pa], two tables and tolerance of `mechanics.slender.newton.solve_slender`.
Constants: TypeAlias = tuple[float, float, FloatArray, FloatArray, float]
_FAILURE = {
    kernels.SINGULAR: "its equations are singular: check the gap, the load and the materials",
    kernels.TOO_FINE: f"a half-length exceeds {np.exp(HIGHEST):.0f} strip widths",
    kernels.NO_CONVERGENCE: "Newton's method did not converge on the strips in contact",
    kernels.NOT_FINITE: "a value is not finite",
}


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


class SlenderOptions(TangentialOptions):
    """Options of the contact model `slender`."""

    half_length: Literal["coupled", "local"] = Field(
        "coupled",
        description="half-length from the line loads of all strips, or local from that of the same"
        " strip: a quarter cheaper, with an error in p0 of 0.5 % where the patch is ten times as"
        " wide as long and 3 % where it is three times",
    )


class Slender(StripModel):
    """Line-contact strips (Kalker 1972) on any profile, with wear compliance.

    Parameters
    ----------
    theory, grid, materials
        As in `StripModel`.
    coupled_lengths : bool
        Whether half-lengths depend on the line loads of all strips.
    """

    capabilities = Capabilities(
        wear_compliance=True,
        coupled=True,
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        creep_factor=True,
        pass_loop=True,
        fields=True,
    )

    def __init__(
        self,
        theory: TangentialTheory,
        grid: Grid,
        materials: tuple[Material, Material],
        coupled_lengths: bool = True,
    ) -> None:
        super().__init__(theory, grid, materials)
        self._bend = (curvature_table if coupled_lengths else no_table)(grid.strips)
        if not isinstance(theory, StripTheory):
            self.capabilities = replace(self.capabilities, pass_loop=False)

    def solve(
        self,
        batch: ContactBatch,
        wear_compliance: FloatArray | None = None,
        coupling: SharedWear | None = None,
        warm: ContactBatchSolution | None = None,
    ) -> ContactBatchSolution:
        """Solve the contacts in one call if strip theory supports them.

        Contacts with another theory have their normal problems solved in one call and their
        tangential problems one after another.
        """
        if batch.friction.ndim > 2:  # nothing else in a batch requires what it does not support
            refuse_unclaimed(self, batch)
        normal = self._solve_normal(batch, wear_compliance, coupling, warm)
        shape = batch.gap.shape
        line_load, half_length = normal.line_load.reshape(shape), normal.half_length.reshape(shape)
        separation, approach = normal.separation.reshape(shape), normal.approach.reshape(shape[0])
        iterations = normal.iterations.ravel()
        if not isinstance(self.theory, StripTheory):
            one_by_one = solved_one_by_one(
                batch,
                lambda k: self._complete(
                    line_load[k],
                    half_length[k],
                    float(batch.longitudinal_curvature[k]),
                    float(approach[k]),
                    int(iterations[k]),
                    batch.point(k),
                ),
            )
            return replace(one_by_one, separation=separation)
        solved, tangential = (line_load, half_length), (self._grid, self._tangential)
        if batch.bearing_torque is not None:
            batch = with_balanced_creepage(
                batch,
                line_load,
                half_length,
                self._grid,
                self._tangential,
                warm,
                lambda trial: strip_tractions(*solved, trial, *tangential)[2],
            )
        dissipation, sums, _ = strip_tractions(*solved, batch, *tangential)
        if not np.isfinite(np.add.reduce(sums, axis=None)):
            number = int((~np.isfinite(sums)).nonzero()[1].min())
            raise naming_contact(
                power_not_finite(batch.point(number), line_load=line_load[number]), number, batch
            )
        return ContactBatchSolution.of_columns(
            {
                "y": self._grid.y,
                "half_length": half_length,
                "line_load": line_load,
                "dissipation": dissipation,
                "approach": approach,
                "longitudinal_creepage": batch.longitudinal,
                "iterations": iterations,
                "separation": separation,
                **dict(zip(SUMS, sums, strict=True)),
            }
        )

    def _solve_normal(
        self,
        batch: ContactBatch,
        wear_compliance: FloatArray | None,
        coupling: SharedWear | None,
        warm: ContactBatchSolution | None,
    ) -> NormalContacts:
        """Solve the normal problems; arguments as in `solve`."""
        worn = wear_compliance is not None or coupling is not None
        tolerance = kernels.WEAR_TOLERANCE if worn else kernels.TOLERANCE
        modulus = self._pair.contact_modulus
        constants = self._grid.spacing, modulus, self._table, self._bend, tolerance
        size = 1 if coupling is None else len(coupling.bodies)
        normal = NormalContacts.starting(batch, size, warm)
        if not normal.solve(wear_compliance if coupling is None else coupling, constants):
            return normal
        for number in normal.failed.tolist():
            try:
                self._check(
                    int(normal.status[number].max()),
                    normal.gap[number],
                    normal.loads[number],
                    normal.line_load[number],
                    normal.approach[number],
                )
            except ContactError as error:
                if size > 1:
                    raise
                raise naming_contact(error, number, batch) from error
        return normal

    def _check(
        self,
        status: int,
        gap: FloatArray,
        loads: FloatArray,
        line_load: FloatArray,
        approach: FloatArray,
    ) -> None:
        state = {"gap": gap, "line_load": line_load, "approach": approach, "normal_force": loads}
        if status != kernels.CONVERGED:
            raise normal_failure("slender", _FAILURE[status], status == kernels.TOO_FINE, state)
        check_edges(self._grid, line_load, state)

    def pass_loop(self, loop: PassLoop) -> int:
        """Run roller passes in compiled code; strip theory only."""
        if not self.capabilities.pass_loop:
            return super().pass_loop(loop)
        from wearsim.mechanics.slender import chord_method, pass_loop  # noqa: PLC0415  (slow to load, rarely needed)

        modulus = self._pair.contact_modulus
        constants = chord_method.ContactConstants(
            self._grid.spacing,
            1.0 / (np.pi * modulus),
            modulus,
            loop.longitudinal_curvature,
            self._table,
            self._bend,
            strip_elasticity(self._tangential.contact_modulus, self._tangential.shear_modulus),
        )
        status, done, full_solves = pass_loop.run_passes(
            loop.order,
            loop.first_pass,
            pass_loop.Passes(loop.base_load, loop.creepage, loop.friction, loop.tilt, loop.spin),
            float(loop.stiffness),
            loop.fresh_approach,
            loop.rests,
            loop.terms,
            loop.term_rates,
            loop.nominal_gap,
            loop.from_apex,
            loop.rolling_speed,
            loop.similar,
            constants,
            pass_loop.Wear(
                loop.slip_base,
                loop.spin_arm,
                loop.slip_rates,
                loop.wear,
                loop.cylinder_depth,
                loop.roller_depth,
            ),
            chord_method.Loads(
                loop.line_load, loop.anchor, loop.anchor_gap, loop.approach, loop.anchor_approach
            ),
            chord_method.new_chord_state(constants, *loop.nominal_gap.shape),
            loop.energy,
        )
        gap = loop.nominal_gap + loop.cylinder_depth + loop.roller_depth
        if status == pass_loop.UNLOADED:
            raise ContactError(
                f"contact is lost at pass {loop.first_pass + done}: the load is not positive",
                {"line_load": loop.line_load, "gap": gap},
                cause="lost",
            )
        loads = loop.line_load.sum(axis=1) * self._grid.spacing
        self._check(status, gap, loads, loop.line_load, loop.approach)
        return int(full_solves)


SPEC = ContactModelSpec(
    name="slender",
    factory=lambda options, grid, materials: Slender(
        tangential_theory(options), grid, materials, options.half_length == "coupled"
    ),
    suggest_grid=grid_about_hertz,
    protocol=2,
    options=SlenderOptions,
    capabilities=Slender.capabilities,
    summary="line-contact strips on any profile; the default",
    references=(
        "Kalker, On elastic line contact, J. Appl. Mech. 39 (1972), DOI 10.1115/1.3422842",
        "Carter, Proc. R. Soc. A 112 (1926), DOI 10.1098/rspa.1926.0100",
    ),
)


def compile_solve_slender() -> None:
    """Compile `solve_slender` for independent contacts by a call for one contact of one strip."""
    strip, contact, count = np.ones((1, 1, 1)), np.ones((1, 1)), np.ones(1, np.int64)
    table = np.ones((2, 2, 1))
    table.setflags(write=False)  # as that of `influence_table`
    kernels.solve_slender(
        *(strip, strip.copy(), None, None, contact, contact.copy(), 1.0, 1e11, table, table),
        *(1.0, strip.copy(), contact.copy(), strip.copy(), strip.copy(), count, count.copy()),
    )


def is_short(
    started: bool, gap: FloatArray, _: FloatArray, bodies: IntArray | None, *__: object
) -> bool:
    """Return whether Python solves contacts in less time than the kernel takes to be compiled."""
    return bodies is None and gap.size <= (TOGETHER if started else INTERPRETED)


compile_alongside("solve_slender", compile_solve_slender, "solve_slender", is_short=is_short)
