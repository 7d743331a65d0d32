"""True and stated errors of power, force, pressure and other observables at the end of a test.

Their true values are those of the contacts on the worn profiles of the reference.
"""

from __future__ import annotations

import math

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.single_step import solve_at_record
from wearsim.studies.run.recorder import history_row
from wearsim.studies.run.result import Result
from wearsim.studies.run.schema import ESTIMATED
from wearsim.types import FloatArray, Grid
from wearsim_bench.stated_errors.random_tests import TRUE_TOLERANCE, RandomTest
from wearsim_bench.stated_errors.references import Reference
from wearsim_bench.stepping.runs import PreparedTest

#: names of the observables; energy and damage do not follow from the worn profiles
OBSERVED = tuple(name for name in ESTIMATED if name not in {"dissipated_energy", "damage"})


def observed_of(test: RandomTest, reference: Reference) -> dict[str, FloatArray]:
    """Return the true observables at the end of a test by name.

    There are none with a thermal load, and where a spring has lost its load: profiles do not
    determine how much is left.

    Parameters
    ----------
    test : RandomTest
        The test.
    reference : Reference
        Its worn profiles.
    """
    grid = Grid(reference.y, float(reference.y[1] - reference.y[0]))
    scenario = test.scenario(evolution__tolerance=TRUE_TOLERANCE)
    prepared = PreparedTest(scenario, grid)
    problem = prepared.problem
    if problem.terms:  # the present load follows from the course of the power
        return {}
    try:
        state = _worn_state(problem, reference)
    except StepError:
        return {}
    row = history_row(prepared.stepper, problem, state, scenario.outputs.width_threshold)
    return {name: np.ravel(row[name]) for name in OBSERVED if name in row}


def _worn_state(problem: WearProblem, reference: Reference) -> WearState:
    """Return the state on the profiles of a reference, with its contacts."""
    solved = np.unique(problem.kinematics.track.places, return_index=True)[1]  # equal ones once
    cylinder = reference.cylinder_depth[solved]
    state = fresh_state(problem).replaced(
        cylinder_depth=cylinder,
        roller_depth=reference.roller_depth,
        passes=np.array([reference.passes]),
    )
    contacts, _ = solve_at_record(problem, state, on_profile=False, cold=True)
    return state.replaced(contacts=contacts)


def errors_of(result: Result, true: dict[str, FloatArray]) -> dict[str, tuple[float, float]]:
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
