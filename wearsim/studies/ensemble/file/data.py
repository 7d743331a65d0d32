"""Content of the file of an ensemble of wear tests, and outcome of one realisation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from wearsim.errors import unknown_name
from wearsim.results.content import Array, Arrays, Schema, StudyData
from wearsim.studies.ensemble.file.schema import (
    DONE,
    ENSEMBLE,
    FAILED,
    QUANTILES,
    ensemble_schema,
    is_row,
    kept_profiles,
    type_of,
)
from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.competing import POINTS

if TYPE_CHECKING:
    from wearsim.results.io.stored_file import StoredFile
    from wearsim.studies.ensemble.file.parts import Part

_SMALL = 1 << 13  # largest variable or column that is kept once it has been read [bytes]


def small_variables(file: StoredFile, names: Iterable[str]) -> Arrays:
    """Read the small ones of some variables."""
    return {name: file.array(name) for name in names if file.dataset(name).nbytes <= _SMALL}


class StoredRows(Mapping[str, "Array"]):
    """Variables of an ensemble by name; there may be gigabytes.

    Parameters
    ----------
    read : callable
        Opens the file of the ensemble, and returns what a function takes from it.
    schema : Schema
        Its schema.
    parts : list of Part
        Its parts, oldest first. A row in a later one counts.
    small : dict of str to ndarray, optional
        Variables that were read when the file was opened, see `small_variables`.
    is_unchanged : callable, optional
        Returns whether the file is as it was then. Those variables and small columns are not read
        again, as estimates take the same ones many times; without it all are.
    """

    def __init__(
        self,
        read: Callable[[Callable[[StoredFile], Arrays]], Arrays],
        schema: Schema,
        parts: list[Part],
        small: Arrays | None = None,
        is_unchanged: Callable[[], bool] = lambda: False,
    ) -> None:
        self._read, self._schema, self.parts = read, schema, parts
        self._small, self._is_unchanged = small or {}, is_unchanged
        self._kept: dict[tuple[object, ...], Array] = {}  # columns of others

    def __len__(self) -> int:
        return len(self._schema.variables)

    def __iter__(self) -> Iterator[str]:
        return iter(self._schema.variables)

    def __contains__(self, name: object) -> bool:
        return name in self._schema.variables

    def __getitem__(self, name: str) -> Array:
        return self.rows(name, 0, None)

    def rows(self, name: str, start: int, stop: int | None, *rest: slice) -> Array:
        """Return some rows of a variable, and read no others.

        Parameters
        ----------
        name : str
            The variable.
        start, stop : int
            The first row, and the one after the last; None for all that follow.
        *rest : slice
            The entries of each row along further axes, by default all.

        Returns
        -------
        ndarray

        Raises
        ------
        ResultsFileError
            If the file or a part is damaged, or was changed since it was opened.
        """
        rows = {name: self._stored(name, (slice(start, stop), *rest))}
        if is_row(self._schema.variables[name]):
            self._put_parts(rows, start, *rest)
        return rows[name]

    def _stored(self, name: str, places: tuple[slice, ...]) -> Array:
        """Return rows of the file without its parts."""
        if not self._is_unchanged():
            return self._of_file([name], places)[name]
        if name in self._small:
            return self._small[name][places].copy()
        key = (name, *((place.start, place.stop, place.step) for place in places))
        if key in self._kept:
            return self._kept[key].copy()
        values = self._of_file([name], places)[name]
        if places[0] == slice(0, None) and values.nbytes <= _SMALL:
            self._kept[key] = values.copy()
        return values

    def block(self, names: Iterable[str], start: int, stop: int | None) -> Arrays:
        """Return the same rows of several variables, for which each file is opened once.

        The parameters and errors are those of `rows`; `names` have one row per realisation.
        """
        rows = self._of_file(names, (slice(start, stop),))
        self._put_parts(rows, start)
        return rows

    def _of_file(self, names: Iterable[str], places: tuple[slice, ...]) -> Arrays:
        return self._read(lambda file: {name: file.array(name, places) for name in names})

    def _put_parts(self, rows: Arrays, start: int, *rest: slice) -> None:
        for part in self.parts:
            part.put_rows(rows, start, *rest)


@dataclass(frozen=True, eq=False, kw_only=True)
class Outcome:
    """Outcome of one realisation.

    Parameters
    ----------
    number : int
        Number of the realisation, from 0.
    error : str
        Error message of a failed realisation; empty on success.
    values : dict of str to float or ndarray
        Numbers by variable. Always: drawn values by dotted key, a number or shape (rollers,). On
        success also: every variable of `schema.OBSERVABLES`, shape (records,); steps, solves,
        depth_error, volume_error, and control if the plan has a control variate; depth_profile,
        the worn depth of the cylinder at the end, shape (strips,) [m], and lift_error_curve of a
        cam, shape (angles,) [m], with fatigue cylinder_damage_profile, roller_damage_profile and,
        of a cam, damage_curve, which are not needed for realisations whose profile is not stored.
    """

    number: int
    error: str = ""
    values: dict[str, float | FloatArray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class EnsembleData(StudyData):
    """Ensemble of wear tests, in SI, in addition to `StudyData`.

    Parameters
    ----------
    stepper : str
        Name of the stepper.
    tolerance : float
        Required relative error of the final depth and worn volume of each test.
    width_threshold : float
        Worn depth above which the profile counts towards the width [m].
    total_passes, total_time : float, float
        Roller passes and duration [s] of a whole test.
    strip_width : float
        Width of a strip [m].
    plan : str
        Name of the sampling design.
    requested : int
        Requested number of realisations, which is the number of rows of the file.
    until : str
        Stopping criterion, such as "depth.mean 1%"; empty if all realisations are required.
    inputs : list of dict
        For each drawn value: dotted `key`, SI `unit`, the random `input` to which it belongs,
        and `rollers`, "each" if the rollers have separate values, else "".
    groups : list of dict
        For each random input: `name`, `role`, `persistence` and a description, `text`.
    control : dict
        Mean, std and number of draws of the control variate; empty if the plan has none.
    life : dict
        Settings of tests that end at a limit, see `LifeSettings`; empty for others.
    cam : bool
        Whether the tests are of a cam.
    variables : mapping of str to ndarray
        Variables of the schema of an ensemble, and the drawn values by dotted key; those
        of a file are read on access. Rows of pending realisations are undefined, those of failed
        ones are nan, apart from observables of tests up to the depth at which they end.
    status : ndarray
        PENDING, DONE or FAILED of every realisation, shape (requested,).
    errors : dict of int to str
        Error messages of failed realisations by their number.
    statistics : dict of str to object
        Estimates over the realisations, for other programs that read the file.
    run_id : str
        Identifies the ensemble; its part files carry it too.
    merged : int
        Number of the last part file whose rows are in the file.
    """

    separately_stored: ClassVar[frozenset[str]] = StudyData.separately_stored.union(
        ("variables", "status", "errors")
    )
    optional: ClassVar[frozenset[str]] = frozenset({"life", "cam", "fatigue"})

    base_schema: ClassVar[Schema] = ENSEMBLE

    stepper: str
    tolerance: float
    width_threshold: float
    total_passes: float
    total_time: float
    strip_width: float
    plan: str
    requested: int
    until: str = ""
    inputs: list[dict[str, str]]
    groups: list[dict[str, str]]
    control: dict[str, float] = field(default_factory=dict)
    life: dict[str, Any] = field(default_factory=dict)
    cam: bool = False
    fatigue: bool = False
    variables: Mapping[str, Array] = field(default_factory=dict)
    status: Array = field(default_factory=lambda: np.zeros(0, np.uint8))
    errors: dict[int, str] = field(default_factory=dict)
    statistics: dict[str, Any] = field(default_factory=dict)
    run_id: str = ""
    merged: int = 0

    @property
    def schema(self) -> Schema:
        """Schema of the results file."""
        return ensemble_schema(self.inputs, self.control, self.life, self.cam, self.fatigue)

    @property
    def done(self) -> IntArray:
        """Numbers of the successful realisations, ascending."""
        return np.flatnonzero(self.status == DONE)

    @property
    def failed(self) -> IntArray:
        """Numbers of the failed realisations, ascending."""
        return np.flatnonzero(self.status == FAILED)

    def rows(self, name: str, start: int, stop: int | None, *rest: slice) -> Array:
        """Return rows of a variable, also of pending and failed realisations.

        Parameters
        ----------
        name : str
            A variable with one row per realisation.
        start, stop : int
            The first realisation, and the one after the last; None for all that follow.
        *rest : slice
            The entries of each row along further axes, by default all.

        Raises
        ------
        UnknownNameError
            If there is no such variable; it lists the known ones.
        """
        if name not in self.variables:
            raise unknown_name(name, "a variable of this ensemble", self.variables)
        if isinstance(self.variables, StoredRows):
            return self.variables.rows(name, start, stop, *rest)  # reads nothing else
        return self.variables[name][(slice(start, stop), *rest)]

    def column(self, name: str, record: int) -> FloatArray:
        """Return an observable at one record of all realisations; see `rows`.

        Negative numbers of a record count from the end. The shape is (requested,).
        """
        return self.rows(name, 0, None, slice(record, record + 1 or None))[:, 0]

    @cached_property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of every variable in the file."""
        strips = len(self.variables["y"])
        lengths = {
            "realisation": self.requested,
            "record": len(self.variables["record_passes"]),
            "roller": len(self.variables["multiplicity"]),
            "y": strips,
            "kept": kept_profiles(self.requested, strips),
            "quantile": len(QUANTILES),
            "angle": len(self.variables["angle"]) if "angle" in self.schema.variables else 0,
            "course": POINTS if self.fatigue else 0,
        }
        return {
            name: tuple(lengths[dim] for dim in variable.dims)
            for name, variable in self.schema.variables.items()
        }

    @property
    def reserved(self) -> Arrays:
        """Shapes and types of the variables of a new file that are written later."""
        return {
            name: np.broadcast_to(np.zeros((), type_of(variable)), self.shapes[name])  # no memory
            for name, variable in self.schema.variables.items()
            if variable.kind != "static"
        }


