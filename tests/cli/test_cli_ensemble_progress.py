"""The progress of an ensemble, in lines and on a terminal."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from wearsim.cli import progress
from wearsim.cli.progress import EnsembleWatcher, progress_text
from wearsim.studies.ensemble.driver import EnsembleProgress
from wearsim.uq.estimation.intervals import UNKNOWN, Interval

PROGRESS = EnsembleProgress(
    done=1200,
    failed=3,
    requested=5000,
    rate=12.34,
    left=307.7,
    what="depth.mean",
    estimate=Interval(21.5e-6, 21.0e-6, 22.0e-6),
    workers="2 processes",
)


def test_progress_has_rate_time_left_and_estimate() -> None:
    assert progress_text(PROGRESS) == (
        "1,200 of 5,000 realisations, 3 failed, 5 min 8 s left,"
        " depth.mean 21.50 um [21.00, 22.00], 12.3/s"
    )


def test_progress_omits_unknown_values() -> None:
    none = PROGRESS.__class__(0, 5, 5, 2.0, 0.0, "depth.mean", UNKNOWN, "serial")
    assert progress_text(none) == "0 of 5 realisations, 5 failed, 2/s"


def test_progress_lines_are_a_second_apart_but_for_the_last(
    capsys: pytest.CaptureFixture[str],
) -> None:
    now = [0.0]
    watch = EnsembleWatcher(quiet=False, now=lambda: now[0])
    for time in (0.5, 1.1, 1.2, 2.2):
        now[0] = time
        watch(PROGRESS)
    last = replace(PROGRESS, done=4997, left=0.0)  # with three that have failed
    watch(last)
    lines = [*[progress_text(PROGRESS)] * 2, progress_text(last)]
    assert capsys.readouterr().err.splitlines() == lines
    assert watch.workers == "2 processes"


@pytest.mark.parametrize(
    ("columns", "line"),
    [
        (53, "1,200 of 5,000, 3 failed, 5 min 8 s left, 12.3/s"),
        (30, "1,200 of 5,000, 3 failed"),
        (5, "1,200 of 5,000"),
        (76, "1,200 of 5,000, 3 failed, 5 min 8 s left, depth.mean 21.50 um [21.00, 22.00]"),
    ],
)
def test_narrow_line_drops_whole_parts(columns: int, line: str) -> None:
    assert progress_text(PROGRESS, columns) == line


def test_line_of_60_columns_is_not_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=60, markup=False, highlight=False)
    monkeypatch.setattr(progress, "console", lambda **_: terminal)
    with EnsembleWatcher(quiet=False) as watch:
        watch(PROGRESS)
    assert "5 min 8 s left, 12.3/s" in screen.getvalue()
    assert "\u2026" not in screen.getvalue()
    assert "um" not in screen.getvalue()


def test_terminal_shows_a_live_line(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=140, markup=False, highlight=False)
    monkeypatch.setattr(progress, "console", lambda **_: terminal)
    with EnsembleWatcher(quiet=False) as watch:
        watch(PROGRESS)
    assert "24 %" in screen.getvalue()
    assert progress_text(PROGRESS, 111) in screen.getvalue()


def test_quiet_shows_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with EnsembleWatcher(quiet=True) as watch:
        watch(PROGRESS)
    assert capsys.readouterr() == ("", "")
    assert watch.workers == "2 processes"
