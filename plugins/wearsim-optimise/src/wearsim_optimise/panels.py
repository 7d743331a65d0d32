"""Panels of an optimisation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.report.panels import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    RED,
    Axis,
    Bars,
    Line,
    Mark,
    Panel,
    Sheet,
    Span,
    dots,
    message,
)
from wearsim_optimise.designs import Design
from wearsim_optimise.result import OptimisationResult
from wearsim_optimise.variables import Variable, places_of

_BESIDE = 3  # panels in a row of the figure
_NEAR = 30  # designs drawn as curves of the parallel coordinates


def optimisation_sheet(result: OptimisationResult, measured: Sequence[Any] = ()) -> Sheet:
    """Return the panels of an optimisation; measured profiles are not drawn."""
    if not result.raw.best:
        text = message("no best design yet", "continue with `wearsim resume`")
        return Sheet(result.title, {"none": text}, [["none"]], (6.0, 4.0))
    panels: dict[str, Panel] = {}
    if result.front:
        panels["front"] = _front(result)
    for variable in result.design_variables:
        panels[variable.name] = _scatter(result, variable)
    panels["progress"] = _progress(result)
    panels["parallel"] = _parallel(result)
    if any(math.isfinite(row["elasticity"]) for row in result.raw.sensitivity):
        panels["sensitivity"] = _sensitivity(result)
    names = list(panels)
    rows = [names[n : n + _BESIDE] for n in range(0, len(names), _BESIDE)]
    if len(rows) > 1:
        rows[-1] += [rows[-1][-1]] * (_BESIDE - len(rows[-1]))
    size = (4.4 * len(rows[0]), 3.4 * len(rows))
    return Sheet(result.title, panels, rows, size)


def _axis_of(result: OptimisationResult, name: str) -> Axis:
    return Axis(name, result.goals.unit(name))


def _shares(designs: Sequence[Design]) -> dict[str, list[Design]]:
    """Return designs by how they are drawn: within the constraints, or not."""
    return {
        "feasible": [design for design in designs if design.is_feasible],
        "violates a constraint": [d for d in designs if d.is_evaluated and not d.is_feasible],
    }


def _array(of: Any, designs: Sequence[Design]) -> Any:
    """Return a value of each design."""
    return np.array([of(design) for design in designs])


def _points(result: OptimisationResult, x: Any, y: Any) -> list[Mark]:
    """Return the designs as points of two of their values, the best with another mark."""
    marks: list[Mark] = []
    for (label, designs), colour in zip(_shares(result.designs).items(), (BLUE, GREY), strict=True):
        if designs:
            style: Any = {"label": label, "colour": colour, "alpha": 0.7}
            numbers = np.array([float(design.number) for design in designs])
            more = {"design": (numbers, "1")}
            marks.append(dots(_array(x, designs), _array(y, designs), more=more, **style))
    best = [result.best]
    point = _array(x, best), _array(y, best)
    marks.append(dots(point[0], point[1], "D", label="best", colour=RED, size=7.0))
    return marks


def _value(name: str) -> Any:
    return lambda design: design.values.get(name, math.nan)


def _scatter(result: OptimisationResult, variable: Variable) -> Panel:
    """Return the objective against a variable."""
    place = result.design_variables.index(variable)
    name = result.goals.objectives[0][0]
    ticks = list(range(variable.count)) if variable.choices else None
    x = Axis(
        variable.name + (f" [{variable.unit}]" if variable.unit else ""),
        per_si=1.0,
        log=variable.is_log,
        ticks=ticks,
        names=[str(choice) for choice in variable.choices] or None,
    )
    marks = _points(result, lambda design: design.numbers[place], _value(name))
    caption = f"{name} of all designs against {variable.name}; those outside a constraint in grey."
    return Panel(f"{name} and {variable.name}", x, _axis_of(result, name), marks, caption)


def _front(result: OptimisationResult) -> Panel:
    """Return the front of two objectives."""
    (first, _), (second, _) = result.goals.objectives
    marks = _points(result, _value(first), _value(second))
    front = [_array(_value(name), result.front) for name in (first, second)]
    marks.insert(0, Line(front[0], front[1], label="front", colour=ORANGE))
    axes = _axis_of(result, first), _axis_of(result, second)
    caption = f"Designs by {first} and {second}. No other design is better than one of the front"
    return Panel("Front of two objectives", *axes, marks, f"{caption} in both.")


def _progress(result: OptimisationResult) -> Panel:
    """Return the objective of the best feasible design so far."""
    name = result.goals.objectives[0][0]
    searched = [design for design in result.designs if design.is_searched]
    best, numbers, values = None, [], []
    for design in searched:
        if design.is_feasible and (best is None or design.loss < best.loss):
            best = design
        numbers.append(float(design.number))
        values.append(math.nan if best is None else best.values[name])
    known = [design for design in searched if design.is_feasible]
    marks: list[Mark] = [Line(np.array(numbers), np.array(values), label="best so far", colour=RED)]
    if known:
        places = np.array([float(d.number) for d in known])
        marks.append(dots(places, np.array([d.values[name] for d in known]), label="feasible"))
    caption = f"{name} of the designs in the order of the search, and the best so far."
    return Panel("Search", Axis("design"), _axis_of(result, name), marks, caption)


def _parallel(result: OptimisationResult) -> Panel:
    """Return variables and quantities of the designs as curves over parallel axes."""
    variables, goals = result.design_variables, result.goals
    quantities = list(goals.named)
    evaluated = [design for design in result.designs if design.is_evaluated]
    rows = []
    for design in evaluated:
        places = places_of(variables, design.numbers)
        rows.append([*places, *(design.values[name] for name in quantities)])
    table = np.array(rows, dtype=float)
    values = table[:, len(variables) :]
    span = np.ptp(values, axis=0)
    table[:, len(variables) :] = (values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    names = [*(variable.name for variable in variables), *quantities]
    x = np.arange(float(len(names)))
    order = sorted(range(len(evaluated)), key=lambda n: evaluated[n].number)[-_NEAR:]
    marks: list[Mark] = []
    for feasible, colour in ((False, GREY), (True, BLUE)):
        chosen = [n for n in order if evaluated[n].is_feasible == feasible]
        if chosen:
            label = "feasible" if feasible else "violates a constraint"
            marks.append(Line(x, table[chosen], colour=colour, alpha=0.5, label=label, width=0.9))
    best = [n for n, design in enumerate(evaluated) if design.number == result.best.number]
    marks.append(Line(x, table[best[0]], colour=RED, width=2.2, label="best"))
    marks += [Span(place, colour=BLACK, width=0.6) for place in x]
    axis = Axis("", ticks=x.tolist(), names=names)
    caption = "Designs over parallel axes, each from its lower to its upper end; the best in red."
    return Panel("Parallel coordinates", axis, Axis("part of the range"), marks, caption)


def _sensitivity(result: OptimisationResult) -> Panel:
    """Return the change of the objective by one per cent of each variable."""
    name = result.goals.objectives[0][0]
    rows = [row for row in result.raw.sensitivity if math.isfinite(row["elasticity"])]
    places = np.arange(float(len(rows)))
    values = np.array([0.01 * row["elasticity"] for row in rows])
    bars = Bars(places - 0.3, places + 0.3, values, horizontal=True, colour=BLUE)
    y = Axis("", ticks=places.tolist(), names=[row["variable"] for row in rows])
    caption = f"Change of {name} where a variable grows by 1 %, from the neighbours of the optimum."
    return Panel("Sensitivity at the optimum", Axis(f"change of {name}", "%"), y, [bars], caption)
