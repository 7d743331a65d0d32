"""Tests stepped together, each at its own pace: one sweep is one try of every test.

What a test does is the same to the bit whatever tests are stepped beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.batch.bisect_failures import bisect_failures
from wearsim.evolution.batch.stack import (
    Stack,
    can_be_stacked,
    problem_of,
    stacked_problem,
    stacked_states,
    state_of,
)
from wearsim.evolution.error_control.step_doubling import Attempt, first_steps
from wearsim.evolution.error_control.step_size import Trial
from wearsim.evolution.integrate import not_finite, too_many_steps
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import fresh_stacked_state
from wearsim.evolution.steppers.backward_euler import ImplicitStepper
from wearsim.evolution.steppers.base import Stepper
from wearsim.types import FloatArray, IntArray


def can_step_together(problem: WearProblem, stepper: Stepper) -> bool:
    """Tell whether a test can be stepped together with others that are `alike`.

    It takes implicit steps: those of other steppers differ from test to test in more than length.
    """
    return isinstance(stepper, ImplicitStepper) and can_be_stacked(problem)


Path: TypeAlias = tuple[Stack, Stack, Stack]
"""The tests that took a step, at its start, in its middle and at its end."""


class Lockstep:
    """Tests that are stepped together, numbered as their problems are given.

    Parameters
    ----------
    problems : sequence of WearProblem
        Alike, and such as can go together.
    stepper : ImplicitStepper
    stop : float
        Passes at which the tests end.
    max_steps : int
        Steps after which a test is given up.

    Attributes
    ----------
    stack : Stack, optional
        The tests that are under way, if any.
    steps, rejected : ndarray of int, shape (all tests,)
        Steps taken and refused.
    failures : dict of int to Exception
        What ended the tests that failed, by number.
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
            numbers = np.concatenate([found for found, _ in done])
            state = stacked_states([found for _, found in done])
            self.stack = Stack(numbers, problem_of(problem, numbers), state)
            steps = np.full(len(numbers), stepper.forced_step or 0.0)
            if not stepper.forced_step:
                steps = first_steps(self.stack.problem, state)
            for number, step in zip(numbers.tolist(), steps.tolist(), strict=True):
                self._trials[number] = self._trial(step)

    def _trial(self, proposed: float) -> Trial:
        forced = bool(self.stepper.forced_step)
        return Trial(proposed, self.stepper.control, self.stepper.order, forced, dict)

    def fail(self, failures: dict[int, Exception]) -> None:
        """End tests, by number."""
        self.failures.update(failures)
        self._end(list(failures))

    def _end(self, numbers: Sequence[int]) -> None:
        if self.stack is not None and len(numbers):
            kept = np.flatnonzero(~np.isin(self.stack.numbers, numbers))
            self.stack = self.stack.at(kept) if kept.size else None

    def sweep(self) -> Path | None:
        """Try one step of every test under way; return those that stand, if any.

        Tests that end by it, or fail, are no longer under way.
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
        self.fail(self._refused(stack, failed, steps))
        tried = [(places, one, self._standing(stack, places, one, steps)) for places, one in done]
        tried = [(places, one, ok) for places, one, ok in tried if ok.size]
        if not tried:
            return None
        stood = stack.at(np.concatenate([places[ok] for places, _, ok in tried]))
        half = stacked_states([state_of(one.half, ok) for _, one, ok in tried])
        end = stacked_states([state_of(one.end, ok) for _, one, ok in tried])
        return self._taken((stood, stood.moved_to(half), stood.moved_to(end)))

    def _proposed(self) -> FloatArray:
        """Return the length of the step that each test tries [passes]; end those with none."""
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

    def _refused(
        self, stack: Stack, failed: dict[int, Exception], steps: FloatArray
    ) -> dict[int, Exception]:
        """Take note of tries that failed, by place; return the errors that end a test."""
        ending: dict[int, Exception] = {}
        for place, error in failed.items():
            number = int(stack.numbers[place])
            try:
                if not isinstance(error, (StepError, ContactError)):
                    raise error
                self._trials[number].refuse(error, float(steps[place]))
            except Exception as final:
                ending[number] = final
        return ending

    def _standing(
        self, stack: Stack, places: IntArray, tried: Attempt, steps: FloatArray
    ) -> IntArray:
        """Return which of the tries at some places stand."""
        stands = [
            self._trials[number].stands(over, step)
            for number, over, step in zip(
                stack.numbers[places].tolist(),
                tried.excess.tolist(),
                steps[places].tolist(),
                strict=True,
            )
        ]
        return np.flatnonzero(stands)

    def _taken(self, path: Path) -> Path | None:
        """Go on from the steps that stand; return those that led to finite values."""
        end = path[-1]
        depth, energy = end.state.cylinder_depth, end.state.energy
        sound = np.isfinite(depth).all(axis=(0, 1, 3)) & np.isfinite(energy)
        failures: dict[int, Exception] = {}
        for (number, passes), ok in zip(end.progress, sound, strict=True):
            trial = self._trials[number]
            self.steps[number] += 1
            self.rejected[number] += trial.rejected
            self._trials[number] = self._trial(trial.proposed)
            if not ok:
                failures[number] = not_finite(passes, {})
        if self.stack is not None:
            self.stack = self.stack.with_others(end)
        self.fail(failures)
        self._end([number for number, passes in end.progress if passes >= self.stop])
        if not failures:
            return path
        kept = np.flatnonzero(sound)
        start, half, end = (one.at(kept) for one in path)
        return (start, half, end) if kept.size else None
