"""Error estimates of steps over many passes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.contacts import with_contacts
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import mean_along, sum_in_order, worn_volume
from wearsim.evolution.state import Depths, WearState
from wearsim.evolution.steppers.base import Step
from wearsim.evolution.steppers.loads import load_deviation, smooth_loads
from wearsim.evolution.steppers.single_step import carried_loads, solve_present, worn_depths
from wearsim.mechanics.numerics.linearised_wear import difference_sizes
from wearsim.mechanics.numerics.step_errors import DEPTH_EXPONENT, VOLUME_EXPONENT
from wearsim.plugins import BODIES
from wearsim.types import BoolArray, FloatArray

COVER = 1.5  # safety factor on an error estimate
UNCERTAIN = 0.3  # part of the bias by variation within a step that may be wrong
VARYING_COVER = 2.0  # further safety factor where inputs vary, so that errors change irregularly
SHARE = 0.7  # part of the tolerance that one step may use
MIN_BUDGET = 0.02  # part of the error budget that a step may always add, so that a run never stalls
ROUND_OFF = 1e-9  # relative standard deviation up to which a load or an input is constant
# part of a contact that adheres above which the power may depend strongly on the load
MOST_ADHERING = 0.5
DEPTHS = ("cylinder_depth", "roller_depth")


def greatest_depth(depths: Depths) -> FloatArray:
    """Return the greatest depth of cylinder and rollers, shape (realisations,) [m]."""
    return np.asarray(np.maximum(*(worn.max(axis=(0, 1, 3)) for worn in depths)))


def volume_of(problem: WearProblem, depths: Depths) -> FloatArray:
    """Return the volume of depths of cylinder and rollers, shape (realisations,) [m^3]."""
    kinematics, spacing = problem.kinematics, problem.grid.spacing
    cylinder = worn_volume(depths[0], spacing, kinematics.track.track_radius)
    rollers = worn_volume(depths[1][0], spacing, kinematics.roller_radius)
    mean = mean_along(mean_along(cylinder, axis=1), axis=0)[0, 0]
    return np.asarray(mean + sum_in_order(kinematics.multiplicity[:, None] * rollers, axis=0))


def sizes(problem: WearProblem, state: WearState, differences: FloatArray) -> FloatArray:
    """Return the sizes of differences in depth, shape (3, realisations).

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    differences : ndarray
        Differences in depth, as `WearState.stacked` [m].

    Returns
    -------
    ndarray
        Greatest difference where the state is worn deep [m]; volume [m^3], with its sign; Euclidean
        norm over all bodies, relative to that of the depths.
    """
    measures = difference_sizes(state.stacked, differences, problem.volume_weights)
    measures[2] /= np.where(measures[3] > 0.0, measures[3], np.inf)
    return np.asarray(measures[:3])


def state_difference(problem: WearProblem, one: WearState, other: WearState) -> FloatArray:
    """Return the absolute `sizes` of the difference of two states, shape (3, realisations)."""
    return np.abs(sizes(problem, one, one.stacked - other.stacked))


def variation_bias(
    problem: WearProblem,
    end: WearState,
    first: FloatArray,
    passes: FloatArray,
    follows_trends: bool = False,
    negligible: float = 0.0,
) -> tuple[Depths, FloatArray, BoolArray] | None:
    """Return the wear and energy that a step misses where load and processes vary within it.

    The step takes their exact means, but wear is not linear in them. The bias due to the variance
    is half the second difference of the wear at the mean and one standard deviation to either
    side, on the profile of the step's end.

    Parameters
    ----------
    problem : WearProblem
    end : WearState
        State at the step's end.
    first, passes : ndarray, shape (realisations,)
        Start and length of the step [passes].
    follows_trends : bool
        Whether the scheme takes a smooth load at the end of the step instead of its mean.
    negligible : float
        Half the square of a relative standard deviation up to which the bias is neglected, except
        where most of a contact adheres or the wear is not proportional to the dissipated power. The
        relative bias of the volume is at most half of it, in partial slip; that of the depth is a
        third of it in a fresh contact; in a groove it is greatest at the edge, where further wear
        removes it.

    Returns
    -------
    depths : tuple of ndarray
        Depth of cylinder and rollers to add, shapes as in `WearState` [m].
    energy : ndarray, shape (realisations,)
        Energy to add [J].
    varies : ndarray of bool, shape (realisations,)
        Whether the load or an input varies.

    None is returned where nothing varies.
    """
    if not problem.varies:
        return None
    start, stop = problem.time(first), problem.time(first + passes)
    every_roller = tuple(range(problem.rollers))
    deviations = [  # field, rollers and standard deviation of all that varies
        ("normal_force_offset", every_roller, load_deviation(problem, start, stop)),
        *((item.name, item.rollers, item.paths.deviation(start, stop)) for item in problem.varying),
    ]
    deviations = [item for item in deviations if np.count_nonzero(item[2])]
    if not deviations:
        return None
    if follows_trends and deviations[0][0] == "normal_force_offset":
        name, rollers, deviation = deviations[0]
        smooth = smooth_loads(problem, first, passes)
        deviations[0] = name, rollers, np.where(smooth, 0.0, deviation)
    averaged = problem.at_time(start, stop)
    loads, least = carried_loads(problem, end.contacts), np.full(len(first), ROUND_OFF)
    if problem.linear_wear:
        adhesion = end.contacts.adhesion_fraction.reshape(problem.shape).max(axis=(0, 1))
        least[adhesion <= MOST_ADHERING] = max(math.sqrt(2.0 * negligible), ROUND_OFF)
    varies, chosen = np.zeros((2, len(first)), dtype=np.bool_)
    shifts: list[tuple[str, FloatArray]] = []
    for name, rollers, deviation in deviations:
        values = loads if name == "normal_force_offset" else getattr(averaged.inputs, name)
        values = values.reshape(-1, values.shape[-1])
        greatest = np.abs(values).max(axis=0)
        varies |= deviation > ROUND_OFF * greatest
        significant = deviation > least * greatest
        if not significant.any():
            continue
        chosen |= significant
        # a load and a friction coefficient are never below zero
        most = 0.9 * values.min(axis=0) if name in {"normal_force_offset", "friction"} else np.inf
        size = np.where(significant, np.minimum(deviation, most), 0.0)
        shifts.append((name, np.where(np.isin(problem.roller, rollers)[:, None], size, 0.0)))
    cylinders, all_rollers, energies = (np.zeros_like(values) for values in (*end.depths, first))
    places = chosen.nonzero()[0]
    if places.size:
        here, state, length = averaged.at(places), end.at(places), passes[places]
        part = here, state, loads[..., places]
        # where loads alone vary, the contacts of the end are those at their means
        known = all(name == "normal_force_offset" for name, *_ in deviations)
        mean = _wear(here, state.contacts, length) if known else _shifted_wear(*part, {}, length)
        for name, shift in shifts:
            less, more = (
                _shifted_wear(*part, {name: change}, length)
                for change in (-shift[:, places], shift[:, places])
            )
            cylinder, roller, energy = (
                0.5 * (low - 2.0 * mid + up) for low, mid, up in zip(less, mean, more, strict=True)
            )
            cylinders[:, :, places] += cylinder
            all_rollers[:, :, places] += roller
            energies[places] += energy
    return (cylinders, all_rollers), energies, varies


def biased_coarse_solution(end: WearState, coarse: WearState, bias: Depths) -> WearState:
    """Return the coarse-step solution with the uncertainty of the variation within a step.

    A part of the bias is added to the profile of the coarse-step solution, where further wear
    reduces it as it would in the test. Its sign is chosen so that it increases the difference of
    the two solutions and cannot cancel another error.

    Parameters
    ----------
    end, coarse : WearState
        The test and its coarse-step solution after the step.
    bias : tuple of ndarray
        Depths of the result of `variation_bias`.
    """
    differences = (one - other for one, other in zip(coarse.depths, end.depths, strict=True))
    along = sum(
        sum_in_order((a * b).sum(axis=-1), axis=axis).sum(axis=0)
        for axis, a, b in zip((0, 1), differences, bias, strict=True)
    )
    part = UNCERTAIN * np.where(along < 0.0, -1.0, 1.0)[:, None]
    return coarse.with_added((part * bias[0], part * bias[1]))


def _shifted_wear(
    problem: WearProblem,
    end: WearState,
    loads: FloatArray,
    shifts: dict[str, FloatArray],
    passes: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return wear and energy of some passes on the profiles of `end`, loads and inputs shifted.

    They are the depths of cylinder and rollers [m], and the energy [J].
    """
    values = {
        name: getattr(problem.inputs, name) + shift
        for name, shift in shifts.items()
        if name != "normal_force_offset"
    }
    shifted = problem.with_inputs(replace(problem.inputs, **values)) if values else problem
    contacts = solve_present(shifted, end, loads + shifts.get("normal_force_offset", 0.0))
    return _wear(shifted, contacts, passes)


