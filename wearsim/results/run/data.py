"""What the file of a run holds, as plain values and arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy.typing as npt

from wearsim.results.content import Arrays, Content, StudyData
from wearsim.results.run.schema import RUN


@dataclass(frozen=True, eq=False, kw_only=True)
class RunData(StudyData):
    """All there is to know of a run, in SI; what its file holds beside `StudyData`.

    Parameters
    ----------
    stepper : str
        Name of the stepper in use.
    tolerance : float
        Relative error asked of the final depth and worn volume.
    width_threshold : float
        Worn depth from which on the width counts [m].
    total_passes : float
        Roller passes of the whole test.
    kinematics : dict of str to float
        rolling_speed [m/s], cylinder_radius, roller_radius, crown_radius [m], pass_rate [1/s],
        physical_rollers.
    static, history, records : dict of str to ndarray
        The variables of `wearsim.results.run.schema`, by kind and name.
    checkpoint : dict of str to ndarray
        The state to resume from.
    drawn : dict of str to dict
        What was drawn in the place of random inputs, by the scenario's key: `values`, one for the
        test or one per roller, and their SI `unit`.
    """

    stored_apart: ClassVar[frozenset[str]] = StudyData.stored_apart | {
        "static",
        "history",
        "records",
        "checkpoint",
    }

    stepper: str
    tolerance: float
    width_threshold: float
    total_passes: float
    kinematics: dict[str, float]
    static: Arrays
    history: Arrays
    records: Arrays
    checkpoint: Arrays
    drawn: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def variables(self) -> Arrays:
        """The variables of all kinds, by name."""
        return {**self.static, **self.history, **self.records}

    @property
    def content(self) -> Content:
        """What goes into its file."""
        return Content(
            RUN, self.about, self.scenario_text, self.files, self.variables, self.checkpoint
        )


def differences(one: RunData, other: RunData) -> list[str]:
    """Return the names of all fields and arrays in which two runs differ, to the bit.

    Parameters
    ----------
    one, other : RunData
        The runs.

    Returns
    -------
    list of str
    """
    names = [
        name
        for name in (*RunData.told(), "scenario_text", "files")
        if getattr(one, name) != getattr(other, name)
    ]
    for kind in ("static", "history", "records", "checkpoint"):
        mine, theirs = getattr(one, kind), getattr(other, kind)
        names += [
            f"{kind}.{name}"
            for name in sorted(mine.keys() | theirs.keys())
            if not _same(mine.get(name), theirs.get(name))
        ]
    return names


def _same(one: npt.NDArray[Any] | None, other: npt.NDArray[Any] | None) -> bool:
    if one is None or other is None:
        return False
    alike = one.dtype == other.dtype and one.shape == other.shape
    return alike and one.tobytes() == other.tobytes()
