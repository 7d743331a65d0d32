"""Wear tests joined as the realisations of one problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from wearsim.evolution.contact_inputs import ContactInputs
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.steppers.backward_euler import ImplicitStepper
from wearsim.evolution.steppers.base import Stepper
from wearsim.plugins import BODIES

_RADII = ("cylinder_radius", "roller_radius", "crown_radius", "rolling_speed")
_ARRAYS = ("from_apex", "roller", "weight", "slip_profile")


def can_step_together(problem: WearProblem, stepper: Stepper) -> bool:
    """Return whether a test can be stepped together with `compatible` ones.

    Tests with load terms, a bearing torque, inputs drawn at every pass, several stations or a wear
    law that is not linear in the dissipation are stepped one at a time, as are those of other
    steppers, whose steps differ between tests in more than length.
    """
    linear = all(problem.wear_factors[body] is not None for body in BODIES)
    plain = not (problem.free or problem.terms or problem.has_nodes)
    single = problem.shape[0] == problem.shape[2] == 1
    return isinstance(stepper, ImplicitStepper) and linear and plain and single


def compatible(one: WearProblem, other: WearProblem) -> bool:
    """Return whether two tests that can be stepped together can be joined in one problem.

    They share grid, model, kinematics and the arrays that do not depend on the realisation.
    """
    first, second = one.kinematics, other.kinematics
    arrays = [(getattr(one, name), getattr(other, name)) for name in _ARRAYS]
    varying = [[(item.name, item.rollers) for item in problem.varying] for problem in (one, other)]
    return (
        one.grid is other.grid
        and one.model is other.model
        and one.tilt_shifts == other.tilt_shifts
        and one.iteration_tolerance == other.iteration_tolerance
        and np.array_equal(first.multiplicity, second.multiplicity)
        and all(a is b if a is None or b is None else np.array_equal(a, b) for a, b in arrays)
        and all(getattr(first, name) == getattr(second, name) for name in _RADII)
        and varying[0] == varying[1]
    )


def joined_problem(problems: Sequence[WearProblem]) -> WearProblem:
    """Return one problem whose realisations are those of the given problems, all compatible."""
    columns = (
        np.concatenate([getattr(problem.inputs, item.name) for problem in problems], axis=1)
        for item in fields(ContactInputs)
    )
    return replace(
        problems[0],
        laws=tuple(law for problem in problems for law in problem.laws),
        loads=tuple(load for problem in problems for load in problem.loads),
        flat_gap=np.concatenate([problem.flat_gap for problem in problems], axis=2),
        inputs=ContactInputs(*columns),
        varying=tuple(
            replace(items[0], paths=tuple(path for item in items for path in item.paths))
            for items in zip(*(problem.varying for problem in problems), strict=True)
        ),
    )