def _wear(
    problem: WearProblem, contacts: ContactBatchSolution, passes: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return wear and energy of some passes, as `_shifted_wear`."""
    energy = problem.total_power(contacts.power) * (passes / problem.kinematics.pass_rate)
    return *worn_depths(problem, contacts, passes), energy


def half_quadrature(problem: WearProblem, state: WearState) -> tuple[WearProblem, WearState]:
    """Return problem and state with half the nodes of every roller, which are a quadrature too."""
    nodes = np.arange(len(problem.roller)).reshape(problem.rollers, -1)
    first = nodes[:, : nodes.shape[1] // 2].ravel()
    contacts = np.arange(len(state.contacts)).reshape(problem.shape)[:, first].ravel()
    half = with_contacts(problem, first)
    return replace(half, weight=2.0 * half.weight), state.replaced(
        contacts=state.contacts.at(contacts),
        coarse_step_solution=None,
        half_quadrature_solution=None,
        **{
            name: values.take(first, axis=axis)
            for name, axis in (("wear_exponents", 1), ("past_feedback", 2))
            if (values := getattr(state, name)) is not None
        },
    )


def with_pass_errors(
    problem: WearProblem,
    start: WearState,
    end: WearState,
    coarse: WearState,
    step: Step,
    passes: FloatArray,
) -> WearState:
    """Return `end` with the error estimates due to inputs drawn at every pass.

    The error of the quadrature is estimated by the difference to a solution with half the nodes
    per roller and the same steps as `coarse`, plus the part that both halves of the nodes share and
    that is known before the test. The draws of a finite number of passes scatter the volume, and
    the depth in proportion.

    Parameters
    ----------
    problem : WearProblem
    start, end : WearState
        The test before and after the step.
    coarse : WearState
        Solution after the step, by the same steps as the half-quadrature solution.
    step : callable
        Scheme of the half-quadrature solution, see `Step`.
    passes : ndarray, shape (realisations,)
        Length of the step.
    """
    halved, first = half_quadrature(problem, start)
    half = step(halved, start.half_quadrature_solution or first, passes)
    volume = volume_of(problem, end.depths)
    variance = start.scatter[1] + _volume_variance(problem, end, passes)
    relative = variance / np.square(np.where(volume > 0.0, volume, np.inf))
    greatest = greatest_depth(end.depths)
    return end.replaced(
        quadrature=state_difference(problem, coarse, half)
        + problem.quadrature_error * np.array([greatest, volume, np.ones_like(volume)]),
        scatter=np.array([np.square(greatest) * relative, variance, relative]),
        half_quadrature_solution=half,
    )


def _volume_variance(problem: WearProblem, end: WearState, passes: FloatArray) -> FloatArray:
    """Return the variance of the volume worn in some passes, shape (realisations,) [m^6]."""
    kinematics, spacing = problem.kinematics, problem.grid.spacing
    cylinder, roller = problem.depths_worn(end.contacts, dict.fromkeys(BODIES, 1.0))
    ratio = np.asarray(kinematics.roller_share * kinematics.physical_rollers)[..., None]
    volume = worn_volume(cylinder, spacing, kinematics.track.track_radius)
    volume = volume + worn_volume(roller * ratio, spacing, kinematics.roller_radius)
    # differences between the means of the rollers are not random
    deviation = volume - problem.per_roller(volume)[:, problem.roller]
    variance = (problem.cylinder_share[None, :, None] * deviation**2).sum(axis=1).max(axis=0)
    return np.asarray(passes * problem.passes_per_draw * variance)


def _allowance(
    tolerance: float, reached: float, exponent: float, error: float, part: float
) -> float:
    """Return the error that a step may add, by the budget that the tolerance leaves.

    Wear reduces earlier errors: a groove that is too deep in one place carries less load there, so
    that errors of shape decay while the groove deepens. The budget is therefore absolute in depth
    and is compared with the present error, not with the sum of all errors made.

    Parameters
    ----------
    tolerance : float
        Required relative error of the final depth and worn volume.
    reached : float
        Depth or volume at the step's end.
    exponent : float
        Lower bound of the exponent of its growth to the end of the test.
    error : float
        Its estimated error before the step.
    part : float
        Part of all passes done at the step's end.
    """
    budget = tolerance * reached / math.pow(part, exponent)
    return SHARE * max(budget - error, MIN_BUDGET * budget)


def excess(
    tolerance: float,
    problem: WearProblem,
    start: WearState,
    end: WearState,
    added: FloatArray,
    stop: float,
    reached: FloatArray | None = None,
) -> FloatArray:
    """Return the error that a step adds relative to its allowance, shape (realisations,).

    Wear reduces earlier errors. If `reached` is given, a step is also within its allowance where
    the total error is within that of a first step.

    Parameters
    ----------
    tolerance : float
        Required relative error of the final depth and worn volume.
    problem : WearProblem
    start, end : WearState
        The test before and after the step.
    added : ndarray, shape (3, realisations)
        Errors that the step adds, as of `sizes`; those of depth and volume are compared.
    stop : float
        Passes at the end of the test.
    reached : ndarray, shape (3, realisations), optional
        Errors after the step, at most `added` and the error before.
    """
    worst = np.zeros(problem.shape[2])
    parts = (end.passes / stop).tolist()
    grown = greatest_depth(end.depths), volume_of(problem, end.depths)
    # errors that a shorter step would not reduce must not shorten it
    before = np.array([start.depth_error, start.volume_error, start.profile_error])
    reducible = before - start.irreducible
    arrays = reducible, added, reducible + added if reached is None else reached
    for kind, exponent in enumerate((DEPTH_EXPONENT, VOLUME_EXPONENT)):
        columns = (a[kind].tolist() for a in (grown, *arrays))
        for v, (part, size, before, error, total) in enumerate(zip(parts, *columns, strict=True)):
            if size > 0.0:
                allowed = _allowance(tolerance, size, exponent, before, part)
                allowed_first = _allowance(tolerance, size, exponent, 0.0, part)
                worst[v] = max(worst[v], min(error / allowed, total / allowed_first))
    return worst
