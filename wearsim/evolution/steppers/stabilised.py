"""Stabilised explicit stepper: Runge-Kutta-Legendre steps for any contact model."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import TypeAlias

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Step
from wearsim.evolution.steppers.edges import have_groove
from wearsim.evolution.steppers.forward_euler import decay_rates
from wearsim.evolution.steppers.loads import (
    descents,
    elastic_approaches,
    fresh_approach,
    mean_force,
    mean_loads,
)
from wearsim.evolution.steppers.single_step import (
    contacts_at,
    recovery_at,
    solve_at_present_loads,
    solve_loaded,
    solve_present,
    worn_depths,
    worn_state,
)
from wearsim.evolution.steppers.step_doubling import StepDoublingStepper
from wearsim.types import FloatArray

MIN_STAGES = 3  # with two, profiles that decay within a step are inaccurate
SAFETY = 1.2  # on the greatest decay rate, which is estimated and may grow within the step

# part of a strip by which the edges of a groove advance in a step, and its wear over the elastic
# approach, at most: the pressure in strips that come into contact within longer steps is too high
ADVANCE = 0.5
MOST_WORN = 0.7

#: change of the state in a step or in a part of it: depth of cylinder and rollers [m], and the
#: power of every contact times the part of the step it lasted [W]
Change: TypeAlias = tuple[FloatArray, FloatArray, FloatArray]


def reach(count: int) -> float:
    """Return the longest stable step of `count` stages, times the greatest decay rate.

    It grows with the square of the number of stages; steps of Euler's method reach 2 each.
    """
    return 0.5 * (count * count + count - 2)


def stages_for(decay: float) -> int:
    """Return the least number of stages whose `reach` is `decay`, `MIN_STAGES` at least."""
    return max(MIN_STAGES, math.ceil(0.5 * (math.sqrt(9.0 + 8.0 * decay) - 1.0)))


@lru_cache(maxsize=256)
def legendre_stages(count: int) -> tuple[tuple[float, float, float, float], ...]:
    """Return the weights of `count` stages, two at least; the last stage is the step's end.

    They are the weights of the last stage and of the one before it, and the parts of the step taken
    at the rate of the last stage and at that of the step's start. The start has the weight that is
    left of 1.

    The stability polynomial of the scheme is a shifted Legendre polynomial: profiles that decay
    fast are halved in a step, without change of sign. Chebyshev's polynomial reaches 1.3 times as
    far but damps them much less, and the kink at a contact's edge then causes ripples on the
    profile.

    References
    ----------
    .. [1] C.D. Meyer, D.S. Balsara, T.D. Aslam, A stabilized Runge-Kutta-Legendre method for
       explicit super-time-stepping of parabolic and mixed equations, J. Comput. Phys. 257 (2014)
       594-626, DOI 10.1016/j.jcp.2013.08.021.
    """
    b = [1.0 / 3.0] * 2 + [(j * j + j - 2) / (2.0 * j * (j + 1)) for j in range(2, count + 1)]
    scale = 2.0 / reach(count)
    stages = [(0.0, 0.0, 0.0, b[1] * scale)]
    for j in range(2, count + 1):
        last = (2 * j - 1) / j * b[j] / b[j - 1]
        before_last = -(j - 1) / j * b[j] / b[j - 2]
        stages.append((last, before_last, scale * last, (b[j - 1] - 1.0) * scale * last))
    return tuple(stages)


class StabilisedStepper(StepDoublingStepper):
    """Stepper of second order for any contact model: Runge-Kutta-Legendre method.

    A step of s stages is stable up to s^2/4 times the stability limit of Euler's method. The
    number of stages follows from the greatest decay rate at the start of each step.

    For a scheme of second order the difference to the coarse-step solution is three times the
    error of the test. It is not divided by three: strips that enter the contact cause kinks in
    time, which reduce the order towards one, and then the difference equals the error.
    """

    order = 2

    def proposed(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the step of the step-size control, limited where there is a groove.

        The distance of an edge from the apex of its roller grows as the cubic root of the passes,
        and the worn depth as its square. Without the separation of the surfaces, the pressure at
        the edge is uncertain for any step.
        """
        controlled = super().proposed(problem, state)
        known = state.contacts.separation is not None and np.count_nonzero(state.passes) > 0
        if self.forced_step is not None or not known:
            return controlled
        worn = np.maximum(descents(problem, state.depths), 0.0)
        elastic = elastic_approaches(problem, state)
        apex = problem.nominal_gap.argmin(axis=-1)
        strips = np.abs(np.arange(problem.grid.strips) - apex[..., None])
        loaded = problem.values_of(state.contacts, "line_load") > 0.0
        growth = np.maximum(
            (strips * loaded).max(axis=-1) / ADVANCE, 2.0 * worn / (MOST_WORN * elastic)
        )
        longest = 3.0 * state.passes / growth.max(axis=(0, 1))
        return np.where(have_groove(problem, state), np.minimum(controlled, longest), controlled)

    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return a step for the decay rates at `state`."""
        return partial(stabilised_step, decay=decay_rates(problem, state))


def stabilised_step(
    problem: WearProblem, state: WearState, passes: FloatArray, decay: FloatArray
) -> WearState:
    """Step over `passes` passes with the number of stages that the decay rate requires.

    Every stage is an explicit step on the profiles of the previous one, combined with earlier
    stages. Wear and energy have the same weights, so that Archard's wear law holds to round-off.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    passes : ndarray, shape (realisations,)
        Length of the step.
    decay : ndarray, shape (realisations,)
        Greatest decay rate [1/pass].
    """
    here = problem.at_time(problem.time(state.passes), problem.time(state.passes + passes))
    stages = legendre_stages(stages_for(float((SAFETY * decay * passes).max())))
    before = (
        np.zeros_like(state.cylinder_depth),
        np.zeros_like(state.roller_depth),
        np.zeros(problem.shape),
    )
    solve = solve_present if problem.varying else contacts_at
    elastic, _ = recovery_at(problem, state)
    contacts, first, elastic, solves = _rate(here, state, passes, before, elastic, solve)
    change = _sum((stages[0][3], first))
    for weights in stages[1:]:
        contacts, rate, elastic, more = _rate(
            here, state.replaced(contacts=contacts), passes, change, elastic
        )
        solves += more
        before, change = change, _sum(*zip(weights, (change, before, rate, first), strict=True))
    begun = state.replaced(contacts=contacts, decay=decay)
    depths = _never_negative(change[0]), _never_negative(change[1])
    worn = worn_state(here, begun.with_added(depths), passes, change[2])
    contacts, _, more = solve_at_present_loads(problem, worn, elastic)
    return worn.replaced(
        contacts=contacts, solves=state.solves + (solves + more) * problem.contacts_each
    )


def _rate(
    here: WearProblem,
    state: WearState,
    passes: FloatArray,
    change: Change,
    elastic: FloatArray,
    solve: Callable[[WearProblem, WearState, FloatArray], ContactBatchSolution] = solve_present,
) -> tuple[ContactBatchSolution, Change, FloatArray, int]:
    """Return the contacts on the profiles of a stage, and the change in a whole step with them.

    The load is the mean over the step, with the spring force at the displacement of the stage.

    Parameters
    ----------
    here : WearProblem
        Problem with every process at its mean over the step.
    state : WearState
        State at the step's start, with contacts for the solver to start from.
    passes : ndarray, shape (realisations,)
        Length of the step.
    change : Change
        Change from the start to the stage.
    elastic : ndarray, shape (stations, contacts, realisations)
        Elastic approach of the previous stage [m], zero without a spring.
    solve : callable
        Solves the contacts on the profiles of a state under given loads.

    Returns
    -------
    contacts : ContactBatchSolution
    change : Change
    elastic : ndarray
        Elastic approach of the stage [m].
    solves : int
        Number of solutions of all contacts.
    """
    stage = state.with_added(change[:2])
    loads_at = partial(mean_loads, here, state, passes, contacts=state.contacts)
    fresh = fresh_approach(here, state, mean_force(here, state, passes))
    contacts, _, solves = solve_loaded(here, stage, loads_at, fresh, elastic, solve)
    if here.has_spring:
        elastic = elastic_approaches(here, stage.replaced(contacts=contacts))
    change = *worn_depths(here, contacts, passes), here.values_of(contacts, "power")
    return contacts, change, elastic, solves


def _never_negative(depths: FloatArray) -> FloatArray:
    """Return the depths worn in a step without negative ones, with the same sum over the strips.

    Stages have negative weights, which a strip at the edge of the contact that is loaded in one
    stage alone would follow.
    """
    if not (depths < 0.0).any():
        return depths
    positive = np.maximum(depths, 0.0)
    totals = depths.sum(axis=-1, keepdims=True), positive.sum(axis=-1, keepdims=True)
    return np.asarray(
        positive * np.divide(*totals, out=np.ones_like(totals[0]), where=totals[1] > 0)
    )


def _sum(*terms: tuple[float, Change]) -> Change:
    """Return the weighted sum of changes."""
    cylinder, roller, power = (
        np.sum([weight * change[part] for weight, change in terms], axis=0) for part in range(3)
    )
    return cylinder, roller, power
