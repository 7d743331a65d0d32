"""Topic `stepping`: references, errors and failures."""

import json
from dataclasses import replace
from typing import get_args

import pytest
from test_bench_contact import plugins  # noqa: F401  (a fixture)

from wearsim.errors import PluginError, StepError
from wearsim.scenario.tables.plain import EvolutionTable
from wearsim_bench.contact.methods import DEFAULT_MODEL, Method, compared_models
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.stepping import groups as stepping_groups
from wearsim_bench.stepping.groups import EVERY_PASS, StepperBenchmark, of_model, of_steppers
from wearsim_bench.stepping.runs import EndState, PreparedTest, WearTest, errors_of
from wearsim_bench.stepping.solvers import SOLVERS, solved_by
from wearsim_bench.stepping.topic import RIG, SPRING, stepping
from wearsim_bench.stepping.turns import NOTABLE

QUICK = Effort(quick=True, repetitions=1)
SHORT = WearTest(RIG, 0.2)  # 600 passes
STEPPERS = set(get_args(EvolutionTable.model_fields["stepper"].annotation)) - {"auto"}


def benchmark_of(model, test=SHORT):
    return StepperBenchmark("problems", test, Method(model), 1, lambda what: None)


def end_of(test=SHORT, **changes):
    prepared = PreparedTest(test.scenario_with(changes))
    return prepared, prepared.stepped(prepared.stop)


@pytest.fixture(scope="module")
def progress():
    return []


@pytest.fixture(scope="module")
def topic(plugins, progress):  # noqa: F811
    return stepping(QUICK, lambda what, part: progress.append((what, part)))


def test_all_steppers_and_solvers_are_measured(topic, progress):
    steppers = topic.groups[:3]
    assert [name.split(",")[0] for name in steppers] == ["rig", "spring", "three rollers"]
    for group in steppers:
        assert {item.method for item in topic.of(group)} == STEPPERS | set(SOLVERS)
        reference = next(item for item in topic.of(group) if item.method == EVERY_PASS)
        assert reference.seconds > 0.0
        assert not reference.errors
        assert [item for item in topic.of(group) if item.failed] == []
    parts = [part for _, part in progress]
    assert parts == sorted(parts)
    assert parts[-1] <= 1.0


def test_solvers_are_compared_with_the_default(topic):
    for group in [name for name in topic.groups if not name.startswith("contact models")]:
        compared = {(item.method, item.setting) for item in topic.of(group) if item.remark}
        assert compared == {
            (item.method, item.setting)
            for item in topic.of(group)
            if item.method.startswith(SOLVERS) and item.errors.get("profile", 0.0) >= NOTABLE
        }
        assert compared
        assert f"of {len(compared)} settings of LSODA and BDF" in topic.conclusions[group]
    for group in topic.groups:
        assert "The default meets its tolerance of 0.001" in topic.conclusions[group]


def test_contact_models_have_separate_references(topic):
    group = next(name for name in topic.groups if name.startswith("contact models"))
    named = {item.method.split(",")[0] for item in topic.of(group)}
    assert named == set(compared_models()) >= {DEFAULT_MODEL, "winkler"}
    for item in topic.of(group):
        if item.method.startswith("choosy"):
            assert item.failed == "raised TypeError: object of type 'NoneType' has no len()"
        else:
            assert 0.0 < item.errors["depth"] < 2e-3


def test_default_is_marked_once_per_group(topic):
    for group in topic.groups:
        marked = [item for item in topic.of(group) if item.default]
        assert len(marked) == 1, group
    first = next(item for item in topic.of(topic.groups[0]) if item.default)
    assert (first.method, first.setting) == ("implicit", "tolerance 1e-3")
    json.dumps(topic.as_json())


def test_errors_decrease_with_strips_and_tolerances(topic):
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
def test_solvers_converge_to_individual_passes(solver, changes):
    prepared, reference = end_of(WearTest(RIG, 2.0, changes), **{"evolution.stepper": EVERY_PASS})
    loose, close = (
        errors_of(
            EndState(
                prepared.problem, solved_by(solver, prepared.problem, prepared.stop, tolerance)
            ),
            reference,
        )
        for tolerance in (1e-2, 1e-6)
    )
    assert close["profile"] < 0.2 * loose["profile"]
    # a pass is a step of Euler's method, of first order in its wear
    assert max(close.values()) < 3e-5


