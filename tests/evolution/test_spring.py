"""Loads with a spring: the displacement of the roller is worn descent less elastic recovery."""

import numpy as np
import pytest

from tests.evolution import built, cylinder_depth_of, stepped
from wearsim.errors import CapabilityError, ScenarioError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.steppers.loads import descents
from wearsim.evolution.steppers.single_step import carried_loads, recovery_at, solve_at_record

PASSES = 20_000
SOFT, STIFF = "690 N/mm", "40 kN/mm"


def sprung(stiffness, stepper="implicit", **changes):
    """Return the problem, and its end state with contacts at the present loads."""
    common = {"operation__passes": PASSES, "load__kind": "spring", "load__stiffness": stiffness}
    common |= {"contact__strips": 61, "evolution__stepper": stepper}
    problem, chosen, stop = built(**common, **changes)
    state, _ = stepped(problem, chosen, stop)
    contacts, loads = solve_at_record(problem, state, on_profile=not chosen.pass_by_pass)
    return problem, state.replaced(contacts=contacts), loads


@pytest.fixture(scope="module")
def every_pass():
    return {stiffness: sprung(stiffness, "per-pass") for stiffness in (SOFT, STIFF)}


def test_fresh_roller_carries_the_load_of_the_scenario():
    problem, _, _ = built(load__kind="spring", load__stiffness=SOFT)
    state = fresh_state(problem)
    assert carried_loads(problem, state.contacts) == pytest.approx(300.0, rel=1e-8)
    assert recovery_at(problem, state)[0] == pytest.approx(3.2227e-6, rel=1e-3)
    assert solve_at_record(problem, state, on_profile=True)[1] == pytest.approx(300.0, rel=1e-12)


@pytest.mark.parametrize("stiffness", [SOFT, STIFF])
def test_load_and_displacement_are_in_equilibrium(every_pass, stiffness):
    problem, state, loads = every_pass[stiffness]
    recovery = recovery_at(problem, state)[1]
    assert recovery.min() > 0.6e-6
    displacement = descents(problem, state.depths) - recovery
    assert 300.0 - problem.stiffness * displacement == pytest.approx(loads, rel=1e-7)
    assert carried_loads(problem, state.contacts) == pytest.approx(loads, rel=1e-7)


@pytest.mark.parametrize("stiffness", [SOFT, STIFF])
@pytest.mark.parametrize("stepper", ["implicit", "stabilised", "explicit"])
def test_all_steppers_converge_to_the_per_pass_run(every_pass, stepper, stiffness):
    _, expected, load = every_pass[stiffness]
    errors = []
    for tolerance in (1e-3, 4e-4 if stepper == "explicit" else 1e-4):
        _, state, found = sprung(stiffness, stepper, evolution__tolerance=tolerance)
        difference = cylinder_depth_of(state) / cylinder_depth_of(expected) - 1.0
        errors.append(abs(difference[0]))
        # the fall of the approach keeps 0.9 % and 30 % of the lost load
        assert found == pytest.approx(load, rel=3e-4)
    assert errors[0] < 1e-3
    assert errors[1] < 3e-4


def test_contact_solver_of_a_plugin_gives_the_same_load_every_pass(every_pass, monkeypatch):
    monkeypatch.setattr("wearsim.evolution.steppers.per_pass.is_compiled", lambda problem: False)
    common = {"load__kind": "spring", "load__stiffness": STIFF, "operation__passes": 300}
    problem, stepper, stop = built(evolution__stepper="per-pass", **common)
    slow, _ = stepped(problem, stepper, stop)
    monkeypatch.undo()
    problem, stepper, stop = built(evolution__stepper="per-pass", **common)
    fast, _ = stepped(problem, stepper, stop)
    error = 3e-5 * slow.cylinder_depth.max()  # of the chord method
    assert slow.cylinder_depth == pytest.approx(fast.cylinder_depth, rel=0.0, abs=error)


def test_spring_stiffer_than_the_contact_converges():
    # two thirds of the extension is elastic: a plain iteration of the load would diverge
    _, expected, load = sprung("1000 kN/mm", "per-pass", operation__rollers=1)
    for stepper in ("implicit", "stabilised"):
        _, state, found = sprung("1000 kN/mm", stepper, operation__rollers=1)
        assert cylinder_depth_of(state) == pytest.approx(cylinder_depth_of(expected), rel=1e-3)
        assert found == pytest.approx(load, rel=2e-3)


def test_each_of_several_rollers_has_its_own_spring():
    changes = {
        "roller__offset": ["0 mm", "3 mm", "3 mm"],
        "wear__roller__k_over_h": "2e-12 1/Pa",
    }
    problem, state, loads = sprung(STIFF, "per-pass", **changes)
    _, _, found = sprung(STIFF, "implicit", **changes)
    assert loads[0, 0, 0] - loads[0, 1, 0] > 5.0  # one roller wears its track alone
    assert found == pytest.approx(loads, rel=2e-3)
    # the load of a roller depends on its own displacement only
    recovery = recovery_at(problem, state)[1]
    expected = 300.0 - problem.stiffness * (descents(problem, state.depths) - recovery)
    assert expected == pytest.approx(loads, rel=1e-6)


def test_model_without_an_approach_is_refused_with_a_remedy(monkeypatch):
    problem, _, _ = built(load__kind="spring", load__stiffness=SOFT)
    solve = problem.model.solve

    def without_approach(*arguments, **options):
        solution = solve(*arguments, **options)
        solution.approach[:] = np.nan
        return solution

    monkeypatch.setattr(problem.model, "solve", without_approach)
    with pytest.raises(CapabilityError, match=r"approach that is not finite.*contact\.model"):
        fresh_state(problem)


def test_parabola_is_refused_with_a_spring_that_unloads_the_roller():
    spring = {"load__kind": "spring", "load__stiffness": "200 kN/mm", "contact__model": "hertz"}
    with pytest.raises(ScenarioError, match=r"200000 N/mm, expected contact.model = 'slender'"):
        built(**spring)
    assert built(**spring, operation__passes=2000)[2] == 2000.0
