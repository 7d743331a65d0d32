"""Wear tests stepped from fresh bodies, and differences of their final states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import (
    DEPTHS,
    greatest_depth,
    volume_of,
)
from wearsim.evolution.integrate import evolve
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Stepper
from wearsim.scenario import Scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import strips_of_run
from wearsim.types import FloatArray, Grid
from wearsim_bench.contact.accuracy import l2


@dataclass(frozen=True)
class WearTest:
    """A shipped scenario, changed and shortened.

    Parameters
    ----------
    scenario : str
        Name of the scenario.
    minutes : float
        Simulated time [min].
    changes : mapping of str to object, optional
        Changed values by dotted key.
    """

    scenario: str
    minutes: float
    changes: Mapping[str, object] = field(default_factory=dict)

    def scenario_with(self, changes: Mapping[str, object]) -> Scenario:
        """Return the scenario with further changes."""
        duration = {"operation.duration": f"{self.minutes!r} min"}
        return shipped_scenario(self.scenario, {**self.changes, **duration, **changes})

    def grid(self) -> Grid:
        """Return the default strips of the test."""
        return strips_of_run(draw(self.scenario_with({})))


@dataclass(frozen=True)
class EndState:
    """Wear problem and final state of a test."""

    problem: WearProblem
    state: WearState

    def profiles_at(self, y: FloatArray) -> FloatArray:
        """Return the worn depths of all bodies at positions y [m], concatenated."""
        grid = self.problem.grid.y
        depths = [
            np.apply_along_axis(
                lambda worn: np.interp(y, grid, worn), -1, getattr(self.state, name)
            )
            for name in DEPTHS
        ]
        return np.concatenate([depth.ravel() for depth in depths])


class PreparedTest:
    """A wear test prepared for stepping.

    Parameters
    ----------
    scenario : Scenario
        Scenario of the test.
    grid : Grid, optional
        Strips, by default those of the scenario.

    Attributes
    ----------
    problem : WearProblem
        The wear problem.
    stepper : Stepper
        Its stepper.
    name : str
        Name of the stepper.
    stop : float
        Number of passes of the test.
    """

    def __init__(self, scenario: Scenario, grid: Grid | None = None) -> None:
        built: tuple[WearProblem, Stepper, str] = assemble_problem(draw(scenario), grid)
        self.problem, self.stepper, self.name = built
        self.stop, self._max_steps = float(scenario.total_passes), scenario.evolution.max_steps

    def stepped(self, passes: float) -> EndState:
        """Step from fresh bodies over a number of passes, without records."""
        problem, state = self.problem, fresh_state(self.problem)
        for advance in evolve(
            self.problem, state, self.stepper, passes, lambda _: np.inf, self._max_steps
        ):
            problem, state = advance.problem, advance.end  # the strips grow with the groove
        return EndState(problem, state)


def errors_of(approximate: EndState, exact: EndState) -> dict[str, float]:
    """Return the relative errors of a final state.

    Parameters
    ----------
    approximate, exact : EndState
        Final states; profiles are compared on the strips of `approximate`.

    Returns
    -------
    dict of str to float
        Errors of the largest `depth`, the `profile` (L2 over all bodies) and the worn `volume`.
    """
    y = approximate.problem.grid.y
    volumes = [volume_of(end.problem, end.state.depths) for end in (approximate, exact)]
    return {
        "depth": _relative_difference(
            greatest_depth(approximate.state.depths), greatest_depth(exact.state.depths)
        ),
        "profile": l2(approximate.profiles_at(y), exact.profiles_at(y)),
        "volume": _relative_difference(*volumes),
    }


def _relative_difference(value: FloatArray, exact: FloatArray) -> float:
    return float(np.abs(value / exact - 1.0).max())
