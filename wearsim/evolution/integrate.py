"""Integration of a wear test: one step after another until the test ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Advance, Stepper


def evolve(
    problem: WearProblem,
    state: WearState,
    stepper: Stepper,
    stop: float,
    next_record: Callable[[float], float],
    max_steps: int,
) -> Iterator[Advance]:
    """Yield the steps from `state` to `stop` passes.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
        State at the start.
    stepper : Stepper
    stop : float
        Passes at the end of the test.
    next_record : callable
        Returns the passes of the first record after given passes; a pass-by-pass stepper stops
        there.
    max_steps : int
        Greatest number of steps; passes solved one by one do not count.

    Raises
    ------
    StepError
        If a value is not finite or `max_steps` is reached.
    """
    while state.passes < stop:
        if state.steps >= max_steps and not stepper.pass_by_pass:
            raise too_many_steps(max_steps, state.passes, stop, state.to_arrays())
        end = min(stop, next_record(state.passes)) if stepper.pass_by_pass else stop
        advance = stepper.advance(problem, state, end)
        state = advance.end
        if not (np.isfinite(state.cylinder_depth).all() and np.isfinite(state.energy).all()):
            raise not_finite(state.passes, state.to_arrays())
        yield advance


def too_many_steps(steps: int, passes: float, stop: float, state: Mapping[str, Any]) -> StepError:
    """Return the error of a test that has reached the greatest number of steps."""
    return StepError(
        f"{steps} steps have reached pass {passes:.0f} of {stop:.0f};"
        " raise evolution.max_steps or evolution.tolerance",
        dict(state),
    )


def not_finite(passes: float, state: Mapping[str, Any]) -> StepError:
    """Return the error of a test with a value that is not finite."""
    return StepError(f"a value is not finite after pass {passes:.0f}", dict(state))
