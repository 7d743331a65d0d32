"""Result of an ensemble of wear tests: estimates with confidence intervals, in SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from wearsim.errors import WearsimError, unknown_name
from wearsim.levelling import ComputedProfile
from wearsim.report.text import sufficient_for
from wearsim.studies.ensemble.file.data import Band, Course, Effect
from wearsim.studies.ensemble.file.schema import DONE, KEPT, PENDING, QUANTILES
from wearsim.studies.ensemble.values import EnsembleValues
from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.estimates import Design, Estimate, Target, estimate
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.moments import summarise
from wearsim.uq.estimation.standard_errors import Control
from wearsim.uq.sampling.sampler import REPLICATES

_BAND = 0.025  # probability below the band of an ensemble
_READ_SIZE = 4_000_000  # numbers read at once
PROBABILITIES = (0.025, 0.05, 0.5, 0.95, 0.975)


@dataclass(frozen=True, eq=False)
class EnsembleResult(EnsembleValues):
    """Result of an ensemble of wear tests, from its successful realisations.

    Examples
    --------
    >>> tests = wearsim.open_results("rig-ensemble.h5")
    >>> tests.count, list(tests.inputs)
    (16, ['friction.coefficient'])
    >>> depth = tests.estimate("depth").mean
    >>> print(f"{depth.value * 1e6:.0f} um, 95 % interval from {depth.low * 1e6:.0f} um")
    48 um, 95 % interval from 46 um
    """

    #: class that runs its realisations, "module:name"; imported to continue them only
    runner: ClassVar[str] = "wearsim.studies.ensemble.realisation:RealisationRunner"

    def worn_profile(self) -> ComputedProfile:
        """Return the mean profile at the end of the tests with its band.

        Examples
        --------
        >>> found = wearsim.open_results("rig-ensemble.h5").worn_profile()
        >>> found.kept, found.label
        (16, 'least to greatest')
        """
        band, start = self.band(), self._start_height()
        low, high, label = band.low, band.high, ""
        if band.kept > 1:
            label = "2.5 % to 97.5 %"
            if not sufficient_for(band.kept, _BAND):
                low, high = self.profiles.min(axis=0), self.profiles.max(axis=0)
                label = "least to greatest"
        return ComputedProfile(
            band.y, start - band.mean, start - high, start - low, start, label, band.kept
        )

    def _start_height(self) -> FloatArray:
        """Return the height at the start of the tests, which the scenario gives [m]."""
        try:
            profile = self.scenario.cylinder.profile
        except WearsimError:  # a plugin of the scenario is not installed
            profile = None
        if profile is None:
            return np.zeros_like(self.y)
        return np.interp(self.y, profile.y, profile.height)

    def __repr__(self) -> str:
        done = f"{self.count}" if self.finished else f"{self.count} of {self.requested}"
        depth = f", depth {self.estimate('depth').mean.value * 1e6:.4g} um" if self.count else ""
        return f"<EnsembleResult '{self.title}': {done} realisations{depth}>"

    def estimate(
        self, name: str, record: int = -1, probabilities: tuple[float, ...] = PROBABILITIES
    ) -> Estimate:
        """Return mean, standard deviation and quantiles, with intervals valid for the plan.

        Parameters
        ----------
        name : str
            The observable.
        record : int
            The record; by default the end of the test.
        probabilities : tuple of float
            Probabilities of the quantiles.

        Returns
        -------
        Estimate

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> median = tests.estimate("depth", probabilities=(0.5,)).quantile(0.5)
        >>> bool(median.low < median.value < median.high)
        True
        """
        return self._estimate(self.independent(name, record)[1], probabilities)

    def _estimate(self, values: FloatArray, probabilities: tuple[float, ...]) -> Estimate:
        return estimate(
            values,
            probabilities,
            self.design,
            self.numbers[self._independent] % REPLICATES,
            self._control,
        )

    @property
    def design(self) -> Design:
        """Sampling design assumed for the intervals.

        Without the failed realisations the known mean of a control variate does not apply.
        """
        return "monte-carlo" if self.plan == "control-variate" and self.failed else self.plan

    @cached_property
    def _control(self) -> Control | None:
        if self.design != "control-variate":
            return None
        known = self.raw.control
        return Control(
            self.values("control"), known["mean"], known["std"] / np.sqrt(known["draws"])
        )

    def estimate_for(self, target: Target) -> Estimate:
        """Return the estimate to which a target applies.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> from wearsim.uq.estimation.estimates import Target
        >>> target = Target.parse("depth.mean 1%")
        >>> tests.estimate_for(target).mean == tests.estimate("depth").mean
        True
        """
        return self.estimate(target.observable, probabilities=target.probabilities)

    def convergence(self, target: Target, points: int = 40) -> tuple[IntArray, list[Interval]]:
        """Return the estimates from the first realisations, for rising numbers of them.

        Parameters
        ----------
        target : Target
            Quantity to estimate.
        points : int
            Approximate number of sample sizes, evenly spaced in their logarithm.

        Returns
        -------
        counts : ndarray of int
            Numbers of completed realisations.
        intervals : list of Interval

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> from wearsim.uq.estimation.estimates import Target
        >>> counts, intervals = tests.convergence(Target.parse("depth.mean 1%"))
        >>> intervals[-1] == tests.estimate("depth").mean
        True
        """
        counts = np.unique(
            np.geomspace(1, self.count, min(points, self.count)).round().astype(np.int64)
        )
        raw, name = self.raw, target.observable
        # kept in memory, since a file's arrays are read again at every access
        held = {
            name: raw.column(name, -1)[:, None],
            **({"control": raw.variables["control"]} if raw.control else {}),
        }
        numbers, intervals = np.arange(raw.requested), []
        for last in self.numbers[counts - 1]:
            status = np.where(numbers <= last, raw.status, PENDING)
            part = replace(self, raw=replace(raw, variables=held, status=status))
            intervals.append(target.interval(part.estimate_for(target)))
        return counts, intervals

    def final_estimates(self) -> dict[str, Any]:
        """Return the estimates at the end of the test by observable, as plain values.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> tests.final_estimates()["depth"]["count"]
        16
        """
        return {name: asdict(self.estimate(name)) for name in self.observables if self.count}

    def course(self, name: str) -> Course:
        """Return estimates of an observable at all records.

        Parameters
        ----------
        name : str
            Name of the observable, "depth".

        Returns
        -------
        Course
            Mean with its interval, standard deviation, and the quantiles `QUANTILES` [SI].

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> course = tests.course("depth")
        >>> course.mean.shape == course.passes.shape
        True
        """
        estimates = [self._estimate(values, QUANTILES) for values in self._by_record(name)]
        return Course(
            passes=self.record_passes,
            time=self.record_time,
            mean=np.array([item.mean.value for item in estimates]),
            mean_low=np.array([item.mean.low for item in estimates]),
            mean_high=np.array([item.mean.high for item in estimates]),
            std=np.array([item.std.value for item in estimates]),
            quantiles={
                p: np.array([item.quantile(p).value for item in estimates]) for p in QUANTILES
            },
        )

    def _by_record(self, name: str) -> Iterator[FloatArray]:
        """Yield an observable of the independent realisations, record by record."""
        if name not in self.observables:
            raise unknown_name(name, "an observable", self.observables)
        records, block = len(self.record_passes), max(_READ_SIZE // max(self.requested, 1), 1)
        for first in range(0, records, block):
            some = self.raw.rows(name, 0, None, slice(first, min(first + block, records)))
            yield from map(np.ascontiguousarray, some[self.numbers][self._independent].T)

    def band(self, name: str = "depth_profile") -> Band:
        """Return mean and 95 % band of the worn profiles, or of another curve, at the end.

        Parameters
        ----------
        name : str
            As of `kept_values`.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> band = tests.band()
        >>> band.kept, bool((band.low <= band.high).all())
        (16, True)
        """
        kept = self.kept_values(name)
        axis = self.raw.schema.variables[name].dims[-1]
        y = self.y if axis == "y" else np.asarray(self.raw.variables[axis])
        unknown = np.full_like(y, np.nan)
        if len(kept) == 0:
            return Band(y, unknown, unknown, unknown, unknown, 0)
        std = kept.std(axis=0, ddof=1) if len(kept) > 1 else unknown
        low, high = np.quantile(kept, (0.025, 0.975), axis=0)
        return Band(y, kept.mean(axis=0), std, low, high, len(kept))

    def sensitivity(self, name: str = "depth") -> list[Effect]:
        """Return the effect of each random input on an observable at the end, largest first.

        Parameters
        ----------
        name : str
            The observable.

        Returns
        -------
        list of Effect
            Yaw and tilt of one misalignment are one input.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> effects = tests.sensitivity("depth")
        >>> effects[0].name
        'friction.coefficient'
        """
        from wearsim.uq.sensitivity.sobol_indices import without_effect  # noqa: PLC0415  (rarely needed)

        groups = {item["name"]: item["text"] for item in self.raw.groups if self.count}
        indices = self._indices(name, list(groups))
        effects = [
            Effect(group, text, first, total, without_effect(total or first))
            for group, text in groups.items()
            for first, total in [indices[group]]
        ]
        return sorted(effects, key=lambda effect: -np.nan_to_num(effect.first.value, nan=-1.0))

    def _indices(
        self, name: str, groups: list[str]
    ) -> Mapping[str, tuple[Interval, Interval | None]]:
        """Return first-order and, with Saltelli's plan, total indices by random input."""
        from wearsim.uq.sensitivity.sobol_indices import first_order, saltelli_indices  # noqa: PLC0415  (rarely needed)

        if self.plan == "saltelli":
            values = np.where(self.raw.status == DONE, self.raw.column(name, -1), np.nan)
            return saltelli_indices(values.reshape(-1, len(groups) + 2), groups)
        values, drawn = self.at_end(name), self.drawn_numbers(groups)
        return {group: (index, None) for group, index in first_order(values, drawn).items()}

    def fewest_for_indices(self, names: list[str] | None = None) -> int:
        """Return the number of realisations from which Sobol indices are known.

        Parameters
        ----------
        names : list of str, optional
            Random inputs; all by default.

        Examples
        --------
        >>> wearsim.open_results("rig-ensemble.h5").fewest_for_indices()
        24
        """
        from wearsim.uq.sensitivity import sobol_indices  # noqa: PLC0415  (rarely needed)

        groups = [item["name"] for item in self.raw.groups]
        if self.plan == "saltelli":
            return sobol_indices.FEWEST_BASES * (len(groups) + 2)
        drawn = self.drawn_numbers(groups if names is None else names)
        # equal columns carry the same information
        columns = (np.unique(numbers, axis=1).shape[1] for numbers in drawn.values())
        return max(sobol_indices.fewest_realisations(int(number)) for number in columns)

    def drawn_numbers(self, groups: list[str]) -> dict[str, FloatArray]:
        """Return the values of random inputs by name, each (count, numbers of a draw).

        Parameters
        ----------
        groups : list of str
            Names of random inputs.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> tests.drawn_numbers(["friction.coefficient"])["friction.coefficient"].shape
        (16, 1)
        """
        drawn = [(item["input"], self.values(item["key"])) for item in self.raw.inputs]
        return {
            group: np.column_stack([v.reshape(self.count, -1) for of, v in drawn if of == group])
            for group in groups
        }

    def statistics(self) -> dict[str, FloatArray]:
        """Return the variables of the file that are estimates, by name.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> sorted(tests.statistics())[:2]
        ['depth_mean', 'depth_profile_high']
        """
        statistics: dict[str, FloatArray] = {}
        for name in self.observables:
            course = self.course(name)
            quantiles = np.array([course.quantiles[p] for p in QUANTILES])
            parts = {"mean": course.mean, "std": course.std, "quantiles": quantiles}
            statistics |= {f"{name}_{part}": values for part, values in parts.items()}
        for name in [name for name in KEPT if name in self.raw.schema.variables]:
            band = self.band(name)
            statistics |= {
                f"{name}_{end}": getattr(band, end) for end in ("mean", "std", "low", "high")
            }
        return statistics

    def is_constant(self, name: str) -> bool:
        """Return whether an observable is equal in all realisations, within rounding.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> tests.is_constant("depth"), tests.is_constant("normal_force")
        (False, True)
        """
        return bool(self.count) and summarise(self.at_end(name)).is_constant
