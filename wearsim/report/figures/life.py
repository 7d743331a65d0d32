"""Figure of the life of a design, or of several: survival, probability plots, effects, limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import (
    FixedFormatter,
    FixedLocator,
    FuncFormatter,
    LogLocator,
    NullLocator,
)

from wearsim.report.figures.comparison import COLOURS
from wearsim.report.lives import against
from wearsim.report.parts import (
    RECORDS,
    evenly_spaced,
    name_axes,
    titled_figure,
    write_message,
)
from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.life_settings import DesignVariable
from wearsim.types import FloatArray
from wearsim.units import engineers_unit
from wearsim.uq.survival.fits import FAMILIES, Family
from wearsim.uq.survival.lives import cumulative_incidence, median_positions, survival_curve

_POINTS = 200  # of a curve
_MOST_MARKS = 500
_PERCENT = (0.1, 1.0, 5.0, 10.0, 25.0, 50.0, 75.0, 90.0, 95.0, 99.0, 99.9)


def life_figure(results: Sequence[LifeResult], labels: Sequence[str]) -> Figure:
    """Return the figure of the lives of designs.

    Parameters
    ----------
    results : sequence of LifeResult
        One design, or several with the same unit of life.
    labels : sequence of str

    Returns
    -------
    Figure
        Survival with its 95 % band and ticks where lives are censored; probability plots on the
        scales of both fits; the effect of each input; the limits that were reached first, for a
        cam by angle; for a sweep also the lives against the design variable.
    """
    colours = list(COLOURS[: len(results)])
    if len(results) > len(COLOURS):
        colours = [to_hex(c) for c in colormaps[RECORDS](np.linspace(0.0, 0.9, len(results)))]
    titles = {result.title for result in results}
    title = titles.pop() if len(titles) == 1 else "lives of designs"
    variable = against(results)
    rows: list[list[str]] = [["survival", *FAMILIES], ["tornado", "incidence", "limits"]]
    if variable is not None:
        rows = [[*row, "against"] for row in rows]
    with titled_figure(18.5 if variable else 14.0, 8.4, title) as figure:
        panels = figure.subplot_mosaic([list(row) for row in rows])
        draw_survival(panels["survival"], results, labels, colours)
        for family in FAMILIES:
            _draw_probabilities(panels[family], results, labels, colours, family)
        _draw_tornado(panels["tornado"], results, labels, colours)
        _draw_incidence(panels["incidence"], results, labels, colours)
        _draw_limits(panels["limits"], results, labels, colours)
        if variable is not None:
            draw_against(panels["against"], results, variable)
    return figure


def draw_against(axes: Axes, results: Sequence[LifeResult], variable: DesignVariable) -> None:
    """Draw the lives of the shares with their intervals against the design variable of a sweep."""
    unit, size = engineers_unit(variable.unit)
    designs = {one.variable.value / size: one for one in results if one.variable}
    shares = results[0].settings.shares
    for number, share in enumerate(shares):
        colour = colormaps[RECORDS](0.1 + 0.7 * number / len(shares))
        found = [(value, one.b(share)) for value, one in sorted(designs.items())]
        known = [(value, life) for value, life in found if np.isfinite(life.value)]
        values, lives = [value for value, _ in known], [life.value for _, life in known]
        ends = [[life.low, life.high] for _, life in known]
        reach = np.abs(np.where(np.isfinite(ends), ends, np.nan) - np.array(lives)[:, None]).T
        axes.errorbar(
            values, lives, reach, fmt="o-", color=colour, capsize=4.0, label=f"B{share:g}"
        )
    if not axes.lines:
        write_message(axes, "Life against the design", ["all lives are censored"])
        return
    axes.set_ylim(bottom=0.0)
    label = variable.key if unit == "1" else f"{variable.key} [{unit}]"
    name_axes(axes, "Life, with 95 % intervals", label, f"life [{results[0].unit}]")
    axes.legend(fontsize=8.0)


def draw_survival(
    axes: Axes,
    results: Sequence[LifeResult],
    labels: Sequence[str],
    colours: Sequence[str] = COLOURS,
) -> None:
    """Draw the survival of designs with its 95 % band, censored lives and target."""
    if all(result.at_once == result.count for result in results):
        write_message(axes, "Survival", ["every life is 0"])
        return
    for result, label, colour in zip(results, labels, colours, strict=False):
        life, survival, low, high = survival_of(result)
        step: Literal["post"] | None = None if result.is_exact else "post"
        (line,) = axes.plot(life, 100.0 * survival, color=colour, label=label)
        line.set_drawstyle("default" if result.is_exact else "steps-post")
        axes.fill_between(life, 100.0 * low, 100.0 * high, color=colour, alpha=0.2, lw=0, step=step)
        if result.censored and len(survival):
            ticks = np.full(1, result.most)
            axes.plot(ticks, 100.0 * survival[-1:], "|", color=colour, ms=12.0, mew=1.5)
            axes.annotate(
                f"{result.censored} censored",
                (result.most, 100.0 * float(survival[-1])),
                (-4, 6),
                textcoords="offset points",
                ha="right",
                color=colour,
                fontsize=8.0,
            )
    for target in {result.target for result in results if result.target is not None}:
        axes.axvline(target, color="0.4", ls=":", lw=1.0)
        axes.annotate("target", (target, 2.0), (3, 0), textcoords="offset points")
    for share in (10.0, 50.0):
        axes.axhline(100.0 - share, color="0.85", lw=0.8, zorder=0)
    axes.set_ylim(0.0, 102.0)
    axes.set_xlim(left=0.0)
    name_axes(axes, "Survival, with 95 % band", f"life [{results[0].unit}]", "survival [%]")
    _legend(axes, labels)


def survival_of(result: LifeResult) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return lives, and the survival with its band at each."""
    if not result.is_exact:
        curve = survival_curve(np.minimum(result.lives, result.most), result.observed)
        start, one = np.zeros(1), np.ones(1)
        end = curve.survival[-1:] if len(curve.life) else one
        last = np.array([result.most]) if result.censored else curve.life[-1:]
        return (
            np.concatenate([start, curve.life, last]),
            np.concatenate([one, curve.survival, end]),
            np.concatenate([one, curve.low, curve.low[-1:] if len(curve.low) else one]),
            np.concatenate([one, curve.high, curve.high[-1:] if len(curve.high) else one]),
        )
    distribution = result.distribution
    end_of_life: float = min(distribution.quantile_of_mean(0.999), result.most)
    life = np.linspace(0.0, end_of_life, _POINTS)[1:]
    found = [distribution.probability_before(float(n)) for n in life]
    survival, low, high = (
        np.array([1.0, *(1.0 - getattr(item, name) for item in found)])
        for name in ("value", "high", "low")
    )
    # the survival falls, so that a bound at one life is one for those before or after it
    low, high = np.maximum.accumulate(low[::-1])[::-1], np.minimum.accumulate(high)
    return np.append(0.0, life), survival, low, high


