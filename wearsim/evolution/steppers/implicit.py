"""Implicit stepper: backward differentiation formulas of variable order and step length."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.error_estimates import (
    COVER as COVER_OF_DOUBLING,
    DEPTH_EXPONENT,
    VOLUME_EXPONENT,
    greatest_depth,
    with_pass_errors,
)
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, joined_states
from wearsim.evolution.steppers import edges
from wearsim.evolution.steppers.base import Attempt, Step, joined_attempts
from wearsim.evolution.steppers.conditions import Conditions, conditions_of, exposure
from wearsim.evolution.steppers.implicit_solution import EndOfStep
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
    energy_per_pass,
    volumes_of,
    wear_per_pass,
)
from wearsim.evolution.steppers.step_doubling import StepDoublingStepper
from wearsim.mechanics.numerics.jit import kernel_input
from wearsim.mechanics.numerics.linearised_wear import carried_errors
from wearsim.mechanics.numerics.multistep import (
    MAX_ORDER,
    ROWS,
    extrapolated,
    first_differences,
    formulas,
    new_differences,
    next_steps,
)
from wearsim.types import BoolArray, FloatArray, IntArray

# part of the tolerance that a step may add to the profiles, by differences and by step doubling
SHARE, DOUBLED_SHARE = 0.35, 0.9
COVER = np.array([[4.0], [2.0], [6.0]])  # safety factors on the errors of depth, volume, profile
# least errors of depth and profile, over that of the volume, all relative and with their factors: a
# groove of wrong volume has the wrong depth and width, which further wear does not correct
OF_VOLUME = 0.33, 0.5
# of a step at a lower order, compared with other orders: the differences that a step leaves are
# less smooth after a change of order; where inputs vary they are not smooth at any order
KEEP = 0.9
PART_EXPONENT = 0.25  # early errors decay: they may be greater, by this power of the passes done
# safety factors on local errors of strips that the edge crosses, and on errors of depth and volume
EDGES, OF_EDGES = 8.0, 3.0
# factors of volume and profile in the errors that steps aim at; step doubling sums absolute changes
# of the volume, which do not add up
OF_STEPS, DOUBLED = (1.0, float(COVER[2, 0])), (math.inf, COVER_OF_DOUBLING)
# the error that a step aims at falls where the errors so far, over the tolerance, exceed the first
# number, to a least part of itself at the second one
ADDED_UP, LEAST_AIM = (0.75, 1.5), 0.1
LEAST_AIM_OF_ROWS = 0.7  # the same where rows of a log are shorter than a step
WHOLE_PASSES = 2.0  # steps above which passes are counted one by one


_PAST = attrgetter("past_wear", "past_sums", "past_feedback", "past_spans", "order")


class Past(NamedTuple):
    """Rates, differences and past points of a state; see `WearState`."""

    wear: FloatArray
    sums: FloatArray
    feedback: FloatArray | None
    spans: FloatArray
    order: IntArray

    @classmethod
    def of(cls, state: WearState) -> Past:
        """Return those of a state of the implicit stepper."""
        return cls(*_PAST(state))


class ImplicitStepper(StepDoublingStepper):
    """Stepper of order one to four that solves the contacts on the profiles at each step's end.

    It is stable for any step length. Order and step length follow from the error that a step adds
    to the profiles, estimated by the next divided difference. The sum of these errors, as far as
    later wear has not reduced them, is the error estimate of the test. Where load or inputs vary,
    and with fixed steps, step doubling estimates it.

    Parameters
    ----------
    tolerance, forced_step
        As of `Stepper`.
    by_doubling : bool
        Whether step doubling estimates the error of all tests: the wear of a contact model may not
        be smooth enough for differences.
    """

    taper = 4.0
    follows_trends = True

    def __init__(
        self, tolerance: float, forced_step: float | None = None, by_doubling: bool = False
    ) -> None:
        super().__init__(tolerance, forced_step)
        self.by_doubling = by_doubling

    def started(self, problem: WearProblem, state: WearState) -> WearState:
        """Return the state with the rates and differences that the formulas need."""
        if state.past_spans is not None:
            return state
        state = with_rates(problem, state)
        resolved = self._resolves(problem, state)
        return edges.with_unresolved_edges(problem, state) if resolved else state

    def _resolves(self, problem: WearProblem, state: WearState) -> bool:
        """Return whether edges of contacts are resolved; step doubling compares whole strips."""
        doubled = self.by_doubling or self.forced_step is not None
        return not doubled and edges.resolves_edges(problem, state.contacts)

    def first_steps(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the length of the first step, shape (realisations,) [passes]."""
        return math.sqrt(self.tolerance) * super().first_steps(problem, state)

    def attempt(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step, estimate its error, and choose order and length of the next one."""
        state = edges.on_strips(problem, state)
        if state.part is None and self._resolves(problem, state):
            state = edges.with_unresolved_edges(problem, state)
        if state.part is None:
            return self._attempt(problem, state, step, stop, scheme)
        attempts, places = [], []
        for some, here, start in edges.by_resolution(problem, state):
            tried = self._attempt(here, start, step[some], stop, scheme)
            if tried.path[-1].part is None:
                ends = tuple(edges.with_unresolved_edges(here, end) for end in tried.path)
                tried = replace(tried, path=ends)
            attempts.append(tried)
            places.append(some)
        return joined_attempts(attempts, places)

    def _attempt(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step in tests that all resolve edges or all do not."""
        varies = problem.constant_load is None or len(problem.varying) > 0
        # local errors miss peaks of a load
        if varies or self.by_doubling or self.forced_step is not None:
            return self._attempt_doubled(problem, state, step, stop, scheme)
        end = scheme(problem, state, step)
        if end.part is not None and edges.unresolved(end).all():
            end = edges.without_edges(end)
        end = with_pass_errors(problem, state, end, end, scheme, step)
        passes = np.where(step == stop - state.passes, stop, end.passes)
        past, depths = Past.of(end), end.stacked
        own, order = np.empty_like(depths), np.empty_like(past.order)
        left = self._left(problem, state, stop, OF_STEPS)
        marked = edges.marked_strips(end)
        parts = np.ones_like(depths) if marked is None else marked.weights
        part, aim = (passes / stop) ** PART_EXPONENT / left, SHARE * self.tolerance
        over, ratio = next_steps(
            *(past.wear, past.spans, depths, past.order, part, aim, KEEP, edges.most(end)),
            *(parts, own, order),
        )
        # without half a pass, the wear of a pass is that after it instead of before it
        if step.min() <= WHOLE_PASSES:
            own *= np.where(step > WHOLE_PASSES, 1.0, 2.0)[:, None]
        displaced = None
        if problem.has_spring:
            of_loads, their_order, displaced = next_steps_of_loads(problem, end, part, aim, KEEP)
            order = np.where(of_loads[1] < ratio, their_order, order)
            over, ratio = np.maximum(over, of_loads[0]), np.minimum(ratio, of_loads[1])
        over = over * left  # it shortens the next step
        of_energy, their_order = next_steps_of_energy(
            state, end, self.tolerance, KEEP, edges.most(end)
        )
        order = np.where(of_energy[1] < ratio, their_order, order)
        over, ratio = np.maximum(over, of_energy[0]), np.minimum(ratio, of_energy[1])
        others = {n: one.replaced(order=order, passes=passes) for n, one in end.auxiliary.items()}
        end = end.replaced(
            passes=passes,
            steps=state.steps + 1,
            order=order,
            **_estimates(problem, state, end, depths, own, step, displaced, marked),
            **others,
        )
        return Attempt((end,), over, ratio)

    def _attempt_doubled(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step as two halves and as a whole; choose order and length of the next one."""
        doubled = self.doubled(problem, state, step, stop, scheme)
        half, end = doubled.path
        past, depths = Past.of(end), end.stacked
        own, order = np.empty_like(depths), np.empty_like(past.order)
        left = self._left(problem, state, stop, DOUBLED)
        if not problem.varying:  # many rows of a log average out within a step
            left = np.where(doubled.varies, np.maximum(left, LEAST_AIM_OF_ROWS), left)
        part = (end.passes / stop) ** PART_EXPONENT / left
        scale = part / (DOUBLED_SHARE * self.tolerance)
        over, ratio = next_steps(
            *(past.wear, past.spans, depths, past.order, scale, 1.0, 1.0, edges.most(end)),
            *(np.ones_like(depths), own, order),
        )
        # local errors miss some of what an abrupt change of wear adds
        allowed = self.tolerance * greatest_depth(end.depths) / part
        added = doubled.added[0] / np.where(allowed > 0.0, allowed, np.inf)
        over = np.maximum(over, added)
        ratio = np.where(added > 1.0, np.minimum(ratio, self.ratio(added)), ratio)
        unknown = np.isinf(past.spans[1])
        if unknown.any():
            excess = self.excess(problem, state, doubled, stop)
            over, ratio = np.where(unknown, (excess, self.ratio(excess)), (over, ratio))
        over = np.where(unknown, over, over * left)
        if self.forced_step is not None:  # fixed steps may be too long for higher orders
            order = np.minimum(order, MAX_ORDER - 2)
        others = {name: one.replaced(order=order) for name, one in end.auxiliary.items()}
        return Attempt((half, end.replaced(order=order, **others)), over, ratio)

    def _left(
        self, problem: WearProblem, state: WearState, stop: float, cover: Sequence[float]
    ) -> FloatArray:
        """Return the part of its usual error that a step aims at, by the errors before it, (N,).

        Errors of the volume add up during a test if they have the same sign.

        Parameters
        ----------
        problem : WearProblem
        state : WearState
            State at the start of the step.
        stop : float
            Passes at the end of the test.
        cover : sequence of float
            Safety factors that the errors of volume and profile of the state contain.
        """
        volumes = volumes_of(problem, state.stacked).tolist()
        _, *fixed = state.irreducible
        errors = (state.volume_error - fixed[0]).tolist(), (state.profile_error - fixed[1]).tolist()
        low, high = ADDED_UP
        found = []
        columns = state.passes.tolist(), volumes, *errors
        for passes, volume, of_volume, of_profile in zip(*columns, strict=True):
            grown, worst = passes / stop, 0.0
            if volume > 0.0:
                worst = of_volume / (volume * cover[0]) * grown**VOLUME_EXPONENT
                worst = max(worst, of_profile / cover[1] * grown**DEPTH_EXPONENT)
            part = (high - worst / self.tolerance) / (high - low)
            found.append(min(max(part, LEAST_AIM), 1.0))
        return np.array(found)

    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return the implicit step."""
        return implicit_step


def _estimates(
    problem: WearProblem,
    start: WearState,
    end: WearState,
    depths: FloatArray,
    added: FloatArray,
    passes: FloatArray,
    displaced: FloatArray | None,
    marked: edges.MarkedStrips | None,
) -> dict[str, FloatArray]:
    """Return the error estimates at the end of a step, by their names in `WearState`.

    Parameters
    ----------
    problem : WearProblem
    start, end : WearState
        States before and after the step.
    depths, added : ndarray
        Depths of the end, and error that the step adds to them, as `WearState.stacked` [m].
    passes : ndarray, shape (realisations,)
        Length of the step.
    displaced : ndarray, shape (realisations,), optional
        Displacement of a roller that the error of its load corresponds to [m].
    marked : MarkedStrips, optional
        Strips of the end, where edges are resolved.
    """
    contacts, shape = end.contacts, end.contacts.line_load.shape
    stiffness = np.zeros(shape[0])
    if problem.has_spring:
        stiffness = np.broadcast_to(problem.stiffness, problem.shape).flatten()
    errors, sizes = carried_errors(
        np.asarray(start.stepping_error),
        added if marked is None else edges.with_sum(end, added, marked),
        contacts.line_load,
        problem.wear_parts(contacts, passes).reshape(2, *shape),
        np.asarray(end.wear_exponents).reshape(shape),
        contacts.approach,
        kernel_input(problem.nominal_gap).reshape(shape),
        depths,
        problem.body_rows,
        stiffness,
        problem.grid.spacing,
        problem.volume_weights,
    )
    if displaced is not None:  # a stiff spring holds the depth, and errors of its load remain
        sizes[0] += displaced
        sizes[2] += displaced / np.where(displaced > 0.0, greatest_depth(end.depths), 1.0)
    if marked is not None:
        of_first_order = edges.first_order_errors(end, marked.young)
        at_edges = EDGES * (np.where(marked.crossed, added, 0.0) + of_first_order)
        sizes[2] = np.hypot(sizes[2], edges.relative_size(at_edges, depths))
        sizes[:2] *= OF_EDGES
    found = COVER * sizes
    found[1] += start.volume_error - start.irreducible[1]  # the error may cross zero
    worn = volumes_of(problem, depths)
    relative = found[1] / np.where(worn > 0.0, worn, np.inf)
    found[0] = np.maximum(found[0], OF_VOLUME[0] * relative * depths.max(axis=(0, 2)))
    found[2] = np.maximum(found[2], OF_VOLUME[1] * relative)
    depth, volume, profile = found + end.irreducible
    return {
        "stepping_error": errors,
        "depth_error": depth,
        "volume_error": volume,
        "profile_error": profile,
    }


def with_rates(problem: WearProblem, state: WearState) -> WearState:
    """Return a state without past points, and with the rates of wear and energy of its contacts."""
    times = problem.time(state.passes)
    here = problem.at_time(times, times)
    force = problem.force(times)
    own = exposure(here, problem, force)
    spans = np.full((ROWS - 1, len(state.passes)), np.inf)
    spans[0] = 0.0
    feedback, error = problem.has_spring or bool(problem.terms), state.stepping_error
    past_feedback = np.zeros((ROWS, *problem.shape)) if feedback else None
    if past_feedback is not None and state.skid_loads is not None:  # a worn cam
        loads = carried_loads(here, state.contacts)
        past_feedback[0] = loads - with_feedback(here, force, np.zeros(()), ())
    if past_feedback is not None and problem.has_spring:
        past_feedback[1] = unloading(here, state, own)
    wear, energy = wear_per_pass(here, state.contacts)
    sums = edges.sums_per_pass(None, energy)
    return state.replaced(
        **dict.fromkeys(edges.FIELDS),
        past_wear=first_differences(wear, own),
        past_sums=first_differences(sums, own)[..., 0],
        past_feedback=past_feedback,
        past_spans=spans,
        order=np.ones(len(state.passes), dtype=np.int64),
        wear_exponents=np.ones((*problem.shape, problem.grid.strips)),
        stepping_error=np.zeros_like(state.stacked) if error is None else error,
    )


def implicit_step(problem: WearProblem, state: WearState, passes: FloatArray) -> WearState:
    """Step over `passes` passes with the contacts solved on the profiles at the step's end.

    A backward differentiation formula of the order in `state`. Energy changes by the same formula
    as the depths, so that Archard's wear law holds to round-off. Passes are counted one by one: the
    formula is applied to the depths half a pass later, ``u + f/2`` with the wear per pass f, whose
    derivative is f up to terms of second order in f. A step in which a depth or the energy would
    decrease is repeated at second order, and at first order if they still decrease; so is one in
    which contact would be lost. A step in which the load jumps is of first order. The state
    returned has the order of its formula.

    Raises
    ------
    StepError
        If the iteration for the contacts does not converge.
    """
    if state.past_spans is None:
        state = with_rates(problem, state)
    state = edges.on_strips(problem, state)
    if state.part is not None:
        parts = edges.by_resolution(problem, state)
        if len(parts) > 1 or parts[0][2].part is None:
            ends = [_split_step(*part, passes) for part in parts]
            order = np.argsort(np.concatenate([some for some, _, _ in parts]))
            return joined_states(ends).at(order)
        state = parts[0][2]
    here = problem.at_time(problem.time(state.passes), problem.time(state.passes + passes))
    conditions = conditions_of(here, problem, state, passes)
    order = Past.of(state).order
    if problem.constant_load is None:  # wear per load and pass is not smooth where the load jumps
        order = np.where(abrupt_loads(problem, state.passes, passes), 1, order)
    try:
        end, decreased = _step(here, state, passes, conditions, order)
    except (StepError, ContactError) as error:
        # the past points may lead beyond the depth at which a spring is unloaded, or to a profile
        # on which the contact is not found; strips that are not cut are the simpler problem
        last = order[0] == 1 and state.part is None
        if len(order) > 1 or last or getattr(error, "cause", "") == "edge":
            raise
        first = np.ones_like(order)
        if state.part is None:
            return _step(here, state, passes, conditions, first)[0]
        whole = edges.without_edges(state)
        return edges.with_unresolved_edges(here, _step(here, whole, passes, conditions, first)[0])
    # strips that leave the contact: their depth can decrease from the third order on
    for lower in (2, 1) if np.count_nonzero(decreased) else ():
        again: IntArray = (decreased & (Past.of(end).order > lower)).nonzero()[0]
        if again.size:
            columns = (column[..., again] for column in vars(conditions).values())
            some = here.at(again), state.at(again), passes[again], Conditions(*columns)
            part, decreased[again] = _step(*some, np.full_like(again, lower))
            end = end.with_others(again, part)
    return end


def _split_step(
    places: IntArray, problem: WearProblem, state: WearState, passes: FloatArray
) -> WearState:
    """Return the end of a step of some tests, see `edges.by_resolution`."""
    end = implicit_step(problem, state, passes[places])
    return edges.with_unresolved_edges(problem, end) if state.part is None else end


def _step(
    problem: WearProblem,
    state: WearState,
    passes: FloatArray,
    conditions: Conditions,
    order: IntArray,
) -> tuple[WearState, BoolArray]:
    """Return the state after an implicit step, and whether depths or energy would decrease.

    Both have one entry per realisation, as has `order`.
    """
    realisations, start, past = len(passes), state.stacked, Past.of(state)
    level = start if state.separation is None else start - edges.separated_bodies(problem, state)
    half_pass = np.where(passes > WHOLE_PASSES, 0.5, 0.0)
    weights = np.empty((2, ROWS, realisations))
    factor, spans = np.empty(realisations), np.empty((ROWS - 1, realisations))
    formulas(past.spans, conditions.mean * passes, order, half_pass, weights, factor, spans)
    worn_passes = factor / conditions.own - half_pass
    added, guess = extrapolated(weights, past.wear)
    scale, marked = None, edges.marked_strips(state)
    if marked is not None:
        young = marked.young
        added = np.where(young, half_pass[:, None] * past.wear[0], added)
        first = (conditions.mean * passes / conditions.own - half_pass) / worn_passes
        scale = np.where(young, first[:, None], 1.0)
    old_sums = past.sums[..., None]
    sums = extrapolated(weights, old_sums)[0]
    feedback = None
    if past.feedback is not None:
        old = past.feedback.reshape(ROWS, -1, realisations, 1)
        feedback = extrapolated(weights, old)[1] + (1.0 - half_pass[:, None]) * old[0]
        feedback = feedback.reshape(problem.shape)
    step = EndOfStep(
        problem, state, level + added, added, conditions.force, passes, worn_passes, scale
    )
    end, worn, feedback, parts = step.solved(level + guess, feedback)
    rates, change = worn / worn_passes[:, None], added + worn
    rates = rates if scale is None else rates / scale
    energy_rate = energy_per_pass(problem, end.contacts)
    sum_rates = edges.sums_per_pass(None if parts is None else rates, energy_rate)
    sums = sums + worn_passes[:, None] * sum_rates
    if parts is not None:
        end = edges.with_volume(
            end, parts, sums[:-1, :, 0] - edges.over_strips(end.stacked - start)
        )
        change = end.stacked - edges.separated_bodies(problem, end) - level
    past_feedback = None
    if feedback is not None:
        new = feedback.reshape(-1, realisations, 1)
        past_feedback = new_differences(new, new - old[0], 0.0 * half_pass, old, spans)
        past_feedback = past_feedback.reshape(ROWS, *problem.shape)
    end = end.replaced(
        passes=state.passes + passes,
        energy=state.energy + sums[-1, :, 0],
        past_wear=new_differences(rates, change, half_pass, past.wear, spans),
        past_sums=new_differences(sum_rates, sums, half_pass, old_sums, spans)[..., 0],
        past_feedback=past_feedback,
        past_spans=spans,
        order=order,
    )
    decreased = (end.stacked < start).any(axis=(0, 2)) | (sums[-1, :, 0] < 0.0)
    return end, decreased
