"""Monte Carlo study of one contact: dissipation for every realisation of the random inputs."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from wearsim.errors import Interrupted, ScenarioError, SolverError
from wearsim.results.io.files import as_path, write_results
from wearsim.results.io.outputs import output_lock
from wearsim.scenario import Scenario
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.contact.batch import Realisations
from wearsim.studies.dissipation.result import (
    BAND,
    DissipationData,
    DissipationResult,
    as_numbers,
    summaries,
)
from wearsim.studies.preparation import checked_count, nothing_random, origin_of
from wearsim.studies.progress import shown_progress
from wearsim.uq.estimation.moments import RowMoments
from wearsim.uq.sampling.sampler import REPLICATES

BATCH = 1024  # realisations of a batch
MOST_POINTS = 4_000_000  # values of friction fields of a batch
MOST_KEPT = 16_000_000  # stored values of P_l(y), 128 MB
SCALARS = (
    "power",
    "force_x",
    "force_y",
    "spin_moment",
    "peak_pressure",
    "adhesion_fraction",
    "longitudinal_creepage",
)


def dissipation(
    scenario: Scenario | str | Path,
    realisations: int = 1000,
    output: str | Path | None = None,
    *,
    force: bool = False,
    progress: bool = False,
    on_progress: Callable[[int, int], None] | None = None,
    stop_requested: Callable[[], bool] | None = None,
) -> DissipationResult:
    """Solve one contact for many realisations of its random inputs.

    The contact belongs to the first roller at the start of the load. Every random input is drawn
    once per realisation for any persistence; a process from its marginal distribution.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario of a run or of a single contact, or its file; `sampling.plan` is the sampling
        design.
    realisations : int
        Number of realisations, at least 1.
    output : path, optional
        Results file; without it the result is kept in memory only.
    force : bool
        Overwrite an existing file.
    progress : bool
        Whether to show the progress, on a terminal or in a notebook.
    on_progress : callable, optional
        Called with the numbers of completed and of all realisations.
    stop_requested : callable, optional
        Called after every batch; True stops the study, and completed realisations are written.

    Returns
    -------
    DissipationResult

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError
        If the study cannot start.
    TypeError, ValueError
        If an argument is invalid.
    SolverError
        If a realisation has no solution, with its number; those before it are in the file.
    Interrupted
        If it was stopped; the file holds the completed realisations, marked as unfinished.

    Examples
    --------
    >>> friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    >>> scenario = wearsim.load_scenario("rig.toml", {"friction.coefficient": friction})
    >>> wearsim.dissipation(scenario, 100)
    <DissipationResult 'a wear test': 100 realisations, power 0.07761 W, std 0.00744 W>
    """
    scenario = with_chosen_model(scenario, test=False)
    realisations = checked_count(scenario, realisations)
    path = as_path(output) if output is not None else None
    with (
        output_lock(path, force, scenario.paths),
        shown_progress(progress, "Counter", on_progress, scenario) as watch,
    ):
        study = _Study(scenario, realisations, path)
        try:
            while study.done < realisations:
                study.step()
                if watch is not None:
                    watch(study.done, realisations)
                if stop_requested is not None and stop_requested() and study.done < realisations:
                    raise study.interrupted()
        except SolverError:
            if study.done:
                study.close()
            raise
        return DissipationResult(study.close(), path)


class _Study:
    """A study in progress with its results so far."""

    def __init__(self, scenario: Scenario, count: int, path: Path | None) -> None:
        self._started, self._solving = time.monotonic(), 0.0
        self._created = datetime.now(UTC).isoformat(timespec="seconds")
        self.scenario, self.path, self.done = scenario, path, 0
        self.contacts = Realisations(scenario, count)
        if not self.contacts.values and not self.contacts.friction_points:
            what = "; ".join(["no random input acts on the contact", *self.contacts.notes])
            raise ScenarioError(scenario.file, [nothing_random(what)])
        self._mean_problem = self.contacts.solve_mean_problem()
        strips = self.contacts.grid.strips
        self._scalars = {name: np.empty(count) for name in SCALARS}
        self._kept = np.empty((min(count, max(MOST_KEPT // strips, 1)), strips))
        self._moments = RowMoments(strips)
        points = self.contacts.friction_points
        self._batch = min(BATCH, max(MOST_POINTS // (points * strips), 1)) if points else BATCH

    def step(self) -> None:
        """Solve one more batch."""
        first, count = self.done, min(self._batch, self.contacts.count - self.done)
        start = time.monotonic()
        batch = self.contacts.solve(first, count)
        rows = batch.dissipation
        for name, values in self._scalars.items():
            values[first : first + count] = getattr(batch, name)
        kept = self._kept[first : first + count]
        kept[:] = rows[: len(kept)]
        self._moments.add(rows.astype(np.float64, copy=False))
        self._solving += time.monotonic() - start
        self.done += count

    def interrupted(self) -> Interrupted:
        """Write the completed realisations and return the error of an interrupted study."""
        self.close()
        what = f"stopped after {self.done} of {self.contacts.count} realisations"
        if self.path is None:
            return Interrupted(f"{what}; nothing was written")
        return Interrupted(
            f"{what}; they are in {self.path}",
            python=f'open them with wearsim.open_results("{self.path}")',
            shell=f"plot them with: wearsim plot {self.path}",
        )

    def close(self) -> DissipationData:
        """Return the completed realisations, and write them if there is a file."""
        scenario, contacts, done = self.scenario, self.contacts, self.done
        kept, points = self._kept[:done], contacts.friction_points
        mean, std = self._moments.mean_and_std()
        low, high = np.quantile(kept, BAND, axis=0)
        variables = {
            "y": contacts.grid.y,
            **{name: values[:done] for name, values in self._scalars.items()},
            "normal_force": contacts.loads[:done],
            "dissipation": kept,
            "dissipation_mean": mean,
            "dissipation_std": std,
            "dissipation_low": low,
            "dissipation_high": high,
            "mean_problem_dissipation": self._mean_problem.dissipation[0],
            **{key: values[:done] for key, values in contacts.values.items()},
        }
        replicates = REPLICATES if scenario.sampling.plan == "sobol" else 1
        data = DissipationData(
            **origin_of(scenario),
            plan=scenario.sampling.plan,
            inputs=[{"key": key, "unit": unit} for key, unit in contacts.units.items()],
            requested=contacts.count,
            finished=done == contacts.count,
            strip_width=contacts.grid.spacing,
            friction_grid=f"{points} points along each of {contacts.grid.strips} strips of"
            f" {contacts.grid.spacing * 1e6:.4g} um"
            if points
            else "",
            mean_problem_power=float(self._mean_problem.power[0]),
            notes=[*scenario.notes, *contacts.notes],
            warnings=self._warnings(len(kept)),
            variables=variables,
            replicates=replicates,
            statistics=as_numbers(summaries(variables, scenario.sampling.plan, replicates)),
            solve_seconds=self._solving,
            wall_seconds=time.monotonic() - self._started,
            created=self._created,
        )
        if self.path is not None:
            write_results(self.path, data)
        return data

    def _warnings(self, kept: int) -> list[str]:
        plan = self.scenario.sampling.plan
        warnings = (
            (
                self.scenario.operation.rollers > 1,
                "only the contact of the first roller is considered",
            ),
            (
                plan == "latin-hypercube",
                (
                    "standard errors and intervals are those of plain Monte Carlo, which are too"
                    f" wide for {plan}"
                ),
            ),
            (
                kept < self.done,
                (
                    f"P_l(y) of the first {kept} of {self.done} realisations is stored; its band is"
                    " computed from them; its mean and std are those of all"
                ),
            ),
        )
        return [text for applies, text in warnings if applies]
