"""Content of the file of a run, as plain values and arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from wearsim.results.content import Arrays, StudyData
from wearsim.results.run.schema import RUN
from wearsim.results.schema import Schema

_ARRAYS = ("static", "history", "records", "checkpoint")


@dataclass(frozen=True, eq=False, kw_only=True)
class RunData(StudyData):
    """Data of a run, in SI, in addition to `StudyData`.

    Parameters
    ----------
    stepper : str
        Name of the stepper.
    tolerance : float
        Required relative error of the final depth and worn volume.
    width_threshold : float
        Worn depth above which the profile counts towards the width [m].
    total_passes : float
        Roller passes of the whole test.
    kinematics : dict of str to float
        rolling_speed [m/s], cylinder_radius, roller_radius, crown_radius [m], pass_rate [1/s],
        physical_rollers.
    static, history, records : dict of str to ndarray
        The variables of `wearsim.results.run.schema`, by kind and name.
    checkpoint : dict of str to ndarray
        State for resuming the run.
    drawn : dict of str to dict
        Drawn values of the random inputs by scenario key: `values`, one for the test or one per
        roller, and their SI `unit`.
    """

    separately_stored: ClassVar[frozenset[str]] = StudyData.separately_stored.union(_ARRAYS)
    schema: ClassVar[Schema] = RUN

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
        """Variables of all kinds by name."""
        return {**self.static, **self.history, **self.records}
