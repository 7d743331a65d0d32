"""Values of a state that a limit may bound: depths, volume, width, lift error, pressure."""

from __future__ import annotations

import numpy as np

from wearsim.contact_batch import ContactBatch
from wearsim.evolution.contacts import at_least, contact_batch
from wearsim.evolution.error_estimates import sizes, volume_of
from wearsim.evolution.pauses import opened
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import (
    Track,
    mean_along,
    sum_in_order,
    worn_volume,
)
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Stepper
from wearsim.evolution.steppers.loads import descents
from wearsim.evolution.steppers.single_step import (
    carried_loads,
    present_problem,
    solve_at_record,
)
from wearsim.mechanics.cam import Extreme, integral_error
from wearsim.types import FloatArray, IntArray

LEAST_PART = 0.1  # part of a strip in contact from which its pressure counts as the greatest
LEAST_STRIPS = 8  # strips in contact from which the loads of the outermost ones are corrected
STEEPER = 2.0  # greatest slope of the line load at an edge over that between the strips inside it


def present_contacts(
    stepper: Stepper, problem: WearProblem, state: WearState
) -> tuple[WearProblem, WearState, FloatArray]:
    """Return `state` with its contacts at the present loads, their problem, and the loads.

    If inputs are drawn at every pass, the contacts are those of the quadrature over passes.
    """
    recorded = stepper.recorded(problem)
    contacts, loads = solve_at_record(
        recorded,
        state,
        on_profile=not stepper.pass_by_pass,
        cold=recorded is not problem,
    )
    contacts, loads = opened(problem, state.passes, contacts, loads)
    return recorded, state.replaced(contacts=contacts), loads


def present_batch(problem: WearProblem, state: WearState) -> ContactBatch:
    """Return the contacts on the profiles of a state, under the loads that they carry."""
    present = present_problem(problem, state)
    loads = at_least(problem, carried_loads(problem, state.contacts))
    return contact_batch(present, present.gap(*state.depths), loads, *state.depths)


