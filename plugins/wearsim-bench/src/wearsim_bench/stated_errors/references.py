"""Reference solutions of random tests, converged in steps and strips and kept in a folder."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from wearsim.atomic_write import os_errors_converted, replacement
from wearsim.errors import ContactError, ResultsFileError, SolverError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import DEPTHS, greatest_depth, volume_of
from wearsim.evolution.integrate import evolve
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Depths, WearState
from wearsim.evolution.steppers.base import Stepper
from wearsim.evolution.steppers.implicit import ImplicitStepper
from wearsim.evolution.steppers.per_pass import is_compiled
from wearsim.evolution.strips import same_strips
from wearsim.studies.run.draws import draw
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray, Grid
from wearsim_bench.stated_errors.observed import OBSERVED, observed_of
from wearsim_bench.stated_errors.random_tests import TRUE_TOLERANCE, RandomTest
from wearsim_bench.stated_errors.strata import FEW_PASSES
from wearsim_bench.stepping.groups import EVERY_PASS
from wearsim_bench.stepping.runs import PreparedTest

EACH_PASS = 2 * FEW_PASSES[1]  # passes up to which each one is solved, if the loop is compiled
LOOSE_FROM = 9  # contacts from which ten times the tolerance is taken
LONGEST_STEP = 0.02  # longest step over the passes done, so that error estimates miss nothing in it
#: strips per half-width of the fresh patch, and of a groove that is much wider, and the greatest
#: number for the contacts of a cylinder, of a cam with a few and with many contacts
PER_PATCH, PER_GROOVE = 72.0, 160.0
LEAST_STRIPS = 241  # for the contacts of a cylinder
MOST_STRIPS = ((3, 601), (8, 321), (10_000, 161))
PILOT_TOLERANCE, PILOT_STRIPS, WIDENED = 1e-2, 8.0, 1.6
MOST_PILOTS = 14
SECONDS = 300.0  # limit on the process time of a reference, which other work does not change
_FAILURE = "failure"  # name of the reason for which there is no reference
_OBSERVABLE = "observed_"  # prefix of the names of observables in files
_STEPS, _STRIPS = (EACH_PASS, LOOSE_FROM, LONGEST_STEP), (PER_PATCH, PER_GROOVE, LEAST_STRIPS)
SETTINGS = hashlib.sha256(repr((*_STEPS, *_STRIPS, MOST_STRIPS, OBSERVED)).encode()).hexdigest()[
    :4
]  # in the names of files, so that those of other settings are not read


@dataclass(frozen=True)
class Reference:
    """Worn profiles at the end of a test.

    Parameters
    ----------
    method : str
        How it was computed.
    seconds : float
        Process time of the computation [s].
    y : ndarray, shape (strips,)
        Position of the strips [m].
    cylinder_depth, roller_depth : ndarray
        Worn depths, shapes as in `WearState` [m].
    depth, volume : float
        Greatest depth of all bodies [m], and volume worn off all bodies [m^3].
    by_strips, by_steps : ndarray, shape (3,)
        Relative changes of depth, profile and volume with half the strips, and on those strips
        with ten times the tolerance and twice as long steps; steps are zero where each pass is
        solved.
    observed : mapping of str to ndarray
        Observables by name.
    """

    method: str
    seconds: float
    y: FloatArray
    cylinder_depth: FloatArray
    roller_depth: FloatArray
    depth: float
    volume: float
    by_strips: FloatArray
    by_steps: FloatArray
    observed: Mapping[str, FloatArray]

    @property
    def profiles(self) -> FloatArray:
        """Depths of all bodies, shape (bodies, strips) [m]."""
        return stacked(self.cylinder_depth, self.roller_depth)

    @property
    def arrays(self) -> dict[str, Any]:
        """The fields by name, and the observables by names with a prefix."""
        fields = {name: value for name, value in vars(self).items() if name != "observed"}
        return fields | {_OBSERVABLE + name: values for name, values in self.observed.items()}

    @staticmethod
    def from_arrays(arrays: Mapping[str, Any]) -> Reference:
        """Return the reference with these `arrays`."""
        names = [name for name in arrays if name.startswith(_OBSERVABLE)]
        fields = {name: value for name, value in arrays.items() if name not in names}
        observed = {name.removeprefix(_OBSERVABLE): arrays[name] for name in names}
        return Reference(**fields, observed=observed)


@dataclass(frozen=True)
class Worn:
    """Depths of all bodies at the end of a test.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Position of the strips [m].
    profiles : ndarray, shape (bodies, strips)
        Worn depths [m].
    depth, volume : float
        Greatest depth [m] and volume of all bodies [m^3].
    """

    y: FloatArray
    profiles: FloatArray
    depth: float
    volume: float

    def changes_from(self, exact: Worn | Reference) -> FloatArray:
        """Return the relative errors of depth, profile and volume, shape (3,).

        Profiles are compared on the strips of this object, in the L2 norm over all bodies; the
        errors of depth and volume have a sign.
        """
        true = np.array([np.interp(self.y, exact.y, profile) for profile in exact.profiles])
        weights = np.gradient(self.y)
        norm, difference = (
            float(np.sqrt((weights * part**2).sum())) for part in (true, self.profiles - true)
        )
        depth, volume = self.depth / exact.depth - 1.0, self.volume / exact.volume - 1.0
        return np.array([depth, difference / norm, volume])


def stacked(cylinder: FloatArray, roller: FloatArray) -> FloatArray:
    """Return the depths of cylinder and rollers, strips last, as rows."""
    return np.concatenate([part.reshape(-1, part.shape[-1]) for part in (cylinder, roller)])


class CappedStepper(ImplicitStepper):
    """Implicit stepper whose steps are at most a part of the passes done.

    Parameters
    ----------
    tolerance, by_doubling
        As of `ImplicitStepper`.
    longest : float
        Greatest ratio of a step to the passes done; a first step is a single pass or less.
    """

    def __init__(self, tolerance: float, longest: float, by_doubling: bool | None) -> None:
        super().__init__(tolerance, by_doubling=by_doubling)
        self.longest = longest

    def proposed(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the step proposed by the error control, at most the longest one."""
        proposed = super().proposed(problem, state)
        return np.minimum(proposed, self.longest * np.maximum(state.passes, 1.0 / self.longest))


