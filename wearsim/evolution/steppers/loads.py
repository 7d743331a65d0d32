"""Loads of the contacts, with their feedback by springs and load terms."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.errors import StepError
from wearsim.evolution.contacts import at_least
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import values_between
from wearsim.evolution.state import HERTZ, Depths, WearState
from wearsim.types import BoolArray, FloatArray

TREND = 0.9  # part of the variance of a smooth load that its linear trend explains
ABRUPT = 0.05  # standard deviation within a step, over the mean, that is taken as that of a jump
APPROACH_EXPONENT = 0.75  # approach as a power of the load: 2/3 in a Hertzian contact, 1 in a flat


def mean_loads(
    problem: WearProblem,
    state: WearState,
    passes: FloatArray,
    displacement: FloatArray,
    contacts: ContactBatchSolution,
) -> FloatArray:
    """Return the mean load of each contact over a step, shape (S, C, N) [N].

    Processes are at their means over the step in `problem`. The load before feedback is integrated
    exactly. The spring force is that at `displacement`, see `displacement_at`, and each load term
    has its exact mean at the constant power of `contacts`.
    """
    start, stop = problem.time(state.passes), problem.time(state.passes + passes)
    terms = []
    if problem.terms:
        power = problem.per_roller(problem.values_of(contacts, "power"))
        mean_power, duration = problem.mean_over_turn(power)[0], float((stop - start)[0])
        pairs = zip(problem.terms.values(), state.terms, strict=True)
        terms = [term.mean_force(value, mean_power, duration) for term, value in pairs]
    return with_feedback(problem, mean_force(problem, state, passes), displacement, terms)


def with_feedback(
    problem: WearProblem,
    force: FloatArray,
    displacement: FloatArray,
    terms: Iterable[FloatArray],
) -> FloatArray:
    """Return the loads for a load `force` before feedback."""
    loads = np.empty(problem.shape)
    loads[:] = force + problem.inputs.normal_force_offset
    if problem.has_spring:
        loads -= problem.feedback(displacement)
    for term in terms:
        loads += term[problem.roller]
    # a spring that has descended lifts the roller while the load rises from a pause
    return at_least(problem, loads)


def advanced_terms(
    problem: WearProblem, state: WearState, stop: FloatArray, power: FloatArray
) -> FloatArray:
    """Return the load terms after a step, shape (terms, rollers, realisations) [N].

    Parameters
    ----------
    problem : WearProblem
    state : WearState
        State at the start of the step.
    stop : ndarray, shape (realisations,)
        Passes at its end.
    power : ndarray, shape (rollers, realisations)
        Mean dissipated power of each roller [W].
    """
    duration = float((problem.time(stop) - problem.time(state.passes))[0])
    pairs = zip(problem.terms.values(), state.terms, strict=True)
    return np.array([term.advance(value, power, duration) for term, value in pairs])


def checked_loads(state: WearState, loads: FloatArray) -> FloatArray:
    """Return the loads of all contacts; raise StepError unless they are positive."""
    if not np.logical_and.reduce(loads > 0.0, axis=None):
        raise StepError(
            f"contact is lost at pass {state.passes[0]:.0f}: the load has fallen to"
            f" {loads.min():.4g} N",
            {"normal_force": loads, "passes": state.passes},
            cause="lost",
        )
    return loads


def descents(problem: WearProblem, depths: Depths) -> FloatArray:
    """Return the worn descent of each contact's roller, shape (S, C, N) [m].

    It is the rise of the least gap, by which rigid bodies would approach; on one track it equals
    the worn depth.
    """
    return np.asarray(problem.gap(*depths).min(axis=-1) - problem.nominal_gap.min(axis=-1))


def elastic_approaches(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the elastic approach of each contact, shape (S, C, N) [m].

    It is the approach of the bodies from first contact of their present profiles. The processes of
    `problem` are at the values with which the contacts were solved.
    """
    return np.asarray(
        problem.values_of(state.contacts, "approach") - problem.gap(*state.depths).min(axis=-1)
    )


