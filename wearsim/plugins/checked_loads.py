"""Checks of the values that loads of plugins compute."""

from __future__ import annotations

from typing import Any

import numpy as np

from wearsim.plugins.checked import Checked
from wearsim.plugins.specs import Load, LoadSpec, LoadTerm
from wearsim.types import FloatArray


class _CheckedPairs(Checked):
    """Checks of a load or a term, which may return pairs of numbers."""

    spec = LoadSpec

    def _pair(self, what: str, pair: Any) -> tuple[float, float]:
        """Return two numbers after checking them."""
        if np.shape(np.asarray(pair, dtype=object)) != (2,):
            raise self._kind_error(what, pair, "a tuple of two numbers")
        first, second = (self._checked(what, value, signed=True) for value in pair)
        return first, second


class CheckedLoad(_CheckedPairs, Load):
    """Load of a plugin, with checks of its forces; errors as of `Checked`.

    Whether they are above zero is for the study to check, as it depends on the scenario.
    """

    def __init__(self, plugin: Load, name: str) -> None:
        super().__init__(plugin, name)
        self.constant = bool(plugin.constant)
        self.stiffness = self._checked("stiffness", plugin.stiffness, (), "N/m")

    @property
    def span(self) -> tuple[float, float] | None:
        """First and last time at which the load is known [s], or None."""
        span: tuple[float, float] | None = self._plugin.span
        return None if span is None else self._pair("span", span)

    def force(self, time: FloatArray) -> FloatArray:
        """Return the load at each `time` [s], shape as `time` [N]."""
        return self._called("force", self._plugin.force, np.shape(time), signed=True, time=time)

    def mean(self, start: float, stop: float) -> float:
        """Return the mean of the load between two times [s] [N]."""
        mean: float = self._plugin.mean(start, stop)
        return self._checked("mean", mean, signed=True, start=start, stop=stop)

    def extremes(self, start: float, stop: float) -> tuple[float, float]:
        """Return the minimum and maximum load between two times [s] [N]."""
        if type(self._plugin).extremes is Load.extremes:
            return super().extremes(start, stop)  # of forces that are checked
        return self._pair("extremes", self._plugin.extremes(start, stop))

    def deviation(self, start: float, stop: float) -> float:
        """Return the standard deviation of the load between two times [s] [N]."""
        deviation: float = self._plugin.deviation(start, stop)
        return self._checked("deviation", deviation, (), "N", start=start, stop=stop)

    @property
    def pauses(self) -> FloatArray:
        """Start and end of times at zero load, shape (pauses, 2) [s]."""
        return self._intervals("pauses", self._plugin.pauses)

    @property
    def gaps(self) -> FloatArray:
        """Start and end of gaps in a log, shape (gaps, 2) [s]."""
        return self._intervals("gaps", self._plugin.gaps)

    def _intervals(self, what: str, value: FloatArray) -> FloatArray:
        return self._checked(what, value, (*(np.shape(value)[:1] or (0,)), 2), "s")


class CheckedLoadTerm(_CheckedPairs, LoadTerm):
    """Term of a plugin, with checks of its forces; errors as of `Checked`."""

    def advance(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the state after `duration` [s] at constant `power` [W]."""
        inputs: dict[str, Any] = {"state": state, "power": power, "duration": duration}
        return self._called("advance", self._plugin.advance, np.shape(state), signed=True, **inputs)

    def mean_force(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the mean of the term over `duration` [s], shape as `state` [N]."""
        inputs: dict[str, Any] = {"state": state, "power": power, "duration": duration}
        return self._called(
            "mean_force", self._plugin.mean_force, np.shape(state), signed=True, **inputs
        )

    def lag(self) -> tuple[float, float] | None:
        """Return gain [N/W] and time constant [s] of a first-order lag, else None."""
        lag: tuple[float, float] | None = self._plugin.lag()
        return None if lag is None else self._pair("lag", lag)