def lift_errors(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the change of the lift at every station, shape (stations, rollers, N) [m].

    The roller's centre moves by -D/cos(alpha) along its path, with the rise D of the least gap of
    the unloaded bodies, and by +D/cos(alpha) on the inner flank of a groove.
    """
    track = problem.kinematics.track
    descent = problem.per_roller(descents(problem, state.depths))
    return np.asarray(-np.sign(track.load_factor) * descent / np.cos(track.pressure_angle))


def peak_to_peak(track: Track, errors: FloatArray) -> FloatArray:
    """Return greatest less smallest lift error over the angle, shape (rollers, N) [m]."""
    least, most = track.greatest_value(np.stack([-errors, errors], axis=1))
    return np.asarray(most + least)


def extremes(problem: WearProblem, state: WearState) -> dict[str, Extreme]:
    """Return extremes over the angle of a cam, with their angles, by name.

    They are the "depth", of shape (realisations,) [m], and of shape (rollers, realisations) the
    "peak_pressure" of the contacts of the state [Pa], and greatest and smallest lift error as
    "least_wear" and "greatest_wear" [m], the last with its sign changed.
    """
    track, errors = problem.kinematics.track, lift_errors(problem, state)
    return {
        "depth": track.greatest(state.cylinder_depth[:, 0].max(axis=-1)),
        "peak_pressure": track.greatest(peak_pressures(problem, state)),
        "least_wear": track.greatest(errors),
        "greatest_wear": track.greatest(-errors),
    }


def depth_error_by_stations(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the error of the greatest depth between the stations of a cam, (realisations,) [m]."""
    return np.nan_to_num(
        problem.kinematics.track.greatest(state.cylinder_depth[:, 0].max(axis=-1)).error
    )


def volume_error_by_stations(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the error of the volume worn off both bodies by a sum over the stations of a cam.

    The relative error is that of the integral of the worn cross-section over the cam's surface,
    shape (realisations,) [m^3].
    """
    cam = problem.kinematics.track
    if cam.panels is None:
        return np.zeros(len(state.passes))
    area = state.cylinder_depth[:, 0].sum(axis=-1)[cam.places]
    weight = cam.panels.weight[:, None]
    per_angle = area * cam.along.length[:, 0] / weight
    total = sum_in_order(weight * per_angle, axis=0)
    relative = integral_error(cam.panels, per_angle) / np.where(total > 0.0, total, np.inf)
    return np.asarray(relative * volume_of(problem, state.depths))


def errors_of_simultaneous_passes(
    stepper: Stepper, problem: WearProblem, state: WearState
) -> FloatArray:
    """Return the errors of steps in which different rollers pass at the same time.

    They pass one after another, and the last turn may be incomplete: at any number of passes, each
    of R rollers has made up to (R - 1)/R passes more or fewer than an R-th of them. The errors are
    bounds of the wear by these passes. Those of the volume nearly cancel, as all passes together
    are counted exactly.

    Returns
    -------
    ndarray, shape (3, realisations)
        Of depth [m], volume [m^3] and profile, relative, as `sizes`.
    """
    if stepper.pass_by_pass or problem.rollers == 1:
        return np.zeros((3, state.passes.size))
    cylinder, roller = problem.sum_of_parts(*problem.wear_parts(state.contacts, 1.0))
    errors = np.abs(sizes(problem, state, np.concatenate([cylinder[:, 0], roller[0]])))
    errors[[0, 2]] *= np.minimum(problem.kinematics.physical_rollers - 1.0, state.passes)
    errors[1] *= np.minimum(1.0, state.passes)
    return errors


def errors_before_strips(
    stepper: Stepper, problem: WearProblem, state: WearState
) -> tuple[FloatArray, FloatArray]:
    """Return the errors of depth [m] and volume [m^3] without those by strips, (realisations,)."""
    of_depth, of_volume, _ = errors_of_simultaneous_passes(stepper, problem, state)
    of_depth = of_depth + depth_error_by_stations(problem, state)
    of_volume = of_volume + volume_error_by_stations(problem, state)
    return state.depth_error + of_depth, state.volume_error + of_volume


def depth(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest depth of the cylinder, shape (realisations,) [m]."""
    return problem.kinematics.track.greatest_value(state.cylinder_depth[:, 0].max(axis=-1))


def roller_depth(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest depth of a roller, shape (realisations,) [m]."""
    return np.asarray(state.roller_depth.max(axis=(0, 1, 3)))


def volume(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the worn volume of the cylinder, shape (realisations,) [m^3]."""
    radius, spacing = problem.kinematics.track.track_radius, problem.grid.spacing
    return np.asarray(mean_along(worn_volume(state.cylinder_depth, spacing, radius), axis=0)[0, 0])


def groove_width(problem: WearProblem, state: WearState, threshold: float) -> FloatArray:
    """Return the width of the groove deeper than `threshold` [m], (realisations,) [m]."""
    return problem.kinematics.track.greatest_value(
        width(problem.grid.y, state.cylinder_depth[:, 0], threshold)
    )


def lift_error(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest lift error, peak to peak over a turn, shape (realisations,) [m].

    It is 0 for a cylinder.
    """
    return np.asarray(
        peak_to_peak(problem.kinematics.track, lift_errors(problem, state)).max(axis=0)
    )


def worn_descents(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the worn descent of each contact's roller, shape (S, C, N) [m].

    The least gaps are those between strips, where a roller that is tilted or beside its groove
    touches first.
    """
    return np.asarray(
        least_gaps(problem, problem.gap(*state.depths)) - least_gaps(problem, problem.nominal_gap)
    )


def least_gaps(problem: WearProblem, gaps: FloatArray) -> FloatArray:
    """Return the least gaps over the last axis, the strips, interpolated between these.

    Where loads have springs, they are the least gaps of strips, from which the loads follow.
    """
    return np.asarray(gaps.min(axis=-1) if problem.has_spring else -greatest_between(-gaps))


def clearance(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest worn descent of a roller, shape (realisations,) [m]."""
    return np.asarray(
        problem.kinematics.track.greatest_value(worn_descents(problem, state)).max(axis=0)
    )


def peak_pressures(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest pressure of the contacts of a state at every station, (S, R, N) [Pa].

    A strip that the edge of a contact crosses carries its load on the part that is in contact.
    Where strips are in contact as wholes, the outermost one also carries the load of the part that
    the edge has crossed of the next one.
    """
    values = problem.values_of(state.contacts, "peak_pressure")
    if state.separation is None and state.contacts.separation is not None:
        return problem.per_roller(values * _on_next_strips(problem, state))
    if state.part is None:
        return problem.per_roller(values)
    load, half = (problem.values_of(state.contacts, n) for n in ("line_load", "half_length"))
    # the square of the pressure is proportional to the line load where the bodies are smooth
    square = np.square(2.0 / np.pi * load / np.where(half > 0.0, half, np.inf))
    greatest_square = square.max(axis=-1)
    for side in (slice(None), slice(None, None, -1)):
        part, from_edge = state.part[..., side], square[..., side]
        crossed, inner, next_inner = from_edge[..., 2:], from_edge[..., 1:-1], from_edge[..., :-2]
        at_edge = (part[..., 2:] >= LEAST_PART) & (part[..., 2:] < 1.0)
        at_edge &= (part[..., 1:-1] >= 1.0) & (part[..., :-2] >= 1.0)
        # the load of a strip of which little is in contact is uncertain
        most = inner + STEEPER * np.maximum(inner - next_inner, 0.0)
        square_at_edge = np.minimum(crossed / np.where(at_edge, part[..., 2:], 1.0), most)
        greatest_square = np.maximum(greatest_square, (square_at_edge * at_edge).max(axis=-1))
    return problem.per_roller(np.maximum(values, np.sqrt(greatest_square)))


def _on_next_strips(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest pressure if the outermost loads extend to a part of the next strips.

    It is relative to the greatest pressure on whole strips, shape (S, C, N). The edge of a contact
    has crossed the part 1/2 - s/r of a strip with the separation s in its middle, which rises by r
    to the next strip. Of a strip that has just come into contact it has crossed half, until the
    strip carries half the load of its inner neighbour.
    """
    names = "line_load", "half_length", "separation"
    load, half, separations = (problem.values_of(state.contacts, name) for name in names)
    square = np.square(load / np.where(half > 0.0, half, np.inf))
    most = square.max(axis=-1)
    several = (load > 0.0).sum(axis=-1, keepdims=True) >= LEAST_STRIPS
    for side in (slice(None), slice(None, None, -1)):
        from_edge, separation = square[..., side], separations[..., side]
        inner, outer, free = from_edge[..., :-3], from_edge[..., 1:-2], from_edge[..., 2:-1]
        at_edge = (outer > 0.0) & (free == 0.0) & several
        with np.errstate(invalid="ignore"):  # infinite beyond the end of a roller
            rise = separation[..., 3:] - separation[..., 2:-1]
            known = at_edge & (rise > 0.0) & (rise < np.inf)
            crossed = 0.5 - separation[..., 2:-1] / np.where(known, rise, 1.0)
        young = known & (outer < 0.5 * inner)
        part = 1.0 + np.where(known & ~young, np.clip(crossed, 0.0, 0.5), 0.0)
        from_edge[..., :-3] = np.where(young, (inner + outer) / 1.5, inner)
        from_edge[..., 1:-2] /= part
    return np.asarray(np.sqrt(square.max(axis=-1) / np.where(most > 0.0, most, 1.0)))


def peak_pressure(stepper: Stepper, problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest pressure at the present loads, shape (realisations,) [Pa]."""
    recorded, state, _ = present_contacts(stepper, problem, state)
    return np.asarray(
        recorded.kinematics.track.greatest_value(peak_pressures(recorded, state)).max(axis=0)
    )


def width(y: FloatArray, worn: FloatArray, threshold: float) -> FloatArray:
    """Return the extent of grooves, shape (..., strips), deeper than `threshold`, (...) [m].

    The crossing is interpolated linearly between strips, so that the width grows continuously.
    """
    rows, last = worn.reshape(-1, len(y)), len(y) - 1
    above = rows > threshold
    ends = above.argmax(axis=1), last - above[:, ::-1].argmax(axis=1)
    left, right = (
        _crossing(y, rows, threshold, inner, np.minimum(np.maximum(inner + side, 0), last))
        for inner, side in zip(ends, (-1, 1), strict=True)
    )
    return np.where(above.any(axis=1), right - left, 0.0).reshape(worn.shape[:-1])


def _crossing(
    y: FloatArray, rows: FloatArray, threshold: float, inner: IntArray, outer: IntArray
) -> FloatArray:
    """Return where the depths of each row fall to a threshold between two strips [m]."""
    row = np.arange(len(rows))
    high, low = rows[row, inner], rows[row, outer]
    part = (high - threshold) / np.where(high > low, high - low, np.inf)
    return np.asarray(y[inner] + part * (y[outer] - y[inner]))


def centroid(y: FloatArray, worn: FloatArray) -> float:
    """Return the axial position of the worn area's centroid [m], or 0 without wear."""
    total = worn.sum()
    return float(np.dot(y, worn) / total) if total > 0.0 else 0.0


def greatest_between(values: FloatArray) -> FloatArray:
    """Return the greatest values over the last axis, the strips, interpolated between these.

    The interpolation is a parabola through the greatest value and its neighbours.
    """
    rows = values.reshape(-1, values.shape[-1])
    row, place, last = np.arange(len(rows)), rows.argmax(axis=1), rows.shape[1] - 1
    top, inner = rows[row, place], (place > 0) & (place < last)
    before, after = rows[row, place - inner], rows[row, place + inner]
    inner &= np.isfinite(before) & np.isfinite(after)  # a gap is infinite beyond a roller's end
    before, after = np.where(inner, before, top), np.where(inner, after, top)
    curvature = 2.0 * top - before - after
    rise = np.square(after - before) / (8.0 * np.where(curvature > 0.0, curvature, np.inf))
    return np.asarray((top + rise).reshape(values.shape[:-1]))
