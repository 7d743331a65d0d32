"""Sensitivity, active constraints, tolerances and confirmation of an optimum."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim_optimise.designs import Design, Designs
from wearsim_optimise.variables import overrides

STEP = 0.02  # step of the derivatives, over the range of a variable
ACTIVE = 0.01  # slack over the limit below which a constraint is active
_CORNERS = 3  # variables up to which all corners of the tolerances are evaluated


def sensitivity(designs: Designs, best: Design) -> list[dict[str, Any]]:
    """Return the derivatives of objective and constraints at the optimum, by variable.

    They are central differences over a fiftieth of the range on either side, one-sided at bounds;
    integers and lists have none.
    """
    place, sign = designs.places(best), _sign(designs)
    pairs = []
    for number, variable in enumerate(designs.variables):
        if variable.kind != "continuous":
            continue
        ends = []
        for side in (-1.0, 1.0):
            moved = place.copy()
            moved[number] = min(max(moved[number] + side * STEP, 0.0), 1.0)
            ends.append(moved if moved[number] != place[number] else None)
        pairs.append((number, ends))
    places = [end for _, ends in pairs for end in ends if end is not None]
    evaluated = iter(designs.at(places, "sensitivity"))
    rows = []
    for number, ends in pairs:
        low, high = (best if end is None else next(evaluated) for end in ends)
        variable = designs.variables[number]
        distance = designs.places(high)[number] - designs.places(low)[number]
        if not (low.is_evaluated and high.is_evaluated and distance > 0.0):
            low, high, distance = _one_sided(designs, best, low, high, number)
        known = distance > 0.0
        ratio = high.numbers[number] / low.numbers[number] if known and low.numbers[number] else 0.0
        rows.append(
            {
                "variable": variable.name,
                "loss": (high.loss - low.loss) / distance if known else math.nan,
                "slacks": ((high.slacks - low.slacks) / distance).tolist() if known else [],
                "low": low.numbers[number],
                "high": high.numbers[number],
                # change of the objective, in per cent, where the variable grows by 1 %
                "elasticity": -sign * (high.loss - low.loss) / math.log(ratio)
                if known and ratio > 0.0 and ratio != 1.0
                else math.nan,
            }
        )
    return rows


def _one_sided(
    designs: Designs, best: Design, low: Design, high: Design, number: int
) -> tuple[Design, Design, float]:
    """Return the side that could be evaluated, with the optimum."""
    for pair in ((low, best), (best, high)):
        distance = designs.places(pair[1])[number] - designs.places(pair[0])[number]
        if pair[0].is_evaluated and pair[1].is_evaluated and distance > 0.0:
            return (*pair, float(distance))
    return best, best, 0.0


def active_constraints(
    designs: Designs, best: Design, rows: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """Return the active constraints and bounds, and what relaxing them by 1 % would bring.

    At the optimum the derivative of the loss is a sum of those of the active constraints, with
    Lagrange multipliers that are not negative (Karush, Kuhn and Tucker); a multiplier is the change
    of the loss per change of its limit.
    """
    goals = designs.goals
    assert goals is not None
    by_name = {row["variable"]: row for row in rows if len(row["slacks"])}
    known = [v for v in designs.variables if v.name in by_name]
    places = dict(zip([v.name for v in designs.variables], designs.places(best), strict=True))
    names, columns = [], []
    for number, name in enumerate(goals.slack_names):
        if best.slacks[number] < ACTIVE:
            names.append(name)
            columns.append([by_name[v.name]["slacks"][number] for v in known])
    for number, variable in enumerate(known):
        side = 1.0 if places[variable.name] <= ACTIVE else -1.0
        if not ACTIVE < places[variable.name] < 1.0 - ACTIVE:
            bound = variable.low if side > 0.0 else variable.high
            names.append(f"{variable.name} {'>' if side > 0.0 else '<'} {variable.shown(bound)}")
            columns.append([side if n == number else 0.0 for n in range(len(known))])
    if not names:
        return []
    multipliers = np.full(len(names), math.nan)
    if known:
        from scipy.optimize import nnls  # noqa: PLC0415  (slow to import)

        matrix = np.array(columns).T
        losses = np.array([by_name[v.name]["loss"] for v in known])
        if np.isfinite(matrix).all() and np.isfinite(losses).all():
            multipliers, _ = nnls(matrix, losses)
    constraints = []
    for name, multiplier in zip(names, multipliers.tolist(), strict=True):
        is_bound = name not in goals.slack_names
        relaxed = 0.01 * (_per_part(known, name) if is_bound else 1.0)
        gain = math.nan
        if math.isfinite(multiplier):
            gain = math.expm1(_sign(designs) * multiplier * relaxed)
        constraints.append({"constraint": name, "multiplier": multiplier, "gain": gain})
    return constraints


def _per_part(known: Sequence[Any], name: str) -> float:
    """Return the change of a variable's place per relative change of its bound."""
    variable = next(v for v in known if name.startswith(f"{v.name} "))
    bound = variable.low if ">" in name else variable.high
    if variable.is_log:
        return 1.0 / math.log(variable.high / variable.low)
    return float(abs(bound) / (variable.high - variable.low))


