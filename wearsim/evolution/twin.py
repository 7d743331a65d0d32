"""Steps whose error a coarser twin of the test tells: shared by every scheme that takes such."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.control import StepControl
from wearsim.evolution.errors_of_steps import (
    COVER,
    DEPTHS,
    Step,
    biased_twin,
    depth_between,
    excess,
    variation_bias,
    whole_volume,
    with_pass_errors,
)
from wearsim.evolution.scene import Scene
from wearsim.evolution.state import WearState, contact_values
from wearsim.evolution.stepper import Advance, Stepper, fitted
from wearsim.types import FloatArray

SMALLEST_STEP = 1e-3  # passes


class TwinStepper(Stepper):
    """Takes every step in halves, and whole in a twin of the test that is stepped beside it.

    What sets the depths of the two apart is an estimate of the error of the test, with all that
    wear has forgotten of earlier errors. Their volumes may cross while both are wrong: there it is
    the sum of what every step has moved them apart, whatever its sign. What a step adds controls
    its size.

    Parameters
    ----------
    control : StepControl
        Step-size control.
    forced_step : float, optional
        Passes per step, in place of the control's choice.
    """

    #: of the scheme: a step adds an error that grows as the step to the power order + 1
    order: int

    def __init__(self, control: StepControl, forced_step: float | None = None) -> None:
        self.control = control
        self.forced_step = forced_step

    @abstractmethod
    def scheme(self, scene: Scene, state: WearState) -> Step:
        """Return what takes a scene, a state and a number of passes to the state after them.

        It is asked for once at the start `state` of each step, for all that is stepped there.
        """

    def side_step(self, scene: Scene, state: WearState, passes: float) -> WearState:
        """Return the state `passes` passes later, in one step."""
        return self.scheme(scene, state)(scene, state, passes)

    def advance(self, scene: Scene, state: WearState, stop: float) -> Advance:
        """Take one step, shortened until what it adds to the error is allowed."""
        twin, scheme = state.shadow or state, self.scheme(scene, state)
        proposed = self.forced_step or state.step or _first_step(scene, state)
        rejected, cause = state.rejected, None
        while proposed >= SMALLEST_STEP:
            left = stop - state.passes
            step = min(proposed, left) if self.forced_step else fitted(proposed, left)
            try:
                half = scheme(scene, state, 0.5 * step)
                end = scheme(scene, half, 0.5 * step)
                whole = scheme(scene, twin, step)
                end = with_pass_errors(scene, state, end, whole, scheme, step)
                bias = variation_bias(scene, end, state.passes, step)
                whole = biased_twin(end, whole, bias)
            except (StepError, ContactError) as failure:
                if self.forced_step:
                    raise
                cause, rejected, proposed = failure, rejected + 1, 0.2 * step
                continue
            moved = _moved_apart(scene, (state, twin), (end, whole))
            end = replace(
                end,
                passes=stop if step == left else end.passes,
                steps=state.steps + 1,
                rejected=rejected,
                solves=end.solves + whole.solves - twin.solves,
            )
            end = _with_errors(state, end, whole, moved[1])
            reached = np.array([end.depth_error, end.volume_error]) - end.irreducible
            over = excess(self.control, scene, state, end, moved, stop, reached)
            chosen = self.control.next_step(step, over, self.order)
            if self.forced_step or over <= 1.0:
                # a step cut short by the stop says little about how long the next may be
                chosen = max(chosen, proposed) if step < proposed else chosen
                end = replace(end, step=self.forced_step or chosen)
                return Advance(path=(state, half, end))
            rejected += 1
            proposed = min(chosen, 0.7 * step)
        if isinstance(cause, ContactError):
            raise cause
        raise StepError(
            f"no step is short enough at pass {state.passes:.0f} (tried down to"
            f" {SMALLEST_STEP:g} passes); {cause or 'the error does not fall with the step'}",
            state.to_arrays(),
        )


def _moved_apart(
    scene: Scene, before: tuple[WearState, WearState], after: tuple[WearState, WearState]
) -> FloatArray:
    """Return how far a step moves a test and its twin apart, in depth and volume.

    Shape (2, realisations): [m] and [m^3], with the factor for safety.
    """
    moved = tuple(getattr(before[0], name) - getattr(before[1], name) for name in DEPTHS)
    volumes = [whole_volume(scene, one) - whole_volume(scene, two) for one, two in (before, after)]
    return COVER * np.array([depth_between(*after, moved), np.abs(volumes[1] - volumes[0])])


def _with_errors(
    start: WearState, end: WearState, whole: WearState, volume_apart: FloatArray
) -> WearState:
    """Return `end` with the errors that its twin `whole` and all else tell, and with that twin."""
    others = [state.irreducible for state in (start, end)]
    twins = {
        name: replace(twin, passes=end.passes, shadow=None, coarse=None)
        for name, twin in (("shadow", whole), ("coarse", end.coarse))
        if twin is not None
    }
    return replace(
        end,
        depth_error=COVER * depth_between(end, whole) + others[1][0],
        volume_error=start.volume_error - others[0][1] + volume_apart + others[1][1],
        shadow=twins["shadow"],
        coarse=twins.get("coarse"),
    )


def _first_step(scene: Scene, state: WearState) -> float:
    """Return the passes that wear a tenth of the elastic approach off the fresh contact."""
    cylinder, roller = scene.shared_wear(*scene.wear_per_pass(state.contacts))
    rate = float((cylinder + roller).max())
    gap = scene.gap(state.cylinder_depth, state.roller_depth)
    approach = contact_values(scene, state.contacts, "approach") - gap.min(axis=-1)
    return 0.1 * float(approach.min()) / rate if rate > 0.0 else np.inf
