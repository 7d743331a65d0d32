"""The loop: one step after another until the test is done; it prints nothing and writes nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.scene import Scene
from wearsim.evolution.state import WearState
from wearsim.evolution.stepper import Advance, Stepper


def evolve(
    scene: Scene,
    state: WearState,
    stepper: Stepper,
    stop: float,
    next_record: Callable[[float], float],
    max_steps: int,
) -> Iterator[Advance]:
    """Yield the steps from `state` to `stop` passes.

    Parameters
    ----------
    scene : Scene
    state : WearState
        Where to start.
    stepper : Stepper
    stop : float
        Passes at which the test ends.
    next_record : callable
        Passes of the first record after given passes; a pass-by-pass stepper stops there.
    max_steps : int
        Steps after which the run is given up; passes solved one by one do not count.

    Raises
    ------
    StepError
        If a value is not finite or `max_steps` is reached.
    """
    while state.passes < stop:
        if state.steps >= max_steps and not stepper.pass_by_pass:
            raise StepError(
                f"{max_steps} steps have reached pass {state.passes:.0f} of {stop:.0f};"
                " raise evolution.max_steps or evolution.tolerance",
                state.to_arrays(),
            )
        end = min(stop, next_record(state.passes)) if stepper.pass_by_pass else stop
        advance = stepper.advance(scene, state, end)
        state = advance.end
        if not (np.isfinite(state.cylinder_depth).all() and np.isfinite(state.energy).all()):
            raise StepError(
                f"a value is not finite after pass {state.passes:.0f}", state.to_arrays()
            )
        yield advance
