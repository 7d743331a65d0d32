"""The phases of an optimisation: starts, search, second choice and front.

Each phase asks `Designs` for rounds of designs and decides by their outcomes alone. A resumed
optimisation repeats the phases with the outcomes that its file holds, and equals an unbroken one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from wearsim.errors import WearsimError
from wearsim_optimise.designs import Design, Designs, completed
from wearsim_optimise.fronts import front_of, pareto_first
from wearsim_optimise.goals import ONE_PERCENT, TIGHTER, Constraint, Goals
from wearsim_optimise.solvers import (
    RADIUS,
    Answer,
    Cobyqa,
    Evolution,
    Search,
    feasible_first,
    violation,
)
from wearsim_optimise.variables import Vector, start_of

CANDIDATES = 32  # designs among which a feasible start is looked for
EVOLVED = 0.5  # part of the designs of the evolution strategy; the rest refines its best design
LEVELS = 5  # of the second objective between the ends of a front
SECOND = 0.05  # first trust region of a search from a known design
MOVES = 5  # of the optimum to a better neighbour, at most
TIMES = 4  # designs asked for over evaluations, at most

Loss = Callable[[Design], float]


class NoFeasibleDesignError(WearsimError):
    """No design within the bounds satisfies the constraints."""


@dataclass(frozen=True)
class Plan:
    """Settings of a search.

    Parameters
    ----------
    objectives : tuple of (str, int)
    constraints : tuple of Constraint
    then : str
    evaluations : int
        Greatest number of designs that are run.
    starts : int
    method : {"auto", "cobyqa", "evolution"}
    seed : int
    """

    objectives: tuple[tuple[str, int], ...]
    constraints: tuple[Constraint, ...]
    then: str
    evaluations: int
    starts: int
    method: str
    seed: int


def first_goals(designs: Designs, plan: Plan) -> Design:
    """Evaluate the first design, from which the quantities are known; return it.

    Raises
    ------
    NoFeasibleDesignError
        If neither the first design nor another one can be evaluated.
    """
    start = start_of(designs.scenario, designs.variables)
    (first,) = designs.with_numbers([start], "start")
    basis = first
    if not first.outcome.get("named"):
        basis = _some_design(designs, plan, first)
    values, margins = basis.outcome["values"], basis.outcome["margins"]
    scales = {**values, **{f"margin {name}": value for name, value in margins.items()}}
    goals = Goals(plan.objectives, plan.constraints, plan.then, basis.outcome["named"], scales)
    for constraint in plan.constraints:
        goals.limit(constraint)  # raises for a unit of another quantity
    designs.use(goals)
    return designs.all[0]


def _some_design(designs: Designs, plan: Plan, first: Design) -> Design:
    """Return a design that can be evaluated, where the first one cannot."""
    tried = [first]
    for place in _scattered(len(designs.variables), CANDIDATES, plan.seed):
        (design,) = designs.at([place], "feasibility")
        tried.append(design)
        if design.outcome.get("named"):
            return design
    reasons = {design.outcome["reason"].splitlines()[0] for design in tried}
    where = _nearest_to_feasible(designs, tried)
    raise NoFeasibleDesignError(
        f"no feasible start: none of {len(tried)} designs between the bounds can be evaluated;"
        f" {where}{next(iter(reasons))}; choose other bounds"
    )


def _nearest_to_feasible(designs: Designs, tried: Sequence[Design]) -> str:
    """Return which margin of a cam is least violated, and where, in words."""
    margins = [
        (min(design.outcome["margins"].values()), design)
        for design in tried
        if design.outcome["margins"]
    ]
    if not margins:
        return ""
    best = max(margins, key=lambda item: item[0])[1]
    return f"nearest to a feasible one is {described(designs, best)}: "


def described(designs: Designs, design: Design) -> str:
    """Return the values of a design's variables in words."""
    pairs = zip(designs.variables, design.numbers, strict=True)
    return ", ".join(f"{variable.name} = {variable.shown(number)}" for variable, number in pairs)


def _scattered(dimensions: int, count: int, seed: int) -> list[Vector]:
    """Return points of a scrambled Sobol sequence."""
    from scipy.stats import qmc  # noqa: PLC0415  (slow to import)

    rng = np.random.default_rng([seed, 40])
    power = max(int(np.ceil(np.log2(max(count, 2)))), 1)
    try:
        engine = qmc.Sobol(dimensions, scramble=True, rng=rng)
    except TypeError:  # SciPy before 1.15
        engine = qmc.Sobol(dimensions, scramble=True, seed=rng)
    return [np.asarray(point) for point in engine.random_base2(power)[:count]]


