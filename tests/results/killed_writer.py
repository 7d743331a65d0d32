"""Separate process that overwrites one file per stage and kills itself at that stage."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

from run_examples import some_run

from tests.faulty_storage import WatchedStorage, some_of_each
from wearsim.results.io.files import write_results


def stages_of_a_write(path: Path) -> list[str]:
    """Return all file operations, in order; one may occur more than once."""
    seen: list[str] = []
    write_results(path, some_run(seed=2, strips=200, records=10), WatchedStorage(seen.append))
    return seen


def kill_while_writing(path: Path, at: int) -> int:
    """Fork, kill the child at file operation number `at`, and return the signal."""
    child = os.fork()
    if child:
        return os.WTERMSIG(os.waitpid(child, 0)[1])
    calls = iter(range(10**6))

    def kill(stage: str) -> None:
        if next(calls) == at:
            os.kill(os.getpid(), signal.SIGKILL)

    write_results(path, some_run(seed=2, strips=200, records=10), WatchedStorage(kill))
    os._exit(0)


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    stages = stages_of_a_write(folder / "whole.h5")
    write_results(folder / "old.h5", some_run(seed=1))
    old = (folder / "old.h5").read_bytes()
    for number in some_of_each(stages):
        name, target = stages[number], folder / f"{number}.h5"
        if number % 2 == 0:  # with and without an old file
            target.write_bytes(old)
        killed_by = kill_while_writing(target, number)
        sys.stdout.write(f"{number},{killed_by},{name}\n")
