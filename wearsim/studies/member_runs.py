"""The wear tests of an ensemble's members: stepped together where they can be, or one by one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearsim.evolution.each import sum_in_order
from wearsim.evolution.joining import alike
from wearsim.evolution.loop import evolve
from wearsim.evolution.scene import Scene
from wearsim.evolution.state import WearState, fresh_state
from wearsim.evolution.stepper import Stepper
from wearsim.evolution.together import can_go_together
from wearsim.studies.draws import Draws
from wearsim.studies.recorder import due_states, history_row
from wearsim.studies.schedule import RecordSchedule
from wearsim.types import FloatArray

MOST_TOGETHER = 128  # more gain nothing
MOST_NUMBERS = 50_000  # strips of all contacts; some 100 arrays of so many numbers live at a time
Row = dict[str, float]


@dataclass(frozen=True)
class Member:
    """A realisation that is ready to be run.

    Parameters
    ----------
    number : int
    drawn : mapping of str to float or ndarray
        What was drawn for it, by the scenario's key [SI].
    draws : Draws
    scene : Scene
    stepper : Stepper
    """

    number: int
    drawn: Mapping[str, float | FloatArray]
    draws: Draws
    scene: Scene
    stepper: Stepper

    @property
    def stop(self) -> float:
        """Passes at the end of the test."""
        return float(self.draws.scenario.total_passes)

    @property
    def schedule(self) -> RecordSchedule:
        """When it is recorded."""
        return RecordSchedule.of(self.draws.scenario, self.stop)

    @property
    def goes_together(self) -> bool:
        """Whether it can be stepped together with others."""
        return can_go_together(self.scene, self.stepper)

    def goes_with(self, other: Member) -> bool:
        """Tell whether it can be stepped together with one that can be stepped together."""
        return self._course == other._course and alike(self.scene, other.scene)

    @property
    def _course(self) -> tuple[object, ...]:
        evolution, outputs = self.draws.scenario.evolution, self.draws.scenario.outputs
        return self.stop, self.schedule, outputs.width_threshold, evolution


@dataclass(frozen=True)
class Observed:
    """What a test has come to.

    Parameters
    ----------
    rows : list of dict
        What was observed at every record.
    scalars : dict of str to float
        Errors and effort.
    profile : ndarray, shape (strips,)
        Worn depth of the cylinder at the end [m].
    """

    rows: list[Row]
    scalars: dict[str, float]
    profile: FloatArray

    @classmethod
    def of(cls, rows: list[Row], end: WearState, place: int, steps: int) -> Observed:
        """Return what a test has come to whose end is one of the realisations of a state."""
        solves = end.solves if end.each is None else end.each.solves[place]
        scalars = {
            "depth_error": float(end.depth_error[place]),
            "volume_error": float(end.volume_error[place]),
            "steps": float(steps),
            "solves": float(solves),
        }
        return cls(rows, scalars, end.cylinder_depth[:, 0, place].mean(axis=0))


def grouped(members: Sequence[Member]) -> list[list[Member]]:
    """Return the members in groups that can be stepped together, or of one each."""
    groups: list[list[Member]] = []
    growing: list[list[Member]] = []
    for member in members:
        if not member.goes_together:
            groups.append([member])
            continue
        numbers = len(member.scene.roller) * member.scene.grid.strips
        most = min(MOST_TOGETHER, max(1, MOST_NUMBERS // numbers))
        found = next((g for g in growing if len(g) < most and member.goes_with(g[0])), None)
        if found is None:
            found = []
            groups.append(found)
            growing.append(found)
        found.append(member)
    return groups


def observed_alone(member: Member) -> Observed:
    """Step through one test."""
    scene, stepper, schedule, stop = member.scene, member.stepper, member.schedule, member.stop
    scenario, state = member.draws.scenario, fresh_state(scene)
    threshold = scenario.outputs.width_threshold
    rows = rows_of_states(scene, state, threshold, stepper.pass_by_pass)
    for advance in evolve(
        scene, state, stepper, stop, schedule.next_record, scenario.evolution.max_steps
    ):
        for due in due_states(scene, stepper, schedule, advance, stop):
            rows += rows_of_states(scene, due, threshold, stepper.pass_by_pass)
        state = advance.end
    return Observed.of(rows, state, 0, state.steps)


def rows_of_states(
    scene: Scene, state: WearState, threshold: float, pass_by_pass: bool = False
) -> list[Row]:
    """Return the observables of every realisation of a state, one number each."""
    row: dict[str, Any] = history_row(scene, state, None, threshold, pass_by_pass)
    count = scene.kinematics.multiplicity[:, None]
    energy, time = row["dissipated_energy"], np.asarray(row["time"])
    begun = time > 0.0
    columns = {
        "depth": row["depth"],
        "width": row["width"],
        "worn_volume": row["worn_volume"],
        "roller_depth": row["roller_depth"].max(axis=0),
        "roller_worn_volume": sum_in_order(row["roller_worn_volume"] * count, axis=0),
        "dissipated_energy": energy,
        "mean_power": np.where(begun, energy / np.where(begun, time, 1.0), row["power"]),
        "power": row["power"],
        "normal_force": sum_in_order(row["normal_force"] * count, axis=0) / count.sum(),
        "peak_pressure": row["peak_pressure"].max(axis=0),
    }
    return [
        {name: float(column[v]) for name, column in columns.items()} for v in range(scene.shape[2])
    ]
