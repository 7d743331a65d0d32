"""Fronts of two objectives: the designs that no other surpasses in both, and orders by them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim_optimise.designs import Design, Designs
from wearsim_optimise.solvers import feasible_first


def pareto_first(rated: Sequence[Any]) -> list[float]:
    """Return the order of designs by two objectives: by fronts, those far from others first."""
    order = np.array(feasible_first(rated))
    feasible = [n for n, item in enumerate(rated) if item.is_feasible]
    if not feasible:
        return list(map(float, order))
    losses = np.array([rated[n].losses for n in feasible])
    spread = np.ptp(losses, axis=0)
    scaled = losses / np.where(spread > 0.0, spread, 1.0)
    dominated = [
        sum(bool(np.all(candidate <= row) and np.any(candidate < row)) for candidate in losses)
        for row in losses
    ]
    for n, row in enumerate(scaled):
        distance = np.sort(np.abs(scaled - row).sum(axis=1))[1] if len(scaled) > 1 else 1.0
        order[feasible[n]] = dominated[n] - 0.5 * min(float(distance), 1.0) - 1e6
    return list(map(float, order))


def front_of(designs: Designs) -> list[Design]:
    """Return the feasible designs that no other surpasses in both objectives, by the first."""
    feasible = [design for design in designs.all if design.is_feasible]
    return sorted(
        (
            design
            for design in feasible
            if not any(_surpasses(candidate, design) for candidate in feasible)
        ),
        key=lambda design: (design.losses, design.number),
    )


def _surpasses(candidate: Design, design: Design) -> bool:
    """Return whether a candidate is as good as a design in all objectives and better in one.

    Of designs with equal objectives the first surpasses the others.
    """
    pairs = list(zip(candidate.losses, design.losses, strict=True))
    if all(a == b for a, b in pairs):
        return candidate.number < design.number
    return all(a <= b for a, b in pairs)
