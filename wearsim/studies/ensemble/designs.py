"""Sampling designs of ensembles, and the sample sizes of their interim analyses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, TypeAlias, get_args

from wearsim.arguments import ArgumentError
from wearsim.errors import Mistake, ScenarioError
from wearsim.scenario import Scenario
from wearsim.uq.sampling.sampler import PlanName

EnsemblePlan: TypeAlias = Literal[
    "monte-carlo", "latin-hypercube", "sobol", "control-variate", "saltelli"
]
ENSEMBLE_PLANS: tuple[EnsemblePlan, ...] = get_args(EnsemblePlan)
#: Plan of the underlying random numbers.
BASE_PLANS: Mapping[EnsemblePlan, PlanName] = {
    "monte-carlo": "monte-carlo",
    "latin-hypercube": "latin-hypercube",
    "sobol": "sobol",
    "control-variate": "monte-carlo",
    "saltelli": "monte-carlo",
}

FIRST_ANALYSIS = 64  # smallest sample size with reliable intervals; a power of two for Sobol

ANALYSIS_RATIO = 1.1  # fewer analyses make it less likely that one of them stops by chance


def parse_plan(name: str) -> EnsemblePlan:
    """Return the plan with a name.

    Raises
    ------
    ArgumentError
        If there is none.
    """
    for plan in ENSEMBLE_PLANS:
        if plan == name:
            return plan
    raise ArgumentError(
        "plan", f"unknown plan '{name}', expected one of {', '.join(ENSEMBLE_PLANS)}"
    )


def sources(
    plan: EnsemblePlan, groups: Sequence[str], realisation: int
) -> tuple[dict[str, int], int]:
    """Return the number of the draw that each input takes in a realisation.

    It is the number of the realisation, except in Saltelli's plan: there d + 2 consecutive
    realisations, a row, share two draws A and B of d inputs. They are A, B, and A with each input
    in turn replaced by the column of B.

    Parameters
    ----------
    plan : str
    groups : sequence of str
        Names of the inputs.
    realisation : int

    Returns
    -------
    sources : dict of str to int
        Empty where all inputs take the draw of the realisation.
    passes : int
        Number of the draws of inputs drawn at every pass, the same within a row, so that its
        realisations differ only in the inputs that are replaced.

    Notes
    -----
    Saltelli et al., Comput. Phys. Commun. 181 (2010), DOI 10.1016/j.cpc.2009.09.018.
    """
    if plan != "saltelli":
        return {}, realisation
    row, block = divmod(realisation, len(groups) + 2)
    first, second = 2 * row, 2 * row + 1
    return {
        name: second if block == 1 or block == 2 + place else first
        for place, name in enumerate(groups)
    }, row


def whole_count(plan: EnsemblePlan, groups: Sequence[str], realisations: int) -> int:
    """Return the number of realisations of a plan, which is rounded up to whole Saltelli rows."""
    if plan != "saltelli":
        return realisations
    size = len(groups) + 2
    return size * max(-(-realisations // size), 1)


def check_plan(scenario: Scenario, plan: EnsemblePlan, growth: str = "") -> None:
    """Check that a plan can grow if it has to, and the correlations of an ensemble.

    Parameters
    ----------
    scenario : Scenario
    plan : str
    growth : str
        What the ensemble must be able to grow for, "a target".

    Raises
    ------
    ScenarioError
        If a plan of fixed size would have to grow, or inputs of Saltelli's plan are correlated.
    """
    mistakes = []
    if growth and plan in {"latin-hypercube", "saltelli"}:
        what = {
            "latin-hypercube": "a Latin hypercube cannot grow: the number of its strata is that of"
            " its realisations",
            "saltelli": "Saltelli's plan is for sensitivity, and its size is chosen beforehand",
        }[plan]
        mistakes.append(
            Mistake(
                "sampling",
                "plan",
                what,
                f'"{plan}" with {growth}',
                f"monte-carlo, sobol or control-variate; or not {growth}",
            )
        )
    if plan == "saltelli" and scenario.sampling.correlation:
        mistakes.append(
            Mistake(
                "sampling",
                "correlation",
                "Saltelli's plan draws the inputs independently, and these are correlated",
                None,
                "no correlation, or another plan",
            )
        )
    if mistakes:
        raise ScenarioError(scenario.file, mistakes)


def interim_sizes(plan: EnsemblePlan, maximum: int) -> list[int]:
    """Return the sample sizes at which an estimate is compared with its target.

    They do not depend on the order in which realisations finish, so that neither does the final
    sample size. Those of Sobol's plan are powers of two times the first.

    Parameters
    ----------
    plan : str
    maximum : int
        Maximum number of realisations, which is the last size.

    Returns
    -------
    list of int
        Ascending.
    """
    sizes = [FIRST_ANALYSIS]
    while sizes[-1] < maximum:
        growth = 2.0 if plan == "sobol" else ANALYSIS_RATIO
        sizes.append(max(int(growth * sizes[-1]), sizes[-1] + 1))
    return [size for size in sizes if size < maximum] + [maximum]
