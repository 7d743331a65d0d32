"""Wear tests of one identification: their records, on common strips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import Evolution, bisect_failures
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.strips import averaged, same_strips
from wearsim.studies.cam.cam_wear import CylinderView, falls_of_lift
from wearsim.studies.ensemble.batch import RealisationRun, joined_problem
from wearsim.studies.schedule import RecordSchedule, due_records, states_at
from wearsim.types import FloatArray, Grid, IntArray


@dataclass(frozen=True)
class ListedPasses(RecordSchedule):
    """Schedule of records at given passes.

    Parameters
    ----------
    passes : tuple of float
        Rising.
    """

    passes: tuple[float, ...] = ()

    def next_record(self, passes: float) -> float:
        """Return the passes of the first record after `passes`, infinity after the last."""
        return next((number for number in self.passes if number > passes), np.inf)


def worn_at_records(
    group: Sequence[RealisationRun],
    schedule: ListedPasses,
    grid: Grid,
    views: Mapping[int, CylinderView],
) -> tuple[dict[int, list[Any]], dict[int, Exception]]:
    """Step through a group of tests; return their profiles and energies at the records, and errors.

    The profiles are on the strips of `grid`.
    """
    results: dict[int, list[Any]] = {run.number: [] for run in group}
    failures: dict[int, Exception] = {}

    def work(places: IntArray) -> None:
        runs = [group[place] for place in places]
        stepper, stop = runs[0].stepper, schedule.passes[-1]
        problem = joined_problem([run.problem for run in runs])
        steps = runs[0].scenario.evolution.max_steps
        for run in runs:
            results[run.number].clear()
        tests = Evolution(problem, fresh_state(problem), stepper, stop, steps, schedule.next_record)
        for advance in tests:
            due = due_records(advance, schedule, stop, stepper.pass_by_pass)
            # tests that are not stepped together have individual steppers, and one record each
            for part in [due] if len(runs) > 1 else [[record] for record in due]:
                if not part:
                    continue
                present, states = states_at(stepper, advance, part)
                numbers = [runs[int(advance.numbers[place])].number for _, place, _ in part]
                profiles = _profiles(present, states, grid, [views[record] for record in numbers])
                for row, number in enumerate(numbers):
                    results[number].append((profiles[row], float(states.energy[row])))
        failures.update({runs[place].number: error for place, error in tests.failures.items()})

    _, failed = bisect_failures(work, np.arange(len(group)))
    return results, failures | {group[place].number: error for place, error in failed.items()}


def _profiles(
    problem: WearProblem, state: WearState, grid: Grid, views: Sequence[CylinderView]
) -> list[dict[str, FloatArray]]:
    """Return the worn profiles of each test of a state by the name of their surface."""
    same = same_strips(problem.grid, grid)
    cylinder, roller = (
        depths if same else averaged(depths, problem.grid, grid) for depths in state.depths
    )
    depth, falls = problem.kinematics.track.at_unworn(cylinder[:, 0]), falls_of_lift(problem, state)
    return [
        {
            **view.profiles(depth[:, row], falls[:, row]),
            "roller": roller[0, :, row].mean(axis=0),
        }
        for row, view in enumerate(views)
    ]
