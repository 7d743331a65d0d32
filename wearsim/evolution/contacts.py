"""Contacts of a wear problem as a batch, and its state before the first pass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import CapabilityError
from wearsim.evolution.fatigue import fresh_damage
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import HERTZ, WearState
from wearsim.mechanics.numerics.jit import kernel_input
from wearsim.types import FloatArray, IntArray

T = TypeVar("T")
GRIP = 0.98  # greatest traction of a rolling roller, of friction: at the ends of a skid
LEAST_LOAD = 1e-3  # next to a pause, of the greatest load


def computed_once(compute: Callable[[WearProblem], T], problem: WearProblem) -> T:
    """Return a quantity that no step of a test with constant inputs changes.

    It is computed at the first call, and kept with the problem.
    """
    if "constants" not in problem.__dict__:
        problem.__dict__["constants"] = {}
    constants: dict[Callable[[WearProblem], T], T] = problem.__dict__["constants"]
    if compute not in constants:
        constants[compute] = compute(problem)
    return constants[compute]


def with_contacts(problem: WearProblem, chosen: IntArray) -> WearProblem:
    """Return a problem with some of its contacts, by number."""
    return replace(
        problem,
        inputs=problem.inputs.at(chosen),
        roller=problem.roller[chosen],
        weight=problem.weight[chosen],
    )


def contact_batch(
    problem: WearProblem,
    gap: FloatArray,
    loads: FloatArray,
    cylinder_depth: FloatArray,
    roller_depth: FloatArray,
) -> ContactBatch:
    """Return all contacts as a batch, numbered as in `WearProblem`, the realisation fastest.

    Parameters
    ----------
    problem : WearProblem
    gap : ndarray, shape (stations, contacts, realisations, strips)
        Gap of each contact [m].
    loads : ndarray, shape (stations, contacts, realisations)
        Normal force of each contact [N].
    cylinder_depth, roller_depth : ndarray
        Worn depths, shapes as in `WearState` [m].
    """
    batch = problem.nominal_batch
    changes: dict[str, Any] = {
        "gap": gap.reshape(batch.gap.shape),
        "normal_force": loads.ravel(),
    }
    if problem.slip_profile is not None or problem.free:
        worn = problem.at_contacts(roller_depth)
        changes["variation"] = _creepage_variation(problem, cylinder_depth, worn)
    if problem.free:
        drop = np.asarray(problem.roller_drop)[problem.roller]
        radius = problem.kinematics.roller_radius - drop - worn
        changes["rolling_radius"] = _of_contacts(problem, radius)
        changes["bearing_torque"] = _bearing_torque(problem, loads, worn)
    return batch.replaced(**changes)


def _bearing_torque(
    problem: WearProblem, loads: FloatArray, roller_depth: FloatArray
) -> FloatArray:
    """Return the torque of all rollers, shape (contacts,) [N m].

    Next to the skids of a cam's roller, its torque is at most that which friction transmits under
    the present load and at the present radius, until wear has moved the skids so far that they are
    located again.
    """
    batch, track = problem.nominal_batch, problem.kinematics.track
    torque = np.asarray(batch.bearing_torque)
    if not (track.relocated or len(track.skids)):
        return torque
    radius = problem.kinematics.roller_radius - roller_depth.max(axis=-1)
    most = GRIP * batch.friction * np.abs(loads * radius).ravel()
    return np.asarray(np.clip(torque, -most, most))


def at_least(problem: WearProblem, loads: FloatArray) -> FloatArray:
    """Return loads that do not fall below a small part of the greatest load of a test with pauses.

    Axis -1 of the loads is that of the realisations.
    """
    return np.maximum(loads, LEAST_LOAD * problem.greatest_load) if problem.pauses else loads


def unworn_contacts(problem: WearProblem) -> ContactBatch:
    """Return the contacts of the unworn bodies under the loads at the start of the test."""
    force = at_least(problem, problem.force(np.zeros(len(problem.loads))))
    loads = np.broadcast_to(force + problem.inputs.normal_force_offset, problem.shape)
    cylinder, roller = np.zeros((1, 1, 1, 1)), np.zeros((1, problem.rollers, 1, 1))
    return contact_batch(problem, problem.nominal_gap, loads, cylinder, roller)


def fresh_state(problem: WearProblem) -> WearState:
    """Return the state before the first pass, with the contacts of the unworn bodies solved."""
    stations, contacts, realisations = problem.shape
    zeros, counts = np.zeros(realisations), np.zeros(realisations, dtype=np.int64)
    problem = problem.at_time(zeros, zeros)
    n, solved = problem.grid.strips, problem.model.solve(unworn_contacts(problem))
    damage = fresh_damage(problem, solved) if problem.fatigue else (None, None)
    return WearState(
        passes=zeros,
        cylinder_depth=np.zeros((stations, 1, realisations, n)),
        roller_depth=np.zeros((1, problem.rollers, realisations, n)),
        terms=np.zeros((len(problem.terms), problem.rollers, realisations)),
        contacts=solved,
        energy=zeros,
        depth_error=zeros,
        volume_error=zeros,
        profile_error=zeros,
        quadrature=np.zeros((3, realisations)),
        scatter=np.zeros((3, realisations)),
        step=zeros,
        steps=counts,
        rejected=counts,
        solves=counts + stations * contacts,
        full_solves=counts,
        approach_factor=_approach_factor(problem, solved) if problem.has_spring else None,
        damage=damage[0],
        damage_points=damage[1],
    )


def _approach_factor(problem: WearProblem, contacts: ContactBatchSolution) -> FloatArray:
    """Return `approach_factor` of a state, from the contacts of the unworn bodies at the start."""
    force = problem.force(np.zeros(len(problem.loads)))
    batch = unworn_contacts(problem)
    if problem.pauses:
        # a test may start in a pause; a small contact would be resolved by too few strips
        force = np.maximum(force, problem.greatest_load) + problem.inputs.normal_force_offset
        batch = replace(batch, normal_force=np.broadcast_to(force, problem.shape).ravel())
        contacts = problem.model.solve(batch, warm=contacts)
    approach = problem.values_of(contacts, "approach") - problem.nominal_gap.min(axis=-1)
    if not np.isfinite(approach).all():
        raise CapabilityError(
            f"{type(problem.model).__name__} returns an approach that is not finite, and a load"
            " with a stiffness depends on it; choose another contact.model, or a load without"
            " stiffness"
        )
    return problem.per_roller(approach / batch.normal_force.reshape(problem.shape) ** HERTZ)


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
        problem.at_contacts(problem.slip_profile)
        + roller_depth / problem.kinematics.roller_radius
        - problem.kinematics.track.over_radius(cylinder_depth)
    )
    if not problem.tilt_shifts:
        variation = variation - problem.spin[:, :, None] * problem.from_apex[problem.roller]
    return _of_contacts(problem, variation)


def _of_contacts(problem: WearProblem, values: FloatArray) -> FloatArray:
    """Return values that broadcast to all contacts as (all contacts, strips)."""
    shape = (*problem.shape, problem.grid.strips)
    return kernel_input(np.broadcast_to(values, shape).reshape(-1, shape[-1]))
