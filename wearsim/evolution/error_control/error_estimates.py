"""What the error of a step is measured by, for every stepper that takes many passes at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from wearsim.evolution.batch.per_realisation import mean_along, sum_in_order
from wearsim.evolution.error_control.step_size import StepControl
from wearsim.evolution.observables import worn_volume
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Depths, WearState
from wearsim.evolution.steppers.single_step import solve_present
from wearsim.evolution.steppers.wear_increment import WearIncrement
from wearsim.types import BoolArray, FloatArray, Number

DEPTH_EXPONENT, VOLUME_EXPONENT = 0.5, 0.75  # below those of any groove: 2/3 to 1, and about 1
Step: TypeAlias = Callable[[WearProblem, WearState, Number], WearState]
COVER = 1.5  # of what is estimated; half as much for safety
FIRST_ORDER_COVER = 2.0  # the twin of a first-order scheme is off by little more than it tells
DEEP = 0.5  # depths are compared where the groove is deeper than this part of its depth
DEPTHS = ("cylinder_depth", "roller_depth")


def greatest_depth(state: WearState) -> FloatArray:
    """Return the greatest worn depth of either body, shape (realisations,) [m]."""
    found: FloatArray = np.maximum(*(getattr(state, name).max(axis=(0, 1, 3)) for name in DEPTHS))
    return found


def total_worn_volume(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the volume worn off the cylinder and all its rollers, shape (realisations,) [m^3]."""
    return volume_of(problem, state.depths)


def volume_of(problem: WearProblem, depths: Depths) -> FloatArray:
    """Return the volume of depths of cylinder and rollers, shape (realisations,) [m^3]."""
    kinematics, spacing = problem.kinematics, problem.grid.spacing
    cylinder = worn_volume(depths[0], spacing, kinematics.cylinder_radius)
    rollers = worn_volume(depths[1][0], spacing, kinematics.roller_radius)
    mean: FloatArray = mean_along(mean_along(cylinder, axis=1), axis=0)[0, 0]
    return mean + sum_in_order(kinematics.multiplicity[:, None] * rollers, axis=0)


def apart(one: WearState, other: WearState) -> Depths:
    """Return how far the depths of two states lie apart."""
    return one.cylinder_depth - other.cylinder_depth, one.roller_depth - other.roller_depth


def grooves(state: WearState) -> tuple[BoolArray, BoolArray]:
    """Return where cylinder and rollers are deep, shapes as of the depths."""
    cylinder, roller = (
        worn >= DEEP * worn.max(axis=(0, 1, 3), keepdims=True) for worn in state.depths
    )
    return cylinder, roller


def greatest_in(deep: tuple[BoolArray, BoolArray], depths: Depths) -> FloatArray:
    """Return the greatest size of depths where grooves are deep, shape (realisations,) [m]."""
    cylinder, roller = (
        np.where(here, np.abs(depth), 0.0).max(axis=(0, 1, 3))
        for here, depth in zip(deep, depths, strict=True)
    )
    greatest: FloatArray = np.maximum(cylinder, roller)
    return greatest


def depth_between(one: WearState, other: WearState) -> FloatArray:
    """Return how far two states lie apart where the first is deep, shape (realisations,) [m]."""
    return greatest_in(grooves(one), apart(one, other))


