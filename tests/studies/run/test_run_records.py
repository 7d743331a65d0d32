"""Records follow their schedule and do not change the steps."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from study_examples import LOADS, ROLLERS, STEPPERS, run_differences, short

from wearsim.errors import StepError
from wearsim.evolution.steppers.per_pass import PerPassStepper
from wearsim.evolution.steppers.step_doubling import StepDoublingStepper
from wearsim.studies.opening import open_results
from wearsim.studies.run import run as studies
from wearsim.studies.run.result import Result

pytestmark = pytest.mark.usefixtures("small_chunks")

PASSES = 6000
SCHEDULES: dict[str, dict[str, object]] = {
    "five": {"outputs.records": 5},
    "fifty": {"outputs.records": 50},
    "log": {"outputs.records": 12, "outputs.spacing": "log"},
    "passes": {"outputs.every_passes": 1700},
    "time": {"outputs.every": "36 s"},  # 1800 passes, except for round-off
    "default": {},
}
EXPECTED = {
    "five": np.arange(0, 6001, 1200),
    "fifty": np.arange(0, 6001, 120),
    "log": np.array([0.0, *PASSES ** (np.arange(1, 13) / 12)]),
    "passes": np.array([0, 1700, 3400, 5100, 6000]),
    "time": np.array([0, 1800, 3600, 5400, 6000]),
    "default": np.arange(0, 6001, 1500),
}
# values that depend on the schedule; all others must be bitwise identical
DEPENDENT = {"sha256", "scenario_text"}


def _runs(**overrides: object) -> dict[str, Result]:
    return {
        name: studies.run(short(**{**overrides, **schedule}))
        for name, schedule in SCHEDULES.items()
    }


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("stepper", ["implicit", "stabilised", "explicit"])
def test_records_do_not_change_steps(stepper: str, load: str) -> None:
    coarse = {"evolution.tolerance": 1e-3} if stepper == "stabilised" else {}
    runs = _runs(**{**ROLLERS["wearing"], **LOADS[load], **STEPPERS[stepper], **coarse})
    first = runs["five"]
    for name, run in runs.items():
        changed = [item for item in run_differences(run, first) if not item.startswith("records.")]
        assert set(changed) <= DEPENDENT, name
        np.testing.assert_allclose(run.record_passes, EXPECTED[name], rtol=1e-12)
        # records at the same passes are bitwise identical in all schedules
        for here, there in zip(*_shared(run, first), strict=True):
            for variable in run.raw.records:
                np.testing.assert_array_equal(
                    run.raw.records[variable][here], first.raw.records[variable][there]
                )


def _shared(one: Result, other: Result) -> tuple[list[int], list[int]]:
    """Return the numbers of the records that two runs made at the same passes."""
    _, here, there = np.intersect1d(one.record_passes, other.record_passes, return_indices=True)
    assert len(here) >= 2
    return here.tolist(), there.tolist()


def _short_side_steps(monkeypatch: pytest.MonkeyPatch, longest: float) -> None:
    """Make side steps longer than `longest` passes fail."""
    side_step = StepDoublingStepper.side_step

    def step(self, problem, state, passes):
        if (passes > longest).any():
            raise StepError(f"{passes} passes are too many")
        return side_step(self, problem, state, passes)

    monkeypatch.setattr(StepDoublingStepper, "side_step", step)


def test_failing_side_step_is_halved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario = short(**{"outputs.records": 12, "outputs.spacing": "log"})
    whole = studies.run(scenario)
    _short_side_steps(monkeypatch, 40.0)
    halves = studies.run(scenario)
    assert {name.partition(".")[0] for name in run_differences(halves, whole)} <= {"records"}
    np.testing.assert_array_equal(halves.record_passes, whole.record_passes)
    difference = np.abs(halves.profiles - whole.profiles).max()
    assert 0.0 < difference < 1e-3 * whole.depth[-1]


def test_record_without_side_step_fails_the_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    _short_side_steps(monkeypatch, 0.0)
    path = tmp_path / "failed.h5"
    with pytest.raises(StepError, match="too many"):
        studies.run(short(**{"outputs.records": 12, "outputs.spacing": "log"}), path)
    assert "too many" in open_results(path).failure


@pytest.mark.parametrize("stepper", ["compiled passes", "passes in Python"])
def test_records_do_not_change_per_pass_steps(stepper: str) -> None:
    schedules = {"outputs.records": 7}, {"outputs.every_passes": 13}, {"outputs.spacing": "log"}
    common = {**ROLLERS["wearing"], **LOADS["spring"], **STEPPERS[stepper]}
    common["operation.passes"] = 100
    first, *others = [studies.run(short(**{**common, **schedule})) for schedule in schedules]
    for other in others:
        state, expected = other.raw.checkpoint, first.raw.checkpoint
        for name in ("cylinder_depth", "roller_depth", "terms", "passes", "steps", "energy"):
            np.testing.assert_array_equal(state[name], expected[name], err_msg=name)
        for name, array in first.raw.records.items():
            exact = name.endswith("profile") or name.startswith("record")
            found, last = other.raw.records[name][-1], array[-1]
            # contacts solved from different initial values agree within the Newton tolerance
            tolerance = 0.0 if exact else 2e-8 * np.abs(last).max()
            np.testing.assert_allclose(found, last, rtol=0.0, atol=tolerance, err_msg=name)


@pytest.mark.parametrize("stepper", ["compiled passes", "passes in Python"])
def test_per_pass_stepper_records_whole_passes(
    stepper: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("the per-pass stepper stops at records and needs no side step")

    monkeypatch.setattr(PerPassStepper, "side_step", refuse)
    common = {**STEPPERS[stepper], "operation.passes": 100}
    for schedule in ({"outputs.records": 7}, {"outputs.records": 30, "outputs.spacing": "log"}):
        run = studies.run(short(**{**common, **schedule}))
        due = [100 * k / 7 for k in range(8)]
        if "outputs.spacing" in schedule:
            due = [0.0, *(100 ** (k / 30) for k in range(1, 31))]
        expected = sorted({math.ceil(round(passes, 9)) for passes in due})
        assert run.record_passes.tolist() == expected
        assert run.steps == 100
        assert set(expected) <= set(run.passes)


@pytest.mark.parametrize("rollers", ROLLERS)
@pytest.mark.parametrize("stepper", STEPPERS)
def test_records_cover_initial_and_final_state(stepper: str, rollers: str) -> None:
    run = studies.run(short(**{**ROLLERS[rollers], **LOADS["spring"], **STEPPERS[stepper]}))
    records, checkpoint = run.raw.records, run.raw.checkpoint
    assert records["record_passes"][0] == 0.0
    assert not records["cylinder_depth_profile"][0].any()
    assert not records["roller_depth_profile"][0].any()
    assert records["record_passes"][-1] == run.passes[-1] == run.raw.total_passes
    assert records["record_time"][-1] == run.time[-1]
    np.testing.assert_array_equal(
        records["cylinder_depth_profile"][-1], checkpoint["cylinder_depth"][:, 0]
    )
    np.testing.assert_array_equal(
        records["roller_depth_profile"][-1], checkpoint["roller_depth"][0]
    )
    assert records["cylinder_depth_profile"][-1].max() == run.depth[-1]
    assert (np.diff(records["record_passes"]) > 0.0).all()


@pytest.mark.parametrize("every", ["10 s", "7.5 s", "1 s"])
def test_time_interval_gives_no_duplicate_last_record(every: str) -> None:
    # 1000 rpm is 50 passes per second less round-off, which also affects the last record
    run = studies.run(short(operation__duration="30 s", outputs__every=every))
    seconds = float(every.split(maxsplit=1)[0])
    np.testing.assert_allclose(run.record_time, np.arange(0.0, 30.1, seconds), atol=1e-9)
    assert run.record_passes[-2] < run.raw.total_passes - 1.0


def test_records_agree_with_interpolated_history() -> None:
    run = studies.run(short(evolution__tolerance=1e-4, outputs__records=23))
    between = np.interp(run.record_passes, run.passes, run.depth)
    np.testing.assert_allclose(run.profiles.max(axis=1), between, rtol=2e-3)
    loads = run.line_load.sum(axis=1) * (run.y[1] - run.y[0])
    np.testing.assert_allclose(loads, 300.0, rtol=1e-9)
