"""Per-pass stepper: every roller pass solved individually, the reference for other steppers."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.errors import StepError
from wearsim.evolution.contacts import contact_batch, with_contacts
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import Redraw
from wearsim.evolution.state import HERTZ, WearState, joined_states
from wearsim.evolution.steppers.base import Attempt, Step, Stepper
from wearsim.evolution.steppers.loads import APPROACH_EXPONENT
from wearsim.evolution.steppers.single_step import MAX_LOAD_ITERATIONS, solve_at_record
from wearsim.evolution.strips import on_grid
from wearsim.plugins import BODIES, PassLoop
from wearsim.types import ContactSolution, FloatArray, IntArray, OperatingPoint

CHUNK = 20_000  # passes between checks for records, progress and interruption
DAMAGE_PART = 0.02  # passes between checks over those done, where damage is computed
SLOW_CHUNK = 200  # the same where the loop is not compiled
LOAD_TOLERANCE = 1e-6  # relative change of the load of a spring by the approach it causes


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
        super().__init__(math.inf, forced_step=CHUNK)
        self._redraw, self._expectation = redraw, expectation

    def recorded(self, problem: WearProblem) -> WearProblem:
        """Return the problem with quadrature nodes where inputs are drawn at every pass."""
        nodes = self._expectation
        if nodes is None:
            return problem
        if nodes.grid is not problem.grid:  # the strips have grown
            nodes = self._expectation = on_grid(nodes, problem.grid)
        return nodes

    def proposed(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the number of passes between checks for records, progress and interruption.

        Damage by fatigue is integrated from one check to the next, a small part of the passes done.
        """
        most = float(CHUNK if is_compiled(problem) else SLOW_CHUNK)
        if problem.fatigue:
            return np.clip(np.floor(DAMAGE_PART * state.passes), 1.0, most)
        return np.full(state.passes.shape, most)

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
            contacts, _ = solve_at_record(problem, end, on_profile=False)
            end = end.replaced(contacts=contacts)
        return Attempt((end,), np.zeros(step.shape), np.ones(step.shape))


def run_passes(
    problem: WearProblem, state: WearState, passes: FloatArray, redraw: Redraw | None = None
) -> WearState:
    """Run the next passes of each realisation, in compiled code if possible.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    passes : ndarray, shape (realisations,)
        Number of passes; a part of a pass counts as one.
    redraw : callable, optional
        Draws the inputs of single passes, see `Redraw`.
    """
    loop = run_compiled if is_compiled(problem) else run_in_python
    tests = zip(np.arange(passes.size)[:, None], np.ceil(passes).tolist(), strict=True)
    return joined_states(
        [loop(problem.at(test), state.at(test), int(count), redraw) for test, count in tests]
    )


def is_compiled(problem: WearProblem) -> bool:
    """Return whether the contact model has a compiled loop that covers the problem."""
    linear = all(problem.wear_factors[body] is not None for body in BODIES)
    lags = all(term.lag() is not None for term in problem.terms.values())
    prescribed = not problem.free and problem.kinematics.track.in_pass_loop
    return problem.model.capabilities.pass_loop and linear and lags and prescribed


def turn_order(problem: WearProblem) -> IntArray:
    """Return the roller of each pass of one turn, shape (physical rollers,)."""
    multiplicity = problem.kinematics.multiplicity.astype(np.int64)
    return np.repeat(np.arange(len(multiplicity), dtype=np.int64), multiplicity)


def _passes(
    problem: WearProblem, state: WearState, count: int, redraw: Redraw | None
) -> tuple[FloatArray, WearProblem]:
    """Return the load before feedback of the next passes, and the problem of their contacts.

    The load has the shape (passes, stations) [N]. It and the processes are those at the middle of
    a pass.
    """
    first, order, kinematics = int(state.passes[0]), turn_order(problem), problem.kinematics
    rollers = order[(first + np.arange(count)) % len(order)]
    times = (state.passes[0] + np.arange(count, dtype=np.float64) + 0.5) / kinematics.pass_rate
    inputs = problem.inputs.at(rollers)
    for item in problem.varying:
        chosen, values = np.isin(rollers, item.rollers), item.paths.of_first(times)
        before = getattr(inputs, item.name)
        inputs = inputs.with_values({item.name: np.where(chosen[:, None], values[:, None], before)})
    if redraw is not None:
        inputs = redraw(inputs, first)
    force = problem.at_stations(problem.loads[0].force(times)).reshape(-1, count).T
    passes = replace(problem, inputs=inputs, roller=rollers, weight=np.ones(count), varying=())
    return force + inputs.normal_force_offset, passes


