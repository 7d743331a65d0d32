"""One member of an ensemble: a whole wear test of one realisation, and what is kept of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from wearsim.errors import StepError, WearsimError
from wearsim.evolution.loop import evolve
from wearsim.evolution.scene import Scene
from wearsim.evolution.state import WearState, fresh_state
from wearsim.evolution.stepper import Stepper
from wearsim.results import Outcome
from wearsim.scenario import Scenario, parse_scenario
from wearsim.studies.build import build_scene, strips_of_run
from wearsim.studies.depth_control import closed_form_depths
from wearsim.studies.draws import Drawer, Draws
from wearsim.studies.ensemble_plan import BASE_PLANS, EnsemblePlan, passes_of, sources
from wearsim.studies.recorder import due_states, history_row
from wearsim.studies.schedule import RecordSchedule
from wearsim.types import FloatArray, Grid


class Members:
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

    def __getstate__(self) -> dict[str, Any]:
        """Return what is sent: not what was made of it here, which each process makes anew."""
        made = {"scenario", "drawer"}
        return {name: value for name, value in self.__dict__.items() if name not in made}

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
        return [self._outcome(number) for number in numbers]

    def _outcome(self, number: int) -> Outcome:
        drawn: dict[str, float | FloatArray] = {}
        try:
            groups = self.drawer.groups
            taken = sources(self.plan, groups, number)
            draws = self.drawer.draw(number, taken, passes_of(self.plan, groups, number))
            drawn = {**draws.values, **draws.time_means}
            return self._run(number, draws, drawn)
        except WearsimError as error:
            return Outcome(number=number, drawn=drawn, error=str(error) or type(error).__name__)
        except Exception as error:
            return Outcome(number=number, drawn=drawn, error=f"{type(error).__name__}: {error}")

    def _run(self, number: int, draws: Draws, drawn: dict[str, float | FloatArray]) -> Outcome:
        scenario, grid = draws.scenario, self.grid
        own = strips_of_run(draws)
        fits = covers(grid, own)
        scene, stepper, _ = build_scene(scenario, grid if fits else own, draws)
        rows, state = observed(scenario, scene, stepper)
        _check_finite(rows)
        worn = state.cylinder_depth[:, 0, 0].mean(axis=0)
        if not fits:
            worn = np.interp(grid.y, own.y, worn, left=0.0, right=0.0)
        return Outcome(
            number=number,
            error="",
            drawn=drawn,
            observables={name: np.array([row[name] for row in rows]) for name in rows[0]},
            scalars={
                "depth_error": float(state.depth_error[0]),
                "volume_error": float(state.volume_error[0]),
                "steps": float(state.steps),
                "solves": float(state.solves),
                **self._control(draws),
            },
            profile=worn,
        )

    def _control(self, draws: Draws) -> dict[str, float]:
        """Return the control variate of a realisation, where the plan has one."""
        if self.plan != "control-variate":
            return {}
        columns = {key: value[None] for key, value in draws.values.items()}
        return {"control": float(closed_form_depths(self.scenario, columns, 1)[0])}


def _check_finite(rows: Sequence[Mapping[str, float]]) -> None:
    for number, row in enumerate(rows):
        for name, value in row.items():
            if not math.isfinite(value):
                raise StepError(f"{name} is not finite at record {number}", dict(row))


def covers(grid: Grid, other: Grid) -> bool:
    """Tell whether strips reach as far as others on both sides."""
    ends = [np.array([g.y[0] - 0.5 * g.spacing, g.y[-1] + 0.5 * g.spacing]) for g in (grid, other)]
    slack = 1e-9 * grid.spacing
    return bool(ends[0][0] <= ends[1][0] + slack and ends[0][1] >= ends[1][1] - slack)


def observed(
    scenario: Scenario, scene: Scene, stepper: Stepper
) -> tuple[list[dict[str, float]], WearState]:
    """Step through a test; return what is observed at every record, and the state at the end."""
    stop, state = float(scenario.total_passes), fresh_state(scene)
    schedule = RecordSchedule.of(scenario, stop)
    threshold = scenario.outputs.width_threshold
    rows = [_row(scene, stepper, state, threshold)]
    for advance in evolve(
        scene, state, stepper, stop, schedule.next_record, scenario.evolution.max_steps
    ):
        due = due_states(scene, stepper, schedule, advance, stop)
        rows += [_row(scene, stepper, one, threshold) for one in due]
        state = advance.end
    return rows, state


def _row(scene: Scene, stepper: Stepper, state: WearState, threshold: float) -> dict[str, float]:
    """Return the observables of a state, one number each."""
    row: dict[str, Any] = history_row(scene, state, None, threshold, stepper.pass_by_pass)
    count = scene.kinematics.multiplicity
    power, time = float(row["power"][0]), float(row["time"])
    energy = float(row["dissipated_energy"][0])
    return {
        "depth": float(row["depth"][0]),
        "width": float(row["width"][0]),
        "worn_volume": float(row["worn_volume"][0]),
        "roller_depth": float(row["roller_depth"].max()),
        "roller_worn_volume": float((row["roller_worn_volume"][:, 0] * count).sum()),
        "dissipated_energy": energy,
        "mean_power": energy / time if time > 0.0 else power,
        "power": power,
        "normal_force": float((row["normal_force"][:, 0] * count).sum() / count.sum()),
        "peak_pressure": float(row["peak_pressure"].max()),
    }
