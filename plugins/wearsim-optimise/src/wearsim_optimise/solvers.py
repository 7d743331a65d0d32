"""Searches that are asked for designs and take their losses: COBYQA, and an evolution strategy.

Several starts and the phases of an optimisation share one list of designs, and each round of them
is evaluated by any number of workers with the same result. COBYQA: Ragonneau, Model-Based
Derivative-Free Optimization Methods and Software (2022), chapter 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from wearsim.errors import PluginError
from wearsim_optimise.variables import Variable, Vector

RADIUS = 0.2  # first trust region, of the range of a variable
FINAL = 4e-4  # last trust region; the error of an optimum is much smaller
_MOST = 10_000  # evaluations of one search, more than the budget allows


#: weight in the loss of the squared violation of a limit, relative to the limit: if all its first
#: designs violate a limit, COBYQA may otherwise end at an infeasible design. The added term and its
#: derivative are zero at a feasible optimum
PENALTY = 10.0


class Rated(Protocol):
    """Loss and slacks of a design."""

    @property
    def loss(self) -> float:
        """Number to be made small."""

    @property
    def slacks(self) -> Vector:
        """How far the design is within its limits."""


@dataclass(frozen=True)
class Answer:
    """Loss and slacks of a design."""

    loss: float
    slacks: Vector


class Search(Protocol):
    """A search that is asked for designs, and takes their losses and slacks."""

    def ask(self) -> list[Vector]:
        """Return the next designs as places of the unit cube; none if the search has ended."""

    def tell(self, rated: Sequence[Rated]) -> None:
        """Take the losses and slacks of the designs asked for, or of the first of them."""


class _Asked(Exception):  # noqa: N818  (the answer to what the search asks)
    """A design that the search needs next."""

    def __init__(self, place: Vector) -> None:
        super().__init__()
        self.place = place


class Cobyqa:
    """COBYQA from one start.

    SciPy runs one COBYQA at a time and offers no way to continue one. For each design the search is
    therefore repeated with the known answers up to the first design without one, which takes
    milliseconds, and nothing beside the runs of the designs. The designs of its first model are
    asked for at once, so that workers share them.

    Parameters
    ----------
    start : ndarray, shape (variables,)
        Places of the start.
    constraints : int
        Number of slacks, not below zero in a feasible design.
    radius : float
        First trust region.
    fixed : sequence of bool
        Variables that keep their places; by default none.
    """

    def __init__(
        self,
        start: Vector,
        constraints: int,
        radius: float = RADIUS,
        fixed: Sequence[bool] = (),
    ) -> None:
        self._start, self._count, self._radius = start, constraints, radius
        kept = np.array(fixed or [False] * len(start))
        self._low, self._high = np.where(kept, start, 0.0), np.where(kept, start, 1.0)
        self._known: dict[bytes, Rated] = {}
        self._next: list[Vector] = []

    def ask(self) -> list[Vector]:
        """Return the next design, at the start those of the first model; none at convergence."""
        self._next = []
        try:
            self._minimise(self._at if self._known else self._first)
        except _Asked as asked:
            if self._known:
                self._next = [asked.place]
        return self._next

    def tell(self, rated: Sequence[Rated]) -> None:
        """Take losses and slacks of the designs, or of the first of them."""
        for place, answer in zip(self._next, rated, strict=False):
            violated = min(violation(answer), 1.0)
            loss = answer.loss + PENALTY * violated**2
            self._known[place.tobytes()] = Answer(loss, answer.slacks)

    def _at(self, place: Vector) -> Rated:
        place = self._within(place)
        if place.tobytes() not in self._known:
            raise _Asked(place)
        return self._known[place.tobytes()]

    def _first(self, place: Vector) -> Rated:
        """Keep a place of the first model, which lies where it does for any answers."""
        place = self._within(place)
        if not any(np.array_equal(place, known) for known in self._next):
            if len(self._next) == 2 * int((self._low < self._high).sum()) + 1:
                raise _Asked(place)
            self._next.append(place)
        return Answer(0.0, np.zeros(self._count))

    def _within(self, place: Vector) -> Vector:
        return np.clip(np.asarray(place, dtype=np.float64), self._low, self._high)

    def _minimise(self, at: Callable[[Vector], Rated]) -> None:
        from scipy.optimize import Bounds, NonlinearConstraint, minimize  # noqa: PLC0415  (slow)

        limits: Any = ()
        if self._count:
            limits = NonlinearConstraint(lambda x: at(x).slacks, 0.0, np.inf)
        options: Any = {
            "initial_tr_radius": self._radius,
            "final_tr_radius": FINAL,
            "maxfev": _MOST,
        }
        minimise: Any = minimize
        minimise(
            lambda x: at(x).loss,
            self._start,
            method="COBYQA",
            bounds=Bounds(self._low, self._high),
            constraints=limits,
            options={**options, "feasibility_tol": 0.0},
        )


class Evolution:
    """CMA-ES with margin for continuous, integer and categorical variables.

    Hamano, Uchida, Shirakawa, Morinaga, Akimoto, "CatCMA with Margin" (GECCO 2025), of the library
    cmaes. Designs are ordered by feasibility first, and then by `order`.

    Parameters
    ----------
    variables : sequence of Variable
    seed : int
    order : callable
        Returns a key of a design by which it is sorted; the smallest is the best.
    """

    def __init__(
        self,
        variables: Sequence[Variable],
        seed: int,
        order: Callable[[Sequence[Rated]], Sequence[float]],
    ) -> None:
        try:
            from cmaes import CatCMAwM  # noqa: PLC0415  (an extra)
        except ImportError as error:
            raise PluginError(
                "integers, lists and lives that are counted are searched by an evolution strategy,"
                " which needs cmaes: pip install 'wearsim-optimise[evolution]'"
            ) from error
        self._variables, self._order = variables, order
        real = [v for v in variables if v.kind == "continuous"]
        whole = [v for v in variables if v.kind == "integer"]
        lists = [v for v in variables if v.kind == "list"]
        # from the centre of the bounds, with their width
        self._solver = CatCMAwM(
            x_space=[[0.0, 1.0]] * len(real) or None,
            z_space=[[v.low + n for n in range(v.count)] for v in whole] or None,
            c_space=[v.count for v in lists] or None,
            seed=seed % 2**32,
        )
        self._solutions: list[Any] = []

    @property
    def size(self) -> int:
        """Designs of a generation."""
        return int(self._solver.population_size)

    def ask(self) -> list[Vector]:
        """Return the designs of a generation; none once they have become equal."""
        self._solutions = [self._solver.ask() for _ in range(self.size)]
        places = [self._place(solution) for solution in self._solutions]
        is_narrow = float(np.ptp(np.array(places), axis=0).max()) < FINAL
        return [] if is_narrow else places

    def _place(self, solution: Any) -> Vector:
        real, whole, chosen = iter(_or(solution.x)), iter(_or(solution.z)), iter(_or(solution.c))
        places = []
        for variable in self._variables:
            if variable.kind == "continuous":
                places.append(min(max(float(next(real)), 0.0), 1.0))
            elif variable.kind == "integer":
                places.append(variable.place(float(next(whole))))
            else:
                places.append(variable.place(float(np.argmax(next(chosen)))))
        return np.array(places)

    def tell(self, rated: Sequence[Rated]) -> None:
        """Order the designs of the generation, and update the distribution by them."""
        ranks = np.argsort(np.argsort(self._order(rated), kind="stable"), kind="stable")
        self._solver.tell(list(zip(self._solutions, ranks.astype(float).tolist(), strict=True)))


def _or(values: Any) -> Any:
    return [] if values is None else values


def feasible_first(rated: Sequence[Rated]) -> list[float]:
    """Return numbers that order designs: feasible ones by loss, then the rest by violation."""
    losses = [item.loss for item in rated if violation(item) == 0.0 and math.isfinite(item.loss)]
    worst = max(losses, default=0.0)
    order = []
    for item in rated:
        violated = violation(item)
        if violated == 0.0 and math.isfinite(item.loss):
            order.append(item.loss)
        else:
            order.append(worst + 1.0 + (violated if math.isfinite(violated) else 1e6))
    return order


def violation(rated: Rated) -> float:
    """Return the greatest violation of a constraint, over its limit; 0 for a feasible design."""
    if not len(rated.slacks):
        return 0.0
    worst = float(np.min(rated.slacks))
    return math.inf if math.isnan(worst) else max(-worst, 0.0)
