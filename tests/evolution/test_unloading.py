"""Springs that unload: runs end at their last pass, with the load of the exact decay."""

from dataclasses import replace

import numpy as np
import pytest

import wearsim
from tests.evolution import SCENARIOS, built, cylinder_depth_of, cylinder_volume_of, stepped
from wearsim.errors import SolverError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.steppers.single_step import solve_at_record, solve_present

KIK_PIOTROWSKI = {"contact.model": "semi-hertzian", "contact.variant": "kik-piotrowski"}


def unloaded(stiffness, **changes):
    """Run the rig with a spring and return the result."""
    spring = {"load.kind": "spring", "load.stiffness": stiffness}
    path = SCENARIOS / "rig-450min.toml"
    return wearsim.run(wearsim.load_scenario(path, spring | changes))


@pytest.mark.parametrize(
    ("stiffness", "changes"),
    [
        ("2e5 N/mm", {}),
        ("2e5 N/mm", {"evolution.tolerance": 1e-5, "evolution.strip_error": False}),
        ("2e4 N/mm", {"operation.duration": "4500 min"}),
        ("690 N/mm", {"operation.duration": "1e6 min"}),
        ("2e5 N/mm", {"operation.duration": "45000 min"}),
        ("2e5 N/mm", KIK_PIOTROWSKI),
    ],
    ids=["stiff", "tight", "medium", "soft", "long", "kik-piotrowski"],
)
def test_unloaded_spring_holds_the_roller(stiffness, changes):
    result = unloaded(stiffness, **changes)
    assert result.finished
    load = np.ravel(result.normal_force)
    assert 0.0 < load[-1] < 1e-6 * load[0]
    assert (np.diff(load) < 0.0).all()
    assert len(result.record_passes) > 5
    assert np.min(result.line_load) >= 0.0
    # the roller has descended by the travel of the spring, and the elastic approach has gone
    fresh = np.ravel(result.elastic_approach)[0]
    travel = 300.0 / {"2e5": 2e8, "2e4": 2e7, "690": 690e3}[stiffness.split()[0]]
    assert np.ravel(result.descent)[-1] == pytest.approx(travel + fresh, rel=1e-6)
    found = np.ravel(result.descent) - (fresh - np.ravel(result.elastic_approach))
    assert travel * (1.0 - load / 300.0) == pytest.approx(found, abs=5e-4 * travel)


@pytest.mark.parametrize("changes", [{}, KIK_PIOTROWSKI], ids=["slender", "kik-piotrowski"])
def test_load_of_a_spring_that_unloads_is_converged(changes):
    small = {"evolution.tolerance": 1e-5, "evolution.strip_error": False}
    converged = unloaded("2e4 N/mm", **changes, **small)
    result = unloaded("2e4 N/mm", **changes)
    exact = np.ravel(converged.normal_force)[-1]
    assert 0.02 < exact / 300.0 < 0.03
    assert np.ravel(result.normal_force)[-1] == pytest.approx(
        exact, rel=1.5e-2 if changes else 5e-3
    )
    assert abs(result.depth[-1] - converged.depth[-1]) <= result.depth_error[-1]
    assert abs(result.worn_volume[-1] - converged.worn_volume[-1]) <= result.volume_error[-1]
    at = np.searchsorted(result.passes, 0.5 * result.passes[-1])
    between = np.interp(
        result.passes[at], converged.passes, np.log(np.ravel(converged.normal_force))
    )
    assert np.log(np.ravel(result.normal_force)[at]) == pytest.approx(between, abs=1e-2)


@pytest.mark.parametrize(("passes", "creepage"), [(3, 1e-3), (10, 1e-3), (1, 1e-2)])
def test_error_of_one_step_contains_that_of_the_load(passes, creepage):
    changes = {
        "load__kind": "spring",
        "load__stiffness": "2e5 N/mm",
        "operation__passes": passes,
        "creepage__longitudinal": creepage,
    }
    problem, stepper, stop = built(**changes)
    state, steps = stepped(problem, stepper, stop)
    assert len(steps) == 1
    problem, stepper, stop = built(evolution__stepper="per-pass", **changes)
    exact, _ = stepped(problem, stepper, stop)
    error = abs(cylinder_volume_of(problem, state) - cylinder_volume_of(problem, exact))
    assert error > 1e-5 * cylinder_volume_of(problem, exact)
    assert error <= state.volume_error < 1e-3 * cylinder_volume_of(problem, exact)
    difference = abs(cylinder_depth_of(state) - cylinder_depth_of(exact))
    assert difference <= state.depth_error + 1e-3 * cylinder_depth_of(exact)


def test_roller_lifted_by_the_wear_of_others_ends_the_run_with_its_cause():
    # two rollers wear the track from under the third, whose spring is pressed in less
    problem, stepper, stop = built(
        load__kind="spring",
        load__stiffness="2e4 N/mm",
        roller__offset=["0 mm", "0.01 mm", "0.02 mm"],
    )
    offset = np.array([[0.0], [0.0], [-250.0]])
    inputs = problem.inputs.with_values({"normal_force_offset": offset})
    problem = replace(problem, inputs=inputs)
    with pytest.raises(SolverError, match=r"contact is lost at pass \d+: the load has fallen"):
        stepped(problem, stepper, stop)


def test_record_does_not_decide_whether_a_run_survives():
    problem, stepper, stop = built(load__kind="spring", load__stiffness="2e5 N/mm")
    _, steps = stepped(problem, stepper, stop)
    for advance in steps[-20:]:
        start, length = advance.path[0], advance.end.passes - advance.path[0].passes
        for part in (0.1, 0.5, 0.9):
            record = stepper.side_step(problem, start, part * length)
            contacts, loads = solve_at_record(problem, record, on_profile=True)
            assert 0.0 < loads.max() < 300.0
            assert contacts.line_load.sum() * problem.grid.spacing == pytest.approx(loads.sum())


def test_semi_hertzian_contact_of_a_deep_groove_carries_any_load():
    problem, stepper, stop = built(
        contact__model="semi-hertzian",
        contact__variant="kik-piotrowski",
        load__kind="spring",
        load__stiffness="2e4 N/mm",
        operation__duration="50 min",
    )
    state, _ = stepped(problem, stepper, stop, fresh_state(problem))
    for load in 10.0 ** np.arange(2, -30, -4):
        contacts = solve_present(problem, state, np.full(problem.shape, load))
        carried = contacts.line_load.sum() * problem.grid.spacing
        assert carried == pytest.approx(load, rel=1e-9)
