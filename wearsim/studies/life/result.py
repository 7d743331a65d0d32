"""Result of an ensemble of tests that end at a limit: the life of a design, in SI."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from wearsim.studies.life.factor import posterior_table
from wearsim.studies.life.rare.estimates import rare_estimates
from wearsim.studies.life.values import LifeValues
from wearsim.uq.estimation.estimates import LIFE, Estimate, Target
from wearsim.uq.estimation.intervals import UNKNOWN, Interval
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.fits import FAMILIES, IntegratedFit, LifeFit, fit_lives, fit_mixture
from wearsim.uq.survival.lives import (
    SurvivalCurve,
    life_quantile,
    lower_bound,
    probability_before,
    survival_curve,
)
from wearsim.uq.survival.rare_events import RareProbability
from wearsim.uq.survival.two_levels import UncertainLife

if TYPE_CHECKING:
    from wearsim.studies.life.comparison import LifeComparison
    from wearsim.uq.sensitivity.effects import SignedEffect

_POINTS = 200  # of a curve
_FEWEST = 32  # realisations below which a target is not reached


@dataclass(frozen=True, eq=False)
class LifeResult(LifeValues):
    """Life of a design, from the tests that ended at a limit.

    Parameters
    ----------
    raw : EnsembleData
    path : Path, optional
    law : Distribution, optional
        Distribution of the wear factor, instead of the scenario's.

    Examples
    --------
    >>> lives = wearsim.open_results("rig-life.h5")
    >>> lives
    <LifeResult 'a wear test': 16 lives, B10 8.5e+05 passes>
    >>> lives.limits, lives.is_exact
    (('depth',), True)
    """

    runner: ClassVar[str] = "wearsim.studies.life.realisation:LifeRunner"

    def __repr__(self) -> str:
        b10 = self.b(10).value
        known = f"B10 {b10:.4g} {self.unit}" if math.isfinite(b10) else "B10 unknown"
        return f"<LifeResult '{self.title}': {self.count} lives, {known}>"

    def with_settings(self, **changed: Any) -> LifeResult:
        """Return the result with other settings: `target` [passes] or `shares` [per cent].

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> lives.with_settings(target=1e6).target
        1000000.0
        """
        return replace(self, raw=replace(self.raw, life={**self.raw.life, **changed}))

    @property
    def method(self) -> str:
        """Method of the intervals of lives, in words."""
        if self.settings.alone:
            exact = "the wear factor is integrated exactly, and nothing else is random"
            return (
                f"credible, by the posterior of K/H: {exact}" if self.levels else f"none: {exact}"
            )
        if self.is_exact:
            method = "Student's t of the probability of failure on the logit scale, inverted"
            return f"credible, by the posterior of K/H, with {method}" if self.levels else method
        if self.censored:
            return "exact, between order statistics; lives beyond the maximum are censored"
        return "exact, between order statistics"

    def with_wear_factor(self, table: Mapping[str, object]) -> LifeResult:
        """Return the lives with another distribution of the wear factor, without new tests.

        Parameters
        ----------
        table : mapping of str to object
            Random input as in a scenario, {"distribution": "lognormal", ...}.

        Raises
        ------
        ValueError
            If the wear factor is not integrated exactly, is correlated with other inputs, or takes
            single values with a probability, which do not say at which quantile they are.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> faster = {"distribution": "lognormal", "median": "2.2e-11 1/Pa", "factor": 1.5}
        >>> print(f"{lives.b(10).value / lives.with_wear_factor(faster).b(10).value:.3f}")
        2.000
        """
        settings = self.settings
        if not settings.factor or settings.spread < 1.0:
            reason = settings.reason or "it is correlated with other inputs"
            raise ValueError(f"the distribution of the wear factor cannot be replaced: {reason}")
        if len(atoms := self._drawn_score.atoms):
            raise ValueError(
                f"the distribution of the wear factor cannot be replaced: {settings.factor} takes"
                f" the value {atoms[0]:g} with a probability; run the study with the other one"
            )
        inputs = {
            item.name: item for item in self.scenario.changed({settings.factor: table}).random
        }
        return replace(self, law=inputs[settings.factor].scalar)

    def with_posterior(self, file: str | Path) -> LifeResult:
        r"""Return the lives with the posterior of K/H of an identification, without new tests.

        Parameters
        ----------
        file : path
            CSV of `wearsim identify --posterior`.

        Raises
        ------
        ScenarioError
            If the file cannot be used, or contains the scatter of an input that is random.
        ValueError
            As `with_wear_factor`.

        Examples
        --------
        >>> from pathlib import Path
        >>> rows = ["median [1/Pa],scatter,weight", "1.0e-11,0.3,2", "1.3e-11,0.5,1"]
        >>> _ = Path("K.csv").write_text("\n".join(rows))
        >>> found = wearsim.open_results("rig-life.h5").with_posterior("K.csv").uncertain_life(10)
        >>> found.low < found.predictive < found.high
        True
        """
        key, table = posterior_table(self.scenario, file)
        if self.settings.factor and key != self.settings.factor:
            raise ValueError(
                f"the posterior is of {key}, and the lives are of {self.settings.factor}"
            )
        return self.with_wear_factor(table)

    def b(self, percent: float) -> Interval:
        """Return the life that a percentage of the specimens does not reach, as B10.

        Parameters
        ----------
        percent : float
            10 for B10.

        Returns
        -------
        Interval
            Sampling interval; the value is nan beyond the censoring and with too few counted lives
            (69 for B1, 7 for B10), and -inf an end for which there are too few. See `b_error` for
            the numerical error. With a posterior of the wear factor the value is the predictive
            one, and the interval is credible, see `uncertain_life`.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> found = lives.b(10)
        >>> print(f"{found.value:.3g}, 95 % interval {found.low:.3g} to {found.high:.3g}")
        8.5e+05, 95 % interval 7.98e+05 to 9.08e+05
        """
        uncertain = self.uncertain_life(percent)
        return uncertain.interval.censored(self.most) if uncertain else self._b(percent, "life")

    def uncertain_life(self, percent: float) -> UncertainLife | None:
        """Return the life of a percentage with what is not known of the wear factor.

        Parameters
        ----------
        percent : float
            10 for B10.

        Returns
        -------
        UncertainLife or None
            Predictive and plug-in life, credible interval, and the variance due to the wear tests
            and to the realisations; None unless the wear factor has the distribution "posterior".

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> lives.uncertain_life(10) is None
        True
        """
        return None if self.uncertain is None else self.uncertain.quantile(percent / 100.0)

    def b_error(self, percent: float) -> tuple[float, float]:
        """Return the life of a percentage if all lives are in error by their numerical bounds.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> low, high = lives.b_error(10)
        >>> low < lives.b(10).value < high
        True
        """
        low, high = (self._b(percent, name).value for name in ("life_low", "life_high"))
        return low, high

    def _b(self, percent: float, name: str) -> Interval:
        if (percent, name) not in self._quantiles:
            self._quantiles[percent, name] = self._quantile(percent, name)
        return self._quantiles[percent, name]

    @cached_property
    def _quantiles(self) -> dict[tuple[float, str], Interval]:
        """Lives of percentages that were needed, or one of their numerical bounds."""
        return {}

    def _quantile(self, percent: float, name: str) -> Interval:
        if not self.count:
            return UNKNOWN
        share = percent / 100.0
        if not self.is_exact:
            lives = self._lives(name)
            return life_quantile(np.minimum(lives, self.most), np.isfinite(lives), share)
        return self._distribution(name).quantile(share).censored(self.most)

    def lower_bound(self, percent: float) -> float:
        """Return the one-sided 95 % lower bound of the life of a percentage; -inf if unknown.

        It applies to the lives as counted.

        Examples
        --------
        >>> wearsim.open_results("rig-life.h5").lower_bound(10)  # takes 29 lives
        -inf
        """
        return lower_bound(np.minimum(self.lives, self.most), self.observed, percent / 100.0)

    def probability_before(self, life: float) -> Interval:
        """Return the probability of a life below `life`; unknown beyond the censoring.

        It is also unknown if `probability_obstacle` has a reason.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> print(f"{lives.probability_before(675_000).value:.2%}")
        3.36%
        """
        if not self.count or life > self.most:
            return UNKNOWN
        if self.is_exact:
            lives = self.uncertain or self.distribution
            return UNKNOWN if self.probability_obstacle(life) else lives.probability_before(life)
        return probability_before(np.minimum(self.lives, self.most), self.observed, life)

    def survival(self, life: float) -> Interval:
        """Return the probability of a life above `life`.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> print(f"{lives.survival(675_000).value:.2%}")
        96.64%
        """
        failed_before = self.probability_before(life)
        return Interval(
            1.0 - failed_before.value, 1.0 - failed_before.high, 1.0 - failed_before.low
        )

    def survival_curve(self) -> SurvivalCurve:
        """Return the survival with its band from 0 to the last life, or the maximum of the tests.

        Examples
        --------
        >>> curve = wearsim.open_results("rig-life.h5").survival_curve()
        >>> print(curve.life[0], curve.survival[0])
        0.0 1.0
        """
        if not self.is_exact:
            curve = survival_curve(np.minimum(self.lives, self.most), self.observed)
            last = [self.most] if self.censored else curve.life[-1:]
            parts = [
                np.concatenate([[1.0], part, part[-1:] if len(part) else [1.0]])
                for part in (curve.survival, curve.low, curve.high)
            ]
            return SurvivalCurve(np.concatenate([[0.0], curve.life, last]), *parts)
        life = np.linspace(0.0, min(self.distribution.quantile_of_mean(0.999), self.most), _POINTS)
        estimates = self.uncertain or self.distribution
        ended = [estimates.probability_before(float(n)) for n in life[1:]]
        survival, low, high = (
            np.array([1.0, *(1.0 - getattr(item, name) for item in ended)])
            for name in ("value", "high", "low")
        )
        # the survival falls, so that a bound at one life is one for those before or after it
        low, high = np.maximum.accumulate(low[::-1])[::-1], np.minimum.accumulate(high)
        return SurvivalCurve(life, survival, low, high)

    @cached_property
    def fits(self) -> list[LifeFit]:
        """Fits to the drawn lives above zero, best first by Akaike's criterion."""
        positive = self.lives > 0.0
        # with the wear factor integrated, lives beyond the maximum are known too
        lives = self.known_lives if self.is_known_throughout else np.minimum(self.lives, self.most)
        observed = np.isfinite(lives) if self.is_known_throughout else self.observed
        if not positive.any():
            return []
        fitted = [fit_lives(family, lives[positive], observed[positive]) for family in FAMILIES]
        return sorted((fit for fit in fitted if fit is not None), key=lambda fit: fit.aic)

    @cached_property
    def integrated_fits(self) -> list[IntegratedFit]:
        """Fits to the lives with the wear factor integrated exactly, best first; else none."""
        if not isinstance(self.distribution, FactorMixture) or not self.count:
            return []
        fitted = [fit_mixture(family, self.distribution) for family in FAMILIES]
        return sorted((fit for fit in fitted if fit is not None), key=lambda fit: fit.aic)

    def _indices(
        self, name: str, groups: list[str]
    ) -> Mapping[str, tuple[Interval, Interval | None]]:
        """Return first-order indices, of "life" for its logarithm, or unknown."""
        if name != "life":
            return super()._indices(name, groups)
        if self.effects_obstacle:
            return dict.fromkeys(groups, (UNKNOWN, None))
        from wearsim.uq.sensitivity.sobol_indices import first_order  # noqa: PLC0415  (rarely needed)

        indices = first_order(self.log_lives, self.drawn_numbers(groups))
        return {group: (index, None) for group, index in indices.items()}

    def tornado(self) -> dict[str, SignedEffect]:
        """Return the effect of each input on the logarithm of life, by its name, greatest first.

        Returns
        -------
        dict of str to SignedEffect
            At the 10 % and the 90 % quantile of the input, relative to its median, the others
            unchanged. That of a wear factor which is integrated exactly has no sampling error, and
            adds none to the others. None where more than 2 % of the lives are censored or zero,
            see `effects_obstacle`.

        Examples
        --------
        >>> found = wearsim.open_results("rig-life.h5").tornado()
        >>> for name, effect in found.items():
        ...     low, high = effect.factors
        ...     print(name, f"{low.value:.2f} {high.value:.2f}")
        wear.cylinder.k_over_h 1.68 0.59
        friction.coefficient 1.17 0.87
        """
        from wearsim.studies.life.effects import effects_on_life  # noqa: PLC0415  (rarely needed)

        return effects_on_life(self)

    def compare(self, other: LifeResult, percent: float = 10.0) -> LifeComparison:
        """Compare the lives with another design's.

        Parameters
        ----------
        other : LifeResult
            With the same unit of life; common draws if it has the same seed.
        percent : float
            Percentage of the lives in ``b10_ratio``, 10 for B10.

        Raises
        ------
        ValueError
            If the units differ.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> faster = {"distribution": "lognormal", "median": "2.2e-11 1/Pa", "factor": 1.5}
        >>> found = lives.compare(lives.with_wear_factor(faster))
        >>> print(f"{found.b10_ratio.value:.2f} {found.same_machine.value:.2f}")
        2.00 1.00
        >>> print(f"{found.two_specimens.value:.2f}")
        0.88
        """
        from wearsim.studies.life.comparison import compare_lives  # noqa: PLC0415  (rarely needed)

        return compare_lives(self, other, percent / 100.0)

    def estimate_for(self, target: Target) -> Estimate:
        """Return the estimate to which a target applies.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> from wearsim.uq.estimation.estimates import Target
        >>> lives.estimate_for(Target.parse("b10 3%")).quantile(0.1).value  # takes 32 realisations
        nan
        """
        if target.observable != LIFE:
            return super().estimate_for(target)
        share = float(target.statistic)
        # more realisations do not reduce what is not known of the wear factor
        life = self._b(100.0 * share, "life") if self.count >= _FEWEST else UNKNOWN
        return Estimate(
            self.count, UNKNOWN, UNKNOWN, ((share, life),), math.nan, math.nan, self.method
        )

    @property
    def rare(self) -> RareProbability | None:
        """Probability of a life before the target from tests for rare events, if requested.

        It is given by the last method in `rare_estimates`.
        """
        return next(reversed(self.rare_estimates.values()), None)

    @cached_property
    def rare_estimates(self) -> dict[str, RareProbability]:
        """Estimates by "importance sampling" and "subset simulation", as far as they were used."""
        return rare_estimates(self) if self.settings.rare else {}

    def final_estimates(self) -> dict[str, Any]:
        """Return lives and estimates at their ends, as plain values.

        Examples
        --------
        >>> lives = wearsim.open_results("rig-life.h5")
        >>> lives.final_estimates()["life"]["b10"]["value"] == lives.b(10).value
        True
        """
        return {
            **super().final_estimates(),
            "life": {f"b{share:g}": asdict(self.b(share)) for share in self.settings.shares},
        }
