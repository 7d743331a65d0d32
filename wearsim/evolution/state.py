"""State of a wear test: all that changes from step to step, the content of a checkpoint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.operating_points import unworn_contacts
from wearsim.evolution.problem import WearProblem
from wearsim.types import FloatArray, IntArray, Number

SIGMAS = 2.0  # standard deviations of the sampling scatter that are counted as error
Depths: TypeAlias = tuple[FloatArray, FloatArray]
"""Depths of cylinder and rollers, shapes as in `WearState` [m]."""
_CONTACT = "contact_"
_AUXILIARY = ("coarse_step_solution", "half_quadrature_solution")
_SCALARS = ("passes", "step", "steps", "rejected", "solves", "full_solves")


@dataclass(frozen=True)
class IndividualCounts:
    """Progress of tests that are stepped together with individual steps.

    Parameters
    ----------
    passes : ndarray, shape (realisations,)
        Roller passes done.
    solves : ndarray of int, shape (realisations,)
        Contact solves of the steps taken.
    """

    passes: FloatArray
    solves: IntArray


@dataclass(frozen=True)
class WearState:
    """A wear test after some roller passes.

    Leading axes are (station, roller, realisation). The axis of rollers has length one for the
    cylinder, that of stations has length one for the rollers.

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
    contacts : ContactBatchSolution
        Last solution of every contact, in the order of `WearProblem.contacts`.
    energy : ndarray, shape (realisations,)
        Dissipated energy of all rollers [J].
    depth_error : ndarray, shape (realisations,)
        Error estimate of the worn depth, the greater of both bodies [m].
    volume_error : ndarray, shape (realisations,)
        Error estimate of the volume worn off both bodies [m^3].
    quadrature : ndarray, shape (2, realisations)
        Part of these errors due to the quadrature over inputs drawn at every pass: in depth [m]
        and volume [m^3].
    scatter : ndarray, shape (2, realisations)
        Variance between tests due to these draws: of depth [m^2] and volume [m^6].
    step : float
        Length of the next step proposed by the step-size control [passes]; 0 before the first.
    steps, rejected : int
        Steps taken and rejected.
    solves : int
        Contact solves of the steps taken.
    full_solves : int
        Passes solved in full, not by the chord method, in a per-pass run.
    loop_strips : ndarray, shape (3, stations, rollers, realisations, strips), optional
        Memory of the compiled per-pass loop: line load [N/m], and line load [N/m] and gap [m] of
        the last factorisation.
    loop_contacts : ndarray, shape (3, stations, rollers, realisations), optional
        Memory of the compiled per-pass loop: approach [m], approach of the last factorisation [m],
        and the sum of the dissipated powers of all passes [W].
    coarse_step_solution : WearState, optional
        The same test with steps of twice the length; the difference is the error estimate.
    half_quadrature_solution : WearState, optional
        The coarse-step solution with half the quadrature nodes per roller.
    decay : ndarray, shape (realisations,), optional
        Greatest decay rate of a profile by wear, last measurement [1/pass].
    individual : IndividualCounts, optional
        Replaces `passes` and `solves` if the realisations are tests with individual steps.
    """

    passes: float
    cylinder_depth: FloatArray
    roller_depth: FloatArray
    terms: FloatArray
    contacts: ContactBatchSolution
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
        """Roller passes done: one number, or one per realisation with individual steps."""
        return self.passes if self.individual is None else self.individual.passes

    @property
    def depths(self) -> Depths:
        """Worn depths of cylinder and rollers [m]."""
        return self.cylinder_depth, self.roller_depth

    @property
    def auxiliary(self) -> dict[str, Any]:
        """The coarse-step and half-quadrature solutions that exist, by field name."""
        states = {name: getattr(self, name) for name in _AUXILIARY}
        return {name: state for name, state in states.items() if state is not None}

    def replaced(self, **others: Any) -> WearState:
        """Return the state with some fields replaced, in a tenth of the time of `replace`."""
        state = object.__new__(WearState)
        state.__dict__.update(self.__dict__, **others)
        return state

    def advanced_to(
        self, passes: Number, solves: IntArray | None = None, **others: Any
    ) -> WearState:
        """Return the state with other passes done, and other fields replaced.

        Parameters
        ----------
        passes : float or ndarray, shape (realisations,)
            Passes done.
        solves : ndarray of int, shape (realisations,), optional
            Contact solves to add.
        **others
            Other fields.
        """
        if self.individual is None:
            count = self.solves if solves is None else self.solves + int(solves.sum())
            return self.replaced(passes=float(passes), solves=count, **others)
        counts = self.individual.solves if solves is None else self.individual.solves + solves
        individual = IndividualCounts(np.asarray(passes), counts)
        return self.replaced(individual=individual, **others)

    def solves_since(self, before: WearState) -> IntArray:
        """Return the contact solves since an earlier state, per realisation or in total."""
        if self.individual is None or before.individual is None:
            return np.array(self.solves - before.solves)
        return self.individual.solves - before.individual.solves

    @property
    def irreducible(self) -> FloatArray:
        """Errors of depth [m] and volume [m^3] not due to step size, shape (2, realisations)."""
        return np.asarray(self.quadrature + SIGMAS * np.sqrt(self.scatter))

    def to_arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """Return the whole state as named arrays, for a checkpoint."""
        arrays: dict[str, npt.NDArray[np.generic]] = {
            item.name: np.asarray(getattr(self, item.name))
            for item in fields(self)
            if item.name not in {"contacts", "individual", *_AUXILIARY}
            and getattr(self, item.name) is not None
        }
        for name, column in vars(self.contacts).items():
            arrays[_CONTACT + name] = np.array(column)
        arrays[_CONTACT + "y"] = np.tile(self.contacts.y, (len(self.contacts), 1))
        for name, state in self.auxiliary.items():
            arrays.update({f"{name}_{key}": a for key, a in state.to_arrays().items()})
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[np.generic]]) -> WearState:
        """Return the state stored in the result of `to_arrays`."""
        known = {item.name for item in fields(cls)}  # early files have further names
        values: dict[str, Any] = {
            name: array.item() if name in _SCALARS else np.array(array)
            for name, array in arrays.items()
            if name in known
        }
        for name in ("quadrature", "scatter"):  # absent from early files of layout 1
            values.setdefault(name, np.zeros((2, len(arrays["depth_error"]))))
        for name in _AUXILIARY:
            part = _with_prefix(arrays, f"{name}_")
            if part:
                values[name] = cls.from_arrays(part)
        columns = _with_prefix(arrays, _CONTACT)
        values["contacts"] = ContactBatchSolution(**columns | {"y": columns["y"][0]})
        return cls(**values)


def _with_prefix(arrays: Mapping[str, npt.NDArray[Any]], prefix: str) -> dict[str, Any]:
    """Return the arrays whose names begin with a prefix, by the rest of their names."""
    return {n.removeprefix(prefix): a for n, a in arrays.items() if n.startswith(prefix)}


def widened(array: FloatArray, strips: int) -> FloatArray:
    """Return `array` with `strips` zeros added at both ends of its last axis."""
    return np.pad(array, [(0, 0)] * (array.ndim - 1) + [(strips, strips)])


def widened_state(state: WearState, y: FloatArray, strips: int) -> WearState:
    """Return a state with strips added on both sides, unworn and without load.

    Parameters
    ----------
    state : WearState
    y : ndarray, shape (strips of the wider grid,)
        Position of all strips [m].
    strips : int
        Number of strips added on each side.
    """
    contacts, loop = state.contacts, state.loop_strips
    return state.replaced(
        cylinder_depth=widened(state.cylinder_depth, strips),
        roller_depth=widened(state.roller_depth, strips),
        contacts=replace(
            contacts,
            y=y,
            half_length=widened(contacts.half_length, strips),
            line_load=widened(contacts.line_load, strips),
            dissipation=widened(contacts.dissipation, strips),
        ),
        loop_strips=None if loop is None else widened(loop, strips),
        **{name: widened_state(part, y, strips) for name, part in state.auxiliary.items()},
    )


def fresh_state(problem: WearProblem) -> WearState:
    """Return the state before the first pass, with the contacts of the unworn bodies solved."""
    problem = problem.at_time(0.0, 0.0)
    stations, _, realisations = problem.shape
    n = problem.grid.strips
    contacts = problem.model.solve(unworn_contacts(problem))
    return WearState(
        passes=0.0,
        cylinder_depth=np.zeros((stations, 1, realisations, n)),
        roller_depth=np.zeros((1, problem.rollers, realisations, n)),
        terms=np.zeros((len(problem.terms), problem.rollers, realisations)),
        contacts=contacts,
        energy=np.zeros(realisations),
        depth_error=np.zeros(realisations),
        volume_error=np.zeros(realisations),
        quadrature=np.zeros((2, realisations)),
        scatter=np.zeros((2, realisations)),
        solves=len(contacts),
    )


def fresh_stacked_state(problem: WearProblem) -> WearState:
    """Return the fresh state of stacked tests with individual steps."""
    state, count = fresh_state(problem), problem.shape[2]
    individual = IndividualCounts(np.zeros(count), np.full(count, state.solves // count))
    state = replace(state, solves=0, individual=individual)
    return replace(state, coarse_step_solution=state)
