"""Weights of the Runge-Kutta-Legendre scheme of second order."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import NamedTuple, TypeAlias

import numpy as np

from wearsim.evolution.error_control.error_estimates import Step
from wearsim.evolution.error_control.step_doubling import StepDoublingStepper
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Contacts, WearState
from wearsim.evolution.steppers.single_step import (
    contacts_at,
    mean_loads,
    present_loads,
    solve_present,
    worn_state,
)
from wearsim.evolution.steppers.spectral_radius import decay_rates
from wearsim.evolution.steppers.wear_increment import WearIncrement
from wearsim.types import FloatArray

FEWEST = 3  # two are of little accuracy for what decays within a step


class Stage(NamedTuple):
    """Weights of one stage; the step's start has 1 - last - before_last.

    Parameters
    ----------
    last, before_last : float
        Weights of the two stages before.
    rate, start_rate : float
        Parts of the step taken at the rate of the last stage, and at that of the start.
    """

    last: float
    before_last: float
    rate: float
    start_rate: float


def reach(count: int) -> float:
    """Return the longest stable step of `count` stages, times the greatest rate of decay.

    It grows with the square of the stages, where as many steps of Euler's method reach 2 each.
    """
    return 0.5 * (count * count + count - 2)


def stages_for(decay: float) -> int:
    """Return the least number of stages whose `reach` is `decay`, `FEWEST` at least."""
    return max(FEWEST, math.ceil(0.5 * (math.sqrt(9.0 + 8.0 * decay) - 1.0)))


@lru_cache(maxsize=256)
def legendre_stages(count: int) -> tuple[Stage, ...]:
    """Return the weights of `count` stages, two at least; the last stage is the step's end.

    The scheme's stability polynomial is a shifted Legendre polynomial: what decays fast falls by
    about half in a step, without change of sign. Chebyshev's reaches 1.3 times as far, but lets
    much more of it stand, and the kink that a contact's edge makes then sends ripples over the
    profile.

    References
    ----------
    .. [1] C.D. Meyer, D.S. Balsara, T.D. Aslam, A stabilized Runge-Kutta-Legendre method for
       explicit super-time-stepping of parabolic and mixed equations, J. Comput. Phys. 257 (2014)
       594-626, DOI 10.1016/j.jcp.2013.08.021.
    """
    b = [1.0 / 3.0] * 2 + [(j * j + j - 2) / (2.0 * j * (j + 1)) for j in range(2, count + 1)]
    scale = 2.0 / reach(count)
    stages = [Stage(0.0, 0.0, 0.0, b[1] * scale)]
    for j in range(2, count + 1):
        last = (2 * j - 1) / j * b[j] / b[j - 1]
        before_last = -(j - 1) / j * b[j] / b[j - 2]
        stages.append(Stage(last, before_last, scale * last, (b[j - 1] - 1.0) * scale * last))
    return tuple(stages)


SAFETY = 1.2  # on the greatest rate of decay, which is estimated and may grow within the step

#: what a step does, or the part of it up to a stage: depth off cylinder and rollers [m], and the
#: power of every contact times the part of the step it lasted [W]
Change: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]


class StabilisedStepper(StepDoublingStepper):
    """Takes Runge-Kutta-Legendre steps of second order, which ask nothing of a model but solutions.

    A step of s stages reaches s^2/4 as far as a stable step of Euler's method. The greatest rate
    of decay, measured at the start of each step, tells how many stages there must be.

    The twin lies three times the error of the test apart from it. All of that is claimed: where
    strips that enter the contact leave kinks in time the order falls towards the first, and the
    two lie apart by just that error.
    """

    order = 2

    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return a step for the rates of decay at `state`."""
        return partial(stabilised_step, decay=decay_rates(problem, state))


def stabilised_step(
    problem: WearProblem, state: WearState, passes: float, decay: FloatArray
) -> WearState:
    """Step over `passes` passes in as many stages as the rate of decay asks for.

    Every stage is an explicit step on the profiles of the one before, weighted with those before
    it. Wear and energy take the same weights, so that Archard's balance holds to round-off.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    passes : float
        Length of the step.
    decay : ndarray, shape (realisations,)
        Greatest rate of decay [1/pass].
    """
    here = problem.at_time(problem.time(state.passes), problem.time(state.passes + passes))
    stages = legendre_stages(stages_for(SAFETY * float(decay.max()) * passes))
    before = (
        np.zeros_like(state.cylinder_depth),
        np.zeros_like(state.roller_depth),
        np.zeros(problem.shape),
    )
    solve = solve_present if problem.varying else contacts_at
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
    return replace(worn, contacts=solve_present(problem, worn, present_loads(problem, worn)))


def _rate(
    here: WearProblem,
    state: WearState,
    passes: float,
    change: Change,
    solve: Callable[[WearProblem, WearState, FloatArray], Contacts] = solve_present,
) -> tuple[Contacts, Change]:
    """Return the contacts on the profiles of a stage, and what the whole step would do by them.

    The load is the mean over the step, but for its feedback of the descent, which is the stage's.

    Parameters
    ----------
    here : WearProblem
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
    power = here.values_of(state.contacts, "power")
    loads = mean_loads(here, state, passes, ((cylinder, roller),), power)
    stage = replace(state, cylinder_depth=cylinder, roller_depth=roller)
    contacts = solve(here, stage, loads)
    wearing = WearIncrement(here, contacts, passes)
    return contacts, (wearing.cylinder, wearing.roller, here.values_of(contacts, "power"))


def _sum(*terms: tuple[float, Change]) -> Change:
    """Return the weighted sum of changes."""
    cylinder, roller, power = (
        np.sum([weight * change[part] for weight, change in terms], axis=0) for part in range(3)
    )
    return cylinder, roller, power