def variation_bias(
    problem: WearProblem, end: WearState, first: Number, passes: Number
) -> Depths | None:
    """Return what a step leaves out where load and processes vary within it.

    The step takes their exact means, but wear is no linear function of them. Half the second
    difference of the wear at the mean and a standard deviation to either side, on the profile of
    the step's end, is the bias that the variance makes.

    Parameters
    ----------
    problem : WearProblem
    end : WearState
        The state at the step's end.
    first, passes : float or ndarray, shape (realisations,)
        Where the step began, and its length [passes].

    Returns
    -------
    cylinder, roller : ndarray
        Depth to add, shapes as in `WearState` [m]; None where nothing varies.
    """
    start, stop = problem.time(first), problem.time(first + passes)
    here = problem.at_time(start, stop)
    mean: WearIncrement | None = None
    bias: Depths | None = None
    loads: FloatArray | None = None
    for name, rollers, deviation in problem.deviations(start, stop):
        if not np.count_nonzero(deviation):
            continue
        if loads is None:
            carried = problem.values_of(end.contacts, "line_load").sum(axis=-1)
            loads = carried * problem.grid.spacing
        values = loads if name == "normal_force_offset" else getattr(here.inputs, name)
        values = values.reshape(-1, values.shape[-1])
        felt = deviation > 1e-9 * np.abs(values).max(axis=0)
        if not felt.any():
            continue
        # a load and a friction coefficient are never below zero
        bounded = name in {"normal_force_offset", "friction"}
        most = 0.9 * values.min(axis=0) if bounded else np.inf
        size = np.where(felt, np.minimum(deviation, most), 0.0)
        mean = mean if mean is not None else _worn_at(here, end, loads, {}, passes)
        shift = np.where(np.isin(problem.roller, rollers)[:, None], size, 0.0)
        less, more = (
            _worn_at(here, end, loads, {name: sign * shift}, passes) for sign in (-1.0, 1.0)
        )
        own = (
            0.5 * (less.cylinder - 2.0 * mean.cylinder + more.cylinder),
            0.5 * (less.roller - 2.0 * mean.roller + more.roller),
        )
        bias = own if bias is None else (bias[0] + own[0], bias[1] + own[1])
    return bias


def variation_error(
    problem: WearProblem, end: WearState, first: Number, passes: Number
) -> FloatArray:
    """Return the size of `variation_bias`, whose parameters these are, with a factor for safety.

    Returns
    -------
    ndarray, shape (2, realisations)
        In depth [m], and in the volume worn off both bodies [m^3].
    """
    bias = variation_bias(problem, end, first, passes)
    if bias is None:
        return np.zeros((2, problem.shape[2]))
    biased = _worn_further(end, bias)
    volumes = np.abs(total_worn_volume(problem, biased) - total_worn_volume(problem, end))
    return COVER * np.array([depth_between(end, biased), volumes])


def biased_coarse_solution(end: WearState, twin: WearState, bias: Depths | None) -> WearState:
    """Return the twin of a test with the bias that the variation within a step makes.

    It is worn into the twin's profile, where the wear to come forgets it as it would in the test.
    Its sign is the one that takes the two further apart, so that it hides no other error.

    Parameters
    ----------
    end, twin : WearState
        The test and its twin after the step.
    bias : tuple of ndarray, optional
        As `variation_bias` returns it.
    """
    if bias is None:
        return twin
    along = sum(
        sum_in_order((a * b).sum(axis=-1), axis=axis).sum(axis=0)
        for axis, a, b in zip((0, 1), apart(twin, end), bias, strict=True)
    )
    sign = np.where(along < 0.0, -1.0, 1.0)[:, None]
    return _worn_further(twin, (sign * bias[0], sign * bias[1]))


def _worn_further(state: WearState, depths: Depths) -> WearState:
    """Return `state` with depths added to those of cylinder and rollers."""
    return state.replaced(
        cylinder_depth=state.cylinder_depth + depths[0],
        roller_depth=state.roller_depth + depths[1],
    )


def _worn_at(
    problem: WearProblem,
    end: WearState,
    loads: FloatArray,
    shifts: dict[str, FloatArray],
    passes: Number,
) -> WearIncrement:
    """Return what passes on the profiles of `end` wear off with loads and inputs shifted."""
    values = {
        name: getattr(problem.inputs, name) + shift
        for name, shift in shifts.items()
        if name != "normal_force_offset"
    }
    shifted = replace(problem, inputs=problem.inputs.with_values(values))
    contacts = solve_present(shifted, end, loads + shifts.get("normal_force_offset", 0.0))
    return WearIncrement(shifted, contacts, passes)


def half_quadrature_start(problem: WearProblem, state: WearState) -> WearState:
    """Return the twin of a test whose rollers have half the contacts, where it has yet to begin."""
    chosen = set(np.flatnonzero(problem.half == 0))
    contacts = zip(problem.contacts, state.contacts, strict=True)
    return replace(
        state,
        contacts=tuple(contact for (_, c, _), contact in contacts if c in chosen),
        coarse_step_solution=None,
        half_quadrature_solution=None,
    )


