"""Pauses: times at zero load, in which there is no contact and nothing wears.

Steps end where a pause begins or ends. A pause is then one step without wear, so that the contacts
are never solved without load.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.loads import advanced_terms
from wearsim.types import BoolArray, FloatArray, IntArray

#: passes, and part of the passes done, by which a state may miss the start or end of a pause
_MARGIN = 1e-6, 1e-7
_SHORTEST = 1.0  # passes; during a shorter pause the mean load over a step is sufficient


def _margin(passes: float) -> float:
    return max(_MARGIN[0], _MARGIN[1] * passes)


def _end_of_pause(pauses: FloatArray, done: float) -> float:
    """Return the end of the last pause that has begun after some passes; -inf if none has."""
    begun = int(np.searchsorted(pauses[:, 0], done + _margin(done), side="right")) - 1
    return float(pauses[begun, 1]) if begun >= 0 else -np.inf


def at_rest(problem: WearProblem, passes: FloatArray) -> BoolArray:
    """Return whether the next step of each realisation is a pause.

    Parameters
    ----------
    problem : WearProblem
    passes : ndarray, shape (realisations,)
        Roller passes done.

    Returns
    -------
    ndarray of bool, shape (realisations,)
    """
    tests = zip(_long(problem), passes.tolist(), strict=True)
    return np.array([done < _end_of_pause(pauses, done) - _margin(done) for pauses, done in tests])


def next_boundaries(problem: WearProblem, passes: FloatArray) -> FloatArray:
    """Return at how many passes the next pause of each realisation starts, or the present one ends.

    Parameters
    ----------
    problem, passes
        As of `at_rest`.

    Returns
    -------
    ndarray, shape (realisations,)
        Roller passes; infinite where no pause follows.
    """
    tests = zip(_long(problem), passes.tolist(), strict=True)
    return np.array(
        [pauses[pauses > done + _margin(done)].min(initial=np.inf) for pauses, done in tests]
    )


def _long(problem: WearProblem) -> list[FloatArray]:
    """Return the pauses that steps do not pass over, of each realisation [passes]."""
    return [pauses[np.ptp(pauses, axis=1) > _SHORTEST] for pauses in problem.pauses]


def rest(problem: WearProblem, state: WearState, passes: FloatArray, stop: float) -> WearState:
    """Return the state after a pause of `passes` passes: load terms relax, and nothing wears.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    passes : ndarray, shape (realisations,)
        Length of the step.
    stop : float
        Passes at the end of the test, which a step may reach.
    """
    done = np.where(passes == stop - state.passes, stop, state.passes + passes)
    terms = state.terms
    if problem.terms:
        terms = advanced_terms(problem, state, done, np.zeros_like(terms[0]))
    if state.past_spans is not None:  # multistep formulas start again, from the last rates
        spans = np.full_like(state.past_spans, np.inf)
        spans[0] = 0.0
        state = state.replaced(past_spans=spans, order=np.ones(len(done), dtype=np.int64))
    return state.replaced(
        passes=done,
        terms=terms,
        **{n: rest(problem, part, passes, stop) for n, part in state.auxiliary.items()},
    )


def step_or_rest(
    step: Callable[[WearProblem, WearState, FloatArray], WearState],
    problem: WearProblem,
    state: WearState,
    passes: FloatArray,
) -> WearState:
    """Return the state after a step, which is a rest for realisations in a pause."""
    resting = at_rest(problem, state.passes) if problem.pauses else np.zeros(len(passes), np.bool_)
    if not resting.any():
        return step(problem, state, passes)
    for chosen, action in ((resting, partial(rest, stop=np.inf)), (~resting, step)):
        places: IntArray = np.flatnonzero(chosen)
        if places.size:
            state = state.with_others(
                places, action(problem.at(places), state.at(places), passes[places])
            )
    return state


def without_load(problem: WearProblem, passes: FloatArray) -> BoolArray:
    """Return whether there is no load at this instant; parameters and result as of `at_rest`."""
    if not problem.pauses:
        return np.zeros(len(passes), dtype=np.bool_)
    tests = zip(problem.pauses, passes.tolist(), strict=True)
    return np.array([done <= _end_of_pause(pauses, done) + _margin(done) for pauses, done in tests])


def opened(
    problem: WearProblem, passes: FloatArray, contacts: ContactBatchSolution, loads: FloatArray
) -> tuple[ContactBatchSolution, FloatArray]:
    """Return contacts and their loads [N], all zero for realisations without load at this instant.

    Parameters
    ----------
    problem : WearProblem
    passes : ndarray, shape (realisations,)
        Roller passes done.
    contacts : ContactBatchSolution
        In the problem's order.
    loads : ndarray, shape (stations, contacts, realisations)
    """
    unloaded = without_load(problem, passes)
    if not unloaded.any():
        return contacts, loads
    numbers: IntArray = np.flatnonzero(np.broadcast_to(unloaded, loads.shape))
    affected = contacts.at(numbers)
    zeros = {n: np.zeros_like(a) for n, a in vars(affected).items() if n != "y" and a is not None}
    empty = ContactBatchSolution(affected.y, **zeros)
    return contacts.with_others(numbers, empty), np.where(unloaded, 0.0, loads)
