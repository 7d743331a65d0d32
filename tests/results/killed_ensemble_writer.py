"""Separate process that writes ensembles and kills itself at every stage."""

from __future__ import annotations

import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from ensemble_examples import finish, some_header, some_outcome, some_static

from tests.faulty_storage import WatchedStorage, one_of_each, some_of_each
from wearsim.atomic_write import DISK, Storage
from wearsim.studies.ensemble.file import writer
from wearsim.studies.ensemble.file.data import Outcome
from wearsim.studies.ensemble.file.schema import DONE
from wearsim.studies.ensemble.file.writer import EnsembleFile

COUNT, STRIPS = 5, 60
BATCHES = ([3, 0, 1], [4, 2])
FAILED = (1, 4)
SMALL_PART = 10_000  # bytes: a batch and no more


def outcome(number: int, fails: bool) -> Outcome:
    """Return a realisation of the killed ensemble."""
    error = f"realisation {number} lost contact" if fails else ""
    return some_outcome(number, STRIPS, error)


def create(path: Path, storage: Storage = DISK) -> None:
    """Write an ensemble of pending realisations."""
    EnsembleFile.create(path, some_header(COUNT), some_static(STRIPS), storage).close()


def continue_writing(
    path: Path, batches: Iterable[list[int]] = BATCHES, storage: Storage = DISK
) -> None:
    """Write missing realisations, with a state after each batch, then repeat the failed ones."""
    with EnsembleFile.open(path, storage) as file:
        for batch in batches:
            missing = [number for number in batch if not file.status[number]]
            file.put([outcome(number, number in FAILED) for number in missing])
            file.put_state(wall_seconds=file.data.wall_seconds + len(missing))
        again = [number for batch in batches for number in batch if file.status[number] != DONE]
        file.clear(again)
        file.put([outcome(number, fails=False) for number in again])


def merge(path: Path, storage: Storage = DISK) -> None:
    """Merge the parts of an ensemble."""
    with EnsembleFile.open(path, storage) as file:
        finish(file)


def finish_writing(path: Path) -> None:
    """Write the pending realisations, and merge the parts."""
    continue_writing(path)
    merge(path)


def complete(path: Path) -> None:
    """Write all realisations that are not done in one batch, and merge the parts."""
    with EnsembleFile.open(path) as file:
        missing = [number for number in range(COUNT) if file.status[number] != DONE]
        file.clear(missing)
        file.put([outcome(number, fails=False) for number in missing])
        finish(file)


def kill_while(work: Callable[[Storage], None], at: int) -> int:
    """Fork, kill the child at file operation number `at`, and return the signal."""
    child = os.fork()
    if child:
        return os.WTERMSIG(os.waitpid(child, 0)[1])
    calls = iter(range(10**6))

    def kill(stage: str) -> None:
        if next(calls) == at:
            os.kill(os.getpid(), signal.SIGKILL)

    work(WatchedStorage(kill))
    os._exit(0)


def kill_at_stages(
    kind: str, start: Path | None, work: Callable[[Path, Storage], None], every: bool
) -> None:
    """Kill the work on a copy of `start`, or without a file; print file, signal and stage.

    The kills are at every file operation, or at one of each kind.
    """
    stages: list[str] = []
    if start:
        copy_of(start, folder / f"{kind}.h5")
    work(folder / f"{kind}.h5", WatchedStorage(stages.append))
    for at in some_of_each(stages) if every else one_of_each(stages):
        name = stages[at]
        if name.startswith("before"):  # a "before" follows each "after" at once
            target = folder / f"{kind}-{at}.h5"
            if start:
                copy_of(start, target)
            killed_by = kill_while(lambda storage: work(target, storage), at)  # noqa: B023
            sys.stdout.write(f"{target.name},{killed_by},{name}\n")


def copy_of(path: Path, target: Path) -> None:
    """Copy an ensemble with its parts."""
    shutil.copy(path, target)
    shutil.copytree(f"{path}.parts", f"{target}.parts")


if __name__ == "__main__":
    folder, every = Path(sys.argv[1]), sys.argv[2] == "all"
    writer.PART_BYTES = SMALL_PART
    fresh, written, whole = (folder / f"{name}.h5" for name in ("fresh", "written", "whole"))
    create(fresh)
    kill_at_stages("create", None, create, every)
    kill_at_stages(
        "rows", fresh, lambda path, storage: continue_writing(path, BATCHES[:1], storage), every
    )
    create(written)
    continue_writing(written)
    kill_at_stages("merge", written, merge, every)
    create(whole)
    finish_writing(whole)
