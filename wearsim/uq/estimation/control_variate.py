"""Estimates by a control variate: a number that goes with the values, and whose mean is known."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.estimation.moments import is_constant

_FEWEST = 10  # realisations, below which the regression says more than they know


class Control(NamedTuple):
    """What is known of a control variate.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The control in each realisation.
    mean : float
        Its true mean.
    mean_error : float
        Standard error of that mean, where it comes from many cheap draws itself.
    """

    values: FloatArray
    mean: float
    mean_error: float = 0.0


class Controlled:
    """Independent realisations with weights that give the control its known mean.

    Parameters
    ----------
    control : Control
        Of the same realisations as the values.

    Notes
    -----
    The weighted mean of anything is its mean corrected by its regression on the control, so that
    one set of weights serves all: Hesterberg and Nelson, Management Science 44 (1998), DOI
    10.1287/mnsc.44.9.1295. The error takes each realisation's residual as the regression on all
    others leaves it, whatever their spread along the control: HC3 of MacKinnon and White, Journal
    of Econometrics 29 (1985), DOI 10.1016/0304-4076(85)90158-7.
    """

    method = "regression on a control variate whose mean is known"

    def __init__(self, control: Control) -> None:
        values, count = control.values, len(control.values)
        self._apart = values - values.mean()
        self._square = float((self._apart**2).sum())
        self._shift = control.mean - float(values.mean())
        self._mean_error = control.mean_error
        self.draws = count
        self.degrees = count - 2
        self.weights = 1.0 / count + self._shift / self._square * self._apart

    def residuals(self, parts: FloatArray) -> FloatArray:
        """Return what the regression of `parts`, (n,), on the control leaves of them, (n,)."""
        return np.asarray(parts - parts.mean() - self._slope(parts) * self._apart)

    def error(self, parts: FloatArray) -> float:
        """Return the standard error of the weighted mean of `parts`, (n,)."""
        own = 1.0 / self.draws + self._apart**2 / self._square
        # a realisation that the line goes through by itself leaves nothing
        free = np.maximum(1.0 - own, np.finfo(float).eps)
        left = float(((self.weights * self.residuals(parts) / free) ** 2).sum())
        return math.sqrt(left + (self._slope(parts) * self._mean_error) ** 2)

    def variance_saved(self, values: FloatArray) -> float:
        """Return the part of the values' variance, (n,), that the control explains, 0 to 1."""
        return 1.0 - float(self.residuals(values).var() / values.var())

    def _slope(self, parts: FloatArray) -> float:
        return float(self._apart @ parts) / self._square


def is_usable(control: Control) -> bool:
    """Tell whether there are realisations enough for a regression, and the control has a spread."""
    values = control.values
    return len(values) >= _FEWEST and not is_constant(float(values.mean()), float(values.std()))
