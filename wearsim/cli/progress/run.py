"""Progress of a run: one live line on a terminal, occasional plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeAlias

from wearsim.cli.output import console, note
from wearsim.report.text.units import count, lapse, shown
from wearsim.studies.run.events import Event, Finished, Started, Stepped, Warned

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

Watcher: TypeAlias = Callable[[Event], None]
BETWEEN_LINES = 1.0  # s


@contextmanager
def watching(quiet: bool) -> Iterator[Watcher]:
    """Open a display of the events of a run on stderr.

    Parameters
    ----------
    quiet : bool
        Whether to show warnings only.
    """
    screen = console(err=True)
    if quiet:
        yield _warn
    elif not screen.is_terminal:
        yield PlainLines(note)
    else:
        text = "{task.percentage:3.0f} %  {task.fields[passes]}  {task.fields[details]}"
        with live_line(screen, text, bar_width=24) as progress:
            yield LiveLine(progress)


def live_line(screen: Console, text: str, bar_width: int, columns: int = 115) -> Progress:
    """Return a progress display of one line, with a bar if the terminal has enough columns."""
    from rich.progress import BarColumn, Progress, TextColumn

    bar = [BarColumn(bar_width)] if screen.width >= columns else []
    return Progress(*bar, TextColumn(text, markup=False), console=screen)


def _warn(event: Event) -> None:
    if isinstance(event, Warned):
        note(f"warning: {event.message}")


class Clock:
    """Estimate of the remaining time of a run, from its rate of passes.

    Parameters
    ----------
    now : callable
        Returns a monotonic time [s].
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self.now = now
        self._begun, self._from = now(), 0.0

    def start(self, event: Started) -> str:
        """Start the clock and return a description of the run."""
        self._begun, self._from = self.now(), event.from_passes
        passes = f"{count(event.total_passes)} passes"
        if event.from_passes:
            passes = f"from pass {count(event.from_passes)} of {passes}"
        verb = "continuing" if event.from_passes else "running"
        return (
            f"{verb} {passes}, {shown(event.total_time, 'min')},"
            f" with {event.model}, {event.stepper}"
        )

    def details(self, event: Stepped) -> str:
        """Return simulated time, depth, step size and, after 2 % of the passes, the time left."""
        text = (
            f"{shown(event.time, 'min')}, depth {shown(event.depth, 'um')},"
            f" step {count(event.step_passes)}"
        )
        done, left = event.passes - self._from, event.total_passes - event.passes
        if done < 0.02 * event.total_passes or left <= 0.0:
            return text
        return f"{text}, {lapse((self.now() - self._begun) * left / done)} left"


class PlainLines:
    """Lines for the first step, the last step and, one second apart, steps between.

    Parameters
    ----------
    write : callable
        Writes a line.
    clock : Clock, optional
        Source of the time.
    """

    def __init__(self, write: Callable[[str], None], clock: Clock | None = None) -> None:
        self._write, self._clock = write, clock or Clock()
        self._written: float | None = None

    def __call__(self, event: Event) -> None:
        """Show an event."""
        if isinstance(event, Started):
            self._write(self._clock.start(event))
        elif isinstance(event, Stepped):
            now, last = self._clock.now(), event.passes >= event.total_passes
            if not last and self._written is not None and now - self._written < BETWEEN_LINES:
                return
            self._written = now
            part = 100.0 * event.passes / event.total_passes
            details = self._clock.details(event)
            self._write(f"pass {count(event.passes)} ({part:.0f} %), {details}")
        elif isinstance(event, Warned):
            self._write(f"warning: {event.message}")
        elif isinstance(event, Finished):
            self._write(f"done in {lapse(event.wall_seconds)}")


class LiveLine:
    """One line that is updated.

    Parameters
    ----------
    progress : rich.progress.Progress
        Display of the line.
    """

    def __init__(self, progress: Progress) -> None:
        self._progress, self._clock = progress, Clock()
        self._task = progress.add_task("", total=1.0, passes="", details="")

    def __call__(self, event: Event) -> None:
        """Show an event."""
        if isinstance(event, Started):
            self._progress.console.print(self._clock.start(event))
            self._progress.update(self._task, total=event.total_passes, completed=event.from_passes)
        elif isinstance(event, Stepped):
            self._progress.update(
                self._task,
                completed=event.passes,
                passes=f"{count(event.passes)} passes",
                details=self._clock.details(event),
            )
        elif isinstance(event, Warned):
            self._progress.console.print(f"warning: {event.message}")
        elif isinstance(event, Finished):
            self._progress.update(self._task, details=f"done in {lapse(event.wall_seconds)}")
