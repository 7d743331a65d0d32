"""Processes that compute the answers of all sessions of a server."""

from __future__ import annotations

import asyncio
import contextlib
import os
import pickle
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wearsim_explore.answers import Answer, FieldMistake, Request
from wearsim_explore.schedule import Schedule
from wearsim_explore.worker import LENGTH, message_of

_LIMIT = 2**24  # bytes that are read ahead
_GRACE = 3.0  # s, after which a worker that was asked to stop is ended


@dataclass
class _Worker:
    """A process, and its index in its schedule."""

    process: asyncio.subprocess.Process
    reading: asyncio.Task[None]


class Pool:
    """Workers of a server: quick ones for tests, and a slow one for lives.

    Parameters
    ----------
    scratch : Path
        Folder for files of computations, which workers remove if the server was killed.
    workers : int, optional
        Number of quick workers; by default the number of processors.

    Attributes
    ----------
    listeners : dict of str to callable
        Functions that receive the answers of a session, and the progress as a number of tests.
    """

    def __init__(self, scratch: Path, workers: int | None = None) -> None:
        self._scratch = scratch
        count = workers or os.cpu_count() or 1
        self.schedules = {"quick": Schedule(count), "slow": Schedule(1)}
        self.listeners: dict[str, Callable[[Request, Answer | int], None]] = {}
        self._workers: dict[tuple[str, int], _Worker] = {}
        self._starting = asyncio.Lock()
        self._closed = False

    def ask(self, request: Request) -> None:
        """Compute an answer as soon as a worker is free."""
        slow = request.stage == "lives"
        self.schedules["slow" if slow else "quick"].ask(request)
        if not slow:
            self.outdate(request.session, request.number)
        self._go_on()

    def outdate(self, session: str, number: int) -> None:
        """Stop the computations of a session for older states of its design."""
        slow = self.schedules["slow"]
        waiting = slow.waiting.get(session)
        if waiting is not None and waiting.number != number:
            slow.drop(session)
        slow.outdate(session, number)
        self._go_on()

    def forget(self, session: str) -> None:
        """Stop all computations of a session that has ended."""
        self.listeners.pop(session, None)
        for schedule in self.schedules.values():
            schedule.forget(session)
        self._go_on()

    async def warm_up(self) -> None:
        """Start all workers, so that the first answer does not wait for it."""
        for name, schedule in self.schedules.items():
            for index in range(schedule.workers):
                await self._worker(name, index)

    async def close(self) -> None:
        """End all workers."""
        self._closed = True
        for worker in self._workers.values():
            worker.reading.cancel()
            with contextlib.suppress(ProcessLookupError):
                worker.process.kill()
        for worker in self._workers.values():
            await worker.process.wait()
        self._workers.clear()

    def _go_on(self) -> None:
        if self._closed:
            return
        for name, schedule in self.schedules.items():
            for index in schedule.to_stop():
                self._tell(name, index, None)
                loop = asyncio.get_running_loop()
                loop.call_later(_GRACE, self._end, name, index, schedule.running[index])
            for index, request in schedule.to_start():
                self._tell(name, index, request)

    def _tell(self, name: str, index: int, message: Request | None) -> None:
        worker = self._workers.get((name, index))
        if worker is not None and worker.process.stdin is not None:
            worker.process.stdin.write(message_of(message))
        else:
            task = asyncio.ensure_future(self._start_with(name, index, message))
            task.add_done_callback(lambda done: done.exception())

    async def _start_with(self, name: str, index: int, message: Request | None) -> None:
        worker = await self._worker(name, index)
        if worker is not None and worker.process.stdin is not None:
            worker.process.stdin.write(message_of(message))

    async def _worker(self, name: str, index: int) -> _Worker | None:
        """Return a worker, started if it is not there."""
        async with self._starting:
            if not self._closed and (name, index) not in self._workers:
                await self._start(name, index)
        return self._workers.get((name, index))

    async def _start(self, name: str, index: int) -> None:
        command = [sys.executable, "-m", "wearsim_explore.worker", str(self._scratch)]
        process = await asyncio.create_subprocess_exec(
            *command,
            *(["--slow"] if name == "slow" else []),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            limit=_LIMIT,
        )
        reading = asyncio.ensure_future(self._read(name, index, process))
        self._workers[name, index] = _Worker(process, reading)

    async def _read(self, name: str, index: int, process: asyncio.subprocess.Process) -> None:
        stream = process.stdout
        if stream is None:
            return
        while True:
            try:
                head = await stream.readexactly(LENGTH.size)
                content = pickle.loads(await stream.readexactly(*LENGTH.unpack(head)))
            except asyncio.IncompleteReadError:
                content = RuntimeError("the computation ended unexpectedly")
                self._workers.pop((name, index), None)
            if index in self.schedules[name].running:
                self._receive(name, index, content)
            if (name, index) not in self._workers:
                return

    def _receive(self, name: str, index: int, content: Any) -> None:
        schedule = self.schedules[name]
        request = schedule.running[index]
        listener = self.listeners.get(request.session)
        if isinstance(content, int):
            if listener is not None and index not in schedule.stopping:
                listener(request, content)
            return
        stopped = content is None or (isinstance(content, Exception) and index in schedule.stopping)
        wanted = schedule.finished(index, complete=not stopped)
        if isinstance(content, Exception):
            content = Answer(mistakes=(FieldMistake("", "", str(content)),))
        try:
            if wanted and listener is not None:
                listener(request, content)
        finally:
            self._go_on()

    def _end(self, name: str, index: int, request: Request) -> None:
        """End a worker that has not stopped; another one is started when it is needed."""
        worker = self._workers.get((name, index))
        if worker is not None and self.schedules[name].running.get(index) is request:
            with contextlib.suppress(ProcessLookupError):
                worker.process.kill()
