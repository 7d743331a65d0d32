"""Wear tests that are stepped from fresh bodies to their end, and how far apart two ends are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wearsim.evolution.error_control.error_estimates import (
    DEPTHS,
    greatest_depth,
    total_worn_volume,
)
from wearsim.evolution.integrate import evolve
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, fresh_state
from wearsim.evolution.steppers.base import Stepper
from wearsim.scenario import Scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.run.assemble import assemble_problem, strips_of_run
from wearsim.studies.run.draws import draw
from wearsim.types import FloatArray, Grid
from wearsim_bench.contact.accuracy import l2


@dataclass(frozen=True)
class WearTest:
    """A shipped scenario, changed and shortened.

    Parameters
    ----------
    scenario : str
        Its name.
    minutes : float
        Simulated time.
    changes : mapping of str to object, optional
        Values by dotted key.
    """

    scenario: str
    minutes: float
    changes: Mapping[str, object] = field(default_factory=dict)

    def asked(self, changes: Mapping[str, object]) -> Scenario:
        """Return the scenario with further changes."""
        duration = {"operation.duration": f"{self.minutes!r} min"}
        return shipped_scenario(self.scenario, {**self.changes, **duration, **changes})

    def grid(self) -> Grid:
        """Return the strips that the test has by default."""
        return strips_of_run(draw(self.asked({})))


@dataclass(frozen=True)
class End:
    """The end of a wear test: its problem and its state there."""

    problem: WearProblem
    state: WearState

    def profiles_at(self, y: FloatArray) -> FloatArray:
        """Return the worn depths of all bodies at some positions [m], one after another."""
        own = self.problem.grid.y
        depths = [
            np.apply_along_axis(lambda worn: np.interp(y, own, worn), -1, getattr(self.state, name))
            for name in DEPTHS
        ]
        return np.concatenate([depth.ravel() for depth in depths])


class Ready:
    """A wear test of which all is built that does not count as stepping.

    Parameters
    ----------
    scenario : Scenario

    Attributes
    ----------
    problem : WearProblem
    stepper : Stepper
    name : str
        Of the stepper.
    stop : float
        Passes at the end of the test.
    """

    def __init__(self, scenario: Scenario) -> None:
        built: tuple[WearProblem, Stepper, str] = assemble_problem(scenario)
        self.problem, self.stepper, self.name = built
        self.stop, self._max_steps = float(scenario.total_passes), scenario.evolution.max_steps

    def stepped(self, passes: float) -> End:
        """Step from fresh bodies over some passes; nothing is recorded on the way."""
        state = fresh_state(self.problem)
        for advance in evolve(
            self.problem, state, self.stepper, passes, lambda _: np.inf, self._max_steps
        ):
            state = advance.end
        return End(self.problem, state)


def errors_of(found: End, exact: End) -> dict[str, float]:
    """Return how far the end of a test is from the exact one, relative.

    Parameters
    ----------
    found, exact : End
        On the same strips, or on finer ones, which are then compared where the first has its own.

    Returns
    -------
    dict of str to float
        Greatest `depth`, `profile` (L2, of all bodies) and worn `volume` (of all bodies).
    """
    y = found.problem.grid.y
    volumes = [total_worn_volume(end.problem, end.state) for end in (found, exact)]
    return {
        "depth": _apart(greatest_depth(found.state), greatest_depth(exact.state)),
        "profile": l2(found.profiles_at(y), exact.profiles_at(y)),
        "volume": _apart(*volumes),
    }


def _apart(found: FloatArray, exact: FloatArray) -> float:
    return float(np.abs(found / exact - 1.0).max())