@dataclass(frozen=True, eq=False)
class Course:
    """Estimates of an observable against the roller passes.

    Parameters
    ----------
    passes, time : ndarray, shape (records,)
        Roller passes, and simulated time [s].
    mean, mean_low, mean_high, std : ndarray, shape (records,)
        Mean with its confidence interval, and standard deviation.
    quantiles : mapping of float to ndarray, shape (records,)
        Quantiles by probability.
    """

    passes: FloatArray
    time: FloatArray
    mean: FloatArray
    mean_low: FloatArray
    mean_high: FloatArray
    std: FloatArray
    quantiles: Mapping[float, FloatArray]


@dataclass(frozen=True, eq=False)
class Band:
    """Profile or curve at the end, over the realisations whose profiles are stored.

    Parameters
    ----------
    y : ndarray, shape (strips,) or (angles,)
        Axial position [m], or angle of the cam [rad].
    mean, std, low, high : ndarray, shape as `y`
        Mean and standard deviation of worn depth, lift error [m] or damage, and 2.5 and 97.5 %
        quantiles.
    kept : int
        Number of profiles.
    """

    y: FloatArray
    mean: FloatArray
    std: FloatArray
    low: FloatArray
    high: FloatArray
    kept: int


@dataclass(frozen=True)
class Effect:
    """Sensitivity of an observable to a random input.

    Parameters
    ----------
    name : str
        Name of the input, such as "creepage.misalignment".
    text : str
        Description of the input.
    first : Interval
        First-order Sobol index: share of the variance due to this input alone.
    total : Interval, optional
        Total Sobol index, interactions with other inputs included; only with Saltelli's plan.
    without_effect : bool
        Whether no effect is detectable.
    """

    name: str
    text: str
    first: Interval
    total: Interval | None
    without_effect: bool
