"""Jobs of the sampling benchmark: parts of studies, control draws, and timed studies."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeAlias

import numpy as np

from wearsim.errors import SolverError
from wearsim.scenario import Scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.ensemble.batch_sizes import MOST_IN_BATCH
from wearsim.studies.ensemble.designs import EnsemblePlan
from wearsim.studies.ensemble.realisation import (
    DRAWS,
    RealisationRunner,
    closed_form_depths,
    control_of,
    profile_axis,
)
from wearsim.studies.execution.factory import executor
from wearsim.studies.run.draws import Drawer
from wearsim.types import FloatArray, Grid
from wearsim.uq.sampling.sampler import PlanName
from wearsim_bench.measure.measurement import OnProgress

RIG = "rig-ensemble"
CHEAP: Mapping[str, object] = {
    "creepage.misalignment.persistence": "per-test",  # identical rollers are solved as one contact
    "contact.strips": 31,
    "outputs.records": 1,
}
"""Changes that shorten a test of the rig and keep all random inputs."""


def rig(seed: int, changes: Mapping[str, object] | None = None) -> Scenario:
    """Return the rig with all random inputs, with short tests.

    Parameters
    ----------
    seed : int
        Seed of the draws.
    changes : mapping of str to object, optional
        Further changes by dotted key.
    """
    return shipped_scenario(RIG, {**CHEAP, "seed": seed, **(changes or {})})


@dataclass(frozen=True)
class Part:
    """Consecutive tests of one study.

    Parameters
    ----------
    plan : str
        The sampling design.
    seed : int
        Seed of the study.
    total : int
        Number of tests of the whole study.
    first, count : int
        First test, and number of tests of this part.
    """

    plan: PlanName
    seed: int
    total: int
    first: int
    count: int

    @property
    def cost(self) -> float:
        """Approximate cost, in tests."""
        return float(self.count)

    def run(self) -> FloatArray:
        """Return final depths and their closed-form approximations, shape (2, count) [m].

        Raises
        ------
        SolverError
            If a test fails.
        """
        scenario = rig(self.seed)
        runner = RealisationRunner(scenario, self.plan, self.total, _grid())
        numbers = range(self.first, self.first + self.count)
        outcomes = runner(numbers)
        failed = [outcome for outcome in outcomes if outcome.error]
        if failed:
            where = f"{self.plan}, seed {self.seed}, realisation {failed[0].number}"
            raise SolverError(f"{len(failed)} tests failed, the first ({where}): {failed[0].error}")
        depths = np.array([np.asarray(outcome.values["depth"])[-1] for outcome in outcomes])
        columns = runner.drawer.columns(self.first, self.count)
        return np.array([depths, closed_form_depths(scenario, columns, self.count)])


@dataclass(frozen=True)
class ControlDraws:
    """Draws for the mean of the control variate of a study.

    Parameters
    ----------
    seed : int
        Seed of the study.
    draws : int
        Number of draws.
    """

    seed: int
    draws: int = DRAWS

    @property
    def cost(self) -> float:
        """Approximate cost, in tests."""
        return 50.0 * self.draws / DRAWS

    def run(self) -> FloatArray:
        """Return the mean of the control variate and its standard error [m].

        Raises
        ------
        SolverError
            If there is no closed form.
        """
        control = control_of(Drawer(rig(self.seed), "monte-carlo"), self.draws)
        if control is None:
            raise SolverError(f"the wear law of {RIG} has no closed form for full slip")
        return np.array([control["mean"], control["std"] / np.sqrt(control["draws"])])


@dataclass(frozen=True)
class Timing:
    """Timing of a complete study, from the scenario to the statistics in its file.

    Parameters
    ----------
    plan : str
        The sampling design.
    total : int
        Number of tests.
    """

    plan: EnsemblePlan
    total: int

    @property
    def cost(self) -> float:
        """Approximate cost, in tests."""
        return 50.0 + self.total

    def run(self) -> FloatArray:
        """Return the processor time [s]."""
        with TemporaryDirectory() as folder:
            path, start = Path(folder) / "ensemble.h5", time.process_time()
            ensemble(rig(0), self.total, path, plan=self.plan, scheduler="serial")
            return np.array(time.process_time() - start)


Job: TypeAlias = Part | ControlDraws | Timing


def parts(plan: PlanName, seed: int, total: int) -> list[Part]:
    """Return the parts of a study, each of the largest batch size."""
    firsts = range(0, total, MOST_IN_BATCH)
    return [Part(plan, seed, total, k, min(MOST_IN_BATCH, total - k)) for k in firsts]


class Jobs:
    """Function that runs jobs by number; it can be pickled."""

    def __init__(self, jobs: Sequence[Job]) -> None:
        self.jobs = tuple(jobs)

    def __call__(self, numbers: Sequence[int]) -> list[FloatArray]:
        """Return the results of the jobs with these numbers."""
        _warm()
        return [self.jobs[number].run() for number in numbers]


@lru_cache(maxsize=1)
def _warm() -> None:
    """Compile and import everything in this process."""
    Timing("sobol", 2).run()


@lru_cache(maxsize=1)
def _grid() -> Grid:
    """Return the strips of all studies; they are identical so that the reference is common."""
    return profile_axis(rig(0))


def run_jobs(
    jobs: Sequence[Job], on_progress: OnProgress, scheduler: str = "processes"
) -> list[FloatArray]:
    """Return the results of jobs, in their order.

    Parameters
    ----------
    jobs : sequence of Job
        The jobs.
    on_progress : callable
        Called with a description and the completed fraction.
    scheduler : str
        Scheduler of `wearsim.studies.execution.factory.executor`.
    """
    order = sorted(range(len(jobs)), key=lambda number: -jobs[number].cost)
    total, completed = sum(job.cost for job in jobs), 0.0
    results: dict[int, FloatArray] = {}
    on_progress("tests of the rig", 0.0)
    with (
        executor(scheduler) as pool,
        closing(pool.results(Jobs(jobs), ([number] for number in order))) as batches,
    ):
        for numbers, values in batches:
            results.update(zip(numbers, values, strict=True))
            completed += sum(jobs[number].cost for number in numbers)
            on_progress("tests of the rig", completed / total)
    return [results[number] for number in range(len(jobs))]
