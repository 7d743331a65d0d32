import io

import pytest
from rich.console import Console

from wearsim.cli.output import plain
from wearsim.cli.progress import run as progress
from wearsim.cli.progress.run import Clock, LiveLine, PlainLines
from wearsim.studies.run.events import Event, Finished, Started, Stepped, Warned

STARTED = Started(1000.0, 60.0, 0.0, "implicit", "slender")


def step(passes: float) -> Stepped:
    return Stepped(passes, 1000.0, 0.06 * passes, 1e-6, 10.0, 1e-9, 0.0)


class Time:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def shown_steps(steps: list[tuple[float, float]]) -> list[str]:
    """Return the lines of steps given as time and passes."""
    time, lines = Time(), []
    watch = PlainLines(lines.append, Clock(time))
    watch(STARTED)
    for now, passes in steps:
        time.now = now
        watch(step(passes))
    return lines[1:]


def test_first_and_last_step_are_always_shown() -> None:
    lines = shown_steps([(0.0, 10.0), (0.1, 500.0), (0.2, 1000.0)])
    assert [line.split(",")[0] for line in lines] == ["pass 10 (1 %)", "pass 1"]
    assert lines[-1].startswith("pass 1,000 (100 %), 1.000 min, depth 1.000 um, step 10")


def test_lines_are_a_second_apart() -> None:
    lines = shown_steps([(0.01 * k, 1.0 + k) for k in range(350)])
    assert len(lines) == 4


def test_time_left_follows_from_the_rate_of_passes() -> None:
    (_, line) = shown_steps([(0.0, 10.0), (10.0, 250.0)])
    assert line.endswith(", 30 s left")


def test_warnings_and_the_end_are_shown() -> None:
    lines: list[str] = []
    watch = PlainLines(lines.append)
    events: list[Event] = [Warned("unstable [step]"), Finished(75.0)]
    for event in events:
        watch(event)
    assert lines == ["warning: unstable [step]", "done in 1 min 15 s"]


def test_quiet_shows_warnings_only(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.watching(quiet=True) as watch:
        events: list[Event] = [STARTED, step(10.0), Warned("look"), Finished(1.0)]
        for event in events:
            watch(event)
    assert capsys.readouterr() == ("", "warning: look\n")


def test_terminal_shows_a_live_line(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=140, markup=False, highlight=False)
    monkeypatch.setattr(progress, "console", lambda **_: terminal)
    with progress.watching(quiet=False) as watch:
        assert isinstance(watch, LiveLine)
        events: list[Event] = [STARTED, step(500.0), Warned("look [here]"), step(1000.0)]
        for event in [*events, Finished(2.0)]:
            watch(event)
    text = screen.getvalue()
    assert "running 1,000 passes" in text
    assert "warning: look [here]" in text
    assert "100 %  1,000 passes  done in 2.0 s" in text


def test_json_has_null_for_nan_and_infinity() -> None:
    import numpy as np

    data = {"a": float("nan"), "b": np.array([1.0, np.inf]), "c": (np.int64(3), None)}
    assert plain(data) == {"a": None, "b": [1.0, None], "c": [3, None]}
