"""What a user gets from an ensemble of wear tests: estimates with intervals, in SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from wearsim.results.ensemble.data import EnsembleData
from wearsim.results.ensemble.reader import read_ensemble
from wearsim.results.ensemble.schema import DONE, OBSERVABLES, QUANTILES, kept_profiles
from wearsim.results.study_result import StudyResult
from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.control_variate import Control
from wearsim.uq.estimation.estimates import Design, Estimate, estimate
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.moments import summarise
from wearsim.uq.sampling.plans import REPLICATES

if TYPE_CHECKING:
    from wearsim.uq.estimation.stopping_rule import Target

_AT_ONCE = 4_000_000  # numbers that are read at once
PROBABILITIES = (0.025, 0.05, 0.5, 0.95, 0.975)


@dataclass(frozen=True)
class Course:
    """An observable against the passes, over the realisations.

    Parameters
    ----------
    passes, time : ndarray, shape (records,)
        Roller passes, and simulated time [s].
    mean, mean_low, mean_high, std : ndarray, shape (records,)
        Mean with its confidence interval, and standard deviation.
    quantiles : mapping of float to ndarray, shape (records,)
        By probability.
    """

    passes: FloatArray
    time: FloatArray
    mean: FloatArray
    mean_low: FloatArray
    mean_high: FloatArray
    std: FloatArray
    quantiles: Mapping[float, FloatArray]


@dataclass(frozen=True)
class Band:
    """Worn profiles at the end, over the realisations whose profile is kept.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position [m].
    mean, std, low, high : ndarray, shape (strips,)
        Mean and standard deviation of the worn depth, and its 2.5 and 97.5 % quantiles [m].
    kept : int
        How many realisations tell it.
    """

    y: FloatArray
    mean: FloatArray
    std: FloatArray
    low: FloatArray
    high: FloatArray
    kept: int


@dataclass(frozen=True)
class Effect:
    """What a random input does to an observable.

    Parameters
    ----------
    name : str
        Name of the input, "creepage.misalignment".
    text : str
        What it is, in words.
    first : Interval
        First-order Sobol index: part of the variance that this input makes by itself.
    total : Interval, optional
        Total index, with all that it makes together with others; Saltelli's plan tells it.
    without_effect : bool
        Whether nothing of an effect is to be seen.
    """

    name: str
    text: str
    first: Interval
    total: Interval | None
    without_effect: bool


@dataclass(frozen=True, eq=False)
class EnsembleResult(StudyResult[EnsembleData]):
    """An ensemble of wear tests, as many as have ended well."""

    def __repr__(self) -> str:
        done = f"{self.count}" if self.finished else f"{self.count} of {self.asked}"
        depth = f", depth {self.estimate('depth').mean.value * 1e6:.4g} um" if self.count else ""
        return f"<EnsembleResult '{self.title}': {done} realisations{depth}>"

    @property
    def plan(self) -> Design:
        """Name of the sampling plan."""
        return cast("Design", self.raw.plan)

    @property
    def until(self) -> str:
        """What was to be reached, such as "depth.mean 1%"; empty where all were asked for."""
        return self.raw.until

    @property
    def asked(self) -> int:
        """Realisations that were asked for, at most."""
        return self.raw.asked

    @property
    def count(self) -> int:
        """Realisations that ended well."""
        return len(self.numbers)

    @property
    def failed(self) -> int:
        """Realisations that failed."""
        return len(self.raw.failed)

    @property
    def errors(self) -> Mapping[int, str]:
        """Why realisations failed, by their number."""
        return self.raw.errors

    @cached_property
    def numbers(self) -> IntArray:
        """Numbers of the realisations that ended well, shape (count,)."""
        return self.raw.done

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of what is followed through every test."""
        return tuple(OBSERVABLES)

    @property
    def y(self) -> FloatArray:
        """Axial position of the strips [m]."""
        return self.raw.variables["y"]

    @property
    def record_passes(self) -> FloatArray:
        """Roller passes at each record; the first is the fresh state."""
        return self.raw.variables["record_passes"]

    @property
    def record_time(self) -> FloatArray:
        """Simulated time at each record [s]."""
        return self.raw.variables["record_time"]

    def values(self, name: str) -> FloatArray:
        """Return any variable of the realisations that ended well.

        Parameters
        ----------
        name : str
            An observable, "depth", or the dotted key of a drawn value.

        Returns
        -------
        ndarray, shape (count, records) for an observable
        """
        return np.asarray(self.raw.variables[name][self.numbers])

    def at_end(self, name: str, record: int = -1) -> FloatArray:
        """Return an observable at the end of the test, or at another record, shape (count,)."""
        return self.raw.column(name, record)[self.numbers]

    def independent(self, name: str, record: int = -1) -> tuple[IntArray, FloatArray]:
        """Return numbers and values of the realisations that are draws by themselves.

        They are all of them, but in Saltelli's plan, which takes the same draws again and again.

        Parameters
        ----------
        name : str
            The observable.
        record : int
            The record; by default the end of the test.

        Returns
        -------
        numbers : ndarray of int, shape (draws,)
        values : ndarray, shape (draws,)
        """
        chosen = self._independent
        return self.numbers[chosen], self.at_end(name, record)[chosen]

    @property
    def inputs(self) -> dict[str, FloatArray]:
        """Drawn values by the scenario's key, each (count,) or (count, rollers) [SI].

        Of what follows a process it is the mean over the test.
        """
        return {item["key"]: self.values(item["key"]) for item in self.raw.inputs}

    def estimate(
        self, name: str, record: int = -1, probabilities: tuple[float, ...] = PROBABILITIES
    ) -> Estimate:
        """Return what the realisations tell of an observable, with intervals that fit the plan.

        Parameters
        ----------
        name : str
            The observable.
        record : int
            The record; by default the end of the test.
        probabilities : tuple of float
            Of the quantiles wanted.

        Returns
        -------
        Estimate
        """
        chosen = self._independent
        return self._estimate(self.at_end(name, record)[chosen], probabilities)

    def _estimate(self, values: FloatArray, probabilities: tuple[float, ...]) -> Estimate:
        """Return what values of the independent realisations tell."""
        replicate = self.numbers[self._independent] % REPLICATES
        return estimate(values, probabilities, self.design, replicate, self._control)

    @property
    def design(self) -> Design:
        """What the intervals take the realisations for.

        Where some fail, the mean of a control is that of others than those that are left.
        """
        return "monte-carlo" if self.plan == "control-variate" and self.failed else self.plan

    @cached_property
    def _control(self) -> Control | None:
        if self.design != "control-variate":
            return None
        known = self.raw.control
        error = known["std"] / np.sqrt(known["draws"])
        return Control(self.values("control"), known["mean"], error)

    def estimate_for(self, target: Target) -> Estimate:
        """Return the estimate that a target is about."""
        return self.estimate(target.observable, probabilities=target.probabilities)

    def told_estimates(self) -> dict[str, Any]:
        """Return the estimates at the end by observable, as plain values."""
        return {name: asdict(self.estimate(name)) for name in self.observables if self.count}

    @cached_property
    def _independent(self) -> slice | IntArray:
        """Which realisations are draws by themselves: of Saltelli's plan, those of A and B."""
        if self.plan != "saltelli":
            return slice(None)
        return np.flatnonzero(self.numbers % (len(self.raw.groups) + 2) < 2)

    def course(self, name: str) -> Course:
        """Return an observable against the passes, with the quantiles that the file has.

        Parameters
        ----------
        name : str
            The observable.

        Returns
        -------
        Course
        """
        found = [self._estimate(values, QUANTILES) for values in self._by_record(name)]
        means = [item.mean for item in found]
        return Course(
            passes=self.record_passes,
            time=self.record_time,
            mean=np.array([mean.value for mean in means]),
            mean_low=np.array([mean.low for mean in means]),
            mean_high=np.array([mean.high for mean in means]),
            std=np.array([item.std.value for item in found]),
            quantiles={p: np.array([item.quantile(p).value for item in found]) for p in QUANTILES},
        )

    def _by_record(self, name: str) -> Iterator[FloatArray]:
        """Yield an observable of the independent realisations at one record after the other."""
        records, together = len(self.record_passes), max(_AT_ONCE // max(self.asked, 1), 1)
        for first in range(0, records, together):
            some = self.raw.columns(name, slice(first, min(first + together, records)))
            for values in some[self.numbers][self._independent].T:
                yield np.ascontiguousarray(values)

    @property
    def kept(self) -> int:
        """How many realisations, the first ones, have their profiles kept."""
        return kept_profiles(self.asked, len(self.y))

    @cached_property
    def profiles(self) -> FloatArray:
        """Worn depth of the cylinder at the end, shape (kept, strips) [m]; failed ones left out."""
        kept = self.raw.variables["depth_profile"]
        status = self.raw.status[: len(kept)]
        return np.asarray(kept[status == DONE])

    def band(self) -> Band:
        """Return mean and 95 % band of the worn profiles at the end."""
        kept = self.profiles
        if len(kept) == 0:
            nothing = np.full_like(self.y, np.nan)
            return Band(self.y, nothing, nothing, nothing, nothing, 0)
        std = kept.std(axis=0, ddof=1) if len(kept) > 1 else np.full_like(self.y, np.nan)
        low, high = np.quantile(kept, (0.025, 0.975), axis=0)
        return Band(self.y, kept.mean(axis=0), std, low, high, len(kept))

    def sensitivity(self, name: str = "depth") -> list[Effect]:
        """Return what each random input does to an observable at the end, the greatest first.

        Parameters
        ----------
        name : str
            The observable.

        Returns
        -------
        list of Effect
            Yaw and tilt of one slack are one input.
        """
        from wearsim.uq.sensitivity.sobol_indices import without_effect  # noqa: PLC0415  (rarely needed)

        groups = {item["name"]: item["text"] for item in self.raw.groups if self.count}
        first, total = self._indices(name, list(groups))
        effects = [
            Effect(
                name=group,
                text=text,
                first=first[group],
                total=total.get(group),
                without_effect=without_effect(total.get(group, first[group])),
            )
            for group, text in groups.items()
        ]
        return sorted(effects, key=lambda effect: -np.nan_to_num(effect.first.value, nan=-1.0))

    def _indices(
        self, name: str, groups: list[str]
    ) -> tuple[dict[str, Interval], dict[str, Interval]]:
        from wearsim.uq.sensitivity.sobol_indices import first_order, saltelli_indices  # noqa: PLC0415  (rarely needed)

        if self.plan == "saltelli":
            size = len(groups) + 2
            values = np.where(self.raw.status == DONE, self.raw.column(name, -1), np.nan)
            found = saltelli_indices(values.reshape(-1, size), groups)
            return (
                {group: pair[0] for group, pair in found.items()},
                {group: pair[1] for group, pair in found.items()},
            )
        keys = {
            group: [i["key"] for i in self.raw.inputs if i["input"] == group] for group in groups
        }
        inputs = self.inputs
        numbers = {
            group: np.column_stack([inputs[key].reshape(self.count, -1) for key in keys[group]])
            for group in groups
        }
        return first_order(self.at_end(name), numbers), {}

    def statistics(self) -> dict[str, FloatArray]:
        """Return the arrays of statistics that stand in the file, by name."""
        found: dict[str, FloatArray] = {}
        for name in self.observables:
            course = self.course(name)
            found[f"{name}_mean"], found[f"{name}_std"] = course.mean, course.std
            found[f"{name}_quantiles"] = np.array([course.quantiles[p] for p in QUANTILES])
        band = self.band()
        for part in ("mean", "std", "low", "high"):
            found[f"depth_profile_{part}"] = getattr(band, part)
        return found

    def is_constant(self, name: str) -> bool:
        """Tell whether an observable is the same in all realisations, but for rounding."""
        return bool(self.count) and summarise(self.at_end(name)).is_constant


def open_ensemble(path: str | Path) -> EnsembleResult:
    """Open the file of an ensemble.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    EnsembleResult

    Raises
    ------
    ResultsFileError
        If it is missing, foreign, truncated, damaged, or written by a newer wearsim.
    """
    return EnsembleResult(read_ensemble(path), Path(path))
