"""Topic `stated-errors`: random tests in strata, references on disk, statistics."""

import json

import numpy as np
import pytest

import wearsim
from wearsim.errors import ResultsFileError, SolverError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import evolve
from wearsim.types import Grid
from wearsim_bench.figures.stated_errors import stated_errors_figure
from wearsim_bench.measure.measurement import Effort, Measurement
from wearsim_bench.stated_errors import references
from wearsim_bench.stated_errors.observed import OBSERVED
from wearsim_bench.stated_errors.random_tests import RandomTest
from wearsim_bench.stated_errors.references import (
    EACH_PASS,
    LONGEST_STEP,
    CappedStepper,
    Worn,
    computed_reference,
    fine_grid,
    reference_of,
    worn_at_end,
    worn_of,
)
from wearsim_bench.stated_errors.strata import ADHESION, CAM, FREE, SPRING, STRATA, random_test
from wearsim_bench.stated_errors.study import (
    CLEAR,
    LACKS,
    QUANTITIES,
    STATED,
    STEPS,
    STRIPS,
    Coverage,
    coverage,
    measured,
    stated,
    worn_of_result,
)
from wearsim_bench.stated_errors.topic import requirements, stated_errors
from wearsim_bench.stepping.runs import PreparedTest

OF_CAMS = {name for name in OBSERVED if name == "lift_error" or name.endswith("angle")}
QUICK = Effort(quick=True, repetitions=1)
SMALL = {"operation.passes": 300, "evolution.tolerance": 1e-2, "contact.strips": 31}
TEST = RandomTest("small", "rig-450min", SMALL)
STIFF = {"load.kind": "spring", "load.stiffness": "200000 N/mm", "operation.rollers": 1}
KEYS = {"load.stiffness", "load.thermal", "load", "roller.offset", "wear", "contact.tangential"}
CREEPAGE = {"yaw", "tilt", "differential_slip", "drive", "bearing_torque", "longitudinal"}


@pytest.fixture(scope="module")
def random_tests():
    """Return 200 random tests, and their scenarios."""
    tests = [random_test(3, number) for number in range(200)]
    return tests, [test.unchanged for test in tests]


def test_random_tests_are_valid_and_cover_all_features(random_tests):
    tests, scenarios = random_tests
    assert len({test.digest for test in tests}) == len(tests)
    assert {key for test in tests for key in test.changes} >= KEYS
    assert {key for test in tests for key in test.changes.get("creepage", {})} >= CREEPAGE
    assert {item.tolerance for item in tests} == {1e-2, 1e-3, 1e-4}
    assert {item.persistence for s in scenarios for item in s.random} >= {"per-test", "per-pass"}
    assert any(", 0.0\n" in text for test in tests for text in test.files.values())  # a pause
    numbers = [scenario.operation.rollers for scenario in scenarios]
    assert set(numbers) == {1, 2, 3}


def test_strata_alternate_and_have_their_features(random_tests):
    tests, scenarios = random_tests
    assert [test.stratum for test in tests[:5]] == list(STRATA)
    of = {name: scenarios[k :: len(STRATA)] for k, name in enumerate(STRATA)}
    assert all(scenario.cam is not None for scenario in of[CAM])
    assert all(1e-5 <= s.creepage.longitudinal <= 1e-4 for s in of[ADHESION])
    assert all(s.creepage.drive == "free" for s in of[FREE])
    stiffness = [1e-3 * s.load.options.stiffness for s in of[SPRING]]  # N/mm
    assert 1e2 <= min(stiffness) < 1e3
    assert 2e4 < max(stiffness) <= 2e5


def test_random_tests_are_reproducible():
    assert random_test(3, 5) == random_test(3, 5)
    assert random_test(3, 5).digest != random_test(4, 5).digest
    shorter = random_test(3, 5, share=0.1).changes["operation.passes"]
    assert shorter == pytest.approx(0.1 * random_test(3, 5).changes["operation.passes"], abs=1)


def test_digest_of_a_test_does_not_depend_on_its_tolerance_and_stepper():
    others = {"evolution.tolerance": 1e-4, "evolution.stepper": "stabilised"}
    assert RandomTest("small", "rig-450min", {**SMALL, **others}).digest == TEST.digest


