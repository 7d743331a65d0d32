"""Integration of wear tests, one step after another until each test ends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from wearsim.errors import ContactError, SolverError, StepError
from wearsim.evolution.pauses import at_rest, next_boundaries
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.relocation import located, relocated
from wearsim.evolution.state import WearState, joined_states
from wearsim.evolution.steppers.base import Attempt, Step, Stepper, Trial
from wearsim.evolution.strips import (
    fill_strips,
    free_strips,
    grown,
    identical_strips,
    next_grids,
    on_grid,
)
from wearsim.types import FloatArray, IntArray

T = TypeVar("T")

MOST_WIDENED = 12  # times that strips grow for one step


def bisect_failures(
    work: Callable[[IntArray], T], places: IntArray
) -> tuple[list[tuple[IntArray, T]], dict[int, Exception]]:
    """Process a batch, and parts of it recursively where that raises.

    The parts are the places that have failed, if the exception names them, and the others; or else
    both halves of the batch.

    Parameters
    ----------
    work : callable
        Processes a part of the batch. Its result for a place must not depend on the others.
    places : ndarray of int, shape (places,)
        The batch.

    Returns
    -------
    done : list of tuple
        Places and result of each part.
    failed : dict of int to Exception
        Exception of each place that fails when processed individually.
    """
    if not places.size:
        return [], {}
    try:
        return [(places, work(places))], {}
    except Exception as error:  # any exception ends the test that raised it and no other
        if len(places) == 1:
            return [], {int(places[0]): error}
        named = [place for place in getattr(error, "places", ()) if place < len(places)]
    apart = np.zeros(len(places), dtype=bool)
    apart[named] = True
    if apart.all() or not apart.any():
        apart = np.arange(len(places)) >= len(places) // 2
    first, failed_first = bisect_failures(work, places[~apart])
    second, failed_second = bisect_failures(work, places[apart])
    return first + second, failed_first | failed_second


@dataclass(frozen=True)
class Advance:
    """One accepted step of some tests.

    Parameters
    ----------
    numbers : ndarray of int, shape (realisations,)
        Numbers of the tests.
    problem : WearProblem
        Their problem.
    path : tuple of WearState
        States at the start of the step, at intermediate points if any, and at its end.
    warning : str, optional
        Message to the user about this step.
    """

    numbers: IntArray
    problem: WearProblem
    path: tuple[WearState, ...]
    warning: str | None = None

    @property
    def end(self) -> WearState:
        """The state after the step."""
        return self.path[-1]


class Evolution:
    """Wear tests stepped to their ends together, each with its own step lengths.

    Iteration yields accepted steps. The results of a test are the same to the bit for any tests
    that it is stepped with. A single test is one realisation. Tests whose strips grow wait until
    the others have ended, and are then stepped on together.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
        State of every test at the start.
    stepper : Stepper
    stop : float
        Passes at the end of the tests.
    max_steps : int
        Greatest number of steps of a test; passes solved one by one do not count.
    next_record : callable
        Returns the passes of the first record after given passes; a pass-by-pass stepper stops
        there.

    Attributes
    ----------
    numbers : ndarray of int
        Realisations of the given problem that are in progress.
    problem, state
        Those of the tests in progress.
    failures : dict of int to Exception
        Errors of the tests that failed, by number.
    """

    def __init__(
        self,
        problem: WearProblem,
        state: WearState,
        stepper: Stepper,
        stop: float,
        max_steps: int,
        next_record: Callable[[float], float],
    ) -> None:
        self.problem = located(problem, state)
        self.state, self.stepper = stepper.started(self.problem, state), stepper
        self.stop, self.max_steps, self._next_record = stop, max_steps, next_record
        self.numbers = np.arange(problem.shape[2])
        self.failures: dict[int, Exception] = {}
        self._ended: set[int] = set()
        self._trials: dict[int, Trial] = {}
        self._scheme: Step
        self._first = problem
        self._waiting: list[tuple[IntArray, WearProblem, WearState]] = []
        self._outgrown: set[int] = set()
        self._widened: dict[int, tuple[float, int]] = {}
        self._end_finished()

    def __iter__(self) -> Iterator[Advance]:
        while self.numbers.size or self._waiting:
            if not self.numbers.size:
                self._continue_waiting()
            advance = self._try_steps() if self.numbers.size else None
            if advance is not None:
                yield advance

    def _continue_waiting(self) -> None:
        """Continue the tests that wait on the same strips as the first of them."""
        grid = self._waiting[0][1].grid
        chosen = [identical_strips(problem.grid, grid) for _, problem, _ in self._waiting]
        parts = [part for part, use in zip(self._waiting, chosen, strict=True) if use]
        self._waiting = [part for part, use in zip(self._waiting, chosen, strict=True) if not use]
        (self.numbers, self.problem, self.state), *rest = parts
        if rest:
            numbers = np.concatenate([part for part, _, _ in parts])
            order = np.argsort(numbers)
            self.numbers = numbers[order]
            self.problem = on_grid(self._first.at(self.numbers), grid)
            self.state = joined_states([state for _, _, state in parts]).at(order)
        self._end_finished()

    def _grow(self) -> None:
        """Continue on wider strips with tests whose contacts are close to the outer strips."""
        outgrown: set[int] = set()
        if self._outgrown:
            tests = enumerate(self.numbers.tolist())
            outgrown = {place for place, number in tests if number in self._outgrown}
            self._outgrown.clear()
        grids = next_grids(self.problem, self.state, outgrown)
        if not grids:
            return
        moving = [*grids]
        while moving:
            grid = grids[moving[0]]
            places = np.array([k for k in moving if identical_strips(grids[k], grid)])
            moving = [place for place in moving if place not in places]
            growing = self.problem.at(places), self.state.at(places)
            self._waiting.append((self.numbers[places], *grown(*growing, grid)))
        kept = np.flatnonzero(~np.isin(np.arange(len(self.numbers)), [*grids]))
        self.numbers = self.numbers[kept]
        if kept.size:
            self.problem, self.state = self.problem.at(kept), self.state.at(kept)
        else:
            self._continue_waiting()

    def fail(self, failures: dict[int, Exception]) -> None:
        """End tests, by number, with the errors given."""
        self.failures.update(failures)
        self._end_finished()

    def end(self, numbers: Iterable[int]) -> None:
        """End tests, by number, before their stop."""
        self._ended.update(numbers)
        self._end_finished()

    def _end_finished(self) -> None:
        """Leave only the tests that have neither failed nor ended."""
        some_over = self.failures or self._ended or max(self.state.passes.tolist()) >= self.stop
        if not (self.numbers.size and some_over):
            return
        tests = enumerate(zip(self.numbers.tolist(), self.state.passes.tolist(), strict=True))
        over = self.failures.keys() | self._ended
        going = [k for k, (n, passes) in tests if passes < self.stop and n not in over]
        if len(going) == len(self.numbers):
            return
        kept = np.array(going, dtype=np.int64)
        self.numbers = self.numbers[kept]
        if going:
            self.problem, self.state = self.problem.at(kept), self.state.at(kept)

    def _try_steps(self) -> Advance | None:
        """Try one step of every test in progress; return the accepted ones, if any."""
        self._grow()
        if not self._trials:  # else the state is that before a rejected step
            problem, self.state = relocated(self.problem, self.state)
            if problem is not self.problem:  # stations at skids that wear has moved
                self.problem, self.state = problem, self.stepper.started(problem, self.state)
        lengths = self._lengths()
        if not self.numbers.size:
            return None
        problem, state, scheme, count = self.problem, self.state, self._scheme, lengths.size

        def selected(places: IntArray) -> tuple[WearProblem, WearState, FloatArray]:
            if places.size == count:
                return problem, state, lengths
            return problem.at(places), state.at(places), lengths[places]

        def attempt(places: IntArray) -> Attempt:
            here, start, step = selected(places)
            tried = _finite(self.stepper.attempt(here, start, step, self.stop, scheme))
            return self.stepper.with_damage(here, start, tried) if problem.fatigue else tried

        accepted: list[tuple[IntArray, Sequence[WearState]]] = []
        stepping = np.arange(count)
        if problem.pauses and not self.stepper.pass_by_pass:  # which passes over them itself
            resting = at_rest(problem, state.passes)
            stepping, places = (~resting).nonzero()[0], resting.nonzero()[0]
            if places.size:
                accepted.append((places, self.stepper.rest(*selected(places), self.stop)))
        done, failed = bisect_failures(attempt, stepping)
        failures = self._rejected(failed, lengths) if failed else {}
        for places, tried in done:
            numbers, ratios = self.numbers[places].tolist(), tried.ratio.tolist()
            errors = tried.excess.tolist(), lengths[places].tolist(), ratios
            tests = enumerate(zip(numbers, *errors, strict=True))
            taken = [k for k, (n, *error) in tests if self._trials[n].accepts(*error)]
            if len(taken) == places.size:
                accepted.append((places, tried.path))
            elif taken:
                chosen = np.array(taken)
                accepted.append((places[chosen], [item.at(chosen) for item in tried.path]))
        warning = done[0][1].warning if done else None
        advance = self._continued(accepted, warning) if accepted else None
        if failures:
            self.fail(failures)
        else:
            self._end_finished()
        return advance

    def _lengths(self) -> FloatArray:
        """Return the length of each test's next trial step [passes]; end tests without one."""
        numbers, lengths = self.numbers.tolist(), []
        if not self._trials.keys() >= set(numbers):
            self._scheme = self.stepper.scheme(self.problem, self.state)
            forced = self.stepper.forced_step is not None
            for number, length in zip(
                numbers, self.stepper.proposed(self.problem, self.state).tolist(), strict=True
            ):
                self._trials.setdefault(number, Trial(length, forced, self.stepper.taper))
        failures: dict[int, Exception] = {}
        done, count = self.state.passes.tolist(), self.numbers.size
        stops, resting = [self.stop] * count, [False] * count
        if self.stepper.pass_by_pass:
            stops = [min(self.stop, self._next_record(passes)) for passes in done]
        elif self.problem.pauses:
            stops = np.minimum(self.stop, next_boundaries(self.problem, self.state.passes)).tolist()
            resting = at_rest(self.problem, self.state.passes).tolist()
        for place, (number, passes, steps, stop, rests) in enumerate(
            zip(numbers, done, self.state.steps.tolist(), stops, resting, strict=True)
        ):
            try:
                if steps >= self.max_steps and not self.stepper.pass_by_pass:
                    raise StepError(
                        f"{steps} steps have reached pass {passes:.0f} of {self.stop:.0f};"
                        " raise evolution.max_steps or evolution.tolerance"
                    )
                length = self._trials[number].step(passes, stop)
                lengths.append(stop - passes if rests else length)
            except SolverError as error:
                error.state = error.state or self.state.at(np.array([place])).to_arrays()
                failures[number] = error
        if failures:
            self.fail(failures)
        return np.array(lengths)

    def _rejected(self, failed: dict[int, Exception], lengths: FloatArray) -> dict[int, Exception]:
        """Shorten the steps that failed, by place; return errors of tests that cannot continue."""
        failures: dict[int, Exception] = {}
        for place, error in failed.items():
            number = int(self.numbers[place])
            passes = float(self.state.passes[place])
            edge = getattr(error, "cause", "") == "edge" and free_strips(self.problem)[place]
            # a step that is too long may find a contact anywhere
            if edge and self.stepper.forced_step is None:
                edge = fill_strips(self.state, place)
            before, times = self._widened.get(number, (passes, 0))
            times = times if before == passes else 0
            if edge and times < MOST_WIDENED:  # the step is tried again on wider strips
                self._widened[number] = passes, times + 1
                self._outgrown.add(number)
            elif isinstance(error, (StepError, ContactError)) and self.stepper.forced_step is None:
                self._trials[number].reject(error, float(lengths[place]))
            else:
                failures[number] = error
        return failures

    def _continued(
        self, accepted: list[tuple[IntArray, Sequence[WearState]]], warning: str | None
    ) -> Advance:
        """Continue from accepted steps, given by the places of their tests and their path."""
        (places, (*middle, end)), *others = accepted
        if others:
            places = np.concatenate([part for part, _ in accepted])
            *middle, end = map(joined_states, zip(*(path for _, path in accepted), strict=True))
            if (np.diff(places) < 0).any():  # pauses come first
                order = np.argsort(places)
                places, end = places[order], end.at(order)
                middle = [part.at(order) for part in middle]
        problem, start, numbers = self.problem, self.state, self.numbers
        whole = places.size == numbers.size
        if not whole:
            problem, start, numbers = problem.at(places), start.at(places), numbers[places]
        trials = [self._trials.pop(number) for number in numbers.tolist()]
        end = end.replaced(
            step=np.array([trial.proposed for trial in trials]),
            rejected=end.rejected + np.array([trial.rejected for trial in trials]),
        )
        self.state = end if whole else self.state.with_others(places, end)
        return Advance(numbers, problem, (start, *middle, end), warning)


def _finite(tried: Attempt) -> Attempt:
    """Return a step; raise StepError if it leads to a value that is not finite."""
    end = tried.path[-1]
    # a sum is not finite if one of its terms is not
    if not np.isfinite(np.add.reduce(end.cylinder_depth + end.energy[:, None], axis=None)):
        raise StepError(f"a value is not finite after pass {end.passes[0]:.0f}", end.to_arrays())
    return tried


def evolve(
    problem: WearProblem,
    state: WearState,
    stepper: Stepper,
    stop: float,
    next_record: Callable[[float], float],
    max_steps: int,
) -> Iterator[Advance]:
    """Yield the steps of a single test, with the parameters of `Evolution`.

    Raises
    ------
    SolverError
        If the test fails.
    """
    test = Evolution(problem, state, stepper, stop, max_steps, next_record)
    yield from test
    for error in test.failures.values():
        raise error
