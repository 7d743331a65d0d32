"""How far a sampling plan's means can be trusted: the standard error of any mean over its rows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wearsim.types import FloatArray, IntArray


class PlanErrors(Protocol):
    """Weights of the realisations, and the standard errors of weighted means."""

    @property
    def method(self) -> str:
        """How the intervals are made, in words."""

    @property
    def weights(self) -> FloatArray | None:
        """Weight of every realisation, (n,), with the sum 1; None for equal ones."""

    @property
    def degrees(self) -> int:
        """Degrees of freedom of the errors, 0 where there is no error to be had."""

    @property
    def draws(self) -> int:
        """Independent draws that the errors come from."""

    def error(self, parts: FloatArray) -> float:
        """Return the standard error of the weighted mean of `parts`, (n,)."""

    def variance_saved(self, values: FloatArray) -> float | None:
        """Return the part of the variance of `values`, (n,), that a control explains, if any."""


@dataclass(frozen=True)
class Independent:
    """Realisations that are independent of each other.

    Parameters
    ----------
    count : int
        Realisations.
    method : str
        In words.
    """

    count: int
    method: str

    @property
    def weights(self) -> None:
        """Return that all are equal."""

    @property
    def degrees(self) -> int:
        """Return one less than the realisations."""
        return self.count - 1

    @property
    def draws(self) -> int:
        """Return the number of realisations."""
        return self.count

    def error(self, parts: FloatArray) -> float:
        """Return the standard error of the mean of `parts`, (n,)."""
        return float(parts.std(ddof=1)) / math.sqrt(self.count)

    def variance_saved(self, values: FloatArray) -> None:
        """Return that no control explains any."""


class Replicated:
    """Realisations in groups that are independent of each other, though not within.

    Parameters
    ----------
    replicate : ndarray of int, shape (n,)
        Group of each realisation. Sizes may differ, as failed realisations leave gaps.

    Notes
    -----
    The error is that of a ratio of sums over clusters (Cochran, Sampling Techniques (1977), section
    11.8), which for groups of one size is the spread of the groups' own means.
    """

    weights: FloatArray | None = None

    def __init__(self, replicate: IntArray) -> None:
        groups, self._group = np.unique(replicate, return_inverse=True)
        self.draws = len(groups)
        self.degrees = self.draws - 1

    @property
    def method(self) -> str:
        """Return how many replicates there are."""
        return f"the spread of {self.draws} independently scrambled Sobol sequences"

    def error(self, parts: FloatArray) -> float:
        """Return the standard error of the mean of `parts`, (n,)."""
        apart = np.bincount(self._group, parts - parts.mean()) / len(parts)
        return math.sqrt(float((apart**2).sum()) * self.draws / self.degrees)

    def variance_saved(self, values: FloatArray) -> None:
        """Return that no control explains any."""