def fresh_approach(problem: WearProblem, state: WearState, force: FloatArray) -> FloatArray:
    """Return the elastic approach of unworn bodies under a load before feedback, (S, C, N) [m].

    It is zero without a spring.
    """
    if state.approach_factor is None:
        return np.zeros(())
    loads = np.maximum(force + problem.inputs.normal_force_offset, 0.0)
    return np.asarray(problem.at_contacts(state.approach_factor) * loads**HERTZ)


def displacement_at(
    problem: WearProblem, depths: Sequence[Depths], recovered: FloatArray
) -> FloatArray:
    """Return the displacement of each contact's roller, shape (S, C, N) [m].

    A mounting spring extends by it: the mean of the worn descents at `depths`, less the elastic
    recovery, by which the elastic approach is below that of unworn bodies under the load before
    feedback. It is zero without a spring.
    """
    if not problem.has_spring:
        return np.zeros(())
    return np.asarray(np.mean([descents(problem, pair) for pair in depths], axis=0) - recovered)


def mean_force(problem: WearProblem, state: WearState, passes: FloatArray) -> FloatArray:
    """Return the exact mean over a step of the load before feedback, shape (N,) [N]."""
    if problem.constant_load is not None:
        return problem.constant_load
    return problem.mean_force(problem.time(state.passes), problem.time(state.passes + passes))


def load_deviation(problem: WearProblem, start: FloatArray, stop: FloatArray) -> FloatArray:
    """Return the exact standard deviation of each load between two times [s], shape (N,) [N]."""
    if problem.constant_load is not None:
        return np.zeros(len(problem.loads))
    return values_between([load.deviation for load in problem.loads], start, stop)


def smooth_loads(problem: WearProblem, first: FloatArray, passes: FloatArray) -> BoolArray:
    """Return whether each load before feedback varies smoothly over a step, shape (N,).

    A linear trend then explains most of its variance.

    Parameters
    ----------
    problem : WearProblem
    first, passes : ndarray, shape (realisations,)
        Start and length of the step [passes].
    """
    start, stop = problem.time(first), problem.time(first + passes)
    deviation = load_deviation(problem, start, stop)
    if problem.pauses or not deviation.any():
        return np.zeros(len(first), dtype=np.bool_)
    loads = problem.force(start), problem.force(stop)
    middle, change = 0.5 * (loads[0] + loads[1]), np.abs(loads[1] - loads[0])
    trend = np.square(change) > TREND * 12.0 * np.square(deviation)
    return np.asarray(trend & (deviation > 0.0) & (change < middle))


def abrupt_loads(problem: WearProblem, first: FloatArray, passes: FloatArray) -> BoolArray:
    """Return whether each load before feedback varies by more than a trend; as `smooth_loads`."""
    start, stop = problem.time(first), problem.time(first + passes)
    deviation = load_deviation(problem, start, stop)
    mean = values_between([load.mean for load in problem.loads], start, stop)
    return np.asarray((deviation > ABRUPT * mean) & ~smooth_loads(problem, first, passes))


def corrected_loads(
    problem: WearProblem,
    loads: FloatArray,
    target: FloatArray,
    approach: FloatArray,
    exponent: FloatArray | float = APPROACH_EXPONENT,
) -> FloatArray:
    """Return loads closer to those at which a spring and the contact are in equilibrium.

    One step of Newton's method for each contact, with the slope of the displacement estimated as
    that of a power of the load. If there is no equilibrium, a load may not be positive.

    Parameters
    ----------
    problem : WearProblem
    loads : ndarray, shape (stations, contacts, realisations)
        Loads of a solution [N].
    target : ndarray
        Loads by the spring at the displacement of that solution [N].
    approach : ndarray
        Part of the displacement that depends on the load [m].
    exponent : float or ndarray
        Exponent of that part as a power of the load.
    """
    slope = exponent * np.maximum(approach, 0.0) / loads
    return np.asarray(loads + (target - loads) / (1.0 + problem.stiffness * slope))


def elastic_approach(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the least elastic approach of the contacts, shape (realisations,) [m]."""
    return np.asarray(elastic_approaches(problem, state).min(axis=(0, 1)))
