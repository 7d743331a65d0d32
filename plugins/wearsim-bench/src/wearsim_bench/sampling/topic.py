"""Sampling designs: errors of mean and quantile of ensembles against time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeAlias

import numpy as np

from wearsim.scenario.tables.plain import SamplingTable
from wearsim.studies.ensemble.designs import BASE_PLANS, EnsemblePlan
from wearsim.studies.ensemble.realisation import DRAWS
from wearsim.types import FloatArray
from wearsim.uq.sampling.sampler import PLANS, PlanName
from wearsim_bench.measure.measurement import Effort, Measurement, OnProgress, Topic
from wearsim_bench.sampling.errors import MEAN, QUANTILE, Reference, Study, plan_error, references
from wearsim_bench.sampling.jobs import ControlDraws, Job, Part, Timing, parts, run_jobs

METHODS: Mapping[EnsemblePlan, str] = {
    "monte-carlo": "Monte Carlo",
    "latin-hypercube": "Latin hypercube",
    "sobol": "Sobol",
    "control-variate": "control variate",
}
DEFAULT = str(SamplingTable.model_fields["plan"].default)
GROUPS = (MEAN, QUANTILE)
AGAIN = 2  # Latin hypercubes per replicate, for each size except the largest

Studies: TypeAlias = Mapping[tuple[PlanName, int], Sequence[Study]]
"""Studies by plan and number of tests; for Monte Carlo and Sobol of the largest size only."""


@dataclass(frozen=True)
class StudySizes:
    """Numbers of tests, replicates and draws.

    Parameters
    ----------
    tests : tuple of int
        Numbers of tests of a study; increasing powers of two.
    replicates : int
        Number of independent studies of each plan.
    control_draws : int
        Draws for the mean of the control variate.
    """

    tests: tuple[int, ...]
    replicates: int
    control_draws: int = DRAWS

    @property
    def controls(self) -> list[ControlDraws]:
        """Draws of the control variate for each replicate."""
        return [ControlDraws(number, self.control_draws) for number in range(self.replicates)]

    @property
    def studies(self) -> list[PlannedStudy]:
        """Studies to run.

        The smaller studies of Monte Carlo and Sobol are blocks of the largest ones.
        """
        largest, studies = self.tests[-1], list[PlannedStudy]()
        for plan in PLANS:
            for tests in self.tests if plan == "latin-hypercube" else (largest,):
                again = 1 if tests == largest else AGAIN
                for number in range(again * self.replicates):
                    studies.append(
                        PlannedStudy(number % self.replicates, len(studies), plan, tests)
                    )
        return studies


FULL = StudySizes((16, 32, 64, 128, 256, 512), 8)
QUICK = StudySizes((16, 32), 2, control_draws=100_000)


@dataclass(frozen=True)
class PlannedStudy:
    """A study to run.

    Parameters
    ----------
    replicate : int
        Number of the replicate, whose studies share the mean of the control variate.
    seed : int
        Seed, different for all studies.
    plan : str
        The sampling design.
    tests : int
        Number of tests.
    """

    replicate: int
    seed: int
    plan: PlanName
    tests: int

    @property
    def parts(self) -> list[Part]:
        """Parts of the study."""
        return parts(self.plan, self.seed, self.tests)


def sampling(effort: Effort, on_progress: OnProgress) -> Topic:
    """Measure every sampling design over the size of a study.

    Parameters
    ----------
    effort : Effort
        Number of cases and repetitions.
    on_progress : callable
        Called with a description and the completed fraction.

    Raises
    ------
    SolverError
        If a test fails.
    WorkerError
        If worker processes fail.
    """
    sizes = QUICK if effort.quick else FULL
    timings = [Timing(plan, count) for plan in METHODS for count in sizes.tests]
    tests = [part for study in sizes.studies for part in study.parts]
    jobs: list[Job] = [*timings, *sizes.controls, *tests]
    results = dict(zip(jobs, run_jobs(jobs, on_progress), strict=True))
    seconds = {(item.plan, item.total): float(results[item]) for item in timings}
    studies = studies_of(sizes, results)
    every = [study for group in studies.values() for study in group]
    known = references(every)
    counts = [len(study.depths) for study in every]
    return Topic(
        name="sampling",
        title="Ensembles of wear tests: sampling plans",
        about=_about(known, max(counts) / sum(counts)),
        seconds="one study, one core",
        error="error",
        errors={"error": "error, rms", "claimed": "95 % half-width"},
        counts={"held": "coverage", "studies": "studies", "known": "standard error of rms"},
        measurements=tuple(measurements(sizes, studies, known, seconds)),
    )


def studies_of(sizes: StudySizes, results: Mapping[Job, FloatArray]) -> Studies:
    """Assemble the studies from the results of jobs.

    Parameters
    ----------
    sizes : StudySizes
        Sizes of the studies.
    results : mapping of Job to ndarray
        Results of the parts of all studies and of the control draws.
    """
    studies: dict[tuple[PlanName, int], list[Study]] = {}
    for planned in sizes.studies:
        values = np.concatenate([results[part] for part in planned.parts], axis=1)
        mean, error = (float(value) for value in results[sizes.controls[planned.replicate]])
        study = Study(planned.replicate, values[0], values[1], (mean, error))
        studies.setdefault((planned.plan, planned.tests), []).append(study)
    return studies


def measurements(
    sizes: StudySizes,
    studies: Studies,
    known: Mapping[str, Reference],
    seconds: Mapping[tuple[EnsemblePlan, int], float],
) -> Iterator[Measurement]:
    """Yield the errors of every plan and size.

    Parameters
    ----------
    sizes : StudySizes
        Sizes of the studies.
    studies : mapping
        Result of `studies_of`.
    known : mapping of str to Reference
        Reference values by group.
    seconds : mapping of (str, int) to float
        Time of a study by plan and number of tests [s].
    """
    for group, (plan, method), tests in product(GROUPS, METHODS.items(), sizes.tests):
        result = plan_error(_of_size(sizes, studies, plan, tests), plan, group, known[group])
        claimed = {"claimed": result.claimed} if math.isfinite(result.claimed) else {}
        row = Measurement(group, method, f"n = {tests}", default=plan == DEFAULT)
        counts = {"held": result.held, "studies": float(result.studies), "known": result.known}
        yield row.with_results(seconds.get((plan, tests)), {"error": result.rms, **claimed}, counts)


def _of_size(
    sizes: StudySizes, studies: Studies, plan: EnsemblePlan, tests: int
) -> Sequence[Study]:
    """Return the studies of this number of tests, or blocks of larger studies."""
    base = BASE_PLANS[plan]
    if (base, tests) in studies:
        return studies[base, tests]
    return [block for study in studies[base, sizes.tests[-1]] for block in study.blocks(tests)]


def _about(known: Mapping[str, Reference], share: float) -> str:
    """Describe the reference values; `share` is the largest share of one study in them."""
    values = "; ".join(
        f"{group} {1e6 * item.value:.4g} um +- {item.error / item.value:.2%}"
        for group, item in known.items()
    )
    return (
        "Tests of the rig with all random inputs and identical rollers. Time is the processor time"
        " of one study in one process, from the scenario to the statistics in its file, measured"
        " once. Errors are the rms over many studies, relative to the reference: the estimate from"
        f" the tests of all studies with the closed form as control variate, {values} (standard"
        f" errors). A study contains at most {share:.1%} of these tests, which reduces its error by"
        " at most that much. Coverage is the fraction of 95 % intervals that contain the reference;"
        " the standard error of the rms is relative to it."
    )
