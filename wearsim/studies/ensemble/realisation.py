"""One member of an ensemble: a whole wear test of one realisation, and what is kept of it."""

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
from wearsim.studies.ensemble.batch import Observed, RealisationRun, Row, grouped, observed
from wearsim.studies.ensemble.control_variate import closed_form_depths
from wearsim.studies.ensemble.designs import BASE_PLANS, EnsemblePlan, passes_of, sources
from wearsim.studies.run.assemble import assemble_problem, prepared_model, strips_of_run
from wearsim.studies.run.draws import Drawer, Draws
from wearsim.types import FloatArray, Grid


class RealisationRunner:
    """Runs realisations of a scenario by their numbers; it can be sent to another process.

    Parameters
    ----------
    scenario : Scenario
    plan : str
        Name of the ensemble's plan.
    total : int
        Realisations of the whole ensemble.
    grid : Grid
        Strips that all members share, unless they do not fit.
    """

    def __init__(self, scenario: Scenario, plan: EnsemblePlan, total: int, grid: Grid) -> None:
        self.text, self.file, self.files = scenario.text, scenario.file, dict(scenario.files)
        self.plan, self.total, self.grid = plan, total, grid
        self._prepared: tuple[object, ContactModel] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Return what is sent: not what was made of it here, which each process makes anew."""
        made = {"scenario", "drawer"}
        kept = {name: value for name, value in self.__dict__.items() if name not in made}
        return {**kept, "_prepared": None}

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario, read from its text."""
        return parse_scenario(self.text, self.file, self.files.__getitem__)

    @cached_property
    def drawer(self) -> Drawer:
        """What draws the inputs."""
        return Drawer(self.scenario, BASE_PLANS[self.plan], self.total)

    def __call__(self, numbers: Sequence[int]) -> list[Outcome]:
        """Run realisations; what fails is told in its outcome.

        Parameters
        ----------
        numbers : sequence of int

        Returns
        -------
        list of Outcome
            In the same order.
        """
        outcomes: dict[int, Outcome] = {}
        members = []
        for number in numbers:
            drawn: dict[str, float | FloatArray] = {}
            try:
                members.append(self._member(number, drawn))
            except Exception as error:  # it ends this realisation and no other
                outcomes[number] = Outcome(number=number, drawn=drawn, error=told(error))
        for group in grouped(members):
            for member, found in zip(group, observed(group), strict=True):
                outcomes[member.number] = self._outcome(member, found)
        return [outcomes[number] for number in numbers]

    def _member(self, number: int, drawn: dict[str, float | FloatArray]) -> RealisationRun:
        """Draw a realisation, whose values are left in `drawn`, and make it ready to be run."""
        groups = self.drawer.groups
        taken = sources(self.plan, groups, number)
        draws = self.drawer.draw(number, taken, passes_of(self.plan, groups, number))
        drawn.update({**draws.values, **draws.time_means})
        own = strips_of_run(draws)
        grid = self.grid if covers(self.grid, own) else own
        model = self._model(draws.scenario, grid)
        problem, stepper, _ = assemble_problem(draws.scenario, grid, draws, model)
        return RealisationRun(number, drawn, draws, problem, stepper)

    def _model(self, scenario: Scenario, grid: Grid) -> ContactModel:
        """Return the contact model for the strips: one for all members that can share it."""
        materials = scenario.cylinder.material, scenario.roller.material
        key = scenario.contact, materials
        if grid is not self.grid:
            return prepared_model(scenario, grid)
        if self._prepared is None or self._prepared[0] != key:
            self._prepared = key, prepared_model(scenario, grid)
        return self._prepared[1]

    def _outcome(self, member: RealisationRun, found: Observed | Exception) -> Outcome:
        number, drawn = member.number, dict(member.drawn)
        if isinstance(found, Exception):
            return Outcome(number=number, drawn=drawn, error=told(found))
        spoilt = not_finite(found.rows)
        if spoilt:
            return Outcome(number=number, drawn=drawn, error=spoilt)
        worn, grid = found.profile, member.problem.grid
        if grid is not self.grid:
            worn = np.interp(self.grid.y, grid.y, worn, left=0.0, right=0.0)
        rows = found.rows
        return Outcome(
            number=number,
            drawn=drawn,
            observables={name: np.array([row[name] for row in rows]) for name in rows[0]},
            scalars={**found.scalars, **self._control(member.draws)},
            profile=worn,
        )

    def _control(self, draws: Draws) -> dict[str, float]:
        """Return the control variate of a realisation, where the plan has one."""
        if self.plan != "control-variate":
            return {}
        columns = {key: value[None] for key, value in draws.values.items()}
        return {"control": float(closed_form_depths(self.scenario, columns, 1)[0])}


def covers(grid: Grid, other: Grid) -> bool:
    """Tell whether strips reach as far as others on both sides."""
    ends = [np.array([g.y[0] - 0.5 * g.spacing, g.y[-1] + 0.5 * g.spacing]) for g in (grid, other)]
    slack = 1e-9 * grid.spacing
    return bool(ends[0][0] <= ends[1][0] + slack and ends[0][1] >= ends[1][1] - slack)


def told(error: Exception) -> str:
    """Return what is told of an error; one that nobody foresaw with its kind."""
    kind = type(error).__name__
    return str(error) or kind if isinstance(error, WearsimError) else f"{kind}: {error}"


def not_finite(rows: Sequence[Row]) -> str:
    """Return what is said of a test that has come to a value which is not finite, or nothing."""
    for number, row in enumerate(rows):
        for name, value in row.items():
            if not math.isfinite(value):
                return f"{name} is not finite at record {number}"
    return ""
