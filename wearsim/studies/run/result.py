"""Results of one wear test: content of the file, and the result in SI."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from wearsim.errors import WearsimError, unknown_name
from wearsim.evolution.limits import SAME_VALUE, Limit
from wearsim.levelling import ComputedProfile
from wearsim.results.content import Array, Arrays, Schema, Stored, StudyData, StudyResult
from wearsim.results.io.files import read_study
from wearsim.studies.fatigue.observables import final_fatigue
from wearsim.studies.run.schema import ALL_VARIABLES, ESTIMATED, MARKS, RUN, run_schema
from wearsim.studies.start.heights import excess_between_strips
from wearsim.types import FloatArray

if TYPE_CHECKING:
    import xarray

_ARRAYS = ("static", "history", "records", "checkpoint")
_DROPPED = {"station", "roller", "realisation"}
Number: TypeAlias = float | list[float]


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
        The variables of `wearsim.studies.run.schema`, by kind and name.
    checkpoint : dict of str to ndarray
        State for resuming the run.
    drawn : dict of str to dict
        Drawn values of the random inputs by scenario key: `values`, one for the test or one per
        roller, and their SI `unit`.
    until : str
        Limit at which the run stops, or has stopped if it is finished, "depth 50 um"; empty
        without one.
    failure, failed_at : str
        Error that ended the run, and the time when it did, ISO 8601; empty if it did not fail.
    """

    separately_stored: ClassVar[frozenset[str]] = StudyData.separately_stored.union(_ARRAYS)
    optional: ClassVar[frozenset[str]] = frozenset({"until", "failure", "failed_at"})

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
    until: str = ""
    failure: str = ""
    failed_at: str = ""

    base_schema: ClassVar[Schema] = RUN

    @property
    def schema(self) -> Schema:
        """Schema of the results file."""
        return self.schema_of({}, {*self.static, *self.history})

    @property
    def fatigue(self) -> bool:
        """Whether it has the damage of its bodies."""
        return "damage" in self.history

    @classmethod
    def schema_of(cls, attributes: Mapping[str, Any], names: Container[str]) -> Schema:
        """Return the schema of a file by its attributes and the names of its variables."""
        return run_schema(frozenset(kind for name, kind in MARKS.items() if name in names))

    @classmethod
    def from_variables(
        cls, attributes: Mapping[str, Any], variables: Arrays, checkpoint: Arrays
    ) -> RunData:
        """Return the content of a file from its fields, variables and checkpoint."""
        groups = {"static": "static", "history": "history", "records": "record"}
        known = cls.schema_of(attributes, variables).variables
        by_kind: dict[str, Any] = {
            group: {name: variables[name] for name, item in known.items() if item.kind == kind}
            for group, kind in groups.items()
        }
        return cls(**{**attributes, **by_kind}, checkpoint=checkpoint)

    @property
    def variables(self) -> Arrays:
        """Variables of all kinds by name."""
        return {**self.static, **self.history, **self.records}


def read_results(path: str | Path) -> RunData:
    """Read the results file of a run; errors as of `read_study`."""
    data: RunData = read_study(path, RunData)
    return data


