"""Part of the page on the life of a design."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.report import summary
from wearsim.report.figures.life import survival_of
from wearsim.report.lives import (
    against,
    effect_cells,
    life_cells,
    rare_command,
    rare_text,
    rounded_lives,
    study_options,
    target_text,
)
from wearsim.report.page.part import SAMPLING, Part, command_of, files_of, tables_of
from wearsim.report.page.plots import COLOURS, Plot, axes, columns, hover, legend
from wearsim.report.page.study_plots import effect_plots
from wearsim.report.text import count, part_with_interval, pass_unit, with_interval
from wearsim.results.ensemble.life import LifeResult
from wearsim.results.ensemble.life_settings import DesignVariable
from wearsim.units import engineers_unit

_ERROR = (
    f"{SAMPLING} The numerical error of the lives is stated beside them; it does not contain the"
    " error of the model."
)


def of_life(result: LifeResult) -> Part:
    """Return the part of the page on a life."""
    settings, unit = result.settings, result.unit
    limits = ", ".join(summary.limits_of(result.scenario.limit.given))
    ended = int(result.observed.sum())
    factor = f"lives are counted: {settings.reason}"
    if result.is_exact:
        factor = f"{settings.factor} is integrated exactly"
    study = [
        ("realisations", f"{count(result.count)} done, {count(result.failed)} failed"),
        ("lives ended by a limit", count(ended)),
        ("lives censored", f"{count(result.censored)}, at {count(result.most)} {unit}"),
        ("wear factor", factor),
        ("95 % intervals", result.method if result.count else "-"),
        ("contact model", result.described_model),
    ]
    options = study_options(result)
    if result.raw.until:
        options += ["--precision", result.raw.until]
    if settings.rare:
        options += ["--rare", str(settings.rare), "--rare-method", settings.rare_method]
    return Part(
        title=result.title,
        question=f"How many {unit} does the design last, until the first of: {limits}?",
        answer=_estimates(result),
        error=_ERROR,
        plots=_plots(result),
        tables=[
            *_changes(result),
            *tables_of(result, ("Study", study), summary.input_rows(result)),
        ],
        warnings=[*result.warnings, *result.notes],
        files=files_of(result),
        command=command_of(result, "life", *options),
    )


def _changes(result: LifeResult) -> list[tuple[str, summary.Rows]]:
    """Return the table of what moves the life, if two lives differ."""
    found = {} if result.are_equal else result.tornado()
    rows = []
    for name, effect in found.items():
        low, high = effect_cells(effect)
        rows.append((name, f"{low} at its 10 % quantile, {high} at its 90 % quantile"))
    return [("What moves the life, from the median of each input", rows)] if rows else []


def _estimates(result: LifeResult) -> summary.Rows:
    """Return the lives of the shares, B10 first, and what reached its limit first."""
    if result.count == 0:
        return [("life", "no test is completed")]
    shares = sorted(result.settings.shares, key=lambda share: share != 10.0)
    rows = [(f"B{share:g}", _life(result, share)) for share in shares]
    for share in shares:
        low, high = result.b_error(share)
        if math.isfinite(low + high):
            text = " to ".join(rounded_lives(low, high))
            rows.append((f"B{share:g}, numerical error", text))
    if result.target is not None:
        found = target_text(result)
        rows.append((f"P(life < {count(result.target)} {result.unit})", found))
        if result.probability_obstacle(result.target) and result.rare is None:
            rows.append(("tests that sample the other inputs", rare_command(result)))
    for method, estimate in result.rare_estimates.items():
        rows.append((f"the same by {method}", rare_text(estimate)))
    for name, share in result.first_limits.items():
        where = ""
        if name in result.angles:
            where = f", at {math.degrees(float(np.median(result.angles[name]))):.1f} deg"
        rows.append((f"{name.replace('_', ' ')} first", f"{100.0 * share:.1f} %{where}"))
    return rows


def _life(result: LifeResult, share: float) -> str:
    """Return a life with its unit and its interval."""
    value, interval = life_cells(result, share)
    return f"{value} {result.unit}" + (f" [{interval}]" if interval else "")


def of_lives(results: Sequence[LifeResult], labels: Sequence[str]) -> Part:
    """Return the part of the page that compares lives with the first of them."""
    first, rows = results[0], []
    for label, other in zip(labels[1:], results[1:], strict=True):
        found, pair = first.compare(other), f"{labels[0]} against {label}"
        rows.append((f"B10 ratio, {pair}", with_interval(found.b10_ratio, "1")))
        if found.same_machine is not None:
            text = f"{labels[0]} lasts longer on {part_with_interval(found.same_machine)} of them"
            rows.append((f"same machine, {pair}", text))
        text = f"{labels[0]} lasts longer with {part_with_interval(found.two_specimens)}"
        rows.append((f"two specimens, {pair}", text))
    rows += [
        (f"B10, {label}", _life(one, 10.0)) for label, one in zip(labels, results, strict=True)
    ]
    curves = [one for one in zip(labels, results, strict=True) if one[1].count]
    text = "Share of the machines that outlast a life."
    plots = [Plot("Survival", text, _survival(curves))] if curves else []
    if variable := against(results):
        text = f"Lives, with their 95 % intervals, against {variable.key}."
        plots.append(Plot("Life against the design", text, _against(results, variable)))
    return Part(
        title=f"{', '.join(labels[:-1])} and {labels[-1]}",
        question=f"Which design lasts more {first.unit}?",
        answer=rows,
        error=_ERROR,
        plots=plots,
        tables=[],
    )


def _against(results: Sequence[LifeResult], variable: DesignVariable) -> Any:
    """Return the lives of a sweep against its design variable."""
    unit, size = engineers_unit(variable.unit)
    plot = axes(variable.key if unit == "1" else f"{variable.key} [{unit}]", "")
    plot.yaxis.axis_label = f"life [{results[0].unit}]"
    designs = {one.variable.value / size: one for one in results if one.variable}
    for colour, share in zip(COLOURS, results[0].settings.shares, strict=False):
        lives = {value: designs[value].b(share) for value in sorted(designs)}
        known = {value: life for value, life in lives.items() if math.isfinite(life.value)}
        ends = {f: [getattr(life, f) for life in known.values()] for f in ("value", "low", "high")}
        data = columns(design=list(known), **ends)
        style: dict[str, Any] = {"color": colour, "source": data}
        plot.segment("design", "low", "design", "high", **style)
        plot.line("design", "value", **style, width=2, legend_label=f"B{share:g}")
        points = plot.scatter("design", "value", **style, size=7)
        interval = ("95 % interval", "@low{0,0} to @high{0,0}")
        hover(plot, [points], ("", f"B{share:g}"), ("life", "@value{0,0}"), interval)
    legend(plot)
    return plot


def _plots(result: LifeResult) -> list[Plot]:
    """Return survival, effects of the inputs, and the lives against the first input."""
    if result.count == 0:
        return []
    text = "Share of the machines that outlast a life, with its 95 % band."
    if result.target is not None:
        text += f" Dotted: the target of {count(result.target)} {result.unit}."
    several = not (result.are_equal or result.settings.alone)
    effects = effect_plots(result, "life", result.lives) if several else []
    return [Plot("Survival", text, _survival([("", result)])), *effects]


def _survival(results: Sequence[tuple[str, LifeResult]]) -> Any:
    """Return the survival of designs, by label, in one figure."""
    curves = [survival_of(result) for _, result in results]
    size, name = pass_unit(max(float(life[-1]) for life, *_ in curves))
    unit = name.replace("roller passes", results[0][1].unit)
    plot = axes(f"life [{unit}]", "survival [%]")
    for number, ((label, result), (life, *parts)) in enumerate(zip(results, curves, strict=True)):
        percent = dict(zip(("survival", "low", "high"), (100.0 * p for p in parts), strict=True))
        data = columns(life=life / size, **percent)
        style: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "width": 2}
        named = {"legend_label": label} if label else {}
        if result.is_exact:
            plot.varea("life", "low", "high", source=data, color=style["color"], alpha=0.18)
            line = plot.line("life", "survival", source=data, **style, **named)
        else:
            for end in ("low", "high"):
                plot.step("life", end, source=data, color=style["color"], alpha=0.4, mode="after")
            plot.step("life", "survival", source=data, mode="after", **style, **named)
            # values under the pointer are those of a line, which steps do not have
            line = plot.line("life", "survival", source=data, alpha=0.0)
        tips = ("survival", "@survival{0.0} %"), ("95 % interval", "@low{0.0} to @high{0.0} %")
        hover(plot, [line], ("", label), ("life", f"@life{{0.000}} {unit}"), *tips)
        if result.target is not None:
            place = [result.target / size] * 2
            plot.line(place, [0.0, 100.0], color="black", line_dash="dotted", width=2)
    legend(plot)
    return plot
