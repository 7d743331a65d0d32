"""A random wear test, and the random numbers that it is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np

from wearsim.scenario import Scenario, parse_scenario
from wearsim.scenario.examples import shipped_scenario

TRUE_TOLERANCE = 1e-6  # of the reference, whose hash does not depend on the tolerance of the test


@dataclass(frozen=True)
class RandomTest:
    """A shipped scenario with random changes.

    Parameters
    ----------
    name : str
        Seed and number of the test.
    base : str
        Name of the shipped scenario.
    changes : mapping of str to object
        Changed values by dotted key.
    files : mapping of str to str
        Content of the files that the changes name.
    stratum : str
        Stratum of the test, one of `strata.STRATA`.
    """

    name: str
    base: str
    changes: Mapping[str, object]
    files: Mapping[str, str] = field(default_factory=dict)
    stratum: str = "ordinary"

    def scenario(self, **further: object) -> Scenario:
        """Return the scenario with further changes; two underscores represent the dot of a key."""
        base = shipped(self.base)
        changes = {**self.changes, **{k.replace("__", "."): v for k, v in further.items()}}
        files = {**base.files, **self.files}
        return parse_scenario(base.text, f"{self.name}.toml", files.__getitem__, changes)

    @cached_property
    def unchanged(self) -> Scenario:
        """Scenario of the test without further changes."""
        return self.scenario()

    @property
    def tolerance(self) -> float:
        """Tolerance of the test."""
        return self.unchanged.evolution.tolerance

    @cached_property
    def digest(self) -> str:
        """Hash of the scenario and its files, without the tolerance and the stepper."""
        return digest(self.unchanged)

    @property
    def settings(self) -> str:
        """The changes in one line."""
        changes = {k: v for k, v in self.changes.items() if k not in _UNINTERESTING}
        return ", ".join([self.base, *(f"{key} = {_brief(v)}" for key, v in changes.items())])


_UNINTERESTING = {"load.file", "sampling.realisation", "outputs.records", "evolution.max_steps"}


def digest(scenario: Scenario) -> str:
    """Return a hash of the settings on which the exact solution of a scenario depends."""
    changes = {"evolution.tolerance": TRUE_TOLERANCE, "evolution.stepper": "auto"}
    return scenario.changed(changes).sha256[:12]


def _brief(value: object) -> str:
    """Return a value of a scenario without braces and quotation marks."""
    if isinstance(value, dict):
        return "(" + ", ".join(f"{key} {_brief(item)}" for key, item in value.items()) + ")"
    return ", ".join(map(_brief, value)) if isinstance(value, list) else str(value)


@cache
def shipped(name: str) -> Scenario:
    """Return a shipped scenario, read once."""
    return shipped_scenario(name)


class Draws:
    """Random numbers of one test, and the changes that they make.

    Parameters
    ----------
    seed, number : int
        Not negative; each pair gives other numbers.
    """

    def __init__(self, seed: int, number: int) -> None:
        self._random = np.random.default_rng([seed, number])
        self.changes: dict[str, object] = {}
        self.files: dict[str, str] = {}

    def chance(self, probability: float) -> bool:
        """Return True with a probability."""
        return bool(self._random.random() < probability)

    def uniform(self, low: float, high: float) -> float:
        """Return a number with four digits, uniform between two limits."""
        return rounded(self._random.uniform(low, high))

    def log_uniform(self, low: float, high: float) -> float:
        """Return a number with four digits whose logarithm is uniform."""
        return rounded(np.exp(self._random.uniform(np.log(low), np.log(high))))

    def choice(self, weights: Mapping[str, float]) -> str:
        """Return one of several names by their probabilities."""
        return str(self._random.choice(list(weights), p=list(weights.values())))

    def normal(self, size: int) -> list[float]:
        """Return standard normal numbers."""
        return [float(value) for value in self._random.standard_normal(size)]


def rounded(value: float) -> float:
    """Return a number rounded to four digits."""
    return float(f"{value:.4g}")
