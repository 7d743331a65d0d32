"""Sampling plans against each other: error of an ensemble's mean and quantile against its cost."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeAlias

import numpy as np

from wearsim.scenario.tables.sampling import SamplingTable
from wearsim.studies.ensemble.control_variate import DRAWS
from wearsim.studies.ensemble.designs import BASE_PLANS, EnsemblePlan
from wearsim.types import FloatArray
from wearsim.uq.sampling.plans import PLANS, PlanName
from wearsim_bench.measure.measurement import Effort, Measurement, Tell, Topic
from wearsim_bench.sampling.errors import MEAN, QUANTILE, Study, Truth, plan_error, truths
from wearsim_bench.sampling.jobs import CheapDraws, Job, Part, Timing, all_done, parts

METHODS: Mapping[EnsemblePlan, str] = {
    "monte-carlo": "Monte Carlo",
    "latin-hypercube": "Latin hypercube",
    "sobol": "Sobol",
    "control-variate": "control variate",
}
DEFAULT = str(SamplingTable.model_fields["plan"].default)
GROUPS = (MEAN, QUANTILE)
AGAIN = 2  # Latin hypercubes of each size but the greatest, for each replicate

Studies: TypeAlias = Mapping[tuple[PlanName, int], Sequence[Study]]
"""By plan and tests of a study; of Monte Carlo and Sobol those of the greatest size."""


@dataclass(frozen=True)
class Size:
    """How much is measured.

    Parameters
    ----------
    tests : tuple of int
        Of a study; powers of two, rising.
    replicates : int
        Independent studies of each plan.
    cheap_draws : int
        That tell the mean of the control.
    """

    tests: tuple[int, ...]
    replicates: int
    cheap_draws: int = DRAWS

    @property
    def controls(self) -> list[CheapDraws]:
        """The cheap draws of each replicate."""
        return [CheapDraws(number, self.cheap_draws) for number in range(self.replicates)]

    @property
    def studies(self) -> list[Asked]:
        """The studies whose tests are run.

        The smaller ones of Monte Carlo and Sobol stand in the greatest; Latin hypercubes do not.
        """
        greatest, found = self.tests[-1], list[Asked]()
        for plan in PLANS:
            for tests in self.tests if plan == "latin-hypercube" else (greatest,):
                again = 1 if tests == greatest else AGAIN
                for number in range(again * self.replicates):
                    found.append(Asked(number % self.replicates, len(found), plan, tests))
        return found


WHOLE = Size((16, 32, 64, 128, 256, 512), 8)
QUICK = Size((16, 32), 2, cheap_draws=100_000)


@dataclass(frozen=True)
class Asked:
    """A study whose tests are run.

    Parameters
    ----------
    replicate : int
        Of what is measured; studies of the same one may share the mean of the control.
    seed : int
        Its own, so that no two studies share a path of a process.
    plan : str
    tests : int
    """

    replicate: int
    seed: int
    plan: PlanName
    tests: int

    @property
    def parts(self) -> list[Part]:
        """Its tests, in parts."""
        return parts(self.plan, self.seed, self.tests)


def sampling(effort: Effort, tell: Tell) -> Topic:
    """Measure every sampling plan over the size of a study.

    Parameters
    ----------
    effort : Effort
    tell : callable
        Gets what is being measured, and which part is done.

    Raises
    ------
    SolverError
        If a test fails.
    WorkerError
        If worker processes break down.
    """
    size = QUICK if effort.quick else WHOLE
    timings = [Timing(plan, count) for plan in METHODS for count in size.tests]
    tests = [part for asked in size.studies for part in asked.parts]
    jobs: list[Job] = [*timings, *size.controls, *tests]
    found = dict(zip(jobs, all_done(jobs, tell), strict=True))
    seconds = {(item.plan, item.total): float(found[item]) for item in timings}
    studies = studies_of(size, found)
    every = [study for some in studies.values() for study in some]
    known = truths(every)
    sizes = [len(study.depths) for study in every]
    return Topic(
        name="sampling",
        title="Ensembles of wear tests: every sampling plan",
        about=_about(known, max(sizes) / sum(sizes)),
        seconds="one study, one core",
        error="error",
        errors={"error": "error, rms", "claimed": "95 % claimed"},
        counts={"held": "intervals that hold it", "studies": "studies", "known": "rms known to"},
        measurements=tuple(measurements(size, studies, known, seconds)),
    )


def studies_of(size: Size, found: Mapping[Job, FloatArray]) -> Studies:
    """Return the studies, put together from what jobs have come to.

    Parameters
    ----------
    size : Size
    found : mapping of Job to ndarray
        What the parts of all studies and the cheap draws have come to.
    """
    studies: dict[tuple[PlanName, int], list[Study]] = {}
    for asked in size.studies:
        values = np.concatenate([found[part] for part in asked.parts], axis=1)
        mean, error = (float(value) for value in found[size.controls[asked.replicate]])
        study = Study(asked.replicate, values[0], values[1], (mean, error))
        studies.setdefault((asked.plan, asked.tests), []).append(study)
    return studies


def measurements(
    size: Size,
    studies: Studies,
    known: Mapping[str, Truth],
    seconds: Mapping[tuple[EnsemblePlan, int], float],
) -> Iterator[Measurement]:
    """Yield the errors of every plan and size.

    Parameters
    ----------
    size : Size
    studies : mapping
        As `studies_of` returns them.
    known : mapping of str to Truth
        By group.
    seconds : mapping of (str, int) to float
        Time of a study by plan and tests [s].
    """
    for group, (plan, method), tests in product(GROUPS, METHODS.items(), size.tests):
        found = plan_error(_of_size(size, studies, plan, tests), plan, group, known[group])
        claimed = {"claimed": found.claimed} if math.isfinite(found.claimed) else {}
        row = Measurement(group, method, f"n = {tests}", default=plan == DEFAULT)
        counts = {"held": found.held, "studies": float(found.studies), "known": found.known}
        yield row.found(seconds.get((plan, tests)), {"error": found.rms, **claimed}, counts)


def _of_size(size: Size, studies: Studies, plan: EnsemblePlan, tests: int) -> Sequence[Study]:
    """Return the studies of so many tests, which may stand in greater ones."""
    base = BASE_PLANS[plan]
    if (base, tests) in studies:
        return studies[base, tests]
    return [block for study in studies[base, size.tests[-1]] for block in study.blocks(tests)]


def _about(known: Mapping[str, Truth], share: float) -> str:
    """Return what errors are against, and the greatest share that one study has in it."""
    told = "; ".join(
        f"{group} {1e6 * truth.value:.4g} um to {truth.error / truth.value:.2%}"
        for group, truth in known.items()
    )
    return (
        "Whole tests of the rig with all that scatters, its rollers alike. Time is the processor"
        " time of one study in one process, from its scenario to the statistics in its file, taken"
        " once. Errors are the rms of many studies, relative to what all their tests together tell"
        f" with the closed form as a control: {told} (standard errors). No study is more than"
        f" {share:.1%} of those tests, and by no more does that lessen its error. `rms known to` is"
        " the standard error of the rms relative to it."
    )
