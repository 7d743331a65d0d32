"""Topic `stated-errors`: random tests, references on disk, statistics."""

import json

import numpy as np
import pytest

from wearsim.errors import ResultsFileError
from wearsim.evolution.steppers.per_pass import is_compiled
from wearsim_bench.figures.stated_errors import stated_errors_figure
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.stated_errors import references
from wearsim_bench.stated_errors.random_tests import (
    PASSES,
    RandomTest,
    random_test,
)
from wearsim_bench.stated_errors.references import computed_reference, reference_of
from wearsim_bench.stated_errors.study import QUANTITIES, STATED, Coverage, coverage, measured
from wearsim_bench.stated_errors.topic import stated_errors
from wearsim_bench.stepping.runs import PreparedTest

QUICK = Effort(quick=True, repetitions=1)
SMALL = {"operation.passes": 300, "evolution.tolerance": 1e-2, "contact.strips": 31}
TEST = RandomTest("small", "rig-450min", SMALL)
FEATURES = {
    "load.stiffness",
    "load.thermal",
    "load",
    "creepage.yaw",
    "creepage.tilt",
    "creepage.differential_slip",
    "creepage",
    "operation.rollers",
    "roller.offset",
    "wear",
}


def test_random_tests_are_valid_and_cover_all_features():
    tests = [random_test(3, number) for number in range(120)]
    assert len({test.digest for test in tests}) == len(tests)
    assert {key for test in tests for key in test.changes} >= FEATURES
    scenarios = [test.scenario() for test in tests]
    assert {item.tolerance for item in tests} == {1e-2, 1e-3, 1e-4}
    passes = [scenario.total_passes for scenario in scenarios]
    assert PASSES[0] - 1 <= min(passes) < 6e3
    assert 8e5 < max(passes) <= PASSES[1]
    assert {item.persistence for s in scenarios for item in s.random} >= {"per-test", "per-pass"}
    assert any(", 0.0\n" in text for test in tests for text in test.files.values())  # a pause


def test_random_tests_are_reproducible():
    assert random_test(3, 5) == random_test(3, 5)
    assert random_test(3, 5).digest != random_test(4, 5).digest
    shorter = random_test(3, 5, share=0.1).changes["operation.passes"]
    assert shorter == pytest.approx(0.1 * random_test(3, 5).changes["operation.passes"], abs=1)


def test_reference_is_kept_in_the_folder(tmp_path, monkeypatch):
    reference = reference_of(TEST, tmp_path / "references")
    assert reference.method == "per-pass"
    monkeypatch.setattr(references, "computed_reference", lambda test: 1 / 0)
    again = reference_of(TEST, tmp_path / "references")
    assert np.array_equal(again.cylinder_depth, reference.cylinder_depth)
    assert np.array_equal(again.y, reference.y)
    assert again.method == reference.method
    changed = RandomTest("small", "rig-450min", {**SMALL, "operation.passes": 301})
    with pytest.raises(ZeroDivisionError):
        reference_of(changed, tmp_path / "references")
    with pytest.raises(ZeroDivisionError):
        reference_of(TEST, None)


def test_unreadable_reference_is_an_error(tmp_path):
    (tmp_path / f"small-{TEST.digest}.npz").write_bytes(b"PK")
    with pytest.raises(ResultsFileError, match="delete it"):
        reference_of(TEST, tmp_path)


def test_wear_without_compiled_loop_is_solved_by_lsoda(monkeypatch):
    regimes = {"mild": "8.6e-8 kg/J", "severe": "5e-3 kg/m^3", "catastrophic_from": "1e6 Pa"}
    law = {"law": "t-gamma", "cylinder": regimes, "roller": {"factor": 0.0}}
    test = RandomTest("nonlinear", "rig-450min", {**SMALL, "wear": law})
    assert not is_compiled(PreparedTest(test.scenario()).problem)
    single = computed_reference(test)
    monkeypatch.setattr(references, "SLOW_PASSES", (0, 100))
    solved = computed_reference(test)
    assert (single.method, solved.method) == ("per-pass", "LSODA, 1e-07")
    assert solved.cylinder_depth.max() == pytest.approx(single.cylinder_depth.max(), rel=2e-3)


def test_true_and_stated_errors_are_measured(tmp_path):
    row = measured(TEST, tmp_path)
    assert row.failed == ""
    assert set(row.errors) == {*QUANTITIES, *(STATED + name for name in QUANTITIES)}
    assert 0.0 < row.errors["depth"] < 1e-2
    assert row.counts["tolerance"] == 1e-2
    lost = {**SMALL, "creepage": {"drive": "free", "bearing_torque": "100 N m"}}
    assert measured(RandomTest("lost", "rig-450min", lost), None).failed.startswith("the roller")


def test_coverage_counts_small_true_errors_as_covered():
    found = Coverage([1e-3, 1e-3, 1e-7, 2e-2], [5e-3, 5e-4, 0.0, 2e-2], [1e-2] * 4)
    assert (found.covered, found.met) == (3, 3)
    assert found.ratios == pytest.approx([5.0, 0.5, 1.0])
    assert found.counts["median"] == pytest.approx(1.0)
    assert Coverage([1e-8], [0.0], [1e-2]).counts == {"tests": 1, "covered": 1, "met": 1}


@pytest.mark.slow
def test_study_lists_statistics_and_worst_tests(tmp_path):
    topic = stated_errors(QUICK, lambda what, part: None, seed=1, number=6, references=tmp_path)
    assert len(list(tmp_path.iterdir())) == 6
    assert topic.groups[0] == "all tests"
    assert len(topic.of("tests")) == 6
    for row in topic.of("all tests"):
        found = coverage(topic.of("tests"), row.method)
        assert row.counts["covered"] == found.covered
        title = f"not covered, {row.method}"
        assert len(topic.of(title)) == min(6 - found.covered, 5)
        for item in topic.of(title):
            assert f"- {item.method}: rig" in topic.conclusions[title]
    json.dumps(topic.as_json())
    assert len(stated_errors_figure(topic, "").axes) == 3
