"""Realisations of an ensemble: their common strips, and their runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from wearsim.errors import WearsimError
from wearsim.plugins import ContactModel
from wearsim.results import Outcome
from wearsim.scenario import Scenario, parse_scenario
from wearsim.studies.ensemble.batch import RealisationRun, RunObservations, batch_groups, observe
from wearsim.studies.ensemble.control_variate import closed_form_depths
from wearsim.studies.ensemble.designs import BASE_PLANS, EnsemblePlan, passes_of, sources
from wearsim.studies.run.assemble import assemble_problem, prepared_model
from wearsim.studies.run.draws import Drawer
from wearsim.studies.run.grid import strips_of_run
from wearsim.types import FloatArray, Grid

GRID_REALISATIONS = 64  # realisations that determine the strips, whatever the ensemble's size
WIDTH_MARGIN = 1.05  # width of the strips over that of the widest of these realisations


def shared_grid(scenario: Scenario) -> Grid:
    """Return strips for the realisations of an ensemble, independent of their number.

    The strips cover those of the first realisations and have their median width. A realisation
    that needs wider coverage is run on separate strips.

    Parameters
    ----------
    scenario : Scenario
        A scenario with random inputs.

    Raises
    ------
    WearsimError
        If no strips fit any of the first realisations; the error is that of the first one.
    """
    drawer, grids, error = Drawer(scenario, "monte-carlo"), [], None
    for number in range(GRID_REALISATIONS):
        try:
            grids.append(strips_of_run(drawer.draw(number)))
        except WearsimError as failure:
            error = error or failure
    if not grids:
        raise error or AssertionError
    spacing = float(np.median([grid.spacing for grid in grids]))
    edges = np.array([grid.edges for grid in grids])
    low, high = float(edges[:, 0].min()), float(edges[:, 1].max())
    strips = int(np.ceil(WIDTH_MARGIN * (high - low) / spacing))
    strips += (strips + 1) % 2
    middle, half = 0.5 * (low + high), 0.5 * strips * spacing
    return Grid.spanning(middle - half, middle + half, strips)


class RealisationRunner:
    """Runs of realisations of a scenario by number; can be sent to another process.

    Parameters
    ----------
    scenario : Scenario
    plan : str
        Name of the ensemble's plan.
    total : int
        Realisations of the whole ensemble.
    grid : Grid
        Strips of all realisations that fit on them.
    """

    def __init__(self, scenario: Scenario, plan: EnsemblePlan, total: int, grid: Grid) -> None:
        self.text, self.file, self.files = scenario.text, scenario.file, dict(scenario.files)
        self.plan, self.total, self.grid = plan, total, grid
        self._prepared: tuple[object, ContactModel] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes to be sent, without those that each process derives from them."""
        derived = {"scenario", "drawer", "_prepared"}
        kept = {name: value for name, value in self.__dict__.items() if name not in derived}
        return {**kept, "_prepared": None}

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario, read from its text."""
        return parse_scenario(self.text, self.file, self.files.__getitem__)

    @cached_property
    def drawer(self) -> Drawer:
        """Sampler of the random inputs."""
        return Drawer(self.scenario, BASE_PLANS[self.plan], self.total)

    def __call__(self, numbers: Sequence[int]) -> list[Outcome]:
        """Run realisations; the outcome of one that fails holds its error.

        Parameters
        ----------
        numbers : sequence of int

        Returns
        -------
        list of Outcome
            In the same order.
        """
        outcomes: dict[int, Outcome] = {}
        runs = []
        for number in numbers:
            drawn: dict[str, float | FloatArray] = {}
            try:
                runs.append(self._prepare(number, drawn))
            except Exception as error:  # an error fails this realisation only
                outcomes[number] = Outcome(number=number, values=drawn, error=_error_text(error))
        for group in batch_groups(runs):
            for run, observations in zip(group, observe(group), strict=True):
                outcomes[run.number] = self._outcome(run, observations)
        return [outcomes[number] for number in numbers]

    def _prepare(self, number: int, drawn: dict[str, float | FloatArray]) -> RealisationRun:
        """Return the run of a realisation, and add the values of its random inputs to `drawn`."""
        groups = self.drawer.groups
        draws = self.drawer.draw(
            number, sources(self.plan, groups, number), passes_of(self.plan, groups, number)
        )
        drawn.update({**draws.values, **draws.time_means})
        grid = strips_of_run(draws)
        (low, high), (first, last) = self.grid.edges, grid.edges
        margin = 1e-9 * self.grid.spacing
        if low <= first + margin and high >= last - margin:
            grid = self.grid
        model = self._model(draws.scenario, grid)
        problem, stepper, _ = assemble_problem(draws, grid, model)
        return RealisationRun(number, drawn, draws, problem, stepper)

    def _model(self, scenario: Scenario, grid: Grid) -> ContactModel:
        """Return the contact model prepared for the strips, shared by realisations if possible."""
        if grid is not self.grid:
            return prepared_model(scenario, grid)
        key = scenario.contact, (scenario.cylinder.material, scenario.roller.material)
        if self._prepared is None or self._prepared[0] != key:
            self._prepared = key, prepared_model(scenario, grid)
        return self._prepared[1]

    def _outcome(self, run: RealisationRun, observations: RunObservations | Exception) -> Outcome:
        drawn = dict(run.drawn)
        if isinstance(observations, Exception):
            return Outcome(number=run.number, values=drawn, error=_error_text(observations))
        rows, scalars = observations.rows, dict(observations.scalars)
        unusable = [
            f"{name} is not finite at record {number}"
            for number, row in enumerate(rows)
            for name, value in row.items()
            if not math.isfinite(value)
        ]
        if unusable:
            return Outcome(number=run.number, values=drawn, error=unusable[0])
        if self.plan == "control-variate":
            columns = {key: value[None] for key, value in run.draws.values.items()}
            scalars["control"] = float(closed_form_depths(self.scenario, columns, 1)[0])
        profile, grid = observations.profile, run.problem.grid
        if grid is not self.grid:
            profile = np.interp(self.grid.y, grid.y, profile, left=0.0, right=0.0)
        courses = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        values = {**drawn, **courses, **scalars, "depth_profile": profile}
        return Outcome(number=run.number, values=values)


def _error_text(error: Exception) -> str:
    """Return the message of an error, after its type if wearsim did not raise it deliberately."""
    kind = type(error).__name__
    return str(error) or kind if isinstance(error, WearsimError) else f"{kind}: {error}"
