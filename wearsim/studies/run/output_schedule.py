"""When profiles are recorded: after how many roller passes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.scenario import Scenario
from wearsim.scenario.tables.plain import DEFAULT_RECORDS
from wearsim.types import FloatArray

_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class RecordSchedule:
    """Records at equal intervals of passes, or at a constant ratio from one to the next.

    Parameters
    ----------
    interval : float
        Passes from one record to the next, or 0 for a constant ratio.
    base, count : float
        Record number k comes after base^(k/count) passes where the ratio is constant.
    """

    interval: float
    base: float
    count: float

    @classmethod
    def of(cls, scenario: Scenario, base: float) -> RecordSchedule:
        """Return the cadence a scenario asks for; `base` is the length of the test [passes].

        The base stays that of the first run when a test is extended, so that the records go on in
        the same rhythm.
        """
        outputs = scenario.outputs
        count = outputs.records if outputs.records is not None else DEFAULT_RECORDS
        if outputs.every_passes is not None:
            return cls(float(outputs.every_passes), base, count)
        if outputs.every is not None:
            return cls(outputs.every * scenario.pass_rate, base, count)
        even = outputs.spacing == "even" or base <= 1.0
        return cls(base / count if even else 0.0, base, count)

    def next_record(self, passes: float) -> float:
        """Return the passes of the first record after `passes`."""
        if self.interval > 0.0:
            due = (math.floor(passes / self.interval + _ROUND_OFF) + 1) * self.interval
        else:
            place = self.count * math.log(max(passes, 1.0)) / math.log(self.base)
            due = float(self.base ** ((math.floor(place + _ROUND_OFF) + 1) / self.count))
        # a record due at the end of the test must not fall a round-off before it
        whole = float(round(due))
        return whole if abs(due - whole) <= 1e-15 * whole and whole > passes else due

    def all_records(self, stop: float, pass_by_pass: bool) -> FloatArray:
        """Return the passes of every record of a test, from the fresh state to its end.

        Parameters
        ----------
        stop : float
            Passes at the end of the test.
        pass_by_pass : bool
            Whether every pass is a step, so that records fall on whole ones.
        """
        found = [0.0]
        while found[-1] < stop:
            found.append(min(self.due_after(found[-1], pass_by_pass), stop))
        return np.array(found)

    def due_between(
        self, first: float, last: float, stop: float, pass_by_pass: bool = False
    ) -> tuple[list[float], bool]:
        """Return what falls due between two states of a test, and whether the second itself does.

        Parameters
        ----------
        first, last : float
            Passes done at the two.
        stop : float
            Passes at the end of the test, which is recorded too.
        pass_by_pass : bool
            As in `all_records`.
        """
        found: list[float] = []
        passes = self.due_after(first, pass_by_pass)
        while passes < last:
            found.append(passes)
            passes = self.due_after(passes, pass_by_pass)
        return found, passes == last or last >= stop

    def due_after(self, passes: float, pass_by_pass: bool) -> float:
        """Return the passes of the first record after `passes`; a pass by itself has no parts."""
        due = self.next_record(passes)
        return float(math.ceil(due)) if pass_by_pass else due
