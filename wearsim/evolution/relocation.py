"""Skids of a cam's roller that move with wear: stations placed again at their ends.

Feedback of wear changes the normal force, and with it the arcs in which a free roller skids. The
stepper restarts where an end has moved: stations are placed at the new ends, and the worn depth is
interpolated to them. The worn volume of every strip between two stations that stay is kept.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import CamStations
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.loads import displacement_at
from wearsim.evolution.steppers.single_step import recovery_at, solve_at_record
from wearsim.evolution.strips import with_surfaces
from wearsim.mechanics.cam import moved_stations
from wearsim.types import FloatArray, IntArray

MOVED = math.radians(0.25)  # movement of an end of a skid at which stations are placed again
LOOK = 1e-3  # relative change of the normal force after which skids are located again
# relative change after which stations are placed again: next to a skid the traction of a rolling
# roller is 2 % below the traction bound
FALLEN = 0.01
SMALL = 0.05  # of the greatest normal force, which smaller ones are compared with


def located(problem: WearProblem, state: WearState) -> WearProblem:
    """Return the problem at the stations of a state, from that of the unworn cam."""
    cam = problem.kinematics.track
    if cam.relocated is None or state.skid_loads is None:
        return problem
    changes = state.skid_loads[0, :, 0]
    return _at_stations(problem, cam.relocated(changes)) if changes.any() else problem


def relocated(problem: WearProblem, state: WearState) -> tuple[WearProblem, WearState]:
    """Return problem and state with the stations at the ends of the present skids.

    Parameters
    ----------
    problem : WearProblem
        At the stations of the state.
    state : WearState

    Returns
    -------
    problem : WearProblem
        The given one unless an end has moved by more than `MOVED`, a skid of more than that has
        begun or ended, or a normal force has changed by more than `FALLEN`.
    state : WearState
        Without past points if the stations have moved.
    """
    cam = problem.kinematics.track
    if cam.relocated is None or cam.moved_skids is None or not problem.has_spring:
        return problem, state
    change = _changes(problem, state, cam)
    last = np.zeros((2, len(change), 1)) if state.skid_loads is None else state.skid_loads
    force = cam.at_unworn(problem.at_stations(preload_of(problem))[:, 0])
    force = np.maximum(np.abs(force), SMALL * np.abs(force).max())
    if (np.abs(change - last[1]) <= LOOK * force).all():
        return problem, state
    slips = (np.abs(change - last[0]) > FALLEN * force).any()
    if not slips and not _skids_differ(cam.skids, cam.moved_skids(change[:, 0])):
        return problem, state.replaced(skid_loads=np.stack([last[0], change]))
    new = cam.relocated(change[:, 0])
    moved = _at_stations(problem, new)
    return moved, _moved(moved, state.replaced(skid_loads=np.stack([change, change])), cam, new)


def preload_of(problem: WearProblem) -> FloatArray:
    """Return the load of each realisation at the start of the test, shape (realisations,) [N]."""
    return np.array([load.force(np.zeros(1))[0] for load in problem.loads])


def _changes(problem: WearProblem, state: WearState, cam: CamStations) -> FloatArray:
    """Return the changes of the normal force by wear at the stations of the unworn cam [N].

    They are the mean over the rollers, shape (stations, 1).
    """
    feedback = problem.feedback(
        displacement_at(problem, [state.depths], recovery_at(problem, state)[1])
    )
    return -cam.at_unworn(problem.per_roller(feedback).mean(axis=1))


def _skids_differ(present: FloatArray, moved: FloatArray) -> bool:
    """Return whether the roller rolls according to one set of skids and slides by the other.

    Parameters
    ----------
    present, moved : ndarray, shape (skids, 2)
        First and last angle of each range in which the roller skids [rad]. Ranges up to `MOVED`
        are not compared.
    """
    angles = np.unique(np.concatenate([present.ravel(), moved.ravel()]))
    middles = 0.5 * (angles[:-1] + angles[1:])
    slides, slides_by_moved = (
        ((ranges[:, :1] <= middles) & (middles <= ranges[:, 1:])).any(axis=0)
        for ranges in (present, moved)
    )
    return bool((np.diff(angles)[slides != slides_by_moved] > MOVED).any())


def _at_stations(problem: WearProblem, cam: CamStations) -> WearProblem:
    """Return the problem at other stations of its cam."""
    moved = replace(problem, kinematics=replace(problem.kinematics, track=cam))
    if any(growth.by_angle for growth in problem.growth):
        return with_surfaces(moved)
    flat_gap = np.broadcast_to(problem.flat_gap[:1], (len(cam.angle), *problem.flat_gap.shape[1:]))
    return replace(moved, flat_gap=flat_gap)


def _moved(problem: WearProblem, state: WearState, old: CamStations, new: CamStations) -> WearState:
    """Return a state at new stations, with the contacts solved on its profiles.

    Parameters
    ----------
    problem : WearProblem
        At the new stations.
    state : WearState
    old, new : CamStations
    """
    fresh = fresh_state(problem)
    cleared = dict.fromkeys(
        (
            *("past_wear", "past_sums", "past_feedback", "past_spans", "order", "wear_exponents"),
            *("separation", "part", "whole_steps"),
        )
    )
    depth = moved_depth(state.cylinder_depth[old.places], old.along, new.along)
    damage, points = _moved_damage(state, old, new)
    at_new = state.replaced(
        damage=damage,
        damage_points=points,
        cylinder_depth=depth,
        contacts=fresh.contacts,
        approach_factor=fresh.approach_factor,
        solves=state.solves + 2 * problem.contacts_each,
        stepping_error=_moved_errors(state, old.along, new.along, old.places),
        **cleared,
        **{
            name: _moved(problem, part.replaced(skid_loads=state.skid_loads), old, new)
            for name, part in state.auxiliary.items()
        },
    )
    contacts, _ = solve_at_record(problem, at_new, on_profile=False, cold=True)
    return at_new.replaced(contacts=contacts)


def _moved_stations(old: CamStations, new: CamStations) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the result of `moved_stations` for stations that have been located again."""
    assert old.panels is not None
    assert new.panels is not None
    return moved_stations(old.panels, new.panels)


