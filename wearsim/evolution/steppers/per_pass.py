"""The per-pass stepper: every roller pass by itself, the truth the others are measured against."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from wearsim.evolution.problem import Scene
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Advance, Stepper
from wearsim.evolution.steppers.single_step import present_loads, solve_present
from wearsim.plugins import PassLoop
from wearsim.types import ContactSolution, FloatArray, IntArray

CHUNK = 20_000  # passes between looks at the clock, the user and the records
SLOW_CHUNK = 200  # the same where the loop is not compiled


class PerPassStepper(Stepper):
    """Applies every roller pass by itself, in compiled code where the scene allows it.

    The rollers take turns. Alike rollers that are merged share their profile: each pass by one of
    them wears it by its share.
    """

    pass_by_pass = True

    def side_step(self, scene: Scene, state: WearState, passes: float) -> WearState:
        """Return the state `passes` whole passes later."""
        return _run(scene, state, math.ceil(passes))

    def advance(self, scene: Scene, state: WearState, stop: float) -> Advance:
        """Run the next passes, up to `stop`."""
        chunk = CHUNK if is_compiled(scene) else SLOW_CHUNK
        end = _run(scene, state, min(math.ceil(stop - state.passes), chunk))
        if is_compiled(scene):
            # for the eye only: the compiled loop goes on from what it carries itself
            end = replace(end, contacts=solve_present(scene, end, present_loads(scene, end)))
        return Advance(path=(state, end))


def _run(scene: Scene, state: WearState, count: int) -> WearState:
    """Run `count` passes, in compiled code where the scene allows it."""
    end = (_run_compiled if is_compiled(scene) else _run_in_python)(scene, state, count)
    return replace(end, passes=state.passes + count, steps=state.steps + count)


def is_compiled(scene: Scene) -> bool:
    """Tell whether the model's compiled loop covers all that the scene asks for."""
    linear = all(
        scene.law.depth_per_dissipation(body, scene.kinematics.rolling_speed) is not None
        for body in ("cylinder", "roller")
    )
    lags = all(term.lag() is not None for term in scene.terms.values())
    prescribed = not scene.free and scene.shape[0] == 1
    return scene.model.capabilities.pass_loop and linear and lags and prescribed


def turn_order(scene: Scene) -> IntArray:
    """Return which roller of the scene makes each pass of one turn, shape (physical rollers,)."""
    multiplicity = scene.kinematics.multiplicity.astype(np.int64)
    return np.repeat(np.arange(len(multiplicity), dtype=np.int64), multiplicity)


def _passes(scene: Scene, state: WearState, count: int) -> tuple[IntArray, FloatArray, Scene]:
    """Return roller, load before feedback [N] and the scene of each of the next passes.

    A pass sees the load and the processes of its middle.
    """
    first, order = int(state.passes), turn_order(scene)
    rollers = order[(first + np.arange(count)) % len(order)]
    passes_done = state.passes + np.arange(count, dtype=np.float64)
    times = (passes_done + 0.5) / scene.kinematics.pass_rate
    passes = scene.single_passes(rollers, first, times)
    force = scene.load.force(times)[:, None] + passes.inputs.normal_force
    return rollers, force, passes


def _term_rates(scene: Scene) -> FloatArray:
    """Return each term's gain and, per roller, the part of the way to rest that a pass goes."""
    kinematics = scene.kinematics
    own_pass = kinematics.physical_rollers / kinematics.multiplicity / kinematics.pass_rate
    rates = np.zeros((len(scene.terms), 1 + len(own_pass)))
    for number, term in enumerate(scene.terms.values()):
        gain, time_constant = term.lag() or (0.0, np.inf)
        rates[number] = [gain, *-np.expm1(-own_pass / time_constant)]
    return rates