def worn_at_end(
    test: RandomTest,
    grid: Grid,
    tolerance: float,
    longest: float = np.inf,
    *,
    until: float = np.inf,
    grows: bool = False,
    keeps_edges: bool = False,
) -> tuple[str, Stepper, WearProblem, WearState]:
    """Return method, stepper, problem and final state of a test on given strips.

    Parameters
    ----------
    test : RandomTest
        The test.
    grid : Grid
        The strips.
    tolerance : float
        Tolerance of the steps; tests with few passes are solved pass by pass.
    longest : float
        Greatest ratio of an implicit step to the passes done.
    until : float
        Process time by which it must be done [s], see `time_limit`.
    grows : bool
        Whether the strips grow with the groove, from the given ones.
    keeps_edges : bool
        Whether steps are taken instead of single passes where they resolve the edges of contacts
        within a strip, which single passes do not: that is a difference by strips.

    Raises
    ------
    SolverError
        If it cannot be computed, or not in time.
    """
    prepared = PreparedTest(test.scenario(evolution__tolerance=tolerance), grid)
    stepper, method = prepared.stepper, f"{prepared.name}, {tolerance:g}"
    if np.isfinite(longest):
        pass_by_pass = PreparedTest(test.scenario(evolution__stepper=EVERY_PASS), grid)
        most_passes = EACH_PASS if is_compiled(pass_by_pass.problem) else FEW_PASSES[1]
        single = prepared.stop <= most_passes
        if single and keeps_edges:
            started = stepper.started(prepared.problem, fresh_state(prepared.problem))
            single = started.separation is None
        if single:
            prepared, stepper, method = pass_by_pass, pass_by_pass.stepper, EVERY_PASS
        elif isinstance(stepper, ImplicitStepper):
            # with the same treatment of strips at the edge of a contact
            stepper = CappedStepper(tolerance, longest, stepper.by_doubling)
    problem = prepared.problem if grows else replace(prepared.problem, growth=())
    state = fresh_state(problem)
    max_steps = test.scenario().evolution.max_steps
    for advance in evolve(problem, state, stepper, prepared.stop, lambda _: np.inf, 10 * max_steps):
        state, final = advance.end, advance.problem
        if time.process_time() > until:
            raise SolverError(f"the reference takes longer than {SECONDS:g} s")
    return method, stepper, final, state


