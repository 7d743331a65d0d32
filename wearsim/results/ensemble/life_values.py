"""Lives of the realisations of a study, and their distribution."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from wearsim.results.ensemble.life_settings import DesignVariable, LifeSettings
from wearsim.results.ensemble.result import EnsembleResult
from wearsim.types import BoolArray, FloatArray, IntArray
from wearsim.uq.distributions.base import Distribution
from wearsim.uq.survival.distributions import (
    CountedLives,
    FactorMixture,
    LifeDistribution,
    score_function,
)


@dataclass(frozen=True, eq=False)
class LifeValues(EnsembleResult):
    """Lives of the realisations of a study; `LifeResult` adds the estimates."""

    law: Distribution | None = None

    @cached_property
    def settings(self) -> LifeSettings:
        """Settings of the study."""
        known = {item.name for item in fields(LifeSettings)}
        stored = {name: value for name, value in self.raw.life.items() if name in known}
        return LifeSettings(**{**stored, "shares": tuple(stored["shares"])})

    @cached_property
    def numbers(self) -> IntArray:
        """Numbers of the successful realisations without weights, shape (count,)."""
        done = self.raw.done
        return np.asarray(done[done < self.settings.plain])

    @property
    def variable(self) -> DesignVariable | None:
        """Design variable whose value differs from that of other results of a sweep."""
        return DesignVariable(**self.settings.variable) if self.settings.variable else None

    @property
    def unit(self) -> str:
        """Unit of lives, "turns" of a cam or roller "passes"."""
        return self.settings.unit

    @property
    def most(self) -> float:
        """Life at which lives are censored."""
        return self.settings.most / self.settings.per_unit

    @property
    def target(self) -> float | None:
        """Life whose probability is estimated."""
        target = self.settings.target
        return None if target is None else target / self.settings.per_unit

    @cached_property
    def lives(self) -> FloatArray:
        """Lives with the drawn values, infinite beyond the censoring, shape (count,)."""
        return self._lives("life")

    @property
    def known_lives(self) -> FloatArray:
        """Lives with the drawn values, also beyond the censoring, shape (count,)."""
        return self._known_lives("life")

    @property
    def is_known_throughout(self) -> bool:
        """Whether the distribution of lives is known beyond the censoring too."""
        return self.is_exact and bool(np.isfinite(self.known_lives).all())

    def _lives(self, name: str) -> FloatArray:
        found = self._known_lives(name)
        return np.asarray(np.where(found <= self.most, found, np.inf))

    def _known_lives(self, name: str) -> FloatArray:
        found = self.values(name) / self.settings.per_unit
        if self.law is not None:  # at the same quantile as the drawn factor
            from scipy.special import ndtr  # noqa: PLC0415  (slow to load)

            drawn = self.values(self.settings.factor)
            chance = ndtr(score_function(self._drawn_law)(drawn))
            found = found * drawn / self.law.quantile(chance)
        return found

    @cached_property
    def observed(self) -> BoolArray:
        """Whether each life ended before the censoring, shape (count,)."""
        return np.isfinite(self.lives)

    @property
    def censored(self) -> int:
        """Number of lives beyond the censoring."""
        return int((~self.observed).sum())

    @property
    def at_once(self) -> int:
        """Number of lives of zero."""
        return int((self.lives == 0.0).sum())

    @property
    def is_exact(self) -> bool:
        """Whether the wear factor is integrated exactly."""
        return bool(self.settings.factor)

    @property
    def limits(self) -> tuple[str, ...]:
        """Names of the limits."""
        return tuple(self.scenario.limit.given)

    @cached_property
    def distribution(self) -> LifeDistribution:
        """Distribution of the lives."""
        return self._distribution("life")

    def _distribution(self, name: str) -> LifeDistribution:
        settings = self.settings
        if not self.is_exact:
            return CountedLives(self._lives(name))
        kappa = self.values(name) / settings.per_unit * self.values(settings.factor)
        return FactorMixture(
            kappa, self._score, self.values("score_mean"), settings.spread, settings.alone
        )

    @property
    def _drawn_law(self) -> Distribution:
        """Distribution of the wear factor in the scenario."""
        return next(
            item.scalar for item in self.scenario.random if item.name == self.settings.factor
        )

    @cached_property
    def _score(self) -> Any:
        return score_function(self.law or self._drawn_law)

    @property
    def first_limits(self) -> dict[str, float]:
        """Share of the realisations in which each limit was reached first, by its name."""
        first = self.values("first_limit")[self.observed]
        shares = {
            name: float((first == place).sum()) / max(self.count, 1)
            for place, name in enumerate(self.limits)
        }
        return dict(sorted(shares.items(), key=lambda item: -item[1]))

    @property
    def angles(self) -> dict[str, FloatArray]:
        """Angles of a cam at which each limit was reached [rad]; without those never first."""
        first, angle = self.values("first_limit"), self.values("limit_angle")
        known = self.observed & np.isfinite(angle)
        found = {name: angle[known & (first == place)] for place, name in enumerate(self.limits)}
        return {name: angles for name, angles in found.items() if len(angles)}

    @property
    def are_equal(self) -> bool:
        """Whether no two lives differ, such as if all are censored, or zero."""
        return self.count < 2 or float(np.ptp(self.log_lives)) == 0.0

    @property
    def log_lives(self) -> FloatArray:
        """Logarithms of the lives, those that are censored or zero at the ends of the range."""
        positive = self.lives[self.lives > 0.0]
        least = float(positive.min(initial=self.most))
        return np.asarray(np.log(np.clip(self.lives, least, self.most)))
