"""True and stated errors of power, force, pressure and other observables at the end of a test."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Stepper
from wearsim.studies.run.recorder import history_row
from wearsim.studies.run.result import Result
from wearsim.studies.run.schema import ESTIMATED
from wearsim.types import FloatArray

#: names of the observables
OBSERVED = tuple(ESTIMATED)


def observed_of(
    stepper: Stepper, problem: WearProblem, state: WearState, threshold: float
) -> dict[str, FloatArray]:
    """Return the observables of a state by name, each of shape (1,) or (rollers,).

    Parameters
    ----------
    stepper, problem, state
        Stepper of a test, its problem, and the state.
    threshold : float
        Depth that bounds the groove's width [m].
    """
    row = history_row(stepper, problem, state, threshold)
    return {name: np.ravel(row[name]) for name in OBSERVED if name in row}


def errors_of(result: Result, true: Mapping[str, FloatArray]) -> dict[str, tuple[float, float]]:
    """Return true and stated errors at the end of a run by observable.

    Errors are relative to the greatest value over the rollers; those of angles are in radians. Of
    several rollers, the one with the smallest ratio of stated to true error counts.
    """
    errors = {}
    for name, exact in true.items():
        computed, stated = (np.ravel(result.raw.history[n][-1]) for n in (name, f"{name}_error"))
        error, scale = np.abs(computed - exact), float(np.abs(exact).max()) or 1.0
        if name.endswith("angle"):
            error, scale = np.minimum(error, math.tau - error), 1.0
        worst = int(np.argmin(stated / np.maximum(error, 1e-300)))
        errors[name] = float(error[worst]) / scale, float(stated[worst]) / scale
    return errors
