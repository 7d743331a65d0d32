"""Wear as a stiff differential equation for general-purpose solvers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import DEPTHS
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.single_step import (
    present_problem,
    recovery_at,
    solve_at_present_loads,
    worn_depths,
)
from wearsim.types import FloatArray

Solver = Literal["BDF", "LSODA"]
SOLVERS: tuple[Solver, ...] = ("BDF", "LSODA")
MOST_SOLVES = 20_000  # limit on contact solves, several times the largest number required
_SMALL = 1e-4  # increment of finite differences, relative to the approach


class _Rates:
    """Wear per pass as a function of the depths, both scaled by the approach of fresh contacts.

    Bodies without wear are omitted. Contacts are warm-started from the last solution.

    Parameters
    ----------
    problem : WearProblem
        A problem without load terms, which have separate states.
    most : int
        Largest number of contact solves.
    """

    def __init__(self, problem: WearProblem, most: int) -> None:
        self.problem, self.state, self.most = problem, fresh_state(problem), most
        self.solves = int(self.state.solves[0])
        self.elastic: FloatArray | None = None
        self.length = float(problem.values_of(self.state.contacts, "approach").max())
        rates = self._wear()
        self.bodies = [name for name in DEPTHS if rates[name].any()]

    def _wear(self) -> dict[str, FloatArray]:
        present = present_problem(self.problem, self.state)
        return dict(zip(DEPTHS, worn_depths(present, self.state.contacts, 1.0), strict=True))

    def start(self) -> FloatArray:
        """Return the depths of fresh bodies."""
        return self._joined({name: getattr(self.state, name) for name in DEPTHS})

    def state_at(self, passes: float, depths: FloatArray) -> WearState:
        """Return the state with these depths and the contacts solved last."""
        values: dict[str, Any] = {}
        first = 0
        for name in self.bodies:
            shape = getattr(self.state, name).shape
            last = first + int(np.prod(shape))
            values[name] = self.length * depths[first:last].reshape(shape)
            first = last
        return replace(self.state, passes=np.array([passes]), **values)

    def __call__(self, passes: float, depths: FloatArray) -> FloatArray:
        """Return the wear per pass at these depths and number of passes.

        Raises
        ------
        StepError
            If the number of contact solves exceeds the limit.
        """
        if self.solves >= self.most:
            raise StepError(
                f"the solver requires more than {self.most} contact solves", {"passes": passes}
            )
        state = self.state_at(passes, depths)
        contacts, _, solves = solve_at_present_loads(self.problem, state, self.elastic)
        self.state = replace(state, contacts=contacts)
        self.elastic, _ = recovery_at(self.problem, self.state)
        self.solves += solves * len(contacts)
        return self._joined(self._wear())

    def jacobian(self, passes: float, depths: FloatArray) -> FloatArray:
        """Return the Jacobian of the wear per pass; its columns without wear are zero.

        The finite differences of the solvers would increase the change of a depth that has no
        effect until a single strip carries the load.
        """
        rate = self(passes, depths)
        jacobian = np.zeros((len(depths), len(depths)))
        for strip in np.flatnonzero(rate):
            changed = depths.copy()
            changed[strip] += _SMALL
            jacobian[:, strip] = (self(passes, changed) - rate) / _SMALL
        return jacobian

    def _joined(self, depths: dict[str, FloatArray]) -> FloatArray:
        joined: FloatArray = np.concatenate([depths[name].ravel() for name in self.bodies])
        return joined / self.length


def solved_by(
    solver: Solver, problem: WearProblem, passes: float, tolerance: float, most: int = MOST_SOLVES
) -> WearState:
    """Return the state after a number of passes, computed by a solver of scipy.

    Parameters
    ----------
    solver : {"BDF", "LSODA"}
        The solver.
    problem : WearProblem
        A problem without load terms.
    passes : float
        Number of passes from fresh bodies.
    tolerance : float
        Relative tolerance of each step, and absolute tolerance relative to the fresh approach.
    most : int
        Largest number of contact solves.

    Returns
    -------
    WearState
        State with depths and number of contact solves; `contacts` are those solved last, `energy`
        is not set.

    Raises
    ------
    StepError
        If the solver fails, or the number of contact solves exceeds the limit.
    ContactError
        If a contact has no solution.
    """
    from scipy.integrate import solve_ivp  # noqa: PLC0415  (slow to import)

    rates = _Rates(problem, most)
    options: dict[str, Any] = {"rtol": tolerance, "atol": tolerance, "jac": rates.jacobian}
    options["t_eval"] = [passes]
    solution = solve_ivp(rates, (0.0, passes), rates.start(), solver, **options)
    if not solution.success:
        raise StepError(f"{solver} failed: {solution.message}", {"passes": solution.t})
    end = rates.state_at(passes, solution.y[:, -1])
    return replace(end, solves=np.array([rates.solves]), steps=np.array([0]))
