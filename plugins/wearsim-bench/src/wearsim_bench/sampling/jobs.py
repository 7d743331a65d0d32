"""The work on sampling plans: tests whose depth is wanted, and whole studies that are timed."""

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
from wearsim.studies.ensemble.batch import MAX_BATCH
from wearsim.studies.ensemble.control_variate import DRAWS, closed_form_depths, control_of
from wearsim.studies.ensemble.designs import EnsemblePlan
from wearsim.studies.ensemble.grid import shared_grid
from wearsim.studies.ensemble.realisation import RealisationRunner
from wearsim.studies.execution.factory import executor
from wearsim.studies.run.draws import Drawer
from wearsim.types import FloatArray, Grid
from wearsim.uq.sampling.plans import PlanName
from wearsim_bench.measure.measurement import Tell

RIG = "rig-ensemble"
CHEAP: Mapping[str, object] = {
    "creepage.misalignment.persistence": "per-test",  # alike rollers are one contact
    "contact.strips": 31,
    "outputs.records": 1,
}
"""What makes a test of the rig cheap, and leaves what scatters."""


def rig(seed: int, changes: Mapping[str, object] | None = None) -> Scenario:
    """Return the rig with all that scatters, in cheap tests.

    Parameters
    ----------
    seed : int
        Of its draws.
    changes : mapping of str to object, optional
        Further values by dotted key.
    """
    return shipped_scenario(RIG, {**CHEAP, "seed": seed, **(changes or {})})


@dataclass(frozen=True)
class Part:
    """Tests on end of one study.

    Parameters
    ----------
    plan : str
    seed : int
        The study's.
    total : int
        Tests of the whole study.
    first, count : int
    """

    plan: PlanName
    seed: int
    total: int
    first: int
    count: int

    @property
    def cost(self) -> float:
        """How long it takes, about, in tests."""
        return float(self.count)

    def done(self) -> FloatArray:
        """Return the depth at the end of every test and in closed form, shape (2, count) [m].

        Raises
        ------
        SolverError
            If a test fails.
        """
        scenario = rig(self.seed)
        members = RealisationRunner(scenario, self.plan, self.total, _grid())
        numbers = range(self.first, self.first + self.count)
        outcomes = members(numbers)
        failed = [outcome for outcome in outcomes if outcome.error]
        if failed:
            where = f"{self.plan}, seed {self.seed}, realisation {failed[0].number}"
            raise SolverError(f"{len(failed)} tests failed, the first ({where}): {failed[0].error}")
        depths = np.array([outcome.observables["depth"][-1] for outcome in outcomes])
        columns = members.drawer.columns(self.first, self.count)
        return np.array([depths, closed_form_depths(scenario, columns, self.count)])


@dataclass(frozen=True)
class CheapDraws:
    """The draws that tell the mean of a study's control variate.

    Parameters
    ----------
    seed : int
        The study's.
    draws : int
    """

    seed: int
    draws: int = DRAWS

    @property
    def cost(self) -> float:
        """How long it takes, about, in tests."""
        return 50.0 * self.draws / DRAWS

    def done(self) -> FloatArray:
        """Return the mean of the control and that mean's standard error [m].

        Raises
        ------
        SolverError
            If there is no closed form.
        """
        found = control_of(Drawer(rig(self.seed), "monte-carlo"), self.draws)
        if found is None:
            raise SolverError(f"the wear law of {RIG} has no full slip in closed form")
        return np.array([found.mean, found.std / np.sqrt(found.draws)])


@dataclass(frozen=True)
class Timing:
    """A whole study, from its scenario to the statistics in its file, to be timed.

    Parameters
    ----------
    plan : str
    total : int
        Tests.
    """

    plan: EnsemblePlan
    total: int

    @property
    def cost(self) -> float:
        """How long it takes, about, in tests."""
        return 50.0 + self.total

    def done(self) -> FloatArray:
        """Return the processor time that it takes [s]."""
        with TemporaryDirectory() as folder:
            path, begun = Path(folder) / "ensemble.h5", time.process_time()
            ensemble(rig(0), self.total, path, plan=self.plan, scheduler="serial")
            return np.array(time.process_time() - begun)


Job: TypeAlias = Part | CheapDraws | Timing


def parts(plan: PlanName, seed: int, total: int) -> list[Part]:
    """Return a study in parts of as many tests as gain from being stepped together."""
    firsts = range(0, total, MAX_BATCH)
    return [Part(plan, seed, total, k, min(MAX_BATCH, total - k)) for k in firsts]


class Jobs:
    """Does jobs by their numbers; it can be sent to another process.

    Parameters
    ----------
    jobs : sequence of Job
    """

    def __init__(self, jobs: Sequence[Job]) -> None:
        self.jobs = tuple(jobs)

    def __call__(self, numbers: Sequence[int]) -> list[FloatArray]:
        """Return what the jobs of these numbers come to."""
        _warm()
        return [self.jobs[number].done() for number in numbers]


@lru_cache(maxsize=1)
def _warm() -> None:
    """Have all compiled and loaded in this process."""
    Timing("sobol", 2).done()


@lru_cache(maxsize=1)
def _grid() -> Grid:
    """Return the strips of all studies, the same so that all have one truth."""
    return shared_grid(rig(0))


def all_done(jobs: Sequence[Job], tell: Tell, scheduler: str = "processes") -> list[FloatArray]:
    """Return what jobs come to, in their order.

    Parameters
    ----------
    jobs : sequence of Job
    tell : callable
        Gets what is being measured, and which part is done.
    scheduler : str
        Who does them, as of `wearsim.studies.execution.factory.executor`.
    """
    order = sorted(range(len(jobs)), key=lambda number: -jobs[number].cost)
    total, so_far = sum(job.cost for job in jobs), 0.0
    found: dict[int, FloatArray] = {}
    tell("whole tests of the rig", 0.0)
    with (
        executor(scheduler) as pool,
        closing(pool.results(Jobs(jobs), ([number] for number in order))) as done,
    ):
        for numbers, results in done:
            found.update(zip(numbers, results, strict=True))
            so_far += sum(jobs[number].cost for number in numbers)
            tell("whole tests of the rig", so_far / total)
    return [found[number] for number in range(len(jobs))]
