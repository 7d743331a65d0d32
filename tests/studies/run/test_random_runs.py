"""Runs with random inputs: draws, expectations over passes, processes and restart."""

import numpy as np
import pytest

import wearsim
from tests.evolution import never
from tests.results_compared import differences
from tests.studies.random_examples import (
    CREEPAGE,
    FRICTION,
    LOAD,
    SLACK,
    WANDERING,
    end_of,
    scenario_of,
)
from wearsim.errors import CapabilityError, Interrupted, ScenarioError, StepError
from wearsim.evolution import error_estimates as errors_of_steps
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import volume_of
from wearsim.evolution.integrate import evolve
from wearsim.evolution.steppers.forward_euler import stability_limit
from wearsim.studies.opening import open_results
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw

ALL_PER_PASS = {
    "load__normal_force": {**LOAD, "persistence": "per-pass"},
    "friction__coefficient": {**FRICTION, "persistence": "per-pass"},
    "creepage__longitudinal": {**CREEPAGE, "persistence": "per-pass"},
    "creepage__misalignment": {**SLACK, "persistence": "per-pass"},
}


def depth_of(state):
    """Return the depth of the groove [m]."""
    return float(state.cylinder_depth.max())


def test_run_uses_the_drawn_values():
    random = scenario_of(
        load__normal_force=LOAD, friction__coefficient=FRICTION, contact__strips=61
    )
    drawn = draw(random).scenario.drawn
    plain = scenario_of(
        load__normal_force=f"{drawn['load.normal_force']!r} N",
        friction__coefficient=drawn["friction.coefficient"],
        contact__strips=61,
    )
    assert drawn["load.normal_force"] != pytest.approx(307.0, abs=1e-6)
    assert depth_of(end_of(random)[1]) == depth_of(end_of(plain)[1])


def test_wear_factor_and_stiffness_can_be_random():
    factor = {"distribution": "lognormal", "median": "2e-9 1/Pa", "factor": 1.5}
    stiffness = {"distribution": "uniform", "low": "600 N/mm", "high": "800 N/mm"}
    scenario = scenario_of(
        wear__cylinder__k_over_h=factor, load__kind="spring", load__stiffness=stiffness
    )
    result = wearsim.run(scenario)
    drawn = result.raw.drawn
    assert 600e3 < drawn["load.stiffness"]["values"][0] < 800e3
    assert drawn["wear.cylinder.k_over_h"]["unit"] == "1/Pa"
    balance = drawn["wear.cylinder.k_over_h"]["values"][0] * result.dissipated_energy[-1]
    assert result.worn_volume[-1] == pytest.approx(balance, rel=1e-12, abs=0.0)


def test_realisation_and_seed_change_the_draws():
    def force(**changes):
        drawn = draw(scenario_of(load__normal_force=LOAD, **changes)).scenario.drawn
        return drawn["load.normal_force"]

    assert len({force(), force(sampling__realisation=1), force(seed=2)}) == 3
    assert force() == force(friction__coefficient=FRICTION)


def test_rollers_have_separate_misalignments():
    slack = {**SLACK, "persistence": "per-roller"}
    friction = {**FRICTION, "persistence": "per-roller"}
    scenario = scenario_of(creepage__misalignment=slack, friction__coefficient=friction)
    problem, state = end_of(scenario)
    assert problem.shape[1] == 3
    for name in ("yaw", "tilt", "friction"):
        assert len(np.unique(getattr(problem.inputs, name))) == 3
    assert np.hypot(problem.inputs.yaw, problem.inputs.tilt).max() < 2e-3
    # the contact of each roller is shifted by -R_crown x tilt
    forces = [contact.line_load for contact in fresh_state(problem).contacts]
    centres = [float(np.dot(problem.grid.y, q) / q.sum()) for q in forces]
    assert centres == pytest.approx(-0.5 * problem.inputs.tilt[:, 0], abs=2e-5)
    assert depth_of(state) > 0.0


@pytest.mark.parametrize("drawn", [("creepage__misalignment",), tuple(ALL_PER_PASS)])
def test_expectation_over_passes_agrees_with_per_pass_draws(drawn):
    inputs = {name: ALL_PER_PASS[name] for name in drawn}
    _, reference = end_of(scenario_of(evolution__stepper="per-pass", contact__strips=61, **inputs))
    fresh, _, _ = assemble_problem(draw(scenario_of(contact__strips=61, **inputs)))
    step = round(10.0 * stability_limit(fresh, fresh_state(fresh))[0])
    problem, state = end_of(scenario_of(evolution__step=step, contact__strips=61, **inputs))
    assert state.steps < 20
    assert abs(depth_of(state) - depth_of(reference)) <= state.depth_error[0]
    volumes = volume_of(problem, state.depths), volume_of(problem, reference.depths)
    assert abs(volumes[0] - volumes[1])[0] <= state.volume_error[0]
    assert state.depth_error[0] < 0.02 * depth_of(state)


