"""The explicit stepper: Euler's method, held under its limit of stability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.advance import (
    contacts_at,
    explicit_step,
    mean_loads,
    present_scene,
    solve_present,
)
from wearsim.evolution.control import StepControl
from wearsim.evolution.errors_of_steps import (
    COVER,
    depth_between,
    excess,
    variation_error,
    whole_volume,
    with_pass_errors,
)
from wearsim.evolution.observables import oscillation
from wearsim.evolution.scene import Scene
from wearsim.evolution.state import WearState, contact_values
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
            added = _errors(scene, state, end, step)
            over = excess(self.control, scene, state, end, added, stop)
            chosen = self.control.next_step(step, over)
            if self.forced_step or over <= 1.0:
                break
            rejected += 1
            proposed = min(chosen, 0.7 * step)
        end = with_pass_errors(scene, state, end, end, explicit_step, step)
        added = added + end.irreducible - state.irreducible
        passes = stop if step == left else end.passes
        end = replace(
            end,
            passes=passes,
            coarse=None if end.coarse is None else replace(end.coarse, passes=passes),
            depth_error=state.depth_error + added[0],
            volume_error=state.volume_error + added[1],
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


def _errors(scene: Scene, start: WearState, end: WearState, step: float) -> FloatArray:
    """Return half the difference to a step at the end's wear rate, and the load's spread.

    Shape (2, realisations): depth [m] and volume worn off both bodies [m^3].
    """
    # the processes at their means over the step, as the step itself took them
    here = scene.at_time(scene.time(start.passes), scene.time(start.passes + step))
    gap = here.gap(end.cylinder_depth, end.roller_depth)
    loads = mean_loads(here, start, step, gap, contact_values(here, end.contacts, "power"))
    solve = solve_present if scene.varying else contacts_at
    again = Wearing(here, solve(here, end, loads), step)
    other = replace(
        end,
        cylinder_depth=start.cylinder_depth + again.cylinder,
        roller_depth=start.roller_depth + again.roller,
    )
    volumes = np.abs(whole_volume(scene, end) - whole_volume(scene, other))
    apart = np.array([depth_between(end, other), volumes])
    return COVER * 0.5 * apart + variation_error(scene, end, start.passes, step)


def stability_limit(scene: Scene, state: WearState) -> float:
    """Return the longest explicit step that is stable [passes].

    Power iteration on the change of wear per pass that a change of the gap causes, from the
    alternating shape that is nearly the stiffest; the sensitivity of the load comes from the model.

    Returns
    -------
    float
        2 over the greatest rate of decay, infinite where nothing wears.
    """
    return min(_limit_of(scene, state, v) for v in range(scene.shape[2]))


def _limit_of(scene: Scene, state: WearState, v: int) -> float:
    """Return the limit of realisation `v`: all rollers together on the cylinder they share.

    A roller's own wear is counted as if every roller had the same share of the shape; that can
    only lower the limit.
    """
    scene = present_scene(scene, state)
    gap = scene.gap(state.cylinder_depth, state.roller_depth)
    curvature = scene.kinematics.longitudinal_curvature
    cylinder, roller = scene.wear_per_pass(state.contacts)
    parts = []
    for (s, c, realisation), contact in zip(scene.contacts, state.contacts, strict=True):
        loaded = contact.line_load > 0.0
        wear = cylinder[s, c, v] * scene.cylinder_share[c]
        wear = wear + roller[s, c, v] * scene.weight[c] * scene.kinematics.roller_share
        ratio = np.where(loaded, wear / np.where(loaded, contact.line_load, 1.0), 0.0)
        if realisation == v and ratio.any():
            load = float(contact.line_load.sum() * scene.grid.spacing)
            depths = state.cylinder_depth[s, 0, v], state.roller_depth[0, scene.roller[c], v]
            parts.append((contact, gap[s, c, v], scene.point(c, v, load, *depths), ratio))
    if not parts:
        return np.inf
    anywhere = np.any([contact.line_load > 0.0 for contact, *_ in parts], axis=0)
    shape, rate = np.where(anywhere, (-1.0) ** np.arange(len(anywhere)), 0.0), 0.0
    for _ in range(POWER_ITERATIONS):
        shape /= np.abs(shape).max()
        new = np.zeros_like(shape)
        for contact, gap_here, point, ratio in parts:
            fall = scene.model.load_sensitivity(contact, gap_here, curvature, point, shape)
            new += ratio * fall
        rate = float(np.dot(shape, new) / np.dot(shape, shape))
        shape = new
    return 2.0 / rate if rate > 0.0 else np.inf
