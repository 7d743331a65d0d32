"""Resumed runs are bitwise identical to unbroken runs."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from study_examples import (
    LOADS,
    OTHERS,
    ROLLERS,
    STEPPERS,
    run_differences,
    run_in_parts,
    run_once,
    short,
)

from tests.faulty_storage import WatchedStorage
from wearsim.errors import Interrupted
from wearsim.scenario import Scenario
from wearsim.studies.opening import open_results
from wearsim.studies.run import in_progress, run as studies
from wearsim.studies.run.recorder import Checkpointed, Event

pytestmark = pytest.mark.usefixtures("small_chunks")


SHORTER = {"recorded and thermal": {"operation.passes": 3000}}  # every interval takes its steps


def _matrix() -> list[object]:
    """Return all combinations of stepper, load and rollers with the steps to stop after.

    Each pair of a stepper with a load, of a stepper with rollers and of a load with rollers is in
    one that is not slow.
    """
    patterns = ((1, 9), (2, 5, 30), (4, 15))
    return [
        pytest.param(
            {**SHORTER.get(load, {}), **ROLLERS[rollers], **LOADS[load], **STEPPERS[stepper]},
            patterns[(s + r) % 3],
            id=f"{stepper}-{load}-{rollers}",
            marks=() if (s + p) % 3 == r else pytest.mark.slow,
        )
        for s, stepper in enumerate(STEPPERS)
        for p, load in enumerate(LOADS)
        for r, rollers in enumerate(ROLLERS)
    ]


@pytest.mark.parametrize(("overrides", "stops"), _matrix())
def test_resumed_run_equals_unbroken_run(
    overrides: dict[str, object], stops: tuple[int, ...], path: Path
) -> None:
    scenario = short(**overrides)
    unbroken = run_once(scenario)
    broken, parts = run_in_parts(scenario, path, *stops)
    assert parts >= 2
    assert run_differences(broken, unbroken) == []
    assert run_differences(open_results(path), unbroken) == []
    assert unbroken.depth[-1] > 0.0


@pytest.mark.parametrize("overrides", OTHERS.values(), ids=OTHERS)
def test_resumed_run_with_options_equals_unbroken_run(
    overrides: dict[str, object], path: Path
) -> None:
    scenario = short(**overrides)
    broken, parts = run_in_parts(scenario, path, 2, 4, 30)
    assert parts >= 2
    assert run_differences(broken, run_once(scenario)) == []


def few_steps(stepper: str, **overrides: object) -> Scenario:
    """Return the rig with a test of a few steps, since one that is stopped writes and reads files.

    Parameters
    ----------
    stepper : str
        One of STEPPERS.
    overrides : object
        As for `short`.
    """
    passes = 60 if stepper == "passes in Python" else 2000
    tolerance = 2e-4 if stepper == "stabilised" else 0.02
    coarse = {"operation.passes": passes, "evolution.tolerance": tolerance, "outputs.records": 2}
    return short(**{**STEPPERS[stepper], **coarse, **overrides})


@pytest.mark.parametrize("stepper", STEPPERS)
def test_run_stopped_after_every_step_equals_unbroken_run(stepper: str, path: Path) -> None:
    scenario = few_steps(stepper, **LOADS["spring"], **ROLLERS["wearing"])
    unbroken = studies.run(scenario)
    broken, parts = run_in_parts(scenario, path, 1)
    assert parts == len(unbroken.passes) - 1 > 2
    assert run_differences(broken, unbroken) == []


@pytest.mark.parametrize("stepper", STEPPERS)
def test_run_in_memory_equals_its_file(stepper: str, path: Path) -> None:
    scenario = short(**STEPPERS[stepper])
    in_memory, filed = run_once(scenario), studies.run(scenario, path)
    assert in_memory.path is None
    assert run_differences(in_memory, filed) == []
    assert run_differences(in_memory, open_results(path)) == []


def test_stopped_run_reports_its_progress(path: Path) -> None:
    scenario = short()
    with pytest.raises(Interrupted) as stop:
        studies.run(scenario, path, stop_requested=lambda: True)
    assert str(stop.value).endswith(f'of 6000; continue with wearsim.resume("{path}")')
    assert stop.value.at_shell.endswith(f"of 6000; continue with: wearsim resume {path}")
    stopped = open_results(path)
    assert not stopped.finished
    assert stopped.steps == 1
    assert 0.0 < stopped.passes[-1] < 6000
    with pytest.raises(Interrupted, match="nothing was written"):
        studies.run(scenario, stop_requested=lambda: True)


def test_stop_after_the_last_step_is_ignored(path: Path) -> None:
    scenario = short(evolution__step=6000)
    assert studies.run(scenario, path, stop_requested=lambda: True).finished


def _checkpoints(events: list[Event]) -> list[float]:
    return [event.passes for event in events if isinstance(event, Checkpointed)]


@pytest.mark.usefixtures("quick_disk")
@pytest.mark.parametrize("stepper", STEPPERS)
def test_checkpoints_do_not_change_steps(
    stepper: str, path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = few_steps(stepper)
    often: list[Event] = []
    every = few_steps(stepper, outputs__checkpoint_every="1e-9 s")
    many = studies.run(every, path, on_event=often.append)
    seldom: list[Event] = []
    monkeypatch.setattr(in_progress, "FIRST_CHECKPOINT", 30.0)
    few = studies.run(scenario, tmp_path / "few.h5", on_event=seldom.append)
    # at the start, after every step, and at the end of the run
    assert _checkpoints(often) == [*many.passes, many.passes[-1]]
    assert _checkpoints(seldom) == [0.0, few.passes[-1]]
    assert run_differences(many, few) == ["sha256", "scenario_text"]


@pytest.mark.usefixtures("quick_disk")
def test_first_checkpoints_come_soon(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = itertools.count(0.0, 0.1)  # each reading of the clock takes 0.1 s
    monkeypatch.setattr(in_progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    events: list[Event] = []
    result = studies.run(short(), path, on_event=events.append)
    assert len(result.passes) > len(_checkpoints(events)) > 2


def test_checkpoint_before_the_test_on_coarse_strips_continues(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = run_once(short())
    monkeypatch.setattr(in_progress, "FIRST_CHECKPOINT", 0.0)

    def stop_at_the_end(event: Event) -> None:
        if isinstance(event, Checkpointed) and event.passes == whole.passes[-1]:
            raise SystemExit

    with pytest.raises(SystemExit):
        studies.run(short(outputs__checkpoint_every="1e9 s"), path, on_event=stop_at_the_end)
    assert not open_results(path).finished
    resumed = studies.resume(path)
    assert resumed.finished
    assert run_differences(whole, resumed) == ["sha256", "scenario_text"]


def test_slow_disk_limits_the_checkpoints(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = few_steps("implicit", outputs__checkpoint_every="1e-9 s")
    for part in (math.inf, 1e-9):
        monkeypatch.setattr(in_progress, "WRITING", part)
        events: list[Event] = []
        result = studies.run(scenario, path, force=True, on_event=events.append)
        # at the start and the end, and the one by which the duration of writing is found
        assert len(_checkpoints(events)) == (3 if part < 1.0 else len(result.passes) + 1)


EXTENSIONS = {
    "even": {},
    "log": {"outputs.spacing": "log"},
    "every": {"outputs.every": "25 s"},
    "every_passes": {"outputs.every_passes": 1300},
    "recorded": LOADS["recorded and thermal"],
    "per-pass": STEPPERS["compiled passes"],
}


@pytest.mark.parametrize("overrides", EXTENSIONS.values(), ids=EXTENSIONS)
def test_finished_test_can_be_extended(overrides: dict[str, object], path: Path) -> None:
    before = studies.run(short(**overrides), path)
    after = studies.resume(path, until=200.0)
    assert after.finished
    assert (after.passes[-1], after.time[-1]) == (10_000.0, pytest.approx(200.0, rel=1e-12))
    assert after.raw.total_passes == 10_000
    rows = len(before.passes)
    for name, array in before.raw.history.items():  # the earlier history is unchanged
        if name.endswith(("_error", "_by_strips")):
            continue  # estimated again for the whole test
        np.testing.assert_array_equal(after.raw.history[name][:rows], array)
    kept = len(before.record_passes)
    np.testing.assert_array_equal(after.record_passes[:kept], before.record_passes)
    np.testing.assert_array_equal(after.profiles[:kept], before.profiles)
    assert (np.diff(after.passes) > 0.0).all()
    assert (np.diff(after.record_passes) > 0.0).all()
    assert (np.diff(after.depth) >= 0.0).all()
    assert after.depth[-1] > before.depth[-1]
    assert after.scenario.total_time == pytest.approx(200.0)
    assert "duration" in after.raw.scenario_text
    assert "passes = 6000" not in after.raw.scenario_text
    assert after.raw.sha256 == after.scenario.sha256 != before.raw.sha256
    assert run_differences(open_results(path), after) == []


def test_extended_test_keeps_record_intervals(path: Path) -> None:
    studies.run(short(), path)
    expected = [0, 1500, 3000, 4500, 6000, 7500, 9000, 10_000]
    assert studies.resume(path, until=200.0).record_passes.tolist() == expected
    # the end of a test is an additional record, which does not shift later ones
    expected += [10_500, 12_000, 12_500]
    assert studies.resume(path, until=250.0).record_passes.tolist() == expected


def test_extended_test_keeps_logarithmic_records(path: Path) -> None:
    studies.run(short(outputs__records=30, outputs__spacing="log"), path)
    found = studies.resume(path, until=240.0).record_passes
    expected = [0.0, *6000.0 ** (np.arange(1, 33) / 30.0), 12_000.0]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("stepper", ["implicit", "compiled passes"])
def test_resumed_extension_equals_unbroken_extension(
    stepper: str, path: Path, tmp_path: Path
) -> None:
    studies.run(short(**STEPPERS[stepper]), path)
    other = tmp_path / "other.h5"
    other.write_bytes(path.read_bytes())
    unbroken = studies.resume(path, until=300.0)
    with pytest.raises(Interrupted):
        studies.resume(other, until=300.0, stop_requested=lambda: True)
    assert 6000.0 < open_results(other).passes[-1] < 15_000.0
    assert run_differences(studies.resume(other), unbroken) == []


def test_test_cannot_end_before_its_present_state(path: Path) -> None:
    studies.run(short(), path)
    before = path.read_bytes()
    with pytest.raises(studies.ResultsFileError, match=r"already reached 2 min.*past 1\.5 min"):
        studies.resume(path, until=90.0)
    assert path.read_bytes() == before


def test_stopped_test_can_be_shortened(path: Path) -> None:
    with pytest.raises(Interrupted):
        studies.run(short(), path, stop_requested=lambda: True)
    result = studies.resume(path, until=60.0)
    assert (result.passes[-1], result.finished) == (3000.0, True)
    assert result.record_passes.tolist() == [0.0, 1500.0, 3000.0]


@pytest.mark.parametrize("until", [None, 120.0])
def test_resuming_finished_test_changes_nothing(until: float | None, path: Path) -> None:
    result = studies.run(short(), path)
    before = path.read_bytes(), path.stat().st_mtime_ns, path.stat().st_ino
    events: list[Event] = []
    again = studies.resume(path, until=until, on_event=events.append)
    assert (path.read_bytes(), path.stat().st_mtime_ns, path.stat().st_ino) == before
    assert run_differences(again, result) == []
    assert events == []


@pytest.mark.usefixtures("quick_disk")
def test_failure_of_the_last_write_is_completed_by_resume(path: Path) -> None:
    def fail_at_last(stage: str) -> None:
        if stage == "before rename":
            written.append(stage)
            if len(written) == 1 + len(whole.passes):
                raise OSError(28, "No space left on device")

    whole, written = studies.run(few_steps("implicit")), list[str]()
    scenario = few_steps("implicit", outputs__checkpoint_every="1e-9 s")
    with pytest.raises(studies.ResultsFileError, match="No space left"):
        studies.run(scenario, path, storage=WatchedStorage(fail_at_last))
    standing = open_results(path)
    assert (standing.passes[-1], standing.finished) == (2000.0, False)
    assert run_differences(studies.resume(path), whole) == ["sha256", "scenario_text"]
