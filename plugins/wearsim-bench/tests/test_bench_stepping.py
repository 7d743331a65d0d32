"""Steppers measured against every pass by itself: who is measured, and what their errors are."""

import json
from dataclasses import replace
from typing import get_args

import pytest
from test_bench_contact import plugins  # noqa: F401  (a fixture)

from wearsim.errors import PluginError, StepError
from wearsim.plugins import ContactModelSpec, registry
from wearsim.scenario.tables.plain import EvolutionTable
from wearsim_bench.contact.methods import DEFAULT_MODEL, Method
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.stepping import groups as stepping_groups
from wearsim_bench.stepping.groups import EVERY_PASS, Bench, of_model, of_steppers
from wearsim_bench.stepping.runs import End, Ready, WearTest, errors_of
from wearsim_bench.stepping.solvers import SOLVERS, solved_by
from wearsim_bench.stepping.topic import RIG, SPRING, stepping

pytestmark = pytest.mark.bench

QUICK = Effort(quick=True, repetitions=1)
SHORT = WearTest(RIG, 0.2)  # 600 passes
STEPPERS = set(get_args(EvolutionTable.model_fields["stepper"].annotation)) - {"auto"}


def bench(model, test=SHORT):
    return Bench("problems", test, Method(model), 1)


def end_of(test=SHORT, **changes):
    ready = Ready(test.asked(changes))
    return ready, ready.stepped(ready.stop)


@pytest.fixture(scope="module")
def told():
    return []


@pytest.fixture(scope="module")
def topic(plugins, told):  # noqa: F811
    return stepping(QUICK, lambda what, part: told.append((what, part)))


def test_that_every_stepper_and_solver_stands_beside_the_truth(topic, told):
    steppers = topic.groups[:3]
    assert [name.split(",")[0] for name in steppers] == ["rig", "spring", "three rollers"]
    for group in steppers:
        assert {item.method for item in topic.of(group)} == STEPPERS | set(SOLVERS)
        truth = next(item for item in topic.of(group) if item.method == EVERY_PASS)
        assert truth.seconds > 0.0
        assert not truth.errors
        assert [item for item in topic.of(group) if item.failed] == []
    parts = [part for _, part in told]
    assert parts == sorted(parts)
    assert parts[-1] <= 1.0


def test_that_every_contact_model_is_held_against_its_own_truth(topic):
    group = next(name for name in topic.groups if name.startswith("contact models"))
    named = {item.method.split(",")[0] for item in topic.of(group)}
    assert named == set(registry().names(ContactModelSpec)) >= {DEFAULT_MODEL, "winkler"}
    for item in topic.of(group):
        if item.method.startswith("choosy"):
            assert item.failed == "raised TypeError: object of type 'NoneType' has no len()"
        else:
            assert 0.0 < item.errors["depth"] < 2e-3


def test_that_what_a_scenario_gets_is_marked_once_in_every_group(topic):
    for group in topic.groups:
        marked = [item for item in topic.of(group) if item.default]
        assert len(marked) == 1, group
    first = next(item for item in topic.of(topic.groups[0]) if item.default)
    assert (first.method, first.setting) == ("implicit", "tolerance 1e-3")
    json.dumps(topic.as_json())


def test_that_more_strips_and_closer_tolerances_are_nearer(topic):
    rig = {(item.method, item.setting): item for item in topic.of(topic.groups[0])}
    for method in {*STEPPERS, *SOLVERS} - {EVERY_PASS}:
        loose, close = (rig[method, f"tolerance {power}"] for power in ("1e-1", "1e-3"))
        assert close.errors["profile"] < loose.errors["profile"]
        assert close.errors["depth"] < 5e-3
    strips = [item for item in topic.of(topic.groups[-1]) if item.method == "LSODA, 1e-5"]
    errors = {int(item.setting.split()[0]): item.errors["profile"] for item in strips}
    default = next(item for item in topic.of(topic.groups[-1]) if item.default)
    assert errors[int(default.setting.split()[0])] < errors[min(errors)]


