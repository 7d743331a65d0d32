import io
from pathlib import Path

import pytest
from rich.console import Console

from wearsim.cli import progress
from wearsim.cli.progress import RunWatcher
from wearsim.mechanics.numerics.jit import kernel
from wearsim.report.text import plain
from wearsim.studies.run.recorder import Event, Finished, Started, Stepped, Warned

STARTED = Started(1000.0, 60.0, 0.0, "implicit", "slender")


def step(passes: float) -> Stepped:
    return Stepped(passes, 1000.0, 0.06 * passes, 1e-6, 10.0, 1e-9, 0.0)


class Time:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def shown_steps(capsys: pytest.CaptureFixture[str], steps: list[tuple[float, float]]) -> list[str]:
    """Return the lines of steps given as time and passes."""
    time = Time()
    watch = RunWatcher(quiet=False, now=time)
    watch(STARTED)
    for now, passes in steps:
        time.now = now
        watch(step(passes))
    start, *others = capsys.readouterr().err.splitlines()
    assert start == "running 1,000 passes, 1.000 min, with slender, implicit"
    return others


def test_first_and_last_step_are_always_shown(capsys: pytest.CaptureFixture[str]) -> None:
    found = shown_steps(capsys, [(0.0, 10.0), (0.1, 500.0), (0.2, 1000.0)])
    assert [line.split(",")[0] for line in found] == ["pass 10 (1 %)", "pass 1"]
    assert found[-1] == "pass 1,000 (100 %), 1.000 min, depth 1.000 um, step of 10 passes"


def test_lines_are_a_second_apart(capsys: pytest.CaptureFixture[str]) -> None:
    assert len(shown_steps(capsys, [(0.01 * k, 1.0 + k) for k in range(350)])) == 4


def test_time_left_follows_from_the_rate_of_passes(capsys: pytest.CaptureFixture[str]) -> None:
    lines = shown_steps(capsys, [(0.0, 10.0), (5.0, 135.0), (10.0, 260.0)])
    assert lines[-1].endswith(", 30 s left")


def test_first_steps_show_no_time_left(capsys: pytest.CaptureFixture[str]) -> None:
    lines = shown_steps(capsys, [(0.0, 10.0), (5.0, 135.0), (10.0, 260.0)])
    assert [" left" in line for line in lines] == [False, False, True]


def test_compilation_is_shown_in_lines_without_control_characters(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    time = Time()

    @kernel
    def first(x: float) -> float:
        return x + 1.0

    @kernel
    def second(x: float) -> float:
        return x + 2.0

    with RunWatcher(quiet=False, now=time, kernels=lambda: {"first", "second"}):
        first(1.0)
        time.now = 5.0
        second(1.0)
        second(2.0)
    assert capsys.readouterr().err.splitlines() == [
        f"compiling kernels, once after installation: {number} of 2" for number in (1, 2)
    ]


def test_quiet_shows_no_compilation(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    @kernel
    def third(x: float) -> float:
        return x + 3.0

    with RunWatcher(quiet=True):
        third(1.0)
    assert capsys.readouterr() == ("", "")


def test_continued_run_starts_at_its_pass(capsys: pytest.CaptureFixture[str]) -> None:
    time = Time()
    watch = RunWatcher(quiet=False, now=time)
    watch(Started(1000.0, 60.0, 500.0, "implicit", "slender"))
    for time.now, passes in ((2.0, 520.0), (4.0, 540.0), (10.0, 600.0)):
        watch(step(passes))
    start, *_, line = capsys.readouterr().err.splitlines()
    assert start.startswith("continuing from pass 500 of 1,000 passes, 1.000 min, with")
    assert line.endswith(", 40 s left")


def test_warnings_and_the_end_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    watch = RunWatcher(quiet=False)
    events: list[Event] = [Warned("unstable [step]"), Finished(75.0)]
    for event in events:
        watch(event)
    assert capsys.readouterr().err.splitlines() == [
        "warning: unstable [step]",
        "done in 1 min 15 s",
    ]


def test_quiet_shows_warnings_only(capsys: pytest.CaptureFixture[str]) -> None:
    with RunWatcher(quiet=True) as watch:
        events: list[Event] = [STARTED, step(10.0), Warned("look"), Finished(1.0)]
        for event in events:
            watch(event)
    assert capsys.readouterr() == ("", "warning: look\n")


def test_terminal_shows_a_live_line(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=140, markup=False, highlight=False)
    monkeypatch.setattr(progress, "console", lambda **_: terminal)
    with RunWatcher(quiet=False) as watch:
        events: list[Event] = [STARTED, step(500.0), Warned("look [here]"), step(1000.0)]
        for event in [*events, Finished(2.0)]:
            watch(event)
    text = screen.getvalue()
    assert "running 1,000 passes" in text
    assert "warning: look [here]" in text
    assert "100 %  done in 2.0 s" in text


def test_json_has_null_for_nan_and_infinity() -> None:
    import numpy as np

    data = {"a": float("nan"), "b": np.array([1.0, np.inf]), "c": (np.int64(3), None)}
    assert plain(data) == {"a": None, "b": [1.0, None], "c": [3, None]}
