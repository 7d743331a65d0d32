"""One step over many passes, implicit or explicit: pure functions from state to state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.each import one_of
from wearsim.evolution.joining import scene_of, state_of
from wearsim.evolution.observables import depth, worn_volume
from wearsim.evolution.scene import Scene
from wearsim.evolution.state import Contacts, WearState, as_batch, contact_values
from wearsim.evolution.wearing import Wearing, exponents_between
from wearsim.evolution.yielding import REALISATION, solve_yielding
from wearsim.types import FloatArray, Number

MAX_FIXED_POINT = 60
PATIENCE = 20  # iterations after which ten times as much is allowed: strips at an edge come and go
SAME_LOAD = 1e-9  # relative change of a load that asks for no new solution


def mean_loads(
    scene: Scene,
    state: WearState,
    passes: Number,
    gaps: Sequence[FloatArray],
    power: FloatArray,
) -> FloatArray:
    """Return the mean load of each contact over a step, shape (S, C, N) [N].

    The load itself is integrated exactly; the feedback takes the mean of the descents at `gaps`,
    as a rule those at the step's ends, and each term its exact mean at constant `power`.
    """
    start, stop = scene.time(state.now), scene.time(state.now + passes)
    scene = scene.at_time(start, stop)
    loads = _loads(scene, scene.mean_load(start, stop))
    if scene.has_spring:
        descents = [scene.descent(gap) for gap in gaps]
        loads -= scene.stiffness * np.mean(descents, axis=0)
    for number, term in enumerate(scene.terms.values()):
        # a station's power counts like any other's
        mean = scene.per_roller(power).mean(axis=0)
        duration = one_of(stop - start)
        loads += term.mean_force(state.terms[number], mean, duration)[scene.roller]
    return checked_loads(loads, state.now)


def _loads(scene: Scene, force: Number) -> FloatArray:
    """Return the load of every contact before feedback where that of the scene is `force` [N]."""
    return np.broadcast_to(force + scene.inputs.normal_force, scene.shape).copy()


def checked_loads(loads: FloatArray, passes: Number) -> FloatArray:
    """Return `loads` if all are positive; a contact that has lost its load cannot go on."""
    if not (loads > 0.0).all():
        raise StepError(
            f"contact is lost at pass {one_of(passes):.0f}: the load has fallen to"
            f" {loads.min():.4g} N; the spring has run out of travel, or the log or a draw falls to"
            " zero",
            {"normal_force": loads, "passes": passes},
        )
    return loads


def _differs(new: FloatArray, old: FloatArray) -> FloatArray:
    """Return the greatest change of each realisation, relative, from (S, C, N, ...)."""
    axes = (0, 1, 3)[: new.ndim - 1]
    change, scale = np.abs(new - old).max(axis=axes), np.abs(new).max(axis=axes)
    relative: FloatArray = np.divide(change, scale, out=np.zeros(len(scale)), where=scale > 0.0)
    return relative


def implicit_step(scene: Scene, state: WearState, passes: Number) -> WearState:
    """Step over `passes` passes with the contacts solved on the profiles at the step's end.

    The wear of the step enters the contact problem as a compliance, so that no step is too long
    for stability. Compliance, loads and creepage depend on the answer and are iterated; where wear
    is no multiple of the line load, its exponent is learnt from one iterate to the next. A
    realisation that has settled is let be while others go on.

    Raises
    ------
    StepError
        If they do not settle.
    """
    scene = scene.at_time(scene.time(state.now), scene.time(state.now + passes))
    gap = scene.gap(state.cylinder_depth, state.roller_depth)
    contacts = state.contacts
    wearing = Wearing(scene, contacts, passes)
    loads = _end_loads(scene, state, passes, wearing, contacts)
    moving = np.ones(scene.shape[REALISATION], dtype=np.bool_)
    iterations = np.zeros(len(moving), dtype=np.int64)
    for iteration in range(1, MAX_FIXED_POINT + 1):
        ends = state.cylinder_depth + wearing.cylinder, state.roller_depth + wearing.roller
        points = scene.points(loads, *ends)
        open_gap, wear = gap + wearing.offset, wearing.compliance
        found = solve_yielding(scene, open_gap, points, wear, contacts, moving)
        iterations += moving
        new = Wearing(scene, found, passes)
        new_loads = _end_loads(scene, state, passes, new, found)
        foreseen = wearing.foreseen(contact_values(scene, found, "line_load"))
        change = np.maximum(_differs(new.opening, foreseen), _differs(new_loads, loads))
        if scene.slip_profile is not None:
            change = np.maximum(change, _differs(new.cylinder, wearing.cylinder))
        moving &= ~(change < scene.settled * 10.0 ** ((iteration - 1) // PATIENCE))
        if not moving.any():
            power = contact_values(scene, found, "power")
            solves = iterations * (len(found) // len(moving))
            begun = state.moved(state.now, solves, contacts=found)
            return worn_state(scene, begun, passes, (new.cylinder, new.roller), power)
        new.exponents = exponents_between(wearing, new)
        contacts, wearing, loads = found, new, new_loads
    raise StepError(
        f"an implicit step of {one_of(passes):.4g} passes from pass {one_of(state.now):.0f} did not"
        f" settle (last change {change.max():.1e})",
        state.to_arrays(),
    )


def _end_loads(
    scene: Scene,
    state: WearState,
    passes: Number,
    wearing: Wearing,
    contacts: Contacts,
) -> FloatArray:
    gaps = (
        scene.gap(state.cylinder_depth, state.roller_depth),
        scene.gap(state.cylinder_depth + wearing.cylinder, state.roller_depth + wearing.roller),
    )
    return mean_loads(scene, state, passes, gaps, contact_values(scene, contacts, "power"))


def explicit_step(scene: Scene, state: WearState, passes: Number) -> WearState:
    """Step over `passes` passes on the profiles of the step's start, under its mean load."""
    here = scene.at_time(scene.time(state.passes), scene.time(state.passes + passes))
    foreseen = Wearing(here, state.contacts, passes)
    mean = _end_loads(here, state, passes, foreseen, state.contacts)
    solve = solve_present if scene.varying else contacts_at
    contacts = solve(here, state, mean)
    solves = len(contacts) if contacts is state.contacts else 2 * len(contacts)
    wearing, power = Wearing(here, contacts, passes), contact_values(here, contacts, "power")
    begun = replace(state, contacts=contacts, solves=state.solves + solves)
    worn = worn_state(here, begun, passes, (wearing.cylinder, wearing.roller), power)
    return replace(worn, contacts=solve_present(scene, worn, present_loads(scene, worn)))


