"""The stabilised stepper: explicit steps of as many stages as stability asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np

from wearsim.evolution.advance import (
    contacts_at,
    mean_loads,
    present_loads,
    solve_present,
    worn_state,
)
from wearsim.evolution.errors_of_steps import Step
from wearsim.evolution.legendre import legendre_stages, stages_for
from wearsim.evolution.scene import Scene
from wearsim.evolution.stability import decay_rates
from wearsim.evolution.state import Contacts, WearState, contact_values
from wearsim.evolution.twin import TwinStepper
from wearsim.evolution.wearing import Wearing
from wearsim.types import FloatArray

SAFETY = 1.2  # on the greatest rate of decay, which is estimated and may grow within the step
#: what a step does, or the part of it up to a stage: depth off cylinder and rollers [m], and the
#: power of every contact times the part of the step it lasted [W]
Change: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]


class StabilisedStepper(TwinStepper):
    """Takes Runge-Kutta-Legendre steps of second order, which ask nothing of a model but solutions.

    A step of s stages reaches s^2/4 as far as a stable step of Euler's method. The greatest rate
    of decay, measured at the start of each step, tells how many stages there must be.

    The twin lies three times the error of the test apart from it. All of that is claimed: where
    strips that enter the contact leave kinks in time the order falls towards the first, and the
    two lie apart by just that error.
    """

    order = 2

    def scheme(self, scene: Scene, state: WearState) -> Step:
        """Return a step for the rates of decay at `state`."""
        return partial(stabilised_step, decay=decay_rates(scene, state))


def stabilised_step(scene: Scene, state: WearState, passes: float, decay: FloatArray) -> WearState:
    """Step over `passes` passes in as many stages as the rate of decay asks for.

    Every stage is an explicit step on the profiles of the one before, weighted with those before
    it. Wear and energy take the same weights, so that Archard's balance holds to round-off.

    Parameters
    ----------
    scene : Scene
    state : WearState
    passes : float
        Length of the step.
    decay : ndarray, shape (realisations,)
        Greatest rate of decay [1/pass].
    """
    here = scene.at_time(scene.time(state.passes), scene.time(state.passes + passes))
    stages = legendre_stages(stages_for(SAFETY * float(decay.max()) * passes))
    before = (
        np.zeros_like(state.cylinder_depth),
        np.zeros_like(state.roller_depth),
        np.zeros(scene.shape),
    )
    solve = solve_present if scene.varying else contacts_at
    contacts, first = _rate(here, state, passes, before, solve)
    solves = len(stages) * len(contacts)
    solves += 0 if contacts is state.contacts else len(contacts)
    change = _sum((stages[0].start_rate, first))
    for stage in stages[1:]:
        contacts, rate = _rate(here, replace(state, contacts=contacts), passes, change)
        weighted = (
            (stage.last, change),
            (stage.before_last, before),
            (stage.rate, rate),
            (stage.start_rate, first),
        )
        before, change = change, _sum(*weighted)
    begun = replace(state, contacts=contacts, solves=state.solves + solves, decay=decay)
    ends = state.cylinder_depth + change[0], state.roller_depth + change[1]
    worn = worn_state(here, begun, passes, ends, change[2])
    return replace(worn, contacts=solve_present(scene, worn, present_loads(scene, worn)))


def _rate(
    here: Scene,
    state: WearState,
    passes: float,
    change: Change,
    solve: Callable[[Scene, WearState, FloatArray], Contacts] = solve_present,
) -> tuple[Contacts, Change]:
    """Return the contacts on the profiles of a stage, and what the whole step would do by them.

    The load is the mean over the step, but for its feedback of the descent, which is the stage's.

    Parameters
    ----------
    here : Scene
        With every process at its mean over the step.
    state : WearState
        The step's start, with contacts nearby.
    passes : float
        Length of the step.
    change : Change
        From the start to the stage.
    solve : callable
        Solves the contacts on the profiles of a state under given loads.
    """
    cylinder, roller = state.cylinder_depth + change[0], state.roller_depth + change[1]
    power = contact_values(here, state.contacts, "power")
    loads = mean_loads(here, state, passes, ((cylinder, roller),), power)
    stage = replace(state, cylinder_depth=cylinder, roller_depth=roller)
    contacts = solve(here, stage, loads)
    wearing = Wearing(here, contacts, passes)
    return contacts, (wearing.cylinder, wearing.roller, contact_values(here, contacts, "power"))


def _sum(*terms: tuple[float, Change]) -> Change:
    """Return the weighted sum of changes."""
    cylinder, roller, power = (
        np.sum([weight * change[part] for weight, change in terms], axis=0) for part in range(3)
    )
    return cylinder, roller, power