def _slip_base(scene: Scene) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the variation of creepage on unworn bodies, its fall per spin, and per worn depth."""
    kinematics, nothing = scene.kinematics, np.zeros_like(scene.from_apex)
    if scene.slip_profile is None:
        return nothing, np.repeat(scene.grid.y[None], len(nothing), axis=0), np.zeros(2)
    rates = np.array([1.0 / kinematics.roller_radius, 1.0 / kinematics.cylinder_radius])
    arm = nothing if scene.tilt_shifts else np.ascontiguousarray(scene.from_apex)
    return np.ascontiguousarray(scene.slip_profile), arm, rates


def _wear_rates(scene: Scene) -> FloatArray:
    """Return depth per pass and dissipation over V: the cylinder's, then each roller's."""
    kinematics = scene.kinematics
    speed = kinematics.rolling_speed
    cylinder = scene.law.depth_per_dissipation("cylinder", speed) or 0.0
    roller = scene.law.depth_per_dissipation("roller", speed) or 0.0
    ratio = kinematics.cylinder_radius / kinematics.roller_radius
    return speed * np.array([cylinder, *(roller * ratio / kinematics.multiplicity)])


def _run_compiled(scene: Scene, state: WearState, count: int) -> WearState:
    """Run `count` passes of every realisation in the model's compiled loop."""
    shape = (*scene.shape, scene.grid.strips)
    strips = state.loop_strips.copy() if state.loop_strips is not None else np.zeros((3, *shape))
    carried = np.zeros((3, *scene.shape))
    if state.loop_contacts is not None:
        carried = state.loop_contacts.copy()
    cylinder, roller = state.cylinder_depth.copy(), state.roller_depth.copy()
    terms, energy = state.terms.copy(), state.energy.copy()
    full_solves = state.full_solves
    slip_base, spin_arm, slip_rates = _slip_base(scene)
    _, force, passes = _passes(scene, state, count)
    inputs, lever = passes.inputs, 1.0 if scene.tilt_shifts else 0.0
    for v in range(scene.shape[2]):
        loop = PassLoop(
            order=turn_order(scene),
            first_pass=int(state.passes),
            base_load=np.ascontiguousarray(force[:, v]),
            creepage=np.stack([inputs.longitudinal[:, v], inputs.yaw[:, v]], axis=1),
            friction=np.ascontiguousarray(inputs.friction[:, v]),
            tilt=lever * inputs.tilt[:, v],
            spin=np.ascontiguousarray(passes.spin[:, v]),
            stiffness=scene.load.stiffness,
            nominal_gap=np.ascontiguousarray(scene.flat_gap[0, :, v]),
            from_apex=np.ascontiguousarray(scene.from_apex),
            longitudinal_curvature=scene.kinematics.longitudinal_curvature,
            rolling_speed=scene.kinematics.rolling_speed,
            slip_base=slip_base,
            spin_arm=spin_arm,
            slip_rates=slip_rates,
            wear=_wear_rates(scene),
            term_rates=_term_rates(scene),
            similar=scene.redraw is None,
            terms=np.ascontiguousarray(terms[:, :, v]),
            cylinder_depth=np.ascontiguousarray(cylinder[0, 0, v]),
            roller_depth=np.ascontiguousarray(roller[0, :, v]),
            line_load=np.ascontiguousarray(strips[0, 0, :, v]),
            anchor=np.ascontiguousarray(strips[1, 0, :, v]),
            anchor_gap=np.ascontiguousarray(strips[2, 0, :, v]),
            approach=np.ascontiguousarray(carried[0, 0, :, v]),
            anchor_approach=np.ascontiguousarray(carried[1, 0, :, v]),
            energy=np.ascontiguousarray(carried[2, 0, :, v]),
        )
        full_solves += scene.model.pass_loop(loop)
        terms[:, :, v] = loop.terms
        cylinder[0, 0, v], roller[0, :, v] = loop.cylinder_depth, loop.roller_depth
        strips[:, 0, :, v] = loop.line_load, loop.anchor, loop.anchor_gap
        carried[:, 0, :, v] = loop.approach, loop.anchor_approach, loop.energy
        # every physical roller dissipates all the time, one pass per turn of the cylinder
        turn = scene.kinematics.physical_rollers / scene.kinematics.pass_rate
        energy[v] = float(loop.energy.sum()) * turn
    return replace(
        state,
        cylinder_depth=cylinder,
        roller_depth=roller,
        terms=terms,
        energy=energy,
        full_solves=full_solves,
        solves=state.solves + count * scene.shape[2],
        loop_strips=strips,
        loop_contacts=carried,
    )


def _run_in_python(scene: Scene, state: WearState, count: int) -> WearState:
    """Run `count` passes by solving every one in full: slow, and right for any plugin."""
    kinematics = scene.kinematics
    rollers, force, passes = _passes(scene, state, count)
    cylinder, roller = state.cylinder_depth.copy(), state.roller_depth.copy()
    terms, energy = state.terms.copy(), state.energy.copy()
    contacts: dict[tuple[int, ...], ContactSolution] = dict(
        zip(scene.contacts, state.contacts, strict=True)
    )
    turn = kinematics.physical_rollers / kinematics.pass_rate
    for number, r in enumerate(rollers):
        own_pass = turn / float(kinematics.multiplicity[r])
        for s, _, v in np.ndindex((scene.shape[0], 1, scene.shape[2])):
            unworn = passes.nominal_gap[s, number, v]
            gap = unworn + cylinder[s, 0, v] + roller[0, r, v]
            load = float(force[number, v]) + float(terms[:, r, v].sum())
            load -= scene.load.stiffness * float(gap.min() - unworn.min())
            point = passes.point(number, v, load, cylinder[s, 0, v], roller[0, r, v])
            contact = scene.model.solve(
                gap, kinematics.longitudinal_curvature, point, None, contacts[s, r, v]
            )
            contacts[s, r, v] = contact
            speed = kinematics.rolling_speed
            ratio = kinematics.cylinder_radius / kinematics.roller_radius
            ratio /= float(kinematics.multiplicity[r]) * scene.shape[0]
            cylinder[s, 0, v] += scene.law.depth_per_pass("cylinder", contact, speed)
            roller[0, r, v] += ratio * scene.law.depth_per_pass("roller", contact, speed)
            energy[v] += contact.power * turn / scene.shape[0]
            power = np.array([contact.power])
            for t, term in enumerate(scene.terms.values()):
                terms[t, r, v] = term.advance(terms[t, r : r + 1, v], power, own_pass)[0]
    return replace(
        state,
        cylinder_depth=cylinder,
        roller_depth=roller,
        terms=terms,
        energy=energy,
        contacts=tuple(contacts[index] for index in scene.contacts),
        full_solves=state.full_solves + count * scene.shape[2] * scene.shape[0],
        solves=state.solves + count * scene.shape[2] * scene.shape[0],
    )
