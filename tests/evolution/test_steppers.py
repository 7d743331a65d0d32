"""Steppers compared with each other: order, error estimates, stability."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.evolution import built, cylinder_depth_of, cylinder_volume_of, never, next_state, stepped
from wearsim.errors import SolverError, StepError
from wearsim.evolution.contacts import fresh_state, unworn_contacts
from wearsim.evolution.integrate import evolve
from wearsim.evolution.observables import centroid
from wearsim.evolution.quantities import oscillation
from wearsim.evolution.steppers.base import Attempt
from wearsim.evolution.steppers.edges import unresolved
from wearsim.evolution.steppers.forward_euler import ExplicitStepper, stability_limit
from wearsim.evolution.steppers.implicit import ImplicitStepper
from wearsim.evolution.steppers.per_pass import PerPassStepper, run_compiled, run_in_python
from wearsim.evolution.steppers.single_step import recovery_at
from wearsim.studies.ensemble.batch import joined_problem

THREE = {"roller__offset": ["-1 mm", "0.3 mm", "1 mm"]}
THERMAL = {"gain": "0.1 N/W", "time_constant": "1 min"}
SPIKE = "time [min], load [N]\n0, 300\n3, 300\n3.1, 900\n4.5, 900\n4.6, 300\n450, 300\n"
CASES = {
    "constant": {},
    "spring": {"load__kind": "spring", "load__stiffness": "690 N/mm"},
    "three rollers": THREE,
    "tilted": {"creepage__tilt": ["1 mrad", "-0.5 mrad", "2 mrad"]},
    "both wear": {"wear__roller__k_over_h": "1.1e-11 1/Pa"},
    "partial slip": {"creepage__longitudinal": 3e-4},
    "yaw": {"creepage__yaw": "1 mrad"},
    "differential slip": {"creepage__differential_slip": True},
    "fast wear": {"wear__cylinder__k_over_h": "4.5e-10 1/Pa"},
}


SMALL = {"operation__passes": 20_000, "contact__strips": 91}


@cache
def end_by_every_pass(case):
    """Return the end state of a case after every pass was solved."""
    return stepped(*built(evolution__stepper="per-pass", **SMALL, **CASES[case]))[0]


@pytest.mark.parametrize("case", list(CASES))
def test_implicit_run_matches_per_pass_within_estimate(case):
    reference = end_by_every_pass(case)
    problem, stepper, stop = built(**SMALL, **CASES[case])
    found, _ = stepped(problem, stepper, stop)
    depth, exact = cylinder_depth_of(found)[0], cylinder_depth_of(reference)[0]
    assert depth == pytest.approx(exact, rel=5e-3)
    # in a groove the reference takes strips as wholes at its edges: an error due to its strips
    whole = 0.0 if found.part is None or unresolved(found).all() else 1e-4
    assert abs(depth - exact) <= found.depth_error[0] + whole * exact
    assert found.depth_error[0] < 1e-2 * exact
    bodies = found.stacked, reference.stacked
    difference = np.linalg.norm(bodies[0] - bodies[1]) / np.linalg.norm(bodies[1])
    assert difference <= found.profile_error[0] + 5.0 * whole < 1e-2
    volume, true = cylinder_volume_of(problem, found)[0], cylinder_volume_of(problem, reference)[0]
    assert volume == pytest.approx(true, rel=5e-3, abs=0.0)
    assert abs(volume - true) <= found.volume_error[0] + 1e-7 * true


ALTERNATING = "time [s], load [N]\n" + "\n".join(
    f"{t}, {150 if t // 5 % 2 else 450}" for t in range(1200)
)


@pytest.fixture(scope="module")
def under_log(tmp_path_factory):
    """Return a function of log, creepage, passes and stepper that gives problem and end state."""
    path = tmp_path_factory.mktemp("log") / "log.csv"

    @cache
    def end_of(log, creepage, passes, name):
        path.write_text(log)
        problem, stepper, stop = built(
            load={"kind": "recorded", "file": str(path)},
            creepage__longitudinal=creepage,
            operation__passes=passes,
            contact__strips=61,
            evolution__tolerance=3e-3,
            evolution__stepper=name,
        )
        return problem, stepped(problem, stepper, stop)[0]

    return end_of


@pytest.mark.parametrize("name", ["implicit", "explicit"])
@pytest.mark.parametrize(
    ("log", "creepage"),
    [(SPIKE, 1e-3), (ALTERNATING, 1e-3), (ALTERNATING, 2e-4)],
    ids=["spike", "a", "b"],
)
def test_no_step_skips_a_peak_of_the_load(under_log, name, log, creepage):
    many, few = (45_000, 15_000) if log == SPIKE else (20_000, 8_000)
    passes = many if name == "implicit" else few
    _, reference = under_log(log, creepage, passes, "per-pass")
    problem, found = under_log(log, creepage, passes, name)
    depth, exact = cylinder_depth_of(found)[0], cylinder_depth_of(reference)[0]
    # by where steps begin and end between the jumps the error scatters by up to three tolerances;
    # a peak that is left out changes the depth by a tenth
    assert depth == pytest.approx(exact, rel=1e-2)
    assert abs(depth - exact) <= found.depth_error[0] + 2e-4 * exact
    volume, whole = cylinder_volume_of(problem, found)[0], cylinder_volume_of(problem, reference)[0]
    assert volume == pytest.approx(whole, rel=1e-2, abs=0.0)
    assert abs(volume - whole) <= found.volume_error[0] + 2e-4 * whole


def test_error_is_controlled_where_only_rollers_wear():
    changes = {
        "wear__cylinder__k_over_h": "0 1/Pa",
        "wear__roller__k_over_h": "3e-10 1/Pa",
        "operation__passes": 10_000,
        "contact__strips": 91,
    }
    reference, _ = stepped(*built(evolution__stepper="per-pass", **changes))
    fine, _ = stepped(*built(evolution__tolerance=1e-6, **changes))
    exact = fine.roller_depth.max()
    # single passes take strips as wholes at the edges of the groove, steps do not
    assert exact == pytest.approx(reference.roller_depth.max(), rel=1e-4)
    true, stated = [], []
    for tolerance in (1e-2, 1e-3, 1e-4):
        found, _ = stepped(*built(evolution__tolerance=tolerance, **changes))
        true.append(abs(found.roller_depth.max() - exact))
        stated.append(found.depth_error[0])
        assert max(true[-1], stated[-1]) < tolerance * exact
    assert sum(stated) > sum(true)  # a single one may be small by chance
    assert found.depth_error[0] < 2e-3 * exact


def test_separate_tracks_have_separate_stability_limits():
    offsets = {"roller__offset": ["-10 mm", "0 mm", "10 mm"], "contact__strips": 241}
    problem, _, _ = built(operation__passes=30_000, **offsets)
    single, _, _ = built(operation__passes=30_000, contact__strips=81, contact__width="10.9 mm")
    ratio = stability_limit(problem, fresh_state(problem)) / stability_limit(
        single, fresh_state(single)
    )
    strips = single.grid.spacing / problem.grid.spacing  # the limit grows with the strips' width
    assert ratio * strips == pytest.approx(3.0, rel=0.15)


def test_tighter_tolerance_gives_a_smaller_error():
    reference, errors = end_by_every_pass("constant"), []
    for tolerance in (1e-2, 1e-3, 3e-5):
        found, _ = stepped(*built(evolution__tolerance=tolerance, **SMALL))
        difference = found.cylinder_depth - reference.cylinder_depth
        errors.append(np.linalg.norm(difference) / np.linalg.norm(reference.cylinder_depth))
        assert errors[-1] < 2.0 * min(found.profile_error[0], tolerance)
    assert errors[2] < errors[1] < errors[0]
    assert errors[2] < 0.1 * errors[0]


def test_offset_rollers_converge_with_the_step_length():
    passes = 60_000
    problem, _, _ = built(operation__passes=passes, contact__strips=71, **THREE)
    reference, _ = stepped(problem, PerPassStepper(), passes)
    y = problem.grid.y
    depth_errors, centre_errors = [], []
    for steps in (10, 20, 40):
        stepper = ImplicitStepper(1.0, forced_step=passes / steps)
        found, _ = stepped(problem, stepper, passes)
        depth_errors.append(abs(cylinder_depth_of(found)[0] - cylinder_depth_of(reference)[0]))
        ours, exact = (centroid(y, s.cylinder_depth[0, 0, 0]) for s in (found, reference))
        centre_errors.append(abs(ours - exact))
    for errors in (depth_errors, centre_errors):
        orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
        assert (orders > 0.7).all()
        assert (orders < 1.6).all()
    assert depth_errors[-1] < 5e-3 * cylinder_depth_of(reference)[0]


# coupled half-lengths are kept from the last factorisation by the chord method
HALF_LENGTHS = [("local", 2e-8), ("coupled", 2e-5)]


@pytest.mark.parametrize(("half_length", "tolerance"), HALF_LENGTHS)
def test_compiled_loop_equals_python_loop(half_length, tolerance):
    problem, _, _ = built(
        contact__half_length=half_length,
        roller__offset=["0 mm", "0 mm", "1 mm"],
        load__kind="spring",
        load__stiffness="690 N/mm",
        wear__roller__k_over_h="5e-12 1/Pa",
        creepage__yaw="0.3 mrad",
        creepage__differential_slip=True,
        contact__strips=61,
        operation__passes=500_000,
        **{"load.thermal": {"gain": "50 N/W", "time_constant": "2 s"}},
    )
    state = fresh_state(problem)
    slow, fast = run_in_python(problem, state, 300), run_compiled(problem, state, 300)
    for name in ("cylinder_depth", "roller_depth", "terms", "energy"):
        one, other = getattr(slow, name), getattr(fast, name)
        assert np.abs(one - other).max() < tolerance * np.abs(one).max(), name
    assert fast.terms.max() > 0.1
    assert fast.full_solves < 30


def test_compiled_loop_equals_python_loop_in_partial_slip():
    problem, _, _ = built(
        creepage__longitudinal=2e-4,
        friction__coefficient=0.4,
        wear__cylinder__k_over_h="1e-10 1/Pa",
        contact__strips=61,
        operation__passes=100_000,
    )
    state = fresh_state(problem)
    slow, fast = run_in_python(problem, state, 300), run_compiled(problem, state, 300)
    depth = slow.cylinder_depth
    assert np.abs(depth - fast.cylinder_depth).max() < 3e-6 * depth.max()
    assert fast.full_solves < 30


@pytest.mark.parametrize(("half_length", "tolerance"), HALF_LENGTHS)
def test_chord_method_leaves_a_small_residual(half_length, tolerance):
    problem, _, _ = built(
        contact__half_length=half_length, operation__passes=200_000, contact__strips=91
    )
    state, _ = stepped(problem, PerPassStepper(), 5_000)
    last = run_compiled(problem, state, 1)
    assert last.full_solves == state.full_solves
    q = last.loop_strips[0, 0, 0, 0]
    gap = problem.gap(state.cylinder_depth, state.roller_depth)[0, 0, 0]
    exact = problem.model.solve_one(gap, 90.0, unworn_contacts(problem).point(0))
    assert np.abs(q - exact.line_load).max() < 5.0 * tolerance * exact.line_load.max()
    assert last.loop_contacts[0, 0, 0, 0] == pytest.approx(exact.approach, rel=tolerance)
    assert q.sum() * problem.grid.spacing == pytest.approx(300.0, rel=1e-10)


@pytest.fixture(scope="module")
def half_worn():
    problem, _, _ = built(contact__strips=161)
    # fixed steps take strips as wholes, as explicit ones do
    state, _ = stepped(problem, ImplicitStepper(1e-3, forced_step=10_000.0), 300_000.0)
    return problem, replace(state, coarse_step_solution=None, step=np.zeros(1))


def roughened(state):
    """Return the state with a nanometre scratched off every other strip in contact."""
    loaded = state.contacts[0].line_load > 0.0
    scratch = np.where(loaded & (np.arange(len(loaded)) % 2 == 0), 1e-9, 0.0)
    return replace(state, cylinder_depth=state.cylinder_depth + scratch)


@pytest.mark.parametrize(("factor", "unstable"), [(0.9, False), (1.4, True)])
def test_explicit_steps_oscillate_beyond_the_limit(half_worn, factor, unstable):
    problem, state = half_worn
    limit = stability_limit(problem, state)[0]
    stepper = ExplicitStepper(1.0, factor * limit, allow_unstable=True)
    state, warnings = roughened(state), []
    first = None
    for _ in range(25):
        advance = next(evolve(problem, state, stepper, 1e12, never, 10**6))
        state = advance.end
        first = first if first is not None else oscillation(state.contacts[0].line_load)
        warnings.append(advance.warning)
    last = oscillation(state.contacts[0].line_load)
    if unstable:
        assert last > 0.1
        assert any(w is not None and w.startswith("unstable: ") for w in warnings)
    else:
        assert last < first
        assert not any(warnings)


def test_implicit_steps_beyond_the_limit_do_not_oscillate(half_worn):
    problem, state = half_worn
    step = 10.0 * stability_limit(problem, state)[0]
    state, stepper = roughened(state), ImplicitStepper(1.0, forced_step=step)
    for _ in range(10):
        state = next_state(problem, stepper, state)
        assert oscillation(state.contacts[0].line_load) < 2e-3


def test_limit_is_the_interpenetration_of_the_strips(half_worn):
    problem, state = half_worn
    cylinder, _ = problem.sum_of_parts(*problem.wear_parts(state.contacts, 1.0))
    wear = stability_limit(problem, state) * cylinder.max()
    # 0.6 of twice the interpenetration: about 0.2 um for worn strips of 0.1 mm
    assert 0.1e-6 < wear < 0.4e-6


def test_forced_step_beyond_the_limit_is_refused(half_worn):
    problem, state = half_worn
    step = 2.0 * stability_limit(problem, state)[0]
    with pytest.raises(StepError, match=r"exceeds the stability limit.*allow_unstable = true"):
        next_state(problem, ExplicitStepper(1.0, step), state)


class Overflowing(ExplicitStepper):
    """Stepper that returns an infinite energy for steps of more than ten passes."""

    def proposed(self, problem, state):
        return np.full(1, self.forced_step or 1e4)

    def attempt(self, problem, state, step, stop, scheme):
        end = replace(state, passes=state.passes + step, energy=np.where(step > 10.0, np.inf, 0.0))
        return Attempt((end,), np.zeros(1), np.ones(1))


def test_step_to_a_value_that_is_not_finite_is_shortened_or_fails():
    problem, _, _ = built(contact__strips=31)
    state = fresh_state(problem)
    end = next_state(problem, Overflowing(1.0), state)
    assert 0.0 < end.passes[0] <= 10.0
    assert end.rejected[0] > 0
    with pytest.raises(StepError, match="a value is not finite after pass 20") as caught:
        next_state(problem, Overflowing(1.0, forced_step=20.0), state)
    assert caught.value.state["passes"] == 20.0


def test_realisations_can_be_stepped_pass_by_pass_together():
    tests = [
        built(creepage__longitudinal=creepage, evolution__stepper="per-pass", contact__strips=61)
        for creepage in (3e-4, 1e-3)
    ]
    first, stepper, _ = tests[0]
    problems = [replace(one, grid=first.grid, model=first.model) for one, _, _ in tests]
    together, _ = stepped(joined_problem(problems), stepper, 400.0)
    for place, problem in enumerate(problems):
        alone, _ = stepped(problem, stepper, 400.0)
        assert (together.at(np.array([place])).cylinder_depth == alone.cylinder_depth).all()


def test_explicit_run_is_stable_and_matches_per_pass():
    reference = end_by_every_pass("constant")
    state, advances = stepped(*built(evolution__stepper="explicit", **SMALL))
    assert not any(advance.warning for advance in advances)
    depth, exact = cylinder_depth_of(state)[0], cylinder_depth_of(reference)[0]
    assert depth == pytest.approx(exact, rel=5e-3)
    assert abs(depth - exact) <= state.depth_error[0]


def test_free_roller_creepage_balances_the_torque():
    problem, stepper, stop = built(
        creepage={"drive": "free", "bearing_torque": "100 N mm", "differential_slip": True},
        operation__passes=300_000,
    )
    state, _ = stepped(problem, stepper, stop)
    contact = state.contacts[0]
    assert problem.inputs.bearing_torque == 0.1
    # the lever arm is the local radius of the roller, which the crown reduces to the sides
    assert 1.0 < contact.force_x * -0.02 / 0.1 < 1.003
    # the groove shortens the cylinder's radius by d, and the roller's slip follows it
    assert contact.longitudinal_creepage > 0.0


def test_vanishing_load_raises_an_error_with_its_cause(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("time [min], load [N]\n0, 300\n2, 300\n2.1, -10\n450, -10\n")
    for name in ("implicit", "stabilised", "explicit", "per-pass"):
        problem, stepper, stop = built(
            # with a load term the scenario is not refused before the run
            load={"kind": "recorded", "file": str(log), "thermal": THERMAL},
            evolution__stepper=name,
            operation__passes=30_000,
            contact__width="8 mm",
        )
        with pytest.raises(SolverError, match=r"contact is lost at pass \d+: the load") as caught:
            stepped(problem, stepper, stop)
        assert caught.value.state


def test_stiff_spring_limits_the_worn_depth():
    problem, stepper, stop = built(load__kind="spring", load__stiffness="40 kN/mm")
    state, _ = stepped(problem, stepper, stop)
    recovery = recovery_at(problem, state)[1].max()
    assert 0.9 * 300.0 / 40e6 < cylinder_depth_of(state)[0] - recovery < 300.0 / 40e6
