"""Contacts that yield by the wear of a step: every realisation's in one call to the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wearsim.contact_batch import OperatingPoints
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Contacts, as_batch
from wearsim.plugins import SharedWear
from wearsim.types import BoolArray, FloatArray, IntArray, OperatingPoint

REALISATION = 2  # axis


def solve_compliant(
    problem: WearProblem,
    gap: FloatArray,
    points: Sequence[OperatingPoint],
    wear: SharedWear,
    warm: Contacts,
    moving: BoolArray,
) -> Contacts:
    """Solve the contacts of the realisations that are moving; the others keep theirs.

    Parameters
    ----------
    problem : WearProblem
    gap : ndarray, shape (stations, contacts, realisations, strips)
        Gap of each contact [m].
    points : sequence of OperatingPoint
        One per contact, in the problem's order.
    wear : SharedWear
        With a first axis of realisations.
    warm : sequence of ContactSolution
        Solutions nearby, in the problem's order; they stand where nothing moves.
    moving : ndarray of bool, shape (realisations,)

    Returns
    -------
    sequence of ContactSolution
        In the problem's order.
    """
    if np.count_nonzero(moving) == len(moving):
        return _solve(problem, gap, points, wear, warm)
    numbers = np.flatnonzero(moving)
    places = np.arange(len(points)).reshape(-1, len(moving))[:, numbers].ravel()
    warm = as_batch(warm, problem.shape)
    found = _solve(
        problem,
        np.take(gap, numbers, axis=REALISATION),
        some_points(points, places),
        wear.at(numbers),
        warm.at(numbers),
    )
    return warm.with_others(numbers, as_batch(found, (*problem.shape[:2], len(numbers))))


def some_points(points: Sequence[OperatingPoint], places: IntArray) -> Sequence[OperatingPoint]:
    """Return some operating points, by number and in that order."""
    if isinstance(points, OperatingPoints):
        return points.at(places)
    return [points[place] for place in places]


def _solve(
    problem: WearProblem,
    gap: FloatArray,
    points: Sequence[OperatingPoint],
    wear: SharedWear,
    warm: Contacts,
) -> Contacts:
    """Solve the contacts of some realisations, in the order station, contact, realisation."""
    model, curvature = problem.model, problem.kinematics.longitudinal_curvature
    stations, contacts, realisations, strips = gap.shape
    together = stations * contacts
    if together == 1:
        return model.solve_batch(gap, curvature, points, wear.total.reshape(gap.shape), warm)
    sets = gap.reshape(together, realisations, strips).transpose(1, 0, 2)
    if realisations == 1:
        return model.solve_coupled_batch(sets, curvature, points, wear, warm)
    # the model takes set by set, which is realisation by realisation
    order = np.arange(len(points)).reshape(together, realisations).T.ravel()
    near = as_batch(warm, gap.shape[:-1]).with_axis_moved(REALISATION, 0)
    found = model.solve_coupled_batch(sets, curvature, some_points(points, order), wear, near)
    by_set = as_batch(found, (realisations, stations, contacts))
    return by_set.with_axis_moved(0, REALISATION)
