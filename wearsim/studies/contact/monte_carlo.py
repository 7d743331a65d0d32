"""A Monte Carlo of one contact: its dissipation in every realisation of the random inputs."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from wearsim.contact_batch import BatchSolution
from wearsim.errors import Interrupted, Mistake, ScenarioError, SolverError
from wearsim.results import DissipationData, DissipationResult, check_output, write_results
from wearsim.results.content import Arrays
from wearsim.results.dissipation.result import BAND, as_numbers, summaries
from wearsim.scenario import Scenario
from wearsim.studies.contact.batch import Realisations
from wearsim.studies.limits import checked_count
from wearsim.studies.run.provenance import origin_of
from wearsim.uq.estimation.moments import RowMoments

BATCH = 1024  # realisations that are solved between two looks at the user
MOST_POINTS = 4_000_000  # numbers of a friction field that are held at once
MOST_KEPT = 16_000_000  # numbers of P_l(y) that are kept; they take 128 MB
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
    scenario: Scenario,
    realisations: int = 1000,
    output: str | Path | None = None,
    *,
    force: bool = False,
    on_progress: Callable[[int, int], None] | None = None,
    stop_requested: Callable[[], bool] | None = None,
) -> DissipationResult:
    """Solve one contact for many realisations of its random inputs.

    The contact is that of the first roller at the start of the load. Every random input is drawn
    once per realisation, whatever its persistence; a process from its marginal.

    Parameters
    ----------
    scenario : Scenario
        A run's or a single contact's; its `sampling.plan` says how the realisations are spread.
    realisations : int
        How many, one or more.
    output : path, optional
        Results file; without it the result is kept in memory only.
    force : bool
        Overwrite an existing file.
    on_progress : callable, optional
        Told how many realisations are done, and of how many.
    stop_requested : callable, optional
        Asked after every batch; True ends the study, and what is done is written.

    Returns
    -------
    DissipationResult

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError
        If the study cannot start.
    TypeError, ValueError
        If the scenario is none, or `realisations` is not a whole number above zero.
    SolverError
        If a realisation has no solution, naming it; those before it are in the file.
    Interrupted
        If it was stopped; the file holds what was done, labelled as unfinished.
    """
    realisations = checked_count(scenario, realisations)
    path = Path(output) if output is not None else None
    if path is not None:
        check_output(path, force, scenario.paths)
    study = _Study(scenario, realisations, path)
    tell = on_progress or (lambda done, total: None)
    try:
        while study.done < realisations:
            study.step()
            tell(study.done, realisations)
            if stop_requested is not None and stop_requested() and study.done < realisations:
                raise study.interrupted()
    except SolverError:
        if study.done:
            study.close()
        raise
    return DissipationResult(study.close(), path)


class _Study:
    """A study in progress: what is solved so far."""

    def __init__(self, scenario: Scenario, count: int, path: Path | None) -> None:
        self._begun, self._solving = time.monotonic(), 0.0
        self._created = datetime.now(UTC).isoformat(timespec="seconds")
        self.scenario, self.path, self.done = scenario, path, 0
        self.contacts = Realisations(scenario, count)
        if not self.contacts.draws.values and self.contacts.draws.field is None:
            raise ScenarioError(scenario.file, [_nothing_random(self.contacts.draws.notes)])
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
        begun = time.monotonic()
        self._take(first, self.contacts.solve(first, count))
        self._solving += time.monotonic() - begun
        self.done += count

    def _take(self, first: int, batch: BatchSolution) -> None:
        rows = batch.columns["dissipation"].reshape(-1, self.contacts.grid.strips)
        for name, values in self._scalars.items():
            values[first : first + len(rows)] = batch.columns[name].ravel()
        kept = self._kept[first : first + len(rows)]
        kept[:] = rows[: len(kept)]
        self._moments.add(rows.astype(np.float64, copy=False))

    def interrupted(self) -> Interrupted:
        """Write what is done and return how the study ends."""
        self.close()
        kept = "nothing was written"
        if self.path:
            kept = f"they are in {self.path}; draw them with: wearsim plot {self.path}"
        return Interrupted(
            f"stopped after {self.done} of {self.contacts.count} realisations; {kept}"
        )

    def close(self) -> DissipationData:
        """Return what is done, having written it if there is a place for it."""
        data = self._data()
        if self.path is not None:
            write_results(self.path, data)
        return data

    def _variables(self) -> Arrays:
        done, contacts = self.done, self.contacts
        kept = self._kept[:done]
        mean, std = self._moments.mean_and_std()
        low, high = np.quantile(kept, BAND, axis=0)
        return {
            "y": contacts.grid.y,
            **{name: values[:done] for name, values in self._scalars.items()},
            "normal_force": contacts.loads(0, done),
            "dissipation": kept,
            "dissipation_mean": mean,
            "dissipation_std": std,
            "dissipation_low": low,
            "dissipation_high": high,
            "mean_problem_dissipation": self._mean_problem.columns["dissipation"].ravel(),
            **{key: values[:done] for key, values in contacts.draws.values.items()},
        }

    def _data(self) -> DissipationData:
        scenario, contacts, variables = self.scenario, self.contacts, self._variables()
        return DissipationData(
            **origin_of(scenario),
            plan=scenario.sampling.plan,
            inputs=[{"key": key, "unit": unit} for key, unit in contacts.draws.units.items()],
            asked=contacts.count,
            finished=self.done == contacts.count,
            strip_width=contacts.grid.spacing,
            friction_grid=self._friction_grid(),
            mean_problem_power=float(self._mean_problem.columns["power"].item()),
            notes=[*scenario.notes, *contacts.draws.notes],
            warnings=self._warnings(len(variables["dissipation"])),
            variables=variables,
            statistics=as_numbers(summaries(variables)),
            solve_seconds=self._solving,
            wall_seconds=time.monotonic() - self._begun,
            created=self._created,
        )

    def _friction_grid(self) -> str:
        points, grid = self.contacts.friction_points, self.contacts.grid
        if not points:
            return ""
        return f"{points} points along each of {grid.strips} strips of {grid.spacing * 1e6:.4g} um"

    def _warnings(self, kept: int) -> list[str]:
        warnings = []
        if self.scenario.operation.rollers > 1:
            warnings.append("only the first roller's contact is looked at")
        if self.scenario.sampling.plan != "monte-carlo":
            warnings.append(
                "standard errors and intervals are those of plain Monte Carlo, which are not exact"
                f" for {self.scenario.sampling.plan}"
            )
        if kept < self.done:
            warnings.append(
                f"P_l(y) of the first {kept} of {self.done} realisations is kept, and its band is"
                " theirs; its mean and std are those of all"
            )
        return warnings


def _nothing_random(notes: Sequence[str]) -> Mistake:
    what = "; ".join(["no random input acts on the contact", *notes])
    expected = (
        "a distribution in the place of a value, such as friction.coefficient ="
        ' {distribution = "maxent", support = [0, "inf"], mean = 0.1, std = 0.02}'
    )
    return Mistake("", "", what, None, expected)
