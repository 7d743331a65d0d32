"""Errors of sampling plans: many studies of one size beside what all tests together tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wearsim.studies.ensemble.designs import EnsemblePlan
from wearsim.types import FloatArray
from wearsim.uq.estimation.estimates import Estimate, estimate
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.quantiles import WeightedDistribution
from wearsim.uq.estimation.standard_errors import Control, Controlled
from wearsim.uq.sampling.plans import REPLICATES

PROBABILITY = 0.95
MEAN, QUANTILE = "mean of depth", "95 % quantile of depth"


@dataclass(frozen=True)
class Study:
    """The tests of one study.

    Parameters
    ----------
    replicate : int
        Studies of the same replicate may share draws; those of others are independent.
    depths, controls : ndarray, shape (tests,)
        At the end of each, and in closed form [m].
    known : tuple of float
        Mean of the control and that mean's standard error [m].
    """

    replicate: int
    depths: FloatArray
    controls: FloatArray
    known: tuple[float, float]

    def blocks(self, size: int) -> list[Study]:
        """Return the studies of `size` tests that stand in it one after another.

        Each has the law of a study that was asked for so many: independent draws have it
        wherever they stand; and `size` points of a Sobol sequence on end, from a multiple of `size`
        on and a power of two, are the first ones with digits exchanged, which Owen's scrambling
        cannot tell apart from those.
        """
        return [
            Study(
                self.replicate,
                self.depths[first : first + size],
                self.controls[first : first + size],
                self.known,
            )
            for first in range(0, len(self.depths) - size + 1, size)
        ]

    def estimate(self, plan: EnsemblePlan) -> Estimate:
        """Return what an ensemble of this plan says of these tests."""
        control = Control(self.controls, *self.known) if plan == "control-variate" else None
        replicate = np.arange(len(self.depths)) % REPLICATES
        return estimate(self.depths, (PROBABILITY,), plan, replicate, control)


def interval_of(found: Estimate, group: str) -> Interval:
    """Return the mean or the quantile of an estimate, by its group."""
    return found.mean if group == MEAN else found.quantile(PROBABILITY)


@dataclass(frozen=True)
class Reference:
    """What all tests together tell [m].

    Parameters
    ----------
    value, error : float
        And its standard error.
    """

    value: float
    error: float


def references(studies: Sequence[Study]) -> dict[str, Reference]:
    """Return what all studies together on_progress, by group.

    All tests, however drawn, are weighted so that the closed form has its known mean, which is what
    all cheap draws tell. The standard errors are the jackknife's, one replicate left out each time.

    Parameters
    ----------
    studies : sequence of Study
        Of two replicates or more.
    """
    numbers = sorted({study.replicate for study in studies})
    whole = _together(studies)
    left = [_together([s for s in studies if s.replicate != number]) for number in numbers]
    share = (len(numbers) - 1) / len(numbers)
    found = {}
    for group, value in whole.items():
        others = np.array([other[group] for other in left])
        error = float(np.sqrt(share * ((others - others.mean()) ** 2).sum()))
        found[group] = Reference(value, error)
    return found


def _together(studies: Sequence[Study]) -> dict[str, float]:
    depths = np.concatenate([study.depths for study in studies])
    controls = np.concatenate([study.controls for study in studies])
    means = sorted({study.known for study in studies})
    known = float(np.mean([mean for mean, _ in means]))
    weights = Controlled(Control(controls, known)).weights
    quantile = WeightedDistribution(depths, weights).quantile(PROBABILITY)
    return {MEAN: float(weights @ depths), QUANTILE: quantile}


@dataclass(frozen=True)
class PlanError:
    """How far the studies of a plan and a size are from the truth.

    Parameters
    ----------
    rms : float
        Relative error.
    claimed : float
        Half-width of the interval, median, relative; infinite where half of them have no end.
    held : float
        Part of the studies whose interval holds the truth.
    studies : int
    known : float
        Standard error of `rms`, relative to it: that of the mean of the replicates' squares, since
        studies of one replicate may share draws.
    """

    rms: float
    claimed: float
    held: float
    studies: int
    known: float


def plan_error(
    studies: Sequence[Study], plan: EnsemblePlan, group: str, truth: Reference
) -> PlanError:
    """Return how far studies of one size are from the truth.

    Parameters
    ----------
    studies : sequence of Study
        Of two replicates or more.
    plan : str
    group : str
        `MEAN` or `QUANTILE`.
    truth : Reference
    """
    found = [interval_of(study.estimate(plan), group) for study in studies]
    apart = np.array([interval.value / truth.value - 1.0 for interval in found])
    widths = [interval.half_width / truth.value for interval in found]
    held = [interval.low <= truth.value <= interval.high for interval in found]
    return PlanError(
        rms=float(np.sqrt(np.mean(apart**2))),
        claimed=float(np.median(widths)),
        held=float(np.mean(held)),
        studies=len(found),
        known=_known(studies, apart**2),
    )


def _known(studies: Sequence[Study], squares: FloatArray) -> float:
    """Return the standard error of the root of the mean of squares, relative to it."""
    replicates = np.array([study.replicate for study in studies])
    numbers = np.unique(replicates)
    means = np.array([squares[replicates == number].mean() for number in numbers])
    return float(0.5 * means.std(ddof=1) / np.sqrt(len(numbers)) / means.mean())