@pytest.mark.parametrize("changes", [{}, SPRING], ids=["constant", "spring"])
@pytest.mark.parametrize("solver", SOLVERS)
def test_that_a_solver_converges_to_every_pass_by_itself(solver, changes):
    ready, truth = end_of(WearTest(RIG, 2.0, changes), **{"evolution.stepper": EVERY_PASS})
    loose, close = (
        errors_of(
            End(ready.problem, solved_by(solver, ready.problem, ready.stop, tolerance)), truth
        )
        for tolerance in (1e-2, 1e-6)
    )
    assert close["profile"] < 0.2 * loose["profile"]
    # a pass is a step of Euler's method: of first order in the wear of one
    assert max(close.values()) < 3e-5


def test_that_bodies_which_wear_together_are_solved_together():
    both = {"wear.roller.k_over_h": "1.1e-11 1/Pa"}
    ready, truth = end_of(WearTest(RIG, 2.0, both), **{"evolution.stepper": EVERY_PASS})
    found = End(ready.problem, solved_by("LSODA", ready.problem, ready.stop, 1e-6))
    assert truth.state.roller_depth.max() > 0.0
    assert max(errors_of(found, truth).values()) < 3e-5


def test_that_a_model_without_compiled_passes_has_a_truth_that_passes_agree_with():
    test = bench("hertz")
    strips = SHORT.grid().strips
    row, converged = test.exact(strips)
    assert row.method == "LSODA"
    assert row.counts["truth"] == converged.own["profile"]
    ready = test.ready(strips, stepper=EVERY_PASS)
    assert max(errors_of(converged.end, ready.stepped(ready.stop)).values()) < 2e-4


def test_that_the_truth_of_a_model_without_compiled_passes_is_converged():
    long = WearTest(RIG, 45.0)
    test = bench("hertz", long)
    _, converged = test.exact(long.grid().strips)
    assert all(0.0 < error < 3e-6 for error in converged.own.values())
    # nearer to it than it is to the truth none can be told to be
    assert converged.errors_of(converged.end) == converged.own
    (row,) = of_model(test, (1e-2,))
    assert row.errors["profile"] > converged.own["profile"] == row.counts["truth"]


def test_that_a_solver_that_asks_for_too_many_contacts_is_stopped():
    ready = Ready(SHORT.asked({}))
    with pytest.raises(StepError, match="more than 5 contacts"):
        solved_by("LSODA", ready.problem, ready.stop, 1e-6, most=5)


def test_that_errors_are_parts_of_the_exact_ones():
    ready, end = end_of()
    state = end.state
    deeper = replace(state, cylinder_depth=1.01 * state.cylinder_depth)
    found = errors_of(End(ready.problem, deeper), end)
    assert found == pytest.approx({"depth": 0.01, "profile": 0.01, "volume": 0.01})
    assert set(errors_of(end, end).values()) == {0.0}


def test_that_a_refusal_is_shown_once_and_with_its_reason():
    found = list(of_steppers(bench("hertz"), (1e-1, 1e-2)))
    refused = [item for item in found if item.failed]
    assert [item.method for item in refused] == ["implicit"]
    assert "contact model 'hertz' takes no wear compliance" in refused[0].failed
    braked = {"creepage": {"drive": "free", "bearing_torque": "100 N m"}}
    (row,) = of_model(bench(DEFAULT_MODEL, WearTest(RIG, 0.2, braked)), (1e-3,))
    assert row.failed.startswith("the roller skids")


def test_that_a_stepper_with_too_many_steps_goes_no_further(monkeypatch):
    monkeypatch.setattr(stepping_groups, "MOST_STEPS", 5)
    found = list(of_steppers(bench(DEFAULT_MODEL), (1e-1, 1e-3, 1e-4)))
    settings = [item.setting for item in found if item.method == "explicit"]
    assert settings == ["tolerance 1e-1", "tolerance 1e-3"]


@pytest.mark.usefixtures("plugins")
def test_that_one_model_is_measured_by_itself_beside_the_default():
    found = stepping(replace(QUICK, plugin="winkler"), lambda what, part: None)
    *steppers, models = found.groups
    assert {item.method.split(",")[0] for item in found.of(models)} == {"winkler", DEFAULT_MODEL}
    for group in steppers:
        assert {item.method for item in found.of(group)} >= {"stabilised", "explicit", *SOLVERS}
        assert EVERY_PASS not in {item.method for item in found.of(group)}
    with pytest.raises(PluginError, match="nobody"):
        stepping(replace(QUICK, plugin="nobody"), lambda what, part: None)
