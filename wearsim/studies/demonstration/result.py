"""Demonstration test of a design: specimens, duration, acceleration, probability of passing."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearsim.quantities import quantity
from wearsim.results.viewed import Viewed
from wearsim.studies.life.result import LifeResult
from wearsim.studies.life.settings import parse_life
from wearsim.studies.opening import labels_of
from wearsim.types import FloatArray
from wearsim.uq.estimation.intervals import ENDS, UNKNOWN, Interval
from wearsim.uq.survival.demonstration import (
    DrawnLives,
    drawn_lives,
    pass_probability,
    specimens,
)
from wearsim.uq.survival.lives import fewest_lives

DURATIONS = (0.75, 1.0, 1.5, 2.0, 3.0, 5.0)  # of the test, over the life to show
FAILURES = 2  # up to which tests are planned by default
_MOST_FAILURES = 20
_TEXT = re.compile(
    r"R\s*=\s*(?P<survival>[^\s,]+)[\s,]+C\s*=\s*(?P<confidence>[^\s,]+)[\s,]+at\s+(?P<life>.+?)"
    r"(?:\s+with\s+(?P<failures>\d+)\s+failures?)?",
    re.IGNORECASE,
)
_EXPECTED = 'expected a survival, a confidence and a life, as in "R=0.9 C=0.95 at 500 h"'


class Requirement(NamedTuple):
    """What a test shall show.

    Parameters
    ----------
    survival, confidence : float
    life : float
        In `unit`.
    unit : str
        Unit of the lives, or a unit of time.
    seconds : float
        Size of a unit of time, 0 for the unit of the lives.
    failures : int
        Number of failures up to which tests are planned.
    """

    survival: float
    confidence: float
    life: float
    unit: str
    seconds: float
    failures: int

    @classmethod
    def parse(cls, text: str, unit: str) -> Requirement:
        """Return the requirement of a text such as "R=0.9 C=0.95 at 500 h with 3 failures".

        Parameters
        ----------
        text : str
        unit : str
            Unit of lives.

        Raises
        ------
        ValueError
            If it cannot be read, or a number is out of range.
        """
        match = _TEXT.fullmatch(text.strip())
        if match is None:
            raise ValueError(f"cannot read '{text}': {_EXPECTED}")
        numbers = []
        for name, letter in (("survival", "R"), ("confidence", "C")):
            try:
                number = float(match[name])
            except ValueError as error:
                raise ValueError(f"'{text}': {letter} is not a number: {_EXPECTED}") from error
            if not 0.0 < number < 1.0:
                raise ValueError(f"'{text}': {letter} must be between 0 and 1, got {match[name]}")
            numbers.append(number)
        failures = int(match["failures"] or FAILURES)
        if failures > _MOST_FAILURES:
            raise ValueError(f"'{text}': at most {_MOST_FAILURES} failures, got {failures}")
        life = match["life"]
        parse_life(life, unit, 1.0, "life")  # checks form and sign
        seconds = 0.0
        try:
            value = float(life.removesuffix(unit))
        except ValueError:
            unit = re.sub(r"^[-+\d.eE\s]+", "", life)
            seconds = quantity(f"1 {unit}", "s")
            value = quantity(life, "s") / seconds
        return cls(numbers[0], numbers[1], value, unit, seconds, failures)


class Plan(NamedTuple):
    """A test of one duration.

    Parameters
    ----------
    duration : float
        Of the test, in the unit of the requirement.
    failures : int
        Number of failures that are allowed.
    specimens : int, optional
        None if there is no such test.
    low, high : int, optional
        Numbers of specimens at the ends of the 95 % interval of the simulated shape.
    passing : Interval
        Probability that the design passes.
    """

    duration: float
    failures: int
    specimens: int | None
    low: int | None
    high: int | None
    passing: Interval


@dataclass(frozen=True, eq=False)
class Demonstration(Viewed):
    """Demonstration tests of a design, from `demonstration`.

    Parameters
    ----------
    designs : tuple of LifeResult
        Lives in service; then those under the conditions of accelerated tests.
    labels : tuple of str
    requirement : Requirement

    Examples
    --------
    >>> lives = wearsim.open_results("rig-life.h5")
    >>> found = wearsim.demonstration(lives, "R=0.9 C=0.95 at 500000")
    >>> found.by_binomial
    [29, 46, 61]
    >>> longer = found.plan(1e6)
    >>> longer.specimens < 29
    True
    """

    designs: tuple[LifeResult, ...]
    labels: tuple[str, ...]
    requirement: Requirement

    path = None

    def __repr__(self) -> str:
        need = self.requirement
        return (
            f"<Demonstration '{self.title}': R = {need.survival:g}, C = {need.confidence:g} at"
            f" {need.life:g} {need.unit}, {self.by_binomial[0]} specimens>"
        )

    @property
    def title(self) -> str:
        """Title of the design."""
        return self.designs[0].title

    @property
    def by_binomial(self) -> list[int]:
        """Specimens for the life itself, for each number of failures, without a distribution."""
        need = self.requirement
        known, failures = np.array([need.survival]), range(need.failures + 1)
        numbers = (specimens(need.confidence, known, k) for k in failures)
        return [int(number) for number in numbers if number is not None]

    @cached_property
    def _drawn(self) -> list[DrawnLives]:
        """Lives of all designs with what is not known of them, in their own unit."""
        return [
            drawn_lives(
                design.distribution,
                design.uncertain,
                math.inf if design.is_known_throughout else design.most,
            )
            for design in self.designs
        ]

    def _units(self, design: int) -> float:
        """Return the number of units of life in a unit of the requirement."""
        seconds = self.requirement.seconds
        return seconds * self.designs[design].settings.rate if seconds else 1.0

    @cached_property
    def _scale(self) -> FloatArray:
        """Logarithm of the life of the simulated survival over the life to show, by draws."""
        need = self.requirement
        return self._drawn[0].log_quantile(1.0 - need.survival) - math.log(
            need.life * self._units(0)
        )

    def _interval(self, values: FloatArray) -> Interval:
        """Return the mean of draws with the 95 % interval."""
        if not np.isfinite(values).all():
            return UNKNOWN
        low, high = np.quantile(values, ENDS).tolist()
        return Interval(float(values.mean()), low, high)

    @property
    def life(self) -> Interval:
        """Life of the simulated design at the survival to show, in the requirement's unit."""
        return Interval(
            *(self.requirement.life * math.exp(end) for end in astuple(self._interval(self._scale)))
        )

    @property
    def survival(self) -> Interval:
        """Survival of the simulated design at the life to show."""
        log = np.full(len(self._scale), math.log(self.requirement.life * self._units(0)))
        return self._interval(1.0 - self._drawn[0].failed(log))

    @property
    def meets(self) -> float:
        """Probability that the simulated design has the survival to show, or a greater one."""
        return float((self._scale >= 0.0).mean()) if np.isfinite(self._scale).all() else math.nan

    def acceleration(self, design: int) -> Interval:
        """Return how many times shorter lives are under the conditions of a test.

        Parameters
        ----------
        design : int
            Its number, from 1.

        Returns
        -------
        Interval
            At the survival to show; of time if the requirement has a unit of time.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> faster = {"distribution": "lognormal", "median": "2.2e-11 1/Pa", "factor": 1.5}
        >>> both = [lives, lives.with_wear_factor(faster)]
        >>> found = wearsim.demonstration(both, "R=0.9 C=0.95 at 5e5", labels=["rig", "fast"])
        >>> print(f"{found.acceleration(1).value:.3f}")
        2.000
        """
        share = 1.0 - self.requirement.survival
        first, other = (self._drawn[k].log_quantile(share) for k in (0, design))
        # in units of time, where speeds may differ
        ratio = first - other + math.log(self._units(design) / self._units(0))
        return Interval(*(math.exp(end) for end in astuple(self._interval(ratio))))

    def plan(self, duration: float, failures: int = 0, design: int = 0) -> Plan:
        """Return a test of a duration.

        Parameters
        ----------
        duration : float
            In the unit of the requirement.
        failures : int
            That are allowed.
        design : int
            Number of the conditions of the test, 0 for service.

        Returns
        -------
        Plan

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> found = wearsim.demonstration(lives, "R=0.9 C=0.95 at 5e5")
        >>> found.plan(5e5).specimens, found.plan(5e5, failures=1).specimens
        (29, 46)
        """
        need, drawn = self.requirement, self._drawn[design]
        log = np.full(len(self._scale), math.log(duration * self._units(design)))
        # if the survival is just met, all lives are shorter by this factor
        survived = 1.0 - drawn.failed(log + self._scale)
        count = specimens(need.confidence, survived, failures)
        if count is None:
            return Plan(duration, failures, None, None, None, UNKNOWN)
        ends = np.quantile(survived, ENDS)
        low, high = (specimens(need.confidence, ends[k : k + 1], failures) for k in (0, 1))
        passing = self._interval(pass_probability(count, failures, drawn.failed(log)))
        return Plan(duration, failures, count, low, high, passing)

    @cached_property
    def plans(self) -> list[list[Plan]]:
        """Tests of all conditions, for each duration and number of failures."""
        need = self.requirement
        return [
            [
                self.plan(need.life * ratio / factor, failures, design)
                for ratio in DURATIONS
                for failures in range(need.failures + 1)
            ]
            for design, factor in enumerate(
                [1.0, *(self.acceleration(k).value for k in range(1, len(self.designs)))]
            )
        ]


