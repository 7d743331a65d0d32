"""Panels of an ensemble: course, density, convergence, profile, lift error and Sobol indices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.panels import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    HEADROOM,
    ORANGE,
    Axis,
    Band,
    Bars,
    Line,
    Mark,
    Panel,
    Sheet,
    Span,
    Whiskers,
    convergence,
    depth_axes,
    dots,
    evenly_spaced,
    histogram,
    measured_marks,
    message,
)
from wearsim.report.text import (
    NINETY_PERCENT,
    OBSERVABLES,
    TOO_FEW_REALISATIONS,
    count,
    in_unit,
    number_of_realisations,
    shown,
    statistic_in_words,
    sufficient_for,
)
from wearsim.studies.cam.panels import ANGLE, segment_marks
from wearsim.studies.cam.turn import unchecked_turn_of
from wearsim.studies.ensemble.file.data import Effect
from wearsim.studies.ensemble.result import EnsembleResult
from wearsim.studies.ensemble.view import known_effects, no_effects
from wearsim.studies.fatigue.panels import DAMAGE
from wearsim.studies.fatigue.view import with_source_lines
from wearsim.studies.run.panels import HEIGHT, track_axis
from wearsim.types import FloatArray
from wearsim.units import engineers_unit
from wearsim.uq.estimation.estimates import Target
from wearsim.uq.estimation.intervals import UNKNOWN, Interval, arrays_of

LINES = 12  # realisations drawn as lines
MOST_POINTS = 2000
_MOST_EFFECTS = 14
_BELOW_LEGEND = 1.0 / (1.0 + HEADROOM)  # part of a histogram


def ensemble_sheet(result: EnsembleResult, measured: Sequence[Measured] = ()) -> Sheet:
    """Return the panels of an ensemble, finished or not.

    Measured profiles are drawn over the worn profile.
    """
    title = with_source_lines(f"{result.title}\n{_caption(result)}", result)
    if result.count == 0:
        nothing = message("", "no realisation is completed: nothing to draw")
        return Sheet(title, {"nothing": nothing}, [["nothing"]], (13.0, 7.5))
    curves = {
        "lift": ("lift_error_curve", _lift_error),
        "damage": ("cylinder_damage_profile", _damage),
    }
    known = result.raw.schema.variables if len(result.profiles) else ()
    drawn = {name: panel(result) for name, (curve, panel) in curves.items() if curve in known}
    lower = ["profile", *drawn, "effects"]
    return Sheet(
        title,
        {
            "density": _density(result),
            "course": _course(result),
            "convergence": _convergence(result),
            "profile": _profile(result, measured),
            **drawn,
            "effects": _effects(result),
            **draws_panels(result, "depth", result.at_end("depth"), Axis("depth at the end", "um")),
        },
        [["course", "density", "convergence"], lower],
        (13.0 if len(lower) < 4 else 17.0, 7.5),
        main="course",
    )


def _caption(result: EnsembleResult) -> str:
    requested, unfinished = (
        ("", "") if result.finished else (f" of {count(result.requested)}", ", unfinished")
    )
    text = (
        f"{number_of_realisations(result.count)}{requested}"
        f"{f' ({count(result.failed)} failed)' if result.failed else ''}, {result.raw.plan},"
        f" of {count(result.raw.total_passes)} roller passes"
        f" ({result.described_model}, {result.raw.stepper}{unfinished})"
    )
    if result.count == 0:
        return text
    depth, profile = result.estimate("depth", -1, NINETY_PERCENT), result.worn_profile()
    if result.count == 1:
        return f"{text}\ndepth {shown(depth.mean.value, 'um')}"
    text += f"\nmean depth {shown(depth.mean.value, 'um')}"
    if profile.start.any():
        text += (
            " worn since the start, mean profile"
            f" {shown(-float(profile.height.min()), 'um')} below nominal"
        )
    if result.is_constant("depth"):
        return f"{text}, equal in all realisations"
    text += f", std {shown(depth.std.value, 'um', 3)}"
    ends = [end for _, end in depth.quantiles]
    if not all(np.isfinite(end.half_width) for end in ends):
        return text
    return f"{text}, 90 % range {' to '.join(in_unit(end.value, 'um', 3) for end in ends)} um"


def _course(result: EnsembleResult) -> Panel:
    """Return depth against roller passes: median, mean, 90 % range and some realisations."""
    course = result.course("depth")
    drawn, x, y = depth_axes(course.passes, course.quantiles[0.5])
    passes, numbers = course.passes[drawn], result.numbers[:LINES]
    first = int(numbers[0])
    rows = result.raw.rows("depth", first, int(numbers[-1]) + 1)[numbers - first][:, drawn]
    low, median, high = (course.quantiles[p][drawn] for p in (0.05, 0.5, 0.95))
    lines = [
        Line(passes, median, label="median"),
        Line(passes, course.mean[drawn], "--", width=1.0, colour=BLACK, label="mean"),
    ]
    return Panel(
        "Depth against roller passes",
        x,
        y,
        _spread(passes, rows, low, high, lines, result.count),
        f"The median of the depth is {shown(float(median[-1]), 'um')} at the end.",
        legend="upper left",
    )


def _spread(
    x: FloatArray,
    some: FloatArray,
    low: FloatArray,
    high: FloatArray,
    lines: list[Line],
    number: int,
) -> list[Mark]:
    """Return curves of some realisations, and of all their 90 % range and further lines."""
    thin = Line(x, some, width=0.6, alpha=0.6, colour=GREY, label=number_of_realisations(len(some)))
    if number == 1:
        return [thin]
    is_sufficient = sufficient_for(number, NINETY_PERCENT[0])
    band = [Band(x, low, high, label="5 % to 95 %")] if is_sufficient else []
    return [thin, *band, *lines]


def _curves(x: FloatArray, curves: FloatArray, mean: FloatArray) -> list[Mark]:
    """Return the curves of some realisations, and of all their 90 % range and mean."""
    low, high = np.quantile(curves, NINETY_PERCENT, axis=0)
    return _spread(
        x, curves[:LINES], low, high, [Line(x, mean, colour=BLACK, label="mean")], len(curves)
    )


def _density(result: EnsembleResult) -> Panel:
    title, depth = "Depth at the end", result.at_end("depth")
    if result.count == 1 or result.is_constant("depth"):
        where = "the only realisation" if result.count == 1 else f"all {count(result.count)}"
        return message(title, f"{shown(float(depth.mean()), 'um')} in {where}: no density to draw")
    estimate = result.estimate("depth", -1, (0.05, 0.5, 0.95))
    low, median, high = (estimate.quantile(p).value for p in (0.05, 0.5, 0.95))
    lines: list[tuple[float, str, str, str]] = [
        (estimate.mean.value, BLACK, "--", f"mean {shown(estimate.mean.value, 'um')}"),
        (median, BLUE, "-", f"median {shown(median, 'um')}"),
        *(
            [(low, GREY, ":", "5 % and 95 %"), (high, GREY, ":", "")]
            if sufficient_for(result.count, NINETY_PERCENT[0])
            else []
        ),
    ]
    extremes = f"from {shown(float(depth.min()), 'um')} to {shown(float(depth.max()), 'um')}"
    return Panel(
        title,
        Axis("depth", "um"),
        Axis("probability density", "1/um", 1e-6, margin=(0.0, HEADROOM), limits=(0.0, None)),
        [
            histogram(depth)[0],
            *(
                Span(place, colour=colour, dash=dash, label=label, width=1.1, reach=_BELOW_LEGEND)
                for place, colour, dash, label in lines
            ),
        ],
        f"Depths of {count(len(depth))} tests, {extremes}.",
        legend="upper right",
        columns=2,
    )


def _convergence(result: EnsembleResult) -> Panel:
    """Return the convergence of the estimate of the target, by default of the mean depth."""
    target = Target.parse(result.until or "depth.mean 1%")
    words, unit = OBSERVABLES[target.observable]
    counts, intervals = result.convergence(target)
    value, low, high = arrays_of(intervals)
    labels = {-target.width: "", target.width: f"target: ±{100 * target.width:g} %"}
    return convergence(
        f"{statistic_in_words(target).capitalize()}, with 95 % interval",
        *(words, unit, counts, value, low, high),
        [
            Span(value[-1] * (1.0 + part), across="y", dash="--", colour=GREEN, label=label)
            for part, label in (labels.items() if result.until else ())
        ],
    )


def _profile(result: EnsembleResult, measured: Sequence[Measured]) -> Panel:
    """Return the mean worn profile with its 95 % range, and measured profiles over it."""
    profile = result.worn_profile()
    y, band = profile.y, Band(profile.y, profile.low, profile.high, label=profile.label)
    start = Line(y, profile.start, "--", width=1.0, colour=GREY, label="start of the tests")
    title = "Deepest groove at the end" if result.raw.cam else "Worn profile at the end"
    title += "" if profile.kept == result.count else f", of the first {count(profile.kept)}"
    deepest = shown(float((profile.start - profile.height).max()), "um")
    return Panel(
        title,
        track_axis(y, profile.start - profile.low, *(item.y for item in measured)),
        HEIGHT,
        [
            *([band] if profile.label else []),
            Line(y, profile.height, colour=BLACK, label="mean"),
            *([start] if profile.start.any() else []),
            *measured_marks(measured),
        ],
        f"Mean of {count(profile.kept)} profiles, {deepest} deep, and the band of the tests.",
        legend="lower right",
    )


def _damage(result: EnsembleResult) -> Panel:
    """Return the damage at the end: of a cam along its angle, of a cylinder across the track."""
    body, name, axis = (
        ("cam", "damage_curve", ANGLE)
        if result.raw.cam
        else ("cylinder", "cylinder_damage_profile", None)
    )
    band, curves = result.band(name), result.kept_values(name)
    mean = shown(result.estimate("cylinder_damage", -1, ()).mean.value, "1")
    return Panel(
        f"Damage of the {body} at the end",
        axis or track_axis(band.y, curves.max(axis=0)),
        DAMAGE,
        _curves(band.y, curves, band.mean),
        f"The greatest damage of the {body} is {mean} in the mean of {count(result.count)} tests.",
    )


def _lift_error(result: EnsembleResult) -> Panel:
    """Return the lift error at the end over the angle, relative to its mean over a turn."""
    curves = result.kept_values("lift_error_curve")
    # the last angle is the first one
    curves = curves - curves[:, :-1].mean(axis=1, keepdims=True)
    mean = shown(result.estimate("lift_error", -1, ()).mean.value, "um")
    return Panel(
        "Lift error at the end",
        ANGLE,
        Axis("difference from its mean", "um"),
        [
            *_curves(np.asarray(result.raw.variables["angle"]), curves, curves.mean(axis=0)),
            *segment_marks(unchecked_turn_of(result.scenario).cam.motion, names=False),
        ],
        f"Change of the lift by wear. Peak to peak it is {mean} in the mean of"
        f" {count(result.count)} tests.",
    )


def _effects(result: EnsembleResult) -> Panel:
    """Return first-order Sobol indices of the depth, and total indices if available."""
    title = "Sobol indices of the depth at the end"
    if why := no_effects(result):
        return message(title, why)
    return effects_panel(title, "the depth", result.sensitivity("depth"))


def effects_panel(title: str, of: str, effects: list[Effect]) -> Panel:
    """Return Sobol indices as bars with their intervals."""
    effects = effects[:_MOST_EFFECTS]
    places = np.arange(float(len(effects)))
    first, total = [item.first for item in effects], [item.total or UNKNOWN for item in effects]
    marks: list[Mark] = [
        Bars(
            *(places - 0.3, places + 0.3),
            [np.nan_to_num(index.value) for index in first],
            horizontal=True,
            colour=[GREY if item.without_effect else BLUE for item in effects],
            alpha=0.55,
        ),
        _intervals(places, first, BLACK),
    ]
    if any(item.total for item in effects):
        below, values = places + 0.38, [index.value for index in total]
        marks += [
            _intervals(below, total, ORANGE),
            dots(values, below, "D", colour=ORANGE, label="total, with interactions"),
        ]
    share = f"{100.0 * first[0].value:.0f} % of the variance"
    return Panel(
        title,
        Axis("first-order index: part of the variance", "%", limits=(0.0, 1.0)),
        Axis(
            ticks=places.tolist(),
            names=[_label(item) for item in effects],
            limits=(len(effects) - 0.4, -0.6),
        ),
        marks,
        f"{effects[0].name} explains {share} of {of}.",
        legend="lower right",
    )


def _label(item: Effect) -> str:
    if not np.isfinite(item.first.value):
        return f"{item.name} ({TOO_FEW_REALISATIONS})"
    return f"{item.name} (not significant)" if item.without_effect else item.name


def _intervals(places: FloatArray, intervals: list[Interval], colour: str) -> Whiskers:
    known = [np.isfinite(index.value) for index in intervals]
    low, high = (np.where(known, end, np.nan) for end in arrays_of(intervals)[1:].clip(0.0, 1.0))
    return Whiskers(places, low, high, horizontal=True, colour=colour)


def draws_panels(
    result: EnsembleResult, name: str, values: FloatArray, axis: Axis
) -> dict[str, Panel]:
    """Return the values of an observable against the input with the largest effect, for a page.

    Parameters
    ----------
    result : EnsembleResult
    name : str
        The observable, "depth" or "life".
    values : ndarray, shape (count,)
        Its values.
    axis : Axis
        Axis of the values.
    """
    if not (effects := known_effects(result, name)):
        return {}
    item = next(item for item in result.raw.inputs if item["input"] == effects[0].name)
    unit, size = engineers_unit(item["unit"])
    drawn = result.inputs[item["key"]].reshape(result.count, -1).mean(axis=1)
    finite = np.flatnonzero(np.isfinite(values))
    every = finite[evenly_spaced(len(finite), MOST_POINTS)]
    panel = Panel(
        f"{name.capitalize()} against {item['key']}",
        Axis(item["key"], unit, 1.0 / size),
        axis,
        [dots(drawn[every], values[every], alpha=0.5, more={"realisation": (every, "1")})],
        f"One point for each of {count(len(every))} tests.",
    )
    return {"draws": panel}