def starts_of(designs: Designs, plan: Plan, first: Design) -> list[Design]:
    """Return the designs from which the search starts, the first one included.

    The others are spread between the bounds; those with the least violation of the limits before
    wear and of the margins of a cam are taken.
    """
    count = plan.starts - 1
    if not count:
        return [first]
    places = _scattered(len(designs.variables), 4 * count, plan.seed)
    if designs.limits or (designs.goals and designs.goals.margin_names):
        before_wear = designs.at(places, "feasibility", before_wear=True)
        violations = [_known_violation(design) for design in before_wear]
        order = sorted(range(len(places)), key=lambda n: (violations[n], n))
        places = [places[n] for n in order]
    return [first, *designs.at(places[:count], "start")]


def _known_violation(design: Design) -> float:
    """Return the greatest violation among the slacks that are known."""
    known = design.slacks[np.isfinite(design.slacks)]
    return max(-float(known.min()), 0.0) if len(known) else math.inf


@dataclass(eq=False)
class LocalSearch:
    """A search from one start.

    Parameters
    ----------
    solver : Search
    rated : callable
        Returns loss and slacks of a design for this search.
    designs : list of Design
        Its start, and the designs that the solver has asked for.
    """

    solver: Search
    rated: Callable[[Design], Answer]
    designs: list[Design]


