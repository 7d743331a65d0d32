"""Progress of realisations: one live line on a terminal, one plain line per second elsewhere."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeAlias

from wearsim.cli.output import console, note
from wearsim.cli.progress.run import BETWEEN_LINES, live_line
from wearsim.report.text.units import count, lapse

if TYPE_CHECKING:
    from rich.progress import Progress

    from wearsim.studies.ensemble.driver import EnsembleProgress

Counter: TypeAlias = Callable[[int, int], None]
_PRIORITY = (0, 1, 3, 4, 2)  # parts of a line: number, failures, time left, estimate, rate
_PERCENT = len("100 %  ")
_BAR, _COLUMNS_FOR_BAR = 16, 115


@contextmanager
def counting(quiet: bool, items: str) -> Iterator[Counter]:
    """Open a display of a number of realisations on stderr; it takes done and total.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing.
    items : str
        Name of the counted items, "realisations".
    """
    screen = console(err=True)
    if quiet:
        yield lambda done, total: None
    elif not screen.is_terminal:
        yield CountedLines(note, items)
    else:
        text = "{task.percentage:3.0f} %  {task.fields[done]}"
        with live_line(screen, text, bar_width=24, columns=0) as progress:
            task = progress.add_task("", total=1.0, done="")

            def show(done: int, total: int) -> None:
                words = f"{count(done)} of {count(total)} {items}"
                progress.update(task, total=total, completed=done, done=words)

            yield show


class CountedLines:
    """Lines with the number of realisations and the time left, at least one second apart.

    Parameters
    ----------
    write : callable
        Writes a line.
    items : str
        Name of the counted items.
    now : callable
        Returns a monotonic time [s].
    """

    def __init__(
        self, write: Callable[[str], None], items: str, now: Callable[[], float] = time.monotonic
    ) -> None:
        self._write, self._items, self._now = write, items, now
        self._begun = self._written = now()

    def __call__(self, done: int, total: int) -> None:
        """Show the number of realisations that are done."""
        now = self._now()
        if now - self._written < BETWEEN_LINES:
            return
        self._written = now
        left = lapse((now - self._begun) * (total - done) / done)
        self._write(f"{count(done)} of {count(total)} {self._items}, {left} left")


@contextmanager
def watching_ensemble(quiet: bool) -> Iterator[EnsembleWatcher]:
    """Open a display of the progress of an ensemble on stderr.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing.
    """
    screen = console(err=True)
    if quiet:
        yield EnsembleWatcher()
    elif not screen.is_terminal:
        yield EnsembleLines(note)
    else:
        has_bar = screen.width >= _COLUMNS_FOR_BAR
        text = "{task.percentage:3.0f} %  {task.fields[words]}"
        with live_line(screen, text, _BAR, _COLUMNS_FOR_BAR) as progress:
            yield LiveEnsemble(progress, _PERCENT + (_BAR + 1 if has_bar else 0))


def progress_text(
    progress: EnsembleProgress, items: str = " realisations", columns: float = math.inf
) -> str:
    """Return the progress of an ensemble on one line.

    Parameters
    ----------
    progress : EnsembleProgress
    items : str
        Name of the counted items, with a leading space.
    columns : float
        Greatest length; parts of low priority are left out to meet it.
    """
    left = progress.done + progress.failed < progress.asked
    rate = f"{progress.rate:.3g}" if progress.rate < 1000.0 else count(progress.rate)
    parts = [
        f"{count(progress.done)} of {count(progress.asked)}{items}",
        f"{count(progress.failed)} failed" if progress.failed else "",
        f"{rate}/s",
        f"{lapse(progress.left)} left" if left else "",
        _estimate(progress),
    ]
    chosen: list[int] = []
    for number in _PRIORITY:
        longer = sorted([*chosen, number]) if parts[number] else chosen
        if not chosen or len(", ".join(parts[k] for k in longer)) <= columns:
            chosen = longer
    return ", ".join(parts[k] for k in chosen)


def _estimate(progress: EnsembleProgress) -> str:
    if progress.estimate is None or not math.isfinite(progress.estimate.value):
        return ""
    from wearsim.report.text.estimates import with_interval
    from wearsim.report.text.labels import OBSERVABLES

    unit = OBSERVABLES[progress.what.split(".", maxsplit=1)[0]].unit
    return f"{progress.what} {with_interval(progress.estimate, unit)}"


class EnsembleWatcher:
    """Receiver of the progress of an ensemble; shows nothing.

    Attributes
    ----------
    workers : str
        Description of the workers; empty before the first progress.
    """

    workers = ""

    def __call__(self, progress: EnsembleProgress) -> None:
        """Store the workers and show the progress."""
        self.workers = progress.workers
        self._show(progress)

    def _show(self, progress: EnsembleProgress) -> None:
        pass


class EnsembleLines(EnsembleWatcher):
    """Lines at least one second apart, so that short studies write none.

    Parameters
    ----------
    write : callable
        Writes a line.
    now : callable
        Returns a monotonic time [s].
    """

    def __init__(
        self, write: Callable[[str], None], now: Callable[[], float] = time.monotonic
    ) -> None:
        self._write, self._now = write, now
        self._written = now()

    def _show(self, progress: EnsembleProgress) -> None:
        now = self._now()
        if now - self._written >= BETWEEN_LINES:
            self._written = now
            self._write(progress_text(progress))


class LiveEnsemble(EnsembleWatcher):
    """One line that is updated.

    Parameters
    ----------
    progress : rich.progress.Progress
        Display of the line.
    taken : int
        Columns of the line taken by the bar and the percentage.
    """

    def __init__(self, progress: Progress, taken: int = 0) -> None:
        self._progress, self._taken = progress, taken
        self._task = progress.add_task("", total=1.0, words="starting")

    def _show(self, progress: EnsembleProgress) -> None:
        self._progress.update(
            self._task,
            total=progress.asked,
            completed=progress.done + progress.failed,
            words=progress_text(progress, "", self._progress.console.width - self._taken),
        )
