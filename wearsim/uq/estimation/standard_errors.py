"""Standard errors of means over the realisations of a sampling design."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np

from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.moments import are_equal

_MIN_REGRESSION = 10  # least number of realisations for a regression on a control variate


class PlanErrors(ABC):
    """Weights of the realisations of a sampling design, and standard errors of weighted means.

    Attributes
    ----------
    method : str
        Method of the intervals, in words.
    draws : int
        Number of independent draws from which the errors are estimated.
    degrees : int
        Degrees of freedom of the errors; 0 if there is no error estimate.
    weights : ndarray, shape (n,), or None
        Weights of the realisations, with the sum 1; None for equal weights.
    """

    method: str
    draws: int
    degrees: int
    weights: FloatArray | None = None

    @abstractmethod
    def error(self, parts: FloatArray) -> float:
        """Return the standard error of the weighted mean of `parts`, (n,)."""

    def variance_saved(self, values: FloatArray) -> float | None:
        """Return the share of the variance of `values`, (n,), explained by a control variate."""
        return None


class Independent(PlanErrors):
    """Independent realisations.

    Parameters
    ----------
    count : int
        Number of realisations.
    method : str
        Description in words.
    """

    def __init__(self, count: int, method: str) -> None:
        self.method, self.draws, self.degrees = method, count, count - 1

    def error(self, parts: FloatArray) -> float:
        """Return the standard error of the mean of `parts`, (n,)."""
        return float(parts.std(ddof=1)) / math.sqrt(self.draws)


class Replicated(PlanErrors):
    """Groups of realisations; the groups are independent, their members are not.

    Parameters
    ----------
    replicate : ndarray of int, shape (n,)
        Group of each realisation. Sizes may differ, because failed realisations are left out.

    Notes
    -----
    The error is that of a ratio of cluster totals (Cochran, Sampling Techniques (1977), section
    11.8); for groups of equal size it is the standard error of the group means.
    """

    def __init__(self, replicate: IntArray) -> None:
        groups, self._group = np.unique(replicate, return_inverse=True)
        self.draws = len(groups)
        self.degrees = self.draws - 1
        self.method = f"the spread of {self.draws} independently scrambled Sobol sequences"

    def error(self, parts: FloatArray) -> float:
        """Return the standard error of the mean of `parts`, (n,)."""
        totals = np.bincount(self._group, parts - parts.mean()) / len(parts)
        return math.sqrt(float((totals**2).sum()) * self.draws / self.degrees)


class Control(NamedTuple):
    """A control variate.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Value of the control variate in each realisation.
    mean : float
        Its true mean.
    mean_error : float
        Standard error of that mean, if it is estimated from a large separate sample.
    """

    values: FloatArray
    mean: float
    mean_error: float = 0.0

    @property
    def is_usable(self) -> bool:
        """Whether the realisations are sufficient for a regression and the values vary."""
        return len(self.values) >= _MIN_REGRESSION and not are_equal(self.values)


class Controlled(PlanErrors):
    """Independent realisations, weighted so that the control variate has its known mean.

    Parameters
    ----------
    control : Control
        Control variate of the same realisations as the values.

    Notes
    -----
    The weighted mean of any quantity is its mean corrected by its regression on the control
    variate, so that one set of weights applies to all quantities: Hesterberg and Nelson, Management
    Science 44 (1998), DOI 10.1287/mnsc.44.9.1295. The error uses leave-one-out residuals of the
    regression and holds for residuals of unequal variance: HC3 of MacKinnon and White, Journal of
    Econometrics 29 (1985), DOI 10.1016/0304-4076(85)90158-7.
    """

    method = "regression on a control variate whose mean is known"
    weights: FloatArray

    def __init__(self, control: Control) -> None:
        values, count = control.values, len(control.values)
        self._deviation = values - values.mean()
        self._square = float((self._deviation**2).sum())
        self._shift = control.mean - float(values.mean())
        self._mean_error = control.mean_error
        self.draws, self.degrees = count, count - 2
        self.weights = 1.0 / count + self._shift / self._square * self._deviation

    def residuals(self, parts: FloatArray) -> FloatArray:
        """Return the residuals, (n,), of the regression of `parts`, (n,), on the control."""
        return np.asarray(parts - parts.mean() - self._slope(parts) * self._deviation)

    def error(self, parts: FloatArray) -> float:
        """Return the standard error of the weighted mean of `parts`, (n,)."""
        leverage = 1.0 / self.draws + self._deviation**2 / self._square
        # a realisation that determines the line has the leverage 1 and no residual
        free = np.maximum(1.0 - leverage, np.finfo(float).eps)
        left = float(((self.weights * self.residuals(parts) / free) ** 2).sum())
        return math.sqrt(left + (self._slope(parts) * self._mean_error) ** 2)

    def variance_saved(self, values: FloatArray) -> float:
        """Return the share of the variance of `values`, (n,), explained by the control."""
        return 1.0 - float(self.residuals(values).var() / values.var())

    def _slope(self, parts: FloatArray) -> float:
        return float(self._deviation @ parts) / self._square
