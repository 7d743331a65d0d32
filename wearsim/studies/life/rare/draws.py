"""Draws of the further tests of a study of lives: shifted scores, their weights, and changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.scenario import Scenario
from wearsim.studies.run.draws import Drawer
from wearsim.types import FloatArray
from wearsim.uq.survival.design_points import mixture_log_weights

LEAST_TESTS = 200  # for rare events
MOST_INPUTS = 4  # with a shift


def shifted_inputs(scenario: Scenario, factor: str = "") -> list[str]:
    """Return the inputs that may be shifted: one number per test, without rank correlation.

    Parameters
    ----------
    scenario : Scenario
    factor : str
        Wear factor that is integrated exactly, given the other draws; it is not shifted, and a
        correlation with it is permitted.
    """
    pairs = [set(names) for *names, _ in scenario.sampling.correlation]
    correlated = {name for pair in pairs if factor not in pair for name in pair}
    return [
        item.name
        for item in scenario.random
        if item.role == "scalar"
        and item.persistence == "per-test"
        and item.name not in {factor, *correlated}
    ]


def drawn_scores(drawer: Drawer, names: list[str], first: int, count: int) -> FloatArray:
    """Return the normal scores of inputs in consecutive realisations, (count, inputs)."""
    from scipy.special import ndtri  # noqa: PLC0415  (slow to load)

    uniforms = drawer.uniforms(first, count)
    return np.column_stack([ndtri(uniforms[name][:, 0]) for name in names])


def log_weight(
    drawer: Drawer,
    shift: Mapping[str, float],
    realisation: int,
    mixture: Sequence[tuple[float, Mapping[str, float]]] = (),
) -> float:
    """Return the logarithm of the weight of a realisation with shifted draws.

    Parameters
    ----------
    drawer : Drawer
    shift : mapping of str to float
        Of the scores, by name of the input.
    realisation : int
    mixture : sequence of (float, mapping of str to float), optional
        Share and shift of each part of the draws, if the realisation is one of a mixture.
    """
    names = list(shift)
    scores = drawn_scores(drawer, names, realisation, 1)
    shares, shifts = zip(*(mixture or ((1.0, shift),)), strict=True)
    vectors = [np.array([by_input[name] for name in names]) for by_input in shifts]
    return float(mixture_log_weights(scores, shares, vectors)[0])


def changes_of(stages: Sequence[Mapping[str, Any]]) -> dict[int, tuple[int, float]]:
    """Return from which realisation the draws of others depart, and the scale of the change."""
    return {
        stage["first"] + place: (parent, stage["scale"])
        for stage in stages
        for place, parent in enumerate(stage.get("parents", ()))
    }
