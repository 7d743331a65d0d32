"""Lives of the realisations of a study, and their distribution."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from wearsim.report.text import rounded_lives
from wearsim.studies.ensemble.result import EnsembleResult
from wearsim.studies.life.stored_settings import DesignVariable, LifeSettings
from wearsim.types import BoolArray, FloatArray, IntArray
from wearsim.uq.distributions.base import Distribution
from wearsim.uq.distributions.two_levels import TwoLevels
from wearsim.uq.survival.distributions import (
    CountedLives,
    FactorMixture,
    LifeDistribution,
)
from wearsim.uq.survival.effective import LEAST_NUMBER
from wearsim.uq.survival.scores import ScoreFunction, score_function
from wearsim.uq.survival.two_levels import UncertainLives

_MOST_UNKNOWN = 0.02  # share of lives at an end of the range up to which effects are stated


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
        """Design variable whose value differs from other results of a sweep."""
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
        lives = self._known_lives(name)
        return np.asarray(np.where(lives <= self.most, lives, np.inf))

    def _known_lives(self, name: str) -> FloatArray:
        lives = self.values(name) / self.settings.per_unit
        if self.law is not None:  # at the same quantile as the drawn factor
            from scipy.special import ndtr  # noqa: PLC0415  (slow to load)

            drawn = self.values(self.settings.factor)
            lives = lives * drawn / self.law.quantile(ndtr(self._drawn_score(drawn)))
        return lives

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
        if not self.is_exact:
            return CountedLives(self._lives(name))
        return self.mixture_of(self.numbers, name)

    def mixture_of(self, numbers: IntArray, name: str = "life") -> FactorMixture:
        """Return the lives of realisations by number, with the wear factor integrated exactly.

        Parameters
        ----------
        numbers : ndarray of int, shape (n,)
        name : str
            "life", or one of its numerical bounds, "life_low" and "life_high".

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> lives.mixture_of(lives.numbers[:4]).count
        4
        """
        settings, keys = self.settings, (name, self.settings.factor, "score_mean")
        life, factor, shift = (self.raw.rows(key, 0, None)[numbers] for key in keys)
        kappa = life / settings.per_unit * factor
        return FactorMixture(kappa, self.score, shift, settings.spread, settings.alone)

    def probability_obstacle(self, life: float) -> str:
        """Return why the probability of a life below `life` is not stated; empty if it is.

        Where the wear factor is integrated exactly, a small probability is caused by realisations
        that are rarely in a sample. It takes an effective number of 20 realisations, see
        `FactorMixture.effective_number`.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> lives.probability_obstacle(800_000), lives.probability_obstacle(400_000)
        ('', 'its effective number of realisations is 6.7, below 20')
        """
        distribution = self.distribution
        if not isinstance(distribution, FactorMixture):
            return ""
        number = distribution.effective_number(life)
        if number >= LEAST_NUMBER:
            return ""
        return f"its effective number of realisations is {number:.2g}, below {LEAST_NUMBER:g}"

    @property
    def _drawn_law(self) -> Distribution:
        """Distribution of the wear factor in the scenario."""
        if not self.settings.factor:
            raise AttributeError("no wear factor is integrated exactly in these lives")
        return {item.name: item for item in self.scenario.random}[self.settings.factor].scalar

    @property
    def factor_law(self) -> Distribution:
        """Distribution of the wear factor that is integrated exactly."""
        return self.law or self._drawn_law

    @property
    def levels(self) -> TwoLevels | None:
        """Posterior of the wear factor that is integrated exactly, if its distribution is one."""
        law = self.factor_law if self.is_exact else None
        return law if isinstance(law, TwoLevels) else None

    @cached_property
    def uncertain(self) -> UncertainLives | None:
        """Lives for all medians and scatters of a wear factor with a posterior."""
        levels, lives = self.levels, self.distribution
        known = levels is not None and isinstance(lives, FactorMixture) and lives.is_finite.any()
        return UncertainLives(lives, levels) if known else None  # type: ignore[arg-type]

    @cached_property
    def _drawn_score(self) -> ScoreFunction:
        """Normal score of the wear factor of the scenario."""
        return score_function(self._drawn_law)

    @cached_property
    def score(self) -> ScoreFunction:
        """Normal score of the wear factor."""
        return score_function(self.law) if self.law else self._drawn_score

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
        by_limit = {name: angle[known & (first == place)] for place, name in enumerate(self.limits)}
        return {name: angles for name, angles in by_limit.items() if len(angles)}

    @property
    def are_equal(self) -> bool:
        """Whether no two lives differ, such as if all are censored, or zero."""
        return self.count < 2 or float(np.ptp(self.log_lives)) == 0.0

    @property
    def log_lives(self) -> FloatArray:
        """Logarithms of the lives, those that are censored or zero at the ends of the range.

        Where the wear factor is integrated exactly, lives beyond the maximum are known too.
        """
        lives, has_log = self._lives_and_logs
        ends = lives[has_log].min(initial=self.most), lives[has_log].max(initial=0.0)
        return np.asarray(np.log(np.clip(lives, ends[0], ends[1] or self.most)))

    @property
    def effects_obstacle(self) -> str:
        """Why the effects of the inputs on the life are not stated; empty if they are."""
        unknown = int((~self._lives_and_logs[1]).sum())
        if self.count < 2 or unknown <= _MOST_UNKNOWN * self.count:
            return ""
        return (
            f"{unknown} of {self.count} lives are censored or zero, more than"
            f" {100.0 * _MOST_UNKNOWN:g} %; give a greater --max or other limits"
        )

    @cached_property
    def _lives_and_logs(self) -> tuple[FloatArray, BoolArray]:
        """Lives, as far as they are known, and whether each has a logarithm."""
        lives = self.known_lives if self.is_exact else self.lives
        return lives, np.isfinite(lives) & (lives > 0.0)


def remarks(result: LifeValues) -> list[str]:
    """Return what a user should know of the lives."""
    remarks = []
    if result.count and result.at_once == result.count:
        remarks.append("a limit is exceeded before any wear in all realisations: every life is 0")
    elif result.at_once:
        remarks.append(f"{result.at_once} of {result.count} realisations exceed a limit when fresh")
    if result.count and not result.observed.any():
        greatest, known = [], result.known_lives[np.isfinite(result.known_lives)]
        # tests with an exact wear factor are run up to its greatest value, and further than `most`
        if result.is_exact and len(known):
            greatest.append(f"the shortest drawn life is {rounded_lives(known.min())[0]}")
        elif result.is_exact:
            greatest.append("with the greatest wear factor")
        for name, limit in () if len(known) else result.scenario.limit.given.items():
            stored = {"volume": "worn_volume"}.get(name, name)
            if stored in result.observables:
                part = float(result.at_end(stored).max()) / limit
                greatest.append(f"{name.replace('_', ' ')} up to {100.0 * part:.3g} % of its limit")
        reached = f" ({', '.join(greatest)})" if greatest else ""
        remarks.append(
            f"no realisation reaches a limit within {result.most:,.0f} {result.unit}{reached};"
            " give a greater --max or other limits"
        )
    return remarks