def tolerances(designs: Designs, best: Design, given: Mapping[str, float]) -> dict[str, Any] | None:
    """Return the worst of the neighbours of the optimum within tolerances of the drawing.

    Parameters
    ----------
    designs : Designs
    best : Design
    given : mapping of str to float
        Tolerances in the units of the variables, by their names.
    """
    if not given:
        return None
    goals = designs.goals
    assert goals is not None
    main = goals.objectives[0][0]
    names = [v.name for v in designs.variables]
    moved = [names.index(name) for name in given]
    signs: list[tuple[float, ...]]
    if len(moved) <= _CORNERS:
        signs = list(itertools.product((-1.0, 1.0), repeat=len(moved)))
    else:
        unit = np.eye(len(moved))
        signs = [tuple(side * row) for row in unit for side in (-1.0, 1.0)]
    neighbours = []
    for row in signs:
        numbers = list(best.numbers)
        for place, sign in zip(moved, row, strict=True):
            numbers[place] += sign * given[names[place]]
        neighbours.append(tuple(numbers))
    tried = designs.with_numbers(neighbours, "tolerance")
    evaluated = [design for design in tried if design.is_evaluated]
    worst = max(evaluated, key=lambda design: design.loss, default=None)
    violated = {}
    for number, name in enumerate(goals.slack_names):
        violating = [design for design in evaluated if design.slacks[number] < 0.0]
        if violating:
            most_violating = min(violating, key=lambda design: float(design.slacks[number]))
            violated[name] = {
                "design": most_violating.number,
                "beyond": -float(most_violating.slacks[number]),
            }
    return {
        "tolerances": dict(given),
        "neighbours": len(tried),
        "failed": len(tried) - len(evaluated),
        "worst": None if worst is None else worst.number,
        "part": None if worst is None else worst.values[main] / best.values[main],
        "violated": violated,
    }


def confirmation(designs: Designs, first: Design, best: Design) -> list[dict[str, Any]]:
    """Return each objective of the optimum over that of the first design, with fresh draws."""
    goals = designs.goals
    assert goals is not None
    rows: list[dict[str, Any]] = []
    for name, _ in goals.objectives:
        if not first.is_evaluated:
            rows.append({"name": name, "why": f"the first design: {first.outcome['reason']}"})
            continue
        if first.number == best.number:
            rows.append({"name": name, "why": "the first design is the best"})
            continue
        verb = goals.named[name]["verb"]
        random = verb in {"life", "ensemble"}
        values = [design.values[name] for design in (best, first)]
        gain: dict[str, Any] = {"values": values, "fresh": random}
        if not random:
            ratio = values[0] / values[1] if values[1] else math.nan
            rows.append({"name": name, **gain, "ratio": ratio, "low": ratio, "high": ratio})
            continue
        pair = [overrides(designs.variables, design.numbers) for design in (best, first)]
        job = {"overrides": pair[0], "other": pair[1], "name": name}
        (design,) = designs.evaluate([job], [best.numbers], "confirmation")
        ratio_or_reason = design.outcome.get("gain") or {"why": design.outcome["reason"]}
        rows.append({"name": name, **gain, **ratio_or_reason})
    return rows


def _sign(designs: Designs) -> int:
    """Return 1 if the first objective shall be great, -1 if small."""
    assert designs.goals is not None
    return designs.goals.objectives[0][1]
