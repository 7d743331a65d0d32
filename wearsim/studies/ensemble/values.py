"""Values of the realisations of an ensemble."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np

from wearsim.errors import unknown_name
from wearsim.results.content import StudyResult
from wearsim.studies.ensemble.file.data import EnsembleData
from wearsim.studies.ensemble.file.schema import (
    DONE,
    KEPT,
    kept_profiles,
    observables_of,
)
from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.estimates import Design

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False)
class EnsembleValues(StudyResult[EnsembleData]):
    """Values of the realisations of an ensemble; `EnsembleResult` adds the estimates."""

    @property
    def plan(self) -> Design:
        """Name of the sampling design."""
        return cast("Design", self.raw.plan)

    @property
    def until(self) -> str:
        """Stopping criterion, such as "depth.mean 1%"; empty if there is none."""
        return self.raw.until

    @property
    def requested(self) -> int:
        """Requested number of realisations."""
        return self.raw.requested

    @property
    def count(self) -> int:
        """Number of successful realisations."""
        return len(self.numbers)

    @property
    def failed(self) -> int:
        """Number of failed realisations."""
        return len(self.raw.failed)

    @property
    def errors(self) -> Mapping[int, str]:
        """Error messages of failed realisations by their number."""
        return self.raw.errors

    @cached_property
    def numbers(self) -> IntArray:
        """Numbers of the successful realisations, shape (count,)."""
        return self.raw.done

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of the observables."""
        return tuple(observables_of(cam=self.raw.cam, fatigue=self.raw.fatigue))

    @property
    def y(self) -> FloatArray:
        """Axial position of the strips [m]."""
        return self.raw.variables["y"]

    @property
    def record_passes(self) -> FloatArray:
        """Roller passes at each record; the first record is the start of the run."""
        return self.raw.variables["record_passes"]

    @property
    def record_time(self) -> FloatArray:
        """Simulated time at each record [s]."""
        return self.raw.variables["record_time"]

    def values(self, name: str) -> FloatArray:
        """Return a variable of the successful realisations.

        Parameters
        ----------
        name : str
            An observable, such as "depth", or the dotted key of a drawn value.

        Returns
        -------
        ndarray, shape (count, records) for an observable

        Raises
        ------
        UnknownNameError
            If there is no such variable; it lists the known ones.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> tests.values("depth").shape == (16, len(tests.record_passes))
        True
        """
        return np.asarray(self.raw.rows(name, 0, None)[self.numbers])

    def to_xarray(self) -> xarray.Dataset:
        """Return all variables of the results file as a dataset of xarray.

        As for other results, but of the successful realisations only.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> tests.to_xarray().sizes["realisation"]
        16
        """
        kept = np.flatnonzero(self.raw.status[: self.kept] == DONE)
        return super().to_xarray().isel(realisation=self.numbers, kept=kept)

    def at_end(self, name: str, record: int = -1) -> FloatArray:
        """Return an observable at the end of the test, or at another record, shape (count,).

        Raises
        ------
        UnknownNameError
            If there is no such observable; it lists the known ones.

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> print(f"{tests.at_end('depth').max() * 1e6:.0f} um")
        54 um
        """
        if name not in self.observables:
            raise unknown_name(name, "an observable", self.observables)
        return self.raw.column(name, record)[self.numbers]

    def independent(self, name: str, record: int = -1) -> tuple[IntArray, FloatArray]:
        """Return numbers and values of the independent realisations.

        These are all successful realisations, except with Saltelli's plan, which reuses draws.

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

        Examples
        --------
        >>> tests = wearsim.open_results("rig-ensemble.h5")
        >>> numbers, values = tests.independent("depth")
        >>> numbers.shape == values.shape == (16,)
        True
        """
        chosen = self._independent
        return self.numbers[chosen], self.at_end(name, record)[chosen]

    @property
    def inputs(self) -> dict[str, FloatArray]:
        """Drawn values by scenario key, shape (count,) or (count, rollers) [SI].

        The value of a random process is its mean over the test.
        """
        return {item["key"]: self.values(item["key"]) for item in self.raw.inputs}

    @cached_property
    def _independent(self) -> slice | IntArray:
        """Independent realisations: with Saltelli's plan, the blocks A and B."""
        if self.plan != "saltelli":
            return slice(None)
        return np.flatnonzero(self.numbers % (len(self.raw.groups) + 2) < 2)

    @property
    def kept(self) -> int:
        """Number of stored profiles, of the first realisations."""
        return kept_profiles(self.requested, len(self.y))

    @cached_property
    def profiles(self) -> FloatArray:
        """Worn depth of the cylinder at the end, shape (kept, strips) [m], without failed ones."""
        return self.kept_values("depth_profile")

    def kept_values(self, name: str) -> FloatArray:
        """Return a variable that is stored for the first realisations, without failed ones.

        Parameters
        ----------
        name : str
            "depth_profile", or "lift_error_curve" of a cam; with fatigue
            "cylinder_damage_profile", "roller_damage_profile", or "damage_curve" of a cam.

        Returns
        -------
        ndarray, shape (realisations, ...)
            In SI; the last axis has strips or, of a curve, angles.

        Raises
        ------
        AttributeError
            If there is no such variable.

        Examples
        --------
        >>> wearsim.open_ensemble("rig-ensemble.h5").kept_values("depth_profile").shape
        (16, 189)
        """
        known = [curve for curve in KEPT if curve in self.raw.schema.variables]
        if name not in known:
            raise unknown_name(name, "a curve", known)
        kept = self.raw.variables[name]
        return np.asarray(kept[self.raw.status[: len(kept)] == DONE])