class Runner:
    """Searches within a budget.

    Parameters
    ----------
    designs : Designs
    plan : Plan
    """

    def __init__(self, designs: Designs, plan: Plan) -> None:
        self.designs, self.plan = designs, plan
        self.asked = 0

    def left(self, budget: int) -> bool:
        """Return whether the budget allows another design."""
        return self.designs.runs < budget and self.asked < TIMES * budget

    def search(
        self,
        starts: Sequence[Design],
        budget: int,
        loss: Loss,
        purpose: str,
        radius: float = RADIUS,
    ) -> bool:
        """Search by COBYQA from several starts until the budget of runs is spent.

        The starts share the first half; the second half is left to the best of them. Returns
        whether the search with the best design has converged.
        """
        half = self.designs.runs + (budget - self.designs.runs) // 2

        def rated(design: Design) -> Answer:
            return completed(self.designs, design, loss)

        def best(searches: list[LocalSearch]) -> LocalSearch:
            return min(searches, key=lambda search: min(_rank(d, loss) for d in search.designs))

        def narrowed(searches: list[LocalSearch]) -> list[LocalSearch]:
            return searches if self.designs.runs < half else [best(searches)]

        searches = [self.local_search(start, rated, radius) for start in starts]
        unfinished = self.run(searches, budget, purpose, narrowed)
        return best(searches) not in unfinished

    def local_search(
        self,
        start: Design,
        rated: Callable[[Design], Answer],
        radius: float = RADIUS,
        further: int = 0,
    ) -> LocalSearch:
        """Return a search by COBYQA from a design, with further slacks than the constraints."""
        places = self.designs.places(start)
        fixed = [variable.kind != "continuous" for variable in self.designs.variables]
        solver = Cobyqa(places, len(start.slacks) + further, radius, fixed)
        return LocalSearch(solver, rated, [start])

    def run(
        self,
        searches: list[LocalSearch],
        budget: int,
        purpose: str,
        narrowed: Callable[[list[LocalSearch]], list[LocalSearch]] = lambda searches: searches,
    ) -> list[LocalSearch]:
        """Evaluate designs of several searches round by round until they or the budget end.

        Returns the searches that the budget has ended.
        """
        while searches and self.left(budget):
            searches = narrowed(searches)
            most = max((budget - self.designs.runs) // len(searches), 1)
            searches = self._round(searches, purpose, most)
        return searches

    def _round(self, searches: list[LocalSearch], purpose: str, most: int) -> list[LocalSearch]:
        """Evaluate the next designs of each search; return the searches that have not ended."""
        asked = [(search, search.solver.ask()[:most]) for search in searches]
        places = [place for _, new_places in asked for place in new_places]
        designs = iter(self.designs.at(places, purpose))
        self.asked += len(places)
        for search, new_places in asked:
            new = [next(designs) for _ in new_places]
            search.designs += new
            if new:
                search.solver.tell([search.rated(design) for design in new])
        return [search for search, new_places in asked if new_places]

    def evolve(self, budget: int, order: Callable[[Sequence[Any]], Sequence[float]]) -> bool:
        """Search by the evolution strategy until the budget of runs is spent.

        Returns whether its designs have become equal.
        """
        search = Evolution(self.designs.variables, self.plan.seed, order)
        same = 0
        while self.left(budget) and same < 3:
            before, places = self.designs.runs, search.ask()
            if not places:
                return True
            new = self.designs.at(places, "search")
            self.asked += len(new)
            search.tell(new)
            same = same + 1 if self.designs.runs == before else 0
        return same == 3


def _rank(design: Design, loss: Loss) -> tuple[float, float]:
    """Return a key by which designs are ordered: feasible ones by their loss, others after them."""
    value = loss(design)
    if not design.is_evaluated or math.isnan(value):
        return math.inf, math.inf
    return violation(design), value


def best_of(designs: Sequence[Design], loss: Loss) -> Design | None:
    """Return the feasible design with the least loss; the first of equal ones."""
    feasible = [design for design in designs if design.is_feasible and math.isfinite(loss(design))]
    return min(feasible, key=lambda design: (loss(design), design.number), default=None)


def objective(number: int) -> Loss:
    """Return the loss of an objective."""
    return lambda design: design.losses[number] if design.losses else math.nan


def optimum(
    designs: Designs, plan: Plan, neighbours: Callable[[Design], object]
) -> tuple[Design, bool]:
    """Search; return the best of all designs, and whether the search has converged.

    A neighbour that is better than the optimum becomes the optimum, and the search continues from
    it as far as designs are left.

    Parameters
    ----------
    designs : Designs
    plan : Plan
    neighbours : callable
        Evaluates neighbours of an optimum.

    Raises
    ------
    NoFeasibleDesignError
        If no design is feasible; the message names the least violated constraint, and where.
    """
    first = first_goals(designs, plan)
    runner = Runner(designs, plan)
    converged = _search(runner, first)
    best = chosen(designs, plan)
    for _ in range(MOVES):
        neighbours(best)
        better = chosen(designs, plan)
        if better.number == best.number:
            return best, converged
        converged = _go_on(runner, better)
        best = chosen(designs, plan)
    return best, False


def _search(runner: Runner, first: Design) -> bool:
    """Search from the beginning; return whether it has converged."""
    designs, plan, main = runner.designs, runner.plan, objective(0)
    mixed = any(variable.kind != "continuous" for variable in designs.variables)
    rough = any(design.outcome.get("rough") for design in designs.all)
    budget = plan.evaluations
    if plan.method == "evolution" or (plan.method == "auto" and (mixed or rough)):
        if len(plan.objectives) == 2:
            return runner.evolve(budget, pareto_first)
        converged = runner.evolve(round(EVOLVED * budget), feasible_first)
        best = best_of(designs.all, main)
        if best and any(v.kind == "continuous" for v in designs.variables):
            return runner.search([best], budget, main, "search") and converged
        return converged
    if len(plan.objectives) == 2:
        return _front(runner, starts_of(designs, plan, first))
    share = budget if not plan.then else max(budget - budget // 3, 1)
    converged = runner.search(starts_of(designs, plan, first), share, main, "search")
    if plan.then and (best := best_of(designs.all, main)):
        return _then(runner, best) and converged
    return converged


def _go_on(runner: Runner, better: Design) -> bool:
    """Search on from a better neighbour; return whether the search has converged."""
    plan = runner.plan
    if len(plan.objectives) == 2:  # the front has one design more
        return not runner.left(plan.evaluations)
    if plan.then:
        return _then(runner, better)
    return runner.search([better], plan.evaluations, objective(0), "search", SECOND)


def _then(runner: Runner, start: Design) -> bool:
    """Search for the least second quantity among designs within 1 % of the best.

    Returns whether the search has converged.
    """
    designs = runner.designs
    goals, best = designs.goals, best_of(designs.all, objective(0))
    assert goals is not None
    assert best is not None
    limit = best.loss + ONE_PERCENT - TIGHTER

    def loss(design: Design) -> float:
        value = design.values.get(goals.then, math.nan)
        return goals.scaled(goals.then, value)

    def rated(design: Design) -> Answer:
        second = completed(designs, design, loss)
        main = completed(designs, design, objective(0))
        return Answer(second.loss, np.append(second.slacks, limit - main.loss))

    return not runner.run(
        [runner.local_search(start, rated, SECOND, 1)], runner.plan.evaluations, "then"
    )


def _front(runner: Runner, starts: list[Design]) -> bool:
    """Search for a front: its ends, and the least first objective at levels of the second.

    Returns whether all these searches have converged.
    """
    designs, budget = runner.designs, runner.plan.evaluations
    used = designs.runs
    converged = True
    for number, share in ((0, 0.25), (1, 0.5)):
        most = used + round(share * (budget - used))
        converged &= runner.search(starts, most, objective(number), "search")
    ends = [best_of(designs.all, objective(number)) for number in (0, 1)]
    if ends[0] is None or ends[1] is None:
        return False
    span = ends[0].losses[1] - ends[1].losses[1]
    if not span > 0.0:
        return converged
    levels = [ends[1].losses[1] + span * (n + 1.0) / (LEVELS + 1.0) for n in range(LEVELS)]
    feasible = [design for design in designs.all if design.is_feasible]
    searches = []
    for level in levels:
        start = min(feasible, key=partial(_beyond, level))
        searches.append(runner.local_search(start, partial(_at_level, designs, level), SECOND, 1))
    return not runner.run(searches, budget, "front") and converged


def _beyond(level: float, design: Design) -> tuple[float, float]:
    """Return a key of the designs from which to start at a level of the second objective.

    Designs within the level come first, ordered by the first objective.
    """
    return max(design.losses[1] - level, 0.0), design.losses[0]


def _at_level(designs: Designs, level: float, design: Design) -> Answer:
    """Return the first loss of a design, with the second one as a constraint."""
    first = completed(designs, design, objective(0))
    second = completed(designs, design, objective(1))
    return Answer(first.loss, np.append(first.slacks, level - second.loss))


def chosen(designs: Designs, plan: Plan) -> Design:
    """Return the best design of all that were evaluated.

    Of a front it is the design nearest to the best values of both objectives, relative to their
    ranges. With a second quantity it is the one with the least of it within 1 % of the best.
    """
    if len(plan.objectives) == 2 and (front := front_of(designs)):
        losses = np.array([design.losses for design in front])
        span = np.ptp(losses, axis=0)
        distances = (losses - losses.min(axis=0)) / np.where(span > 0.0, span, 1.0)
        return front[int(np.hypot(*distances.T).argmin())]
    best = best_of(designs.all, objective(0))
    if best is None:
        raise NoFeasibleDesignError(_least_violated(designs))
    if not plan.then:
        return best
    candidates = [d for d in designs.all if d.is_feasible and d.loss <= best.loss + ONE_PERCENT]
    return min(candidates, key=lambda design: (design.values[plan.then], design.number))


def _least_violated(designs: Designs) -> str:
    """Return which constraint is least violated, and where."""
    goals = designs.goals
    assert goals is not None
    known = [design for design in designs.all if np.isfinite(design.slacks).any()]
    runs = len(designs.all)
    if not known:
        reason = designs.all[0].outcome["reason"]
        return f"no feasible design found in {runs}: none could be evaluated; the first: {reason}"
    nearest = min(known, key=lambda design: (_known_violation(design), design.number))
    slacks = np.where(np.isfinite(nearest.slacks), nearest.slacks, np.inf)
    place = int(slacks.argmin())
    if slacks[place] >= 0.0:
        return (
            f"no feasible design found in {runs}: the objective is known of none within the"
            f" constraints, as of {described(designs, nearest)}: {nearest.outcome['reason']}"
        )
    if place < len(goals.constraints):
        name = goals.constraints[place].name
        value = goals.shown(name, nearest.values[name])
    else:
        name = goals.margin_names[place - len(goals.constraints)]
        value = f"{nearest.outcome['margins'][name]:.4g} in SI units"
    return (
        f"no feasible design found in {runs}: the least violated constraint is"
        f" '{goals.slack_names[place]}', with {value} at {described(designs, nearest)};"
        " relax it, or choose other bounds"
    )
