"""Panels of an identification: traces and residuals, wear factors, and power of tests."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.panels import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Axis,
    Band,
    Contours,
    Line,
    Mark,
    Panel,
    Sheet,
    Span,
    Text,
    dots,
    evenly_spaced,
    share_axis,
)
from wearsim.report.text import in_unit, shown
from wearsim.studies.identify.planning import SCATTERS, PlannedDesign
from wearsim.studies.identify.result import IdentificationResult

_IN_FIGURE, MOST_TRACES, MOST_POINTS = 6, 12, 1200
_MASSES = (0.95, 0.9, 0.5)
_SHADES = ("#d6e4f2", "#a9c7e4", "#6f9fce")
_UNIT: dict[str, Any] = {"unit": "1e-12 1/Pa", "per_si": 1e12}  # of K/H


def identification_sheet(result: IdentificationResult, measured: Sequence[Measured] = ()) -> Sheet:
    """Return the panels of an identification.

    K/H of each specimen with the pooled distribution, and the density of m and t; traces with the
    band of the model and its residuals, as far as profiles were measured.
    """
    panels = {"factors": _factors(result), "scatter": _density_of_scatter(result)}
    panels["density"] = _density(result)
    traced = [k for k in range(len(result.tests)) if np.isfinite(result.values("trace_y")[k, 0])]
    for place in traced[:MOST_TRACES]:
        panels[f"trace {place}"], panels[f"residual {place}"] = _trace(result, place)
    columns = max(len(traced[:_IN_FIGURE]), 1)
    rows, heights = [["factors", "density"]], [1.0]
    if traced:
        drawn = traced[:_IN_FIGURE]
        upper = ([f"{name} {place}" for place in drawn] for name in ("trace", "residual"))
        rows, heights = [*upper, *rows], [0.75, 0.35, 1.0]
    size = (max(4.2 * columns, 9.6), 8.6 if traced else 4.2)
    title = f"{result.title}\n{result.verdict_words}"
    return Sheet(title, panels, rows, size, heights=heights)


def depth_text(name: str, ends: Sequence[float]) -> str:
    """Return the interval of a depth after its name."""
    return f"{name} {in_unit(ends[0], 'um')} to {shown(ends[1], 'um')}"


def _trace(result: IdentificationResult, place: int) -> tuple[Panel, Panel]:
    """Return a trace against the band of the model, and its residuals."""
    names = ("y", "height", "fitted", "low", "high", "unworn")
    rows = [result.values(f"trace_{name}")[place] for name in names]
    known = np.flatnonzero(np.isfinite(rows[0]))
    every = known[evenly_spaced(len(known), MOST_POINTS)]
    y, height, fitted, low, high, unworn = (row[every] for row in rows)
    test, free = result.tests[place], unworn > 0.5
    marks = [
        dots(y, height, ".", size=2.0, colour=GREY, label="measured"),
        dots(y[free], height[free], ".", size=2.0, colour=GREEN, label="shoulders"),
        Band(y, low, high, colour=ORANGE, alpha=0.4, label="95 % band"),
        Line(y, fitted, width=1.0, label="best profile"),
    ]
    k = test["k_over_h_per_Pa"]
    title = f"{test['file'].rpartition('/')[2]}: K/H {1e12 * k['value']:.3g}e-12 1/Pa"
    text = depth_text("Model's depth", test["model_depth_interval_m"])
    if test["depth_interval_m"] is not None:
        text = f"{depth_text('Measured depth', test['depth_interval_m'])}. {text}"
    lift = test.get("quantity") == "lift"
    ends = float(y.min()), float(y.max())
    x = Axis("angle", "deg", limits=ends) if lift else Axis("y", "mm", limits=ends)
    name = "change of the lift" if lift else "height"
    upper = Panel(title, x, Axis(name, "um"), marks, f"{text}.", legend="lower right")
    noise = test["noise_m"] or 0.0
    residuals: list[Mark] = [
        Line(y, height - fitted, colour=GREY, width=0.6),
        Span(-2.0 * noise, 2.0 * noise, across="y", colour=GREEN, alpha=0.15),
    ]
    return upper, Panel("", x, Axis("residual", "um"), residuals, figure_only=True)


def _factors(result: IdentificationResult) -> Panel:
    """Return K/H of each specimen with its density, and the distribution of the next one."""
    k, following = np.exp(result.ln_k), result.summary["next_specimen"]
    std, middle = np.log(following["factor"]), np.log(following["median_per_Pa"])
    named: list[tuple[str, Any]] = [*zip(result.raw.specimens, result.test_density, strict=True)]
    named.append(("next specimen", np.exp(-0.5 * ((result.ln_k - middle) / std) ** 2)))
    marks: list[Mark] = []
    for row, (name, density) in enumerate(named):
        colour, alpha = (BLUE, 0.35) if row < len(named) - 1 else (ORANGE, 0.5)
        curve = row + 0.8 * density / density.max()
        marks += [
            Band(k, np.full_like(k, row), curve, colour=colour, alpha=alpha),
            Text(0.01, row + 0.1, name.rpartition("/")[2], parts="x", colour=BLACK),
        ]
    below = np.cumsum(result.test_density, axis=1)
    below /= below[:, -1:]
    low = min(k[row.searchsorted(1e-3)] for row in below)
    high = max(k[min(row.searchsorted(0.999), len(k) - 1)] for row in below)
    return Panel(
        "K/H of each specimen, and of the next one",
        Axis("K/H", log=True, limits=(0.8 * low, 1.25 * high), **_UNIT),
        Axis(ticks=(), limits=(-0.1, len(named) + 0.1)),
        marks,
        "Density of the wear factor of each specimen, and of the next one.",
    )


def _density_of_scatter(result: IdentificationResult) -> Panel:
    """Return the density of the scatter of ln K/H, for a page."""
    t = result.scatter
    density = (result.posterior * np.gradient(result.values("mean_ln_k"), axis=1)).sum(axis=1)
    density /= np.trapezoid(density, t)
    ends = result.scatter_of_k
    return Panel(
        "Scatter of the wear factor itself",
        Axis("scatter t of ln K/H", limits=(0.0, max(1.3 * ends["high"], 0.3))),
        Axis("probability density", limits=(0.0, None)),
        [
            Band(t, np.zeros_like(t), density),
            Line(t, density),
            Span(float(result.summary["negligible"]), dash="--", colour=GREY),
        ],
        f"95 %: {ends['low']:.2f} to {ends['high']:.2f}. Dashed: a negligible scatter.",
    )


def _density(result: IdentificationResult) -> Panel:
    """Return areas of the density of m and t that hold 50, 90 and 95 %."""
    t, m, density = result.scatter, result.values("mean_ln_k"), result.posterior
    weight = density * np.gradient(t)[:, None] * np.gradient(m, axis=1)
    order = np.argsort(-density, axis=None)
    held = np.cumsum(weight.ravel()[order])
    held /= held[-1]
    levels = [float(density.ravel()[order][held.searchsorted(mass)]) for mass in _MASSES]
    rows, median = np.broadcast_to(t[:, None], m.shape), np.exp(m)
    top = max(1.3 * result.scatter_of_k["high"], 0.3)
    inside = (density > levels[0]) & (rows < top)
    limits = (0.9 * float(median[inside].min()), 1.1 * float(median[inside].max()))
    areas = Contours(median, rows, density, [*levels, density.max()], _SHADES, outlined=True)
    negligible = Span(result.summary["negligible"], across="y", dash="--", width=0.8, colour=GREY)
    return Panel(
        "Median and scatter of K/H: 50, 90 and 95 %",
        Axis("median of K/H", log=True, limits=limits, **_UNIT),
        Axis("scatter t of ln K/H (dashed: negligible)", limits=(0.0, top)),
        [areas, negligible],
        figure_only=True,
    )


def power_sheet(designs: Sequence[PlannedDesign], title: str = "") -> Sheet:
    """Return the power of planned tests against their number."""
    panels = {}
    for number, design in enumerate(designs):
        rates = {
            "'random' though t = 0" if t == 0.0 else f"'random', t = {t:g}": design.random[t]
            for t in (0.0, *SCATTERS)
        }
        marks: list[Mark] = [
            Line(design.tests, rate, marker="o", size=3.5, colour=colour, label=label)
            for (label, rate), colour in zip(rates.items(), (GREY, *COLOURS), strict=False)
        ]
        marks += [
            Line(
                design.tests, design.explained[0.0], dash="--", marker="s", size=3.5, colour=RED,
                label="'explained', t = 0",
            ),
            Span(0.8, across="y", dash=":", width=0.8, colour=GREY),
        ]  # fmt: skip
        panels[design.name] = Panel(
            fill(f"Inputs {design.name}", 56),
            Axis("number of tests", log=True),
            share_axis("" if number else "rate of the verdict"),
            marks,
            "Rates of the verdicts by the number of tests.",
            legend="" if number else "best",
        )
    size = (4.9 * len(designs) + 0.4, 4.2)
    return Sheet(title, panels, [list(panels)], size)
