"""Progress on stderr: one live line on a terminal, plain lines one second apart elsewhere."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeAlias

from wearsim.cli.output import console, note
from wearsim.report.text import count, lapse, shown
from wearsim.studies.run.events import Event, Finished, Started, Stepped, Warned

if TYPE_CHECKING:
    from wearsim.studies.ensemble.driver import EnsembleProgress

Counter: TypeAlias = Callable[[int, int], None]
BETWEEN_LINES = 1.0  # s
_BAR, _COLUMNS_FOR_BAR = 24, 115


class Display:
    """One line that is updated on a terminal, and written at most once a second elsewhere.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing.
    now : callable
        Returns a monotonic time [s].

    Attributes
    ----------
    live : rich.progress.Progress
        Display on a terminal, disabled elsewhere.
    columns : float
        Greatest length of the text.
    """

    def __init__(self, quiet: bool, now: Callable[[], float] = time.monotonic) -> None:
        from rich.progress import BarColumn, Progress, TextColumn

        screen = console(err=True)
        bar = [BarColumn(_BAR)] if screen.width >= _COLUMNS_FOR_BAR else []
        self.live = Progress(
            *bar,
            TextColumn("{task.percentage:3.0f} %  {task.description}", markup=False),
            console=screen,
            speed_estimate_period=3600.0,
            get_time=now,
            disable=quiet or not screen.is_terminal,
        )
        self.columns = math.inf
        if not self.live.disable:
            self.columns = screen.width - len("100 %  ") - len(bar) * (_BAR + 1)
        self.live.add_task("starting")
        (self._task,) = self.live.tasks
        self._quiet, self._now, self._written = quiet, now, now()

    def advance(self, done: float, total: float) -> str:
        """Set how much is done, and return the time left in the form ", 12 s left"."""
        self.live.update(self._task.id, completed=done, total=total)
        left = self._task.time_remaining
        return f", {lapse(left)} left" if left else ""

    def show(self, text: str, *, always: bool = False) -> None:
        """Show a text on the line, or write it if a second has passed since the last one."""
        self.live.update(self._task.id, description=text)
        now = self._now()
        if self.live.disable and (always or now - self._written >= BETWEEN_LINES):
            self._written = now
            self.write(text)

    def write(self, text: str, *, also_quiet: bool = False) -> None:
        """Write a line, on a terminal above the live one."""
        if not self.live.disable:
            self.live.console.print(text)
        elif also_quiet or not self._quiet:
            note(text)


@contextmanager
def counting(quiet: bool, items: str) -> Iterator[Counter]:
    """Open a display of a number of realisations; it takes done and total.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing.
    items : str
        Name of the counted items, "realisations".
    """
    display = Display(quiet)

    def show(done: int, total: int) -> None:
        left = display.advance(done, total)
        display.show(f"{count(done)} of {count(total)} {items}{left}")

    with display.live:
        yield show


@contextmanager
def watching(quiet: bool) -> Iterator[RunWatcher]:
    """Open a display of the events of a run.

    Parameters
    ----------
    quiet : bool
        Whether to show warnings only.
    """
    display = Display(quiet)
    with display.live:
        yield RunWatcher(display)


class RunWatcher:
    """Receiver of the events of a run; the first and the last step are always shown.

    Parameters
    ----------
    display : Display
    """

    def __init__(self, display: Display) -> None:
        self._display, self._is_first_step = display, True

    def __call__(self, event: Event) -> None:
        """Show an event."""
        if isinstance(event, Started):
            self._display.advance(event.from_passes, event.total_passes)
            self._display.write(_start(event))
        elif isinstance(event, Stepped):
            self._show_step(event)
        elif isinstance(event, Warned):
            self._display.write(f"warning: {event.message}", also_quiet=True)
        elif isinstance(event, Finished):
            self._display.show(f"done in {lapse(event.wall_seconds)}", always=True)

    def _show_step(self, step: Stepped) -> None:
        left = self._display.advance(step.passes, step.total_passes)
        part = f" ({100.0 * step.passes / step.total_passes:.0f} %)"
        text = (
            f"pass {count(step.passes)}{part if self._display.live.disable else ''},"
            f" {shown(step.time, 'min')}, depth {shown(step.depth, 'um')},"
            f" step {count(step.step_passes)}{left}"
        )
        is_last = step.passes >= step.total_passes
        self._display.show(text, always=self._is_first_step or is_last)
        self._is_first_step = False


def _start(event: Started) -> str:
    """Return a description of a run: "running 1,000 passes, 2 min, with slender, implicit"."""
    passes = f"running {count(event.total_passes)} passes"
    if event.from_passes:
        passes = (
            f"continuing from pass {count(event.from_passes)} of {count(event.total_passes)} passes"
        )
    return f"{passes}, {shown(event.total_time, 'min')}, with {event.model}, {event.stepper}"


@contextmanager
def watching_ensemble(quiet: bool) -> Iterator[EnsembleWatcher]:
    """Open a display of the progress of an ensemble.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing.
    """
    display = Display(quiet)
    with display.live:
        yield EnsembleWatcher(display)


class EnsembleWatcher:
    """Receiver of the progress of an ensemble.

    Parameters
    ----------
    display : Display

    Attributes
    ----------
    workers : str
        Description of the workers; empty before the first progress.
    """

    workers = ""

    def __init__(self, display: Display) -> None:
        self._display = display

    def notice(self, text: str) -> None:
        """Show a notice, also if nothing else is shown."""
        self._display.write(text, also_quiet=True)

    def __call__(self, progress: EnsembleProgress) -> None:
        """Store the workers and show the progress."""
        self.workers = progress.workers
        self._display.advance(progress.done + progress.failed, progress.requested)
        self._display.show(progress_text(progress, self._display.columns))


def progress_text(progress: EnsembleProgress, columns: float = math.inf) -> str:
    """Return the progress of an ensemble on one line.

    Parameters
    ----------
    progress : EnsembleProgress
    columns : float
        Greatest length; parts that would exceed it are left out.
    """
    text = f"{count(progress.done)} of {count(progress.requested)}"
    if columns == math.inf:
        text += " realisations"
    parts = [
        f"{count(progress.failed)} failed" if progress.failed else "",
        f"{lapse(progress.left)} left" if progress.left else "",
        _estimate(progress),
        f"{progress.rate:.3g}/s" if progress.rate < 1000.0 else f"{count(progress.rate)}/s",
    ]
    for part in filter(None, parts):
        if len(text) + len(f", {part}") <= columns:
            text += f", {part}"
    return text


def _estimate(progress: EnsembleProgress) -> str:
    if progress.estimate is None or not math.isfinite(progress.estimate.value):
        return ""
    from wearsim.report.text import OBSERVABLES, with_interval

    unit = OBSERVABLES[progress.what.split(".", maxsplit=1)[0]].unit
    return f"{progress.what} {with_interval(progress.estimate, unit)}"