def _scale(family: Family) -> Callable[[FloatArray], FloatArray]:
    from scipy.special import ndtri  # noqa: PLC0415  (slow to load)

    if family == "log-normal":
        return lambda p: np.asarray(ndtri(p))
    return lambda p: np.log(-np.log1p(-p))


def _draw_probabilities(
    axes: Axes,
    results: Sequence[LifeResult],
    labels: Sequence[str],
    colours: Sequence[str],
    family: Family,
) -> None:
    """Draw lives on the probability scale of a family, on which its fit is a straight line."""
    scale, ends = _scale(family), []
    title = f"{family[:1].upper()}{family[1:]} probability plot"
    for result, label, colour in zip(results, labels, colours, strict=False):
        chosen = result.observed & (result.lives > 0.0)
        lives = np.sort(result.lives[chosen])
        if not len(lives):
            continue
        part = median_positions(result.count)[result.at_once :][: len(lives)]
        picks = evenly_spaced(len(lives), _MOST_MARKS)
        axes.plot(lives[picks], scale(part[picks]), ".", color=colour, ms=4.0, label=label)
        ends += [float(lives[0]), float(lives[-1])]
        fit = next((item for item in result.fits if item.family == family), None)
        if fit is not None:
            across = np.geomspace(0.7 * lives[0], 1.3 * lives[-1], _POINTS)
            line = np.clip(fit.probability_before(across), 1e-4, 1.0 - 1e-4)
            inside = (line > 1e-4) & (line < 1.0 - 1e-4)
            best = result.fits[0] is fit
            axes.plot(
                across[inside],
                scale(line[inside]),
                color=colour,
                lw=1.4,
                ls="-" if best else "--",
                label=f"fit{', lower AIC' if best else ''}",
            )
        if result.is_exact:
            first, last = 0.7 * lives[0], 1.3 * lives[-1]
            if result.settings.alone:  # one test, which is a point of the distribution
                first, last = (result.distribution.quantile_of_mean(p) for p in (0.002, 0.998))
                ends += [first, last]
            across = np.geomspace(first, last, _POINTS)
            mean = np.clip(result.distribution.failed(across).mean(axis=0), 1e-4, 1.0 - 1e-4)
            axes.plot(across, scale(mean), color="0.3", lw=0.9, ls=":", label="exact K/H")
    if not ends:
        write_message(axes, title, ["no life above 0 ended"])
        return
    axes.set_xscale("log")
    axes.set_xlim(0.75 * min(ends), 1.3 * max(ends))
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda life, place: f"{life:.3g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    ticks = np.array(_PERCENT) / 100.0
    axes.set_ylim(*(float(value) for value in scale(np.array([5e-4, 0.9995]))))
    axes.yaxis.set_major_locator(FixedLocator(scale(ticks).tolist()))
    axes.yaxis.set_major_formatter(FixedFormatter([f"{tick:g}" for tick in _PERCENT]))
    axes.yaxis.set_minor_locator(NullLocator())
    name_axes(axes, title, f"life [{results[0].unit}]", "failed [%]")
    axes.legend(fontsize=8.0)


