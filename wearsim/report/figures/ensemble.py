"""The figure of an ensemble of wear tests: depth and its spread, profile, what moves it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.parts.convergence import draw_settling, settling
from wearsim.report.parts.depth_axes import set_depth_axes
from wearsim.report.parts.sobol_bars import draw_effects
from wearsim.report.parts.style import BLUE, GREEN, GREY, figure_style, name_axes, say
from wearsim.report.text.labels import OBSERVABLES, statistic_in_words
from wearsim.report.text.quantile_thresholds import NINE_IN_TEN, enough_for, known_ends
from wearsim.report.text.units import PER_SI, count, shown
from wearsim.types import FloatArray
from wearsim.uq.estimation.stopping_rule import Target

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult

UM, MM = PER_SI["um"], PER_SI["mm"]
FEW = 12  # realisations drawn one by one
_MOST_CLASSES = 60
_TOUCHED = 1e-3  # of the deepest, from which on the track is drawn
_MARGIN = 0.08  # beside it, in parts of its width
_ROOM = 1.3  # height of the density's panel over its highest class, for the legend
_DEFAULT = "depth.mean 1%"


def ensemble_figure(result: EnsembleResult) -> Figure:
    """Return the figure of an ensemble of wear tests.

    Parameters
    ----------
    result : EnsembleResult
        Finished or not.

    Returns
    -------
    Figure
        Five panels: depth against passes, density of the final depth, how its estimate settles,
        mean worn profile, and what moves the depth. Without a realisation that ended well, no more
        than that is said.
    """
    with figure_style():
        figure = Figure(figsize=(13.0, 7.5), layout="constrained")
        figure.suptitle(f"{result.title}\n{_caption(result)}", fontsize=10.5)
        if result.count == 0:
            say(figure.subplots(), "", ["no realisation has ended well: there is nothing to draw"])
            return figure
        # each row with columns of its own
        upper, lower = np.ravel(np.array(figure.subfigures(2, 1)))
        course, density, settled = upper.subplots(1, 3)
        profile, effects = lower.subplots(1, 2)
        _draw_course(course, result)
        _draw_density(density, result)
        _draw_settling(settled, result)
        _draw_profile(profile, result)
        draw_effects(effects, result)
    return figure


def _caption(result: EnsembleResult) -> str:
    raw = result.raw
    text = _number_of(result.count)
    text += "" if result.finished else f" of {count(result.asked)}"
    text += f" ({count(result.failed)} failed)" if result.failed else ""
    text += f", {raw.plan}, of {count(raw.total_passes)} roller passes"
    text += f" ({result.described_model}, {raw.stepper}{'' if result.finished else ', unfinished'})"
    return f"{text}{_depth_told(result)}"


def _number_of(realisations: int) -> str:
    return f"{count(realisations)} realisation{'' if realisations == 1 else 's'}"


def _depth_told(result: EnsembleResult) -> str:
    if result.count == 0:
        return ""
    depth = result.estimate("depth", -1, ())
    what = "depth" if result.count == 1 else "mean depth"
    text = f": {what} {shown(depth.mean.value, 'um')}"
    if result.count == 1 or result.is_constant("depth"):
        return text if result.count == 1 else f"{text}, the same in all"
    text += f", std {shown(depth.std.value, 'um', 3)}"
    known = known_ends(result, "depth")
    if known is None:
        return text
    ends = [shown(end, "um", 3).removesuffix(" um") for end in known]
    return f"{text}, 90 % within {' to '.join(ends)} um"


def _draw_course(axes: Axes, result: EnsembleResult) -> None:
    """Draw depth against passes: median, band and mean, and a few realisations."""
    course = result.course("depth")
    drawn, unit, name = set_depth_axes(axes, course.passes, course.quantiles[0.5])
    passes = course.passes[drawn] / unit
    rows = _first_rows(result, "depth")[:, drawn] * UM
    axes.plot(passes, rows[0], color=GREY, lw=0.6, alpha=0.6, label=_number_of(len(rows)))
    axes.plot(passes, rows[1:].T, color=GREY, lw=0.6, alpha=0.6)
    if result.count > 1:
        low, median, high = (course.quantiles[p][drawn] * UM for p in (0.05, 0.5, 0.95))
        if enough_for(result.count, NINE_IN_TEN[0]):
            axes.fill_between(passes, low, high, color=BLUE, alpha=0.25, lw=0, label="5 to 95 %")
        axes.plot(passes, median, color=BLUE, label="median")
        axes.plot(passes, course.mean[drawn] * UM, color="black", ls="--", lw=1.0, label="mean")
    name_axes(axes, "Depth of the groove", name, "greatest worn depth [um]")
    axes.legend(loc="upper left")


def _first_rows(result: EnsembleResult, name: str) -> FloatArray:
    """Return an observable of the first few realisations that ended well, (few, records)."""
    numbers = result.numbers[:FEW]
    first = int(numbers[0])
    return np.asarray(result.raw.rows(name, first, int(numbers[-1]) + 1)[numbers - first])


def _draw_density(axes: Axes, result: EnsembleResult) -> None:
    title = "Final depth"
    if result.count == 1 or result.is_constant("depth"):
        same = shown(float(result.at_end("depth").mean()), "um")
        where = "the one realisation" if result.count == 1 else f"all {count(result.count)}"
        say(axes, title, [f"{same} in {where}: no density to draw"])
        return
    depth = result.at_end("depth") * UM
    # Rice's rule
    classes = int(np.clip(np.ceil(2.0 * len(depth) ** (1.0 / 3.0)), 5, _MOST_CLASSES))
    axes.hist(depth, classes, density=True, color=BLUE, alpha=0.45, label="realisations")
    found = result.estimate("depth", -1, (0.05, 0.5, 0.95))
    _mark(axes, found.mean.value, "black", "--", f"mean {shown(found.mean.value, 'um')}")
    _mark(
        axes,
        found.quantile(0.5).value,
        BLUE,
        "-",
        f"median {shown(found.quantile(0.5).value, 'um')}",
    )
    if enough_for(result.count, NINE_IN_TEN[0]):
        _mark(axes, found.quantile(0.05).value, GREY, ":", "5 and 95 %")
        _mark(axes, found.quantile(0.95).value, GREY, ":", None)
    name_axes(axes, title, "depth [um]", "density [1/um]")
    axes.set_ylim(top=_ROOM * axes.get_ylim()[1])
    axes.legend(loc="upper right", ncols=2)


def _mark(axes: Axes, depth: float, colour: str, style: str, label: str | None) -> None:
    axes.axvline(depth * UM, 0.0, 1.0 / _ROOM, color=colour, ls=style, lw=1.1, label=label)


def _draw_settling(axes: Axes, result: EnsembleResult) -> None:
    """Draw how the target's estimate settles, or the mean depth where there is no target."""
    target = Target.parse(result.until or _DEFAULT)
    named = OBSERVABLES[target.observable]
    counts, found = settling(result, target)
    value, low, high = (
        np.array([getattr(item, end) for item in found]) * named.per_si
        for end in ("value", "low", "high")
    )
    draw_settling(axes, counts, value, low, high)
    if result.until:
        for sign in (-1.0, 1.0):
            label = f"{100 * target.width:g} % off" if sign > 0.0 else None
            ends = value[-1] * (1.0 + sign * target.width)
            axes.axhline(ends, color=GREEN, lw=1.0, ls="--", label=label)
        axes.legend(loc="upper right")
    title = f"{statistic_in_words(target).capitalize()}, with its 95 % interval"
    name_axes(axes, title, "realisations", named.label)


def _draw_profile(axes: Axes, result: EnsembleResult) -> None:
    """Draw the mean worn profile downwards, with its band."""
    band = result.band()
    y = band.y * MM
    told = "" if band.kept == result.count else f", of the first {count(band.kept)}"
    if band.kept > 1:
        low, high, label = band.low, band.high, "2.5 to 97.5 %"
        if not enough_for(band.kept, 0.025):
            kept = result.profiles
            low, high, label = kept.min(axis=0), kept.max(axis=0), "least to greatest"
        axes.fill_between(y, -high * UM, -low * UM, color=BLUE, alpha=0.25, lw=0, label=label)
    axes.plot(y, -band.mean * UM, color="black", label="mean")
    touched = y[band.high > _TOUCHED * max(float(band.high.max()), 0.0)]
    if len(touched) > 1:
        margin = _MARGIN * (touched[-1] - touched[0])
        axes.set_xlim(touched[0] - margin, touched[-1] + margin)
    name_axes(axes, f"Worn profile of the cylinder at the end{told}", "y [mm]", "worn height [um]")
    axes.legend(loc="lower right")
