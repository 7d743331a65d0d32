"""Run as a process: has runs killed, finishes what they left, and tells what came of it.

One process does all: it compiles and runs once, and forks for every run that is to be killed.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from study_examples import LOADS, ROLLERS, short, unlike

from wearsim.results import Result, open_results
from wearsim.results.io import atomic_write
from wearsim.scenario import Scenario
from wearsim.studies.run import run as replay
from wearsim.studies.run.events import Event, Started

OFTEN = {"outputs.checkpoint_every": "1e-9 s"}
SMALL_CHUNK = 1 << 15  # several writes to a file


def go(scenario: Scenario, path: Path) -> float:
    """Run a test, or go on with what there is of it; return where it stood, -1 for nowhere."""
    if not path.exists():
        replay.run(scenario, path)
        return -1.0
    stood = [float(scenario.total_passes)]  # nothing is told of a finished run

    def watch(event: Event) -> None:
        if isinstance(event, Started):
            stood.append(event.from_passes)

    replay.resume(path, on_event=watch)
    return stood[-1]


def forked(work: Callable[[], object]) -> int:
    """Do `work` in a child, and return its process id."""
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
    """Return the processor time that `work` takes in a child, by the timer of `ended_after` [s]."""
    plenty = 1000.0
    reading, writing = os.pipe()

    def timed() -> None:
        signal.setitimer(signal.ITIMER_PROF, plenty)
        work()
        os.write(writing, f"{plenty - signal.getitimer(signal.ITIMER_PROF)[0]}".encode())

    assert ended(forked(timed)) == 0
    os.close(writing)
    with os.fdopen(reading) as told:
        return float(told.read())


def ended_after(seconds: float, work: Callable[[], object]) -> int:
    """Do `work` in a child that SIGPROF ends when it has had so much processor time [s].

    No wall clock: a busy machine moves no kill to before the work begins.
    """

    def limited() -> None:
        signal.setitimer(signal.ITIMER_PROF, max(seconds, 1e-6))
        work()

    return ended(forked(limited))


def stages_of(work: Callable[[], object]) -> list[str]:
    """Return every call of the seam while `work` is done."""
    seen: list[str] = []
    atomic_write.on_write_stage = seen.append
    work()
    atomic_write.on_write_stage = lambda _: None
    return seen


def chosen_of(stages: list[str], extent: str) -> list[int]:
    """Return the numbers of the calls of the seam at which to kill."""
    return {"all": list(range(len(stages))), "each stage": one_of_each(stages)}[extent]


def killing(at: int) -> Callable[[str], None]:
    """Return a seam that kills the process at one of its calls."""
    calls = iter(range(10**6))

    def kill(_: str) -> None:
        if next(calls) == at:
            os.kill(os.getpid(), signal.SIGKILL)

    return kill


def one_of_each(stages: list[str]) -> list[int]:
    """Return the numbers of one call per stage: of the first, of the last, or of one between."""
    chosen = []
    for turn, name in enumerate(dict.fromkeys(stages)):
        calls = [number for number, stage in enumerate(stages) if stage == name]
        chosen.append(calls[(0, len(calls) // 2, -1)[turn % 3]])
    return sorted(chosen)


def kill_at_stages(scenario: Scenario, folder: Path, extent: str) -> None:
    """Kill a run at calls of the seam, all or one per stage; every fifth once more as it goes on.

    Tells the names of all calls first.
    """
    whole = replay.run(scenario)
    atomic_write._CHUNK = SMALL_CHUNK
    stages = stages_of(lambda: go(scenario, folder / "whole.h5"))
    tell(stages=stages)
    for turn, number in enumerate(chosen_of(stages, extent)):
        path = folder / f"{number}.h5"
        again = [7 * number % 50] if turn % 5 == 0 else []
        killed = []
        for at in (number, *again):

            def work(at: int = at) -> None:
                atomic_write.on_write_stage = killing(at)
                go(scenario, path)  # noqa: B023  (done before the next turn)

            killed.append(ended(forked(work)))
        tell(number=number, killed=killed, **finished(scenario, path, whole))
        assert not path.with_name(f"{path.name}.part").exists()


def kill_at_moments(scenario: Scenario, folder: Path, count: int) -> None:
    """Kill runs at random moments, half of them once more as they go on."""
    whole = replay.run(scenario)
    go(scenario, folder / "first.h5")  # imports what children find in memory
    took = min(seconds_of(lambda at=folder / n: go(scenario, at)) for n in ("one.h5", "two.h5"))
    moments = random.Random(7)
    for number in range(count):
        path, killed = folder / f"{number}.h5", []
        for _ in range(1 + number % 2):
            seconds = moments.uniform(0.0, 1.0) * took
            killed.append(ended_after(seconds, lambda path=path: go(scenario, path)))
        tell(killed=killed, **finished(scenario, path, whole))


def finished(scenario: Scenario, path: Path, whole: Result) -> dict[str, object]:
    """Finish a run; return where it stood and what sets its file apart from the unbroken one."""
    stood = go(scenario, path)
    return {"stood": stood, "unlike": unlike(open_results(path), whole)}


def tell(**row: object) -> None:
    """Write a line for the test."""
    sys.stdout.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    replay._RunInProgress._last_write = property(lambda _: 0.0, lambda _, seconds: None)
    mode, where = sys.argv[1], Path(sys.argv[2])
    if mode == "stages":
        kill_at_stages(short(**OFTEN, evolution__step=3000), where, sys.argv[3])
    else:
        kinds = {**LOADS["spring"], **ROLLERS["wearing"], **OFTEN}
        kill_at_moments(short(**kinds, evolution__step=1500), where, int(sys.argv[3]))
