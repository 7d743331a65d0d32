"""Operating points of the contacts of a wear problem, from loads and worn depths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wearsim.contact_batch import OperatingPoints
from wearsim.evolution.problem import WearProblem
from wearsim.types import FloatArray, OperatingPoint


def operating_points(
    problem: WearProblem,
    loads: FloatArray,
    cylinder_depth: FloatArray,
    roller_depth: FloatArray,
) -> Sequence[OperatingPoint]:
    """Return the operating point of every contact, in the order of `WearProblem.contacts`.

    Parameters
    ----------
    problem : WearProblem
    loads : ndarray, shape (stations, contacts, realisations)
        Normal force of each contact [N].
    cylinder_depth, roller_depth : ndarray
        Worn depths, shapes as in `WearState` [m].
    """
    worn = problem.at_contacts(roller_depth)
    points = OperatingPoints(
        normal_force=loads.ravel(),
        **problem.input_columns,
        rolling_speed=problem.kinematics.rolling_speed,
        variation=_creepage_variation(problem, cylinder_depth, worn),
    )
    if not problem.free:
        return points
    torques = np.broadcast_to(problem.inputs.bearing_torque, problem.shape).ravel().tolist()
    radii = _rolling_radius(problem, worn)
    return [
        replace(point, bearing_torque=torque, rolling_radius=radius)
        for point, torque, radius in zip(points, torques, radii, strict=True)
    ]


def unworn_contacts(problem: WearProblem) -> tuple[FloatArray, float, Sequence[OperatingPoint]]:
    """Return gap [m], curvature along rolling [1/m] and operating points of the unworn bodies.

    The loads are those at the start of the test.
    """
    loads = np.broadcast_to(problem.force(0.0) + problem.inputs.normal_force_offset, problem.shape)
    cylinder, roller = np.zeros((1, 1, 1, 1)), np.zeros((1, problem.rollers, 1, 1))
    points = operating_points(problem, loads, cylinder, roller)
    return problem.nominal_gap, problem.kinematics.longitudinal_curvature, points


def _rolling_radius(problem: WearProblem, roller_depth: FloatArray) -> FloatArray:
    """Return the rolling radius of free rollers, shape (all contacts, strips) [m]."""
    kinematics, s = problem.kinematics, problem.from_apex[problem.roller]
    radius = kinematics.roller_radius - s * s / (2.0 * kinematics.crown_radius) - roller_depth
    return _of_contacts(problem, radius)


def _creepage_variation(
    problem: WearProblem, cylinder_depth: FloatArray, roller_depth: FloatArray
) -> FloatArray | None:
    """Return the variation of creepage, (all contacts, strips), or None for spin alone.

    The tilt enters differential slip once: as the shift of the contact away from the apex or,
    where it shifts nothing, as the term -phi y of the spin.
    """
    if problem.slip_profile is None:
        return None
    variation: FloatArray = (
        problem.slip_profile[problem.roller]
        + roller_depth / problem.kinematics.roller_radius
        - cylinder_depth / problem.kinematics.cylinder_radius
    )
    if not problem.tilt_shifts:
        variation = variation - problem.spin[:, :, None] * problem.from_apex[problem.roller]
    return _of_contacts(problem, variation)


def _of_contacts(problem: WearProblem, values: FloatArray) -> FloatArray:
    """Return values that broadcast to all contacts as (all contacts, strips)."""
    shape = (*problem.shape, problem.grid.strips)
    return np.broadcast_to(values, shape).reshape(-1, shape[-1])
