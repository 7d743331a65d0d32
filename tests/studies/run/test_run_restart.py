"""A run that is stopped and goes on ends as if unbroken, to the bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from study_examples import LOADS, OTHERS, ROLLERS, STEPPERS, run_in_parts, short, unlike

from wearsim.results import open_results
from wearsim.studies.run import run as replay
from wearsim.studies.run.events import Checkpointed, Event

pytestmark = pytest.mark.usefixtures("small_chunks")


def _matrix() -> list[object]:
    """Return every mix of stepper, load and rollers with the steps to stop after."""
    kinds = [(s, load, r) for s in STEPPERS for load in LOADS for r in ROLLERS]
    patterns = ((1, 9), (2, 5, 30), (4, 15))
    return [
        pytest.param(
            {**ROLLERS[rollers], **LOADS[load], **STEPPERS[stepper]},
            patterns[number % len(patterns)],
            id=f"{stepper}-{load}-{rollers}",
        )
        # each row of three meets every pattern, and the next rows meet them in another order
        for number, (stepper, load, rollers) in ((k + k // 3, kind) for k, kind in enumerate(kinds))
    ]


@pytest.mark.parametrize(("overrides", "stops"), _matrix())
def test_that_a_run_in_parts_equals_an_unbroken_one(
    overrides: dict[str, object], stops: tuple[int, ...], path: Path
) -> None:
    scenario = short(**overrides)
    unbroken = replay.run(scenario)
    broken, parts = run_in_parts(scenario, path, *stops)
    assert parts >= 2
    assert unlike(broken, unbroken) == []
    assert unlike(open_results(path), unbroken) == []
    assert unbroken.depth[-1] > 0.0


@pytest.mark.parametrize("overrides", OTHERS.values(), ids=OTHERS)
def test_that_other_tests_in_parts_equal_unbroken_ones(
    overrides: dict[str, object], path: Path
) -> None:
    scenario = short(**overrides)
    broken, parts = run_in_parts(scenario, path, 2, 4)
    assert parts >= 2
    assert unlike(broken, replay.run(scenario)) == []


@pytest.mark.parametrize("stepper", STEPPERS)
def test_that_a_run_may_be_stopped_after_every_step(stepper: str, path: Path) -> None:
    scenario = short(**{**LOADS["spring"], **ROLLERS["wearing"], **STEPPERS[stepper]})
    unbroken = replay.run(scenario)
    broken, parts = run_in_parts(scenario, path, 1)
    assert parts == len(unbroken.passes) - 1
    assert unlike(broken, unbroken) == []


@pytest.mark.parametrize("stepper", STEPPERS)
def test_that_a_run_in_memory_equals_its_file(stepper: str, path: Path) -> None:
    scenario = short(**STEPPERS[stepper])
    in_memory, filed = replay.run(scenario), replay.run(scenario, path)
    assert in_memory.path is None
    assert unlike(in_memory, filed) == []
    assert unlike(in_memory, open_results(path)) == []


def test_that_a_stopped_run_says_where_it_stands(path: Path) -> None:
    scenario = short()
    with pytest.raises(replay.Interrupted, match=rf"of 6000; continue with: wearsim resume {path}"):
        replay.run(scenario, path, stop_requested=lambda: True)
    stopped = open_results(path)
    assert not stopped.finished
    assert stopped.steps == 1
    assert 0.0 < stopped.passes[-1] < 6000
    with pytest.raises(replay.Interrupted, match="nothing was written"):
        replay.run(scenario, stop_requested=lambda: True)


def test_that_a_stop_after_the_last_step_is_no_stop(path: Path) -> None:
    scenario = short(evolution__step=6000)
    assert replay.run(scenario, path, stop_requested=lambda: True).finished


def _checkpoints(events: list[Event]) -> list[float]:
    return [event.passes for event in events if isinstance(event, Checkpointed)]


@pytest.mark.usefixtures("quick_disk")
@pytest.mark.parametrize("stepper", STEPPERS)
def test_that_checkpoints_never_move_a_step(stepper: str, path: Path, tmp_path: Path) -> None:
    scenario = short(**STEPPERS[stepper])
    often: list[Event] = []
    every = short(**STEPPERS[stepper], outputs__checkpoint_every="1e-9 s")
    many = replay.run(every, path, on_event=often.append)
    seldom: list[Event] = []
    few = replay.run(scenario, tmp_path / "few.h5", on_event=seldom.append)
    # at the start, after every step, and once more when the run is finished
    assert _checkpoints(often) == [*many.passes, many.passes[-1]]
    assert _checkpoints(seldom) == [0.0, few.passes[-1]]
    assert unlike(many, few) == ["sha256", "scenario_text"]


def test_that_a_slow_disk_takes_a_fiftieth_of_the_time(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = short(outputs__checkpoint_every="1e-9 s")
    for seconds in (1e-9, 1e9):
        written = property(lambda _, held=seconds: held, lambda _, found: None)
        monkeypatch.setattr(replay._RunInProgress, "_last_write", written)
        events: list[Event] = []
        result = replay.run(scenario, path, force=True, on_event=events.append)
        assert len(_checkpoints(events)) == (2 if seconds > 1.0 else len(result.passes) + 1)


EXTENSIONS = {
    "even": {},
    "log": {"outputs.spacing": "log"},
    "every": {"outputs.every": "25 s"},
    "every_passes": {"outputs.every_passes": 1300},
    "recorded": LOADS["recorded and thermal"],
    "per-pass": STEPPERS["compiled passes"],
}


@pytest.mark.parametrize("overrides", EXTENSIONS.values(), ids=EXTENSIONS)
def test_that_a_finished_test_can_be_extended(overrides: dict[str, object], path: Path) -> None:
    before = replay.run(short(**overrides), path)
    after = replay.resume(path, until=200.0)
    assert after.finished
    assert (after.passes[-1], after.time[-1]) == (10_000.0, pytest.approx(200.0, rel=1e-12))
    assert after.raw.total_passes == 10_000
    rows = len(before.passes)
    for name, array in before.raw.history.items():  # what was, stands
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
    assert unlike(open_results(path), after) == []


def test_that_records_go_on_in_the_same_rhythm(path: Path) -> None:
    replay.run(short(), path)
    expected = [0, 1500, 3000, 4500, 6000, 7500, 9000, 10_000]
    assert replay.resume(path, until=200.0).record_passes.tolist() == expected
    # the end of a test is a record out of the rhythm, which goes on as if it were none
    expected += [10_500, 12_000, 12_500]
    assert replay.resume(path, until=250.0).record_passes.tolist() == expected


def test_that_logarithmic_records_go_on_in_the_same_rhythm(path: Path) -> None:
    replay.run(short(outputs__records=30, outputs__spacing="log"), path)
    found = replay.resume(path, until=240.0).record_passes
    expected = [0.0, *6000.0 ** (np.arange(1, 33) / 30.0), 12_000.0]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("stepper", ["implicit", "compiled passes"])
def test_that_an_extension_in_parts_equals_an_unbroken_one(
    stepper: str, path: Path, tmp_path: Path
) -> None:
    replay.run(short(**STEPPERS[stepper]), path)
    other = tmp_path / "other.h5"
    other.write_bytes(path.read_bytes())
    unbroken = replay.resume(path, until=300.0)
    with pytest.raises(replay.Interrupted):
        replay.resume(other, until=300.0, stop_requested=lambda: True)
    assert 6000.0 < open_results(other).passes[-1] < 15_000.0
    assert unlike(replay.resume(other), unbroken) == []


def test_that_a_test_cannot_end_before_it_stands(path: Path) -> None:
    replay.run(short(), path)
    before = path.read_bytes()
    with pytest.raises(replay.ResultsFileError, match=r"already reached 2 min.*past 1\.5 min"):
        replay.resume(path, until=90.0)
    assert path.read_bytes() == before


def test_that_a_stopped_test_can_be_cut_short(path: Path) -> None:
    with pytest.raises(replay.Interrupted):
        replay.run(short(), path, stop_requested=lambda: True)
    result = replay.resume(path, until=60.0)
    assert (result.passes[-1], result.finished) == (3000.0, True)
    assert result.record_passes.tolist() == [0.0, 1500.0, 3000.0]


@pytest.mark.parametrize("until", [None, 120.0])
def test_that_a_finished_test_is_left_alone(until: float | None, path: Path) -> None:
    result = replay.run(short(), path)
    before = path.read_bytes(), path.stat().st_mtime_ns, path.stat().st_ino
    events: list[Event] = []
    again = replay.resume(path, until=until, on_event=events.append)
    assert (path.read_bytes(), path.stat().st_mtime_ns, path.stat().st_ino) == before
    assert unlike(again, result) == []
    assert events == []


def test_that_a_test_killed_before_its_last_write_is_finished_by_it(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(self: replay._RunInProgress, finished: bool = False) -> None:
        write(self, False)
        if finished:
            raise OSError

    write = replay._RunInProgress._write
    with monkeypatch.context() as patch:
        patch.setattr(replay._RunInProgress, "_write", fail)
        with pytest.raises(OSError):  # noqa: PT011  (it has no text)
            replay.run(short(), path)
    standing = open_results(path)
    assert (standing.passes[-1], standing.finished) == (6000.0, False)
    assert unlike(replay.resume(path), replay.run(short())) == []