def test_a_run_of_single_passes_under_a_spring_records_the_expectation():
    drawn = {"creepage__longitudinal": ALL_PER_PASS["creepage__longitudinal"]}
    spring = {"load__kind": "spring", "load__stiffness": "690 N/mm"}
    strips = {"contact__strips": 61, "evolution__strip_error": False}
    single, expected = (
        wearsim.run(scenario_of(4000, **spring, **drawn, evolution__stepper=stepper, **strips))
        for stepper in ("per-pass", "auto")
    )
    # one roller's creepage is drawn from pass to pass, and the loads are those of its passes
    loads = [result.normal_force[-1].mean() for result in (single, expected)]
    assert loads[0] == pytest.approx(loads[1], rel=1e-3)


def test_expectation_is_insensitive_to_the_step():
    inputs = {"creepage__misalignment": ALL_PER_PASS["creepage__misalignment"]}
    depths = [
        depth_of(end_of(scenario_of(evolution__step=step, contact__strips=61, **inputs))[1])
        for step in (250, 1000, 3000)
    ]
    assert depths == pytest.approx([depths[0]] * 3, rel=3e-3)


def test_long_explicit_step_is_unstable():
    inputs = {
        "evolution__stepper": "explicit",
        "evolution__step": 400,
        "evolution__nodes": 16,
        "creepage__misalignment": ALL_PER_PASS["creepage__misalignment"],
    }
    with pytest.raises(StepError, match="exceeds the stability limit"):
        end_of(scenario_of(**inputs))
    result = wearsim.run(scenario_of(evolution__allow_unstable=True, **inputs))
    assert any(text.startswith("unstable") for text in result.warnings)


def test_more_nodes_reduce_the_quadrature_error():
    errors = []
    for nodes in (8, 128):
        _, state = end_of(
            scenario_of(passes=2000, evolution__nodes=nodes, evolution__step=1000, **ALL_PER_PASS)
        )
        errors.append(state.quadrature[0, 0] / depth_of(state))
    assert errors[1] < 0.2 * errors[0]


def test_processes_agree_with_per_pass_reference():
    load = {**WANDERING, "marginal": LOAD}
    friction = {**WANDERING, "marginal": FRICTION, "persistence": "per-roller"}
    inputs = {"load__normal_force": load, "friction__coefficient": friction, "contact__strips": 61}
    _, reference = end_of(scenario_of(evolution__stepper="per-pass", **inputs))
    problem, state = end_of(scenario_of(**inputs))
    assert len(problem.varying) == 4
    assert abs(depth_of(state) - depth_of(reference)) <= state.depth_error[0]
    assert depth_of(state) == pytest.approx(depth_of(reference), rel=2e-3)


def test_per_pass_draws_do_not_depend_on_records():
    inputs = {**ALL_PER_PASS, "evolution__stepper": "per-pass", "passes": 900}
    few = wearsim.run(scenario_of(outputs__records=1, **inputs))
    many = wearsim.run(scenario_of(outputs__records=9, **inputs))
    assert few.depth[-1] == many.depth[-1]
    profiles = [result.raw.records["cylinder_depth_profile"][-1] for result in (few, many)]
    assert (profiles[0] == profiles[1]).all()


@pytest.mark.parametrize("stepper", ["implicit", "per-pass"])
def test_resumed_random_run_equals_unbroken_run(tmp_path, stepper):
    scenario = scenario_of(
        passes=900,
        evolution__stepper=stepper,
        **({"evolution__nodes": 16} if stepper == "implicit" else {}),
        contact__strips=61,
        outputs__records=5,
        load__normal_force={**WANDERING, "marginal": LOAD},
        friction__coefficient={**FRICTION, "persistence": "per-pass"},
        creepage__misalignment={**SLACK, "persistence": "per-roller"},
    )
    whole = wearsim.run(scenario, tmp_path / "whole.h5")
    requests = iter([False, False, True])
    with pytest.raises(Interrupted):
        wearsim.run(scenario, tmp_path / "part.h5", stop_requested=lambda: next(requests, True))
    assert not open_results(tmp_path / "part.h5").finished
    resumed = wearsim.resume(tmp_path / "part.h5")
    changed = set(differences(whole.raw, resumed.raw)) - {"wall_seconds", "created"}
    assert not changed


def test_run_refuses_friction_field():
    field = {"distribution": "white", "marginal": FRICTION}
    with pytest.raises(CapabilityError, match="resolved within one contact"):
        draw(scenario_of(friction__coefficient=field))


def test_run_refuses_latin_hypercube():
    with pytest.raises(ScenarioError, match="a study of many realisations"):
        assemble_problem(
            draw(scenario_of(load__normal_force=LOAD, sampling__plan="latin-hypercube"))
        )


def test_process_with_too_many_steps_is_refused():
    load = {**WANDERING, "correlation_time": "1 us", "marginal": LOAD}
    with pytest.raises(ScenarioError, match="a longer correlation_time"):
        draw(scenario_of(passes=100_000, load__normal_force=load))


