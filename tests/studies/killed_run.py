"""Script that kills runs, resumes them and prints the results as JSON lines.

A single process compiles and forks for every run that is killed.
"""

from __future__ import annotations

import json
import math
import os
import random
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from study_examples import LOADS, ROLLERS, run_differences, short

from tests.faulty_storage import WatchedStorage, one_of_each
from wearsim.atomic_write import DISK, Storage
from wearsim.scenario import Scenario
from wearsim.studies.opening import open_results
from wearsim.studies.run import in_progress, run as studies
from wearsim.studies.run.recorder import Event, Started
from wearsim.studies.run.result import Result

OFTEN = {"outputs.checkpoint_every": "1e-9 s"}


def go(scenario: Scenario, path: Path, storage: Storage = DISK) -> float:
    """Run or resume a test; return the passes from which it was resumed, -1 for none."""
    if not path.exists():
        studies.run(scenario, path, storage=storage)
        return -1.0
    starts = [float(scenario.total_passes)]  # there are no events of a finished run

    def watch(event: Event) -> None:
        if isinstance(event, Started):
            starts.append(event.from_passes)

    studies.resume(path, on_event=watch, storage=storage)
    return starts[-1]


def forked(work: Callable[[], object]) -> int:
    """Run `work` in a child process, and return the process id."""
    child = os.fork()
    if child:
        return child
    try:
        work()
    except BaseException as error:
        sys.stderr.write(f"{error!r}\n")
        os._exit(1)
    os._exit(0)


def ended(child: int) -> int:
    """Wait for a child; return the signal that killed it, or minus its exit code."""
    return -os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def seconds_of(work: Callable[[], object]) -> float:
    """Return the processor time of `work` in a child, by the timer of `ended_after` [s]."""
    limit = 1000.0
    reading, writing = os.pipe()

    def timed() -> None:
        signal.setitimer(signal.ITIMER_PROF, limit)
        work()
        os.write(writing, f"{limit - signal.getitimer(signal.ITIMER_PROF)[0]}".encode())

    assert ended(forked(timed)) == 0
    os.close(writing)
    with os.fdopen(reading) as output:
        return float(output.read())


def ended_after(seconds: float, work: Callable[[], object]) -> int:
    """Run `work` in a child that SIGPROF ends after a processor time [s].

    Unlike a wall clock, processor time does not depend on the load of the machine.
    """

    def limited() -> None:
        signal.setitimer(signal.ITIMER_PROF, max(seconds, 1e-6))
        work()

    return ended(forked(limited))


def stages_of(work: Callable[[Storage], object]) -> list[str]:
    """Return the file operations of `work`."""
    seen: list[str] = []
    work(WatchedStorage(seen.append))
    return seen


def chosen_of(stages: list[str], extent: str) -> list[int]:
    """Return the numbers of the write stages at which to kill.

    With one of each stage there is no kill after an operation, since one comes before the next.
    """
    each = one_of_each(stages)
    if extent == "each stage":
        return [number for number in each if stages[number].startswith("before")]
    return sorted({*range(0, len(stages), 6), *each})


def killing(at: int) -> Storage:
    """Return file operations that kill the process at one of their stages."""
    calls = iter(range(10**6))

    def kill(_: str) -> None:
        if next(calls) == at:
            os.kill(os.getpid(), signal.SIGKILL)

    return WatchedStorage(kill)


def kill_at_stages(scenario: Scenario, folder: Path, extent: str) -> None:
    """Kill a run at some write stages, see `chosen_of`; every fifth again when it is resumed.

    The names of all stages are printed first.
    """
    whole = studies.run(scenario)
    stages = stages_of(lambda storage: go(scenario, folder / "whole.h5", storage))
    write_line(stages=stages)
    for turn, number in enumerate(sorted({*chosen_of(stages, extent), len(stages) - 1})):
        path = folder / f"{number}.h5"
        again = [7 * number % 50] if turn % 5 == 0 else []
        killed = []
        for at in (number, *again):

            def work(at: int = at) -> None:
                go(scenario, path, killing(at))  # noqa: B023  (done before the next turn)

            killed.append(ended(forked(work)))
        write_line(number=number, killed=killed, **finished(scenario, path, whole))
        assert not path.with_name(f"{path.name}.tmp").exists()


def kill_at_moments(scenario: Scenario, folder: Path, count: int) -> None:
    """Kill runs at random moments, half of them again when they are resumed."""
    whole = studies.run(scenario)
    go(scenario, folder / "first.h5")  # imports modules for the children
    took = min(seconds_of(lambda at=folder / n: go(scenario, at)) for n in ("one.h5", "two.h5"))
    moments = random.Random(7)
    for number in range(count):
        path, killed = folder / f"{number}.h5", []
        for _ in range(1 + number % 2):
            seconds = moments.uniform(0.0, 1.0) * took
            killed.append(ended_after(seconds, lambda path=path: go(scenario, path)))
        write_line(killed=killed, **finished(scenario, path, whole))


def finished(scenario: Scenario, path: Path, whole: Result) -> dict[str, object]:
    """Resume a run; return the passes it was resumed from, and differences to the unbroken run."""
    passes = go(scenario, path)
    return {"resumed_from": passes, "differences": run_differences(open_results(path), whole)}


def write_line(**row: object) -> None:
    """Print a line of JSON for the test."""
    sys.stdout.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    in_progress.WRITING = math.inf  # the duration of writing does not limit the checkpoints
    mode, where = sys.argv[1], Path(sys.argv[2])
    if mode == "stages":
        kill_at_stages(short(**OFTEN, evolution__step=3000), where, sys.argv[3])
    else:
        kinds = {**LOADS["spring"], **ROLLERS["wearing"], **OFTEN}
        kill_at_moments(short(**kinds, evolution__step=1500), where, int(sys.argv[3]))
