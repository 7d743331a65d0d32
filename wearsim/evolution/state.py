"""The state of a wear test: everything that evolves, and so exactly what a checkpoint holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.contact_batch import BatchSolution, rows_of
from wearsim.evolution.problem import WearProblem
from wearsim.types import ContactSolution, FloatArray, IntArray, Number

SIGMAS = 2.0  # of the scatter that draws at every pass leave, counted as error
Contacts: TypeAlias = Sequence[ContactSolution]
Depths: TypeAlias = tuple[FloatArray, FloatArray]
"""Of cylinder and rollers, shapes as in `WearState` [m]."""
_CONTACT = "contact_"
_TWINS = ("coarse_step_solution", "half_quadrature_solution")
_SCALARS = ("passes", "step", "steps", "rejected", "solves", "full_solves")


@dataclass(frozen=True)
class IndividualCounts:
    """Where tests stand that are stepped together and go each its own way.

    Parameters
    ----------
    passes : ndarray, shape (realisations,)
        Roller passes done.
    solves : ndarray of int, shape (realisations,)
        Contact solves of the steps taken.
    """

    passes: FloatArray
    solves: IntArray

    def at(self, numbers: IntArray) -> IndividualCounts:
        """Return those of some tests."""
        return IndividualCounts(self.passes[numbers], self.solves[numbers])


@dataclass(frozen=True)
class WearState:
    """A wear test after some roller passes.

    Leading axes are (station, roller, realisation); a profile has length one where it is shared.

    Parameters
    ----------
    passes : float
        Roller passes done, all rollers together.
    cylinder_depth : ndarray, shape (stations, 1, realisations, strips)
        Worn depth of the cylinder [m].
    roller_depth : ndarray, shape (1, rollers, realisations, strips)
        Worn depth of each roller [m].
    terms : ndarray, shape (terms, rollers, realisations)
        State of each load term.
    contacts : sequence of ContactSolution
        The last solution of every contact.
    energy : ndarray, shape (realisations,)
        Dissipated energy of all rollers [J].
    depth_error, volume_error : ndarray, shape (realisations,)
        Estimated error of depth, on either body [m], and of the volume worn off both [m^3] so far.
    quadrature : ndarray, shape (2, realisations)
        Part of those errors that the quadrature over inputs drawn at every pass has made.
    scatter : ndarray, shape (2, realisations)
        Variance of depth [m^2] and volume [m^6] from test to test that such draws leave.
    step : float
        Passes the step-size control proposes next; 0 where it has yet to choose.
    steps, rejected, solves, full_solves : int
        Steps taken and refused, contact solves of the steps taken, and passes solved in full.
    loop_strips : ndarray, shape (3, stations, rollers, realisations, strips), optional
        What the compiled per-pass loop carries: line load, and the line load [N/m] and gap [m]
        where the factorisation in use was made.
    loop_contacts : ndarray, shape (3, stations, rollers, realisations), optional
        Approach now, and there [m], and the sum of the dissipated powers of all passes [W].
    shadow : WearState, optional
        The same test stepped twice as coarsely; what sets the two apart is the error estimate.
    coarse : WearState, optional
        The shadow with half the contacts that stand for inputs drawn at every pass.
    decay : ndarray, shape (realisations,), optional
        Greatest rate at which wear flattens a profile, where last measured [1/pass].
    individual : IndividualCounts, optional
        In place of `passes` and `solves` where the realisations are tests that go each its own way.
    """

    passes: float
    cylinder_depth: FloatArray
    roller_depth: FloatArray
    terms: FloatArray
    contacts: Contacts
    energy: FloatArray
    depth_error: FloatArray
    volume_error: FloatArray
    quadrature: FloatArray
    scatter: FloatArray
    step: float = 0.0
    steps: int = 0
    rejected: int = 0
    solves: int = 0
    full_solves: int = 0
    loop_strips: FloatArray | None = None
    loop_contacts: FloatArray | None = None
    coarse_step_solution: WearState | None = None
    half_quadrature_solution: WearState | None = None
    decay: FloatArray | None = None
    individual: IndividualCounts | None = None

    @property
    def passes_done(self) -> Number:
        """Passes done: one number, or one for each realisation that goes its own way."""
        return self.passes if self.individual is None else self.individual.passes

    @property
    def batch(self) -> BatchSolution:
        """The contacts as columns with leading axes (station, contact, realisation)."""
        stations, _, realisations = self.cylinder_depth.shape[:3]
        contacts = len(self.contacts) // (stations * realisations)
        return as_batch(self.contacts, (stations, contacts, realisations))

    @property
    def depths(self) -> Depths:
        """Worn depths of cylinder and rollers."""
        return self.cylinder_depth, self.roller_depth

    def replaced(self, **others: Any) -> WearState:
        """Return the state with other fields: as `replace`, which takes ten times as long."""
        state = object.__new__(WearState)
        state.__dict__.update(self.__dict__, **others)
        return state

    def advanced_to(self, now: Number, solves: IntArray | None = None, **others: Any) -> WearState:
        """Return the state with other passes done, and whatever else is new.

        Parameters
        ----------
        now : float or ndarray, shape (realisations,)
            Passes done.
        solves : ndarray of int, shape (realisations,), optional
            Further solves.
        **others
            Other fields.
        """
        if self.individual is None:
            count = self.solves if solves is None else self.solves + int(solves.sum())
            return self.replaced(passes=float(now), solves=count, **others)
        counts = self.individual.solves if solves is None else self.individual.solves + solves
        return self.replaced(individual=IndividualCounts(np.asarray(now), counts), **others)

    def solves_since(self, before: WearState) -> IntArray:
        """Return the contact solves since an earlier state, of all or of each realisation."""
        if self.individual is None or before.individual is None:
            return np.array(self.solves - before.solves)
        return self.individual.solves - before.individual.solves

    @property
    def irreducible(self) -> FloatArray:
        """The errors of depth and volume that shorter steps would not lessen, (2, realisations)."""
        total: FloatArray = self.quadrature + SIGMAS * np.sqrt(self.scatter)
        return total

    def to_arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """Return the whole state as named arrays, for a checkpoint."""
        arrays: dict[str, npt.NDArray[np.generic]] = {
            item.name: np.asarray(getattr(self, item.name))
            for item in fields(self)
            if item.name not in {"contacts", "individual", *_TWINS}
            and getattr(self, item.name) is not None
        }
        for item in fields(ContactSolution):
            arrays[_CONTACT + item.name] = np.array(rows_of(self.contacts, item.name))
        for name in _TWINS:
            twin = getattr(self, name)
            if twin is not None:
                arrays.update({f"{name}_{key}": a for key, a in twin.to_arrays().items()})
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[np.generic]]) -> WearState:
        """Rebuild a state from what `to_arrays` returned."""
        values: dict[str, object] = {}
        for twin in _TWINS:
            start = f"{twin}_"
            part = {name[len(start) :]: a for name, a in arrays.items() if name.startswith(start)}
            if part:
                values[twin] = cls.from_arrays(part)
            arrays = {name: a for name, a in arrays.items() if not name.startswith(start)}
        known = {item.name for item in fields(cls)}  # of older files some are no longer kept
        for name, array in arrays.items():
            if name in _SCALARS:
                values[name] = array.item()
            elif name in known:
                values[name] = np.array(array)
        contact = {
            name[len(_CONTACT) :]: array
            for name, array in arrays.items()
            if name.startswith(_CONTACT)
        }
        for name in ("quadrature", "scatter"):  # files of version 0.1.0 have none
            values.setdefault(name, np.zeros((2, len(arrays["depth_error"]))))
        count = len(contact["power"])
        values["contacts"] = tuple(
            ContactSolution(**_unpack({name: column[k] for name, column in contact.items()}))
            for k in range(count)
        )
        return cls(**values)  # type: ignore[arg-type]


def _unpack(values: dict[str, Any]) -> dict[str, Any]:
    return {n: v.item() if v.ndim == 0 else np.array(v) for n, v in values.items()}


def as_batch(contacts: Contacts, shape: tuple[int, ...]) -> BatchSolution:
    """Return contacts as columns with given leading axes."""
    if not isinstance(contacts, BatchSolution):
        return BatchSolution.of(shape, contacts)
    if contacts.shape == shape:
        return contacts
    axes = len(contacts.shape)
    columns = {
        name: column.reshape(shape + column.shape[axes:])
        for name, column in contacts.columns.items()
    }
    return BatchSolution(shape, contacts.y, columns)


def widened(array: FloatArray, strips: int) -> FloatArray:
    """Return `array` with `strips` zeros added at both ends of its last axis."""
    margins = [(0, 0)] * (array.ndim - 1) + [(strips, strips)]
    return np.pad(array, margins)


def widened_state(state: WearState, y: FloatArray, strips: int) -> WearState:
    """Return a state on strips added on both sides, unworn and without load.

    Parameters
    ----------
    state : WearState
    y : ndarray, shape (wider strips,)
        Position of all strips [m].
    strips : int
        How many are added on each side.
    """
    contacts = tuple(
        replace(
            contact,
            y=y,
            half_length=widened(contact.half_length, strips),
            line_load=widened(contact.line_load, strips),
            dissipation=widened(contact.dissipation, strips),
        )
        for contact in state.contacts
    )
    loop = state.loop_strips
    shadow, coarse = (
        None if twin is None else widened_state(twin, y, strips)
        for twin in (state.coarse_step_solution, state.half_quadrature_solution)
    )
    return replace(
        state,
        cylinder_depth=widened(state.cylinder_depth, strips),
        roller_depth=widened(state.roller_depth, strips),
        contacts=contacts,
        loop_strips=None if loop is None else widened(loop, strips),
        coarse_step_solution=shadow,
        half_quadrature_solution=coarse,
    )


def fresh_state(problem: WearProblem) -> WearState:
    """Solve the fresh contacts and return the state before the first pass."""
    problem = problem.at_time(0.0, 0.0)
    stations, _, realisations = problem.shape
    n = problem.grid.strips
    cylinder_depth = np.zeros((stations, 1, realisations, n))
    roller_depth = np.zeros((1, problem.rollers, realisations, n))
    terms = np.zeros((len(problem.terms), problem.rollers, realisations))
    loads = np.broadcast_to(problem.force(0.0) + problem.inputs.normal_force_offset, problem.shape)
    contacts = problem.model.solve_batch(
        problem.nominal_gap,
        problem.kinematics.longitudinal_curvature,
        problem.points(loads, cylinder_depth, roller_depth),
    )
    return WearState(
        passes=0.0,
        cylinder_depth=cylinder_depth,
        roller_depth=roller_depth,
        terms=terms,
        contacts=contacts,
        energy=np.zeros(realisations),
        depth_error=np.zeros(realisations),
        volume_error=np.zeros(realisations),
        quadrature=np.zeros((2, realisations)),
        scatter=np.zeros((2, realisations)),
        solves=len(contacts),
    )


def fresh_stacked_state(problem: WearProblem) -> WearState:
    """Return the fresh state of tests that are joined in a problem and go each its own way."""
    state = fresh_state(problem)
    count = problem.shape[2]
    solves = np.full(count, state.solves // count)
    state = replace(state, solves=0, individual=IndividualCounts(np.zeros(count), solves))
    return replace(state, coarse_step_solution=state)
