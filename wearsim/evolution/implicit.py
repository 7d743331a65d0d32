"""The implicit stepper: backward Euler by contact with wear compliance, error by a coarser twin."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.advance import (
    cylinder_depth_of,
    cylinder_volume_of,
    implicit_step,
    present_loads,
)
from wearsim.evolution.control import StepControl
from wearsim.evolution.scene import Scene
from wearsim.evolution.state import WearState, contact_values
from wearsim.evolution.stepper import Advance, Stepper, fitted
from wearsim.types import FloatArray

SMALLEST_STEP = 1e-3  # passes
COVER = 1.5  # a first-order scheme's twin differs by the error itself; half as much for safety
DEPTH_EXPONENT, VOLUME_EXPONENT = 0.5, 0.75  # below those of any groove: 2/3 to 1, and about 1
DEEP = 0.5  # depths are compared where the groove is deeper than this part of its depth


Pair: TypeAlias = tuple[WearState, WearState]  # a test and its twin


class ImplicitStepper(Stepper):
    """Takes every step in halves, and whole in a twin of the test that is stepped beside it.

    The two differ by about the error of the test, with all that wear has forgotten of earlier
    errors; `COVER` times that is the estimate. What a step adds to the difference controls its
    size.

    Parameters
    ----------
    control : StepControl
        Step-size control.
    forced_step : float, optional
        Passes per step, in place of the control's choice.
    """

    def __init__(self, control: StepControl, forced_step: float | None = None) -> None:
        self.control = control
        self.forced_step = forced_step

    def side_step(self, scene: Scene, state: WearState, passes: float) -> WearState:
        """Return the state `passes` passes later, in one step."""
        return implicit_step(scene, state, passes)

    def advance(self, scene: Scene, state: WearState, stop: float) -> Advance:
        """Take one step, shortened until what it adds to the error is allowed."""
        twin = state.shadow or state
        proposed = self.forced_step or state.step or _first_step(scene, state)
        rejected, cause = state.rejected, None
        while proposed >= SMALLEST_STEP:
            left = stop - state.passes
            step = min(proposed, left) if self.forced_step else fitted(proposed, left)
            try:
                half = implicit_step(scene, state, 0.5 * step)
                end = implicit_step(scene, half, 0.5 * step)
                whole = implicit_step(scene, twin, step)
            except (StepError, ContactError) as failure:
                if self.forced_step:
                    raise
                cause, rejected, proposed = failure, rejected + 1, 0.2 * step
                continue
            spread = _load_spread(scene, state, end)
            excess = self._excess(scene, (state, twin), (end, whole), spread, stop)
            if self.forced_step or excess <= 1.0:
                chosen = self.control.next_step(step, excess)
                # a step cut short by the stop says little about how long the next may be
                chosen = max(chosen, proposed) if step < proposed else chosen
                passes = stop if step == left else end.passes
                end = replace(
                    end,
                    passes=passes,
                    depth_error=_depth_error(end, whole) + spread,
                    volume_error=COVER * np.abs(_volume_gap(scene, end, whole)),
                    step=self.forced_step or chosen,
                    steps=state.steps + 1,
                    rejected=rejected,
                    solves=end.solves + whole.solves - twin.solves,
                    shadow=replace(whole, passes=passes, shadow=None),
                )
                return Advance(path=(state, half, end))
            rejected += 1
            proposed = min(self.control.next_step(step, excess), 0.7 * step)
        if isinstance(cause, ContactError):
            raise cause
        raise StepError(
            f"no step is short enough at pass {state.passes:.0f} (tried down to"
            f" {SMALLEST_STEP:g} passes); {cause or 'the error does not fall with the step'}",
            state.to_arrays(),
        )

    def _excess(self, scene: Scene, start: Pair, end: Pair, spread: float, stop: float) -> float:
        """Return what a step adds to the errors of depth and volume over what it may add."""
        part = end[0].passes / stop
        reached = float(cylinder_depth_of(end[0]).max())
        spent = float(start[0].depth_error.max())
        allowed = self.control.allowance(reached, DEPTH_EXPONENT, spent, part)
        added = COVER * (_distance(*start, *end) + spread)
        if reached <= 0.0:
            return 0.0
        volume = cylinder_volume_of(scene, end[0])
        spent = float(start[0].volume_error.max())
        in_volume = self.control.allowance(float(volume.max()), VOLUME_EXPONENT, spent, part)
        apart = _volume_gap(scene, *end) - _volume_gap(scene, *start)
        return max(added / allowed, COVER * float(np.abs(apart).max()) / in_volume)


def _first_step(scene: Scene, state: WearState) -> float:
    """Return the passes that wear a tenth of the elastic approach off the fresh contact."""
    cylinder, roller = scene.shared_wear(*scene.wear_per_pass(state.contacts))
    rate = float((cylinder + roller).max())
    gap = scene.gap(state.cylinder_depth, state.roller_depth)
    approach = contact_values(scene, state.contacts, "approach") - gap.min(axis=-1)
    return 0.1 * float(approach.min()) / rate if rate > 0.0 else np.inf


def _distance(start: WearState, twin: WearState, end: WearState, whole: WearState) -> float:
    """Return how much a step has moved test and twin apart, where the grooves are deep [m]."""
    moved = 0.0
    for name in ("cylinder_depth", "roller_depth"):
        worn: FloatArray = getattr(end, name)
        before = getattr(start, name) - getattr(twin, name)
        change = np.abs(worn - getattr(whole, name) - before)
        moved = max(moved, float(change[worn >= DEEP * worn.max()].max()))
    return moved


def _depth_error(end: WearState, whole: WearState) -> FloatArray:
    """Return the estimated error of the cylinder's depth, shape (realisations,) [m]."""
    worn = end.cylinder_depth
    apart = np.abs(worn - whole.cylinder_depth)
    deep = worn >= DEEP * worn.max(axis=(0, 1, 3), keepdims=True)
    greatest: FloatArray = np.where(deep, apart, 0.0).max(axis=(0, 1, 3))
    return COVER * greatest


def _volume_gap(scene: Scene, end: WearState, whole: WearState) -> FloatArray:
    return cylinder_volume_of(scene, end) - cylinder_volume_of(scene, whole)


def _load_spread(scene: Scene, start: WearState, end: WearState) -> float:
    """Return the error of depth that the load's variation within the step can make [m].

    Wear follows the line load, which is no linear function of the load: with q ~ N^(2/3) at
    the centre of a fresh contact, the mean of q differs from q of the mean by a ninth of the
    load's relative variance. A worn, conformal contact is more nearly linear.
    """
    first, last = scene.time(start.passes), scene.time(end.passes)
    middle = 0.5 * (first + last)
    halves = scene.load.deviation(first, middle), scene.load.deviation(middle, last)
    if halves == (0.0, 0.0):
        return 0.0
    variance = 0.5 * (halves[0] ** 2 + halves[1] ** 2)
    smallest = float(present_loads(scene, end).min())
    grown = float((cylinder_depth_of(end) - cylinder_depth_of(start)).max())
    return variance / smallest**2 / 9.0 * grown
