"""Wear factor of a scenario that lives can be integrated over exactly, or why there is none."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.evolution.limits import OF_FATIGUE
from wearsim.plugins import BODIES
from wearsim.scenario import RandomInput, Scenario
from wearsim.studies.run.draws import Drawer
from wearsim.types import FloatArray

SHARED = "wear.factor"  # of cylinder and roller
CYLINDER = "wear.cylinder.k_over_h"
OF_BODIES = {f"wear.{body}.k_over_h": body for body in BODIES}
RARE = 1e-6  # probability of a greater factor than that up to which tests are run
NEGLIGIBLE = 1e-12  # the same for a life before the target


@dataclass(frozen=True)
class ExactFactor:
    """Random wear factor that all bodies share in a test.

    Parameters
    ----------
    item : RandomInput
    others : tuple of str
        Inputs with a rank correlation, in the order of `slopes`.
    slopes : ndarray
        Coefficients of the mean normal score of the factor given their scores.
    spread : float
        Standard deviation of that score.
    """

    item: RandomInput
    others: tuple[str, ...]
    slopes: FloatArray
    spread: float

    @property
    def reference(self) -> float:
        """The median, with which tests are run."""
        return float(self.item.scalar.quantile(np.array([0.5]))[0])

    def exceeded(self, probability: float) -> float:
        """Return the factor that is exceeded with a probability."""
        return float(self.item.scalar.quantile(np.array([1.0 - probability]))[0])

    def score_mean(self, drawer: Drawer, realisation: int) -> float:
        """Return the mean normal score of the factor given the other draws of a realisation."""
        if not self.others:
            return 0.0
        from scipy.special import ndtri  # noqa: PLC0415  (slow to load)

        uniforms = drawer.uniforms(realisation, 1)
        return float(
            self.slopes @ np.array([float(ndtri(uniforms[name][0, 0])) for name in self.others])
        )


def exact_factor(scenario: Scenario) -> tuple[ExactFactor | None, str]:
    """Return the wear factor that is integrated exactly, or None and the reason in words.

    The worn state must depend on factor and passes through their product alone.
    """
    if reason := _obstacle(scenario):
        return None, reason
    (item,) = _factors(scenario)
    pairs = {
        frozenset((first, second)): rank for first, second, rank in scenario.sampling.correlation
    }
    others = tuple(
        other.name
        for other in scenario.random
        if other is not item and any(other.name in pair for pair in pairs)
    )
    if not any(item.name in pair for pair in pairs):
        return ExactFactor(item, (), np.zeros(0), 1.0), ""

    def normal(first: str, second: str) -> float:
        rank = pairs.get(frozenset((first, second)), float(first == second))
        return 2.0 * math.sin(math.pi / 6.0 * rank)

    among = np.array([[normal(a, b) for b in others] for a in others])
    across = np.array([normal(item.name, name) for name in others])
    slopes = np.linalg.solve(among, across)
    return ExactFactor(item, others, slopes, math.sqrt(1.0 - float(slopes @ across))), ""


def _factors(scenario: Scenario) -> list[RandomInput]:
    return [item for item in scenario.random if item.name.startswith("wear.")]


def _obstacle(scenario: Scenario) -> str:
    """Return why no wear factor can be integrated exactly, or an empty text."""
    factors = _factors(scenario)
    if not factors:
        return "no wear factor is random"
    if of_fatigue := [name for name in OF_FATIGUE if name in scenario.limit.given]:
        return f"a limit of {of_fatigue[0]} depends on the wear factor and on the passes separately"
    names = [item.name for item in factors]
    if scenario.wear is None or not set(names) <= {SHARED, *OF_BODIES}:
        return f"{', '.join(names)} is not a factor of all wear"
    rates = {body: scenario.wear.built.depth_per_dissipation(body, 1.0) for body in BODIES}
    if any(rate is None for rate in rates.values()):
        return f"the wear law {scenario.wear.law} is not linear in the dissipation"
    if len(names) > 1:
        return f"{' and '.join(names)} are drawn independently"
    if factors[0].scalar.quantile(np.array([0.5 * RARE]))[0] <= 0.0:
        return f"{names[0]} is 0 with a probability, and such a test has no limit"
    body = OF_BODIES.get(names[0])
    if fixed := [other for other, rate in rates.items() if body and other != body and rate]:
        return (
            f"{names[0]} is random and K/H of the {fixed[0]} is not, so that their ratio varies;"
            f" scatter both by {SHARED}"
        )
    if processes := [item.name for item in scenario.random if item.role == "process"]:
        return f"{' and '.join(processes)} {'vary' if len(processes) > 1 else 'varies'} in time"
    if not scenario.load.built.constant:
        return f'the load "{scenario.load.kind}" varies in time'
    if scenario.load.terms:
        return f'the load term "{scenario.load.terms[0].name}" depends on time'
    return "every pass is solved separately" if scenario.evolution.stepper == "per-pass" else ""


def with_posterior(scenario: Scenario, file: str | Path) -> Scenario:
    """Return a scenario whose wear factor has the posterior in a file.

    It is K/H of the cylinder or cam. Where a random `wear.factor` multiplies K/H of both bodies, it
    is this factor, so that K/H of the cylinder has the posterior and the ratio of both stays.

    Parameters
    ----------
    scenario : Scenario
    file : path
        From `wearsim identify --posterior`.

    Raises
    ------
    ScenarioError
        If the file cannot be used, or contains the scatter of an input that is random.
    """
    return scenario.changed(dict([posterior_table(scenario, file)]))


def posterior_table(scenario: Scenario, file: str | Path) -> tuple[str, dict[str, object]]:
    """Return the key of the wear factor, and its table with the posterior in a file."""
    name = Path(os.path.relpath(file, Path(scenario.file).parent)).as_posix()
    table: dict[str, object] = {"distribution": "posterior", "file": name}
    if any(item.name == SHARED for item in scenario.random) and scenario.wear is not None:
        options: Any = scenario.wear.options
        return SHARED, {**table, "over": f"{options.cylinder.wear_factor!r} 1/Pa"}
    return CYLINDER, table
