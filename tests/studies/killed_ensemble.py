"""Script that kills ensembles, resumes them and prints the results as JSON lines.

A single process compiles and forks for every ensemble that is killed.
"""

from __future__ import annotations

import itertools
import random
import sys
from pathlib import Path

from killed_run import (
    chosen_of,
    ended,
    ended_after,
    forked,
    killing,
    seconds_of,
    stages_of,
    write_line,
)

from tests.fixed_batches import batches_of
from tests.studies.ensemble_cases import differences, small
from wearsim.atomic_write import DISK, Storage
from wearsim.scenario import Scenario
from wearsim.studies.ensemble import driver, realisation
from wearsim.studies.ensemble.api import ensemble, resume_ensemble
from wearsim.studies.opening import open_ensemble


def go(scenario: Scenario, count: int, path: Path, storage: Storage = DISK) -> int:
    """Run or resume an ensemble; return the number of completed realisations, -1 for no file."""
    if not path.exists():
        ensemble(scenario, count, path, scheduler="serial", storage=storage)
        return -1
    done = int((open_ensemble(path).raw.status != 0).sum())
    resume_ensemble(path, scheduler="serial", storage=storage)
    return done


def kill_at_stages(scenario: Scenario, count: int, folder: Path, extent: str) -> None:
    """Kill an ensemble at every sixth write stage, or one of each kind, of each of its writers.

    No kill comes after a write, since one comes before the next operation; with one of each kind
    this holds for all operations, and the two parts, which are written in the same way, have every
    second kind each. The names of all stages are printed first. Every fifth is killed again when it
    is resumed.
    """
    whole = ensemble(scenario, count, folder / "one.h5", scheduler="serial")
    stages = stages_of(lambda storage: go(scenario, count, folder / "whole.h5", storage))
    write_line(stages=stages)
    created = stages.index("after fsync folder") + 1  # parts and their merging follow
    third = (len(stages) - created) // 3
    bounds = [0, created, created + third, created + 2 * third, len(stages)]
    numbers = []
    for place, (start, stop) in enumerate(itertools.pairwise(bounds)):
        found = [start + number for number in chosen_of(stages[start:stop], extent)]
        if extent == "each stage" and place in {1, 2}:
            found = found[place - 1 :: 2]
        numbers += found
    chosen = [number for number in numbers if stages[number] != "after write"]
    for turn, number in enumerate(chosen):
        path = folder / f"{number}.h5"
        again = [7 * number % 30] if turn % 5 == 0 else []
        killed = []
        for at in (number, *again):

            def work(at: int = at, path: Path = path) -> None:
                go(scenario, count, path, killing(at))

            killed.append(ended(forked(work)))
        done = go(scenario, count, path)
        write_line(number=number, killed=killed, done=done, differences=differences(path, whole))


def kill_at_moments(scenario: Scenario, count: int, folder: Path, times: int) -> None:
    """Kill ensembles at random moments, half of them again when they are resumed."""
    whole = ensemble(scenario, count, folder / "one.h5", scheduler="serial")
    go(scenario, count, folder / "first.h5")  # imports modules for the children
    took = seconds_of(lambda: go(scenario, count, folder / "whole.h5"))
    moments = random.Random(11)
    for number in range(times):
        path, killed = folder / f"{number}.h5", []
        for _ in range(1 + number % 2):
            seconds = moments.uniform(0.0, 1.0) * took
            killed.append(ended_after(seconds, lambda path=path: go(scenario, count, path)))
        done = go(scenario, count, path)
        write_line(killed=killed, done=done, differences=differences(path, whole))


if __name__ == "__main__":
    driver.BatchSizes = batches_of(1)
    realisation.AXIS_REALISATIONS = 3  # drawn again after every kill
    mode, where = sys.argv[1], Path(sys.argv[2])
    if mode == "stages":
        quick = {"evolution__strip_error": False, "evolution__tolerance": 0.1}
        kill_at_stages(small(passes=100, contact__strips=31, **quick), 2, where, sys.argv[3])
    else:
        tests = small(passes=400, contact__strips=31)
        kill_at_moments(tests, 8, where, int(sys.argv[3]))