def test_steps_of_a_reference_are_short_where_the_estimated_error_misses_a_falling_load():
    # a spring as stiff as the contact: the load decays within the longest steps of the default
    test = RandomTest("stiff", "rig-450min", {**SMALL, **STIFF, "operation.passes": 20_000})
    grid = Grid.spanning(-4e-3, 4e-3, 41)
    method, _, *every = worn_at_end(test, grid, 1e-6, LONGEST_STEP)
    assert (method, EACH_PASS) == ("per-pass", 20_000)
    prepared = PreparedTest(test.scenario(), grid)
    ends = []
    for longest in (LONGEST_STEP, 1e6):
        stepper, state = CappedStepper(1e-4, longest, False), fresh_state(prepared.problem)
        for advance in evolve(
            prepared.problem, state, stepper, prepared.stop, lambda _: np.inf, 10_000
        ):
            state = advance.end
            step = state.passes[0] - advance.path[0].passes[0]
            assert step < 1.01 or step <= 1.03 * longest * advance.path[0].passes[0]
        ends.append(np.abs(worn_of(prepared.problem, state).changes_from(worn_of(*every))).max())
    assert ends[0] < 1e-5 < ends[1]


def test_reference_has_the_stations_of_the_run_where_equal_ones_are_solved_once():
    changes = {"operation.turns": 20_000, "evolution.tolerance": 1e-2, "cam.stations": 2}
    test = RandomTest("cam", "cam-eccentric", {**changes, "contact.strips": 31})
    result = wearsim.run(test.scenario())
    grid = Grid(result.y, result.y[1] - result.y[0])
    *_, problem, state = worn_at_end(test, grid, 1e-3)
    own, stepped = worn_of_result(result), worn_of(problem, state)
    assert own.profiles.shape == stepped.profiles.shape
    assert np.abs(own.changes_from(stepped)).max() < 2e-2
    last = {name: column[-1] for name, column in result.raw.history.items()}
    assert stated(result)["depth"] == pytest.approx(
        (last["depth_error_by_steps"] + last["depth_error_by_strips"]).item() / own.depth, rel=1e-3
    )
    assert last["depth_error_by_stations"].item() > 0.0


def test_strips_of_a_reference_span_the_groove_and_resolve_the_fresh_patch():
    reference = computed_reference(TEST)
    worn = reference.cylinder_depth[0, 0, 0] > 0.0
    assert not worn[0]
    assert not worn[-1]
    assert worn.sum() > 100
    narrow = fine_grid(Grid.spanning(-1e-3, 1e-3, 21), 1e-3, 1e-3, 1)
    wide = fine_grid(Grid.spanning(-1e-2, 1e-2, 21), 1e-3, 1e-2, 1)
    many = fine_grid(Grid.spanning(-1e-2, 1e-2, 21), 1e-3, 1e-2, 20)
    assert narrow.spacing < 1e-3 / 48
    assert wide.spacing > narrow.spacing
    assert many.strips < wide.strips


def test_errors_of_depth_and_volume_are_relative_and_those_of_profiles_a_norm():
    y = np.linspace(-1.0, 1.0, 41)
    exact = Worn(y, np.array([1.0 - y**2]), 1.0, 4.0 / 3.0)
    other = Worn(y[::2], 1.1 * exact.profiles[:, ::2], 1.1, 1.0)
    assert other.changes_from(exact) == pytest.approx([0.1, 0.1, -0.25])


def test_reference_is_kept_in_the_folder(tmp_path, monkeypatch):
    reference = reference_of(TEST, tmp_path / "references")
    assert reference.method == "per-pass"
    monkeypatch.setattr(references, "computed_reference", lambda test: 1 / 0)
    again = reference_of(TEST, tmp_path / "references")
    assert np.array_equal(again.cylinder_depth, reference.cylinder_depth)
    assert np.array_equal(again.y, reference.y)
    assert again.method == reference.method
    assert again.volume == reference.volume
    assert again.observed.keys() == reference.observed.keys()
    assert again.observed["peak_pressure"] == reference.observed["peak_pressure"]
    changed = RandomTest("small", "rig-450min", {**SMALL, "operation.passes": 301})
    with pytest.raises(ZeroDivisionError):
        reference_of(changed, tmp_path / "references")
    with pytest.raises(ZeroDivisionError):
        reference_of(TEST, None)


def test_failure_of_a_reference_is_kept_too(tmp_path, monkeypatch):
    def fails(test):
        raise SolverError("it takes longer")

    monkeypatch.setattr(references, "computed_reference", fails)
    with pytest.raises(SolverError, match=r"it takes longer$"):
        reference_of(TEST, tmp_path)
    monkeypatch.undo()
    with pytest.raises(SolverError, match=r"it takes longer \(kept in small-"):
        reference_of(TEST, tmp_path)


def test_unreadable_reference_is_an_error(tmp_path):
    (tmp_path / f"small-{TEST.digest}-{references.SETTINGS}.npz").write_bytes(b"PK")
    with pytest.raises(ResultsFileError, match="delete it"):
        reference_of(TEST, tmp_path)


