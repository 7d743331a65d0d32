"""Wear tests stacked as the realisations of one problem, and selections of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from wearsim.evolution.contact_inputs import ContactInputs
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import IndividualCounts, WearState
from wearsim.types import IntArray

#: axis of the realisations in the arrays of a `WearState`
_AXES = {
    "cylinder_depth": 2,
    "roller_depth": 2,
    "terms": 2,
    "energy": 0,
    "depth_error": 0,
    "volume_error": 0,
    "quadrature": 1,
    "scatter": 1,
}
_RADII = ("cylinder_radius", "roller_radius", "crown_radius", "rolling_speed")
_ARRAYS = ("from_apex", "roller", "weight", "half", "slip_profile")


def compatible(one: WearProblem, other: WearProblem) -> bool:
    """Return whether two tests that can be stacked can share a stack.

    They share grid, model, kinematics and the arrays that do not depend on the realisation.
    """
    first, second = one.kinematics, other.kinematics
    arrays = [(getattr(one, name), getattr(other, name)) for name in _ARRAYS]
    varying = [[(item.name, item.rollers) for item in problem.varying] for problem in (one, other)]
    return (
        one.grid is other.grid
        and one.model is other.model
        and one.tilt_shifts == other.tilt_shifts
        and one.iteration_tolerance == other.iteration_tolerance
        and np.array_equal(first.multiplicity, second.multiplicity)
        and all(a is b if a is None or b is None else np.array_equal(a, b) for a, b in arrays)
        and all(getattr(first, name) == getattr(second, name) for name in _RADII)
        and varying[0] == varying[1]
    )


def stacked_problem(problems: Sequence[WearProblem]) -> WearProblem:
    """Return one problem whose realisations are the given tests, which are compatible."""
    columns = (
        np.concatenate([getattr(problem.inputs, item.name) for problem in problems], axis=1)
        for item in fields(ContactInputs)
    )
    return replace(
        problems[0],
        flat_gap=np.concatenate([problem.flat_gap for problem in problems], axis=2),
        inputs=ContactInputs(*columns),
        stacked=tuple(problems),
    )


def problem_of(problem: WearProblem, numbers: IntArray) -> WearProblem:
    """Return the problem of some realisations, by number and in that order."""
    columns = (
        np.take(getattr(problem.inputs, item.name), numbers, axis=1)
        for item in fields(ContactInputs)
    )
    return replace(
        problem,
        flat_gap=np.take(problem.flat_gap, numbers, axis=2),
        inputs=ContactInputs(*columns),
        stacked=tuple(problem.stacked[number] for number in numbers) if problem.stacked else (),
    )


def contacts_of(state: WearState, numbers: IntArray) -> IntArray:
    """Return the numbers of the contacts of some realisations, in the state's order."""
    realisations = state.cylinder_depth.shape[2]
    return np.arange(len(state.contacts)).reshape(-1, realisations)[:, numbers].ravel()


def state_of(state: WearState, numbers: IntArray) -> WearState:
    """Return the state of some realisations, by number and in that order."""
    arrays: dict[str, Any] = {
        name: np.take(getattr(state, name), numbers, axis=axis) for name, axis in _AXES.items()
    }
    coarse, counts = state.coarse_step_solution, state.individual
    if counts is not None:
        counts = IndividualCounts(counts.passes[numbers], counts.solves[numbers])
    return replace(
        state,
        **arrays,
        contacts=state.contacts.at(contacts_of(state, numbers)),
        coarse_step_solution=None if coarse is None else state_of(coarse, numbers),
        individual=counts,
    )


def stacked_states(states: Sequence[WearState]) -> WearState:
    """Return the states of tests with individual steps as realisations of one state."""
    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(state, name) for state in states], axis=axis)
        for name, axis in _AXES.items()
    }
    first, *others = (state.contacts for state in states)
    rows = len(first) // states[0].cylinder_depth.shape[2]
    counts = [state.individual for state in states if state.individual is not None]
    coarse = [
        state.coarse_step_solution for state in states if state.coarse_step_solution is not None
    ]
    return replace(
        states[0],
        **arrays,
        contacts=first.joined_with(*others, rows=rows),
        coarse_step_solution=stacked_states(coarse) if len(coarse) == len(states) else None,
        individual=IndividualCounts(
            np.concatenate([item.passes for item in counts]),
            np.concatenate([item.solves for item in counts]),
        ),
    )


@dataclass(frozen=True)
class Stack:
    """Some tests, as the realisations of one problem.

    Parameters
    ----------
    numbers : ndarray of int, shape (tests,)
        Numbers of the tests.
    problem : WearProblem
        Their stacked problem.
    state : WearState
        Their states, with individual steps.
    """

    numbers: IntArray
    problem: WearProblem
    state: WearState

    @property
    def progress(self) -> list[tuple[int, float]]:
        """Number of each test and the roller passes done."""
        passes: list[float] = np.asarray(self.state.passes_done).tolist()
        return list(zip(self.numbers.tolist(), passes, strict=True))

    def at(self, places: IntArray) -> Stack:
        """Return the tests at some places, in that order."""
        if np.array_equal(places, np.arange(len(self.numbers))):
            return self
        problem, state = problem_of(self.problem, places), state_of(self.state, places)
        return Stack(self.numbers[places], problem, state)

    def with_states_of(self, others: Stack) -> Stack:
        """Return these tests with the states of some of them replaced.

        Parameters
        ----------
        others : Stack
            Some of the tests, with their new states.
        """
        if np.array_equal(self.numbers, others.numbers):
            return replace(self, state=others.state)
        order, place = np.arange(len(self.numbers)), np.argsort(self.numbers)
        at = place[np.searchsorted(self.numbers, others.numbers, sorter=place)]
        order[at] = len(order) + np.arange(len(at))
        return replace(self, state=state_of(stacked_states([self.state, others.state]), order))