def test_wear_of_both_bodies_is_solved():
    both = {"wear.roller.k_over_h": "1.1e-11 1/Pa"}
    prepared, reference = end_of(WearTest(RIG, 2.0, both), **{"evolution.stepper": EVERY_PASS})
    end = EndState(prepared.problem, solved_by("LSODA", prepared.problem, prepared.stop, 1e-6))
    assert reference.state.roller_depth.max() > 0.0
    assert max(errors_of(end, reference).values()) < 3e-5


def test_solver_reference_agrees_with_individual_passes():
    test = benchmark_of("hertz")
    strips = SHORT.grid().strips
    row, converged = test.exact(strips)
    assert row.method == "LSODA"
    assert row.counts["truth"] == converged.own["profile"]
    prepared = test.prepared(strips, stepper=EVERY_PASS)
    assert max(errors_of(converged.end, prepared.stepped(prepared.stop)).values()) < 2e-4


def test_solver_reference_is_converged():
    long = WearTest(RIG, 10.0)
    test = benchmark_of("hertz", long)
    _, converged = test.exact(long.grid().strips)
    assert all(0.0 < error < 3e-6 for error in converged.own.values())
    # errors are at least those of the reference
    assert converged.errors_of(converged.end) == converged.own
    (row,) = of_model(test, (1e-2,))
    assert row.errors["profile"] > converged.own["profile"] == row.counts["truth"]


def test_limit_of_contact_solves_stops_a_solver():
    prepared = PreparedTest(SHORT.scenario_with({}))
    with pytest.raises(StepError, match="more than 5 contact solves"):
        solved_by("LSODA", prepared.problem, prepared.stop, 1e-6, most=5)


def test_errors_are_relative():
    prepared, end = end_of()
    state = end.state
    deeper = replace(state, cylinder_depth=1.01 * state.cylinder_depth)
    errors = errors_of(EndState(prepared.problem, deeper), end)
    assert errors == pytest.approx({"depth": 0.01, "profile": 0.01, "volume": 0.01})
    assert set(errors_of(end, end).values()) == {0.0}


def test_refusal_is_reported_once():
    rows = of_steppers(benchmark_of("hertz"), (1e-1, 1e-2))
    refused = [item for item in rows if item.failed]
    assert [item.method for item in refused] == ["implicit"]
    assert "contact model 'hertz' takes no wear compliance" in refused[0].failed
    braked = {"creepage": {"drive": "free", "bearing_torque": "100 N m"}}
    (row,) = of_model(benchmark_of(DEFAULT_MODEL, WearTest(RIG, 0.2, braked)), (1e-3,))
    assert row.failed.startswith("the roller skids")


def test_stepper_with_many_steps_skips_low_tolerances(monkeypatch):
    monkeypatch.setattr(stepping_groups, "MOST_STEPS", 5)
    rows = of_steppers(benchmark_of(DEFAULT_MODEL), (1e-1, 1e-3, 1e-4))
    settings = [item.setting for item in rows if item.method == "explicit"]
    assert settings == ["tolerance 1e-1", "tolerance 1e-3"]


@pytest.mark.usefixtures("plugins")
def test_plugin_option_measures_one_model():
    topic = stepping(replace(QUICK, plugin="winkler"), lambda what, part: None)
    *steppers, models = topic.groups
    assert {item.method.split(",")[0] for item in topic.of(models)} == {"winkler", DEFAULT_MODEL}
    for group in steppers:
        assert {item.method for item in topic.of(group)} >= {"stabilised", "explicit", *SOLVERS}
        assert EVERY_PASS not in {item.method for item in topic.of(group)}
    with pytest.raises(PluginError, match="unknown-model"):
        stepping(replace(QUICK, plugin="unknown-model"), lambda what, part: None)
