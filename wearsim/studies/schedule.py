"""Passes at which profiles and contacts are recorded, and the states there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from operator import itemgetter
from typing import TypeAlias

import numpy as np

from wearsim.evolution.integrate import Advance
from wearsim.evolution.limits import take_side_step
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, joined_states
from wearsim.evolution.steppers.base import Stepper
from wearsim.scenario import Scenario
from wearsim.scenario.tables.plain import DEFAULT_RECORDS
from wearsim.types import FloatArray

MOST_RECORDS = 500  # of a prolonged test
_ROUND_OFF = 1e-9
#: A record in or at the end of a step: the last state before or at it, by its number on the path;
#: the place of its test; its passes.
Due: TypeAlias = tuple[int, int, float]


@dataclass(frozen=True)
class RecordSchedule:
    """Passes of the records, at equal intervals or in a geometric sequence.

    Parameters
    ----------
    interval : float
        Passes between records, or 0 for a geometric sequence.
    base, count : float
        In a geometric sequence record k is at base^(k/count) passes.
    """

    interval: float
    base: float
    count: float

    @classmethod
    def of(cls, scenario: Scenario, base: float) -> RecordSchedule:
        """Return the schedule of a scenario; `base` is the length of the test [passes].

        When a test is extended, the base remains the length of the first run.
        """
        outputs = scenario.outputs
        count = outputs.records if outputs.records is not None else DEFAULT_RECORDS
        if outputs.every_passes is not None:
            return cls(float(outputs.every_passes), base, count)
        if outputs.every is not None:
            return cls(outputs.every * scenario.pass_rate, base, count)
        return cls(base / count if outputs.spacing == "even" or base <= 1.0 else 0.0, base, count)

    def interval_at(self, passes: float) -> float:
        """Return the interval of the records that are kept after some passes, 0 if geometric.

        Where a test has been prolonged to more than `MOST_RECORDS` intervals, and to more than
        twice its first length, the interval is doubled as often as needed.
        """
        if passes <= 2.0 * self.base or passes <= MOST_RECORDS * self.interval or not self.interval:
            return self.interval
        longest = max(2.0 * self.base, MOST_RECORDS * self.interval)
        return float(self.interval * 2.0 ** math.ceil(math.log2(passes / longest)))

    def is_kept(self, record: float, passes: float) -> bool:
        """Return whether a record is still kept after `passes`, as tests are prolonged."""
        interval = self.interval_at(passes)
        if interval == self.interval or record == passes:
            return True
        due = math.floor(record / interval + _ROUND_OFF) * interval
        # records of passes that are solved one by one are at the next whole pass
        return abs(record - due) <= _ROUND_OFF * record or record == math.ceil(due)

    def next_record(self, passes: float) -> float:
        """Return the passes of the first record after `passes`."""
        if interval := self.interval_at(passes):
            due = (math.floor(passes / interval + _ROUND_OFF) + 1) * interval
        else:
            number = self.count * math.log(max(passes, 1.0)) / math.log(self.base)
            due = float(self.base ** ((math.floor(number + _ROUND_OFF) + 1) / self.count))
        # round-off must not move a record at the end of the test to just before it
        whole = float(round(due))
        return whole if abs(due - whole) <= 1e-15 * whole and whole > passes else due

    def all_records(self, stop: float, pass_by_pass: bool) -> FloatArray:
        """Return the passes of all records of a test, from the initial state to the end.

        Parameters
        ----------
        stop : float
            Passes at the end of the test.
        pass_by_pass : bool
            Whether every step is one pass, so that records are at whole numbers of passes.
        """
        records = [0.0]
        while records[-1] < stop:
            records.append(min(self.due_after(records[-1], pass_by_pass), stop))
        return np.array(records)

    def due_between(
        self, first: float, last: float, stop: float, pass_by_pass: bool = False
    ) -> list[tuple[float, bool]]:
        """Return the records after one state of a test, up to and including the next state.

        Parameters
        ----------
        first, last : float
            Passes of the two states.
        stop : float
            Passes at the end of the test, which is always recorded.
        pass_by_pass : bool
            As in `all_records`.

        Returns
        -------
        list of (float, bool)
            Passes, and whether the record is at the second state.
        """
        records, passes = [], self.due_after(first, pass_by_pass)
        while passes < last:
            records.append((passes, False))
            passes = self.due_after(passes, pass_by_pass)
        return records + [(last, True)] * (passes == last or last >= stop)

    def due_after(self, passes: float, pass_by_pass: bool) -> float:
        """Return the passes of the first record after `passes`, whole if `pass_by_pass`."""
        due = self.next_record(passes)
        return float(math.ceil(due)) if pass_by_pass else due


def due_records(
    advance: Advance, schedule: RecordSchedule, stop: float, pass_by_pass: bool
) -> list[Due]:
    """Return the records of a step in order; `stop` is the end of the tests [passes]."""
    return sorted(
        [
            (source + at_end, place, passes)
            for source, (start, end) in enumerate(pairwise(advance.path))
            for place, part in enumerate(
                zip(start.passes.tolist(), end.passes.tolist(), strict=True)
            )
            for passes, at_end in schedule.due_between(*part, stop, pass_by_pass)
        ]
    )


def states_at(
    stepper: Stepper, advance: Advance, due: Sequence[Due]
) -> tuple[WearProblem, WearState]:
    """Return problem and states at records of a step, by side steps where no state is.

    Parameters
    ----------
    stepper : Stepper
    advance : Advance
        The step.
    due : sequence of Due
        Some of its records in order; each becomes a realisation.
    """
    groups = {source: [item[1] for item in of] for source, of in groupby(due, key=itemgetter(0))}
    plain = {"coarse_step_solution": None, "half_quadrature_solution": None}
    states = [advance.path[k].replaced(**plain).at(np.array(of)) for k, of in groups.items()]
    problem = advance.problem.at(np.concatenate([*groups.values()]))
    return problem, state_at(
        stepper, problem, joined_states(states), np.array([record[2] for record in due])
    )


def state_at(
    stepper: Stepper, problem: WearProblem, state: WearState, passes: FloatArray
) -> WearState:
    """Return the state at passes, shape (realisations,), by side steps where it is earlier."""
    later = np.flatnonzero(passes > state.passes)
    if not later.size:
        return state
    start, ends = state.at(later), passes[later]
    end = take_side_step(stepper.side_step, problem.at(later), start, ends - start.passes)
    return state.with_others(later, end.replaced(passes=ends))