def _draw_tornado(
    axes: Axes, results: Sequence[LifeResult], labels: Sequence[str], colours: Sequence[str]
) -> None:
    """Draw how far each input moves the life from its median, and the 95 % intervals."""
    title = "What moves the life"
    bars = [{} if result.are_equal else result.tornado() for result in results]
    names = list(dict.fromkeys(name for found in bars for name in found))
    if not names:
        alone = {result.settings.factor for result in results if result.settings.alone}
        text = f"only {', '.join(alone)}" if alone else "too few realisations, or equal lives"
        obstacles = [result.effects_obstacle for result in results if result.effects_obstacle]
        write_message(
            axes, title, [line for one in obstacles for line in one.split("; ")] or [text]
        )
        return
    height = 0.7 / len(results)
    for number, (found, colour, label) in enumerate(zip(bars, colours, labels, strict=False)):
        places = [
            names.index(name) + (number - 0.5 * (len(results) - 1)) * height for name in found
        ]
        for end, alpha in enumerate((0.35, 0.8)):
            ends = [effect.factors[end] for effect in found.values()]
            value = np.array([one.value for one in ends])
            reach = np.array([[one.value - one.low, one.high - one.value] for one in ends]).T
            axes.barh(
                places,
                value - 1.0,
                height,
                left=1.0,
                color=colour,
                alpha=alpha,
                label=label if end else "",
                xerr=reach,
                error_kw={"lw": 1.0, "capsize": 2.0, "ecolor": "0.2"},
            )
    axes.axvline(1.0, color="0.3", lw=0.8)
    axes.use_sticky_edges = False
    axes.margins(x=0.08)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    name_axes(axes, title, "factor of the life, input at its 10 % (pale) and 90 % quantile", "")
    _legend(axes, labels)


def _draw_incidence(
    axes: Axes, results: Sequence[LifeResult], labels: Sequence[str], colours: Sequence[str]
) -> None:
    """Draw the share that each limit has ended, against the life."""
    title, styles = "Share ended by each limit", ("-", "--", "-.", ":")
    drawn = False
    for result, label, colour in zip(results, labels, colours, strict=False):
        cause = np.where(result.observed, result.values("first_limit"), -1).astype(np.int64)
        lives = np.minimum(result.lives, result.most)
        found, incidence = cumulative_incidence(lives, cause, len(result.limits))
        for place, name in enumerate(result.limits):
            if not len(found) or incidence[place, -1] == 0.0:
                continue
            words = name.replace("_", " ")
            axes.step(
                np.append(0.0, found),
                np.append(0.0, 100.0 * incidence[place]),
                where="post",
                color=colour,
                ls=styles[place % len(styles)],
                label=words if len(labels) == 1 else f"{label}: {words}",
            )
            drawn = True
    if not drawn:
        write_message(axes, title, ["no limit was reached"])
        return
    axes.set_ylim(0.0, 102.0)
    axes.set_xlim(left=0.0)
    name_axes(axes, title, f"life [{results[0].unit}]", "ended [%]")
    axes.legend(fontsize=8.0)


def _draw_limits(
    axes: Axes, results: Sequence[LifeResult], labels: Sequence[str], colours: Sequence[str]
) -> None:
    """Draw which limit was first: of cams by angle, else as bars."""
    if any(result.angles for result in results):
        bins = [5.0 * number for number in range(73)]
        for result, label, colour in zip(results, labels, colours, strict=False):
            for number, (name, angles) in enumerate(result.angles.items()):
                words = name.replace("_", " ")
                axes.hist(
                    np.degrees(angles) % 360.0,
                    bins,
                    weights=np.full(len(angles), 100.0 / result.count),
                    color=colour,
                    alpha=0.8 - 0.3 * (number % 2),
                    histtype="stepfilled" if number == 0 else "step",
                    label=words if len(labels) == 1 else f"{label}: {words}",
                )
        axes.set_xlim(0.0, 360.0)
        axes.xaxis.set_major_locator(FixedLocator(range(0, 361, 60)))
        name_axes(axes, "Angle at which the limit is reached", "angle [deg]", "share [%]")
        axes.legend(fontsize=8.0)
        return
    if not any(result.observed.any() for result in results):
        write_message(axes, "Limit reached first", ["no limit was reached"])
        return
    names = list(dict.fromkeys(name for result in results for name in result.first_limits))
    width = 0.7 / len(results)
    for number, (result, label, colour) in enumerate(zip(results, labels, colours, strict=False)):
        shares = [100.0 * result.first_limits.get(name, 0.0) for name in names]
        places = np.arange(len(names)) + (number - 0.5 * (len(results) - 1)) * width
        axes.bar(places, shares, width, color=colour, alpha=0.8, label=label)
    axes.set_xticks(range(len(names)), [name.replace("_", " ") for name in names])
    axes.set_ylim(0.0, 102.0)
    axes.set_xlim(-1.0, max(len(names), 1.0))
    name_axes(axes, "Limit reached first", "", "share [%]")
    _legend(axes, labels)


def _legend(axes: Axes, labels: Sequence[str]) -> None:
    if len(labels) > 1:
        axes.legend(fontsize=8.0)
