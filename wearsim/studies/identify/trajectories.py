"""Worn profiles for every wear factor: one wear test for each draw of the other inputs.

Where nothing depends on time, the worn profile depends on the wear factor and on the number of
passes only through their product tau = (K/H) n, so that the records of one test are the profiles
of all wear factors. Otherwise a test is run for each of several wear factors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wearsim.errors import CapabilityError, SolverError, mistake_in
from wearsim.plugins import ContactModel
from wearsim.scenario import Scenario
from wearsim.studies.cam.cam_wear import Wanted, size_of, view_of
from wearsim.studies.ensemble.batch import RealisationRun, batch_groups
from wearsim.studies.ensemble.realisation import closed_form_depths
from wearsim.studies.identify.wear_tests import ListedPasses, worn_at_records
from wearsim.studies.run.assemble import assemble_problem, prepared_model, start_height
from wearsim.studies.run.draws import Drawer
from wearsim.studies.run.grid import lattice, strips_of_run
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray, Grid

CYLINDER, ROLLER = "wear.cylinder.k_over_h", "wear.roller.k_over_h"
RATIO = 1.3  # of tau between records
RATIO_OF_TESTS = 1.7  # of K/H between tests
DRAWS, DRAWS_OF_MANY = 256, 128  # by default, with one test for each draw and with several
BELOW, ABOVE = 0.75, 1.35  # depths that are covered, over the least and the greatest measured
# greatest tolerance of a wear test where there are many: the scatter between tests is far greater
TOLERANCE = 1e-2
_FEW = 8  # draws
_MOST_LOST = 0.05  # fraction of the draws whose tests may fail
_PILOTS = 6  # tests that search for the wear factor of a cam
_NEAR = 1.3  # ratio of sizes at which the search ends
_EXTENSIONS = 4  # times that tests are run again, to cover what was measured
_GAIN = 1.05  # least ratio of depths by which a greater K/H is not in vain
_MOST_EXTENDED = 100.0  # greatest ratio of K/H by which a test is extended at once
_ROOM = 1.5  # by which the depth on a cam may differ between draws from that expected


@dataclass(frozen=True)
class Grown:
    """Worn profiles at one number of passes, for rising wear factors.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of the strips [m].
    start : ndarray, shape (strips,)
        Height of the cylinder before wear [m].
    ln_k : ndarray, shape (draws, records)
        Logarithm of K/H of the cylinder [1/Pa].
    depth : mapping of str to ndarray, shape (draws, records, strips)
        Worn depth of "cylinder" and "roller", of a cam at each measured angle [m]; "lift" has the
        fall of the lift, at `CURVE_ANGLES` instead of strips.
    energy : ndarray, shape (draws, records)
        Dissipated energy of all rollers [J].
    """

    y: FloatArray
    start: FloatArray
    ln_k: FloatArray
    depth: Mapping[str, FloatArray]
    energy: FloatArray


@dataclass(frozen=True)
class Trajectories:
    """Wear of a test for draws of its other inputs.

    Parameters
    ----------
    values : mapping of str to ndarray, shape (draws,)
        Drawn values by the scenario's key; the mean over the rollers where they differ.
    reasons : tuple of str
        Why the wear factor and the passes do not act through their product; empty if they do.
    by_passes : mapping of float to Grown
        Profiles by the number of passes.
    lost : int
        Number of draws that were left out, since a test failed.
    """

    values: Mapping[str, FloatArray]
    reasons: tuple[str, ...]
    by_passes: Mapping[float, Grown]
    lost: int = 0


def time_dependence(scenario: Scenario, shared: bool) -> tuple[str, ...]:
    """Return the reasons why K/H and the passes do not act through their product.

    Parameters
    ----------
    scenario : Scenario
    shared : bool
        Whether the wear factors of both bodies have a common unknown factor.
    """
    processes = [item.name for item in scenario.random if item.role == "process"]
    worn = factors(scenario)[1]
    reasons = (
        (bool(processes), f"a random process in time sets {' and '.join(processes)}"),
        (not scenario.load.built.constant, f"the load '{scenario.load.kind}' depends on time"),
        (
            bool(scenario.load.terms),
            f"the load has terms ({', '.join(term.name for term in scenario.load.terms)})",
        ),
        (
            (worn > 0.0 or any(item.name == ROLLER for item in scenario.random)) and not shared,
            (
                "the roller's wear factor is that of the scenario (--share k=cylinder,roller gives"
                " both bodies one unknown factor)"
            ),
        ),
    )
    return tuple(text for applies, text in reasons if applies)


def check_law(scenario: Scenario) -> None:
    """Check that a scenario has a wear factor to be identified.

    Raises
    ------
    CapabilityError, ScenarioError
        If the wear law has none, or if it is zero or has a random factor.
    """
    if scenario.wear is None or scenario.wear.law != "archard-dissipation":
        law = "none" if scenario.wear is None else f"'{scenario.wear.law}'"
        raise CapabilityError(
            f"{scenario.file}: identification needs the wear factor K/H of"
            f" wear.law = 'archard-dissipation', and the wear law is {law}"
        )
    if any(item.name == "wear.factor" for item in scenario.random):
        raise mistake_in(
            scenario.file,
            "is random, and so is what is identified: the scatter of K/H between specimens",
            None,
            "no such line: delete factor under [wear], or the table [wear.factor]",
            table="wear",
            key="factor",
        )
    if factors(scenario)[0] <= 0.0:
        raise mistake_in(
            scenario.file,
            "must be above 0: it is where the search begins",
            "0",
            "a positive value such as '1e-11 1/Pa'",
            table="wear.cylinder",
            key="k_over_h",
        )


def factors(scenario: Scenario) -> tuple[float, float]:
    """Return the wear factors of cylinder and roller [1/Pa]."""
    assert scenario.wear is not None
    options: Any = scenario.wear.options
    return float(options.cylinder.wear_factor), float(options.roller.wear_factor)


def with_factors(scenario: Scenario, cylinder: float, roller: float) -> Scenario:
    """Return a scenario with other wear factors [1/Pa]."""
    assert scenario.wear is not None
    options: Any = scenario.wear.options
    changed = {
        name: getattr(options, name).model_copy(update={"k_over_h": value})
        for name, value in (("cylinder", cylinder), ("roller", roller))
    }
    return replace(
        scenario, wear=replace(scenario.wear, options=options.model_copy(update=changed))
    )


class Grower:
    """Wear tests of one scenario for draws of its inputs other than the wear factor.

    Parameters
    ----------
    scenario : Scenario
    draws : int, optional
        Number of draws.
    shared : bool
        Whether the wear factors of both bodies have a common unknown factor.
    on_progress : callable, optional
        Called with the numbers of completed and of all wear tests.
    angles : mapping of str to float, optional
        Surfaces of a cam by name, and their angles [rad].
    tolerance : float
        Tolerance of the wear tests of many draws, if that of the scenario is smaller.
    """

    def __init__(
        self,
        scenario: Scenario,
        draws: int | None = None,
        shared: bool = False,
        on_progress: Callable[[int, int], None] | None = None,
        angles: Mapping[str, float] | None = None,
        tolerance: float = TOLERANCE,
    ) -> None:
        check_law(scenario)
        dropped = {CYLINDER, ROLLER} if shared else {CYLINDER}
        random = tuple(item for item in scenario.random if item.name not in dropped)
        self.scenario, self.shared = replace(scenario, random=random), shared
        self.drawer = Drawer(self.scenario, "sobol", replicates=1)
        self.reasons = time_dependence(self.scenario, shared)
        chosen = draws or (DRAWS_OF_MANY if self.reasons else DRAWS)
        self.count = chosen if self.drawer.groups else 1
        self.draws: list[Setup] = [self.drawer.draw(number) for number in range(self.count)]
        self._report = on_progress or (lambda done, total: None)
        self._grid: Grid | None = None
        self._angles, self._tolerance = angles or {}, tolerance

    def values(self) -> dict[str, FloatArray]:
        """Return the drawn values by key, shape (draws,); means over rollers and time."""
        rows = [{**draws.values, **draws.time_means} for draws in self.draws]
        return {key: np.array([float(np.mean(row[key])) for row in rows]) for key in rows[0]}

    def grow(self, wanted: Sequence[Wanted]) -> Trajectories:
        """Run the wear tests of a cylinder.

        Parameters
        ----------
        wanted : sequence of Wanted
            Sizes of the measured grooves.

        Returns
        -------
        Trajectories

        Raises
        ------
        SolverError
            If the tests of more than a twentieth of the draws fail; others are left out.
        """
        times = sorted({item.passes for item in wanted})
        # with one test for all K/H, a groove that was measured earlier needs a smaller one
        ends = [
            [
                self._factor_for(margin * size, item.passes)
                * (1.0 if self.reasons else item.passes / times[-1])
                for margin, size in ((BELOW, item.low), (ABOVE, item.high))
            ]
            for item in wanted
        ]
        start = np.max([high for _, high in ends], axis=0)
        span = float((start / np.min([low for low, _ in ends], axis=0)).max())
        least = (ABOVE / BELOW) ** 1.5  # also where rigid bodies do not wear
        return self._covered(times, start, max(span, least), wanted)

    def grow_on_cam(self, wanted: Sequence[Wanted]) -> Trajectories:
        """Run the wear tests of a cam; see `grow`.

        Parameters
        ----------
        wanted : sequence of Wanted
            Sizes of the measured grooves and changes of the lift.
        """
        times = sorted({item.passes for item in wanted})
        k, sizes = self._pilot(wanted, times[-1])
        # with one test for each K/H, a groove that was measured earlier needs a greater one
        part = np.array([item.passes / times[-1] if self.reasons else 1.0 for item in wanted])
        low, high = np.array([(item.low, item.high) for item in wanted]).T / sizes
        low, high = (
            k * depths**1.5 / part for depths in (BELOW / _ROOM * low, ABOVE * _ROOM * high)
        )
        cylinder, roller = factors(self.scenario)
        columns = self.drawer.columns(0, self.count)
        share = {ROLLER: np.full(self.count, roller)} if self.shared else {}
        expected = closed_form_depths(
            self.scenario, {**columns, CYLINDER: np.full(self.count, cylinder), **share}, self.count
        )
        usual = expected / expected[0] if expected[0] > 0.0 else np.full(self.count, np.nan)
        usual = np.where(np.isfinite(usual) & (usual > 0.0), usual, 1.0)
        start = high.max() * np.clip(usual, 0.1, 10.0) ** -1.5
        return self._covered(times, start, float(high.max() / low.min()), wanted)

    def _covered(
        self, times: Sequence[float], start: FloatArray, span: float, wanted: Sequence[Wanted]
    ) -> Trajectories:
        """Return the wear from the least to the greatest size of all that was measured.

        Where a draw wears less or more than was expected, all tests are run again.
        """
        before = np.inf
        for last in (False,) * _EXTENSIONS + (True,):
            grown, kept = self._grown_at(times, start, span)
            more, less = np.ones((2, len(kept)))
            for item in wanted:
                sizes = size_of(item.surface, grown.by_passes[item.passes].depth[item.surface])
                short = item.high / np.maximum(sizes[:, -1], 1e-3 * item.high)
                more = np.maximum(more, np.where(short > 1.0, (ABOVE * short) ** 1.5, 1.0))
                beyond = sizes[:, 0] / item.low
                less = np.maximum(less, np.where(beyond > 1.0, (beyond / BELOW) ** 1.5, 1.0))
            missing = float(max(more.max(), less.max()))
            if last or missing == 1.0 or missing > before / _GAIN:
                break
            before = missing
            start = start.copy()
            start[kept] *= np.minimum(more, _MOST_EXTENDED)
            span *= float(np.minimum(more, _MOST_EXTENDED).max() * less.max())
        return grown

    def _pilot(self, wanted: Sequence[Wanted], passes: float) -> tuple[float, FloatArray]:
        """Return a wear factor near the first draw, and the sizes that it wears [m]."""
        k = factors(self.scenario)[0]
        high = np.array([item.high for item in wanted])
        for number in range(_PILOTS):
            profiles = self._run([(0, k)], [passes], pilot=True)[1][0][0][0]
            sizes = np.array(
                [float(size_of(item.surface, profiles[item.surface])) for item in wanted]
            )
            if not (sizes > 0.0).all():
                where = wanted[int(sizes.argmin())].surface
                raise mistake_in(self.scenario.file, "the model does not wear there", key=where)
            ratio = float((high / sizes).max())
            if 1.0 / _NEAR < ratio < _NEAR or number == _PILOTS - 1:
                break
            k *= float(np.clip(ratio, 0.01, 100.0)) ** 1.5
        return k, sizes

    def _grown_at(
        self, times: Sequence[float], start: FloatArray, span: float
    ) -> tuple[Trajectories, list[int]]:
        """Return the wear up to a factor for each draw, and down to the part 1/span of it.

        The numbers of the draws without a failed test are returned too.
        """
        # interpolation between many tests is hidden by their scatter
        ratio = RATIO_OF_TESTS if self.reasons and self.count > _FEW else RATIO
        count = int(np.ceil(np.log(span) / np.log(ratio))) + 1
        scale = span ** (np.arange(count) / (count - 1) - 1.0)  # up to 1
        if self.reasons:
            kept, states = self._run(
                [(d, start[d] * s) for d in range(self.count) for s in scale], times
            )
            ln_k = np.log(start[kept])[:, None] + np.log(scale)
            by_passes = {
                item: self._grown(ln_k, [state[place] for state in states])
                for place, item in enumerate(times)
            }
        else:
            records = times[-1] * scale
            kept, states = self._run(list(enumerate(start)), records.tolist())
            ln_tau = np.log(start[kept])[:, None] + np.log(records)
            grown = self._grown(ln_tau, [item for state in states for item in state])
            # the energy belongs to the passes of a record, and grows as they do
            by_passes = {
                item: replace(
                    grown, ln_k=ln_tau - np.log(item), energy=grown.energy * (item / records)
                )
                for item in times
            }
        values = {key: column[kept] for key, column in self.values().items()}
        return Trajectories(values, self.reasons, by_passes, self.count - len(kept)), kept

    def _factor_for(self, depth: float, passes: float) -> FloatArray:
        """Return the wear factor with which each draw wears to a depth, for rigid bodies.

        That of the scenario for a draw of which rigid bodies do not wear.
        """
        cylinder, roller = factors(self.scenario)
        scenario = replace(self.scenario, operation=self._operation(passes))
        columns = self.drawer.columns(0, self.count)
        factor, before = np.full(self.count, cylinder), np.full(self.count, np.inf)
        for _ in range(8):  # a mounting spring slows the wear as the groove deepens, or ends it
            share = {ROLLER: factor * (roller / cylinder)} if self.shared else {}
            reached = closed_form_depths(
                scenario, {**columns, CYLINDER: factor, **share}, self.count
            )
            ended = (before < depth) & (reached < np.minimum(_GAIN * before, depth))
            worn, before = (reached > 0.0) & ~ended, reached
            ratio = np.where(worn, depth / np.where(worn, reached, 1.0), 1.0)
            factor = factor * np.clip(ratio, 0.1, 10.0) ** 1.5
        return factor

    def _operation(self, passes: float) -> Any:
        """Return the operation of the scenario up to some passes."""
        return self.scenario.operation.model_copy(
            update={"passes": max(1, round(passes)), "duration": None, "turns": None}
        )

    def _grown(self, ln_k: FloatArray, states: Sequence[tuple[Any, ...]]) -> Grown:
        assert self._grid is not None
        profiles, energies = zip(*states, strict=True)
        depth = {
            name: np.array([profile[name] for profile in profiles]).reshape(*ln_k.shape, -1)
            for name in profiles[0]
        }
        start = start_height(self.scenario, self._grid)
        return Grown(self._grid.y, start, ln_k, depth, np.array(energies).reshape(ln_k.shape))

    def _run(
        self, tests: Sequence[tuple[int, float]], passes: Sequence[float], pilot: bool = False
    ) -> tuple[list[int], list[list[tuple[dict[str, FloatArray], float]]]]:
        """Run tests, given by draw and wear factor.

        Returns the draws without a failed test, and profiles and energy at the passes for each of
        their tests.
        """
        cylinder, roller = factors(self.scenario)
        table = self._operation(passes[-1])
        ready: list[Setup] = []
        evolution = self.scenario.evolution
        if self.count > _FEW and evolution.tolerance < self._tolerance:
            evolution = evolution.model_copy(update={"tolerance": self._tolerance})
        for number, k in tests:
            draws = self.draws[number]
            of_roller = k * (roller / cylinder) if self.shared else factors(draws.scenario)[1]
            scenario = with_factors(draws.scenario, k, of_roller)
            scenario = replace(scenario, operation=table, evolution=evolution)
            ready.append(replace(draws, scenario=scenario))
        last = {number: place for place, (number, _) in enumerate(tests)}  # of the greatest wear
        setups = [ready[place] for place in last.values()]
        self._grid = grid = _covering([strips_of_run(setup) for setup in setups], setups)
        model = prepared_model(self.scenario, grid)

        def models(scenario: Scenario, strips: Grid) -> ContactModel:
            return model if strips is grid else prepared_model(scenario, strips)

        schedule = ListedPasses(0.0, 1.0, 1.0, tuple(passes))
        runs, results, views = [], {}, {}
        for number, draws in enumerate(ready):
            problem, stepper, _ = assemble_problem(draws, grid, models)
            runs.append(RealisationRun(number, {}, draws, problem, stepper))
            views[number] = view_of(draws.scenario, self._angles)
        failures, done = dict[int, Exception](), 0
        for group in batch_groups(runs):
            grown, failed = worn_at_records(group, schedule, grid, views)
            results.update(grown)
            failures.update(failed)
            done += len(group)
            if not pilot:
                self._report(done, len(runs))
        lost = {tests[number][0] for number in failures}
        if len(lost) > _MOST_LOST * self.count:
            raise SolverError(
                f"{len(failures)} of {len(runs)} wear tests failed; the first:"
                f" {failures[min(failures)]}"
            )
        kept = [number for number in range(self.count) if number not in lost]
        return kept, [results[n] for n, (draw, _) in enumerate(tests) if draw not in lost]


def _covering(grids: Sequence[Grid], setups: Sequence[Setup]) -> Grid:
    """Return strips of the median width that cover others and the predicted grooves."""
    low = min(grid.edges[0] for grid in grids)
    high = max(grid.edges[1] for grid in grids)
    middle, spacing = 0.5 * (low + high), float(np.median([grid.spacing for grid in grids]))
    half = max(abs(setup.centre - middle) + setup.final for setup in setups)
    extent = Grid.spanning(middle - 0.5 * spacing, middle + 0.5 * spacing, 1)
    return lattice(extent, max(half, 0.5 * (high - low)))