def time_limit() -> float:
    """Return the process time by which a reference that begins now must be done [s]."""
    return time.process_time() + SECONDS


def worn_of(problem: WearProblem, state: WearState) -> Worn:
    """Return the depths of a final state."""
    depth, volume = greatest_depth(state.depths)[0], volume_of(problem, state.depths)[0]
    return Worn(
        problem.grid.y, stacked(*at_all_stations(problem, state)), float(depth), float(volume)
    )


def at_all_stations(problem: WearProblem, state: WearState) -> Depths:
    """Return the depths of cylinder and rollers; those of a cam at all of its stations."""
    cylinder, roller = state.depths
    return problem.kinematics.track.at_unworn(cylinder), roller


def final_grid(test: RandomTest, until: float) -> tuple[Grid, float, float]:
    """Return coarse strips over the final groove, and the half-widths of fresh patch and groove.

    The groove is that of a run at a loose tolerance; its strips are widened until the outermost
    ones are not worn.
    """
    scenario = test.scenario()
    means = Setup(scenario)
    load = means.load_range(scenario.total_time)[1]
    load += draw(scenario).range_of("normal_force_offset")[1]
    patch, centre = means.widest_patch(load).b, means.centre
    shift = float(np.abs(means.positions - centre).max())
    half, reason = shift + 1.5 * patch, "the groove is wider than all strips"
    for _ in range(MOST_PILOTS):
        strips = 2 * int(np.ceil(min(PILOT_STRIPS * half / patch, 90.0))) + 1
        grid = Grid.spanning(centre - half, centre + half, strips)
        half *= WIDENED
        try:
            *_, state = worn_at_end(test, grid, PILOT_TOLERANCE, until=until)
        except ContactError as error:  # the contact is wider than the strips
            reason = str(error)
            continue
        worn = np.flatnonzero((stacked(*state.depths) > 0.0).any(axis=0))
        if worn.size and worn[0] > 1 and worn[-1] < strips - 2:
            reach = float(np.abs(grid.y[worn] - centre).max()) + 2.0 * grid.spacing
            reach = min(1.04 * reach, half / WIDENED)
            return Grid.spanning(centre - reach, centre + reach, strips), patch, reach - shift
    raise SolverError(reason)


def fine_grid(coarse: Grid, patch: float, groove: float, contacts: int) -> Grid:
    """Return strips that resolve the fresh patch, and the final groove where it is much wider."""
    width = coarse.edges[1] - coarse.edges[0]
    spacing = max(patch / PER_PATCH, groove / PER_GROOVE)
    most = next(strips for number, strips in MOST_STRIPS if contacts <= number)
    least = LEAST_STRIPS if contacts <= MOST_STRIPS[0][0] else 0
    strips = min(max(int(np.ceil(width / spacing)), least), most)
    return Grid.spanning(*coarse.edges, strips + (strips + 1) % 2)


