"""Result of a run, in SI."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.results.io.reader import read_results
from wearsim.results.run.data import RunData
from wearsim.results.run.schema import VARIABLES
from wearsim.results.study_result import StudyResult
from wearsim.types import FloatArray, IntArray

Number: TypeAlias = float | list[float]

_DROPPED = {"station", "roller", "realisation"}


@dataclass(frozen=True, eq=False)
class Result(StudyResult[RunData]):
    """Result of a run, finished or not.

    The axes station, roller and realisation are dropped where their length is one.
    """

    def __repr__(self) -> str:
        passes, total = float(self.passes[-1]), self.raw.total_passes
        done = f"{passes:.12g}" if self.finished else f"{passes:.12g} of {total:.12g}"
        depth = float(np.max(self.depth[-1])) * 1e6
        return f"<Result '{self.title}': {done} roller passes, depth {depth:.4g} um>"

    def values(self, name: str) -> npt.NDArray[Any]:
        """Return a variable of the results file, axes of length one dropped as above.

        Parameters
        ----------
        name : str
            Name of the variable, such as "half_length".
        """
        array = self.raw.variables[name]
        dims = zip(VARIABLES[name].dims, array.shape, strict=True)
        return array.reshape([n for dim, n in dims if n != 1 or dim not in _DROPPED])

    @property
    def drawn(self) -> dict[str, tuple[float, ...]]:
        """Drawn values of the random inputs by scenario key, one or one per roller [SI].

        Inputs that vary during the run (processes, draws at every pass) are not included.
        """
        return {key: tuple(item["values"]) for key, item in self.raw.drawn.items()}

    @property
    def start_height(self) -> FloatArray:
        """Height of the cylinder above its nominal shape at the start, shape (strips,) [m]."""
        return self.raw.static["start_height"]

    @property
    def stepper(self) -> str:
        """Name of the stepper."""
        return self.raw.stepper

    @property
    def passes(self) -> FloatArray:
        """Roller passes after each step, all rollers together; the first row is 0."""
        return self.values("passes")

    @property
    def time(self) -> FloatArray:
        """Simulated time after each step [s]."""
        return self.values("time")

    @property
    def depth(self) -> FloatArray:
        """Greatest depth of the cylinder worn since the start, after each step [m]."""
        return self.values("depth")

    @property
    def width(self) -> FloatArray:
        """Width of the groove in the cylinder after each step [m]."""
        return self.values("width")

    @property
    def worn_volume(self) -> FloatArray:
        """Worn volume of the cylinder after each step [m^3]."""
        return self.values("worn_volume")

    @property
    def roller_depth(self) -> FloatArray:
        """Greatest depth of each roller worn since the start, after each step [m]."""
        return self.values("roller_depth")

    @property
    def roller_worn_volume(self) -> FloatArray:
        """Worn volume of one physical roller after each step [m^3]."""
        return self.values("roller_worn_volume")

    @property
    def dissipated_energy(self) -> FloatArray:
        """Energy dissipated by all rollers since the start, after each step [J]."""
        return self.values("dissipated_energy")

    @property
    def power(self) -> FloatArray:
        """Dissipated power of all rollers after each step [W]."""
        return self.values("power")

    @property
    def normal_force(self) -> FloatArray:
        """Normal force of each roller after each step [N]."""
        return self.values("normal_force")

    @property
    def peak_pressure(self) -> FloatArray:
        """Greatest normal pressure of each roller after each step [Pa]."""
        return self.values("peak_pressure")

    @property
    def longitudinal_creepage(self) -> FloatArray:
        """Mean longitudinal creepage of each roller after each step."""
        return self.values("longitudinal_creepage")

    @property
    def depth_error(self) -> FloatArray:
        """Estimated error of the depth of either body after each step [m]."""
        return self.values("depth_error")

    @property
    def volume_error(self) -> FloatArray:
        """Estimated error of the volume worn off both bodies, after each step [m^3]."""
        return self.values("volume_error")

    @property
    def rejected(self) -> IntArray:
        """Rejected steps so far, after each step."""
        return self.values("rejected")

    @property
    def solves(self) -> IntArray:
        """Contact solves of accepted steps so far, after each step."""
        return self.values("solves")

    @property
    def full_solves(self) -> IntArray:
        """Roller passes solved in full so far, after each step."""
        return self.values("full_solves")

    @property
    def y(self) -> FloatArray:
        """Axial position of the strips [m]."""
        return self.values("y")

    @property
    def record_passes(self) -> FloatArray:
        """Roller passes at each record."""
        return self.values("record_passes")

    @property
    def record_time(self) -> FloatArray:
        """Simulated time at each record [s]."""
        return self.values("record_time")

    @property
    def profiles(self) -> FloatArray:
        """Worn depth of the cylinder at each record, positive down, shape (record, y) [m]."""
        return self.values("cylinder_depth_profile")

    @property
    def depth_below_nominal(self) -> FloatArray:
        """Greatest depth of the cylinder below its nominal shape at each record [m].

        It differs from `depth` (worn since the start) if the cylinder has a start profile.
        """
        below = self.raw.records["cylinder_depth_profile"] - self.start_height
        deepest: FloatArray = below.max(axis=(1, 3))
        return deepest[:, 0] if deepest.shape[1] == 1 else deepest

    @property
    def roller_profiles(self) -> FloatArray:
        """Worn depth of each roller at each record, positive into the roller [m]."""
        return self.values("roller_depth_profile")

    @property
    def line_load(self) -> FloatArray:
        """Normal force per axial length of each contact at each record [N/m]."""
        return self.values("line_load")

    @property
    def dissipation(self) -> FloatArray:
        """Dissipated power per axial length of each contact at each record [W/m]."""
        return self.values("dissipation")

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
        per_roller = ("roller_depth", "roller_worn_volume", "normal_force", "peak_pressure")
        last.update({name: last[name].max(axis=0) for name in per_roller})
        # the estimated errors apply to the deeper body and to the volume of both bodies
        deepest = np.maximum(last["depth"], last["roller_depth"])
        rollers = self.raw.static["multiplicity"] @ self.raw.history["roller_worn_volume"][-1]
        below_nominal = (
            {"depth_below_nominal_m": _number(np.asarray(self.depth_below_nominal[-1]))}
            if self.start_height.any()
            else {}
        )
        return {
            "passes": _number(last["passes"]),
            "time_s": _number(last["time"]),
            "depth_m": _number(last["depth"]),
            **below_nominal,
            "width_m": _number(last["width"]),
            "worn_volume_m3": _number(last["worn_volume"]),
            "roller_depth_m": _number(last["roller_depth"]),
            "roller_worn_volume_m3": _number(last["roller_worn_volume"]),
            "dissipated_energy_J": _number(last["dissipated_energy"]),
            "power_W": _number(last["power"]),
            "normal_force_N": _number(last["normal_force"]),
            "peak_pressure_Pa": _number(last["peak_pressure"]),
            "depth_error_m": _number(last["depth_error"]),
            "volume_error_m3": _number(last["volume_error"]),
            "relative_depth_error": _number(_relative(last["depth_error"], deepest)),
            "relative_volume_error": _number(
                _relative(last["volume_error"], last["worn_volume"] + rollers)
            ),
        }


def _number(values: npt.NDArray[Any]) -> Number:
    numbers: list[float] = values.astype(float).ravel().tolist()
    return numbers[0] if len(numbers) == 1 else numbers


def _relative(error: FloatArray, value: FloatArray) -> FloatArray:
    worn = value > 0.0
    return np.asarray(worn * error / (value + ~worn))  # without division by zero


def open_results(path: str | Path) -> Result:
    """Open a results file.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Result

    Raises
    ------
    ResultsFileError
        If it is missing, foreign, truncated, damaged, or written by a newer wearsim.
    """
    return Result(read_results(path), Path(path))
