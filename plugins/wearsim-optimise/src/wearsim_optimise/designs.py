"""Designs of an optimisation: evaluated in rounds, kept in order, and read again after a kill."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from wearsim import Scenario
from wearsim.errors import Interrupted
from wearsim_optimise.evaluation import CHEAP, Evaluation, Limits
from wearsim_optimise.goals import TIGHTER, Goals
from wearsim_optimise.solvers import Answer, violation
from wearsim_optimise.variables import Variable, Vector, numbers_at, overrides, places_of

Results = Callable[[Evaluation, Any], Any]


@dataclass(frozen=True)
class Design:
    """A design with its outcome.

    Parameters
    ----------
    number : int
        From 1, in the order in which designs were asked for.
    numbers : tuple of float
        Values of the variables, in their units.
    purpose : str
        Why it was evaluated: "start", "search", "then", "front", "sensitivity", "tolerance",
        "confirmation" or "feasibility".
    outcome : mapping
        Status, reason, values, margins and seconds of `Evaluation`.
    key : str
        Text that identifies it.
    loss, slacks
        Numbers for the search; the loss is NaN if the objective is not known.
    """

    number: int
    numbers: tuple[float, ...]
    purpose: str
    outcome: Mapping[str, Any]
    key: str = ""
    loss: float = math.nan
    losses: tuple[float, ...] = ()
    slacks: Vector = field(default_factory=lambda: np.zeros(0))

    @property
    def status(self) -> str:
        """Status: evaluated, before wear, infeasible or failed."""
        return str(self.outcome["status"])

    @property
    def values(self) -> Mapping[str, float]:
        """Quantities that are asked for, in SI."""
        values: Mapping[str, float] = self.outcome["values"]
        return values

    @property
    def is_searched(self) -> bool:
        """Whether it is a design of the search; others are evaluated after the search."""
        return self.purpose in {"start", "search", "then", "front"}

    @property
    def counts(self) -> bool:
        """Whether it counts against the budget: a wear test was run for it, or was not needed."""
        return self.is_searched and self.status in {"evaluated", "failed"}

    @property
    def is_evaluated(self) -> bool:
        """Whether all quantities are known."""
        known = bool(self.losses) and all(map(math.isfinite, self.losses))
        return self.status == "evaluated" and known

    @property
    def is_feasible(self) -> bool:
        """Whether all quantities are known and within their limits."""
        return self.is_evaluated and violation(self) == 0.0


def with_goals(design: Design, goals: Goals | None) -> Design:
    """Return a design with its losses and slacks."""
    if goals is None or "gain" in design.outcome:
        return design
    losses = tuple(
        math.nan
        if design.status == "failed"
        else goals.loss(number, design.values.get(name, math.nan))
        for number, (name, _) in enumerate(goals.objectives)
    )
    slacks = np.array(goals.slacks(design.values, design.outcome["margins"]))
    return replace(design, loss=losses[0], losses=losses, slacks=slacks)


def key_of(job: Mapping[str, Any]) -> str:
    """Return a text that identifies a job."""
    return repr(sorted((name, repr(value)) for name, value in job.items()))


class Designs:
    """All designs of an optimisation.

    Parameters
    ----------
    scenario : Scenario
    variables : sequence of Variable
    names : sequence of str
        Quantities that are asked for.
    realisations : int
    most : str, optional
        Greatest life.
    known : mapping of str to mapping
        Outcomes by the text of their job, from a file.
    pool : Executor
        Evaluates jobs.
    on_outcome : callable
        Called after each new outcome with the text of its job and the outcome.
    stop_requested : callable, optional
    """

    def __init__(
        self,
        scenario: Scenario,
        variables: Sequence[Variable],
        names: Sequence[str],
        *,
        realisations: int,
        most: str | None,
        known: Mapping[str, Mapping[str, Any]],
        pool: Any,
        on_outcome: Callable[[str, Mapping[str, Any]], None],
        stop_requested: Callable[[], bool] | None,
    ) -> None:
        self.scenario, self.variables, self.names = scenario, variables, tuple(names)
        self.realisations, self.most = realisations, most
        self.known = dict(known)
        self._pool, self._on_outcome, self._stop = pool, on_outcome, stop_requested
        self.goals: Goals | None = None
        self.limits: Limits = {}
        self.all: list[Design] = []
        self._by_key: dict[str, int] = {}

    @property
    def evaluated(self) -> list[Design]:
        """Designs of which all quantities are known."""
        return [design for design in self.all if design.is_evaluated]

    @property
    def runs(self) -> int:
        """Number of designs that count against the budget of the search."""
        return sum(design.counts for design in self.all)

    def use(self, goals: Goals) -> None:
        """Apply goals to all designs; designs that violate limits before wear are not run."""
        self.goals = goals
        cheap = [c for c in goals.constraints if goals.named[c.name]["verb"] in CHEAP]
        self.limits = {item.name: (item.sign, goals.limit(item)) for item in cheap}
        self.all = [with_goals(design, goals) for design in self.all]

    def at(self, places: Sequence[Vector], purpose: str, **more: Any) -> list[Design]:
        """Return designs at places of the unit cube; evaluate those that are not known."""
        numbers = [numbers_at(self.variables, place) for place in places]
        return self.with_numbers(numbers, purpose, **more)

    def with_numbers(
        self, numbers: Sequence[tuple[float, ...]], purpose: str, **more: Any
    ) -> list[Design]:
        """Return designs with values of the variables; evaluate those that are not known."""
        jobs = [{"overrides": overrides(self.variables, chosen), **more} for chosen in numbers]
        return self.evaluate(jobs, numbers, purpose)

    def evaluate(
        self, jobs: Sequence[Mapping[str, Any]], numbers: Sequence[tuple[float, ...]], purpose: str
    ) -> list[Design]:
        """Return the designs of jobs; evaluate those that are not known.

        Raises
        ------
        Interrupted
            If a stop was requested; all outcomes so far are kept.
        """
        keys = [key_of(job) for job in jobs]
        missing = [n for n, key in enumerate(keys) if key not in self.known]
        missing = [n for n in missing if keys.index(keys[n]) == n]
        if missing:
            self._run([jobs[n] for n in missing], [keys[n] for n in missing])
        designs = []
        for key, chosen in zip(keys, numbers, strict=True):
            if key not in self._by_key:
                self._by_key[key] = len(self.all)
                outcome = self.known[key]
                design = Design(len(self.all) + 1, tuple(chosen), purpose, outcome, key)
                self.all.append(with_goals(design, self.goals))
            designs.append(self.all[self._by_key[key]])
        return designs

    def _run(self, jobs: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> None:
        if self._stop is not None and self._stop():
            raise Interrupted("stopped before the next designs")
        named = self.goals.named if self.goals else {}
        work = Evaluation(
            self.scenario,
            tuple(jobs),
            self.names,
            named,
            self.limits,
            self.realisations,
            self.most,
        )
        for numbers, outcomes in self._pool.results(work, iter([[n] for n in range(len(jobs))])):
            for number, outcome in zip(numbers, outcomes, strict=True):
                self.known[keys[number]] = outcome
                self._on_outcome(keys[number], outcome)
            if self._stop is not None and self._stop():
                raise Interrupted("stopped; all designs so far are kept")

    def places(self, design: Design) -> Vector:
        """Return the places of a design in the unit cube."""
        return places_of(self.variables, design.numbers)


def completed(designs: Designs, chosen: Design, loss: Callable[[Design], float]) -> Answer:
    """Return loss and slacks of a design, those that are not known from similar designs.

    A design that violates a limit before wear by far is not run, and one that fails has no values.
    Values interpolated smoothly from the evaluated designs replace them, so that the models of the
    search remain valid.

    Parameters
    ----------
    designs : Designs
    chosen : Design
    loss : callable
        Loss of a design; not a number where it is not known.
    """
    values = np.concatenate([[loss(chosen)], chosen.slacks])
    missing = ~np.isfinite(values)
    if missing.any():
        evaluated = [design for design in designs.evaluated if math.isfinite(loss(design))]
        if evaluated:
            place = designs.places(chosen)
            places = np.array([designs.places(design) for design in evaluated])
            rows = np.array([np.concatenate([[loss(d)], d.slacks]) for d in evaluated])
            values[missing] = _interpolated(places, rows[:, missing], place)
            if chosen.status == "failed":  # a great loss leads the search away from it
                values[0] = max(float(rows[:, 0].max()), values[0]) + 0.1
        values[~np.isfinite(values)] = 1.0
    slacks = values[1:]
    return Answer(float(values[0]), slacks - TIGHTER if len(slacks) else slacks)


def _interpolated(places: Vector, rows: Vector, place: Vector) -> Vector:
    """Return values at a place: by radial functions, or of the nearest of a few places."""
    if len(places) > places.shape[1] + 1:
        from scipy.interpolate import RBFInterpolator  # noqa: PLC0415  (slow to import)

        _, first = np.unique(places, axis=0, return_index=True)
        try:
            spline = RBFInterpolator(places[first], rows[first], kernel="linear", degree=1)
            return np.asarray(spline(place[None])[0])
        except np.linalg.LinAlgError:  # all places on a line
            pass
    nearest = int(((places - place) ** 2).sum(axis=1).argmin())
    return np.asarray(rows[nearest])
