"""Interactive figures of ensembles, of studies of one contact, and of comparisons."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from bokeh.models.annotations import Whisker
from bokeh.models.ranges import Range1d
from bokeh.models.tickers import BasicTicker

from wearsim.report.measured import Measured, computed_profile
from wearsim.report.page.plots import (
    COLOURS,
    MM,
    MOST_POINTS,
    UM,
    W_MM,
    Plot,
    add_measured,
    axes,
    columns,
    hover,
    in_degrees,
    legend,
    pass_axes,
    worn_range,
)
from wearsim.report.parts import BLUE, GREY, evenly_spaced, lift_curves
from wearsim.report.text import count, shown, sufficient_for
from wearsim.results import DissipationResult, EnsembleResult, Result
from wearsim.results.ensemble.data import Effect
from wearsim.studies.ensemble.compare import Comparison
from wearsim.types import FloatArray
from wearsim.units import engineers_unit

LEAST_CLASSES, MOST_CLASSES = 5, 60
WIDTH: dict[str, Any] = {
    "lower": "low",
    "upper": "high",
    "dimension": "width",
}  # of whiskers along the x axis


def ensemble_plots(result: EnsembleResult, measured: Sequence[Measured]) -> list[Plot]:
    """Return the figures of an ensemble: density, course, profile, inputs and Sobol indices."""
    if result.count == 0:
        return []
    plots = [_course(result), _band(result, measured)]
    plots += [_lift_error(result)] if result.raw.cam and len(result.profiles) else []
    if result.count > 1 and not result.is_constant("depth"):
        plots = [
            _density(result),
            *plots,
            *effect_plots(result, "depth", result.at_end("depth") * UM),
        ]
    return plots


def _histogram(values: FloatArray, x: str, y: str, tips: Sequence[tuple[str, str]]) -> Any:
    """Return axes with a histogram, and the greatest number in a class."""
    # Rice's rule
    classes = int(np.clip(2.0 * len(values) ** (1.0 / 3.0), LEAST_CLASSES, MOST_CLASSES))
    number, edges = np.histogram(values, classes)
    part = 100.0 * number / len(values)
    data = columns(left=edges[:-1], right=edges[1:], number=number, part=part)
    plot = axes(x, y)
    style = {"fill_color": BLUE, "fill_alpha": 0.5, "line_color": "white"}
    bars = plot.quad(left="left", right="right", top="number", bottom=0.0, source=data, **style)
    hover(plot, [bars], *tips)
    return plot, int(number.max())


def _density(result: EnsembleResult) -> Plot:
    """Return the histogram of the depth, with its mean and quantiles."""
    depth = result.at_end("depth")
    tips = [("depth", "@left{0.00} to @right{0.00} um"), ("tests", "@number, @part{0.0} %")]
    plot, most = _histogram(depth * UM, "depth at the end [um]", "number of tests", tips)
    found = result.estimate("depth", -1, (0.05, 0.5, 0.95))
    lines = [
        ("mean", found.mean.value, "black", "dashed"),
        ("median", found.quantile(0.5).value, BLUE, "solid"),
    ]
    if sufficient_for(result.count, 0.05):
        ends = [(f"{100.0 * p:g} %", found.quantile(p).value) for p in (0.05, 0.95)]
        lines += [(name, value, GREY, "dotted") for name, value in ends]
    for name, value, colour, dash in lines:
        label = f"{name} {shown(value, 'um')}"
        style = {"color": colour, "width": 2, "line_dash": dash, "legend_label": label}
        plot.line([value * UM] * 2, [0.0, 1.05 * most], **style)
    legend(plot)
    range_ = f"from {shown(float(depth.min()), 'um')} to {shown(float(depth.max()), 'um')}"
    text = f"Depths of {count(len(depth))} tests, {range_}."
    return Plot("Depth at the end of all tests", text, plot)


def _course(result: EnsembleResult) -> Plot:
    """Return depth against passes: median, mean and 90 % range."""
    course = result.course("depth")
    median = course.quantiles[0.5]
    plot, drawn, unit = pass_axes(course.passes, median, "depth [um]")
    data = columns(
        x=course.passes[drawn] / unit,
        passes=course.passes[drawn],
        mean=course.mean[drawn] * UM,
        low=course.quantiles[0.05][drawn] * UM,
        median=median[drawn] * UM,
        high=course.quantiles[0.95][drawn] * UM,
    )
    tips = [("passes", "@passes{0,0}"), ("mean", "@mean{0.00} um"), ("median", "@median{0.00} um")]
    if sufficient_for(result.count, 0.05):
        _area(plot, "x", data, BLUE, "5 % to 95 %")
        tips.append(("5 % to 95 %", "@low{0.00} to @high{0.00} um"))
    style = {"color": "black", "line_dash": "dashed", "legend_label": "mean"}
    plot.line("x", "mean", source=data, **style)
    line = plot.line("x", "median", source=data, color=BLUE, width=2, legend_label="median")
    line.level = "underlay"
    hover(plot, [plot.scatter("x", "median", source=data, color=BLUE, size=5)], *tips)
    legend(plot)
    text = f"The median of the depth is {shown(float(median[-1]), 'um')} at the end."
    return Plot("Depth against roller passes", text, plot)


def _area(plot: Any, x: str, data: Any, colour: str, label: str = "") -> None:
    """Draw the area between the columns `low` and `high`."""
    named = {"legend_label": label} if label else {}
    plot.varea(x, "low", "high", source=data, color=colour, alpha=0.22, **named)


def _band(result: EnsembleResult, measured: Sequence[Measured]) -> Plot:
    """Return the mean worn profile with its band."""
    found = computed_profile(result)
    heights = {"mean": found.height * UM, "low": found.low * UM, "high": found.high * UM}
    data = columns(y=found.y * MM, **heights)
    extent = worn_range(found.y, found.start - found.low)
    plot = axes("y [mm]", "height above nominal [um]", x_range=extent)
    tips = [("y", "@y{0.000} mm"), ("mean", "@mean{0.000} um")]
    if found.label:
        _area(plot, "y", data, BLUE, found.label)
        tips.append((found.label, "@low{0.000} to @high{0.000} um"))
    line = plot.line("y", "mean", source=data, color=BLUE, width=2, legend_label="mean")
    hover(plot, [line], *tips)
    add_measured(plot, measured)
    legend(plot)
    deepest = shown(float((found.start - found.height).max()), "um")
    text = f"Mean of {count(found.kept)} profiles, {deepest} deep, and the band of the tests."
    return Plot("Worn profile at the end", text, plot)


def _lift_error(result: EnsembleResult) -> Plot:
    """Return the mean lift error of cams over the angle, with its band."""
    angle, curves = lift_curves(result)
    low, high = np.quantile(curves, (0.05, 0.95), axis=0)
    values = {"mean": curves.mean(axis=0) * UM, "low": low * UM, "high": high * UM}
    data = columns(angle=angle, **values)
    plot = axes("angle of the cam [deg]", "difference from its mean [um]")
    in_degrees(plot)
    tips = [("angle", "@angle{0.0} deg"), ("mean", "@mean{0.000} um")]
    if sufficient_for(len(curves), 0.05):
        _area(plot, "angle", data, BLUE, "5 % to 95 %")
        tips.append(("5 % to 95 %", "@low{0.000} to @high{0.000} um"))
    line = plot.line("angle", "mean", source=data, color=BLUE, width=2, legend_label="mean")
    hover(plot, [line], *tips)
    legend(plot)
    found = result.estimate("lift_error", -1, ())
    text = f"Change of the lift by wear. Peak to peak it is {shown(found.mean.value, 'um')} in the"
    return Plot("Lift error at the end", f"{text} mean of {count(result.count)} tests.", plot)


def effect_plots(result: EnsembleResult, name: str, values: FloatArray) -> list[Plot]:
    """Return the Sobol indices of an observable, and its values against the first input.

    Parameters
    ----------
    result : EnsembleResult
    name : str
        The observable, "depth" [um] or "life", of which the indices are those of its logarithm.
    values : ndarray, shape (count,)
        Its values in the unit shown.
    """
    effects = [item for item in result.sensitivity(name) if math.isfinite(item.first.value)]
    if not effects:
        return []
    of = "ln life" if name == "life" else f"the {name}"
    names = [item.name for item in effects][::-1]
    first = [item.first for item in effects][::-1]
    low, high = [item.low for item in first], [item.high for item in first]
    extent = Range1d(start=min(0.0, *low), end=max(1.0, *high))
    plot = axes(f"part of the variance of {of}", "", y_range=names, x_range=extent)
    data = columns(name=names, value=[item.value for item in first], low=low, high=high)
    bars = plot.hbar("name", right="value", height=0.5, source=data, color=BLUE, alpha=0.6)
    plot.add_layout(Whisker(base="name", source=data, **WIDTH))
    tips = ("index", "@value{0.000}"), ("95 % interval", "@low{0.000} to @high{0.000}")
    hover(plot, [bars], ("input", "@name"), *tips)
    largest = effects[0]
    text = f"{largest.name} explains {100.0 * largest.first.value:.0f} % of the variance."
    title = f"What the scatter of the {name} is due to (Sobol indices)"
    return [Plot(title, text, plot), _draws(result, largest, name, values)]


def _draws(result: EnsembleResult, effect: Effect, name: str, shown_values: FloatArray) -> Plot:
    """Return the values of an observable against the drawn values of an input."""
    item = next(item for item in result.raw.inputs if item["input"] == effect.name)
    unit, size = engineers_unit(item["unit"])
    values = result.inputs[item["key"]].reshape(result.count, -1).mean(axis=1) / size
    drawn = np.flatnonzero(np.isfinite(shown_values))
    every = drawn[evenly_spaced(len(drawn), MOST_POINTS)]
    label = "depth at the end [um]" if name == "depth" else f"life [{result.unit}]"
    plot = axes(f"{item['key']} [{unit}]", label)
    plot.xaxis.ticker = BasicTicker(desired_num_ticks=3)
    data = columns(x=values[every], value=shown_values[every], number=result.numbers[every])
    points = plot.scatter("x", "value", source=data, size=5, color=BLUE, alpha=0.5)
    digits = "{0.000e+0}" if np.abs(values).max() < 1e-3 else "{0.0000}"
    value = "@value{0.00} um" if name == "depth" else "@value{0,0}"
    tips = (item["key"], f"@x{digits} {unit}"), (name, value)
    hover(plot, [points], ("realisation", "@number"), *tips)
    text = f"One point for each of {count(len(every))} tests."
    return Plot(f"{name.capitalize()} against {item['key']}", text, plot)


def dissipation_plots(result: DissipationResult) -> list[Plot]:
    """Return the figures of a study of one contact: power per length, and density of the power."""
    variables = result.raw.variables
    each = {part: variables[f"dissipation_{part}"] * W_MM for part in ("mean", "low", "high")}
    data = columns(y=result.y * MM, **each)
    extent = worn_range(result.y, each["high"])
    plot = axes("y [mm]", "dissipated power per length [W/mm]", x_range=extent)
    _area(plot, "y", data, BLUE, "2.5 % to 97.5 %")
    line = plot.line("y", "mean", source=data, color=BLUE, width=2, legend_label="mean")
    hover(plot, [line], ("y", "@y{0.000} mm"), ("mean", "@mean{0.00000} W/mm"))
    legend(plot)
    text = "Mean over the realisations and their 95 % band."
    first = Plot("Dissipated power per length", text, plot)
    power = result.power
    if result.count < 2 or result.summaries["power"].is_constant:
        return [first]
    tips = [("power", "@left{0.0000} to @right{0.0000} W"), ("realisations", "@number")]
    plot, _ = _histogram(power, "dissipated power [W]", "number of realisations", tips)
    ends = f"from {shown(float(power.min()), 'W')} to {shown(float(power.max()), 'W')}"
    return [first, Plot("Dissipated power", f"{count(len(power))} realisations, {ends}.", plot)]


def comparison_plots(
    comparison: Comparison, results: Mapping[str, Result | EnsembleResult]
) -> list[Plot]:
    """Return the depths of several results with their intervals, and their profiles.

    Parameters
    ----------
    comparison : Comparison
    results : mapping of str to Result or EnsembleResult
        The results by label.
    """
    rows = comparison.rows[::-1]
    labels = [row.label for row in rows]
    plot = axes("depth at the end [um]", "", y_range=labels)
    ends = {end: [getattr(row.value, end) * UM for row in rows] for end in ("value", "low", "high")}
    data = columns(label=labels, **ends)
    plot.add_layout(Whisker(base="label", source=data, **WIDTH))
    points = plot.scatter("value", "label", source=data, size=10, color=BLUE)
    tips = ("depth", "@value{0.00} um"), ("interval", "@low{0.00} to @high{0.00} um")
    hover(plot, [points], ("", "@label"), *tips)
    text = "; ".join(f"{row.label} {shown(row.value.value, 'um')}" for row in comparison.rows)
    return [Plot("Depth at the end", f"{text}.", plot), _profiles(results)]


def _profiles(results: Mapping[str, Result | EnsembleResult]) -> Plot:
    """Return the worn profiles of several results in one figure."""
    found = {label: computed_profile(result) for label, result in results.items()}
    y = np.sort(np.concatenate([one.y for one in found.values()]))
    worn = [np.interp(y, one.y, one.start - one.low) for one in found.values()]
    extent = worn_range(y, np.max(worn, axis=0))
    plot = axes("y [mm]", "height above nominal [um]", x_range=extent)
    for number, (label, one) in enumerate(found.items()):
        colour = COLOURS[number % len(COLOURS)]
        heights = {"height": one.height * UM, "low": one.low * UM, "high": one.high * UM}
        data = columns(y=one.y * MM, **heights)
        if one.label:
            _area(plot, "y", data, colour)
        line = plot.line("y", "height", source=data, color=colour, width=2, legend_label=label)
        hover(plot, [line], ("", label), ("y", "@y{0.000} mm"), ("height", "@height{0.000} um"))
    legend(plot)
    banded = any(one.label for one in found.values())
    text = "Profiles at the end" + (", of ensembles the mean with a band." if banded else ".")
    return Plot("Worn profiles", text, plot)
