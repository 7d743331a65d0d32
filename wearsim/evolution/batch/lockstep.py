"""Tests stepped together with individual step lengths.

The results of a test are the same to the bit for any batch that it is stepped in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.batch.bisect_failures import bisect_failures
from wearsim.evolution.batch.stack import (
    Stack,
    problem_of,
    stacked_problem,
    stacked_states,
    state_of,
)
from wearsim.evolution.error_control.step_doubling import Attempt, first_steps
from wearsim.evolution.error_control.step_size import Trial
from wearsim.evolution.integrate import not_finite, too_many_steps
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, fresh_stacked_state
from wearsim.evolution.steppers.backward_euler import ImplicitStepper
from wearsim.evolution.steppers.base import Stepper
from wearsim.plugins import BODIES
from wearsim.types import FloatArray, IntArray


def can_step_together(problem: WearProblem, stepper: Stepper) -> bool:
    """Return whether a test can be stepped together with `compatible` ones.

    Tests with load terms, a bearing torque, inputs drawn at every pass, several stations or a wear
    law that is not linear in the dissipation are stepped one at a time, as are those of other
    steppers, whose steps differ between tests in more than length.
    """
    linear = all(problem.wear_factors[body] is not None for body in BODIES)
    plain = not (problem.free or problem.terms or problem.has_nodes or problem.redraw)
    single = problem.shape[0] == problem.shape[2] == 1
    return isinstance(stepper, ImplicitStepper) and linear and plain and single


Path: TypeAlias = tuple[Stack, Stack, Stack]
"""The tests that took a step, at its start, in its middle and at its end."""


class Lockstep:
    """Tests that are stepped together, numbered in the order of their problems.

    Parameters
    ----------
    problems : sequence of WearProblem
        Compatible problems that can be stacked.
    stepper : ImplicitStepper
    stop : float
        Passes at the end of the tests.
    max_steps : int
        Greatest number of steps of a test.

    Attributes
    ----------
    stack : Stack, optional
        The tests in progress, if any.
    steps, rejected : ndarray of int, shape (all tests,)
        Steps taken and rejected.
    failures : dict of int to Exception
        Errors of the tests that failed, by number.
    """

    def __init__(
        self, problems: Sequence[WearProblem], stepper: ImplicitStepper, stop: float, max_steps: int
    ) -> None:
        self.stepper, self.stop, self.max_steps = stepper, stop, max_steps
        self.steps, self.rejected = np.zeros((2, len(problems)), dtype=np.int64)
        self._trials: dict[int, Trial] = {}
        self.stack: Stack | None = None
        problem = stacked_problem(problems)
        done, self.failures = bisect_failures(
            lambda numbers: fresh_stacked_state(problem_of(problem, numbers)),
            np.arange(len(problems)),
        )
        if done:
            numbers = np.concatenate([part for part, _ in done])
            state = stacked_states([part for _, part in done])
            self.stack = Stack(numbers, problem_of(problem, numbers), state)
            steps = np.full(len(numbers), stepper.forced_step or 0.0)
            if not stepper.forced_step:
                steps = first_steps(self.stack.problem, state)
            for number, step in zip(numbers.tolist(), steps.tolist(), strict=True):
                self._trials[number] = stepper.trial(step, dict)

    def fail(self, failures: dict[int, Exception]) -> None:
        """End tests, by number, with the errors given."""
        self.failures.update(failures)
        self._end(list(failures))

    def _end(self, numbers: Sequence[int]) -> None:
        if self.stack is not None and len(numbers):
            kept = np.flatnonzero(~np.isin(self.stack.numbers, numbers))
            self.stack = self.stack.at(kept) if kept.size else None

    def sweep(self) -> Path | None:
        """Try one step of every test in progress; return the accepted ones, if any.

        Tests that reach their end or fail are removed from `stack`.
        """
        steps = self._proposed()
        if self.stack is None:
            return None
        stack = self.stack
        scheme = self.stepper.scheme(stack.problem, stack.state)

        def attempt(places: IntArray) -> Attempt:
            some = stack.at(places)
            return self.stepper.attempt(some.problem, some.state, steps[places], self.stop, scheme)

        done, failed = bisect_failures(attempt, np.arange(len(steps)))
        self._reject(stack, failed, steps)
        accepted: list[tuple[IntArray, WearState, WearState]] = []
        for places, tried in done:
            columns = stack.numbers[places], tried.excess, steps[places]
            each = zip(*(column.tolist() for column in columns), strict=True)
            chosen = np.flatnonzero([self._trials[n].accepts(over, step) for n, over, step in each])
            if chosen.size:
                half, end = state_of(tried.half, chosen), state_of(tried.end, chosen)
                accepted.append((places[chosen], half, end))
        if not accepted:
            return None
        start = stack.at(np.concatenate([places for places, _, _ in accepted]))
        half = stacked_states([half for _, half, _ in accepted])
        end = stacked_states([end for _, _, end in accepted])
        return self._continue((start, replace(start, state=half), replace(start, state=end)))

    def _proposed(self) -> FloatArray:
        """Return the length of each test's next trial step [passes]; end tests without one."""
        steps: list[float] = []
        failures: dict[int, Exception] = {}
        for number, passes in [] if self.stack is None else self.stack.progress:
            try:
                if self.steps[number] >= self.max_steps:
                    raise too_many_steps(self.max_steps, passes, self.stop, {})
                steps.append(self._trials[number].step(passes, self.stop))
            except (StepError, ContactError) as error:
                failures[number] = error
        self.fail(failures)
        return np.array(steps)

    def _reject(self, stack: Stack, failed: dict[int, Exception], steps: FloatArray) -> None:
        """Shorten the steps that failed, by place; end tests that cannot continue."""
        ending: dict[int, Exception] = {}
        for place, error in failed.items():
            number = int(stack.numbers[place])
            if isinstance(error, (StepError, ContactError)) and not self.stepper.forced_step:
                self._trials[number].reject(error, float(steps[place]))
            else:
                ending[number] = error
        self.fail(ending)

    def _continue(self, path: Path) -> Path | None:
        """Continue from accepted steps; return those that led to finite values."""
        end = path[-1]
        finite = np.isfinite(end.state.cylinder_depth).all(axis=(0, 1, 3)) & np.isfinite(
            end.state.energy
        )
        failures: dict[int, Exception] = {}
        for (number, passes), ok in zip(end.progress, finite, strict=True):
            trial = self._trials[number]
            self.steps[number] += 1
            self.rejected[number] += trial.rejected
            self._trials[number] = self.stepper.trial(trial.proposed, dict)
            if not ok:
                failures[number] = not_finite(passes, {})
        if self.stack is not None:
            self.stack = self.stack.with_states_of(end)
        self.fail(failures)
        self._end([number for number, passes in end.progress if passes >= self.stop])
        if not failures:
            return path
        kept = np.flatnonzero(finite)
        start, half, end = (one.at(kept) for one in path)
        return (start, half, end) if kept.size else None