@dataclass(frozen=True, eq=False)
class Result(StudyResult[RunData]):
    """Result of a run, finished or not.

    The axes station, roller and realisation are dropped where their length is one.

    Examples
    --------
    >>> result = wearsim.run("rig.toml")
    >>> result
    <Result 'a wear test': 1350000 roller passes, depth 48.11 um>
    >>> result.y.shape == result.profiles[-1].shape  # the groove at the end
    True
    >>> f"{result.final['relative_depth_error']:.1%}"
    '0.0%'
    """

    passes = Stored(
        "passes", "Roller passes after each step, all rollers together; the first row is 0."
    )
    time = Stored("time", "Simulated time after each step [s].")
    depth = Stored(
        "depth", "Greatest depth of the cylinder worn since the start, after each step [m]."
    )
    width = Stored("width", "Width of the groove in the cylinder after each step [m].")
    worn_volume = Stored("worn_volume", "Worn volume of the cylinder after each step [m^3].")
    roller_depth = Stored(
        "roller_depth", "Greatest depth of each roller worn since the start, after each step [m]."
    )
    roller_worn_volume = Stored(
        "roller_worn_volume", "Worn volume of one physical roller after each step [m^3]."
    )
    dissipated_energy = Stored(
        "dissipated_energy",
        "Energy dissipated by all rollers since the start, after each step [J].",
    )
    power = Stored("power", "Dissipated power of all rollers after each step [W].")
    normal_force = Stored("normal_force", "Normal force of each roller after each step [N].")
    peak_pressure = Stored(
        "peak_pressure", "Greatest normal pressure of each roller after each step [Pa]."
    )
    descent = Stored("descent", "Worn descent of each roller since the start, after each step [m].")
    elastic_approach = Stored(
        "elastic_approach", "Elastic approach of each roller and the cylinder after each step [m]."
    )
    longitudinal_creepage = Stored(
        "longitudinal_creepage", "Mean longitudinal creepage of each roller after each step."
    )
    depth_error = Stored(
        "depth_error", "Estimated error of the depth of either body after each step [m]."
    )
    volume_error = Stored(
        "volume_error", "Estimated error of the volume worn off both bodies, after each step [m^3]."
    )
    profile_error = Stored(
        "profile_error",
        "Estimated error of the profiles of all bodies after each step: its root mean square over"
        " the strips, relative to that of the depths.",
    )
    depth_error_by_steps = Stored(
        "depth_error_by_steps", "Part of `depth_error` that is due to the steps [m]."
    )
    volume_error_by_steps = Stored(
        "volume_error_by_steps", "Part of `volume_error` that is due to the steps [m^3]."
    )
    profile_error_by_steps = Stored(
        "profile_error_by_steps", "Part of `profile_error` that is due to the steps."
    )
    depth_error_by_strips = Stored(
        "depth_error_by_strips",
        "Part of `depth_error` that is due to the strips [m]; not a number where it is not"
        " estimated.",
    )
    volume_error_by_strips = Stored(
        "volume_error_by_strips", "Part of `volume_error` that is due to the strips [m^3]."
    )
    profile_error_by_strips = Stored(
        "profile_error_by_strips", "Part of `profile_error` that is due to the strips."
    )
    rejected = Stored("rejected", "Rejected steps so far, after each step.")
    solves = Stored("solves", "Contact solves of accepted steps so far, after each step.")
    full_solves = Stored("full_solves", "Roller passes solved in full so far, after each step.")
    y = Stored("y", "Axial position of the strips [m].")
    start_height = Stored(
        "start_height",
        "Height of the cylinder above its nominal shape at the start, shape (strips,) [m].",
    )
    record_passes = Stored("record_passes", "Roller passes at each record.")
    record_time = Stored("record_time", "Simulated time at each record [s].")
    profiles = Stored(
        "cylinder_depth_profile",
        "Worn depth of the cylinder at each record, positive down, (record, y) [m].",
    )
    roller_profiles = Stored(
        "roller_depth_profile",
        "Worn depth of each roller at each record, positive into the roller [m].",
    )
    line_load = Stored(
        "line_load", "Normal force per axial length of each contact at each record [N/m]."
    )
    dissipation = Stored(
        "dissipation", "Dissipated power per axial length of each contact at each record [W/m]."
    )

    @property
    def is_cam(self) -> bool:
        """Whether it is the run of a cam."""
        return "station_angle" in self.raw.static

    def worn_profile(self, angle: float | None = None) -> ComputedProfile:
        """Return the profile at the end of the run.

        Parameters
        ----------
        angle : float, optional
            Angle of a cam [rad]; by default where it is worn deepest.

        Examples
        --------
        >>> found = wearsim.run("rig.toml").worn_profile()
        >>> print(f"{-found.height.min() * 1e6:.1f} um")
        48.1 um
        """
        start, worn = self.start_height, np.asarray(self.profiles[-1])
        if self.is_cam:
            from wearsim.studies.cam.grooves import grooves_at  # noqa: PLC0415  (not of a cylinder)

            worn = grooves_at(self, angle)[0][-1]
        height = start - worn
        return ComputedProfile(self.y, height, height, height, start)

    def to_xarray(self) -> xarray.Dataset:
        """Return all variables of the file; of a cam also depth and lift error along "angle".

        Examples
        --------
        >>> wearsim.run("rig.toml").to_xarray()["cylinder_depth_profile"].dims
        ('record', 'station', 'realisation', 'y')
        """
        from wearsim.studies.cam.grooves import with_angles  # noqa: PLC0415  (of a cam)

        dataset = super().to_xarray()
        return with_angles(dataset, self) if self.is_cam else dataset

    @property
    def errors(self) -> dict[str, FloatArray]:
        """Estimated numerical errors after each step, by the name of the quantity [SI].

        They are due to steps, strips and the stations of a cam; not a number where they are not
        estimated. The error of the depth applies to either body, of the worn volume to both.

        Examples
        --------
        >>> result = wearsim.run("rig.toml")
        >>> bool(result.errors["power"][-1] < 1e-3 * result.power[-1])
        True
        """
        estimated = (name for name in ESTIMATED if name in self.raw.history)
        return {
            "depth": self.depth_error,
            "worn_volume": self.volume_error,
            **{name: self.values(f"{name}_error") for name in estimated},
        }

    def __repr__(self) -> str:
        passes, total = float(self.passes[-1]), self.raw.total_passes
        done = f"{passes:.12g}" if self.finished else f"{passes:.12g} of {total:.12g}"
        depth = float(np.max(self.depth[-1])) * 1e6
        return f"<Result '{self.title}': {done} roller passes, depth {depth:.4g} um>"

    def values(self, name: str) -> Array:
        """Return a variable of the results file, axes of length one dropped as above.

        Parameters
        ----------
        name : str
            Name of the variable, such as "half_length".

        Raises
        ------
        UnknownNameError
            If there is none; it lists the known ones.

        Examples
        --------
        >>> result = wearsim.run("rig.toml")
        >>> print(f"{result.values('half_length').max() * 1e3:.2f} mm")
        0.14 mm
        """
        variables = self.raw.schema.variables
        if name not in variables:
            raise unknown_name(name, "a variable of a run", variables)
        array = self.raw.variables[name]
        dims = zip(variables[name].dims, array.shape, strict=True)
        return array.reshape([n for dim, n in dims if n != 1 or dim not in _DROPPED])

    @property
    def drawn(self) -> dict[str, tuple[float, ...]]:
        """Drawn values of the random inputs by scenario key, one or one per roller [SI].

        Inputs that vary during the run (processes, draws at every pass) are not included.
        """
        return {key: tuple(item["values"]) for key, item in self.raw.drawn.items()}

    @property
    def until(self) -> str:
        """Limit at which the run has stopped, "depth 50 um"; empty at the end of the test."""
        return self.raw.until if self.finished else ""

    @property
    def passes_error(self) -> float | None:
        """Error of the passes at which the run has reached its limit; None if not known.

        It is the estimated error of the limited quantity, over its growth per pass in the last
        step.
        """
        name = Limit.parse(self.until).variable if self.until else ""
        if name not in self.errors or len(self.passes) < 2:
            return None
        before, last = self.values(name)[-2:].reshape(2, -1)
        place = int(last.argmax())
        growth = abs(float(last[place] - before[place]))
        step = float(self.passes[-1] - self.passes[-2])
        greatest = float(np.max(self.errors[name][-1]))
        if not (np.isfinite(greatest) and growth > 0.0):
            return None
        return min(greatest * step / growth, float(self.passes[-1]))

    @property
    def limits(self) -> list[dict[str, Any]]:
        """Limits of the scenario, and how far the run is from each, in SI."""
        try:
            given: Mapping[str, float] = self.scenario.limit.given
        except WearsimError:  # a plugin of the scenario is not installed
            return []
        return [self._limit(key, value) for key, value in given.items()]

    def _limit(self, key: str, value: float) -> dict[str, Any]:
        limit = Limit(key.replace("_", " "), value, key)
        history = np.asarray(self.values(limit.variable), dtype=float)
        course, reached = history.reshape(len(history), -1).max(axis=1), None
        above = np.flatnonzero(course >= value * (1.0 - SAME_VALUE))
        if len(above):
            first = slice(max(int(above[0]) - 1, 0), int(above[0]) + 1)
            low, high = course[first][[0, -1]]
            part = (value - low) / (high - low) if high > low else 1.0
            reached = float(np.interp(part, [0.0, 1.0], self.passes[first][[0, -1]]))
        return {
            "quantity": key,
            "unit": limit.unit,
            "limit": value,
            "at_end": float(course[-1]),
            "reached": reached is not None,
            "reached_at_passes": reached,
            "excess": float(course[-1] / value - 1.0),
        }

    @property
    def stepper(self) -> str:
        """Name of the stepper."""
        return self.raw.stepper

    @property
    def failure(self) -> str:
        """Error that ended the run; empty if it did not fail."""
        return self.raw.failure

    @property
    def depth_below_nominal(self) -> FloatArray:
        """Greatest depth of the cylinder below its nominal shape at each record [m].

        It differs from `depth` (worn since the start) if the cylinder has a start profile.
        """
        below = self.raw.records["cylinder_depth_profile"] - self.start_height
        deepest: FloatArray = below.max(axis=(1, 3))
        return deepest[:, 0] if deepest.shape[1] == 1 else deepest

    @property
    def depth_below_nominal_error(self) -> float:
        """Estimated error of `depth_below_nominal` at the end, that between strips included [m]."""
        below = self.raw.records["cylinder_depth_profile"][-1] - self.start_height
        return float(np.max(self.depth_error[-1])) + excess_between_strips(below)

    @property
    def steps(self) -> int:
        """Number of accepted steps; the history may have fewer rows."""
        return int(np.sum(self.raw.checkpoint.get("steps", len(self.passes) - 1)))

    @property
    def final(self) -> dict[str, Number]:
        """Final state in SI, ready for JSON.

        Quantities that differ between rollers are the maximum over the rollers. With several
        realisations each value is a list. A relative error is 0 if nothing is worn.
        """
        last = {name: array[-1] for name, array in self.raw.history.items()}
        per_roller = (
            *("roller_depth", "roller_worn_volume", "normal_force", "peak_pressure"),
            *("descent", "elastic_approach"),
        )
        last.update({name: last[name].max(axis=0) for name in per_roller})
        deepest = np.maximum(last["depth"], last["roller_depth"])
        rollers = self.raw.static["multiplicity"] @ self.raw.history["roller_worn_volume"][-1]
        below: dict[str, Number] = {
            "depth_below_nominal_m": _number(np.asarray(self.depth_below_nominal[-1])),
            "depth_below_nominal_error_m": self.depth_below_nominal_error,
        }

        def with_units(*names: str) -> dict[str, Number]:
            return {_key(name): _number(last[name]) for name in names}

        return {
            "passes": _number(last["passes"]),
            **self._final_of_cam(last),
            **with_units("time", "depth"),
            **(below if self.start_height.any() else {}),
            **with_units("width", "worn_volume", "roller_depth", "roller_worn_volume"),
            **with_units("dissipated_energy", "power", "normal_force", "peak_pressure"),
            **with_units("descent", "elastic_approach"),
            **{name: _number(value) for name, value in final_fatigue(self, last).items()},
            **with_units("depth_error", "volume_error"),
            **self._final_errors(last),
            "relative_profile_error": _number(last["profile_error"]),
            "relative_depth_error": _number(_relative(last["depth_error"], deepest)),
            "relative_volume_error": _number(
                _relative(last["volume_error"], last["worn_volume"] + rollers)
            ),
        }

    def _final_errors(self, last: Arrays) -> dict[str, Number]:
        """Return the estimated errors of the final state, the greatest one over the rollers."""
        known = {name: last[f"{name}_error"] for name in ESTIMATED if f"{name}_error" in last}
        return {
            _key(name, "_error"): _number(
                error.max(axis=0) if "roller" in ALL_VARIABLES[name].dims else error
            )
            for name, error in known.items()
            if ALL_VARIABLES[name].unit != "1"
        }

    def _final_of_cam(self, last: Arrays) -> dict[str, Number]:
        """Return the final state of a cam, and depth and lift error per station."""
        if "turns" not in last:
            return {}
        curve = self.raw.records["lift_error_curve"][-1].mean(axis=(1, 2))

        def of_worst(name: str, quantity: str) -> Number:
            """Return a value of the roller of which a quantity is greatest."""
            worst = self.raw.history[quantity][-1].argmax(axis=0)[None]
            return _number(np.take_along_axis(last[name], worst, axis=0))

        numbers = self.raw.static["station_segment"].tolist()
        dwells = [k for k, number in enumerate(numbers) if numbers.count(number) == 1]
        dwell = curve[dwells[0] if dwells else 0]  # a dwell has one station
        return {
            "turns": _number(last["turns"]),
            "depth_angle_rad": _number(last["depth_angle"]),
            "lift_error_m": _number(last["lift_error"].max(axis=0)),
            "peak_pressure_angle_rad": of_worst("peak_pressure_angle", "peak_pressure"),
            "least_wear_angle_rad": of_worst("least_wear_angle", "lift_error"),
            "greatest_wear_angle_rad": of_worst("greatest_wear_angle", "lift_error"),
            "station_angle_rad": self.raw.static["station_angle"].tolist(),
            "station_depth_m": last["station_depth"].mean(axis=-1).tolist(),
            "station_lift_error_m": curve.tolist(),
            "station_lift_error_from_dwell_m": (curve - dwell).tolist(),
        }


def _key(name: str, ending: str = "") -> str:
    """Return the name of a variable with its SI unit, "worn_volume_m3"."""
    return f"{name}{ending}_{ALL_VARIABLES[name].unit.replace('^', '')}"


def _number(values: Array) -> Number:
    numbers: list[float] = values.astype(float).ravel().tolist()
    return numbers[0] if len(numbers) == 1 else numbers


def _relative(error: FloatArray, value: FloatArray) -> FloatArray:
    worn = value > 0.0
    return np.asarray(worn * error / (value + ~worn))  # without division by zero
