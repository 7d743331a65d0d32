"""Wear as a stiff differential equation, for solvers that know nothing of contacts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.error_control.error_estimates import DEPTHS
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, fresh_state
from wearsim.evolution.steppers.single_step import present_loads, present_problem, solve_present
from wearsim.evolution.steppers.wear_increment import WearIncrement
from wearsim.types import FloatArray

Solver = Literal["BDF", "LSODA"]
SOLVERS: tuple[Solver, ...] = ("BDF", "LSODA")
MOST_SOLVES = 20_000  # of contacts, after which a solver is stopped: several times what any needs
_SMALL = 1e-4  # of the approach: how much a profile is changed to see the wear change


class _Rates:
    """The wear per pass of the worn depths, both over the approach of the fresh contacts.

    Bodies that do not wear are left out. Contacts start at the last ones solved.

    Parameters
    ----------
    problem : WearProblem
        Without terms of the load, which have a state of their own.
    most : int
        Contacts that are solved at most.
    """

    def __init__(self, problem: WearProblem, most: int) -> None:
        self.problem, self.state, self.most = problem, fresh_state(problem), most
        self.solves = self.state.solves
        self.length = float(problem.values_of(self.state.contacts, "approach").max())
        rates = self._wear()
        self.bodies = [name for name in DEPTHS if rates[name].any()]

    def _wear(self) -> dict[str, FloatArray]:
        wear = WearIncrement(present_problem(self.problem, self.state), self.state.contacts, 1.0)
        return dict(zip(DEPTHS, (wear.cylinder, wear.roller), strict=True))

    def start(self) -> FloatArray:
        """Return the depths of fresh bodies."""
        return self._joined({name: getattr(self.state, name) for name in DEPTHS})

    def state_at(self, passes: float, depths: FloatArray) -> WearState:
        """Return the test at some depths, its contacts those last solved."""
        values: dict[str, Any] = {}
        first = 0
        for name in self.bodies:
            shape = getattr(self.state, name).shape
            last = first + int(np.prod(shape))
            values[name] = self.length * depths[first:last].reshape(shape)
            first = last
        return self.state.advanced_to(passes, **values)

    def __call__(self, passes: float, depths: FloatArray) -> FloatArray:
        """Return the wear per pass at some depths, after some passes.

        Raises
        ------
        StepError
            If it has been asked for too many times.
        """
        if self.solves >= self.most:
            raise StepError(
                f"the solver asked for more than {self.most} contacts", {"passes": passes}
            )
        state = self.state_at(passes, depths)
        contacts = solve_present(self.problem, state, present_loads(self.problem, state))
        self.state = replace(state, contacts=contacts)
        self.solves += len(contacts)
        return self._joined(self._wear())

    def jacobian(self, passes: float, depths: FloatArray) -> FloatArray:
        """Return how the wear per pass answers to every depth; none does where nothing wears.

        The solver's own differences change a depth that has no effect more and more, until a
        single strip carries the contact.
        """
        rate = self(passes, depths)
        found = np.zeros((len(depths), len(depths)))
        for strip in np.flatnonzero(rate):
            changed = depths.copy()
            changed[strip] += _SMALL
            found[:, strip] = (self(passes, changed) - rate) / _SMALL
        return found

    def _joined(self, depths: dict[str, FloatArray]) -> FloatArray:
        joined: FloatArray = np.concatenate([depths[name].ravel() for name in self.bodies])
        return joined / self.length


def solved_by(
    solver: Solver, problem: WearProblem, passes: float, tolerance: float, most: int = MOST_SOLVES
) -> WearState:
    """Return the test after some passes, stepped by a solver of scipy's.

    Parameters
    ----------
    solver : {"BDF", "LSODA"}
    problem : WearProblem
        Without terms of the load.
    passes : float
        From fresh bodies.
    tolerance : float
        Of each of the solver's steps, relative, and absolute as a part of the fresh approach.
    most : int
        Contacts that are solved at most.

    Returns
    -------
    WearState
        Depths, and contact solves; `contacts` are those that were solved last, `energy` is not
        known.

    Raises
    ------
    StepError
        If the solver gives up, or asks for too many contacts.
    ContactError
        If it asks for a contact that has no solution.
    """
    from scipy.integrate import solve_ivp  # noqa: PLC0415  (slow to import)

    rates = _Rates(problem, most)
    options: dict[str, Any] = {"rtol": tolerance, "atol": tolerance, "jac": rates.jacobian}
    options["t_eval"] = [passes]
    found = solve_ivp(rates, (0.0, passes), rates.start(), solver, **options)
    if not found.success:
        raise StepError(f"{solver} gave up: {found.message}", {"passes": found.t})
    end = rates.state_at(passes, found.y[:, -1])
    return replace(end, solves=rates.solves, steps=0)