def _moved_errors(
    state: WearState, old: CamStations, new: CamStations, places: IntArray
) -> FloatArray | None:
    """Return the errors of the depths at new stations, interpolated along the angle."""
    errors, stations = state.stepping_error, len(state.cylinder_depth)
    if errors is None:
        return None
    cylinder = np.tensordot(_moved_stations(old, new)[0], errors[:stations][places], axes=1)
    return np.concatenate([cylinder, errors[stations:]])


def _moved_damage(
    state: WearState, old: CamStations, new: CamStations
) -> tuple[FloatArray | None, FloatArray | None]:
    """Return damage at new stations, interpolated along the angle, and the points of its rates."""
    if state.damage is None or state.damage_points is None:
        return None, None
    matrix, stations = _moved_stations(old.along, new.along)[0], len(state.cylinder_depth)
    cylinder = state.damage[:, :stations][:, old.places]
    moved = np.maximum(np.moveaxis(np.tensordot(matrix, cylinder, axes=(1, 1)), 0, 1), 0.0)
    points = np.stack([np.full_like(state.damage_points[0], np.nan), state.damage_points[1]])
    return np.concatenate([moved, state.damage[:, stations:]], axis=1), points


def moved_depth(depth: FloatArray, old: CamStations, new: CamStations) -> FloatArray:
    """Return the worn depth at new stations, which keeps the volume of every strip.

    Parameters
    ----------
    depth : ndarray, shape (old stations, ...)
        Depth at the old stations [m].
    old, new : CamStations
        With `panels`.
    """
    matrix, old_part, new_part = _moved_stations(old, new)
    new_depth = np.maximum(np.tensordot(matrix, depth, axes=1), 0.0)
    lengths = [stations.length.reshape(-1, *(1,) * (depth.ndim - 1)) for stations in (old, new)]
    for part in np.unique(new_part[new_part >= 0]):
        before, after = old_part == part, new_part == part
        kept_volume = (lengths[0][before] * depth[before]).sum(axis=0)
        volume = (lengths[1][after] * new_depth[after]).sum(axis=0)
        scaled = volume > 0.5 * kept_volume
        factor = np.where(scaled, kept_volume / np.where(volume > 0.0, volume, 1.0), 0.0)
        # at the edge of the groove all depth may lie between two stations
        added = np.where(scaled, 0.0, kept_volume / lengths[1][after].sum())
        new_depth[after] = new_depth[after] * factor + added
    return new_depth