@pytest.mark.parametrize("key", ["load__normal_force", "friction__coefficient"])
def test_wear_by_variation_within_a_step_is_added(key, monkeypatch):
    marginal = LOAD if "load" in key else FRICTION
    inputs = {"contact__strips": 61, key: {**WANDERING, "marginal": marginal}}
    # in full slip wear is linear in friction and depends on its mean only
    inputs["creepage__longitudinal"] = 3e-4
    exact = depth_of(end_of(scenario_of(evolution__stepper="per-pass", **inputs))[1])
    scenario = scenario_of(evolution__step=1500, **inputs)
    _, state = end_of(scenario)
    monkeypatch.setattr("wearsim.evolution.steppers.step_doubling.variation_bias", lambda *_: None)
    _, without = end_of(scenario)
    assert abs(depth_of(state) - exact) < 0.8 * abs(depth_of(without) - exact)
    assert abs(depth_of(state) - exact) < state.depth_error[0] < 0.05 * exact


@pytest.mark.parametrize("rollers", ["identical", "different"])
def test_run_with_random_load_is_within_its_error_estimate(rollers):
    slack = {"creepage__misalignment": {**SLACK, "persistence": "per-roller"}}
    inputs = {"load__normal_force": {**WANDERING, "marginal": LOAD}, "contact__strips": 61}
    inputs |= slack if rollers == "different" else {}
    problem, fine = end_of(scenario_of(evolution__tolerance=1e-4, **inputs))
    for tolerance in (3e-3, 3e-2):
        _, state = end_of(scenario_of(evolution__tolerance=tolerance, **inputs))
        difference = abs(depth_of(state) - depth_of(fine))
        assert difference <= state.depth_error[0] + fine.depth_error[0]
        assert state.depth_error[0] <= tolerance * depth_of(state)
        volumes = [volume_of(problem, one.depths) for one in (state, fine)]
        assert abs(volumes[0] - volumes[1]) <= state.volume_error[0] + fine.volume_error[0]


def test_records_are_comparable_between_steppers():
    slack = {"creepage__misalignment": ALL_PER_PASS["creepage__misalignment"]}
    inputs = {**slack, "passes": 3000, "contact__strips": 61}
    expected = wearsim.run(scenario_of(**inputs))
    drawn = wearsim.run(scenario_of(evolution__stepper="per-pass", **inputs))
    power = drawn.dissipated_energy[-1] / drawn.time[-1]
    assert drawn.power[-1] == pytest.approx(power, rel=0.05)
    assert drawn.power[-1] == pytest.approx(expected.power[-1], rel=0.02)
    # the width of the load averaged over many passes, since single passes roughen the profile
    widths = []
    for result in (expected, drawn):
        load = result.raw.records["line_load"][-1, 0, 0, 0]
        widths.append(np.sqrt(np.dot(load, result.y**2) / load.sum()))
    assert widths[1] == pytest.approx(widths[0], rel=0.03)


def test_strips_cover_groove_of_greatest_friction():
    friction = {"distribution": "uniform", "low": 0.05, "high": 1.0, "persistence": "per-roller"}
    scenario = scenario_of(friction__coefficient=friction, seed=3)
    plain, _, _ = assemble_problem(draw(scenario_of()))
    problem, state = end_of(scenario)
    assert problem.inputs.friction.max() > 0.5
    assert np.ptp(problem.grid.y) > 1.3 * np.ptp(plain.grid.y)
    assert depth_of(state) > 0.0


@pytest.mark.parametrize(
    "creepage",
    [
        {**WANDERING, "marginal": {"distribution": "normal", "mean": 0.0, "std": 1e-3}},
        {"distribution": "normal", "mean": 0.0, "std": 1e-3, "persistence": "per-pass"},
    ],
)
def test_strips_cover_groove_of_creepage_about_zero(creepage):
    changes = {"creepage__longitudinal": creepage, "evolution__tolerance": 1e-2}
    problem, state = end_of(scenario_of(passes=20_000, **changes))
    worn = problem.grid.y[state.cylinder_depth[0, 0, 0] > 0.0]
    fresh = assemble_problem(draw(scenario_of(passes=20_000, creepage__longitudinal=0.0)))[
        0
    ].grid.y[-1]
    assert fresh < worn[-1] < problem.grid.y[-1]


def test_nodes_without_expectation_are_refused():
    for changes in ({}, {"evolution__stepper": "per-pass", **ALL_PER_PASS}):
        with pytest.raises(ScenarioError, match="without an expectation over passes"):
            assemble_problem(draw(scenario_of(evolution__nodes=16, **changes)))


def test_step_is_shortened_where_coarse_solution_fails(monkeypatch):
    friction = {**FRICTION, "persistence": "per-pass"}
    problem, stepper, _ = assemble_problem(
        draw(scenario_of(passes=600, friction__coefficient=friction))
    )
    fresh = fresh_state(problem)
    plain = next(evolve(problem, fresh, stepper, 600.0, never, 10**6)).end
    original, failures = (
        errors_of_steps.half_quadrature,
        [StepError("the coarse solution did not converge", {})],
    )

    def fails_once(*arguments):
        if failures:
            raise failures.pop()
        return original(*arguments)

    monkeypatch.setattr(errors_of_steps, "half_quadrature", fails_once)
    end = next(evolve(problem, fresh, stepper, 600.0, never, 10**6)).end
    assert not failures
    assert end.rejected >= 1
    assert 0.0 < end.passes < plain.passes
