"""The explicit stepper: Euler's method, held under its limit of stability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.advance import (
    cylinder_depth_of,
    cylinder_volume_of,
    explicit_step,
)
from wearsim.evolution.control import StepControl
from wearsim.evolution.observables import oscillation
from wearsim.evolution.scene import Scene
from wearsim.evolution.state import WearState
from wearsim.evolution.stepper import Advance, Stepper, fitted
from wearsim.evolution.wearing import Wearing
from wearsim.types import FloatArray

SAFETY = 0.5  # of the limit of stability
OSCILLATING = 0.1  # alternate strips differ by this part of the peak line load
POWER_ITERATIONS = 12


class ExplicitStepper(Stepper):
    """Takes the wear rate of the step's start for the whole step.

    A bump of height h changes the line load by -k h and wear then flattens it at the rate c k per
    pass; the step must stay below 2/(c k) for the stiffest shape the strips can hold.

    Parameters
    ----------
    control : StepControl
        Step-size control; the limit of stability holds besides.
    forced_step : float, optional
        Passes per step, in place of the control's choice.
    allow_unstable : bool
        Let a forced step exceed the limit of stability.
    """

    def __init__(
        self,
        control: StepControl,
        forced_step: float | None = None,
        allow_unstable: bool = False,
    ) -> None:
        self.control = control
        self.forced_step = forced_step
        self.allow_unstable = allow_unstable

    def side_step(self, scene: Scene, state: WearState, passes: float) -> WearState:
        """Return the state `passes` passes later, in one step."""
        return explicit_step(scene, state, passes)

    def advance(self, scene: Scene, state: WearState, stop: float) -> Advance:
        """Take one step, under the limit of stability and within the tolerance."""
        limit = stability_limit(scene, state)
        proposed = self._proposal(state, limit)
        rejected = state.rejected
        while True:
            left = stop - state.passes
            step = min(proposed, left) if self.forced_step else fitted(proposed, left)
            end = explicit_step(scene, state, step)
            in_depth, in_volume = _errors(scene, state, end, step)
            reached = float(cylinder_depth_of(end).max())
            allowed = self.control.allowance(reached, 0.0, 0.0, end.passes / stop)
            excess = float(in_depth.max()) / allowed if allowed > 0.0 else 0.0
            chosen = self.control.next_step(step, excess)
            if self.forced_step or excess <= 1.0:
                break
            rejected += 1
            proposed = min(chosen, 0.7 * step)
        end = replace(
            end,
            passes=stop if step == left else end.passes,
            depth_error=state.depth_error + in_depth,
            volume_error=state.volume_error + in_volume,
            step=self.forced_step or (max(chosen, proposed) if step < proposed else chosen),
            steps=state.steps + 1,
            rejected=rejected,
        )
        return Advance(path=(state, end), warning=_warning(end, step, limit))

    def _proposal(self, state: WearState, limit: float) -> float:
        if self.forced_step is None:
            return min(state.step or np.inf, SAFETY * limit)
        if self.forced_step > limit and not self.allow_unstable:
            raise StepError(
                f"a step of {self.forced_step:g} passes exceeds the limit of stability, which is"
                f" {limit:.4g} passes at pass {state.passes:.0f}; lower evolution.step, set"
                " evolution.stepper = 'implicit', or set evolution.allow_unstable = true to see"
                " what happens",
                state.to_arrays(),
            )
        return self.forced_step


def _warning(end: WearState, step: float, limit: float) -> str | None:
    """Return what to say where the contacts have begun to oscillate."""
    worst = max(oscillation(contact.line_load) for contact in end.contacts)
    if worst < OSCILLATING:
        return None
    return (
        f"unstable: at pass {end.passes:.0f} the line load alternates from strip to strip by"
        f" {worst:.0%} of its peak; the step of {step:.4g} passes is"
        f" {step / limit:.2g} times the limit of stability"
    )


def _errors(
    scene: Scene, start: WearState, end: WearState, step: float
) -> tuple[FloatArray, FloatArray]:
    """Return half the difference to a step at the end's wear rate, in depth and in volume."""
    again = Wearing(scene, end.contacts, step)
    other = replace(end, cylinder_depth=start.cylinder_depth + again.cylinder)
    in_depth = 0.5 * np.abs(cylinder_depth_of(end) - cylinder_depth_of(other))
    in_volume = cylinder_volume_of(scene, end) - cylinder_volume_of(scene, other)
    return in_depth, 0.5 * np.abs(in_volume)


def stability_limit(scene: Scene, state: WearState) -> float:
    """Return the longest explicit step that is stable [passes].

    Power iteration on the change of wear per pass that a change of the gap causes, from the
    alternating shape that is nearly the stiffest; the sensitivity of the load comes from the model.

    Returns
    -------
    float
        2 over the greatest rate of decay, infinite where nothing wears.
    """
    gap = scene.gap(state.cylinder_depth, state.roller_depth)
    curvature = scene.kinematics.longitudinal_curvature
    cylinder, roller = scene.wear_per_pass(state.contacts)
    greatest = 0.0
    for number, index in enumerate(scene.contacts):
        contact = state.contacts[number]
        s, r, v = index
        point = scene.point(
            r,
            float(contact.line_load.sum() * scene.grid.spacing),
            state.cylinder_depth[s, 0, v],
            state.roller_depth[0, r, v],
        )
        loaded = contact.line_load > 0.0
        wear = cylinder[index] + roller[index] * scene.kinematics.roller_share
        ratio = np.where(loaded, wear / np.where(loaded, contact.line_load, 1.0), 0.0)
        if not ratio.any():
            continue
        shape = np.where(loaded, (-1.0) ** np.arange(len(loaded)), 0.0)
        rate = 0.0
        for _ in range(POWER_ITERATIONS):
            shape /= np.abs(shape).max()
            fall = scene.model.load_sensitivity(contact, gap[index], curvature, point, shape)
            new = ratio * fall
            rate = float(np.dot(shape, new) / np.dot(shape, shape))
            shape = new
        greatest = max(greatest, rate)
    return 2.0 / greatest if greatest > 0.0 else np.inf
