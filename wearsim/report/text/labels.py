"""How the observables of a wear test are called, and in which unit engineers read them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from wearsim.report.text.units import PER_SI
from wearsim.results.ensemble.schema import OBSERVABLES as STORED
from wearsim.uq.estimation.stopping_rule import Target


class Named(NamedTuple):
    """An observable as it is shown.

    Parameters
    ----------
    words : str
        What it is.
    unit : str
        A key of `PER_SI`.
    """

    words: str
    unit: str

    @property
    def label(self) -> str:
        """The words with the unit, for an axis or the head of a row."""
        return f"{self.words} [{self.unit}]"

    @property
    def per_si(self) -> float:
        """One SI unit in the unit that is shown."""
        return PER_SI[self.unit]


OBSERVABLES: Mapping[str, Named] = {
    "depth": Named("depth", "um"),
    "width": Named("width", "mm"),
    "worn_volume": Named("worn volume", "mm^3"),
    "roller_depth": Named("roller depth", "um"),
    "total_roller_worn_volume": Named("roller volume", "mm^3"),
    "dissipated_energy": Named("energy", "J"),
    "mean_power": Named("mean power", "W"),
    "power": Named("power", "W"),
    "normal_force": Named("normal force", "N"),
    "peak_pressure": Named("peak pressure", "MPa"),
}
"""Those that an ensemble follows, by name."""


def si_key(name: str) -> str:
    """Return the name of an observable with its SI unit, for JSON: "worn_volume_m3"."""
    return f"{name}_{STORED[name].unit.replace('^', '')}"


def statistic_in_words(target: Target) -> str:
    """Return what a target is about, "mean of depth" or "95 % quantile of width"."""
    statistic = target.statistic
    if isinstance(statistic, str):
        word: str = statistic
    else:
        word = "median" if statistic == 0.5 else f"{100.0 * statistic:g} % quantile"
    return f"{word} of {OBSERVABLES[target.observable].words}"
