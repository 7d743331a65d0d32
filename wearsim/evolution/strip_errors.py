"""Error of wear tests due to the width of their strips.

A test is repeated on strips of twice the width, with a greater tolerance of its steps: the error
accumulates in it as in the test, which contacts solved on coarse strips at a few times do not show.
The error estimate is the difference of the two tests times a safety factor. Profiles are compared
at the middles of the coarse strips, and the greatest depth of the test with that of the coarse test
interpolated between its strips, since averages over strips and the depth of the deepest strip
depend on the width of strips even in equal profiles. The rise of a parabola through the deepest
strips of the test above these is part of the error of its depth. The difference of the means over
strips from the depths in their middles is part of the error of the profile; it is greatest at the
edges of a groove.

A difference is three times the error of the test where that is proportional to the square of the
width of the strips, as in a groove at full slip. Where slip is partial it is equal to the error:
most wear is then at the edges of the contact, where a strip is inside or outside as a whole. The
rate of wear then depends on the strips, and the difference of the volumes over that of the profiles
measures how far slip is partial. In a fresh contact, too, strips enter the contact one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from typing import Any, TypeAlias

import numpy as np

from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import Advance, Evolution
from wearsim.evolution.observables import greatest_between
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Stepper
from wearsim.evolution.steppers.loads import elastic_approaches
from wearsim.evolution.steppers.single_step import volumes_of
from wearsim.evolution.strips import coarse_problem
from wearsim.types import FloatArray, Grid

LOOSER = 12.0  # tolerance of the coarse test over that of the test
LOOSER_ITERATIONS = 4.0  # the same of the iterations of a step
LOOSEST = 0.1  # greatest tolerance of a coarse test
# safety factors on the differences of depth, volume and profile where the rate of wear does not
# depend on the strips, where it does, and before wear: later, wear reduces errors of the shape
COVER, PARTIAL_COVER, FRESH_COVER = (
    np.array(factors)[:, None]
    for factors in ((0.25, 0.42, 0.9), (0.75, 0.72, 1.3), (1.35, 1.15, 1.8))
)
OF_PROFILE = 0.1  # least relative errors of depth and volume over that of the profile
# the same of the volume worn in a contact that adheres, before wear has changed it
OF_FRESH_PROFILE = 0.3
# difference of the mean over a strip from the depth in its middle, over that of a parabola, at the
# edge of a groove within a strip: from 1 to 4 by the angle at which the depth begins
IN_MIDDLE = 2.0
BACK = 2.0  # ratio of passes over which an error that crosses zero is remembered

#: Function that returns observables of a state by name, with the realisations last.
Observe: TypeAlias = Callable[[WearProblem, WearState], Mapping[str, FloatArray]]
#: Problem of some tests, their numbers and passes, and the depths as `WearState.stacked` [m].
Worn: TypeAlias = tuple[WearProblem, list[int], list[float], FloatArray]


@dataclass
class Course:
    """Depths and volume of one test after each of its steps, and its profiles at the end.

    Parameters
    ----------
    passes : list of float
        Roller passes.
    sizes : list of ndarray, shape (3,)
        Greatest depth of the cylinder and of the rollers [m], volume worn off both [m^3].
    profiles : ndarray, shape (bodies, strips)
        Depths at the end, of the cylinder at the stations of the unworn cam [m].
    grid : Grid
        Strips at the end.
    approach : float
        Greatest elastic approach of the contacts at the end [m].
    adhesion : float
        Greatest part of a contact that adheres at the end.
    observed : dict of str to sequence of ndarray
        Observables by name, at the start and after each step, if they are asked for.
    """

    passes: list[float] = field(default_factory=list)
    sizes: list[FloatArray] = field(default_factory=list)
    profiles: FloatArray | None = None
    grid: Grid | None = None
    approach: float = 0.0
    adhesion: float = 0.0
    observed: dict[str, Any] = field(default_factory=dict)


def sizes_of(problem: WearProblem, depths: FloatArray, between: bool = False) -> FloatArray:
    """Return greatest depth of cylinder and rollers [m] and volume [m^3], (3, realisations).

    Parameters
    ----------
    problem : WearProblem
    depths : ndarray, shape (stations + rollers, realisations, strips)
        As `WearState.stacked` [m].
    between : bool
        Whether the greatest depths are those of parabolas through the deepest strips and their
        neighbours, instead of those of strips.
    """
    top = greatest_between if between else partial(np.max, axis=-1)
    tops, stations = top(depths), problem.shape[0]
    cylinder = problem.kinematics.track.greatest_value(tops[:stations])
    return np.array([cylinder, tops[stations:].max(axis=0), volumes_of(problem, depths)])


def _means_below_points(depths: FloatArray) -> float:
    """Return how much the mean over the deepest strip is below the depth in its middle, at most.

    Strips that were joined, or that the edge of a contact has crossed, hold mean depths. The mean
    of a parabola over a strip is below its vertex by a 24th of the second difference.
    """
    second = 2.0 * depths[:, 1:-1] - depths[:, :-2] - depths[:, 2:]
    return float(second[depths[:, 1:-1] == depths.max()].max(initial=0.0)) / 24.0


def _means_and_middles(depths: FloatArray) -> float:
    """Return the difference of means over strips from the depths in their middles, relative.

    It is the ratio of the Euclidean norms of the difference and of the depths, see `IN_MIDDLE`.
    """
    second = float(np.linalg.norm(np.diff(depths, 2, axis=-1)))
    return IN_MIDDLE * second / 24.0 / float(np.linalg.norm(depths))


def add_step(courses: Sequence[Course], advance: Advance) -> None:
    """Add a step of some tests to their courses, which are numbered as the tests."""
    add_steps(courses, [worn_by(advance)])


def worn_by(advance: Advance) -> Worn:
    """Return problem, numbers and passes of tests after a step, and depths of all bodies."""
    end = advance.end
    return advance.problem, advance.numbers.tolist(), end.passes.tolist(), end.stacked


def add_steps(courses: Sequence[Course], steps: Sequence[Worn], between: bool = False) -> None:
    """Add steps of some tests to their courses; `between` is that of `sizes_of`.

    Those of one problem, as of a single test, are taken together.
    """
    for _, group in groupby(steps, key=lambda step: id(step[0])):
        of_problem = list(group)
        problem, numbers, _, last = of_problem[-1]  # all have the same numbers
        depths = np.concatenate([stacked for *_, stacked in of_problem], axis=1)
        sizes = iter(sizes_of(problem, depths, between).T)
        for _, numbers, passes, _ in of_problem:
            for number, done in zip(numbers, passes, strict=True):
                courses[number].passes.append(done)
                courses[number].sizes.append(next(sizes))
        stations = problem.shape[0]
        profiles = np.concatenate(
            [problem.kinematics.track.at_unworn(last[:stations]), last[stations:]]
        )
        for place, number in enumerate(numbers):
            courses[number].profiles, courses[number].grid = profiles[:, place], problem.grid


def add_observed(
    courses: Sequence[Course], numbers: Sequence[int], observed: Mapping[str, FloatArray]
) -> None:
    """Add the observables of some tests, realisations last, to their courses by number."""
    for place, number in enumerate(numbers):
        for name, values in observed.items():
            courses[number].observed.setdefault(name, []).append(values[..., place])


def coarse_courses(
    problem: WearProblem,
    stepper: Stepper,
    stop: float,
    needed: FloatArray,
    max_steps: int,
    observe: Observe | None = None,
) -> list[Course | None]:
    """Return the courses of tests on strips of twice the width.

    Parameters
    ----------
    problem : WearProblem
        Problem of the tests, on the strips with which they start.
    stepper : Stepper
        Stepper with the greater tolerance.
    stop : float
        Passes at the end of the tests.
    needed : ndarray, shape (realisations,)
        Passes to which the course of each test is needed, at most to their end.
    max_steps : int
    observe : callable, optional
        Returns the observables of the courses.

    Returns
    -------
    list of Course or None
        None for a test that fails on the coarse strips.
    """
    coarse, courses = coarse_problem(problem), [Course() for _ in needed]
    coarse = replace(coarse, iteration_tolerance=LOOSER_ITERATIONS * coarse.iteration_tolerance)
    try:
        state = fresh_state(coarse)
        tests = Evolution(coarse, state, stepper, stop, max_steps, lambda _: np.inf)
        if observe is not None:
            add_observed(courses, range(len(courses)), observe(coarse, state))
        steps: list[Worn] = []
        for advance in tests:
            end, numbers = advance.end, advance.numbers
            steps.append(worn_by(advance))
            if observe is not None:
                add_observed(courses, numbers.tolist(), observe(advance.problem, end))
            done = (end.passes >= needed[numbers]).nonzero()[0]
            if done.size:
                approaches = elastic_approaches(advance.problem, end).max(axis=(0, 1))
                parts = end.contacts.adhesion_fraction.reshape(advance.problem.shape)
                for place in done.tolist():
                    course = courses[numbers[place]]
                    course.approach = float(approaches[place])
                    course.adhesion = float(parts[..., place].max())
                tests.end(numbers[done].tolist())
        add_steps(courses, steps, between=True)
    except Exception:  # a test fails for its own reasons, and the others are repeated without it
        if len(needed) == 1:
            return [None]
        singly = (
            coarse_courses(problem.at(n), stepper, stop, needed[n], max_steps, observe)
            for n in np.arange(len(needed))[:, None]
        )
        return [course for part in singly for course in part]
    return [None if n in tests.failures else course for n, course in enumerate(courses)]


def strip_errors(
    coarse: Course | None, passes: FloatArray, sizes: FloatArray, end: Course
) -> FloatArray:
    """Return the estimated errors of a test due to its strips, shape (3, points).

    Parameters
    ----------
    coarse : Course or None
        The test on strips of twice the width; without it the errors are not known, nan.
    passes : ndarray, shape (points,)
        Rising, from the start of the test.
    sizes : ndarray, shape (3, points)
        Sizes of the test at these passes, see `Course`.
    end : Course
        With the profiles of the test at its end.

    Returns
    -------
    ndarray, shape (3, points)
        Errors of the greatest depth of either body [m] and of the volume [m^3]; Euclidean norm of
        that of the profiles over that of the depths.
    """
    if coarse is None:
        return np.full((3, len(passes)), np.nan)
    steps, last = np.array(coarse.passes), float(passes[-1])
    common = np.append(steps[steps < last], last)  # passes at which the tests are compared
    with np.errstate(divide="ignore", invalid="ignore"):
        coarse_logs, logs = (
            np.array([np.interp(np.log(common), np.log(points), np.log(size)) for size in rows])
            for points, rows in ((steps, np.array(coarse.sizes).T), (passes, sizes))
        )
        ratio = np.abs(np.expm1(coarse_logs - logs))
    ratio = np.where(np.isfinite(ratio), ratio, 0.0)
    # the error at a point is the greatest of the last steps, as it may cross zero
    recent = (common[None, :] > common[:, None] / BACK) & (common[None, :] <= common[:, None])
    decay = np.sqrt(common[None, :] / common[:, None])
    relative = (np.where(recent, decay, 0.0)[None] * ratio[:, None, :]).max(axis=2)
    part = np.array([np.interp(passes, common, row) for row in relative])
    depth = np.maximum(part[0] * sizes[0], part[1] * sizes[1])
    of_profile = _profile_error(coarse, end) if steps[-1] == last else 0.0
    profile = np.full(len(passes), of_profile)
    if relative[0, -1] > 0.0:
        profile = profile * np.maximum(part[0] / relative[0, -1], 1.0)
    # how far the rate of wear depends on the strips
    partial_slip = min(float(part[2, -1]) / of_profile, 1.0) if of_profile > 0.0 else 1.0
    deepest = np.maximum(sizes[0], sizes[1])
    fresh = coarse.approach / (coarse.approach + 3.0 * deepest) if coarse.approach > 0.0 else 0.0
    cover = COVER + (PARTIAL_COVER - COVER) * partial_slip
    cover = cover + (FRESH_COVER - cover) * fresh
    errors = cover * np.array([depth, part[2] * sizes[2], profile])
    # profiles are compared at the end alone, where their difference may cross zero too
    errors[2] = np.maximum(errors[2], errors[0] / np.where(deepest > 0.0, deepest, np.inf))
    # the differences of depth and volume may be small by chance, that of the depth of a single
    # strip more often
    of_volume = np.maximum(OF_PROFILE * partial_slip, OF_FRESH_PROFILE * coarse.adhesion * fresh)
    least = np.array([OF_PROFILE * deepest, of_volume * sizes[2]])
    errors[:2] = np.maximum(errors[:2], least * errors[2])
    if end.profiles is not None and end.profiles.any():
        top = greatest_between(end.profiles).max() + _means_below_points(end.profiles)
        errors[0] += deepest * (top / end.profiles.max() - 1.0)
        errors[2] = np.hypot(errors[2], _means_and_middles(end.profiles))
    return np.asarray(errors)


def _profile_error(coarse: Course, end: Course) -> float:
    """Return the norm of the difference of two tests at their end, over that of the depths."""
    if coarse.grid is None or coarse.profiles is None or end.grid is None or end.profiles is None:
        return 0.0
    fine = _at_points(end.profiles, end.grid, coarse.grid.y)
    size = float(np.linalg.norm(fine))
    return float(np.linalg.norm(fine - coarse.profiles)) / size if size > 0.0 else 0.0


def _at_points(depths: FloatArray, grid: Grid, y: FloatArray) -> FloatArray:
    """Return depths at points by cubic polynomials through four strips, 0 beyond the strips."""
    place = (y - grid.y[0]) / grid.spacing
    first = np.clip(np.floor(place).astype(np.int64) - 1, 0, max(grid.strips - 4, 0))
    nodes = np.arange(min(4, grid.strips))
    interpolated = np.zeros((*depths.shape[:-1], len(y)))
    for node in nodes:
        other_nodes = nodes[nodes != node]
        weight = np.prod(
            (place[:, None] - first[:, None] - other_nodes) / (node - other_nodes), axis=1
        )
        interpolated += weight * depths[..., first + node]
    inside = (place >= -0.5) & (place <= grid.strips - 0.5)
    return np.asarray(np.where(inside, interpolated, 0.0))
