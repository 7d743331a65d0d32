"""Errors of observables of wear tests, such as power and peak pressure, due to steps and strips.

The coarse test of `strip_errors` has strips of twice the width and a greater tolerance of its
steps. Its observables differ from those of the test by at least the errors of the test where these
are proportional to the width of the strips, and by three times as much where they are proportional
to its square. The error estimate is the greatest of the last differences times a safety factor,
since a peak pressure rises and falls as single strips come into contact. Depth and volume of a
roller have at least the relative error by strips of depth and volume of both bodies: single
differences may be small by chance, and both bodies are worn by the same contacts.

A load that varies in time differs between two steps from its values at them. Power, pressure and
approach are therefore compared after division by a power of the normal force, and the error of the
force is added. A force without feedback is known; of one with feedback the part due to it is
compared, or the whole force where that differs less.

At the edge of a groove the line load falls within a layer to zero. Where the layer is shorter than
the contact is long, the contact is shorter there under the same load, and its pressure higher.
Neither strips wider than the contact is long nor those of the coarse test resolve this peak, which
is added to the error of the pressure. Ends of rollers have such a peak where the groove reaches
them, under a line load that wear has made uniform.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from wearsim.evolution.problem import WearProblem
from wearsim.evolution.strip_errors import BACK, Course
from wearsim.types import FloatArray

# safety factor on the greatest of the last differences: the error of the coarse test may have the
# sign of that of the test. In the rig's test against rigid bodies, of the pressures of whole strips
# a factor of 1 covers 70 % to 80 %, and this factor at least 96 %
COVER = 1.5
# the same for free rollers. Their creepage is found from a sum of tractions of both signs, and the
# error of this sum may decrease more slowly than the width of the strips
COVER_OF_FREE = 2.5
# further factors on differences of peak pressures on a cylinder, of one roller and of several that
# differ: where the edge of a roller is in the groove of another, the pressure has a narrow peak
OF_PEAKS, OF_SEVERAL_PEAKS = 1.35, 2.0
# relative difference from other steps above which a pressure of the coarse test is a peak that the
# test does not have: where edges are resolved, the long steps of the coarse test raise its pressure
# by up to a half after strips have come into contact, while its errors by strips vary by 1 %
SPIKE = 0.03
#: observables whose relative error is at least that of the greatest depth or of the volume worn off
#: both bodies
OF_DEPTH, OF_VOLUME = ("roller_depth", "descent"), ("roller_worn_volume",)
#: exponents of the normal force in observables that depend on it, in a groove or a fresh contact
OF_FORCE = {"power": 1.0, "peak_pressure": 0.5, "elastic_approach": 0.75}
# relative peak at an edge without a layer; measured on grooves of crowns of 30 to 250 mm, on strips
# of a sixth of the half-length
ABRUPT_EDGE = 0.3
#: observables from which peaks at edges are estimated, with the width
OF_EDGES = ("peak_pressure", "normal_force", "elastic_approach", "descent")


def relative_crown_radius(problem: WearProblem) -> FloatArray | None:
    """Return the relative radius of the crowns of roller and cylinder.

    Returns
    -------
    ndarray, shape (contacts, realisations), optional
        [m]; None for cams, for rollers with several contacts, and where the gap is not that of
        crowns.
    """
    if problem.shape[0] > 1 or problem.has_nodes or not problem.has_crowned_gap:
        return None
    bend = np.median(np.diff(problem.nominal_gap, 2, axis=-1), axis=-1)
    return np.asarray(np.broadcast_to(problem.grid.spacing**2 / bend[0], problem.shape[1:]))


def load_before_feedback(problem: WearProblem, passes: FloatArray) -> FloatArray:
    """Return the load before feedback of a test on a cylinder at some passes, (points,) [N]."""
    loads = np.empty(len(passes))
    for place, done in enumerate(passes):
        time = problem.time(np.array([done]))
        here = problem.at_time(time, time)
        loads[place] = float((here.force(time) + here.inputs.normal_force_offset).mean())
    return loads


def observed_errors(
    coarse: Course | None,
    passes: FloatArray,
    observed: Mapping[str, FloatArray],
    sizes: FloatArray,
    by_strips: FloatArray,
    crown_radius: FloatArray | None = None,
    spacing: float = math.inf,
    roller_width: float = math.inf,
    load: Callable[[FloatArray], FloatArray] | None = None,
    feedback: bool = True,
    free: bool = False,
    cam: bool = False,
) -> dict[str, FloatArray]:
    """Return the estimated errors of observables of a test.

    Parameters
    ----------
    coarse : Course or None
        The coarse test with its observables; without it the errors are not known, nan.
    passes : ndarray, shape (points,)
        Rising, from the start of the test, 0.
    observed : mapping of str to ndarray, shape (points, ...)
        Observables of the test by name; angles end on "angle" [rad].
    sizes, by_strips : ndarray, shape (3, points)
        As of `strip_errors`: sizes of the test, and their errors by strips.
    crown_radius : ndarray, shape (rollers,), optional
        See `relative_crown_radius` [m]; None where peaks at edges are not estimated.
    spacing : float
        Width of the strips at the end [m].
    roller_width : float
        Width of the rollers without their edges [m].
    load : callable, optional
        Returns the load before feedback at some passes [N]; None for a constant one.
    feedback : bool
        Whether the normal force depends on wear or power.
    free, cam : bool
        Whether the rollers are free, and whether they are on a cam.
    """
    if not observed:
        return {}
    if coarse is None:
        return {name: np.full(values.shape, np.nan) for name, values in observed.items()}
    steps = np.array([0.0, *coarse.passes])
    # compared also at the steps of the test: its pressure may rise and fall within a coarse step
    after = passes[passes >= steps[1]] if len(steps) > 1 else passes[-1:]
    common = np.union1d(steps[steps < passes[-1]], np.append(after, passes[-1]))
    # interpolated over the logarithm of the passes, and over the passes themselves well before the
    # first step, where a pressure is that of the unworn bodies
    first = 0.01 * float(max(common[1:].min(initial=np.inf), 1e-300))
    at_steps, at_common, at_passes = (
        np.log1p(points / first) for points in (steps, common, passes)
    )
    differences, widths = [], []
    exponents = OF_FORCE if load is not None and "normal_force" in observed else {}
    for name in observed:
        fine_values, coarse_values = (
            _over_force(name, courses, len(points), exponents.get(name, 0.0))
            for courses, points in ((observed, passes), (coarse.observed, steps))
        )
        if name == "peak_pressure":
            at_coarse = _interpolated(at_steps, at_passes, fine_values)
            coarse_values = _without_spikes(coarse_values, at_coarse)
        fine = _interpolated(at_common, at_passes, fine_values)
        difference = np.abs(_interpolated(at_common, at_steps, coarse_values) - fine)
        if name.endswith("angle"):
            difference = np.minimum(difference, math.tau - difference)
        else:
            difference /= np.where(fine != 0.0, np.abs(fine), np.inf)
        if name == "normal_force" and not feedback:
            difference[:] = 0.0
        elif name == "normal_force" and load is not None:
            of_fine, of_coarse = (
                _between_pauses(force - load(points)[:, None], force)
                for points, force in ((passes, fine_values), (steps, coarse_values))
            )
            by_feedback = np.abs(
                _interpolated(at_common, at_steps, of_coarse)
                - _interpolated(at_common, at_passes, of_fine)
            )
            # both contain errors of interpolation
            difference = np.minimum(difference, by_feedback / np.where(fine != 0.0, fine, np.inf))
        differences.append(difference)
        widths.append(fine_values.shape[1])
    greatest = _greatest_of_last(common, np.concatenate(differences, axis=1))
    part = np.column_stack([np.interp(at_passes, at_common, column) for column in greatest.T])
    part *= COVER_OF_FREE if free else COVER
    estimates = dict(zip(observed, np.split(part, np.cumsum(widths)[:-1], axis=1), strict=True))
    if "peak_pressure" in estimates and not cam:
        several = estimates["peak_pressure"].shape[1] > 1
        estimates["peak_pressure"] *= OF_SEVERAL_PEAKS if several else OF_PEAKS
    worn = np.array([np.maximum(sizes[0], sizes[1]), sizes[2]])
    least = by_strips[:2] / np.where(worn > 0.0, worn, np.inf)
    errors, has_edges = {}, observed.keys() >= {"width", *OF_EDGES}
    peaks = edge_peaks(observed, crown_radius, spacing, roller_width) if has_edges else 0.0
    for name, values in observed.items():
        scale = 1.0 if name.endswith("angle") else np.abs(values)
        lowest = [
            bound
            for names, bound in zip((OF_DEPTH, OF_VOLUME), least, strict=True)
            if name in names
        ]
        relative = np.maximum(estimates[name], lowest[0][:, None]) if lowest else estimates[name]
        if name in exponents:
            of_force = estimates["normal_force"].max(axis=1, keepdims=True)
            relative = relative + exponents[name] * of_force
        errors[name] = relative.reshape(values.shape) * scale
        if name == "peak_pressure":
            errors[name] = errors[name] + scale * peaks
    return errors


def _over_force(name: str, observed: Mapping[str, Any], points: int, exponent: float) -> FloatArray:
    """Return an observable over a power of the normal force, as columns."""
    values = np.asarray(observed[name]).reshape(points, -1)
    if exponent == 0.0:
        return values
    force = np.reshape(observed["normal_force"], (points, -1)).mean(axis=1, keepdims=True)
    return _between_pauses(values / np.where(force > 0.0, force, 1.0) ** exponent, force)


def _without_spikes(coarse: FloatArray, fine: FloatArray) -> FloatArray:
    """Return columns of the coarse test without peaks of a step or two, see `SPIKE`.

    Their ratio to the test is there the median of five steps.
    """
    if len(coarse) < 6 or not (fine > 0.0).all():
        return coarse
    ratio = coarse[1:] / fine[1:]
    medians = np.median([ratio[k : len(ratio) - 4 + k] for k in range(5)], axis=0)
    medians = np.pad(medians, ((2, 2), (0, 0)), mode="edge")
    ratio = np.where(np.abs(ratio - medians) > SPIKE * medians, medians, ratio)
    return np.concatenate([coarse[:1], ratio * fine[1:]])


def _between_pauses(values: FloatArray, force: FloatArray) -> FloatArray:
    """Return columns whose values at points without force are interpolated from the others."""
    loaded = np.flatnonzero(force.mean(axis=1) > 0.0)
    if len(loaded) in {0, len(values)}:
        return values
    every = np.arange(len(values))
    return np.column_stack([np.interp(every, loaded, column[loaded]) for column in values.T])


def edge_peaks(
    observed: Mapping[str, FloatArray],
    crown_radius: FloatArray | None,
    spacing: float,
    roller_width: float,
) -> FloatArray:
    """Return relative peaks of the pressure that strips do not resolve, (points, rollers, ...).

    Parameters
    ----------
    observed : mapping of str to ndarray, shape (points, ...)
        `OF_EDGES` and "width".
    crown_radius, spacing, roller_width
        As of `observed_errors`.
    """
    peaks = np.zeros(observed["peak_pressure"].shape)
    if crown_radius is not None:
        peaks = _peaks_at_edges(observed, crown_radius, spacing)
    if math.isfinite(roller_width):
        peaks = np.maximum(peaks, _peaks_at_ends(observed, roller_width - 2.0 * spacing))
    return peaks


def _peaks_at_edges(
    observed: Mapping[str, FloatArray], crown_radius: FloatArray, spacing: float
) -> FloatArray:
    """Return relative peaks at the edges of grooves that strips do not resolve, (points, rollers).

    With the elastic approach w, the half-width b and the crown radius R of the groove, the layer is
    w R/b long. The half-length is N/(pi b p), as the line load is N/(2 b) and the pressure p.
    """
    shape = observed["peak_pressure"].shape
    pressure, force, elastic, worn = (
        np.maximum(observed[name].reshape(len(observed[name]), -1), 0.0) for name in OF_EDGES
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        layer = np.pi * crown_radius * elastic * pressure / force  # over the half-length
        width = spacing * np.pi * np.sqrt(2.0 * crown_radius * (worn + elastic)) * pressure / force
        in_groove = worn / (worn + elastic)
    peak = ABRUPT_EDGE * np.maximum(1.0 - layer, 0.0) * in_groove * np.minimum(width, 1.0)
    return np.asarray(np.nan_to_num(peak).reshape(shape))


def _peaks_at_ends(observed: Mapping[str, FloatArray], width: float) -> FloatArray:
    """Return relative peaks at ends of rollers that the groove has reached, as pressures."""
    worn, elastic = (np.maximum(observed[name], 0.0) for name in ("descent", "elastic_approach"))
    reached = observed["width"].reshape(len(worn), -1).max(axis=1) >= width
    in_groove = np.divide(worn, worn + elastic, out=np.zeros_like(worn), where=worn > 0.0)
    return np.asarray(ABRUPT_EDGE * in_groove * reached.reshape(-1, *[1] * (worn.ndim - 1)))


def _greatest_of_last(passes: FloatArray, errors: FloatArray) -> FloatArray:
    """Return the greatest of the last errors, which decay, as an error may cross zero.

    Parameters
    ----------
    passes : ndarray, shape (points,)
        Rising, from 0.
    errors : ndarray, shape (points, columns)
    """
    root, begin = np.sqrt(passes), np.searchsorted(passes, passes / BACK, side="right")
    greatest = errors.copy()
    for place in range(1, len(passes)):
        last = slice(begin[place], place + 1)
        greatest[place] = np.maximum.reduce(root[last, None] * errors[last]) / root[place]
    return greatest


def _interpolated(at: FloatArray, points: FloatArray, columns: FloatArray) -> FloatArray:
    """Return columns of values at points, by a power law where they are positive."""
    interpolated = []
    for values in columns.T:
        if (values > 0.0).all():
            interpolated.append(np.exp(np.interp(at, points, np.log(values))))
        elif (values[1:] > 0.0).all() and values[0] == 0.0 and len(values) > 1:
            # depth or volume: zero at the start, and a power law from the first step on
            logs = np.interp(at, points[1:], np.log(values[1:]))
            interpolated.append(
                np.where(at < points[1], np.interp(at, points, values), np.exp(logs))
            )
        else:
            interpolated.append(np.interp(at, points, values))
    return np.column_stack(interpolated)
