"""Implicit stepper: backward differentiation formulas of variable order and step length."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.errors import ContactError, StepError
from wearsim.evolution.error_estimates import (
    COVER as COVER_OF_DOUBLING,
    greatest_depth,
    with_pass_errors,
)
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers import edges
from wearsim.evolution.steppers.base import Attempt, Step
from wearsim.evolution.steppers.conditions import Conditions, conditions_of, exposure
from wearsim.evolution.steppers.implicit_solution import step_by_formula
from wearsim.evolution.steppers.load_errors import (
    next_steps_of_energy,
    next_steps_of_loads,
    unloading,
)
from wearsim.evolution.steppers.loads import (
    abrupt_loads,
    with_feedback,
)
from wearsim.evolution.steppers.single_step import (
    carried_loads,
    wear_of_contacts,
    wear_per_pass,
)
from wearsim.evolution.steppers.step_doubling import StepDoublingStepper
from wearsim.mechanics.numerics.multistep import MAX_ORDER, ROWS, first_differences, next_steps
from wearsim.mechanics.numerics.step_errors import (
    COVER,
    KEEP,
    PART_EXPONENT,
    SHARE,
    assess_step,
    parts_of_aim,
)
from wearsim.types import BoolArray, FloatArray, IntArray

# the first step, by a power of the tolerance, in units of that of other steppers; it adds a third
# of the allowed error at tolerances from 1e-2 to 1e-5, on the rig and on cams
FIRST, FIRST_EXPONENT = 17.0, 0.8
DOUBLED_SHARE = 0.7  # part of the tolerance that a step may add to the profiles, by step doubling
# least relative error of the energy that step doubling aims at: where the power changes by jumps, a
# smaller one asks for ever shorter steps
LEAST_OF_JUMPS = 1e-4
# factors of volume and profile in the errors that steps aim at; step doubling sums absolute changes
# of the volume, which do not add up
OF_STEPS, DOUBLED = (1.0, COVER[2]), (math.inf, COVER_OF_DOUBLING)
# least part of its usual error that a step aims at, where rows of a log are shorter than a step
LEAST_AIM_OF_ROWS = 0.7


@dataclass(eq=False)
class ImplicitStepper(StepDoublingStepper):
    """Stepper of order one to four that solves the contacts on the profiles at each step's end.

    It is stable for any step length. Order and step length follow from the error that a step adds
    to the profiles, estimated by the next divided difference. The sum of these errors, as far as
    later wear has not reduced them, is the error estimate of the test. Where load or inputs vary,
    and with fixed steps, step doubling estimates it: the next difference misses peaks of a load.

    Parameters
    ----------
    tolerance, forced_step
        As of `Stepper`.
    by_doubling : bool, optional
        Whether step doubling estimates the error: of all tests, where the wear of a contact model
        is not smooth enough for differences, or of none. By default of those whose load or inputs
        vary.
    """

    by_doubling: bool | None = None

    taper = 2.0
    follows_trends = True

    def started(self, problem: WearProblem, state: WearState) -> WearState:
        """Return the state with the rates and differences that the formulas need."""
        if state.past_spans is not None:
            return state
        state = with_rates(problem, state)
        # step doubling compares whole strips
        doubled = self.by_doubling or self.forced_step is not None
        if not doubled and edges.resolves_edges(problem, state.contacts):
            return edges.without_edges(problem, state)
        # local errors do not find those of a lower order in single strips
        counted = problem.varies and not problem.has_nodes
        return edges.with_whole_strips(problem, state) if counted else state

    def first_steps(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the length of the first step, shape (realisations,) [passes]."""
        part = FIRST * math.pow(self.tolerance, FIRST_EXPONENT)
        return part * super().first_steps(problem, state)

    def attempt(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step, estimate its error, and choose order and length of the next one."""
        by_doubling = problem.varies if self.by_doubling is None else self.by_doubling
        if by_doubling or self.forced_step is not None:
            return self._attempt_doubled(problem, state, step, stop, scheme)
        # counted as wholes beside tests that vary, which have left the batch
        whole = state.separation is None and state.part is not None
        if whole and edges.resolves_edges(problem, state.contacts):
            state = edges.without_edges(problem, state)
        end = scheme(problem, state, step)
        if problem.has_nodes:
            end = with_pass_errors(problem, state, end, end, scheme, step)
        if problem.varies and (bias := self.bias(problem, state, end, step)) is not None:
            end = end.with_added(*bias[:2])
        passes = np.where(step == stop - state.passes, stop, end.passes)
        fixed = state.irreducible
        work, order = np.zeros((7, step.size)), np.empty(step.size, np.int64)
        of_next, estimates, displaced, left = work[:2], work[2:5], work[5], work[6]
        self._left(problem, state, stop, OF_STEPS, fixed, left)
        done, contacts, past = passes / stop, end.contacts, end.past
        assert state.stepping_error is not None
        assert end.wear_exponents is not None
        assert end.order is not None
        if problem.has_spring:
            aim, scale = SHARE * self.tolerance, done**PART_EXPONENT / left
            of_loads, their_order, displaced = next_steps_of_loads(problem, end, scale, aim, KEEP)
        errors = assess_step(
            self.tolerance,
            left,
            done,
            step,
            state.passes,
            end.passes,
            state.energy,
            end.energy,
            displaced,
            state.volume_error - fixed[1],
            end.irreducible if problem.has_nodes else fixed,
            state.stepping_error,
            end.stacked,
            end.order,
            past.spans,
            past.wear,
            past.sums,
            past.part,
            past.whole_steps,
            problem.body_rows,
            problem.contact_gap,
            contacts.approach,
            contacts.line_load,
            wear_of_contacts(problem, contacts),
            end.wear_exponents.reshape(contacts.line_load.shape),
            problem.contact_stiffness,
            problem.grid.spacing,
            problem.volume_weights,
            of_next,
            order,
            estimates,
        )
        over, ratio = of_next
        if problem.has_spring:
            order = np.where(of_loads[1] < ratio, their_order, order)
            over, ratio = np.maximum(over, of_loads[0] * left), np.minimum(ratio, of_loads[1])
        end = end.replaced(
            passes=passes,
            steps=state.steps + 1,
            order=order,
            stepping_error=errors,
            depth_error=estimates[0],
            volume_error=estimates[1],
            profile_error=estimates[2],
        )
        if others := end.auxiliary:
            end = end.replaced(
                **{n: other.replaced(order=order, passes=passes) for n, other in others.items()}
            )
        return Attempt((end,), over, ratio)

    def _attempt_doubled(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step as two halves and as a whole; choose order and length of the next one."""
        (half, end), added, _, varies = self.doubled(problem, state, step, stop, scheme)
        past, depths, orders = end.past, end.stacked, np.asarray(end.order)
        errors, order = np.empty_like(depths), np.empty_like(orders)
        most = np.full_like(order, MAX_ORDER)
        left = np.empty(step.size)
        self._left(problem, state, stop, DOUBLED, state.irreducible, left)
        if not problem.varying:  # many rows of a log average out within a step
            left = np.where(varies, np.maximum(left, LEAST_AIM_OF_ROWS), left)
        part = (end.passes / stop) ** PART_EXPONENT / left
        scale = part / (DOUBLED_SHARE * self.tolerance)
        over, ratio = next_steps(
            *(past.wear, past.spans, depths, orders, scale, 1.0, 1.0, most),
            *(np.ones_like(depths), errors, order),
        )
        # local errors miss some of what an abrupt change of wear adds
        allowed = self.tolerance * greatest_depth(end.depths) / part
        beyond = added[0] / np.where(allowed > 0.0, allowed, np.inf)
        over = np.maximum(over, beyond) * left
        ratio = np.where(beyond > 1.0, np.minimum(ratio, self.ratio(beyond)), ratio)
        if self.by_doubling and not problem.varies:
            least = max(self.tolerance, LEAST_OF_JUMPS)
            of_energy, their_order = next_steps_of_energy(half, end, least, KEEP, most)
            order = np.where(of_energy[1] < ratio, their_order, order)
            over, ratio = np.maximum(over, of_energy[0]), np.minimum(ratio, of_energy[1])
        if self.forced_step is not None:  # fixed steps may be too long for higher orders
            order = np.minimum(order, MAX_ORDER - 2)
        others = {name: solution.replaced(order=order) for name, solution in end.auxiliary.items()}
        return Attempt((half, end.replaced(order=order, **others)), over, ratio)

    def _left(
        self,
        problem: WearProblem,
        state: WearState,
        stop: float,
        cover: tuple[float, float],
        fixed: FloatArray,
        left: FloatArray,
    ) -> None:
        """Find the part of its usual error that a step aims at, by the errors before it.

        Parameters
        ----------
        problem : WearProblem
        state : WearState
            State at the start of the step.
        stop : float
            Passes at the end of the test.
        cover : tuple of float
            Safety factors that the errors of volume and profile of the state contain.
        fixed : ndarray, shape (3, realisations)
            `irreducible` of the state.
        left : ndarray, shape (realisations,)
            Result.
        """
        parts_of_aim(
            self.tolerance,
            state.passes / stop,
            *cover,
            state.volume_error,
            state.profile_error,
            fixed,
            state.stacked,
            state.past.separation,
            state.past.part,
            problem.volume_weights,
            left,
        )

    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return the implicit step."""
        return implicit_step

    def whole_step(
        self, problem: WearProblem, start: WearState, step: FloatArray, end: WearState, scheme: Step
    ) -> WearState:
        """Return the solution by a whole step, with first guesses from that by halves."""
        start = start.replaced(wear_exponents=end.wear_exponents)
        return implicit_step(problem, start, step, end.contacts)


def with_rates(problem: WearProblem, state: WearState) -> WearState:
    """Return a state without past points, and with the rates of wear and energy of its contacts."""
    times = problem.time(state.passes)
    here = problem.at_time(times, times)
    force = problem.force(times)
    per_pass = exposure(here, problem, force)
    spans = np.full((ROWS - 1, len(state.passes)), np.inf)
    spans[0] = 0.0
    feedback, error = problem.has_spring or bool(problem.terms), state.stepping_error
    past_feedback = np.zeros((ROWS, *problem.shape)) if feedback else None
    if past_feedback is not None and state.skid_loads is not None:  # a worn cam
        loads = carried_loads(here, state.contacts)
        past_feedback[0] = loads - with_feedback(here, force, np.zeros(()), ())
    if past_feedback is not None and problem.has_spring:
        past_feedback[1] = unloading(here, state, per_pass)
    wear, energy = wear_per_pass(here, state.contacts)
    return state.replaced(
        **dict.fromkeys(edges.FIELDS),
        past_wear=first_differences(wear, per_pass),
        past_sums=first_differences(energy[None], per_pass),
        past_feedback=past_feedback,
        past_spans=spans,
        order=np.ones(len(state.passes), dtype=np.int64),
        wear_exponents=np.ones((*problem.shape, problem.grid.strips)),
        stepping_error=np.zeros_like(state.stacked) if error is None else error,
    )


def implicit_step(
    problem: WearProblem,
    state: WearState,
    passes: FloatArray,
    near: ContactBatchSolution | None = None,
) -> WearState:
    """Step over `passes` passes with the contacts solved on the profiles at the step's end.

    A backward differentiation formula of the order in `state`. Energy changes by the same formula
    as the depths, so that Archard's wear law holds to round-off. Passes are counted one by one: the
    formula is applied to the depths half a pass later, ``u + f/2`` with the wear per pass f, whose
    derivative is f up to terms of second order in f. A step in which a depth or the energy would
    decrease is repeated at second order, and at first order if they still decrease; one that does
    not converge, or in which contact would be lost, at first order on whole strips. A step in which
    the load jumps is of first order. The state returned has the order of its formula. `near` is as
    of `step_by_formula`.

    Raises
    ------
    StepError
        If the iteration for the contacts does not converge, or a roller that is not close to some
        strips wears them.
    """
    if state.past_spans is None:
        state = with_rates(problem, state)
    state = edges.at_start_of_step(problem, state)
    here = (
        problem.at_time(problem.time(state.passes), problem.time(state.passes + passes))
        if problem.varying
        else problem
    )
    conditions = conditions_of(here, problem, state, passes)
    order = state.order
    assert order is not None
    if problem.constant_load is None:  # wear per load and pass is not smooth where the load jumps
        order = np.where(abrupt_loads(problem, state.passes, passes), 1, order)
    step = here, state, passes, conditions
    try:
        end, decreased, unsolved = step_by_formula(*step, order, near)
    except (StepError, ContactError) as error:
        # the past points may lead beyond the depth at which a spring is unloaded, or to a profile
        # on which the contact is not found
        is_edge = getattr(error, "cause", "") == "edge"
        if len(order) > 1 or is_edge or not _has_simpler_step(state, order)[0]:
            raise
        return _step_of_first_order(*step, np.zeros(1, dtype=np.int64))
    if unsolved is not None:
        failed = unsolved.nonzero()[0]
        final = failed[~_has_simpler_step(state, order)[failed]]
        _check_convergence(state, passes, final, unsolved[final])
        end = end.with_others(failed, _step_of_first_order(*step, failed))
        decreased[failed] = False
    several_rollers = problem.shape[1] > 1 and problem.shape[0] == 1
    if several_rollers and end.separation is not None and edges.beyond_edges(state, end).any():
        raise StepError(
            f"a roller carries load beyond its edges after a step from pass {state.passes[0]:.0f}",
            end.to_arrays(),
        )
    # strips that leave the contact: their depth can decrease from the third order on
    for lower in (2, 1) if decreased.nonzero()[0].size else ():
        again: IntArray = (decreased & (np.asarray(end.order) > lower)).nonzero()[0]
        if again.size:
            some, orders = _step_of(*step, again), np.full_like(again, lower)
            part, decreased[again], unsolved = step_by_formula(*some, orders)
            _check_convergence(state, passes, again, unsolved)
            end = end.with_others(again, part)
    return end


def _step_of(
    problem: WearProblem,
    state: WearState,
    passes: FloatArray,
    conditions: Conditions,
    places: IntArray,
) -> tuple[WearProblem, WearState, FloatArray, Conditions]:
    """Return the arguments of `step_by_formula` for some tests of a batch."""
    columns = (column[..., places] for column in vars(conditions).values())
    return problem.at(places), state.at(places), passes[places], Conditions(*columns)


def _has_simpler_step(state: WearState, order: IntArray) -> BoolArray:
    """Return for which tests a step of first order on whole strips differs from the present one."""
    resolved = state.separation is not None and ~edges.unresolved(state)
    return np.asarray((order > 1) | resolved)


def _step_of_first_order(
    problem: WearProblem,
    state: WearState,
    passes: FloatArray,
    conditions: Conditions,
    places: IntArray,
) -> WearState:
    """Return some tests of a batch after steps of first order on whole strips."""
    here, start, lengths, own = _step_of(problem, state, passes, conditions, places)
    if start.separation is not None:
        start = edges.without_edges(here, start)
    end, _, unsolved = step_by_formula(here, start, lengths, own, np.ones_like(places))
    _check_convergence(state, passes, places, unsolved)
    return end


def _check_convergence(
    state: WearState, passes: FloatArray, places: IntArray, unsolved: FloatArray | None
) -> None:
    """Raise StepError if the iteration of some tests of a batch, by place, did not converge."""
    if unsolved is not None and (failed := places[unsolved > 0.0]).size:
        first = failed[0]
        raise StepError(
            f"an implicit step of {passes[first]:.4g} passes from pass {state.passes[first]:.0f}"
            f" did not converge (last relative change {unsolved.max():.1e})",
            state.to_arrays(),
            places=failed.tolist(),
        )
