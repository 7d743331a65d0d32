"""Single passes of rollers against plain loops over the strips of an elastic foundation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.evolution import built, stepped
from tests.evolution.black_box import BlackBox, boxed, foundation_model
from tests.evolution.test_fatigue import fatigue
from tests.evolution.test_single_steps import FRICTION, LOAD, RADII, SLIP, solved
from wearsim.errors import StepError
from wearsim.evolution.contacts import fresh_state, unworn_contacts
from wearsim.evolution.quantities import Varying
from wearsim.evolution.steppers.per_pass import (
    CHUNK,
    DAMAGE_PART,
    LOAD_TOLERANCE,
    SLOW_CHUNK,
    PerPassStepper,
    is_compiled,
    run_compiled,
    run_in_python,
    run_passes,
)
from wearsim.mechanics.numerics.piecewise_linear import Paths

STATE = "cylinder_depth", "roller_depth", "terms", "energy"
TURN = 60.0 / 1000.0  # s
# a small load; a pause with a load term, a negative offset, and a roller lifted by its spring
STOPPED = [(0.0, 300.0), (0.06, 310.0), (0.065, 0.0)]
DIP = [(0.02, 310.0), (0.03, 0.05), (0.04, 310.0)]
LIFTED = [STOPPED[0], *DIP, *STOPPED[1:], (0.12, 0.0), (0.14, 40.4), (0.145, 310.0)]
OFFSETS = ["0 mm", "-1 mm", "0.5 mm"]
CASES = {  # the last two springs are as stiff as the contact, or stiffer
    "three": (OFFSETS, [-20.0, 0.0, 0.0], 1.4e5, 4e-7, LIFTED),
    "light": (["0 mm"] * 3, [0.0], 1.7e6, 1.6e-7, [(0.0, 0.05), (0.2, 0.055)]),
    "merged": (["0 mm"] * 3, [-20.0], 5e8, 1.1e-9, [*STOPPED, (0.12, 0.0), (0.125, 310.0)]),
}


def loads_of(samples, stiffness, tmp_path):
    """Return the options of a log with a spring and a load term."""
    log = tmp_path / "log.csv"
    rows = (f"{time}, {load}\n" for time, load in [*samples, (10.0, samples[-1][1])])
    log.write_text("time [s], load [N]\n" + "".join(rows))
    term = {"gain": "500 N/W", "time_constant": "2 s"}
    spring = f"{stiffness / 1e3} N/mm"
    return {"kind": "recorded", "file": str(log), "stiffness": spring, "thermal": term}


def slipping(inputs, first):
    """Return inputs with a creepage that rises from pass to pass."""
    numbers = first + np.arange(len(inputs.longitudinal))
    return replace(inputs, longitudinal=inputs.longitudinal * (1.0 + 0.1 * numbers[:, None]))


@pytest.mark.parametrize("case", list(CASES))
def test_passes_equal_a_plain_loop(case, tmp_path):
    offsets, rises, stiffness, factor, samples = CASES[case]
    problem, _, _ = boxed(
        foundation=True,
        contact__strips=41,
        operation__passes=450,
        roller__offset=offsets,
        wear__cylinder__k_over_h=f"{factor} 1/Pa",
        wear__roller__k_over_h=f"{2.0 * factor} 1/Pa",
        load=loads_of(samples, stiffness, tmp_path),
    )
    bodies, spacing = problem.rollers, problem.grid.spacing
    # of unworn bodies under the first load, or the greatest one of a test with pauses
    offset, known = np.array(rises), 310.0 if problem.pauses else samples[0][1]
    rising = Paths.through(np.array([0.0, 2.0]), np.array([0.01, 0.21]))
    problem = replace(
        problem,
        inputs=problem.inputs.with_values({"normal_force_offset": offset[:, None]}),
        varying=(Varying("friction", (0,), rising),),
    )
    state = fresh_state(problem)
    found = run_in_python(problem, run_in_python(problem, state, 4, slipping), 5, slipping)
    gaps = problem.nominal_gap[0, :, 0]
    fresh = [solved(gaps[r], known + offset[r], spacing)[1] - gaps[r].min() for r in range(bodies)]
    cylinder, rollers, terms, energy = np.zeros(41), np.zeros((bodies, 41)), np.zeros(bodies), 0.0
    line_loads, rested = np.zeros((bodies, 41)), 0
    for number in range(9):
        r, shared, time = number % bodies, 3 / bodies, (number + 0.5) * TURN / 3.0
        force = np.interp(time, *np.transpose(samples)) + offset[r]
        friction = FRICTION if r else 0.01 + 0.1 * time
        loss = friction * SLIP * (1.0 + 0.1 * number)  # energy per line load and length
        gap, free = gaps[r] + cylinder + rollers[r], force + terms[r]
        zero = gaps[r].min() + fresh[r] * max(force / (known + offset[r]), 0.0) ** (2.0 / 3.0)

        def excess(load, gap=gap, free=free, zero=zero):
            return free - stiffness * (solved(gap, load, spacing)[1] - zero) - load

        power, rests = 0.0, min(free - stiffness * (gap.min() - zero), force) <= 0.0
        rested += rests
        if not rests:
            q = solved(gap, brentq(excess, 1e-6, 2.0 * LOAD, xtol=1e-9, rtol=1e-12), spacing)[0]
            cylinder += factor * loss * q
            rollers[r] += 2.0 * factor * loss * q * RADII[0] / RADII[1] / shared
            power = loss * q.sum() * spacing * 2.0 * math.pi * RADII[0] / TURN
            energy += power * TURN
            line_loads[r] = q
        terms[r] += (500.0 * power - terms[r]) * -math.expm1(-TURN / shared / 2.0)
    assert found.passes[0] == found.steps == 9
    assert found.solves - state.solves == found.full_solves - state.full_solves == 9
    assert rested == {"three": 4, "light": 0, "merged": 3}[case]
    lines = found.contacts.line_load
    columns = (found.cylinder_depth, cylinder), (found.roller_depth, rollers), (lines, line_loads)
    for one, exact in columns:
        np.testing.assert_allclose(
            np.squeeze(one), np.squeeze(exact), rtol=1e-5, atol=1e-6 * exact.max()
        )
    np.testing.assert_allclose(found.terms[0, :, 0], terms, rtol=1e-5)
    assert found.energy[0] == pytest.approx(energy, rel=1e-6, abs=0.0)


@pytest.mark.parametrize("spring", [0, 200])
def test_passes_along_a_cam_equal_a_plain_loop(spring):
    factor = 4e-7
    problem, _, _ = built(
        "cam-cycloidal",
        creepage={"longitudinal": SLIP},
        contact__strips=41,
        load__stiffness=f"{spring} N/mm",
        wear__cylinder__k_over_h=f"{factor} 1/Pa",
        wear__roller__k_over_h=f"{2.0 * factor} 1/Pa",
        cam__motion=[
            {"law": "cycloidal", "angle": "180 deg", "rise": f"{rise} mm"} for rise in (8, -8)
        ],
    )
    problem = replace(problem, model=BlackBox(foundation_model(problem.grid)))
    assert not is_compiled(problem)
    state, stations, spacing = fresh_state(problem), problem.shape[0], problem.grid.spacing
    found = run_in_python(problem, run_in_python(problem, state, 1), 2)
    cam, gap = problem.kinematics.track, problem.nominal_gap[0, 0, 0]
    columns = "longitudinal_curvature", "rolling_speed", "length", "time_share", "stiffness"
    curvature, speed, length, share, stiffness = (getattr(cam, n)[:, 0, 0] for n in columns)
    force = problem.force(np.zeros(1))[:, 0, 0]
    zeros = [
        solved(gap, *one)[1] for one in zip(force, [spacing] * stations, curvature, strict=True)
    ]
    cylinder, roller, energy = np.zeros((stations, 41)), np.zeros(41), 0.0
    lines = np.zeros((stations, 41))
    for _ in range(3):
        for s in range(stations):
            worn = gap + cylinder[s] + roller

            def excess(load, worn=worn, s=s):
                approach = solved(worn, load, spacing, curvature[s])[1]
                return force[s] - stiffness[s] * (approach - zeros[s]) - load

            load = brentq(excess, 1e-3, 2.0 * force.max(), xtol=1e-9, rtol=1e-12)
            lines[s] = solved(worn, load, spacing, curvature[s])[0]
            loss = FRICTION * SLIP * lines[s]
            cylinder[s] += factor * loss
            roller += 2.0 * factor * loss * length[s] / (2.0 * math.pi * RADII[1])
            energy += loss.sum() * spacing * speed[s] * TURN * share[s]
    assert found.passes[0] == found.steps == 3
    assert found.solves - state.solves == found.full_solves - state.full_solves == 3 * stations
    exact = (found.cylinder_depth, cylinder), (found.roller_depth, roller)
    for one, other in (*exact, (found.contacts.line_load, lines)):
        np.testing.assert_allclose(np.squeeze(one), other, rtol=1e-5, atol=1e-6 * other.max())
    assert found.energy[0] == pytest.approx(energy, rel=1e-6, abs=0.0)


TILT = {"creepage__tilt": ["1 mrad", "1 mrad", "-2 mrad"]}
DIFFERENTIAL = {"creepage__differential_slip": True}


@pytest.mark.parametrize(
    "changes",
    [
        TILT,
        {**DIFFERENTIAL, "roller__offset": ["0 mm"] * 3},
        {**DIFFERENTIAL, **TILT},
        {**DIFFERENTIAL, **TILT, "creepage__tilt_shifts_contact": False},
        {**TILT, "creepage__tilt_shifts_contact": False},
    ],
    ids=["tilt", "slip", "slip and tilt", "slip and spin", "spin"],
)
def test_compiled_passes_equal_python_ones(changes):
    common = {"roller__offset": ["0 mm", "0 mm", "1 mm"], "contact__strips": 41}
    problem, _, _ = built(
        load__kind="spring",
        load__stiffness="690 N/mm",
        wear__cylinder__k_over_h="1e-9 1/Pa",
        wear__roller__k_over_h="5e-10 1/Pa",
        load__thermal={"gain": "50 N/W", "time_constant": "2 s"},
        **common | changes,
    )
    state = fresh_state(problem)
    slow = run_in_python(problem, state, 7)
    middle = run_compiled(problem, state, 3)
    fast = run_compiled(problem, middle, 4)
    for name in ("cylinder_depth", "roller_depth", "terms", "energy"):
        one, other = getattr(slow, name), getattr(fast, name)
        # the load of a spring has this accuracy
        assert np.abs(one - other).max() < LOAD_TOLERANCE * np.abs(one).max(), name
    assert (fast.steps, fast.solves, fast.passes[0]) == (7, state.solves + 7, 7.0)
    # the first pass of each roller is solved fully
    assert middle.full_solves - state.full_solves == problem.rollers
    unbroken = run_compiled(problem, state, 7)
    for name in ("cylinder_depth", "roller_depth", "terms", "energy", "full_solves"):
        assert (getattr(unbroken, name) == getattr(fast, name)).all()


@pytest.fixture(scope="module")
def foundation():
    return boxed(foundation=True, contact__strips=41)[0]


def test_records_of_passes_have_the_strips_of_the_run(foundation):
    other = boxed(foundation=True, contact__strips=43)[0]
    stepper = PerPassStepper(expectation=other)
    assert PerPassStepper().recorded(foundation) is foundation
    found = stepper.recorded(foundation)
    assert found.grid is foundation.grid
    assert stepper.recorded(foundation) is found


def test_passes_are_taken_together_up_to_a_check_or_the_stop(foundation):
    stepper, (compiled, _, _) = PerPassStepper(), built(contact__strips=41)
    damaged, _, _ = built(contact__strips=41, **fatigue())
    start = fresh_state(foundation)
    state = start.replaced(passes=np.array([12_345.0]))
    assert stepper.proposed(foundation, state) == SLOW_CHUNK
    assert stepper.proposed(compiled, state) == CHUNK
    assert stepper.proposed(damaged, state) == math.floor(12_345 * DAMAGE_PART)
    assert stepper.proposed(damaged, start) == 1.0
    end, advances = stepped(foundation, stepper, 2.5)
    assert (len(advances), end.passes[0]) == (1, 3.0)
    errors = end.depth_error, end.volume_error, end.profile_error
    assert np.count_nonzero(errors) == 0


@pytest.mark.parametrize(
    ("changes", "compiled"),
    [
        ({}, True),
        ({"load__thermal": {"gain": "50 N/W", "time_constant": "2 s"}}, True),
        ({"contact__model": "hertz"}, False),
        ({"wear": {"law": "t-gamma", "cylinder": {}, "roller": {}}}, False),
        ({"creepage": {"drive": "free", "bearing_torque": "10 N mm"}}, False),
    ],
    ids=["linear", "term", "model", "law", "free"],
)
def test_loop_is_compiled_for_models_and_laws_that_it_contains(changes, compiled):
    problem, _, _ = built(contact__strips=41, **changes)
    assert is_compiled(problem) == compiled


def test_compiled_passes_return_the_contacts_of_the_worn_profile():
    problem, _, _ = built(contact__strips=41, wear__cylinder__k_over_h="1e-9 1/Pa")
    state, stepper = fresh_state(problem), PerPassStepper()
    tried = stepper.attempt(problem, state, np.array([20.0]), 100.0, stepper.scheme(problem, state))
    (end,) = tried.path
    assert end.full_solves < 20
    gap = problem.gap(*end.depths)[0, 0, 0]
    exact = problem.model.solve_one(gap, 90.0, unworn_contacts(problem).point(0))
    np.testing.assert_allclose(end.contacts.line_load[0], exact.line_load, rtol=1e-6, atol=0.1)
    assert np.abs(state.contacts.line_load[0] - exact.line_load).max() > 100.0


def test_pass_without_load_is_an_error(foundation):
    inputs = foundation.inputs.with_values({"normal_force_offset": np.array([[-305.0]])})
    problem = replace(foundation, inputs=inputs)
    with pytest.raises(StepError, match=r"the load of a pass has fallen to -5 N") as caught:
        run_in_python(problem, fresh_state(foundation), 1)
    assert caught.value.cause == "lost"


class Alternating(BlackBox):
    """Contact model whose approach alternates from call to call: the load does not converge."""

    def solve_contact(self, *arguments):
        found = super().solve_contact(*arguments)
        return replace(found, approach=found.approach + (self.solved % 2) * 1e-6)


def test_load_of_a_spring_that_does_not_converge_is_an_error():
    spring = {"load__kind": "spring", "load__stiffness": "690 N/mm"}
    problem, _, _ = boxed(foundation=True, box=Alternating, contact__strips=41, **spring)
    with pytest.raises(StepError, match=r"did not converge in a pass"):
        run_passes(problem, fresh_state(problem), np.ones(1))
