"""Reference solutions of random tests, kept in a folder."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.evolution.error_estimates import DEPTHS
from wearsim.evolution.steppers.per_pass import is_compiled
from wearsim.results.io.atomic_write import os_errors_converted, replacement
from wearsim.types import FloatArray, Grid
from wearsim_bench.stated_errors.random_tests import SLOW_PASSES, RandomTest
from wearsim_bench.stepping.groups import CONVERGED, EVERY_PASS
from wearsim_bench.stepping.runs import EndState, PreparedTest
from wearsim_bench.stepping.solvers import solved_by


@dataclass(frozen=True)
class Reference:
    """Worn profiles at the end of a test, without stepping error.

    Parameters
    ----------
    method : str
        How it was computed.
    seconds : float
        Time of the computation [s].
    y : ndarray, shape (strips,)
        Position of the strips [m].
    cylinder_depth, roller_depth : ndarray
        Worn depths, shapes as in `WearState` [m].
    """

    method: str
    seconds: float
    y: FloatArray
    cylinder_depth: FloatArray
    roller_depth: FloatArray

    @property
    def grid(self) -> Grid:
        """The strips."""
        return Grid(self.y, float(self.y[1] - self.y[0]))

    def as_end_of(self, end: EndState) -> EndState:
        """Return the final state `end` with the profiles of the reference."""
        depths = {name: getattr(self, name) for name in DEPTHS}
        return EndState(end.problem, end.state.replaced(**depths))


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
    path = None if folder is None else folder / f"{test.name}-{test.digest}.npz"
    if path is not None and path.exists():
        try:
            with np.load(path) as arrays:
                return Reference(**{name: arrays[name][()] for name in arrays})
        except (OSError, ValueError, TypeError, EOFError, BadZipFile) as error:
            raise ResultsFileError(f"{path}: is not a reference solution; delete it") from error
    reference = computed_reference(test)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        with os_errors_converted(path), replacement(path) as file:
            np.savez(file, **vars(reference))
    return reference


def computed_reference(test: RandomTest) -> Reference:
    """Return the reference of a test.

    Every pass is solved individually where the loop over passes is compiled or the test has few
    passes; otherwise LSODA integrates the wear per pass.
    """
    start = time.perf_counter()
    prepared = PreparedTest(test.scenario(evolution__stepper=EVERY_PASS))
    if is_compiled(prepared.problem) or prepared.stop <= SLOW_PASSES[1]:
        method, end = EVERY_PASS, prepared.stepped(prepared.stop).state
    else:
        method = f"LSODA, {CONVERGED:g}"
        end = solved_by("LSODA", prepared.problem, prepared.stop, CONVERGED)
    seconds = time.perf_counter() - start
    y = prepared.problem.grid.y
    return Reference(method, seconds, y, end.cylinder_depth, end.roller_depth)
