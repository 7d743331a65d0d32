"""One point of the growth of costs, in a process of its own, whose peak of memory is then its own.

``python -m wearsim_bench.growth.point WORK FILE`` takes a `Work` as JSON and writes a `Cost` as
JSON to a file, since a plugin may print what it likes. A short test goes before, which is not
counted, so that nothing is compiled or loaded while time runs.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from wearsim.errors import WearsimError
from wearsim.scenario import Scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.run.run import run
from wearsim_bench.measure.memory import family_peak_bytes, peak_bytes
from wearsim_bench.measure.timing import timed

LONG = 1.0  # s, from which on it is timed once
SHORT = 100  # passes of the test that goes before


@dataclass(frozen=True)
class Work:
    """What a point does: a wear test, or an ensemble of them.

    Parameters
    ----------
    scenario : str
        Name of a shipped one.
    changes : dict of str to object
        Values by dotted key.
    realisations : int, optional
        Tests of an ensemble; without it there is one test.
    workers : int
        Processes that an ensemble's tests run in.
    repetitions : int
        Of the timing, unless it takes long; the least counts.
    """

    scenario: str
    changes: Mapping[str, object]
    realisations: int | None = None
    workers: int = 1
    repetitions: int = 1

    def asked(self, changes: Mapping[str, object] | None = None) -> Scenario:
        """Return the scenario with further changes."""
        return shipped_scenario(self.scenario, {**self.changes, **(changes or {})})


@dataclass(frozen=True)
class Cost:
    """What a point has taken, and what came of it.

    Parameters
    ----------
    seconds : float
        Least time [s].
    peak_bytes, added_bytes : int or None
        Most memory of all its processes, and how much of that is more than one of them holds with
        nothing but its modules; None where the system does not tell.
    file_bytes : int
        Of the results.
    depth : float
        At the end; of an ensemble its mean [m].
    stated : float
        Its error as the results state it, relative; of an ensemble the mean over its tests.
    half_width : float or None
        Half of the 95 % interval of an ensemble's mean depth, relative.
    """

    seconds: float
    peak_bytes: int | None
    added_bytes: int | None
    file_bytes: int
    depth: float
    stated: float
    half_width: float | None = None


class _Point:
    """A point: it does its work again and again, and keeps the most memory that is seen."""

    def __init__(self, work: Work, folder: Path) -> None:
        self.work, self.path = work, folder / "results.h5"
        self.peak = 0
        self.answer: dict[str, float] = {}

    def look(self, *_: object) -> None:
        """See how much memory there is by now."""
        self.peak = max(self.peak, family_peak_bytes(self.work.workers) or 0)

    def warm(self) -> None:
        """Do a short part of the work, so that all is compiled and loaded."""
        short = {"operation.passes": min(SHORT, self.work.asked().total_passes)}
        scenario = self.work.asked({**short, "outputs.records": 1})
        if self.work.realisations is None:
            run(scenario, self.path, force=True)
        else:
            ensemble(scenario, 2, self.path, force=True, scheduler="serial")

    def once(self) -> None:
        """Do the work."""
        (self._test if self.work.realisations is None else self._ensemble)()

    def _test(self) -> None:
        result = run(self.work.asked(), self.path, force=True)
        depth = float(result.depth[-1].max())
        self.answer = {"depth": depth, "stated": float(result.depth_error[-1].max()) / depth}

    def _ensemble(self) -> None:
        several = self.work.workers > 1
        found = ensemble(
            self.work.asked(),
            self.work.realisations or 1,
            self.path,
            force=True,
            workers=self.work.workers,
            on_progress=self.look if several else None,
        )
        mean = found.estimate("depth").mean
        stated = float(np.mean(found.values("depth_error") / found.at_end("depth")))
        self.answer = {"depth": mean.value, "stated": stated}
        if np.isfinite(mean.half_width):
            self.answer["half_width"] = mean.half_width / mean.value


def cost_of(work: Work) -> Cost:
    """Return what some work takes in this process, which has done nothing before.

    Parameters
    ----------
    work : Work
    """
    bare = peak_bytes()
    with TemporaryDirectory() as folder:
        point = _Point(work, Path(folder))
        point.warm()
        seconds = timed(point.once)
        point.look()
        if seconds < LONG:
            seconds = min([seconds, *(timed(point.once) for _ in range(work.repetitions - 1))])
        size = point.path.stat().st_size
    known = bare is not None
    return Cost(
        seconds=seconds,
        peak_bytes=point.peak if known else None,
        added_bytes=point.peak - bare if bare is not None else None,
        file_bytes=size,
        depth=point.answer["depth"],
        stated=point.answer["stated"],
        half_width=point.answer.get("half_width"),
    )


def main(arguments: list[str], write: Callable[[str], Any]) -> None:
    """Do the work that is given as JSON, and write what it takes, or why it cannot be done."""
    try:
        told = asdict(cost_of(Work(**json.loads(arguments[0]))))
    except WearsimError as error:
        told = {"failed": str(error).splitlines()[0]}
    except Exception as error:
        told = {"failed": f"raised {type(error).__name__}: {error}".splitlines()[0]}
    write(json.dumps(told))


if __name__ == "__main__":
    main(sys.argv[1:], partial(Path(sys.argv[2]).write_text, encoding="utf-8"))
