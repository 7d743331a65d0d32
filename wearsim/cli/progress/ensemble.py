"""Shows how far an ensemble is: a live line on a terminal, or a line now and then."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

from wearsim.cli.output import console, note
from wearsim.cli.progress.run import BETWEEN_LINES, ROOM_FOR_BAR, Clock
from wearsim.report.text.units import count, lapse

if TYPE_CHECKING:
    from rich.progress import Progress

    from wearsim.studies.ensemble.progress import EnsembleProgress
    from wearsim.uq.estimation.intervals import Interval

_BY_NEED = (0, 1, 3, 4, 2)  # parts of a line: how many, failed, time left, estimate, rate
_PERCENT = len("100 %  ")
_BAR = 16


class EnsembleWatcher(Protocol):
    """What is told how far an ensemble is."""

    workers: str
    """Who works on it, once that is known."""

    def __call__(self, progress: EnsembleProgress) -> None:
        """Take note of it."""


@contextmanager
def watching_ensemble(quiet: bool) -> Iterator[EnsembleWatcher]:
    """Give a watcher for an ensemble; all it shows goes to stderr.

    Parameters
    ----------
    quiet : bool
        Show nothing.
    """
    if quiet:
        yield Silent()
        return
    screen = console(err=True)
    if not screen.is_terminal:
        yield EnsembleLines(note)
        return
    from rich.progress import BarColumn, Progress, TextColumn

    text = TextColumn("{task.percentage:3.0f} %  {task.fields[told]}", markup=False)
    bar = [BarColumn(_BAR)] if screen.width >= ROOM_FOR_BAR else []
    with Progress(*bar, text, console=screen) as progress:
        yield LiveEnsemble(progress, _PERCENT + (_BAR + 1 if bar else 0))


def told(progress: EnsembleProgress, what: str = " realisations", room: float = math.inf) -> str:
    """Return how far an ensemble is, in a line.

    Parameters
    ----------
    progress : EnsembleProgress
    what : str
        What is counted; a narrow line has no room for it.
    room : float
        Columns there are; parts for which there is no room are left out, the last needed first.
    """
    left = progress.done + progress.failed < progress.asked
    estimated = progress.estimate is not None and math.isfinite(progress.estimate.value)
    parts = [
        f"{count(progress.done)} of {count(progress.asked)}{what}",
        f"{count(progress.failed)} failed" if progress.failed else "",
        _rate(progress.rate),
        f"{lapse(progress.left)} left" if left else "",
        _with_estimate(progress.what, progress.estimate) if estimated else "",
    ]
    chosen: list[int] = []
    for number in _BY_NEED:
        with_it = sorted([*chosen, number]) if parts[number] else chosen
        if not chosen or len(", ".join(parts[k] for k in with_it)) <= room:
            chosen = with_it
    return ", ".join(parts[k] for k in chosen)


def _rate(rate: float) -> str:
    return f"{rate:.3g}/s" if rate < 1000.0 else f"{count(rate)}/s"


def _with_estimate(what: str, estimate: Interval) -> str:
    from wearsim.report.text.intervals import with_interval
    from wearsim.report.text.labels import OBSERVABLES

    return f"{what} {with_interval(estimate, OBSERVABLES[what.split('.', maxsplit=1)[0]].unit)}"


class Silent:
    """Shows nothing."""

    workers = ""

    def __call__(self, progress: EnsembleProgress) -> None:
        """Take note of how far an ensemble is."""
        self.workers = progress.workers


class EnsembleLines:
    """Writes a line whenever a second has passed, so that short studies write none.

    Parameters
    ----------
    write : callable
        Takes a line.
    clock : Clock, optional
        Tells the time.
    """

    workers = ""

    def __init__(self, write: Callable[[str], None], clock: Clock | None = None) -> None:
        self._write, self._now = write, (clock or Clock()).now
        self._written = self._now()

    def __call__(self, progress: EnsembleProgress) -> None:
        """Take note of how far an ensemble is."""
        self.workers = progress.workers
        now = self._now()
        if now - self._written >= BETWEEN_LINES:
            self._written = now
            self._write(told(progress))


class LiveEnsemble:
    """Keeps one line up to date.

    Parameters
    ----------
    progress : rich.progress.Progress
        Draws the line.
    taken : int
        Columns of the line that are taken by other things.
    """

    workers = ""

    def __init__(self, progress: Progress, taken: int = 0) -> None:
        self._progress, self._taken = progress, taken
        self._task = progress.add_task("", total=1.0, told="starting")

    def __call__(self, progress: EnsembleProgress) -> None:
        """Take note of how far an ensemble is."""
        self.workers = progress.workers
        self._progress.update(
            self._task,
            total=progress.asked,
            completed=progress.done + progress.failed,
            told=told(progress, "", self._progress.console.width - self._taken),
        )