def present_scene(scene: Scene, state: WearState) -> Scene:
    """Return the scene with every process at its value of this moment."""
    now = scene.time(state.now)
    return scene.at_time(now, now)


def present_loads(scene: Scene, state: WearState) -> FloatArray:
    """Return the load of each contact at this moment, shape (S, C, N) [N]."""
    scene = present_scene(scene, state)
    loads = _loads(scene, scene.force(scene.time(state.now)))
    if scene.has_spring:
        gap = scene.gap(state.cylinder_depth, state.roller_depth)
        loads -= scene.stiffness * scene.descent(gap)
    for number in range(len(scene.terms)):
        loads += state.terms[number][scene.roller]
    return checked_loads(loads, state.now)


def contacts_at(scene: Scene, state: WearState, loads: FloatArray) -> Contacts:
    """Return the contacts on the present profiles under `loads`, shape (S, C, N) [N].

    A step over many passes leaves them solved on the profile it leads to; where they carry these
    loads already there is nothing left to solve.
    """
    if scene.varying:
        return solve_present(scene, state, loads)
    line_load = contact_values(scene, state.contacts, "line_load")
    carried = line_load.sum(axis=-1) * scene.grid.spacing
    apart, most = np.abs(carried - loads).max(axis=(0, 1)), loads.max(axis=(0, 1))
    others = np.flatnonzero(apart > SAME_LOAD * most)
    if not others.size:
        return state.contacts
    if others.size == loads.shape[REALISATION]:
        return solve_present(scene, state, loads)
    chosen, part = scene_of(scene, others), state_of(state, others)
    found = solve_present(chosen, part, np.take(loads, others, axis=REALISATION))
    return state.batch.with_others(others, as_batch(found, chosen.shape))


def solve_present(scene: Scene, state: WearState, loads: FloatArray) -> Contacts:
    """Solve every contact on the present profiles under `loads`, shape (S, C, N) [N]."""
    scene = present_scene(scene, state)
    points = scene.points(loads, state.cylinder_depth, state.roller_depth)
    gap = scene.gap(state.cylinder_depth, state.roller_depth)
    return scene.model.solve_batch(
        gap, scene.kinematics.longitudinal_curvature, points, None, state.contacts or None
    )


def worn_state(
    scene: Scene,
    state: WearState,
    passes: Number,
    worn: tuple[FloatArray, FloatArray],
    power: FloatArray,
) -> WearState:
    """Return the state that a step leads to.

    Parameters
    ----------
    scene : Scene
    state : WearState
        Where the step began; its contacts stand in the state returned too.
    passes : float or ndarray, shape (realisations,)
        Length of the step.
    worn : tuple of ndarray
        Depth the step has worn off cylinder and rollers, shapes as in `WearState` [m].
    power : ndarray, shape (stations, contacts, realisations)
        Mean dissipated power of the step [W], of the same dissipation as the wear.
    """
    duration = one_of(scene.time(state.now + passes) - scene.time(state.now))
    terms = np.array(
        [
            term.advance(state.terms[number], scene.per_roller(power).mean(axis=0), duration)
            for number, term in enumerate(scene.terms.values())
        ]
    ).reshape(state.terms.shape)
    return state.moved(
        state.now + passes,
        cylinder_depth=state.cylinder_depth + worn[0],
        roller_depth=state.roller_depth + worn[1],
        terms=terms,
        energy=state.energy + scene.total_power(power) * (passes / scene.kinematics.pass_rate),
    )


def cylinder_depth_of(state: WearState) -> FloatArray:
    """Return the greatest worn depth of the cylinder, shape (realisations,) [m]."""
    greatest: FloatArray = depth(state.cylinder_depth).max(axis=(0, 1))
    return greatest


def cylinder_volume_of(scene: Scene, state: WearState) -> FloatArray:
    """Return the cylinder's worn volume, shape (realisations,) [m^3]; stations share it equally."""
    radius = scene.kinematics.cylinder_radius
    volume = worn_volume(state.cylinder_depth, scene.grid.spacing, radius)
    mean: FloatArray = volume.mean(axis=(0, 1))
    return mean
