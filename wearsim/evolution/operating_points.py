"""Operating points of the contacts of a wear problem, from loads and worn depths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wearsim.contact_batch import OperatingPoints
from wearsim.evolution.problem import WearProblem
from wearsim.types import Creepage, FloatArray, IntArray, OperatingPoint


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
    if problem.free:
        return [
            operating_point(
                problem,
                (c, v),
                float(loads[s, c, v]),
                cylinder_depth[s, 0, v],
                roller_depth[0, problem.roller[c], v],
            )
            for s, c, v in problem.contacts
        ]
    variation = _creepage_variation(
        problem,
        problem.roller[None, :, None],
        problem.spin[None, :, :, None],
        cylinder_depth,
        problem.at_contacts(roller_depth),
    )
    if variation is not None:
        shape = (*problem.shape, problem.grid.strips)
        variation = np.broadcast_to(variation, shape).reshape(-1, shape[-1])
    return OperatingPoints(
        normal_force=loads.ravel(),
        **problem.input_columns,
        rolling_speed=problem.kinematics.rolling_speed,
        variation=variation,
    )


def operating_point(
    problem: WearProblem,
    place: tuple[int, int],
    load: float,
    cylinder_depth: FloatArray,
    roller_depth: FloatArray,
) -> OperatingPoint:
    """Return the operating point of a single contact.

    Parameters
    ----------
    problem : WearProblem
    place : (int, int)
        Contact and realisation.
    load : float
        Normal force [N].
    cylinder_depth, roller_depth : ndarray, shape (strips,)
        Worn depths of the two bodies [m].
    """
    kinematics, inputs, roller = problem.kinematics, problem.inputs, int(problem.roller[place[0]])
    spin, radius = float(problem.spin[place]), None
    if problem.free:
        s = problem.from_apex[roller]
        radius = kinematics.roller_radius - s * s / (2.0 * kinematics.crown_radius) - roller_depth
    return OperatingPoint(
        normal_force=load,
        rolling_speed=kinematics.rolling_speed,
        creepage=Creepage(
            float(inputs.longitudinal[place]),
            float(inputs.yaw[place]),
            spin,
            _creepage_variation(problem, roller, spin, cylinder_depth, roller_depth),
        ),
        friction=float(inputs.friction[place]),
        bearing_torque=float(inputs.bearing_torque[place]) if problem.free else None,
        rolling_radius=radius,
    )


def _creepage_variation(
    problem: WearProblem,
    roller: int | IntArray,
    spin: float | FloatArray,
    cylinder_depth: FloatArray,
    roller_depth: FloatArray,
) -> FloatArray | None:
    """Return the variation of creepage over the strips (last axis), or None for spin alone.

    The tilt enters differential slip once: as the shift of the contact away from the apex or,
    where it shifts nothing, as the term -phi y of the spin.
    """
    if problem.slip_profile is None:
        return None
    variation: FloatArray = (
        problem.slip_profile[roller]
        + roller_depth / problem.kinematics.roller_radius
        - cylinder_depth / problem.kinematics.cylinder_radius
    )
    return variation if problem.tilt_shifts else variation - spin * problem.from_apex[roller]