def with_pass_errors(
    problem: WearProblem,
    start: WearState,
    end: WearState,
    whole: WearState,
    step: Step,
    passes: Number,
) -> WearState:
    """Return `end` with what the draws at every pass of a step make uncertain.

    A twin of the test is stepped beside it with half the contacts of each roller. What sets it
    apart from the same steps with all of them, with all that wear has forgotten of earlier
    differences, is the estimate of the quadrature's error. What the draws of so many passes leave
    to chance scatters the volume, and the depth as much.

    Parameters
    ----------
    problem : WearProblem
    start, end : WearState
        The test before and after the step.
    whole : WearState
        The test stepped as the twin is.
    step : callable
        Takes a problem, a state and a number of passes to the state after them.
    passes : float
        Length of the step.
    """
    if not problem.has_nodes:
        return end
    halved = problem.halved
    coarse = step(
        halved, start.half_quadrature_solution or half_quadrature_start(problem, start), passes
    )
    volume = total_worn_volume(problem, end)
    variance = start.scatter[1] + _volume_variance(problem, end, passes)
    depth = np.square(greatest_depth(end) / np.where(volume > 0.0, volume, 1.0)) * variance
    volumes = np.abs(total_worn_volume(problem, whole) - total_worn_volume(problem, coarse))
    return replace(
        end,
        quadrature=np.array([depth_between(whole, coarse), volumes]),
        scatter=np.array([depth, variance]),
        half_quadrature_solution=coarse,
    )


def _volume_variance(problem: WearProblem, end: WearState, passes: Number) -> FloatArray:
    """Return the variance of the volume that so many passes wear, shape (realisations,) [m^6]."""
    kinematics, spacing = problem.kinematics, problem.grid.spacing
    cylinder, roller = problem.wear_per_pass(end.contacts)
    ratio = kinematics.roller_share * kinematics.physical_rollers
    volume = worn_volume(cylinder, spacing, kinematics.cylinder_radius)
    volume = volume + worn_volume(roller * ratio, spacing, kinematics.roller_radius)
    # what differs from roller to roller is no chance
    chance = volume - problem.per_roller(volume)[:, problem.roller]
    variance: FloatArray = (
        (problem.cylinder_share[None, :, None] * chance**2).sum(axis=1).max(axis=0)
    )
    return passes * variance


def excess(
    control: StepControl,
    problem: WearProblem,
    start: WearState,
    end: WearState,
    added: FloatArray,
    stop: float,
    reached: FloatArray | None = None,
) -> FloatArray:
    """Return what a step adds to the errors over what it may add, shape (realisations,).

    Wear forgets, and its errors make room again: where `reached` tells them, all of them together
    may also be what a first step might have added.

    Parameters
    ----------
    control : StepControl
    problem : WearProblem
    start, end : WearState
        The test before and after the step.
    added : ndarray, shape (2, realisations)
        Error of depth [m] and volume [m^3] that the step adds.
    stop : float
        Passes at the end of the test.
    reached : ndarray, shape (2, realisations), optional
        Error of depth [m] and volume [m^3] after the step, at most `added` and what was before.
    """
    worst = np.zeros(problem.shape[2])
    parts = np.broadcast_to(end.passes_done / stop, worst.shape).tolist()
    sizes = greatest_depth(end), total_worn_volume(problem, end)
    # what no shorter step would take away must not shorten it
    reducible = np.array([start.depth_error, start.volume_error]) - start.irreducible
    arrays = reducible, added, reducible + added if reached is None else reached
    for kind, exponent in enumerate((DEPTH_EXPONENT, VOLUME_EXPONENT)):
        columns = (column.tolist() for column in (sizes[kind], *(a[kind] for a in arrays)))
        for v, (part, size, before, error, total) in enumerate(zip(parts, *columns, strict=True)):
            if size > 0.0:
                allowed = control.allowance(size, exponent, before, part)
                anew = control.allowance(size, exponent, 0.0, part)
                worst[v] = max(worst[v], min(error / allowed, total / anew))
    return worst