def _fresh_approaches(state: WearState, force: FloatArray, passes: WearProblem) -> FloatArray:
    """Return the elastic approach of unworn bodies in each pass, shape (stations, passes) [m]."""
    if state.approach_factor is None:
        return np.zeros((passes.shape[0], len(force)))
    return np.asarray(
        state.approach_factor[:, passes.roller, 0] * np.maximum(force.T, 0.0) ** HERTZ
    )


def _term_rates(problem: WearProblem) -> FloatArray:
    """Return each term's gain [N/W] and, per roller, its relaxation per pass.

    The relaxation is the fraction of the distance to equilibrium covered in one pass.
    """
    kinematics = problem.kinematics
    own_pass = kinematics.physical_rollers / kinematics.multiplicity / kinematics.pass_rate
    lags = [term.lag() or (0.0, np.inf) for term in problem.terms.values()]
    return np.array(
        [[gain, *-np.expm1(-own_pass / time_constant)] for gain, time_constant in lags]
    ).reshape(len(lags), 1 + len(own_pass))


def _slip_base(problem: WearProblem) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the fields `slip_base`, `spin_arm` and `slip_rates` of `PassLoop`."""
    kinematics, from_apex = problem.kinematics, np.array(problem.from_apex[:, 0])
    zeros = np.zeros_like(from_apex)
    if problem.slip_profile is None:
        return zeros, np.repeat(problem.grid.y[None], len(zeros), axis=0), np.zeros(2)
    return (
        np.array(problem.slip_profile[0, :, 0]),
        zeros if problem.tilt_shifts else from_apex,
        np.array([1.0 / kinematics.roller_radius, 1.0 / kinematics.cylinder_radius]),
    )


def run_compiled(
    problem: WearProblem, state: WearState, count: int, redraw: Redraw | None = None
) -> WearState:
    """Run `count` passes of a single realisation in the model's compiled loop."""
    rollers, strips = problem.rollers, problem.grid.strips
    # the loop changes these arrays in place, by views without the axes of length one
    loop_strips = _copied(state.loop_strips, (3, *problem.shape, strips))
    loop_contacts = _copied(state.loop_contacts, (3, *problem.shape))
    new = state.replaced(
        cylinder_depth=state.cylinder_depth.copy(),
        roller_depth=state.roller_depth.copy(),
        terms=state.terms.copy(),
        loop_strips=loop_strips,
        loop_contacts=loop_contacts,
    )
    line_load, anchor, anchor_gap = loop_strips.reshape(3, rollers, strips)
    approach, anchor_approach, energy = loop_contacts.reshape(3, rollers)
    slip_base, spin_arm, slip_rates = _slip_base(problem)
    kinematics, speed = problem.kinematics, problem.kinematics.rolling_speed
    (load,), (law,) = problem.loads, problem.laws
    per_power = [law.depth_per_dissipation(body, speed) or 0.0 for body in BODIES]
    ratio = kinematics.cylinder_radius / kinematics.roller_radius
    force, passes = _passes(problem, state, count, redraw)
    inputs, fresh = passes.inputs, _fresh_approaches(state, force, passes)
    if state.loop_contacts is None and state.approach_factor is not None:
        first = fresh.max() * state.approach_factor[0, :, 0] / state.approach_factor.max()
        approach[:] = first + problem.nominal_gap.min(axis=-1)[0, :, 0]
    loop = PassLoop(
        order=turn_order(problem),
        first_pass=int(state.passes[0]),
        base_load=force.ravel(),
        creepage=np.concatenate([inputs.longitudinal, inputs.yaw], axis=1),
        friction=inputs.friction.ravel(),
        tilt=inputs.tilt.ravel() * (1.0 if problem.tilt_shifts else 0.0),
        spin=passes.spin.ravel(),
        stiffness=load.stiffness,
        fresh_approach=fresh[0],
        nominal_gap=np.array(problem.flat_gap[0, :, 0]),
        from_apex=np.array(problem.from_apex[:, 0]),
        longitudinal_curvature=np.full(rollers, kinematics.track.longitudinal_curvature),
        rolling_speed=np.full(rollers, speed),
        slip_base=slip_base,
        spin_arm=spin_arm,
        slip_rates=slip_rates,
        wear=speed * np.array([per_power[0], *(per_power[1] * ratio / kinematics.multiplicity)]),
        term_rates=_term_rates(problem),
        similar=redraw is None,
        terms=new.terms.reshape(-1, rollers),
        cylinder_depth=new.cylinder_depth.reshape(strips),
        roller_depth=new.roller_depth.reshape(rollers, strips),
        line_load=line_load,
        anchor=anchor,
        anchor_gap=anchor_gap,
        approach=approach,
        anchor_approach=anchor_approach,
        energy=energy,
        rests=bool(problem.pauses),
    )
    full_solves = problem.model.pass_loop(loop)
    # every physical roller dissipates all the time, one pass per turn of the cylinder
    turn = kinematics.physical_rollers / kinematics.pass_rate
    return new.replaced(
        passes=state.passes + count,
        energy=np.array([float(energy.sum()) * turn]),
        steps=state.steps + count,
        full_solves=state.full_solves + full_solves,
        solves=state.solves + count,
    )


