"""Shows how many realisations are done: a live line on a terminal, or a line now and then."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

from wearsim.cli.output import console, note
from wearsim.cli.progress.run import BETWEEN_LINES, Clock
from wearsim.report.text.units import count, lapse

Counter: TypeAlias = Callable[[int, int], None]


@contextmanager
def counting(quiet: bool, what: str) -> Iterator[Counter]:
    """Give what is told how many are done, and of how many; all it shows goes to stderr.

    Parameters
    ----------
    quiet : bool
        Show nothing.
    what : str
        What is counted, "realisations".
    """
    if quiet:
        yield lambda done, total: None
        return
    screen = console(err=True)
    if not screen.is_terminal:
        yield CountedLines(note, what)
        return
    from rich.progress import BarColumn, Progress, TextColumn

    text = "{task.percentage:3.0f} %  {task.fields[done]}"
    with Progress(TextColumn(text, markup=False), BarColumn(24), console=screen) as progress:
        task = progress.add_task("", total=1.0, done="")

        def show(done: int, total: int) -> None:
            words = f"{count(done)} of {count(total)} {what}"
            progress.update(task, total=total, completed=done, done=words)

        yield show


class CountedLines:
    """Writes a line whenever a second has passed, so that short studies write none.

    Parameters
    ----------
    write : callable
        Takes a line.
    what : str
        What is counted.
    clock : Clock, optional
        Tells the time.
    """

    def __init__(self, write: Callable[[str], None], what: str, clock: Clock | None = None) -> None:
        self._write, self._what, self._now = write, what, (clock or Clock()).now
        self._begun = self._written = self._now()

    def __call__(self, done: int, total: int) -> None:
        """Take note of how many are done."""
        now = self._now()
        if now - self._written < BETWEEN_LINES:
            return
        self._written = now
        left = lapse((now - self._begun) * (total - done) / done)
        self._write(f"{count(done)} of {count(total)} {self._what}, {left} left")
