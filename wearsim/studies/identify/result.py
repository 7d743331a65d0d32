"""Results of an identification: schema of the file, its content, and the result in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from wearsim.models.random.posterior import CONTAINED, SPECIMENS
from wearsim.report.frames import dataset_of
from wearsim.results.content import (
    Arrays,
    Axis,
    Schema,
    Stored,
    StudyData,
    StudyResult,
    Variable,
    by_name,
)
from wearsim.types import FloatArray
from wearsim.uq.distributions.two_levels import TwoLevels

if TYPE_CHECKING:
    import xarray

_TRACE = ("groove", "point")

VARIABLES: Mapping[str, Variable] = by_name(
    (
        Variable("scatter", ("scatter",), "1", "scatter t of ln K/H", "static"),
        Variable("mean_ln_k", ("scatter", "mean"), "1", "mean m of ln K/H [1/Pa]", "static"),
        Variable("posterior", ("scatter", "mean"), "1", "posterior density of t and m", "record"),
        Variable("ln_k", ("ln_k",), "1", "ln K/H [1/Pa]", "static"),
        Variable(
            "test_density",
            ("specimen", "ln_k"),
            "1",
            "density of ln K/H of each specimen",
            "record",
        ),
        Variable("trace_y", _TRACE, "m", "axial position of a trace", "record"),
        Variable("trace_height", _TRACE, "m", "levelled height of a trace", "record"),
        Variable("trace_fitted", _TRACE, "m", "height of the best profile", "record"),
        Variable("trace_low", _TRACE, "m", "lower end of the 95 % band", "record"),
        Variable("trace_high", _TRACE, "m", "upper end of the 95 % band", "record"),
        Variable("trace_unworn", _TRACE, "1", "1 on the shoulders of a trace", "record"),
    )
)

IDENTIFICATION = Schema(
    "wearsim-identification",
    3,
    "wear factors of measured grooves, from `wearsim identify`",
    by_name(
        (
            Axis("specimen", "specimen in the order of the tests", 1),
            Axis("groove", "measured groove", 1),
            Axis("point", "point of a trace", 1),
            Axis("mean", "value of the mean of ln K/H", 1),
        )
    ),
    VARIABLES,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class IdentificationData(StudyData):
    """Wear factors of measured grooves, in SI, in addition to `StudyData`.

    Parameters
    ----------
    tests : list of dict
        Numbers of each measured groove.
    specimens : list of str
        Names of the specimens.
    summary : dict
        Scatter, verdict and what would decide.
    variables : dict of str to ndarray
        Variables of `wearsim.studies.identify.result`.
    measured : list of dict
        Tables of a tests file with the same measurements.
    draws : int, optional
        Required number of draws.
    shared : bool
        Whether both bodies have one unknown factor of their K/H.
    contained : list of str
        Dotted keys of inputs that were neither drawn nor known, see `levels`.
    """

    optional: ClassVar[frozenset[str]] = frozenset({"measured", "draws", "shared", "contained"})

    tests: list[dict[str, Any]]
    specimens: list[str]
    summary: dict[str, Any]
    variables: Arrays
    measured: list[dict[str, Any]] = field(default_factory=list)
    draws: int | None = None
    shared: bool = False
    contained: list[str] = field(default_factory=list)

    base_schema: ClassVar[Schema] = IDENTIFICATION


@dataclass(frozen=True, eq=False)
class IdentificationResult(StudyResult[IdentificationData]):
    """Wear factors of measured grooves, and whether they scatter.

    Examples
    --------
    >>> from wearsim.studies.identify.measurements import Measurement
    >>> depths = [Measurement(f"test {d}", depth=d * 1e-6, depth_std=1e-6) for d in (45, 48, 51)]
    >>> found = wearsim.identify("rig.toml", depths)
    >>> [f"{test['k_over_h_per_Pa']['value']:.2e}" for test in found.tests]
    ['9.94e-12', '1.10e-11', '1.20e-11']
    """

    scatter = Stored("scatter", "Grid of the scatter t of ln K/H.")
    posterior = Stored("posterior", "Posterior density of t and m, shape (scatter, mean).")
    ln_k = Stored("ln_k", "Grid of ln K/H for the densities of the specimens.")
    test_density = Stored("test_density", "Density of ln K/H, shape (specimens, ln_k).")

    def __repr__(self) -> str:
        count = len(self.raw.specimens)
        return f"<IdentificationResult '{self.title}': {count} specimens, {self.verdict}>"

    def values(self, name: str) -> FloatArray:
        """Return a variable of the results file.

        Raises
        ------
        KeyError
            If there is none of this name.

        Examples
        --------
        >>> from wearsim.studies.identify.measurements import Measurement
        >>> depths = [Measurement("one", depth=48e-6, depth_std=1e-6)]
        >>> found = wearsim.identify("rig.toml", depths)
        >>> found.values("test_density").shape
        (1, 601)
        """
        return np.asarray(self.raw.variables[name])

    @property
    def tests(self) -> list[dict[str, Any]]:
        """Numbers of each measured groove, as in the JSON output."""
        return self.raw.tests

    @property
    def summary(self) -> dict[str, Any]:
        """Scatter, verdict and what would decide, as in the JSON output."""
        return self.raw.summary

    @property
    def verdict(self) -> str:
        """Verdict on the scatter of K/H: "explained", "random" or "undecided"."""
        return str(self.raw.summary["verdict"])

    @property
    def scatter_of_k(self) -> dict[str, float]:
        """Scatter of ln K/H with its 90 and 95 % intervals."""
        scatter: dict[str, float] = self.raw.summary["scatter_of_k"]
        return scatter

    @property
    def bayes_factor(self) -> float:
        """Evidence of equal wear factors over the evidence of scattered ones."""
        return float(self.raw.summary["bayes_factor"])

    @property
    def verdict_words(self) -> str:
        """Verdict with its reason in words."""
        t = self.scatter_of_k
        size = f"a scatter of {t['value']:.2g} (95 %: {t['low']:.2g} to {t['high']:.2g})"
        below = f"that of ln K/H is below the negligible {self.summary['negligible']:g}"
        if self.verdict == "random":
            return f"random, with {size}"
        if self.verdict == "undecided":
            return "undecided: these tests cannot show whether K/H scatters"
        if self.summary["scatter_detected"]:
            return f"explained: {below}, although {size} is detected"
        return f"explained: the inputs explain the scatter; {below}"

    def samples(self, draws: int = 500, seed: int = 1) -> xarray.Dataset:
        """Return samples of mean, scatter and every ln K/H together, as arviz reads them.

        Parameters
        ----------
        draws : int
            Samples of each walker of the sampler emcee.
        seed : int
            Seed of the random numbers.

        Returns
        -------
        xarray.Dataset
            Variables ``m``, ``t`` and ``ln_k`` over chain, draw and specimen;
            ``to_netcdf("k.nc", group="posterior")`` writes a file for ``arviz.from_netcdf``.

        Raises
        ------
        ModuleNotFoundError
            If emcee or xarray is not installed, which are part of the extra ``wearsim[sampling]``.

        Examples
        --------
        >>> from wearsim.studies.identify.measurements import Measurement
        >>> depths = [Measurement(f"test {d}", depth=d * 1e-6, depth_std=1e-6) for d in (45, 51)]
        >>> wearsim.identify("rig.toml", depths).samples(draws=20)["ln_k"].dims
        ('chain', 'draw', 'specimen')
        """
        from wearsim.uq.hierarchy.sampling import sample_hierarchy  # noqa: PLC0415  (rarely needed)

        m, t, ln_k = sample_hierarchy(self.ln_k, self.test_density, draws, seed)
        dims = ("chain", "draw")
        return dataset_of(
            {"m": (dims, m), "t": (dims, t), "ln_k": ((*dims, "specimen"), ln_k)},
            {"specimen": self.raw.specimens},
        )

    def posterior_toml(self) -> str:
        """Return the distribution of K/H of the next specimen, as a table of a scenario.

        Examples
        --------
        >>> from wearsim.studies.identify.measurements import Measurement
        >>> depths = [Measurement(f"test {d}", depth=d, depth_std=1e-6) for d in (45e-6, 48e-6)]
        >>> print(wearsim.identify("rig.toml", depths).posterior_toml().splitlines()[3])
        [wear.cylinder.k_over_h]
        """
        following, scatter = self.raw.summary["next_specimen"], self.scatter_of_k
        return (
            f"# K/H of the next specimen by {len(self.raw.specimens)} specimens\n"
            f"# {self.verdict_words}\n"
            f"# scatter of ln K/H {scatter['value']:.3g}"
            f" (95 %: {scatter['low']:.3g} to {scatter['high']:.3g})\n"
            "[wear.cylinder.k_over_h]\n"
            'distribution = "lognormal"\n'
            f'median = "{following["median_per_Pa"]:.5g} 1/Pa"\n'
            f"factor = {following['factor']:.5g}\n"
        )

    @cached_property
    def levels(self) -> TwoLevels:
        """Distribution of K/H of the next specimen, with the uncertainty of its median and scatter.

        Weights over mean m and scatter t of ln K/H. Its `contained` are inputs that were neither
        drawn nor known in all tests: where they differed, t contains it.

        Examples
        --------
        >>> from wearsim.studies.identify.measurements import Measurement
        >>> depths = [Measurement(f"test {d}", depth=d, depth_std=1e-6) for d in (45e-6, 48e-6)]
        >>> levels = wearsim.identify("rig.toml", depths).levels
        >>> levels.specimens, levels.contained
        (2, ('creepage.longitudinal', 'creepage.tilt', 'creepage.yaw', 'load.normal_force'))
        """
        grid = self.scatter, self.values("mean_ln_k"), self.posterior
        return TwoLevels.on_grid(*grid, len(self.raw.specimens), self.raw.contained)

    def posterior_csv(self) -> str:
        """Return medians, scatters and weights of K/H as the CSV of the distribution "posterior".

        Examples
        --------
        >>> from wearsim.studies.identify.measurements import Measurement
        >>> depths = [Measurement(f"test {d}", depth=d, depth_std=1e-6) for d in (45e-6, 48e-6)]
        >>> print(wearsim.identify("rig.toml", depths).posterior_csv().splitlines()[3])
        median [1/Pa],scatter,weight
        """
        levels = self.levels
        lines = [
            "# K/H of specimens: weights of medians, and of scatters of ln K/H between specimens",
            f"# {SPECIMENS}: {levels.specimens}",
            f"# {CONTAINED}: {', '.join(levels.contained)}",
            "median [1/Pa],scatter,weight",
        ]
        rows = zip(np.exp(levels.m), levels.t, levels.weight, strict=True)
        return "\n".join([*lines, *(f"{k:.8g},{t:.6g},{w:.6g}" for k, t, w in rows), ""])