def _copied(array: FloatArray | None, shape: tuple[int, ...]) -> FloatArray:
    return np.zeros(shape) if array is None else array.copy()


def run_in_python(
    problem: WearProblem, state: WearState, count: int, redraw: Redraw | None = None
) -> WearState:
    """Run `count` passes of a single realisation by full solves: slow, but for any plugin."""
    kinematics = problem.kinematics
    force, passes = _passes(problem, state, count, redraw)
    fresh = _fresh_approaches(state, force, passes)
    cylinder, roller = state.cylinder_depth.copy(), state.roller_depth.copy()
    terms, energy = state.terms.copy(), state.energy.copy()
    contacts, stations = list(state.contacts), problem.shape[0]
    (law,) = problem.laws
    turn = kinematics.physical_rollers / kinematics.pass_rate
    for number, r in enumerate(passes.roller):
        single = with_contacts(passes, np.array([number]))
        multiplicity = float(kinematics.multiplicity[r])
        for s in range(stations):
            speed, part, radius = kinematics.track.station(s)
            ratio = radius / kinematics.roller_radius / multiplicity
            unworn = single.nominal_gap[s, 0, 0]
            gap = unworn + cylinder[s, 0, 0] + roller[0, r, 0]
            free = float(force[number, s]) + float(terms[:, r, 0].sum())
            zero = float(unworn.min() + fresh[s, number])
            stiffness = float(np.reshape(problem.stiffness, (-1, 1))[s, 0])
            most = free - stiffness * (float(gap.min()) - zero)
            if problem.pauses and min(most, float(force[number, s])) <= 0.0:
                for t, term in enumerate(problem.terms.values()):
                    terms[t, r] = term.advance(terms[t, r], np.zeros(1), turn / multiplicity)
                continue
            place = s * problem.rollers + r
            batch = contact_batch(
                single, single.nominal_gap, np.zeros(single.shape), cylinder, roller
            )
            curvature = float(batch.longitudinal_curvature[s])
            spring = stiffness, free, zero
            contact = _solve_pass(problem, gap, curvature, batch.point(s), spring, contacts[place])
            contacts[place] = contact
            cylinder[s, 0, 0] += law.depth_per_pass("cylinder", contact, speed)
            roller[0, r, 0] += ratio * law.depth_per_pass("roller", contact, speed)
            energy += contact.power * turn * part
            power = np.array([contact.power])
            for t, term in enumerate(problem.terms.values()):
                terms[t, r] = term.advance(terms[t, r], power, turn / multiplicity)
    return state.replaced(
        passes=state.passes + count,
        cylinder_depth=cylinder,
        roller_depth=roller,
        terms=terms,
        energy=energy,
        contacts=ContactBatchSolution.of(contacts),
        steps=state.steps + count,
        full_solves=state.full_solves + count * stations,
        solves=state.solves + count * stations,
    )


def _solve_pass(
    problem: WearProblem,
    gap: FloatArray,
    curvature: float,
    point: OperatingPoint,
    spring: tuple[float, float, float],
    warm: ContactSolution,
) -> ContactSolution:
    """Solve the contact of one pass together with the load of a spring.

    Parameters
    ----------
    problem : WearProblem
    gap : ndarray, shape (strips,)
        Present gap [m].
    curvature : float
        Relative curvature along rolling [1/m].
    point : OperatingPoint
        Operating point, except for its load.
    spring : tuple of float
        Stiffness [N/m], load without displacement of the roller [N], and the approach there [m].
    warm : ContactSolution
        Solution of the roller's previous pass.

    Raises
    ------
    StepError
        If the load is not positive, or does not converge.
    """
    (stiffness, free, zero), lowest, solution = spring, float(gap.min()), warm
    most = free - stiffness * (lowest - zero)  # without elastic approach
    if not most > 0.0:
        raise StepError(
            f"contact is lost: the load of a pass has fallen to {most:.4g} N", cause="lost"
        )
    load = free - stiffness * (warm.approach - zero)
    load = load if load > 0.0 else 0.1 * most
    for _ in range(MAX_LOAD_ITERATIONS):
        solution = problem.model.solve_one(
            gap, curvature, replace(point, normal_force=load), None, solution
        )
        if not stiffness:
            return solution
        change = free - stiffness * (solution.approach - zero) - load
        if abs(change) <= LOAD_TOLERANCE * load:
            return solution
        slope = APPROACH_EXPONENT * (solution.approach - lowest) / load
        load = max(load + change / (1.0 + stiffness * slope), 0.1 * load)
    raise StepError("the load of a spring and its contact did not converge in a pass")
