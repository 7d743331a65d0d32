"""Lives of designs after returns from the field."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wearsim.results.viewed import Viewed
from wearsim.studies.life.result import LifeResult
from wearsim.studies.opening import labels_of
from wearsim.studies.returns.table import Returns, UnitsOf, read_returns
from wearsim.types import FloatArray
from wearsim.uq.distributions.two_levels import TwoLevels, weighted_quantiles
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.fleet import FleetCheck, RemainingLife, check_fleet, remaining_lives
from wearsim.uq.survival.returns import FieldPosterior, update
from wearsim.uq.survival.two_levels import UncertainLife, UncertainLives

LIFE_FACTOR = 1.5  # geometric standard deviation of the prior of the life factor
SHARES = (10.0, 50.0)  # percentages whose remaining life is stated
NO_LEVELS = (
    "returns update what is not known of K/H, which takes a posterior of wear tests, K.csv of"
    " `wearsim identify --posterior`"
)
_ENDS = np.array([0.025, 0.5, 0.975])


class RunningUnit(NamedTuple):
    """A unit in service, with its age and remaining life."""

    name: str
    design: int
    age: float
    remaining: RemainingLife


@dataclass(frozen=True, eq=False)
class FieldReturns(Viewed):
    r"""Lives of designs after returns from the field, from `field_returns`.

    Parameters
    ----------
    designs : tuple of LifeResult
        Their lives with the posterior of K/H before the returns.
    labels : tuple of str
    returns : Returns
    life_factor : float
        Geometric standard deviation of the prior of the common life factor; 1 for none.

    Examples
    --------
    >>> from pathlib import Path
    >>> rows = ["median [1/Pa],scatter,weight", "1.0e-11,0.3,2", "1.3e-11,0.5,1"]
    >>> _ = Path("K.csv").write_text("\n".join(rows))
    >>> units = ["life [passes],state", "4e5,failed", "6e5,suspended", "7e5,suspended"]
    >>> _ = Path("returns.csv").write_text("\n".join(units))
    >>> lives = wearsim.open_results("rig-life.h5").with_posterior("K.csv")
    >>> field = wearsim.field_returns(lives, "returns.csv")
    >>> field.b(10).low < field.b(10).value < field.b(10).high
    True
    >>> [unit.name for unit in field.running]
    ['line 3', 'line 4']
    """

    designs: tuple[LifeResult, ...]
    labels: tuple[str, ...]
    returns: Returns
    life_factor: float

    path = None

    def __repr__(self) -> str:
        failed = f"{self.returns.failed} of {len(self.returns.fleet)} units failed"
        b10 = f"B10 {self.before(10).predictive:.4g} -> {self.after(10).predictive:.4g} {self.unit}"
        return f"<FieldReturns '{self.title}': {failed}, {b10}>"

    @property
    def title(self) -> str:
        """Title of the design."""
        return self.designs[0].title if len(self.designs) == 1 else ", ".join(self.labels)

    @property
    def unit(self) -> str:
        """Unit of lives."""
        return self.designs[0].unit

    @cached_property
    def mixtures(self) -> list[FactorMixture]:
        """Realisations of the designs."""
        return [design.distribution for design in self.designs]  # type: ignore[misc]

    @cached_property
    def posterior(self) -> FieldPosterior:
        """What is not known of K/H and the life factor, before and after the returns."""
        levels = self.designs[0].levels
        assert levels is not None
        return update(self.mixtures, levels, self.returns.fleet, math.log(self.life_factor))

    @cached_property
    def lives_before(self) -> list[UncertainLives]:
        """Lives of the designs in the field before the returns."""
        return [self.posterior.lives_before(item) for item in self.mixtures]

    @cached_property
    def lives_after(self) -> list[UncertainLives]:
        """Lives of the designs in the field after the returns."""
        return [self.posterior.lives_after(item) for item in self.mixtures]

    def before(self, percent: float, design: int = 0) -> UncertainLife:
        r"""Return the life that a percentage does not reach, before the returns.

        Parameters and return as of `after`.

        Examples
        --------
        >>> from pathlib import Path
        >>> rows = ["median [1/Pa],scatter,weight", "1.0e-11,0.3,2", "1.3e-11,0.5,1"]
        >>> _ = Path("K.csv").write_text("\n".join(rows))
        >>> _ = Path("returns.csv").write_text("life,state\n4e5,failed\n7e5,suspended\n")
        >>> lives = wearsim.open_results("rig-life.h5").with_posterior("K.csv")
        >>> field = wearsim.field_returns(lives, "returns.csv")
        >>> field.before(10).by_tests > field.after(10).by_tests
        True
        """
        return self.lives_before[design].quantile(percent / 100.0)

    def after(self, percent: float, design: int = 0) -> UncertainLife:
        r"""Return the life that a percentage does not reach, after the returns.

        Parameters
        ----------
        percent : float
            10 for B10.
        design : int
            Number of the design, if there are several.

        Returns
        -------
        UncertainLife
            Predictive and plug-in life, and the credible interval.

        Examples
        --------
        >>> from pathlib import Path
        >>> rows = ["median [1/Pa],scatter,weight", "1.0e-11,0.3,2", "1.3e-11,0.5,1"]
        >>> _ = Path("K.csv").write_text("\n".join(rows))
        >>> _ = Path("returns.csv").write_text("life,state\n4e5,failed\n7e5,suspended\n")
        >>> lives = wearsim.open_results("rig-life.h5").with_posterior("K.csv")
        >>> field = wearsim.field_returns(lives, "returns.csv")
        >>> found = field.after(10)
        >>> found.low < found.predictive < found.high
        True
        """
        return self.lives_after[design].quantile(percent / 100.0)

    def b(self, percent: float, design: int = 0) -> Interval:
        r"""Return the predictive life that a percentage does not reach, after the returns.

        Parameters
        ----------
        percent : float
            10 for B10.
        design : int
            Number of the design, if there are several.

        Returns
        -------
        Interval
            With its 95 % credible interval.

        Examples
        --------
        >>> from pathlib import Path
        >>> rows = ["median [1/Pa],scatter,weight", "1.0e-11,0.3,2", "1.3e-11,0.5,1"]
        >>> _ = Path("K.csv").write_text("\n".join(rows))
        >>> _ = Path("returns.csv").write_text("life,state\n4e5,failed\n7e5,suspended\n")
        >>> lives = wearsim.open_results("rig-life.h5").with_posterior("K.csv")
        >>> field = wearsim.field_returns(lives, "returns.csv")
        >>> field.b(10).value == field.after(10).predictive
        True
        """
        return self.after(percent, design).interval

    @cached_property
    def check(self) -> FleetCheck:
        """Predicted and observed failures."""
        posterior = self.posterior
        return check_fleet(self.mixtures, posterior.before, posterior.after, self.returns.fleet)

    @cached_property
    def running(self) -> list[RunningUnit]:
        """Units in service with their remaining lives, in the order of the file."""
        fleet, remaining = self.returns.fleet, dict[tuple[int, float], RemainingLife]()
        target = self.designs[0].target
        for number, mixture in enumerate(self.mixtures):
            chosen = self.returns.running & (fleet.design == number)
            ages, levels = np.unique(fleet.low[chosen]), self.posterior.after
            shares = [share / 100.0 for share in SHARES]
            lives = remaining_lives(mixture, levels, ages, shares, target) if len(ages) else []
            remaining |= {
                (number, age): life for age, life in zip(ages.tolist(), lives, strict=True)
            }
        return [
            RunningUnit(
                self.returns.units[place],
                int(fleet.design[place]),
                float(fleet.low[place]),
                remaining[int(fleet.design[place]), float(fleet.low[place])],
            )
            for place in np.flatnonzero(self.returns.running)
        ]

    @property
    def factor(self) -> Interval:
        """Life factor after the returns: median and 95 % credible interval."""
        return _interval(self.posterior.log_factor, self.posterior.factor_weight)

    @property
    def factor_before(self) -> Interval:
        """Life factor before the returns."""
        reach = self.life_factor**1.959963984540054
        return Interval(1.0, 1.0 / reach, reach)

    def wear_factor(self, levels: TwoLevels) -> tuple[Interval, Interval]:
        r"""Return median K/H over the life factor [1/Pa] and scatter t, each with its interval.

        Parameters
        ----------
        levels : TwoLevels
            ``field.posterior.before`` or ``field.posterior.after``.

        Examples
        --------
        >>> from pathlib import Path
        >>> rows = ["median [1/Pa],scatter,weight", "1.0e-11,0.3,2", "1.3e-11,0.5,1"]
        >>> _ = Path("K.csv").write_text("\n".join(rows))
        >>> _ = Path("returns.csv").write_text("life,state\n4e5,failed\n7e5,suspended\n")
        >>> lives = wearsim.open_results("rig-life.h5").with_posterior("K.csv")
        >>> field = wearsim.field_returns(lives, "returns.csv")
        >>> median, scatter = field.wear_factor(field.posterior.after)
        >>> 5e-12 < median.value < 5e-11, 0.3 <= scatter.value <= 0.5
        (True, True)
        """
        scatter = weighted_quantiles(levels.t, levels.weight, _ENDS).tolist()
        return _interval(levels.m, levels.weight), Interval(scatter[1], scatter[0], scatter[2])


def _interval(log: FloatArray, weight: FloatArray) -> Interval:
    low, middle, high = np.exp(weighted_quantiles(log, weight, _ENDS)).tolist()
    return Interval(middle, low, high)


def field_returns(
    lives: LifeResult | Sequence[LifeResult],
    file: str | Path,
    *,
    life_factor: float = LIFE_FACTOR,
    labels: Sequence[str] = (),
) -> FieldReturns:
    r"""Return the lives of designs after returns from the field, without new tests.

    Parameters
    ----------
    lives : LifeResult or sequence of LifeResult
        With the same posterior of K/H, see `LifeResult.with_posterior`; several designs share K/H
        and the life factor.
    file : path
        CSV with a row for each unit in service: ``life``, or ``low`` and ``high`` where a failure
        was found at an inspection; ``state``, "failed" or "suspended"; optionally ``limit``, the
        cause of a failure, ``design`` and ``unit``.
    life_factor : float
        Geometric standard deviation, from 1 on, of the prior of a factor by which all lives in the
        field differ from the computed ones; its median is 1.
    labels : sequence of str
        Names of several designs in the column ``design``; by default the names of their files.

    Returns
    -------
    FieldReturns

    Raises
    ------
    ScenarioError
        If the file cannot be used.
    ValueError
        If the lives have no posterior of K/H, or another argument is invalid.

    Examples
    --------
    >>> from pathlib import Path
    >>> rows = ["median [1/Pa],scatter,weight", "1.0e-11,0.3,2", "1.3e-11,0.5,1"]
    >>> _ = Path("K.csv").write_text("\n".join(rows))
    >>> _ = Path("returns.csv").write_text("life,state\n4e5,failed\n7e5,suspended\n")
    >>> lives = wearsim.open_results("rig-life.h5").with_posterior("K.csv")
    >>> field = wearsim.field_returns(lives, "returns.csv")
    >>> len(field.running), int(field.check.observed[-1])
    (1, 1)
    """
    designs = list(lives) if isinstance(lives, Sequence) else [lives]
    if not 1.0 <= life_factor < math.inf:
        raise ValueError(f"the life factor must be from 1 on, got {life_factor:g}")
    for design in designs:
        if design.uncertain is None:
            reason = design.settings.reason
            why = f"; its K/H is not integrated exactly: {reason}" if reason else ""
            raise ValueError(f"{NO_LEVELS}; {design.title} has none{why}")
        first = designs[0]
        if design.unit != first.unit or not _are_equal(design.levels, first.levels):
            raise ValueError(
                f"{first.title} and {design.title} have different units of life or posteriors of"
                " K/H; returns of several designs take the same"
            )
    names = tuple(labels or labels_of(designs))
    units = [
        UnitsOf(name, design.unit, design.settings.rate, design.limits)
        for name, design in zip(names, designs, strict=True)
    ]
    return FieldReturns(tuple(designs), names, read_returns(file, units), life_factor)


def _are_equal(first: TwoLevels | None, other: TwoLevels | None) -> bool:
    if first is None or other is None:
        return False
    pairs = ((first.m, other.m), (first.t, other.t), (first.weight, other.weight))
    return all(np.array_equal(first, second) for first, second in pairs)
