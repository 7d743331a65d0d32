"""The built-in loads `constant`, `spring` and `recorded`, and the load term `thermal`."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from wearsim.csv_tables import read_columns
from wearsim.errors import mistake_in
from wearsim.mechanics.numerics.piecewise_linear import PiecewiseLinear
from wearsim.models.motion import ANGLE_NAMES
from wearsim.plugins import Load, LoadSpec, LoadTerm, Options
from wearsim.quantities import (
    InputFile,
    NonNegativeStiffness,
    PerPower,
    PositiveDuration,
    PositiveForce,
    Quantity,
)
from wearsim.types import FloatArray
from wearsim.units import FORCE, TORQUE, TORSIONAL_STIFFNESS

GAP = 10.0  # interval between samples above which it is a gap, over the usual interval
FEWEST_SAMPLES = 10  # with fewer, a file is a schedule without a usual interval
ZERO_DRIFT = 0.01  # part of the greatest load by which a log may be below zero in a pause
_PAPER = ("Chevalier, Cloupet, Soize, Wear 258 (2005), DOI 10.1016/j.wear.2004.11.012",)


class ConstantOptions(Options):
    """Options of the load `constant`."""

    normal_force: PositiveForce = Field(description="load on each roller, e.g. '300 N'")


class SpringOptions(ConstantOptions):
    """Options of the load `spring`."""

    stiffness: NonNegativeStiffness = Field(
        description="decrease of the load per displacement of the roller, e.g. '690 N/mm'"
    )


class RecordedOptions(Options):
    """Options of the load `recorded`."""

    file: InputFile = Field(description="CSV with columns such as 'time [min]', 'load [N]'")
    columns: tuple[str, str] | None = Field(
        None, description="names of the columns of time and load, if they are others"
    )
    gaps: Literal["error", "hold", "interpolate"] = Field(
        "interpolate",
        description="load in a gap, an interval of more than ten times the usual one: an error, the"
        " last value before it, or a straight line across it",
    )
    stiffness: NonNegativeStiffness = Field(
        0.0,
        description="decrease of the load per displacement of the roller, if the log does not"
        " include it",
    )


class ThermalOptions(Options):
    """Options of the load term `thermal`."""

    gain: PerPower = Field(description="steady-state load per dissipated power, e.g. '50 N/W'")
    time_constant: PositiveDuration = Field(
        description="time to 63 % of the steady state, e.g. '20 min'"
    )


class _FollowerOptions(Options):
    """Options of the load of a follower, a force or a torque."""

    external: InputFile | None = Field(
        None,
        description="CSV with columns 'angle [deg]' and 'force [N]', or 'torque [N m]' of an arm,"
        " over a turn; positive presses the roller on the outer flank",
    )
    feedback: Literal["none", "static", "inertia"] = Field(
        "static",
        description="effect of wear on the load: none, by the spring, or by the spring and the"
        " inertia of the changed motion",
    )


class FollowerOptions(_FollowerOptions):
    """Options of the load `follower`."""

    preload: Annotated[float, Quantity(FORCE, "not negative")] = Field(
        description="force on the follower without lift, e.g. '300 N'"
    )
    stiffness: NonNegativeStiffness = Field(
        0.0, description="increase of the force per lift, e.g. '5 N/mm'"
    )


class ArmOptions(_FollowerOptions):
    """Options of the load `follower-arm`."""

    preload: Annotated[float, Quantity(TORQUE, "not negative")] = Field(
        description="torque on the arm without lift, e.g. '24 N m'"
    )
    stiffness: Annotated[float, Quantity(TORSIONAL_STIFFNESS, "not negative")] = Field(
        0.0, description="increase of the torque per angle of the arm, e.g. '32 N m/rad'"
    )


class FollowerLoad(Load):
    """Preload and spring of a follower; the load on the roller differs along the cam.

    `force` is the force [N], or torque [N m], on the follower without lift, and `spring` the
    increase per lift [N/m, or N m/rad].
    """

    constant = True

    def __init__(self, options: FollowerOptions | ArmOptions) -> None:
        self.preload, self.spring = options.preload, options.stiffness
        self.feedback = options.feedback
        arm = isinstance(options, ArmOptions)
        #: external force [N] or torque [N m] at angles of the cam [rad]
        self.external = _periodic(options.external, arm) if options.external else None

    def force(self, time: FloatArray) -> FloatArray:
        """Return the preload at each `time` [s], shape as `time`."""
        return np.full_like(time, self.preload)

    def mean(self, start: float, stop: float) -> float:
        """Return the preload."""
        return self.preload

    def static(self, lift: FloatArray, theta: FloatArray) -> FloatArray:
        """Return the force [N] or torque [N m] on the follower at rest, at angles `theta` [rad]."""
        external = self.external(theta) if self.external else 0.0
        return self.preload + self.spring * lift + external


def _periodic(file: InputFile, arm: bool) -> Callable[[FloatArray], FloatArray]:
    """Return a closed cubic spline through the external force or torque of a file."""
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import)

    name, unit = ("torque", "N m") if arm else ("force", "N")
    aliases = {"angle": ANGLE_NAMES, name: ("drehmoment", "moment") if arm else ("kraft",)}
    columns = read_columns(
        file.text, file.path, {"angle": "rad", name: unit}, aliases=aliases, rising="angle"
    )
    angle, force = columns["angle"], columns[name]
    turn = angle[-1] - angle[0]
    if turn > math.tau * (1.0 + 1e-9) or len(angle) < 4:
        got = f"{math.degrees(angle[0]):.6g} to {math.degrees(angle[-1]):.6g} deg"
        raise mistake_in(file.path, "is not one turn", got, "at least 4 rows within 360 deg")
    if turn < math.tau * (1.0 - 1e-9):
        angle, force = np.append(angle, angle[0] + math.tau), np.append(force, force[0])
    elif abs(force[-1] - force[0]) > 1e-9 * float(np.abs(force).max()):
        got = f"{force[0]:.6g} and {force[-1]:.6g} {unit}"
        raise mistake_in(file.path, f"the {name} jumps", got, "equal values at 0 and 360 deg")
    force[-1], start = force[0], float(angle[0])
    spline = CubicSpline(angle - start, force, bc_type="periodic")
    return lambda theta: np.asarray(spline(np.mod(np.mod(theta, math.tau) - start, math.tau)))


class ConstantLoad(Load):
    """Constant load, with the stiffness of the mounting spring if there is one."""

    constant = True

    def __init__(self, options: ConstantOptions) -> None:
        self._force = options.normal_force
        self.stiffness = options.stiffness if isinstance(options, SpringOptions) else 0.0

    def force(self, time: FloatArray) -> FloatArray:
        """Return the load at each `time` [s], shape as `time` [N]."""
        return np.full_like(time, self._force)

    def mean(self, start: float, stop: float) -> float:
        """Return the mean of the load between two times [s] [N]."""
        return self._force

    def extremes(self, start: float, stop: float) -> tuple[float, float]:
        """Return the load twice [N]."""
        return self._force, self._force


@lru_cache(maxsize=4)  # a log may have millions of rows, and a study builds its load several times
def _read_log(
    text: str, path: str, gaps: str, names: tuple[str, str] | None
) -> tuple[PiecewiseLinear, FloatArray, FloatArray]:
    """Return the log, its pauses and its gaps [s]."""
    first, second = names or ("time", "load")
    if first == second:
        raise mistake_in(path, "time and load need two columns", first)
    columns = read_columns(
        text,
        path,
        {first: "s", second: "N"},
        aliases={} if names else {"time": ["t"], "load": ["force", "normal force", "normal_force"]},
        rising=first,
        choice='choose other names with load.columns = ["TIME", "LOAD"]',
    )
    time, load = columns[first], columns[second]
    load = np.where((load < 0.0) & (load >= -ZERO_DRIFT * load.max()), 0.0, load)
    steps = np.diff(time)
    before = np.flatnonzero(steps > GAP * np.median(steps))
    if len(time) < FEWEST_SAMPLES:
        before = before[:0]
    missing = np.stack([time[before], time[before + 1]], axis=1)
    if len(before) and gaps == "error":
        expected = 'a log without gaps, or load.gaps = "hold" or "interpolate"'
        raise mistake_in(path, gap_text(missing, float(np.median(steps))), None, expected)
    if gaps == "hold":
        time = np.insert(time, before + 1, missing[:, 1])
        load = np.insert(load, before + 1, load[before])
    zero = np.concatenate([[0], (load == 0.0).astype(np.int8), [0]])
    starts, stops = (np.flatnonzero(np.diff(zero) == sign) for sign in (1, -1))
    return PiecewiseLinear(time, load), np.stack([time[starts], time[stops - 1]], axis=1), missing


def gap_text(gaps: FloatArray, interval: float | None = None) -> str:
    """Return a sentence on the gaps of a log [s], and on its usual interval [s] if it is given."""
    start, stop = gaps[np.diff(gaps, axis=1).argmax()]
    several = f"{len(gaps)} gaps, the longest" if len(gaps) > 1 else "a gap"
    usual = f", {(stop - start) / interval:.4g} times the usual interval" if interval else ""
    return f"has {several} from {start / 60.0:.6g} to {stop / 60.0:.6g} min{usual}"


class RecordedLoad(Load):
    """Logged load, linear between its samples and integrated exactly; zero in a pause."""

    def __init__(self, options: RecordedOptions) -> None:
        self.stiffness = options.stiffness
        self._log, self._pauses, self._gaps = _read_log(
            options.file.text, options.file.path, options.gaps, options.columns
        )

    @property
    def pauses(self) -> FloatArray:
        """Start and end of times at zero load, shape (pauses, 2) [s]."""
        return self._pauses

    @property
    def gaps(self) -> FloatArray:
        """Start and end of gaps in the log, shape (gaps, 2) [s]."""
        return self._gaps

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the log [s]."""
        return float(self._log.time[0]), float(self._log.time[-1])

    def force(self, time: FloatArray) -> FloatArray:
        """Return the load at each `time` [s], shape as `time` [N]."""
        return self._log.at(time)

    def mean(self, start: float, stop: float) -> float:
        """Return the exact mean of the load between two times [s] [N]."""
        return self._log.mean(start, stop)

    def extremes(self, start: float, stop: float) -> tuple[float, float]:
        """Return the exact minimum and maximum load between two times [s] [N]."""
        return self._log.extremes(start, stop)

    def deviation(self, start: float, stop: float) -> float:
        """Return the exact standard deviation of the load between two times [s] [N]."""
        return self._log.deviation(start, stop)


