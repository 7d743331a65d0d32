"""Topic `random`: random scenarios, transformed scenarios, invariants and reproducers."""

from __future__ import annotations

import math

import pytest

import wearsim
from wearsim_bench.measure.measurement import Effort, Measurement
from wearsim_bench.random import invariants
from wearsim_bench.random.invariants import EXCESS, INVARIANTS, measured
from wearsim_bench.random.scenarios import random_scenario
from wearsim_bench.random.smallest import smallest
from wearsim_bench.random.topic import ERRORS, SUMMARY, random, reproducer, topic_of
from wearsim_bench.random.transformations import SYSTEMS, UnitSystem, in_units, mirrored
from wearsim_bench.stated_errors.random_tests import RandomTest
from wearsim_bench.stated_errors.study import TESTS

SMALL = {"operation.passes": 300, "evolution.tolerance": 1e-2, "contact.strips": 31}
ROW = Measurement(TESTS, "1-0", "")


def test_scenarios_repeat_and_span_the_language():
    tests = [random_scenario(1, number)[0] for number in range(55)]
    assert [test.changes for test in tests[:5]] == [
        random_scenario(1, number)[0].changes for number in range(5)
    ]
    scenarios = [test.scenario() for test in tests]
    models = {scenario.contact.model for scenario in scenarios}
    assert models == {"slender", "hertz", "hertz-fastsim", "semi-hertzian"}
    assert {scenario.load.kind for scenario in scenarios} >= {
        "constant", "recorded", "spring", "follower", "follower-arm",
    }  # fmt: skip
    assert {test.base for test in tests} >= {"rig-450min", "cam-groove", "cam-swinging"}
    assert any(scenario.random for scenario in scenarios)
    assert any(scenario.fatigue for scenario in scenarios)
    assert any(scenario.roller.width for scenario in scenarios)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("mm", 2.0), ("N", 4.0), ("MPa", 1.0), ("1/Pa", 1.0), ("N m", 8.0), ("s", 1)],
)
def test_length_scaling_keeps_pressures(unit: str, factor: float):
    assert SYSTEMS["length"].factor(unit) == factor


def test_units_change_every_quantity_and_file():
    test = RandomTest("t", "rig-logged-load", {})
    changed = in_units(test.scenario(), UnitSystem(length=2.0, mass=2.0))
    whole = test.scenario()
    assert changed.roller.radius == 2.0 * whole.roller.radius
    assert changed.total_passes == whole.total_passes
    assert changed.outputs.width_threshold == 2.0 * whole.outputs.width_threshold
    (name,) = whole.files
    last = [float(each.files[name].split(",")[-1]) for each in (whole, changed)]
    assert last[1] == 4.0 * last[0]


def test_mirror_image_of_a_mirror_image_is_the_scenario():
    changes = {"roller.offset": ["1 mm", "-2 mm", "0 mm"], "creepage.yaw": "1 mrad"}
    scenario = RandomTest("t", "rig-450min", changes).scenario()
    image = mirrored(scenario)
    assert image.roller.offset == tuple(-value for value in scenario.roller.offset)
    assert image.creepage.yaw == -1e-3
    assert mirrored(image).roller.offset == scenario.roller.offset


@pytest.mark.parametrize("name", INVARIANTS)
def test_invariant_holds_for_a_small_test(name: str):
    changes = {
        **SMALL,
        "friction.coefficient": {"distribution": "uniform", "low": 0.1, "high": 0.2},
    }
    row = measured(name, RandomTest("t", "rig-450min", changes).scenario(), ROW)
    assert not row.failed
    if name == "truth within stated errors":
        assert set(row.errors) == set(ERRORS)


@pytest.fixture
def heavy_rollers_wear_less(monkeypatch):
    """Let every test with a load above 500 N break the invariant of runs."""

    def holds(subject):
        return 2.0 if subject.scenario.load.options.normal_force > 500.0 else 0.0

    monkeypatch.setitem(INVARIANTS, next(iter(INVARIANTS)), holds)


@pytest.mark.usefixtures("heavy_rollers_wear_less")
def test_smallest_reproducer_has_only_what_matters():
    changes = {**SMALL, "load.normal_force": "600 N", "friction.coefficient": 0.2}
    row = measured(next(iter(INVARIANTS)), RandomTest("t", "rig-450min", changes).scenario(), ROW)
    assert row.failed == "2 times what is allowed"
    test = RandomTest("1-0", "rig-450min", changes)
    assert smallest(test, row).changes == {"load.normal_force": "600 N"}
    ((name, text),) = reproducer(smallest(test, row), row).items()
    assert name == "1-0-runs-to-its-end.toml"
    assert wearsim.Scenario.from_toml(text).load.options.normal_force == 600.0


def test_a_fault_a_refusal_and_an_inapplicable_invariant_are_told_apart(monkeypatch):
    name = next(iter(INVARIANTS))
    scenario = RandomTest("t", "rig-450min", SMALL).scenario()
    outcomes = {}
    for error in (KeyError("x"), wearsim.SolverError("no step"), invariants.InapplicableError()):

        def fails(_subject, error=error):
            raise error

        monkeypatch.setitem(INVARIANTS, name, fails)
        row = measured(name, scenario, ROW)
        outcomes[type(error).__name__] = row.failed, row.remark
    assert outcomes == {
        "KeyError": ("raised KeyError: 'x'", ""),
        "SolverError": ("", "ends with an error: no step"),
        "InapplicableError": ("", ""),
    }


def test_topic_counts_and_lists_broken_invariants():
    name = next(iter(INVARIANTS))
    rows = [
        Measurement(TESTS, "1-0", name, counts={EXCESS: 0.5}),
        Measurement(TESTS, "1-1", name, counts={EXCESS: 3.0}, failed="3 times what is allowed"),
        Measurement(TESTS, "1-2", name, remark="ends with an error: skids"),
    ]
    topic = topic_of(rows, 1, 3, {"1-1-runs.toml": "title = 'x'"})
    (first, *_) = topic.of(SUMMARY)
    assert first.counts == {"tests": 2, "clear": 1, "broken": 1, EXCESS: 3.0}
    assert "1-1, " + name in topic.conclusions[SUMMARY]
    assert "title = 'x'" in topic.conclusions[SUMMARY]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 12, 13, 15])
def test_ten_random_scenarios_meet_their_invariants(seed: int):
    topic = random(Effort(quick=True), lambda what, part: None, seed=seed, number=10)
    counts = {row.method: row.counts for row in topic.of(SUMMARY)}
    truth = counts.pop("truth within stated errors")
    assert not any(found["broken"] for found in counts.values()), topic.conclusions[SUMMARY]
    # errors are estimates of three quantities of each test
    assert truth["covered"] >= 0.8 * 3 * truth["tests"], topic.conclusions[SUMMARY]
    assert counts["runs to its end, finite and not negative"]["clear"] <= 2


def test_scenarios_of_a_seed_meet_their_invariants():
    topic = random(Effort(quick=True, repetitions=1), lambda what, part: None, seed=3, number=1)
    assert "All invariants hold." in topic.conclusions[SUMMARY]
    assert all(math.isfinite(row.counts.get(EXCESS, 0.0)) for row in topic.measurements)
