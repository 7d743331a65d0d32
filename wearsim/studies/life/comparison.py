"""Comparison of the lives of designs, with common draws where they have the same seed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.studies.life.stored_settings import DesignVariable
from wearsim.studies.life.values import LifeValues
from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.comparison import quantile_ratio, same_machine, two_specimens
from wearsim.uq.survival.distributions import (
    CountedLives,
    FactorMixture,
    LifeDistribution,
)

if TYPE_CHECKING:
    from wearsim.studies.life.result import LifeResult


@dataclass(frozen=True)
class LifeComparison:
    """Lives of two designs.

    Parameters
    ----------
    b10_ratio : Interval
        B10 of the first over B10 of the second.
    same_machine : Interval, optional
        Probability that the first outlives the second with the same drawn values; None without
        common draws.
    two_specimens : Interval
        Probability that a specimen of the first outlives one of the second, drawn separately.
    count : int
        Number of pairs.
    b10_ratio_bounds : tuple of float
        Least and greatest ratio of B10 within the numerical errors of both lives.
    """

    b10_ratio: Interval
    same_machine: Interval | None
    two_specimens: Interval
    count: int
    b10_ratio_bounds: tuple[float, float] = (math.nan, math.nan)


def _pair(
    first: LifeValues, second: LifeValues
) -> tuple[tuple[LifeDistribution, ...], tuple[FloatArray, ...], float, bool, int]:
    """Return distributions and lives of two designs, of common realisations if they are paired.

    After them the life up to which both are known, whether realisations of the same number have
    common draws, and the number of realisations that both have.
    """
    both = (first, second)
    # kappa is known beyond the maximum, and with it the survival
    known = all(item.is_known_throughout for item in both)
    most = math.inf if known else min(item.most for item in both)
    paired = first.raw.seed == second.raw.seed
    distributions: tuple[LifeDistribution, ...] = (first.distribution, second.distribution)
    lives = tuple(item.known_lives if known else item.lives for item in both)
    common = np.intersect1d(first.numbers, second.numbers)
    exact = [item.exact for item in distributions]
    if paired and not all(exact):
        if any(exact):
            paired = False
        else:
            places = [np.searchsorted(item.numbers, common) for item in both]
            distributions = tuple(map(_at, distributions, places))
            lives = tuple(of[at] for of, at in zip(lives, places, strict=True))
    return distributions, lives, most, paired, len(common)


def _at(distribution: LifeDistribution, places: IntArray) -> LifeDistribution:
    """Return the distribution of some realisations."""
    if isinstance(distribution, FactorMixture):
        shift = np.broadcast_to(np.asarray(distribution.shift), distribution.kappa.shape)
        return replace(distribution, kappa=distribution.kappa[places], shift=shift[places])
    assert isinstance(distribution, CountedLives)
    return CountedLives(distribution.life[places])


def compare_lives(first: LifeResult, second: LifeResult, share: float = 0.1) -> LifeComparison:
    """Return the comparison of two designs, with `b10_ratio` for lives at a share of failures.

    Raises
    ------
    ValueError
        If the units of their lives differ.
    """
    if first.unit != second.unit:
        raise ValueError(
            f"{first.title} is in {first.unit} and {second.title} in {second.unit}; their lives"
            " cannot be compared"
        )
    (one, other), lives, most, paired, common = _pair(first, second)
    machine = None
    if paired and len(lives[0]) == len(lives[1]):
        machine = same_machine(lives[0], lives[1], most)
        if first.settings.alone and second.settings.alone:  # for any wear factor
            machine = Interval(machine.value, machine.value, machine.value)
    (low, high), (least, greatest) = (item.b_error(100.0 * share) for item in (first, second))
    return LifeComparison(
        quantile_ratio(one, other, share, most, paired),
        machine,
        two_specimens(one, other, most, paired),
        common,
        (
            low / greatest if greatest > 0.0 else math.nan,
            high / least if least > 0.0 else math.inf,
        ),
    )


def swept_variable(results: Sequence[Any]) -> DesignVariable | None:
    """Return the design variable whose value differs between results of a sweep, if there is one.

    Parameters
    ----------
    results : sequence of LifeResult

    Returns
    -------
    DesignVariable or None
        That of the first; None unless all have the same variable with different values.
    """
    variables = [result.variable for result in results if result.variable]
    keys, values = {(item.key, item.unit) for item in variables}, {item.value for item in variables}
    return variables[0] if len(keys) == 1 and len(values) == len(results) > 1 else None
