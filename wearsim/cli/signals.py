"""Ctrl-C and SIGTERM: the first asks a run to stop at a checkpoint, the second ends it at once."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from wearsim.cli.output import note

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@dataclass
class Stop:
    """Whether the user asked to stop."""

    asked: bool = False

    def requested(self) -> bool:
        """Return whether the user asked to stop."""
        return self.asked


@contextmanager
def stop_on_signals(
    saying: str = "stopping at a checkpoint; once more to stop at once",
) -> Iterator[Stop]:
    """Catch SIGINT and SIGTERM for as long as the context lasts.

    The first signal sets the flag and gives the signals back to the operating system, so that a
    second one ends the process even while compiled code runs; its results file still opens.

    Parameters
    ----------
    saying : str
        What the user is told at the first.
    """
    stop = Stop()
    before = {number: signal.getsignal(number) for number in _SIGNALS}

    def ask(number: int, frame: Any) -> None:
        stop.asked = True
        for caught in _SIGNALS:
            signal.signal(caught, signal.SIG_DFL)
        note(saying)

    for number in _SIGNALS:
        signal.signal(number, ask)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
