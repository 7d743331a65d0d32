"""Per-pass stepper: every roller pass solved individually, the reference for other steppers."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.contact_inputs import Redraw
from wearsim.evolution.error_control.step_size import StepControl
from wearsim.evolution.operating_points import contact_batch
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Attempt, Step, Stepper
from wearsim.evolution.steppers.single_step import present_loads, solve_present
from wearsim.plugins import BODIES, PassLoop
from wearsim.types import ContactSolution, FloatArray, IntArray

CHUNK = 20_000  # passes between checks for records, progress and interruption
SLOW_CHUNK = 200  # the same where the loop is not compiled


class PerPassStepper(Stepper):
    """Stepper that applies every roller pass individually, in compiled code if possible.

    The rollers pass in turn. Identical rollers that are merged share their profile: each pass by
    one of them wears it by its share.

    Parameters
    ----------
    redraw : callable, optional
        Draws the inputs of single passes, see `Redraw`.
    expectation : WearProblem, optional
        The same problem with quadrature nodes instead of passes drawn one by one, for records.
    """

    pass_by_pass = True

    def __init__(
        self, redraw: Redraw | None = None, expectation: WearProblem | None = None
    ) -> None:
        super().__init__(StepControl(math.inf), forced_step=CHUNK)
        self._redraw, self._expectation = redraw, expectation

    def recorded(self, problem: WearProblem) -> WearProblem:
        """Return the problem with quadrature nodes where inputs are drawn at every pass."""
        return self._expectation or problem

    def proposed(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the number of passes between checks for records, progress and interruption."""
        return np.full(state.passes.shape, float(CHUNK if is_compiled(problem) else SLOW_CHUNK))

    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return the loop over single passes."""
        return partial(run_passes, redraw=self._redraw)

    def attempt(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Run the next passes, without an error estimate."""
        end = scheme(problem, state, step)
        if is_compiled(problem):
            # for output only: the compiled loop continues from its own memory
            end = end.replaced(contacts=solve_present(problem, end, present_loads(problem, end)))
        return Attempt((end,), np.zeros(step.shape))


def run_passes(
    problem: WearProblem, state: WearState, passes: FloatArray, redraw: Redraw | None = None
) -> WearState:
    """Run the next passes of all realisations, in compiled code if possible.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
        With the same number of passes done in all realisations.
    passes : ndarray, shape (realisations,)
        Number of passes, all equal; a part of a pass counts as one.
    redraw : callable, optional
        Draws the inputs of single passes, see `Redraw`.
    """
    count, loop = math.ceil(passes.max()), run_compiled if is_compiled(problem) else run_in_python
    end = loop(problem, state, count, redraw)
    return end.replaced(passes=state.passes + count, steps=state.steps + count)


def is_compiled(problem: WearProblem) -> bool:
    """Return whether the contact model has a compiled loop that covers the problem."""
    linear = all(problem.wear_factors[body] is not None for body in BODIES)
    lags = all(term.lag() is not None for term in problem.terms.values())
    prescribed = not problem.free and problem.shape[0] == 1
    return problem.model.capabilities.pass_loop and linear and lags and prescribed


def turn_order(problem: WearProblem) -> IntArray:
    """Return the roller of each pass of one turn, shape (physical rollers,)."""
    multiplicity = problem.kinematics.multiplicity.astype(np.int64)
    return np.repeat(np.arange(len(multiplicity), dtype=np.int64), multiplicity)


