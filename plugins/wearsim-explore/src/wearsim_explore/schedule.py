"""Order of computations: of each session at most one running, and only the newest one waiting."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from wearsim_explore.answers import Request

_PATIENCE = 2.0  # s; a first answer that takes longer is stopped for a newer one


@dataclass
class Schedule:
    """Computations that share some workers.

    A request replaces the waiting one of its session. First answers are computed before refined
    ones. If all workers are busy, a first answer stops a refined one of another session, which is
    computed again later.

    Parameters
    ----------
    workers : int
        Number of workers.
    clock : callable
        Returns the time [s].

    Attributes
    ----------
    waiting : dict of str to Request
        By session, in the order of arrival.
    running : dict of int to Request
        By worker.
    stopping : set of int
        Workers that have been asked to stop.
    """

    workers: int
    clock: Callable[[], float] = time.monotonic
    waiting: dict[str, Request] = field(default_factory=dict)
    running: dict[int, Request] = field(default_factory=dict)
    stopping: set[int] = field(default_factory=set)
    _started: dict[int, float] = field(default_factory=dict)
    _outdated: set[int] = field(default_factory=set)

    def ask(self, request: Request) -> None:
        """Add a waiting request, in place of an older one of its session."""
        self.waiting[request.session] = request
        self.outdate(request.session, request.number)

    def outdate(self, session: str, number: int) -> None:
        """Mark the running computation of a session as outdated by a newer state of its design."""
        for worker, running in self.running.items():
            if running.session == session and running.number != number:
                slow = self.clock() - self._started[worker] > _PATIENCE
                if running.stage != "first" or slow:
                    self._outdated.add(worker)

    def forget(self, session: str) -> None:
        """Remove a session that has ended."""
        self.waiting.pop(session, None)
        self._outdated |= {w for w, request in self.running.items() if request.session == session}

    def drop(self, session: str) -> None:
        """Remove the waiting request of a session."""
        self.waiting.pop(session, None)

    def to_start(self) -> list[tuple[int, Request]]:
        """Return workers with the requests that they compute from now on."""
        started = []
        for worker in range(self.workers):
            if worker in self.running or not (request := self._next()):
                continue
            del self.waiting[request.session]
            self.running[worker] = request
            self._started[worker] = self.clock()
            started.append((worker, request))
        return started

    def to_stop(self) -> list[int]:
        """Return the workers to ask to stop, each once."""
        stop = set(self._outdated)
        request = self._next()
        if request and request.stage == "first" and not (self.stopping | stop):
            refined = [w for w, running in self.running.items() if running.stage != "first"]
            stop |= set(refined[:1]) if len(self.running) == self.workers else set()
        new = sorted((stop & self.running.keys()) - self.stopping)
        self.stopping |= set(new)
        return new

    def finished(self, worker: int, *, complete: bool) -> bool:
        """Free a worker; return whether its answer is wanted.

        Parameters
        ----------
        worker : int
        complete : bool
            False for a computation that was stopped. It waits again, unless it is outdated.
        """
        request, outdated = self.running.pop(worker), worker in self._outdated
        self.stopping.discard(worker)
        self._outdated.discard(worker)
        if not complete and not outdated:
            self.waiting.setdefault(request.session, request)
        return complete and not outdated

    def _next(self) -> Request | None:
        busy = {request.session for request in self.running.values()}
        free = [request for session, request in self.waiting.items() if session not in busy]
        first = (request for request in free if request.stage == "first")
        return next(first, free[0] if free else None)
