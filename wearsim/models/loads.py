"""The built-in loads `constant`, `spring` and `recorded`, and the load term `thermal`."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from wearsim.csv_tables import read_columns
from wearsim.mechanics.numerics.piecewise_linear import PiecewiseLinear
from wearsim.plugins import Load, LoadSpec, LoadTerm, Options
from wearsim.quantities import (
    InputFile,
    NonNegativeStiffness,
    PerPower,
    PositiveDuration,
    PositiveForce,
)
from wearsim.types import FloatArray


class ConstantOptions(Options):
    """Options of the load `constant`."""

    normal_force: PositiveForce = Field(description="load on each roller, e.g. '300 N'")


class SpringOptions(ConstantOptions):
    """Options of the load `spring`."""

    stiffness: NonNegativeStiffness = Field(
        description="load lost per depth the roller sinks into worn material, e.g. '690 N/mm'"
    )


class RecordedOptions(Options):
    """Options of the load `recorded`."""

    file: InputFile = Field(description="CSV with columns such as 'time [min]', 'load [N]'")
    stiffness: NonNegativeStiffness = Field(
        0.0, description="load lost per depth besides, where the log does not show it already"
    )


class ThermalOptions(Options):
    """Options of the load term `thermal`."""

    gain: PerPower = Field(description="load gained per dissipated power at rest, e.g. '50 N/W'")
    time_constant: PositiveDuration = Field(description="time to 63 % of it, e.g. '20 min'")


class ConstantLoad(Load):
    """The same load at all times, less what a mounting spring loses as its roller sinks."""

    def __init__(self, options: ConstantOptions) -> None:
        self._force = options.normal_force
        self.stiffness = options.stiffness if isinstance(options, SpringOptions) else 0.0

    def force(self, time: FloatArray) -> FloatArray:
        """Return the load at each `time` [s], shape as `time` [N]."""
        return np.full_like(time, self._force)

    def mean(self, start: float, stop: float) -> float:
        """Return the mean of the load between two times [s] [N]."""
        return self._force


class RecordedLoad(Load):
    """A logged load, linear between its samples and integrated exactly."""

    def __init__(self, options: RecordedOptions) -> None:
        columns = read_columns(
            options.file.text, options.file.path, {"time": "s", "load": "N"}, rising="time"
        )
        self.stiffness = options.stiffness
        self._log = PiecewiseLinear(columns["time"], columns["load"])

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
        """Return the exact least and greatest load between two times [s] [N]."""
        return self._log.extremes(start, stop)

    def deviation(self, start: float, stop: float) -> float:
        """Return the exact standard deviation of the load between two times [s] [N]."""
        return self._log.deviation(start, stop)


class ThermalTerm(LoadTerm):
    """Load from thermal expansion: it follows gain x power with a first-order lag.

    The parts between mount and contact grow with temperature, which follows the dissipated power
    (section 2.2 of the paper, DOI 10.1016/j.wear.2004.11.012).
    """

    def __init__(self, options: ThermalOptions) -> None:
        self.gain = options.gain
        self.time_constant = options.time_constant

    def advance(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the term after `duration` [s] at constant `power` [W], shape (rollers,) [N]."""
        target = self.gain * power
        return target + (state - target) * math.exp(-duration / self.time_constant)

    def mean_force(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the term's exact mean over that time, shape (rollers,) [N]."""
        target = self.gain * power
        ratio = duration / self.time_constant
        part = -math.expm1(-ratio) / ratio if ratio > 0.0 else 1.0
        return target + (state - target) * part

    def lag(self) -> tuple[float, float]:
        """Return gain [N/W] and time constant [s]."""
        return self.gain, self.time_constant


_PAPER = ("Chevalier, Cloupet, Soize, Wear 258 (2005), DOI 10.1016/j.wear.2004.11.012",)

SPECS = (
    LoadSpec(
        name="constant",
        factory=ConstantLoad,
        options=ConstantOptions,
        summary="the same load at all times",
    ),
    LoadSpec(
        name="spring",
        factory=ConstantLoad,
        options=SpringOptions,
        summary="a preload that a mounting spring loses as the roller sinks in",
        references=_PAPER,
    ),
    LoadSpec(
        name="recorded",
        factory=RecordedLoad,
        options=RecordedOptions,
        summary="a logged load from a CSV file, linear between samples",
    ),
    LoadSpec(
        name="thermal",
        factory=ThermalTerm,
        options=ThermalOptions,
        role="term",
        summary="load that follows the dissipated power with a first-order lag",
        references=_PAPER,
    ),
)
