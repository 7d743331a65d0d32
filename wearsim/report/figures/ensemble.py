"""Figures of an ensemble and of a comparison of runs and ensembles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.figures.cam import name_segments
from wearsim.report.measured import ComputedProfile, Measured, computed_profile
from wearsim.report.parts import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    draw_convergence,
    draw_measured,
    lift_curves,
    name_axes,
    set_depth_axes,
    titled_figure,
    write_message,
)
from wearsim.report.text import (
    NINETY_PERCENT,
    OBSERVABLES,
    PER_SI,
    TOO_FEW_REALISATIONS,
    count,
    in_unit,
    number_of_realisations,
    shown,
    statistic_in_words,
    sufficient_for,
    too_few,
)
from wearsim.results import EnsembleResult
from wearsim.results.ensemble.data import Effect
from wearsim.results.ensemble.schema import PENDING
from wearsim.studies.cam.turn import CamTurn
from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.estimates import Target
from wearsim.uq.estimation.intervals import UNKNOWN, Interval

UM, MM = PER_SI["um"], PER_SI["mm"]
LINES = 12  # realisations drawn as lines
_MOST_CLASSES = 60
_MOST_EFFECTS = 14
_WORN = 1e-3  # part of the greatest depth beyond which the profile is drawn,
_MARGIN = 0.08  # with this margin, relative to its width
_HEADROOM = 1.3  # height of the density's panel relative to its highest class, for the legend
_DEFAULT = "depth.mean 1%"


def ensemble_figure(result: EnsembleResult, measured: Sequence[Measured] = ()) -> Figure:
    """Return the figure of an ensemble.

    Parameters
    ----------
    result : EnsembleResult
        Finished or not.
    measured : sequence of Measured
        Profiles drawn over the worn profile.

    Returns
    -------
    Figure
        Five panels: depth against roller passes, density of the depth at the end, convergence of
        the estimate, mean worn profile, and Sobol indices of the depth; of a cam a sixth, the lift
        error over the angle; a message if no realisation is completed.
    """
    found = computed_profile(result)
    with titled_figure(13.0, 7.5, f"{result.title}\n{_caption(result, found)}") as figure:
        if result.count == 0:
            write_message(figure.subplots(), "", ["no realisation is completed: nothing to draw"])
            return figure
        # subfigures, since the rows have different columns
        upper, lower = np.ravel(np.array(figure.subfigures(2, 1)))
        course, density, convergence = upper.subplots(1, 3)
        profile, *angle, effects = lower.subplots(1, 3 if result.raw.cam and found.kept else 2)
        draw_course(course, result)
        _draw_density(density, result)
        _draw_convergence(convergence, result)
        _draw_profile(profile, result, found, measured)
        _draw_effects(effects, result)
        for axes in angle:
            _draw_lift_error(axes, result)
    return figure


def _caption(result: EnsembleResult, found: ComputedProfile) -> str:
    requested, unfinished = f" of {count(result.requested)}", ", unfinished"
    if result.finished:
        requested = unfinished = ""
    text = (
        f"{number_of_realisations(result.count)}{requested}"
        f"{f' ({count(result.failed)} failed)' if result.failed else ''}, {result.raw.plan},"
        f" of {count(result.raw.total_passes)} roller passes"
        f" ({result.described_model}, {result.raw.stepper}{unfinished})"
    )
    if result.count == 0:
        return text
    depth = result.estimate("depth", -1, NINETY_PERCENT)
    if result.count == 1:
        return f"{text}\ndepth {shown(depth.mean.value, 'um')}"
    text += f"\nmean depth {shown(depth.mean.value, 'um')}"
    if found.start.any():
        lowest = shown(-float(found.height.min()), "um")
        text += f" worn since the start, mean profile {lowest} below nominal"
    if result.is_constant("depth"):
        return f"{text}, equal in all realisations"
    text += f", std {shown(depth.std.value, 'um', 3)}"
    ends = [end for _, end in depth.quantiles]
    if not all(np.isfinite(end.half_width) for end in ends):
        return text
    return f"{text}, 90 % range {' to '.join(in_unit(end.value, 'um', 3) for end in ends)} um"


def draw_course(axes: Axes, result: EnsembleResult) -> None:
    """Draw depth against roller passes: median, mean, 90 % range and some realisations."""
    course = result.course("depth")
    drawn, unit, name = set_depth_axes(axes, course.passes, course.quantiles[0.5])
    passes = course.passes[drawn] / unit
    numbers = result.numbers[:LINES]
    first = int(numbers[0])
    rows = result.raw.rows("depth", first, int(numbers[-1]) + 1)[numbers - first][:, drawn] * UM
    lines = axes.plot(passes, rows.T, color=GREY, lw=0.6, alpha=0.6)
    lines[0].set_label(number_of_realisations(len(rows)))
    if result.count > 1:
        low, median, high = (course.quantiles[p][drawn] * UM for p in (0.05, 0.5, 0.95))
        if sufficient_for(result.count, NINETY_PERCENT[0]):
            axes.fill_between(passes, low, high, color=BLUE, alpha=0.25, lw=0, label="5 % to 95 %")
        axes.plot(passes, median, color=BLUE, label="median")
        axes.plot(passes, course.mean[drawn] * UM, color="black", ls="--", lw=1.0, label="mean")
    name_axes(axes, "Depth against roller passes", name, "depth [um]")
    axes.legend(loc="upper left")


def _draw_density(axes: Axes, result: EnsembleResult) -> None:
    title, depth = "Depth at the end", result.at_end("depth")
    if result.count == 1 or result.is_constant("depth"):
        where = "the only realisation" if result.count == 1 else f"all {count(result.count)}"
        text = f"{shown(float(depth.mean()), 'um')} in {where}: no density to draw"
        write_message(axes, title, [text])
        return
    # Rice's rule
    classes = int(np.clip(np.ceil(2.0 * len(depth) ** (1.0 / 3.0)), 5, _MOST_CLASSES))
    axes.hist(depth * UM, classes, density=True, color=BLUE, alpha=0.45, label="realisations")
    found = result.estimate("depth", -1, (0.05, 0.5, 0.95))
    low, median, high = (found.quantile(p).value for p in (0.05, 0.5, 0.95))
    marks: list[tuple[float, str, str, str | None]] = [
        (found.mean.value, "black", "--", f"mean {shown(found.mean.value, 'um')}"),
        (median, BLUE, "-", f"median {shown(median, 'um')}"),
    ]
    if sufficient_for(result.count, NINETY_PERCENT[0]):
        marks += [(low, GREY, ":", "5 % and 95 %"), (high, GREY, ":", None)]
    for place, colour, style, label in marks:
        axes.axvline(place * UM, 0.0, 1 / _HEADROOM, color=colour, ls=style, lw=1.1, label=label)
    name_axes(axes, title, "depth [um]", "probability density [1/um]")
    axes.set_ylim(top=_HEADROOM * axes.get_ylim()[1])
    axes.legend(loc="upper right", ncols=2)


def convergence_of(
    result: EnsembleResult, target: Target, points: int = 40
) -> tuple[IntArray, list[Interval]]:
    """Return the estimates from the first realisations of an ensemble, for rising numbers of them.

    Parameters
    ----------
    result : EnsembleResult
        With at least one completed realisation.
    target : Target
        Quantity to estimate.
    points : int
        Approximate number of sample sizes, evenly spaced in their logarithm.

    Returns
    -------
    counts : ndarray of int
        Numbers of completed realisations.
    intervals : list of Interval
    """
    spaced = np.geomspace(1, result.count, min(points, result.count))
    counts = np.unique(spaced.round().astype(np.int64))
    raw, name = result.raw, target.observable
    # kept in memory, since a file's arrays are read again at every access
    held = {name: raw.column(name, -1)[:, None]}
    held |= {"control": raw.variables["control"]} if raw.control else {}
    numbers, found = np.arange(raw.requested), []
    for last in result.numbers[counts - 1]:
        status = np.where(numbers <= last, raw.status, PENDING)
        part = replace(result, raw=replace(raw, variables=held, status=status))
        found.append(target.interval(part.estimate_for(target)))
    return counts, found


def _draw_convergence(axes: Axes, result: EnsembleResult) -> None:
    """Draw the convergence of the estimate of the target, by default of the mean depth."""
    target = Target.parse(result.until or _DEFAULT)
    named = OBSERVABLES[target.observable]
    counts, found = convergence_of(result, target)
    value, low, high = (
        np.array([getattr(item, end) for item in found]) * named.per_si
        for end in ("value", "low", "high")
    )
    draw_convergence(axes, counts, value, low, high)
    if result.until:
        label = f"target: ±{100 * target.width:g} %"
        axes.axhline(value[-1] * (1.0 - target.width), color=GREEN, lw=1.0, ls="--")
        axes.axhline(value[-1] * (1.0 + target.width), color=GREEN, lw=1.0, ls="--", label=label)
        axes.legend(loc="upper right")
    title = f"{statistic_in_words(target).capitalize()}, with 95 % interval"
    name_axes(axes, title, "realisations", named.label)


def _draw_profile(
    axes: Axes, result: EnsembleResult, found: ComputedProfile, measured: Sequence[Measured]
) -> None:
    """Draw the mean worn profile with its 95 % range, and measured profiles over it."""
    y = found.y * MM
    if found.label:
        low, high = found.low * UM, found.high * UM
        axes.fill_between(y, low, high, color=BLUE, alpha=0.25, lw=0, label=found.label)
    axes.plot(y, found.height * UM, color="black", label="mean")
    if found.start.any():
        axes.plot(y, found.start * UM, color=GREY, lw=1.0, ls="--", label="start of the tests")
    draw_measured(axes, measured)
    depth = found.start - found.low
    worn = y[depth > _WORN * max(float(depth.max()), 0.0)]
    if len(worn) > 1:
        margin = _MARGIN * (worn[-1] - worn[0])
        points = [profile.y * MM for profile in measured]
        axes.set_xlim(
            min([worn[0] - margin, *(float(ends.min()) for ends in points)]),
            max([worn[-1] + margin, *(float(ends.max()) for ends in points)]),
        )
    title = "Deepest groove at the end" if result.raw.cam else "Worn profile at the end"
    title += "" if found.kept == result.count else f", of the first {count(found.kept)}"
    name_axes(axes, title, "y [mm]", "height above nominal [um]")
    axes.legend(loc="lower right")


def _draw_lift_error(axes: Axes, result: EnsembleResult) -> None:
    """Draw the lift error at the end over the angle, relative to its mean over a turn."""
    angle, curves = lift_curves(result)
    lines = axes.plot(angle, curves[:LINES].T * UM, color=GREY, lw=0.6, alpha=0.6)
    lines[0].set_label(number_of_realisations(len(lines)))
    if len(curves) > 1:
        low, high = np.quantile(curves, NINETY_PERCENT, axis=0) * UM
        if sufficient_for(len(curves), NINETY_PERCENT[0]):
            axes.fill_between(angle, low, high, color=BLUE, alpha=0.25, lw=0, label="5 % to 95 %")
        axes.plot(angle, curves.mean(axis=0) * UM, color="black", label="mean")
    name_segments(axes, CamTurn(result.scenario).cam.motion, names=False)
    name_axes(axes, "Lift error at the end", "angle [deg]", "difference from its mean [um]")
    axes.legend(loc="best")


def _draw_effects(axes: Axes, result: EnsembleResult) -> None:
    """Draw first-order Sobol indices with intervals, and total indices if available."""
    effects, title = result.sensitivity("depth"), "Sobol indices of the depth at the end"
    if result.count == 1 or not any(np.isfinite(item.first.value) for item in effects):
        write_message(axes, title, [too_few(result)])
        return
    if result.is_constant("depth"):
        write_message(axes, title, ["none, the depth is equal in all realisations"])
        return
    effects = effects[:_MOST_EFFECTS]
    places = np.arange(float(len(effects)))
    colours = [GREY if item.without_effect else BLUE for item in effects]
    first, total = [item.first for item in effects], [item.total or UNKNOWN for item in effects]
    widths = [100.0 * np.nan_to_num(index.value) for index in first]
    axes.barh(places, widths, 0.6, color=colours, alpha=0.55)
    _draw_intervals(axes, places, first, "black")
    if any(item.total for item in effects):
        below = np.asarray(places + 0.38, dtype=np.float64)
        _draw_intervals(axes, below, total, ORANGE)
        values = [100.0 * index.value for index in total]
        label = "total, with interactions"
        axes.plot(values, below, "D", color=ORANGE, ms=4.0, label=label)
        axes.legend(loc="lower right")
    axes.set_yticks(places, [_label(item) for item in effects])
    for tick, item in zip(axes.get_yticklabels(), effects, strict=True):
        tick.set_color("black" if tick.get_text() == item.name else GREY)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    name_axes(axes, title, "first-order index: part of the variance [%]", "")


def _label(item: Effect) -> str:
    if not np.isfinite(item.first.value):
        return f"{item.name} ({TOO_FEW_REALISATIONS})"
    return f"{item.name} (not significant)" if item.without_effect else item.name


def _draw_intervals(axes: Axes, places: FloatArray, found: list[Interval], colour: str) -> None:
    known = [np.isfinite(index.value) for index in found]
    ends = np.clip([[index.low for index in found], [index.high for index in found]], 0.0, 1.0)
    axes.plot(np.where(known, 100.0 * ends, np.nan), [places, places], color=colour, lw=1.0)