def _passes(
    problem: WearProblem, state: WearState, count: int, redraw: Redraw | None
) -> tuple[FloatArray, WearProblem]:
    """Return the load before feedback [N] of the next passes, and the problem of their contacts.

    The load and the processes of a pass are those at its middle.
    """
    first, order, kinematics = int(state.passes[0]), turn_order(problem), problem.kinematics
    rollers = order[(first + np.arange(count)) % len(order)]
    times = (state.passes[0] + np.arange(count, dtype=np.float64) + 0.5) / kinematics.pass_rate
    inputs = problem.inputs.at(rollers)
    for item in problem.varying:
        values = np.stack([path.at(times) for path in item.paths], axis=1)
        inputs = inputs.with_value_of(item, rollers, values)
    if redraw is not None:
        inputs = redraw(inputs, first)
    force = np.stack([load.force(times) for load in problem.loads], axis=1)
    passes = replace(problem, inputs=inputs, roller=rollers, weight=np.ones(count), varying=())
    return force + inputs.normal_force_offset, passes


def _term_rates(problem: WearProblem) -> FloatArray:
    """Return each term's gain [N/W] and, per roller, its relaxation per pass.

    The relaxation is the fraction of the distance to equilibrium covered in one pass.
    """
    kinematics = problem.kinematics
    own_pass = kinematics.physical_rollers / kinematics.multiplicity / kinematics.pass_rate
    lags = [term.lag() or (0.0, np.inf) for term in problem.terms.values()]
    rates = [[gain, *-np.expm1(-own_pass / time_constant)] for gain, time_constant in lags]
    return np.array(rates).reshape(len(lags), 1 + len(own_pass))