def demonstration(
    lives: LifeResult | Sequence[LifeResult],
    requirement: str,
    *,
    labels: Sequence[str] = (),
) -> Demonstration:
    """Return demonstration tests of a design: specimens against duration, without new tests.

    Parameters
    ----------
    lives : LifeResult or sequence of LifeResult
        Lives in service; several are followed by those under the conditions of accelerated tests,
        such as a greater load, with the same seed.
    requirement : str
        Survival, confidence and life, "R=0.9 C=0.95 at 500 h", optionally "... with 3 failures".
    labels : sequence of str
        Names of the conditions.

    Returns
    -------
    Demonstration

    Raises
    ------
    ValueError
        If the requirement cannot be read, or the life of the survival is not known.

    Examples
    --------
    >>> lives = wearsim.open_results("rig-life.h5")
    >>> wearsim.demonstration(lives, "R=0.9 C=0.95 at 5e5")
    <Demonstration 'a wear test': R = 0.9, C = 0.95 at 500000 passes, 29 specimens>
    """
    designs = list(lives) if isinstance(lives, Sequence) else [lives]
    need = Requirement.parse(requirement, designs[0].unit)
    share = 1.0 - need.survival
    for design in designs:
        if design.unit != designs[0].unit:
            raise ValueError(
                f"{designs[0].title} is in {designs[0].unit} and {design.title} in {design.unit}"
            )
        fewest = 1 if design.is_exact else fewest_lives(share)
        if design.count < fewest:
            raise ValueError(f"a survival of {need.survival:g} takes {fewest} lives")
    result = Demonstration(tuple(designs), tuple(labels or labels_of(designs)), need)
    for number, design in enumerate(designs):
        if not math.isfinite(result.acceleration(number).value):
            raise ValueError(
                f"the life that {100.0 * share:g} % do not reach of {result.labels[number]} is not"
                f" known up to {design.most:,.0f} {design.unit}; give a greater --max"
            )
    return result
