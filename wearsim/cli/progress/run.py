"""Shows a run's events: a live line on a terminal, occasional plain lines elsewhere."""

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
ROOM_FOR_BAR = 115  # columns


@contextmanager
def watching(quiet: bool) -> Iterator[Watcher]:
    """Give a watcher for a run's events; everything it shows goes to stderr.

    Parameters
    ----------
    quiet : bool
        Show warnings alone.
    """
    if quiet:
        yield _warn
        return
    screen = console(err=True)
    if not screen.is_terminal:
        yield PlainLines(note)
        return
    with _bar(screen) as progress:
        yield LiveLine(progress)


def _warn(event: Event) -> None:
    if isinstance(event, Warned):
        note(f"warning: {event.message}")


class Clock:
    """Foretells the time a run still takes, from the passes it did since it started.

    Parameters
    ----------
    now : callable
        Returns a time [s] that never goes back.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self.now = now
        self._begun, self._from = now(), 0.0

    def start(self, event: Started) -> None:
        """Start counting."""
        self._begun, self._from = self.now(), event.from_passes

    def left(self, event: Stepped) -> str:
        """Return the time left, as words; nothing while too little is done to tell, or all is."""
        done, left = event.passes - self._from, event.total_passes - event.passes
        if done < 0.02 * event.total_passes or left <= 0.0:
            return ""
        return f", {lapse((self.now() - self._begun) * left / done)} left"


def opening(event: Started) -> str:
    """Return what is said when a run starts."""
    verb = f"going on from pass {count(event.from_passes)} of" if event.from_passes else "running"
    return (
        f"{verb} {count(event.total_passes)} passes, {shown(event.total_time, 'min')},"
        f" with {event.model}, {event.stepper}"
    )


def details(event: Stepped) -> str:
    """Return where a run stands, but for its passes."""
    return (
        f"{shown(event.time, 'min')}, depth {shown(event.depth, 'um')},"
        f" step {count(event.step_passes)}"
    )


class PlainLines:
    """Writes a line now and then: the first and the last step always, others a second apart.

    Parameters
    ----------
    write : callable
        Takes a line.
    clock : Clock, optional
        Tells the time.
    """

    def __init__(self, write: Callable[[str], None], clock: Clock | None = None) -> None:
        self._write, self._clock = write, clock or Clock()
        self._written: float | None = None

    def __call__(self, event: Event) -> None:
        """Take note of an event."""
        if isinstance(event, Started):
            self._clock.start(event)
            self._write(opening(event))
        elif isinstance(event, Stepped):
            self._step(event)
        elif isinstance(event, Warned):
            self._write(f"warning: {event.message}")
        elif isinstance(event, Finished):
            self._write(f"done in {lapse(event.wall_seconds)}")

    def _step(self, event: Stepped) -> None:
        now, last = self._clock.now(), event.passes >= event.total_passes
        if not last and self._written is not None and now - self._written < BETWEEN_LINES:
            return
        self._written = now
        part = 100.0 * event.passes / event.total_passes
        self._write(
            f"pass {count(event.passes)} ({part:.0f} %), {details(event)}{self._clock.left(event)}"
        )


def _bar(screen: Console) -> Progress:
    from rich.progress import BarColumn, Progress, TextColumn

    text = "{task.percentage:3.0f} %  {task.fields[passes]}  {task.fields[details]}"
    columns = [TextColumn(text, markup=False)]
    if screen.width >= ROOM_FOR_BAR:
        return Progress(BarColumn(bar_width=24), *columns, console=screen)
    return Progress(*columns, console=screen)


class LiveLine:
    """Keeps one line up to date.

    Parameters
    ----------
    progress : rich.progress.Progress
        Draws the line.
    """

    def __init__(self, progress: Progress) -> None:
        self._progress, self._clock = progress, Clock()
        self._task = progress.add_task("", total=1.0, passes="", details="")

    def __call__(self, event: Event) -> None:
        """Take note of an event."""
        if isinstance(event, Started):
            self._clock.start(event)
            self._progress.console.print(opening(event))
            self._progress.update(self._task, total=event.total_passes, completed=event.from_passes)
        elif isinstance(event, Stepped):
            self._progress.update(
                self._task,
                completed=event.passes,
                passes=f"{count(event.passes)} passes",
                details=details(event) + self._clock.left(event),
            )
        elif isinstance(event, Warned):
            self._progress.console.print(f"warning: {event.message}")
        elif isinstance(event, Finished):
            self._progress.update(self._task, details=f"done in {lapse(event.wall_seconds)}")