class ThermalTerm(LoadTerm):
    """Load from thermal expansion, a first-order lag of gain x power.

    The parts between mount and contact expand with temperature, which follows the dissipated power
    (section 2.2 of the paper, DOI 10.1016/j.wear.2004.11.012).
    """

    def __init__(self, options: ThermalOptions) -> None:
        self.gain, self.time_constant = options.gain, options.time_constant

    def advance(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the term after `duration` [s] at constant `power` [W], shape (rollers,) [N]."""
        target = self.gain * power
        return target + (state - target) * math.exp(-duration / self.time_constant)

    def mean_force(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the exact mean of the term over `duration` [s], shape (rollers,) [N]."""
        target, ratio = self.gain * power, duration / self.time_constant
        part = -math.expm1(-ratio) / ratio if ratio > 0.0 else 1.0
        return target + (state - target) * part

    def lag(self) -> tuple[float, float]:
        """Return gain [N/W] and time constant [s]."""
        return self.gain, self.time_constant


SPECS = (
    LoadSpec(
        name="constant",
        factory=ConstantLoad,
        options=ConstantOptions,
        summary="a constant load",
        protocol=2,
    ),
    LoadSpec(
        name="spring",
        factory=ConstantLoad,
        options=SpringOptions,
        summary="a preload that decreases by the stiffness of the mounting spring as the roller"
        " descends",
        references=_PAPER,
        protocol=2,
    ),
    LoadSpec(
        name="recorded",
        factory=RecordedLoad,
        options=RecordedOptions,
        summary="a logged load from a CSV file, linear between samples",
        protocol=2,
    ),
    LoadSpec(
        name="follower",
        factory=FollowerLoad,
        options=FollowerOptions,
        summary="preload, spring and inertia of a cam's follower, and an external force by angle",
        protocol=2,
    ),
    LoadSpec(
        name="follower-arm",
        factory=FollowerLoad,
        options=ArmOptions,
        summary="the load 'follower' of a swinging arm, which is chosen for it",
        protocol=2,
    ),
    LoadSpec(
        name="thermal",
        factory=ThermalTerm,
        options=ThermalOptions,
        role="term",
        summary="a first-order lag of the dissipated power",
        references=_PAPER,
        protocol=2,
    ),
)
