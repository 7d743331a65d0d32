"""Runs that are interrupted, fail, or cannot start."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from study_examples import LOADS, STEPPERS, run_differences, run_once, short

from tests.faulty_storage import WatchedStorage, one_of_each
from wearsim.errors import (
    CapabilityError,
    Interrupted,
    ResultsFileError,
    ScenarioError,
    SolverError,
    StepError,
)
from wearsim.evolution.steppers import implicit
from wearsim.results.io.files import write_results
from wearsim.scenario import Scenario, parse_scenario
from wearsim.studies import schedule
from wearsim.studies.opening import open_results
from wearsim.studies.run import recorder, run as studies
from wearsim.studies.run.recorder import Event, Warned
from wearsim.studies.run.result import Result, read_results

pytestmark = pytest.mark.usefixtures("small_chunks", "quick_disk")

OFTEN = {"outputs.checkpoint_every": "1e-9 s"}


class InterruptAtCall:
    """Replacement of a function that raises KeyboardInterrupt at one of its calls."""

    def __init__(self, function: Callable[..., object], at: int, late: bool = False) -> None:
        self.function, self.left, self.late = function, at, late

    def __call__(self, *args: object, **kwargs: object) -> object:
        self.left -= 1
        if self.left == 0 and not self.late:
            raise KeyboardInterrupt
        value = self.function(*args, **kwargs)
        if self.left == 0:
            raise KeyboardInterrupt
        return value


PLACES = [
    (implicit, "implicit_step"),  # three in a step: two halves and the coarse solution
    (schedule, "take_side_step"),
    (recorder, "record_row"),
    (recorder, "history_row"),
]


@pytest.fixture(scope="module")
def nine_records() -> tuple[Scenario, Result]:
    scenario = short(outputs__records=9, evolution__tolerance=0.005)
    return scenario, studies.run(scenario)


@pytest.mark.parametrize(
    ("module", "name", "at", "late"),
    [  # each pair of two of the three is in one that is not slow
        pytest.param(
            *PLACES[number],
            (2, 7)[place],
            bool(late),
            id=f"{PLACES[number][1]}-{(2, 7)[place]}-{'after' if late else 'before'}",
            marks=() if (number + place + late) % 2 == 0 else pytest.mark.slow,
        )
        for number, place, late in itertools.product(range(4), range(2), range(2))
    ],
)
def test_interrupt_in_a_step_keeps_the_previous_step(
    module: object,
    name: str,
    at: int,
    late: bool,
    nine_records: tuple[Scenario, Result],
    path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario, unbroken = nine_records
    with monkeypatch.context() as patch:
        patch.setattr(module, name, InterruptAtCall(getattr(module, name), at, late))
        patch.setattr(recorder, "MOST_WAITING", 0)  # every state is observed by itself
        with pytest.raises(Interrupted, match=r"stopped at pass \d+ of 6000; continue with"):
            studies.run(scenario, path)
    stopped = open_results(path)
    assert not stopped.finished
    rows = len(stopped.passes)
    for variable, array in stopped.raw.history.items():
        if variable.endswith(("_error", "_by_strips")):
            continue  # the error due to the strips is estimated at the end
        np.testing.assert_array_equal(array, unbroken.raw.history[variable][:rows])
    assert stopped.record_passes[-1] <= stopped.passes[-1] == stopped.raw.checkpoint["passes"]
    assert stopped.steps == rows - 1
    assert run_differences(studies.resume(path), unbroken) == []


def _stages(scenario: Scenario, path: Path) -> list[str]:
    """Return the file operations of a whole run to `path`."""
    seen: list[str] = []
    studies.run(scenario, path, storage=WatchedStorage(seen.append))
    return seen


def test_interrupt_while_writing_leaves_resumable_file(path: Path) -> None:
    scenario = short(evolution__step=3000, evolution__strip_error=False, **OFTEN)
    unbroken = studies.run(scenario)
    stages = _stages(scenario, path)
    starts = [number for number, stage in enumerate(stages) if stage == "before open"]
    assert len(starts) == 4  # initial state, two steps, finished
    write = stages[starts[1] : starts[2]]
    within_a_write = [starts[1] + 1 + number for number in one_of_each(write)]
    at_the_end = range(len(stages) - 3, len(stages) + 1)  # around the rename and after it
    for at in (*within_a_write, *at_the_end):
        interrupting = WatchedStorage(InterruptAtCall(lambda _: None, at))
        with pytest.raises(Interrupted, match="continue with"):
            studies.run(scenario, path, force=True, storage=interrupting)
        assert list(path.parent.iterdir()) == [path]
        if at % 3 == 0:
            assert run_differences(studies.resume(path), unbroken) == []


def test_interrupt_of_first_write_leaves_initial_file_or_none(path: Path) -> None:
    scenario = short(evolution__step=3000)
    stages = _stages(scenario, path)
    renamed = stages.index("after rename")
    for at in (1, renamed, renamed + 1):
        path.unlink(missing_ok=True)
        interrupting = WatchedStorage(InterruptAtCall(lambda _: None, at))
        with pytest.raises(KeyboardInterrupt):
            studies.run(scenario, path, storage=interrupting)
        assert path.exists() == (at > renamed)
    assert open_results(path).passes.tolist() == [0.0]
    assert run_differences(studies.resume(path), studies.run(scenario)) == []


# with a falling log, contact is lost in a groove that is deeper than the elastic approach
LOST = {
    "wear.cylinder.k_over_h": "1.1e-10 1/Pa",
    "contact.width": "8 mm",
    "load": {"kind": "recorded", "file": "load.csv", "stiffness": "20000 N/mm"},
    "operation.passes": 20_000,
}
FALLING = "time [min],load [N]\n0,300\n2,300\n3,8\n20,8\n"


def _lost(stepper: str) -> Scenario:
    coarse = {"evolution.tolerance": 1e-3} if stepper == "stabilised" else {}
    overrides = {**STEPPERS[stepper], **LOST, **coarse}
    text = short(**overrides).text
    return parse_scenario(text, "rig.toml", {"load.csv": FALLING}.__getitem__)


@pytest.mark.parametrize("stepper", ["implicit", "stabilised", "explicit", "compiled passes"])
def test_lost_contact_keeps_the_last_accepted_state(stepper: str, path: Path) -> None:
    scenario = _lost(stepper)
    with pytest.raises(SolverError, match="contact is lost at pass") as caught:
        studies.run(scenario, path)
    assert caught.value.state
    spring = "(load.stiffness = 20000 N/mm) has run out of travel; lower load.stiffness or"
    assert spring in str(caught.value)
    left = open_results(path)
    assert not left.finished
    # the load falls below the loss of the spring after the second minute
    assert 6000.0 < left.passes[-1] < 9000.0
    assert (left.normal_force > 0.0).all()
    assert left.record_passes[-1] <= left.passes[-1] == left.raw.checkpoint["passes"]
    assert np.isfinite(left.depth).all()
    assert left.failure == str(caught.value)
    assert datetime.fromisoformat(left.raw.failed_at) >= datetime.fromisoformat(left.raw.created)
    # a second attempt fails in the same way and leaves the file unchanged
    with pytest.raises(SolverError, match="contact is lost at pass"):
        studies.resume(path)
    assert run_differences(open_results(path), left) == []


def test_failure_without_a_file_is_raised() -> None:
    with pytest.raises(SolverError, match="contact is lost"):
        studies.run(_lost("compiled passes"))


def test_run_of_too_many_steps_keeps_the_steps(path: Path) -> None:
    with pytest.raises(StepError, match="5 steps have reached pass"):
        studies.run(short(evolution__max_steps=5), path)
    left = open_results(path)
    assert (left.steps, len(left.passes), left.finished) == (5, 6, False)


def test_failure_after_resume_keeps_the_steps(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    unbroken = run_once(short())
    with pytest.raises(Interrupted):
        studies.run(short(), path, stop_requested=lambda: True)
    steps = iter(range(100))
    proposed = implicit.ImplicitStepper.proposed

    def fail(self: object, *args: object) -> object:
        if next(steps) == 4:
            raise StepError("no step")
        return proposed(self, *args)

    with monkeypatch.context() as patch:
        patch.setattr(implicit.ImplicitStepper, "proposed", fail)
        with pytest.raises(StepError, match="no step"):
            studies.resume(path)
    assert open_results(path).steps == 5
    assert open_results(path).failure == "no step"
    resumed = studies.resume(path)
    assert run_differences(resumed, unbroken) == []
    assert (resumed.failure, open_results(path).failure) == ("", "")


def test_error_of_a_plugin_is_stored_with_the_last_step(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = iter(range(100))
    record = recorder.due_records

    def fail(*args: Any) -> object:
        if next(calls) == 2:
            raise ZeroDivisionError("by zero")
        return record(*args)

    monkeypatch.setattr(recorder, "due_records", fail)
    with pytest.raises(ZeroDivisionError):
        studies.run(short(), path)
    left = open_results(path)
    assert left.failure == "ZeroDivisionError: by zero"
    assert (left.steps, len(left.passes)) == (2, 3)


@pytest.mark.parametrize("content", [b"content", None])
def test_existing_file_is_overwritten_by_force_only(
    content: bytes | None, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if content is None:
        studies.run(short(), path)
        content = path.read_bytes()
    path.write_bytes(content)

    def work(*_: object) -> None:
        raise AssertionError("the run was assembled before the output was checked")

    with monkeypatch.context() as patch:
        patch.setattr("wearsim.studies.run.in_progress.assemble_problem", work)
        with pytest.raises(ResultsFileError, match="already exists; force=True replaces it"):
            studies.run(short(), path)
    assert path.read_bytes() == content
    assert studies.run(short(), path, force=True).finished
    assert run_differences(open_results(path), run_once(short())) == []


def test_invalid_scenario_leaves_existing_file_unchanged(path: Path) -> None:
    path.write_bytes(b"content")
    wrong: list[tuple[type[Exception], dict[str, object]]] = [
        (ScenarioError, {"contact.width": "1 mm"}),
        (ScenarioError, {**LOADS["recorded and thermal"], "operation.passes": 60_000}),
        (
            CapabilityError,
            {"contact.model": "hertz-fastsim", "evolution.stepper": "implicit"},
        ),
    ]
    for error, overrides in wrong:
        with pytest.raises(error):
            studies.run(short(**overrides), path, force=True)
        assert path.read_bytes() == b"content"


def test_short_log_error_states_both_times(path: Path) -> None:
    recorded = LOADS["recorded and thermal"]
    with pytest.raises(ScenarioError) as caught:
        studies.run(short(**recorded, operation__duration="15 min"), path)
    assert str(caught.value) == (
        "rig.toml: [load] file: load.csv: the log does not cover the test, got 0 to 12 min,"
        " expected 0 to 15 min: a longer log or a shorter operation.duration"
    )
    assert not path.exists()


def test_test_cannot_be_extended_past_its_log(path: Path) -> None:
    studies.run(short(**LOADS["recorded and thermal"]), path)
    before = path.read_bytes()
    with pytest.raises(ScenarioError, match="the log does not cover the test"):
        studies.resume(path, until=780.0)
    assert path.read_bytes() == before


def _stopped(path: Path, **changes: object) -> None:
    with pytest.raises(Interrupted):
        studies.run(short(**changes), path, stop_requested=lambda: True)


def _warnings(path: Path) -> list[str]:
    events: list[Event] = []
    result = studies.resume(path, on_event=events.append)
    messages = [event.message for event in events if isinstance(event, Warned)]
    assert list(result.warnings) == messages == list(open_results(path).warnings)
    return messages


def test_same_software_resumes_without_warning(path: Path) -> None:
    _stopped(path, evolution__strip_error=False)  # no warning of its size
    assert _warnings(path) == []


def test_changed_software_causes_one_warning_each(path: Path) -> None:
    _stopped(path, evolution__strip_error=False)  # no warning of its size
    data = read_results(path)
    older = data.software | {"numpy": "1.0", "wearsim": "0.0.1"}
    write_results(path, replace(data, software=older))
    now = data.software["numpy"]
    messages = _warnings(path)
    assert len(messages) == 2
    assert (
        f"this file was written with numpy 1.0 and continues with {now}: the last digits may"
        " differ from those of an unbroken run"
    ) in messages


@pytest.mark.parametrize(("distribution", "number"), [("rollers", "2.0"), ("rollers", "0.1.0")])
def test_changed_plugin_of_same_name_causes_a_warning(
    distribution: str, number: str, path: Path
) -> None:
    _stopped(path, evolution__strip_error=False)  # no warning of its size
    data = read_results(path)
    rows = [dict(row) for row in data.plugins]
    rows[0] |= {"distribution": distribution, "version": number}
    write_results(path, replace(data, plugins=rows))
    (message,) = _warnings(path)
    assert message == (
        f"this file was written with the contact model 'slender' of {distribution} {number} and"
        " continues with wearsim: the last digits may differ from those of an unbroken run"
    )
