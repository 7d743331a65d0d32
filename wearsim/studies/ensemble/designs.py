"""The plans of an ensemble: which draws each of its realisations takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, TypeAlias, get_args

from wearsim.errors import Mistake, ScenarioError
from wearsim.scenario import Scenario
from wearsim.uq.sampling.plans import PlanName

EnsemblePlan: TypeAlias = Literal[
    "monte-carlo", "latin-hypercube", "sobol", "control-variate", "saltelli"
]
ENSEMBLE_PLANS: tuple[EnsemblePlan, ...] = get_args(EnsemblePlan)
BASE_PLANS: Mapping[EnsemblePlan, PlanName] = {
    "monte-carlo": "monte-carlo",
    "latin-hypercube": "latin-hypercube",
    "sobol": "sobol",
    "control-variate": "monte-carlo",
    "saltelli": "monte-carlo",
}
"""The plan by which numbers are drawn."""


def parse_plan(name: str) -> EnsemblePlan:
    """Return the plan of a name.

    Raises
    ------
    ValueError
        If there is none.
    """
    for plan in ENSEMBLE_PLANS:
        if plan == name:
            return plan
    raise ValueError(f"unknown plan '{name}', expected one of {', '.join(ENSEMBLE_PLANS)}")


def sources(plan: EnsemblePlan, groups: Sequence[str], realisation: int) -> dict[str, int]:
    """Return the number of the draw that each input takes in a realisation.

    All take that of the realisation, but in Saltelli's plan: there d + 2 realisations on end share
    two draws A and B of d inputs. They are A, B, and A with one input after the other from B.

    Parameters
    ----------
    plan : str
    groups : sequence of str
        Names of the inputs.
    realisation : int

    Returns
    -------
    dict of str to int

    Notes
    -----
    Saltelli et al., Comput. Phys. Commun. 181 (2010), DOI 10.1016/j.cpc.2009.09.018.
    """
    if plan != "saltelli":
        return {}
    row, block = divmod(realisation, len(groups) + 2)
    first, second = 2 * row, 2 * row + 1
    return {
        name: second if block == 1 or block == 2 + place else first
        for place, name in enumerate(groups)
    }


def passes_of(plan: EnsemblePlan, groups: Sequence[str], realisation: int) -> int:
    """Return whose draws at every pass a realisation takes: in Saltelli's plan a row shares them.

    What differs within a row is then what is exchanged, and no chance besides.
    """
    return realisation // (len(groups) + 2) if plan == "saltelli" else realisation


def whole_count(plan: EnsemblePlan, groups: Sequence[str], asked: int) -> int:
    """Return how many realisations a plan makes of those asked for: Saltelli's go in whole rows."""
    if plan != "saltelli":
        return asked
    size = len(groups) + 2
    return size * max(-(-asked // size), 1)


def check_plan(scenario: Scenario, plan: EnsemblePlan, until: str) -> None:
    """Refuse what a plan cannot do.

    Raises
    ------
    ScenarioError
        If an ensemble that cannot grow is to stop at a target, or Saltelli's inputs depend on each
        other.
    """
    problems = []
    if until and plan in {"latin-hypercube", "saltelli"}:
        why = {
            "latin-hypercube": "a Latin hypercube cannot grow: its strata are as many as its"
            " realisations",
            "saltelli": "Saltelli's plan is for sensitivity, and its size is chosen beforehand",
        }[plan]
        expected = "monte-carlo, sobol or control-variate; or no --until"
        problems.append(Mistake("sampling", "plan", why, f'"{plan}" with --until', expected))
    if plan == "saltelli" and scenario.sampling.correlation:
        what = "Saltelli's plan draws every input by itself, and these are correlated"
        expected = "no correlation, or another plan"
        problems.append(Mistake("sampling", "correlation", what, None, expected))
    if problems:
        raise ScenarioError(scenario.file, problems)
