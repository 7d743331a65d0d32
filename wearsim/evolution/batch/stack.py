"""Tests side by side as the realisations of one problem: joined, and taken apart again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from wearsim.evolution.contact_inputs import ContactInputs
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import IndividualCounts, WearState
from wearsim.plugins import BODIES
from wearsim.types import FloatArray, IntArray

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
_SAME_ARRAYS = ("from_apex", "roller", "weight", "half", "slip_profile")


def can_be_stacked(problem: WearProblem) -> bool:
    """Tell whether a test can be stepped together with others that are like it.

    Load terms, a bearing torque, inputs drawn at every pass, several stations and wear laws that
    are not linear in the dissipation take one test at a time.
    """
    linear = all(problem.wear_factors[body] is not None for body in BODIES)
    plain = not (problem.free or problem.terms or problem.has_nodes or problem.redraw)
    return linear and plain and problem.shape[0] == problem.shape[2] == 1


def compatible(one: WearProblem, other: WearProblem) -> bool:
    """Tell whether two tests that can be joined can be so with each other."""
    first, second = one.kinematics, other.kinematics
    radii = ("cylinder_radius", "roller_radius", "crown_radius", "rolling_speed")
    varying = [[(item.name, item.rollers) for item in problem.varying] for problem in (one, other)]
    return (
        all(getattr(one, name) is getattr(other, name) for name in ("grid", "model"))
        and all(
            getattr(one, name) == getattr(other, name)
            for name in ("tilt_shifts", "iteration_tolerance")
        )
        and all(_equal(getattr(one, name), getattr(other, name)) for name in _SAME_ARRAYS)
        and all(getattr(first, name) == getattr(second, name) for name in radii)
        and _equal(first.multiplicity, second.multiplicity)
        and varying[0] == varying[1]
    )


def _equal(one: FloatArray | None, other: FloatArray | None) -> bool:
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)


def stacked_problem(problems: Sequence[WearProblem]) -> WearProblem:
    """Return one problem of which the tests, which are compatible, are the realisations."""
    inputs = [problem.inputs for problem in problems]
    joined = ContactInputs(
        *(
            np.concatenate([getattr(one, item.name) for one in inputs], axis=1)
            for item in fields(ContactInputs)
        )
    )
    gaps = np.concatenate([problem.flat_gap for problem in problems], axis=2)
    return replace(problems[0], flat_gap=gaps, inputs=joined, stacked=tuple(problems))


def problem_of(problem: WearProblem, numbers: IntArray) -> WearProblem:
    """Return the problem with some of its realisations, in that order."""
    inputs = ContactInputs(
        *(
            np.take(getattr(problem.inputs, item.name), numbers, axis=1)
            for item in fields(ContactInputs)
        )
    )
    stacked = tuple(problem.stacked[number] for number in numbers) if problem.stacked else ()
    gap = np.take(problem.flat_gap, numbers, axis=2)
    return replace(problem, flat_gap=gap, inputs=inputs, stacked=stacked)


def state_of(state: WearState, numbers: IntArray) -> WearState:
    """Return the state of some realisations, in that order."""
    taken: dict[str, Any] = {
        name: np.take(getattr(state, name), numbers, axis=axis) for name, axis in _AXES.items()
    }
    shadow = state.coarse_step_solution
    return replace(
        state,
        **taken,
        contacts=state.batch.at(numbers),
        coarse_step_solution=None if shadow is None else state_of(shadow, numbers),
        individual=None if state.individual is None else state.individual.at(numbers),
    )


def stacked_states(states: Sequence[WearState]) -> WearState:
    """Return the states of tests that go each its own way as the realisations of one."""
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(state, name) for state in states], axis=axis)
        for name, axis in _AXES.items()
    }
    first, *others = (state.batch for state in states)
    each = [state.individual for state in states if state.individual is not None]
    shadows = [
        state.coarse_step_solution for state in states if state.coarse_step_solution is not None
    ]
    return replace(
        states[0],
        **joined,
        contacts=first.joined_with(*others),
        coarse_step_solution=stacked_states(shadows) if len(shadows) == len(states) else None,
        individual=IndividualCounts(
            np.concatenate([one.passes for one in each]),
            np.concatenate([one.solves for one in each]),
        ),
    )


@dataclass(frozen=True)
class Stack:
    """Some tests, as the realisations of one problem.

    Parameters
    ----------
    numbers : ndarray of int, shape (tests,)
        Which they are.
    problem : WearProblem
    state : WearState
        Theirs; each goes its own way.
    """

    numbers: IntArray
    problem: WearProblem
    state: WearState

    @property
    def progress(self) -> list[tuple[int, float]]:
        """Number and roller passes done of each test."""
        passes: list[float] = np.asarray(self.state.passes_done).tolist()
        return list(zip(self.numbers.tolist(), passes, strict=True))

    def at(self, places: IntArray) -> Stack:
        """Return the tests at some places, in that order."""
        if np.array_equal(places, np.arange(len(self.numbers))):
            return self
        problem, state = problem_of(self.problem, places), state_of(self.state, places)
        return Stack(self.numbers[places], problem, state)

    def moved_to(self, state: WearState) -> Stack:
        """Return the same tests at another state."""
        return replace(self, state=state)

    def with_others(self, others: Stack) -> Stack:
        """Return these tests, some of them at the state that they have in another stack."""
        if np.array_equal(self.numbers, others.numbers):
            return self.moved_to(others.state)
        order, place = np.arange(len(self.numbers)), np.argsort(self.numbers)
        at = place[np.searchsorted(self.numbers, others.numbers, sorter=place)]
        order[at] = len(order) + np.arange(len(at))
        return self.moved_to(state_of(stacked_states([self.state, others.state]), order))
