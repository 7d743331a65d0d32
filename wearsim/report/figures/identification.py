"""Figures of an identification: traces and residuals, wear factors, and power of tests."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from wearsim.report.parts import BLUE, GREEN, GREY, ORANGE, RED, name_axes, titled_figure
from wearsim.report.text import PER_SI
from wearsim.results import IdentificationResult
from wearsim.studies.identify.planning import SCATTERS, PlannedDesign
from wearsim.types import FloatArray

_MOST_TRACES = 6
_COLOURS = (BLUE, ORANGE, GREEN, RED)
_MASSES = (0.95, 0.9, 0.5)


def identification_figure(result: IdentificationResult) -> Figure:
    """Return the figure of an identification.

    Traces with the band of the model and its residuals, as far as profiles were measured; below
    them K/H of each specimen with the pooled distribution, and the density of m and t.
    """
    known = [k for k in range(len(result.tests)) if np.isfinite(result.values("trace_y")[k, 0])]
    shown = known[:_MOST_TRACES]
    columns = max(len(shown), 1)
    height = 8.6 if shown else 4.2
    title = f"{result.title}\n{result.verdict_words}"
    with titled_figure(max(4.2 * columns, 9.6), height, title) as figure:
        lower: Any = figure
        if shown:
            parts: Any = figure.subfigures(2, 1, height_ratios=[1.1, 1.0])
            upper, lower = parts
            axes = upper.subplots(2, columns, squeeze=False, sharex="col", height_ratios=[2.2, 1.0])
            for column, place in enumerate(shown):
                _draw_trace(axes[0, column], axes[1, column], result, place)
            axes[0, 0].legend(loc="lower right", markerscale=4.0, fontsize=7.0)
        left, right = lower.subplots(1, 2)
        draw_factors(left, result)
        _draw_density(right, result)
    return figure


def _draw_trace(upper: Axes, lower: Axes, result: IdentificationResult, place: int) -> None:
    """Draw a trace against the band of the model, and its residuals."""
    names = ("y", "height", "fitted", "low", "high", "unworn")
    rows = [result.values(f"trace_{name}")[place] for name in names]
    y, height, fitted, low, high, unworn = (row[np.isfinite(rows[0])] for row in rows)
    test = result.tests[place]
    lift = test.get("quantity") == "lift"
    across = PER_SI["deg" if lift else "mm"] * y
    upper.plot(across, 1e6 * height, ".", ms=2.0, color=GREY, label="measured")
    upper.plot(
        across[unworn > 0.5],
        1e6 * height[unworn > 0.5],
        ".",
        ms=2.0,
        color=GREEN,
        label="shoulders",
    )
    upper.fill_between(
        across, 1e6 * low, 1e6 * high, color=ORANGE, alpha=0.4, lw=0, label="95 % band"
    )
    upper.plot(across, 1e6 * fitted, color=BLUE, lw=1.0, label="best profile")
    k = test["k_over_h_per_Pa"]
    title = f"{test['file'].rpartition('/')[2]}: K/H {1e12 * k['value']:.3g}e-12 1/Pa"
    name_axes(upper, title, "", "change of the lift [um]" if lift else "height [um]")
    lower.plot(across, 1e6 * (height - fitted), color=GREY, lw=0.6)
    noise = 1e6 * (test["noise_m"] or 0.0)
    lower.axhspan(-2.0 * noise, 2.0 * noise, color=GREEN, alpha=0.15, lw=0)
    name_axes(lower, "", "angle [deg]" if lift else "y [mm]", "residual [um]")


def draw_factors(axes: Axes, result: IdentificationResult) -> None:
    """Draw K/H of each specimen with its density, and the distribution of the next one."""
    grid = np.exp(result.ln_k)
    for row, (name, density) in enumerate(
        zip(result.raw.specimens, result.test_density, strict=True)
    ):
        curve = 0.8 * density / density.max()
        axes.fill_between(1e12 * grid, row, row + curve, color=BLUE, alpha=0.35, lw=0)
        axes.annotate(
            name.rpartition("/")[2],
            (0.01, row + 0.1),
            xycoords=axes.get_yaxis_transform(),
            fontsize=8.0,
        )
    found = result.summary["next_specimen"]
    std, middle = np.log(found["factor"]), np.log(found["median_per_Pa"])
    count = len(result.raw.specimens)
    curve = 0.8 * np.exp(-0.5 * ((result.ln_k - middle) / std) ** 2)
    axes.fill_between(1e12 * grid, count, count + curve, color=ORANGE, alpha=0.5, lw=0)
    axes.annotate(
        "next specimen", (0.01, count + 0.1), xycoords=axes.get_yaxis_transform(), fontsize=8.0
    )
    axes.set(xscale="log", yticks=[], ylim=(-0.1, count + 1.1))
    below = np.cumsum(result.test_density, axis=1)
    below /= below[:, -1:]
    low = min(grid[row.searchsorted(1e-3)] for row in below)
    high = max(grid[min(row.searchsorted(0.999), len(grid) - 1)] for row in below)
    axes.set_xlim(1e12 * 0.8 * low, 1e12 * 1.25 * high)
    _set_ticks(axes)
    name_axes(axes, "K/H of each specimen, and of the next one", "K/H [1e-12 1/Pa]", "")


def _draw_density(axes: Axes, result: IdentificationResult) -> None:
    """Draw contours of the density of m and t that hold 50, 90 and 95 %."""
    t, m, density = result.scatter, result.values("mean_ln_k"), result.posterior
    t_step = np.gradient(t)[:, None]
    weight = density * t_step * np.gradient(m, axis=1)
    order = np.argsort(-density, axis=None)
    held = np.cumsum(weight.ravel()[order])
    held /= held[-1]
    levels = [float(density.ravel()[order][held.searchsorted(mass)]) for mass in _MASSES]
    rows = np.broadcast_to(t[:, None], m.shape)
    median = 1e12 * np.exp(m)
    axes.contourf(median, rows, density, [*levels, density.max()], colors=_shades())
    axes.contour(median, rows, density, levels, colors=BLUE, linewidths=0.8)
    found = result.summary["scatter_of_k"]
    top = max(1.3 * found["high"], 0.3)
    inside = (density > levels[0]) & (rows < top)
    axes.set(
        xscale="log",
        ylim=(0.0, top),
        xlim=(0.9 * float(median[inside].min()), 1.1 * float(median[inside].max())),
    )
    axes.axhline(result.summary["negligible"], color=GREY, lw=0.8, ls="--")
    _set_ticks(axes)
    title = "Median and scatter of K/H: 50, 90 and 95 %"
    name_axes(axes, title, "median of K/H [1e-12 1/Pa]", "scatter t of ln K/H (dashed: negligible)")


def _set_ticks(axes: Axes) -> None:
    """Set round values as ticks of a logarithmic x axis."""
    low, high = axes.get_xlim()
    # powers of ten, twice and five times them are too few in less than a decade
    narrow = high < 10.0 * low
    locator = MaxNLocator(7, steps=[1, 2, 5, 10]) if narrow else LogLocator(subs=(1.0, 2.0, 5.0))
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())


def _shades() -> list[str]:
    return ["#d6e4f2", "#a9c7e4", "#6f9fce"]


def power_figure(designs: Sequence[PlannedDesign], title: str = "") -> Figure:
    """Return the power of planned tests against their number.

    Parameters
    ----------
    designs : sequence of PlannedDesign
    title : str
        Title of the figure.
    """
    with titled_figure(4.9 * len(designs) + 0.4, 4.2, title) as figure:
        row = figure.subplots(1, len(designs), squeeze=False, sharey=True)[0]
        for axes, design in zip(row, designs, strict=True):
            tests = np.array(design.tests)
            for t, colour in zip((0.0, *SCATTERS), (GREY, *_COLOURS), strict=False):
                label = f"'random', t = {t:g}" if t else "'random' though t = 0"
                _draw_rates(axes, tests, design.random[t], colour, label, "-o")
            _draw_rates(axes, tests, design.explained[0.0], RED, "'explained', t = 0", "--s")
            axes.axhline(80.0, color=GREY, lw=0.8, ls=":")
            axes.set(ylim=(0.0, 102.0), xscale="log")
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter("{x:g}")
            axes.tick_params(axis="x", which="minor", labelsize=7.0)
            name_axes(axes, fill(f"Inputs {design.name}", 56), "number of tests", "")
        row[0].set_ylabel("rate of the verdict [%]")
        figure.legend(*row[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure


def _draw_rates(
    axes: Axes, tests: FloatArray, rates: Sequence[float], colour: str, label: str, style: str
) -> None:
    axes.plot(tests, 100.0 * np.array(rates), style, color=colour, ms=3.5, label=label)