def reference_of(test: RandomTest, folder: Path | None) -> Reference:
    """Return the reference of a test from the folder, or compute it and keep it there.

    Parameters
    ----------
    test : RandomTest
        The test.
    folder : Path, optional
        Folder of the references; None to keep none.

    Raises
    ------
    SolverError
        If the test cannot be computed.
    ResultsFileError
        If the file cannot be read or written.
    """
    path = None if folder is None else folder / f"{test.name}-{test.digest}-{SETTINGS}.npz"
    return Reference.from_arrays(kept(path, lambda: computed_reference(test).arrays))


def kept(path: Path | None, compute: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Return the arrays of a file, or compute and write them; a failure is written too."""
    if path is not None and path.exists():
        try:
            with np.load(path) as arrays:
                stored = {name: arrays[name][()] for name in arrays}
        except (OSError, ValueError, TypeError, EOFError, BadZipFile) as error:
            raise ResultsFileError(f"{path}: is not a reference solution; delete it") from error
        if _FAILURE in stored:
            raise SolverError(f"{stored[_FAILURE]} (kept in {path.name})")
        return stored
    failure: SolverError | None = None
    try:
        computed = compute()
    except SolverError as error:
        failure, computed = error, {_FAILURE: error.message}
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        with os_errors_converted(path), replacement(path) as file:
            np.savez(file, **computed)
    if failure is not None:
        raise failure
    return computed


def computed_reference(test: RandomTest) -> Reference:
    """Return the reference of a test.

    Every pass is solved individually where they are few; otherwise implicit steps are taken at a
    low tolerance, none longer than a part of the passes done.
    """
    until = time_limit()
    coarse, patch, groove = final_grid(test, until)
    contacts = PreparedTest(test.scenario(), coarse).problem.shape
    grid = fine_grid(coarse, patch, groove, contacts[0] * contacts[1])
    tolerance = TRUE_TOLERANCE * (10.0 if contacts[0] * contacts[1] >= LOOSE_FROM else 1.0)
    half = Grid.spanning(*grid.edges, grid.strips // 2 + (grid.strips // 2 + 1) % 2)
    method, stepper, problem, end = worn_at_end(test, grid, tolerance, LONGEST_STEP, until=until)
    fine = worn_of(problem, end)
    halved = worn_of(*worn_at_end(test, half, tolerance, LONGEST_STEP, until=until)[2:])
    by_steps = np.zeros(3)
    if method != EVERY_PASS:
        loose = worn_at_end(test, half, 10.0 * tolerance, 2.0 * LONGEST_STEP, until=until)[2:]
        by_steps = worn_of(*loose).changes_from(halved)
    depths = dict(zip(DEPTHS, at_all_stations(problem, end), strict=True))
    return Reference(
        method=method,
        seconds=time.process_time() - until + SECONDS,
        y=grid.y,
        **depths,
        depth=fine.depth,
        volume=fine.volume,
        by_strips=halved.changes_from(fine),
        by_steps=by_steps,
        observed=observed_of(stepper, problem, end, test.scenario().outputs.width_threshold),
    )


def on_strips(test: RandomTest, start: Grid, end: Grid, folder: Path | None) -> Worn:
    """Return the end of a test on the strips of a run, without stepping error.

    Parameters
    ----------
    test : RandomTest
        The test.
    start, end : Grid
        Strips at the start and end of the run; they grow if these differ.
    folder : Path, optional
        Folder of the references.
    """
    sizes = [value for grid in (start, end) for value in (*grid.edges, grid.strips)]
    shape = hashlib.sha256(np.array(sizes).tobytes()).hexdigest()[:8]
    path = None if folder is None else folder / f"{test.name}-{test.digest}-{SETTINGS}-{shape}.npz"

    def compute() -> dict[str, Any]:
        grows = not same_strips(start, end)
        steps = TRUE_TOLERANCE, LONGEST_STEP
        *_, problem, state = worn_at_end(
            test, start, *steps, until=time_limit(), grows=grows, keeps_edges=True
        )
        return vars(worn_of(problem, state))

    return Worn(**kept(path, compute))
