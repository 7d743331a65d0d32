"""Labels and engineering units of the observables of a wear test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from wearsim.report.text.units import PER_SI
from wearsim.results.ensemble.schema import OBSERVABLES as STORED
from wearsim.uq.estimation.stopping_rule import Target


class Named(NamedTuple):
    """Label of an observable.

    Parameters
    ----------
    words : str
        Name of the quantity.
    unit : str
        A key of `PER_SI`.
    """

    words: str
    unit: str

    @property
    def label(self) -> str:
        """Name with the unit, for an axis or a table."""
        return f"{self.words} [{self.unit}]"

    @property
    def per_si(self) -> float:
        """One SI unit in the engineering unit."""
        return PER_SI[self.unit]


#: observables of an ensemble by name
OBSERVABLES: Mapping[str, Named] = {
    "depth": Named("depth", "um"),
    "width": Named("width", "mm"),
    "worn_volume": Named("worn volume", "mm^3"),
    "roller_depth": Named("roller depth", "um"),
    "total_roller_worn_volume": Named("total roller worn volume", "mm^3"),
    "dissipated_energy": Named("dissipated energy", "J"),
    "mean_power": Named("mean power", "W"),
    "power": Named("dissipated power", "W"),
    "normal_force": Named("normal force", "N"),
    "peak_pressure": Named("peak pressure", "MPa"),
}


def si_key(name: str) -> str:
    """Return the name of an observable with its SI unit, for JSON: "worn_volume_m3"."""
    return f"{name}_{STORED[name].unit.replace('^', '')}"


def statistic_in_words(target: Target) -> str:
    """Return the statistic of a target, "mean of depth" or "95 % quantile of width"."""
    statistic: str | float = target.statistic
    if statistic == 0.5:
        statistic = "median"
    elif not isinstance(statistic, str):
        statistic = f"{100.0 * statistic:g} % quantile"
    return f"{statistic} of {OBSERVABLES[target.observable].words}"
