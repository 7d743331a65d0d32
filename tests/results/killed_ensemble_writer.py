"""Separate process that writes ensembles and kills itself at every stage."""

from __future__ import annotations

import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from ensemble_examples import some_header, some_outcome, some_static

from wearsim.results import EnsembleFile, Outcome
from wearsim.results.ensemble.schema import DONE
from wearsim.results.io import atomic_write

COUNT, STRIPS = 5, 60
BATCHES = ([3, 0, 1], [4, 2])
FAILED = (1, 4)
SMALL_CHUNK = 400  # two writes per profile, so that a kill can leave half of one


def outcome(number: int, fails: bool) -> Outcome:
    """Return a realisation of the killed ensemble."""
    error = f"realisation {number} lost contact" if fails else ""
    return some_outcome(number, STRIPS, error)


def create(path: Path) -> None:
    """Write an ensemble of pending realisations."""
    EnsembleFile.create(path, some_header(COUNT), some_static(STRIPS)).close()


def continue_writing(path: Path, batches: Iterable[list[int]] = BATCHES) -> None:
    """Write missing realisations, with a state after each batch, then repeat the failed ones."""
    with EnsembleFile.open(path) as file:
        for batch in batches:
            missing = [number for number in batch if not file.status[number]]
            file.put([outcome(number, number in FAILED) for number in missing])
            file.put_state({"wall_seconds": file.data.wall_seconds + len(missing)})
        again = [number for batch in batches for number in batch if file.status[number] != DONE]
        file.clear(again)
        file.put([outcome(number, fails=False) for number in again])


def kill_while(work: Callable[[], None], at: int) -> int:
    """Fork, kill the child at call number `at` of the write hook, and return the signal."""
    child = os.fork()
    if child:
        return os.WTERMSIG(os.waitpid(child, 0)[1])
    calls = iter(range(10**6))

    def kill(stage: str) -> None:
        if next(calls) == at:
            os.kill(os.getpid(), signal.SIGKILL)

    atomic_write.on_write_stage = kill
    work()
    os._exit(0)


def stages_of(work: Callable[[], None]) -> list[str]:
    """Return all calls of the write hook, in order."""
    seen: list[str] = []
    atomic_write.on_write_stage = seen.append
    work()
    atomic_write.on_write_stage = lambda _: None
    return seen


def kill_at_stages(kind: str, start: Path | None, work: Callable[[Path], None]) -> None:
    """Kill the work on a copy of `start`, or without a file; print file, signal and stage.

    The kills are at every call of the write hook, or at the first, middle and last of each stage.
    """
    stages = stages_of(lambda: work(whole))
    for at, name in enumerate(stages):
        calls = [number for number, stage in enumerate(stages) if stage == name]
        chosen = every or at in {calls[0], calls[len(calls) // 2], calls[-1]}
        if chosen and name.startswith("before"):  # a "before" follows each "after" at once
            target = folder / f"{kind}-{at}.h5"
            if start:
                shutil.copy(start, target)
            killed_by = kill_while(lambda: work(target), at)  # noqa: B023
            sys.stdout.write(f"{target.name},{killed_by},{name}\n")


if __name__ == "__main__":
    folder, every = Path(sys.argv[1]), sys.argv[2] == "all"
    fresh, whole = folder / "fresh.h5", folder / "whole.h5"
    create(fresh)
    kill_at_stages("create", None, create)
    atomic_write._CHUNK = SMALL_CHUNK
    kill_at_stages("rows", fresh, lambda path: continue_writing(path, BATCHES[:1]))
    continue_writing(whole)