def test_true_and_stated_errors_are_measured(tmp_path):
    row = measured(TEST, tmp_path)
    assert row.failed == ""
    observed = [name for name in OBSERVED if name not in OF_CAMS | {"damage"}]
    assert set(row.errors) == {
        prefix + name for prefix in ("", STATED, STEPS, STRIPS) for name in QUANTITIES
    } | {prefix + name for prefix in ("", STATED) for name in observed}
    assert 0.0 < row.errors["peak_pressure"] < 0.2
    assert row.errors["normal_force"] < 1e-9
    assert 0.0 < row.errors["depth"] < 2e-2
    for name in ("depth", "volume"):  # relative to nearly the same values, so that errors add up
        parts = row.errors[STEPS + name], row.errors[STRIPS + name]
        assert row.errors[name] <= sum(parts) * 1.05
        assert row.errors[name] >= abs(parts[0] - parts[1]) * 0.95
    assert row.counts["tolerance"] == 1e-2
    assert len(list(tmp_path.iterdir())) == 2  # the reference, and that on the strips of the run
    lost = {**SMALL, "creepage": {"drive": "free", "bearing_torque": "100 N m"}}
    assert measured(RandomTest("lost", "rig-450min", lost), None).failed.startswith(CLEAR)


def test_observables_of_a_reference_are_those_of_a_run_on_fine_strips():
    result = wearsim.run(TEST.scenario(contact__strips=301, evolution__tolerance=1e-5))
    observed = computed_reference(TEST).observed
    assert set(observed) == set(OBSERVED) - OF_CAMS - {"damage"}
    for name, value in observed.items():
        own = np.ravel(result.raw.history[name][-1])
        assert value == pytest.approx(own, rel=1e-2), name


def test_reference_that_takes_too_long_is_named_in_the_row_of_its_test(monkeypatch):
    monkeypatch.setattr(references, "SECONDS", 0.0)
    row = measured(TEST, None)
    assert row.failed.startswith(LACKS + "the reference takes longer than 0 s")


def test_requirements_state_what_is_met():
    def row(number, true, stated, by_steps=0.0):
        errors = {"": true, STATED: stated, STEPS: by_steps, STRIPS: true}
        named = {prefix + name: value for prefix, value in errors.items() for name in QUANTITIES}
        stratum = STRATA[number % 5]
        return Measurement("tests", str(number), stratum, 1.0, named, counts={"tolerance": 1e-3})

    good = [row(number, 1e-4, 5e-4) for number in range(100)]
    assert "NOT MET" not in requirements(good)
    missed = requirements([*good[:90], *(row(k, 1e-3, 1e-4, 3e-3) for k in range(90, 100))])
    assert "NOT MET: depth covered in 90.0% of the tests" in missed
    assert "NOT MET: errors by steps up to 3 tolerances" in missed
    ended = [Measurement("tests", str(k), SPRING, failed=CLEAR + "lost") for k in range(6)]
    lacking = Measurement("tests", "7", SPRING, failed=LACKS + "slow")
    assert "NOT MET: 6 of 107 end with an error" in requirements([*good, *ended, lacking])
    assert "met: 1 of 101 lack a reference" in requirements([*good, lacking])


def test_coverage_counts_small_true_errors_as_covered():
    found = Coverage([1e-3, 1e-3, 1e-7, 2e-2], [5e-3, 5e-4, 0.0, 2e-2], [1e-2] * 4)
    assert (found.covered, found.met) == (3, 3)
    assert found.ratios == pytest.approx([5.0, 0.5, 1.0])
    assert found.counts["median"] == pytest.approx(1.0)
    assert "median" not in Coverage([1e-8], [0.0], [1e-2]).counts
    assert Coverage([1e-8], [0.0], [1e-2], [3e-3]).counts["greatest_step"] == pytest.approx(0.3)


@pytest.mark.slow
def test_study_lists_statistics_and_worst_tests(tmp_path):
    topic = stated_errors(
        QUICK, lambda what, part: None, seed=1, number=5, references=tmp_path, jobs=2
    )
    assert topic.groups[0] == "all tests"
    assert [row.setting for row in topic.of("tests")] == list(STRATA)
    for row in topic.of("all tests"):
        found = coverage(topic.of("tests"), row.method)
        assert row.counts["covered"] == found.covered
        title = f"not covered, {row.method}"
        done = [item for item in topic.of("tests") if row.method in item.errors]
        assert len(topic.of(title)) == len(done) - found.covered
        for item in topic.of(title):
            assert f"- {item.method}: " in topic.conclusions[title]
            (tmp_path / "again.toml").write_text(topic.files[f"{item.method}.toml"])
            again = wearsim.load_scenario(tmp_path / "again.toml")
            assert again.total_passes > 0
    json.dumps(topic.as_json())
    assert len(stated_errors_figure(topic, "").axes) == 3
