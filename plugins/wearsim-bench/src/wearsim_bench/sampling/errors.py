"""Errors of sampling designs: studies of one size compared with the estimate from all tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wearsim.studies.ensemble.designs import EnsemblePlan
from wearsim.types import FloatArray
from wearsim.uq.estimation.estimates import Estimate, WeightedDistribution, estimate
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.standard_errors import Control, Controlled
from wearsim.uq.sampling.sampler import REPLICATES

PROBABILITY = 0.95
MEAN, QUANTILE = "mean of depth", "95 % quantile of depth"


@dataclass(frozen=True)
class Study:
    """Results of the tests of one study.

    Parameters
    ----------
    replicate : int
        Number of the replicate; studies of different replicates are independent.
    depths, controls : ndarray, shape (tests,)
        Final depths, and their closed-form approximations [m].
    known : tuple of float
        Mean of the control variate and its standard error [m].
    """

    replicate: int
    depths: FloatArray
    controls: FloatArray
    known: tuple[float, float]

    def blocks(self, size: int) -> list[Study]:
        """Return the consecutive blocks of `size` tests as studies.

        A block has the distribution of a study of this size. This holds for independent draws, and
        for a Sobol sequence if `size` is a power of two: a block that starts at a multiple of
        `size` is the first block with permuted digits, which has the same distribution under
        Owen scrambling.
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
        """Return the estimate of an ensemble with this plan from these tests."""
        control = Control(self.controls, *self.known) if plan == "control-variate" else None
        replicate = np.arange(len(self.depths)) % REPLICATES
        return estimate(self.depths, (PROBABILITY,), plan, replicate, control)


def interval_of(result: Estimate, group: str) -> Interval:
    """Return the mean or the quantile of an estimate, by its group."""
    return result.mean if group == MEAN else result.quantile(PROBABILITY)


@dataclass(frozen=True)
class Reference:
    """Reference value from all tests.

    Parameters
    ----------
    value, error : float
        Value and standard error [m].
    """

    value: float
    error: float


def references(studies: Sequence[Study]) -> dict[str, Reference]:
    """Return the reference values from all studies, by group.

    The tests are weighted so that the control variate has its known mean. The standard errors are
    those of the jackknife over replicates.

    Parameters
    ----------
    studies : sequence of Study
        Studies of at least two replicates.
    """
    numbers = sorted({study.replicate for study in studies})
    pooled = _pooled(studies)
    reduced = [_pooled([s for s in studies if s.replicate != number]) for number in numbers]
    share = (len(numbers) - 1) / len(numbers)
    references = {}
    for group, value in pooled.items():
        jackknife = np.array([values[group] for values in reduced])
        error = float(np.sqrt(share * ((jackknife - jackknife.mean()) ** 2).sum()))
        references[group] = Reference(value, error)
    return references


def _pooled(studies: Sequence[Study]) -> dict[str, float]:
    depths = np.concatenate([study.depths for study in studies])
    controls = np.concatenate([study.controls for study in studies])
    means = sorted({study.known for study in studies})
    known = float(np.mean([mean for mean, _ in means]))
    weights = Controlled(Control(controls, known)).weights
    quantile = WeightedDistribution(depths, weights).quantile(PROBABILITY)
    return {MEAN: float(weights @ depths), QUANTILE: quantile}


@dataclass(frozen=True)
class PlanError:
    """Errors of the studies of one plan and size.

    Parameters
    ----------
    rms : float
        Root mean square of the relative errors.
    claimed : float
        Median relative half-width of the confidence interval; infinite if half are unbounded.
    held : float
        Fraction of the studies whose interval contains the reference.
    studies : int
        Number of studies.
    known : float
        Relative standard error of `rms`, from the means over replicates, since studies of one
        replicate may share draws.
    """

    rms: float
    claimed: float
    held: float
    studies: int
    known: float


def plan_error(
    studies: Sequence[Study], plan: EnsemblePlan, group: str, reference: Reference
) -> PlanError:
    """Return the errors of studies of one size.

    Parameters
    ----------
    studies : sequence of Study
        Studies of at least two replicates.
    plan : str
        The sampling design.
    group : str
        `MEAN` or `QUANTILE`.
    reference : Reference
        Reference value of the group.
    """
    intervals = [interval_of(study.estimate(plan), group) for study in studies]
    errors = np.array([interval.value / reference.value - 1.0 for interval in intervals])
    widths = [interval.half_width / reference.value for interval in intervals]
    held = [interval.low <= reference.value <= interval.high for interval in intervals]
    return PlanError(
        rms=float(np.sqrt(np.mean(errors**2))),
        claimed=float(np.median(widths)),
        held=float(np.mean(held)),
        studies=len(intervals),
        known=_relative_standard_error(studies, errors**2),
    )


def _relative_standard_error(studies: Sequence[Study], squares: FloatArray) -> float:
    """Return the relative standard error of the root of the mean of squares."""
    replicates = np.array([study.replicate for study in studies])
    numbers = np.unique(replicates)
    means = np.array([squares[replicates == number].mean() for number in numbers])
    return float(0.5 * means.std(ddof=1) / np.sqrt(len(numbers)) / means.mean())
