"""One study of a scaling benchmark, run in a separate process to measure its peak memory.

``python -m wearsim_bench.growth.point WORKLOAD FILE`` takes a `Workload` as JSON and writes a
`Cost` as JSON to a file, since plugins may write to stdout. An untimed short test is run first, so
that compilation and imports are not timed.
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

LONG = 1.0  # s, longer studies are timed once
SHORT = 100  # passes of the untimed test


@dataclass(frozen=True)
class Workload:
    """A wear test or an ensemble of wear tests.

    Parameters
    ----------
    scenario : str
        Name of a shipped scenario.
    changes : dict of str to object
        Changed values by dotted key.
    realisations : int, optional
        Realisations of an ensemble; None for a single test.
    workers : int
        Worker processes of an ensemble.
    repetitions : int
        Repetitions of the timing of short studies; the smallest time is used.
    """

    scenario: str
    changes: Mapping[str, object]
    realisations: int | None = None
    workers: int = 1
    repetitions: int = 1

    def scenario_with(self, changes: Mapping[str, object] | None = None) -> Scenario:
        """Return the scenario with further changes."""
        return shipped_scenario(self.scenario, {**self.changes, **(changes or {})})


@dataclass(frozen=True)
class Cost:
    """Time, memory and result of a study.

    Parameters
    ----------
    seconds : float
        Smallest time [s].
    peak_bytes, added_bytes : int or None
        Peak memory of all processes, and the part above that of one process after its imports;
        None if not available.
    file_bytes : int
        Size of the results file.
    depth : float
        Final depth; for an ensemble the mean [m].
    stated : float
        Relative error estimate of the results; for an ensemble the mean over its tests.
    half_width : float or None
        Relative half-width of the 95 % confidence interval of the mean depth.
    """

    seconds: float
    peak_bytes: int | None
    added_bytes: int | None
    file_bytes: int
    depth: float
    stated: float
    half_width: float | None = None


class _WorkloadRunner:
    """Repeated run of a workload, with the peak memory."""

    def __init__(self, work: Workload, folder: Path) -> None:
        self.work, self.path = work, folder / "results.h5"
        self.peak = 0
        self.result: dict[str, float] = {}

    def update_peak(self, *_: object) -> None:
        """Update the peak memory."""
        self.peak = max(self.peak, family_peak_bytes(self.work.workers) or 0)

    def warm(self) -> None:
        """Run a short part of the workload, for compilation and imports."""
        short = {"operation.passes": min(SHORT, self.work.scenario_with().total_passes)}
        scenario = self.work.scenario_with({**short, "outputs.records": 1})
        if self.work.realisations is None:
            run(scenario, self.path, force=True)
        else:
            ensemble(scenario, 2, self.path, force=True, scheduler="serial")

    def once(self) -> None:
        """Run the workload once."""
        (self._test if self.work.realisations is None else self._ensemble)()

    def _test(self) -> None:
        result = run(self.work.scenario_with(), self.path, force=True)
        depth = float(result.depth[-1].max())
        self.result = {"depth": depth, "stated": float(result.depth_error[-1].max()) / depth}

    def _ensemble(self) -> None:
        several = self.work.workers > 1
        results = ensemble(
            self.work.scenario_with(),
            self.work.realisations or 1,
            self.path,
            force=True,
            workers=self.work.workers,
            on_progress=self.update_peak if several else None,
        )
        mean = results.estimate("depth").mean
        stated = float(np.mean(results.values("depth_error") / results.at_end("depth")))
        self.result = {"depth": mean.value, "stated": stated}
        if np.isfinite(mean.half_width):
            self.result["half_width"] = mean.half_width / mean.value


def cost_of(work: Workload) -> Cost:
    """Return the cost of a workload in this process, which must be a new one."""
    bare = peak_bytes()
    with TemporaryDirectory() as folder:
        runner = _WorkloadRunner(work, Path(folder))
        runner.warm()
        seconds = timed(runner.once)
        runner.update_peak()
        if seconds < LONG:
            seconds = min([seconds, *(timed(runner.once) for _ in range(work.repetitions - 1))])
        size = runner.path.stat().st_size
    known = bare is not None
    return Cost(
        seconds=seconds,
        peak_bytes=runner.peak if known else None,
        added_bytes=runner.peak - bare if bare is not None else None,
        file_bytes=size,
        depth=runner.result["depth"],
        stated=runner.result["stated"],
        half_width=runner.result.get("half_width"),
    )


def main(arguments: list[str], write: Callable[[str], Any]) -> None:
    """Run the workload given as JSON, and write its cost or the reason of its failure."""
    try:
        cost = asdict(cost_of(Workload(**json.loads(arguments[0]))))
    except WearsimError as error:
        cost = {"failed": str(error).splitlines()[0]}
    except Exception as error:
        cost = {"failed": f"raised {type(error).__name__}: {error}".splitlines()[0]}
    write(json.dumps(cost))


if __name__ == "__main__":
    main(sys.argv[1:], partial(Path(sys.argv[2]).write_text, encoding="utf-8"))
