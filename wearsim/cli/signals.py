"""SIGINT and SIGTERM: the first one stops a run at a checkpoint, the second one at once."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from wearsim.cli.output import note

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@dataclass
class Stop:
    """Flag that is set by a signal."""

    received: bool = False

    def requested(self) -> bool:
        """Return whether a stop is requested."""
        return self.received


@contextmanager
def stop_on_signals(
    message: str = "stopping at a checkpoint; repeat to stop at once",
) -> Iterator[Stop]:
    """Catch SIGINT and SIGTERM while the context is open.

    The first signal sets the flag and restores the default handlers, so that a second one ends the
    process even while compiled code runs; the results file remains readable.

    Parameters
    ----------
    message : str
        Written to stderr at the first signal.
    """
    stop = Stop()
    # a process of loky outlives a process that is ended by a signal, and would warn of it
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker:UserWarning")
    before = {number: signal.getsignal(number) for number in _SIGNALS}

    def handle(number: int, frame: Any) -> None:
        stop.received = True
        for caught in _SIGNALS:
            signal.signal(caught, signal.SIG_DFL)
        note(message)

    for number in _SIGNALS:
        signal.signal(number, handle)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
