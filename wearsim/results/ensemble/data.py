"""What the file of an ensemble of wear tests holds, and what each realisation brings to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from wearsim.results.content import Arrays, Content, StudyData
from wearsim.results.ensemble import state_slots
from wearsim.results.ensemble.schema import (
    DONE,
    FAILED,
    QUANTILES,
    STATIC,
    is_row,
    kept_profiles,
    layout_of,
    type_of,
)
from wearsim.results.ensemble.stored_arrays import StoredArrays
from wearsim.results.schema import Layout
from wearsim.types import FloatArray


@dataclass(frozen=True, eq=False, kw_only=True)
class Outcome:
    """What became of one realisation.

    Parameters
    ----------
    number : int
        Which it is, from 0.
    error : str
        Why it failed; empty where it ended well.
    drawn : dict of str to float or ndarray
        Drawn values by dotted key, one or (rollers,).
    observables : dict of str to ndarray
        Each of `ensemble_layout.OBSERVABLES`, shape (records,).
    scalars : dict of str to float
        steps, solves, depth_error, volume_error, and control where there is a control variate.
    profile : ndarray, optional
        Worn depth of the cylinder at the end, shape (strips,) [m]; may be left out where it is
        not kept.
    """

    number: int
    error: str = ""
    drawn: dict[str, float | FloatArray] = field(default_factory=dict)
    observables: dict[str, FloatArray] = field(default_factory=dict)
    scalars: dict[str, float] = field(default_factory=dict)
    profile: FloatArray | None = None

    @property
    def values(self) -> dict[str, float | FloatArray]:
        """All numbers by the name of their variable."""
        profile = {} if self.profile is None else {"depth_profile": self.profile}
        return {**self.drawn, **self.observables, **self.scalars, **profile}


@dataclass(frozen=True, eq=False, kw_only=True)
class EnsembleData(StudyData):
    """All there is to know of an ensemble of wear tests, in SI, beside `StudyData`.

    Parameters
    ----------
    stepper : str
        Name of the stepper in use.
    tolerance : float
        Relative error asked of the final depth and worn volume of each test.
    width_threshold : float
        Worn depth from which on the width counts [m].
    total_passes, total_time : float, float
        Roller passes and duration [s] of a whole test.
    strip_width : float
        Width of a strip [m].
    plan : str
        Name of the sampling plan.
    asked : int
        Realisations at most: rows of the file.
    until : str
        What to reach before that, such as "depth.mean 1%"; empty where all are asked for.
    inputs : list of dict
        One for each drawn value: dotted `key`, SI `unit`, the random `input` that it belongs to,
        and `rollers`, "each" where every roller has its own, else "".
    groups : list of dict
        One for each random input: `name`, `role`, `persistence` and a `text` that describes it.
    control : dict
        Mean and std of the control variate and from how many draws; empty where there is none.
    variables : mapping of str to ndarray
        Those of `wearsim.results.ensemble.schema`, and the drawn values by dotted key; those of
        a file are read when they are asked for. Rows of pending realisations mean nothing, those
        of failed ones are nan.
    status : ndarray
        PENDING, DONE or FAILED of every realisation, shape (asked,).
    errors : dict of int to str
        Why realisations failed, by their number.
    statistics : dict of str to object
        Estimates made from them, for readers of the file.
    """

    stored_apart: ClassVar[frozenset[str]] = (
        StudyData.stored_apart | {"variables", "status", "errors"} | set(state_slots.NAMES)
    )

    stepper: str
    tolerance: float
    width_threshold: float
    total_passes: float
    total_time: float
    strip_width: float
    plan: str
    asked: int
    until: str = ""
    inputs: list[dict[str, str]]
    groups: list[dict[str, str]]
    control: dict[str, float] = field(default_factory=dict)
    variables: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)
    status: npt.NDArray[np.uint8] = field(default_factory=lambda: np.zeros(0, np.uint8))
    errors: dict[int, str] = field(default_factory=dict)
    statistics: dict[str, Any] = field(default_factory=dict)

    @property
    def layout(self) -> Layout:
        """The layout of its file."""
        return layout_of(self.inputs, self.control)

    @property
    def state(self) -> dict[str, Any]:
        """What changes while it grows, by name."""
        return {name: getattr(self, name) for name in state_slots.NAMES}

    @property
    def done(self) -> npt.NDArray[np.int64]:
        """Numbers of the realisations that ended well, ascending."""
        return np.flatnonzero(self.status == DONE)

    @property
    def failed(self) -> npt.NDArray[np.int64]:
        """Numbers of the realisations that failed, ascending."""
        return np.flatnonzero(self.status == FAILED)

    def rows(self, name: str, start: int, stop: int) -> npt.NDArray[Any]:
        """Return a variable of some realisations, pending and failed ones too, and read no others.

        Parameters
        ----------
        name : str
            One whose first axis is the realisations.
        start, stop : int
            The first realisation, and the one after the last.
        """
        if isinstance(self.variables, StoredArrays):
            return self.variables.rows(name, start, stop)
        return self.variables[name][start:stop]

    def columns(self, name: str, records: slice) -> FloatArray:
        """Return an observable at some records in every realisation, as `column` does.

        Parameters
        ----------
        name : str
            One of `ensemble_layout.OBSERVABLES`.
        records : slice
            From which record to which.

        Returns
        -------
        ndarray
            Shape (asked, records).
        """
        if isinstance(self.variables, StoredArrays):
            return self.variables.columns(name, records)
        return self.variables[name][:, records]

    def column(self, name: str, record: int) -> FloatArray:
        """Return an observable at one record in every realisation, pending and failed ones too.

        Parameters
        ----------
        name : str
            One of `ensemble_layout.OBSERVABLES`.
        record : int
            The record; negative ones count from the end.

        Returns
        -------
        ndarray
            Shape (asked,).
        """
        if isinstance(self.variables, StoredArrays):
            return self.variables.column(name, record)
        return self.variables[name][:, record]

    @property
    def content(self) -> Content:
        """What goes into its file before any realisation is done; rows are places only."""
        layout = self.layout
        static = {name: np.asarray(self.variables[name], float) for name in STATIC}
        strips, rollers = len(static["y"]), len(static["multiplicity"])
        lengths = {
            "realisation": self.asked,
            "record": len(static["record_passes"]),
            "roller": rollers,
            "y": strips,
            "kept": kept_profiles(self.asked, strips),
            "quantile": len(QUANTILES),
        }
        variables: Arrays = {}
        for name, variable in layout.variables.items():
            shape = [lengths[dim] for dim in variable.dims]
            nothing = np.array(np.nan if variable.kind == "statistic" else 0, type_of(variable))
            variables[name] = np.broadcast_to(nothing, shape)  # takes no memory
        return Content(
            layout,
            self.about,
            self.scenario_text,
            self.files,
            {**variables, **static, "quantile": np.array(QUANTILES)},
            state_slots.first_places(self.state),
            frozenset(name for name, variable in layout.variables.items() if is_row(variable)),
        )