def _slip_base(
    problem: WearProblem, from_apex: FloatArray, realisation: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the fields `slip_base`, `spin_arm` and `slip_rates` of `PassLoop`."""
    kinematics, zeros = problem.kinematics, np.zeros_like(from_apex)
    if problem.slip_profile is None:
        return zeros, np.repeat(problem.grid.y[None], len(zeros), axis=0), np.zeros(2)
    rates = np.array([1.0 / kinematics.roller_radius, 1.0 / kinematics.cylinder_radius])
    arm = zeros if problem.tilt_shifts else from_apex
    return _of_realisation(problem, problem.slip_profile, realisation), arm, rates


def _of_realisation(problem: WearProblem, values: FloatArray, realisation: int) -> FloatArray:
    """Return an array of the rollers, (rollers, strips), in one realisation."""
    shape = (len(values), problem.shape[2], problem.grid.strips)
    return np.array(np.broadcast_to(values, shape)[:, realisation])


def run_compiled(
    problem: WearProblem, state: WearState, count: int, redraw: Redraw | None = None
) -> WearState:
    """Run `count` passes of every realisation in the model's compiled loop."""
    strips, carried = state.loop_strips, state.loop_contacts
    strips = np.zeros((3, *problem.shape, problem.grid.strips)) if strips is None else strips.copy()
    carried = np.zeros((3, *problem.shape)) if carried is None else carried.copy()
    cylinder, roller = state.cylinder_depth.copy(), state.roller_depth.copy()
    terms, energy = state.terms.copy(), state.energy.copy()
    full_solves = state.full_solves.copy()
    kinematics, speed = problem.kinematics, problem.kinematics.rolling_speed
    ratio = kinematics.cylinder_radius / kinematics.roller_radius
    force, passes = _passes(problem, state, count, redraw)
    inputs, lever = passes.inputs, 1.0 if problem.tilt_shifts else 0.0
    # every physical roller dissipates all the time, one pass per turn of the cylinder
    turn = kinematics.physical_rollers / kinematics.pass_rate
    for v, law in enumerate(problem.laws):
        per_power = [law.depth_per_dissipation(body, speed) or 0.0 for body in BODIES]
        wear = speed * np.array([per_power[0], *(per_power[1] * ratio / kinematics.multiplicity)])
        from_apex = _of_realisation(problem, problem.from_apex, v)
        slip_base, spin_arm, slip_rates = _slip_base(problem, from_apex, v)
        loop = PassLoop(
            order=turn_order(problem),
            first_pass=int(state.passes[0]),
            base_load=np.ascontiguousarray(force[:, v]),
            creepage=np.stack([inputs.longitudinal[:, v], inputs.yaw[:, v]], axis=1),
            friction=np.ascontiguousarray(inputs.friction[:, v]),
            tilt=lever * inputs.tilt[:, v],
            spin=np.ascontiguousarray(passes.spin[:, v]),
            stiffness=problem.loads[v].stiffness,
            nominal_gap=_of_realisation(problem, problem.flat_gap[0], v),
            from_apex=from_apex,
            longitudinal_curvature=np.full(problem.rollers, kinematics.longitudinal_curvature),
            rolling_speed=np.full(problem.rollers, speed),
            slip_base=slip_base,
            spin_arm=spin_arm,
            slip_rates=slip_rates,
            wear=wear,
            term_rates=_term_rates(problem),
            similar=redraw is None,
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
        full_solves[v] += problem.model.pass_loop(loop)
        terms[:, :, v] = loop.terms
        cylinder[0, 0, v], roller[0, :, v] = loop.cylinder_depth, loop.roller_depth
        strips[:, 0, :, v] = loop.line_load, loop.anchor, loop.anchor_gap
        carried[:, 0, :, v] = loop.approach, loop.anchor_approach, loop.energy
        energy[v] = float(loop.energy.sum()) * turn
    return state.replaced(
        cylinder_depth=cylinder,
        roller_depth=roller,
        terms=terms,
        energy=energy,
        full_solves=full_solves,
        solves=state.solves + count,
        loop_strips=strips,
        loop_contacts=carried,
    )


def run_in_python(
    problem: WearProblem, state: WearState, count: int, redraw: Redraw | None = None
) -> WearState:
    """Run `count` passes by solving every one in full: slow, but for any plugin."""
    kinematics, speed = problem.kinematics, problem.kinematics.rolling_speed
    force, passes = _passes(problem, state, count, redraw)
    cylinder, roller = state.cylinder_depth.copy(), state.roller_depth.copy()
    terms, energy = state.terms.copy(), state.energy.copy()
    contacts: dict[tuple[int, ...], ContactSolution] = dict(
        zip(problem.contacts, state.contacts, strict=True)
    )
    turn = kinematics.physical_rollers / kinematics.pass_rate
    for number, r in enumerate(passes.roller):
        one = passes.with_contacts(np.array([number]))
        multiplicity = float(kinematics.multiplicity[r])
        ratio = kinematics.cylinder_radius / kinematics.roller_radius
        ratio /= multiplicity * problem.shape[0]
        for s, _, v in np.ndindex((problem.shape[0], 1, problem.shape[2])):
            unworn = one.nominal_gap[s, 0, v]
            gap = unworn + cylinder[s, 0, v] + roller[0, r, v]
            load = float(force[number, v]) + float(terms[:, r, v].sum())
            load -= problem.loads[v].stiffness * float(gap.min() - unworn.min())
            loads = np.full(one.shape, load)
            batch = contact_batch(one, one.nominal_gap, loads, cylinder, roller)
            point = batch.point(s * problem.shape[2] + v)
            contacts[s, r, v] = contact = problem.model.solve_one(
                gap, kinematics.longitudinal_curvature, point, None, contacts[s, r, v]
            )
            cylinder[s, 0, v] += problem.laws[v].depth_per_pass("cylinder", contact, speed)
            roller[0, r, v] += ratio * problem.laws[v].depth_per_pass("roller", contact, speed)
            energy[v] += contact.power * turn / problem.shape[0]
            power = np.array([contact.power])
            for t, term in enumerate(problem.terms.values()):
                value = terms[t, r : r + 1, v]
                terms[t, r, v] = term.advance(value, power, turn / multiplicity)[0]
    solves = count * problem.shape[0]
    return state.replaced(
        cylinder_depth=cylinder,
        roller_depth=roller,
        terms=terms,
        energy=energy,
        contacts=ContactBatchSolution.of([contacts[index] for index in problem.contacts]),
        full_solves=state.full_solves + solves,
        solves=state.solves + solves,
    )
