"""The hard case of one contact: friction that scatters by half from point to point."""

from __future__ import annotations

import numpy as np

from wearsim.errors import WearsimError
from wearsim.results import DissipationResult
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.contact.monte_carlo import dissipation
from wearsim_bench.hard_cases.measures import changes_of, order
from wearsim_bench.hard_cases.verdict import Check, Verdict

NAME = "friction field, 50 % scatter"
_BASE = "mean-contact"
_LENGTH, _SCATTER = "200 um", 0.5
_POINTS, _STRIPS = 12, 36  # the fewest that resolve the field along and across
_NEAR, _ROUND_OFF = 0.02, 1e-9


def friction_field(doublings: int, realisations: int) -> Verdict:
    """Return the verdict on a field of friction over one contact.

    Power must stay below full sliding, equal the work of the forces, and converge realisation by
    realisation with the grid.

    Parameters
    ----------
    doublings : int
        Of the points along and across.
    realisations : int
    """
    try:
        found = [_solved(1 << k, realisations) for k in range(doublings + 1)]
    except WearsimError as error:
        return Verdict(NAME, str(error), f"stopped: {str(error).splitlines()[0]}")
    scenario = shipped_scenario(_BASE)
    powers = [np.asarray(result.values("power")) for result in found]
    slip = scenario.rolling_speed * abs(scenario.creepage.longitudinal or 0.0)
    work = slip * np.abs(np.asarray(found[-1].values("force_x")))
    moved = changes_of(powers)
    checks = (
        Check("work", float(np.abs(powers[-1] / work - 1.0).max()), _ROUND_OFF),
        Check("strips", moved[-1], _NEAR, order(moved)),
    )
    trouble = "" if all(np.isfinite(power).all() for power in powers) else "not finite"
    figures = {"power_W": float(powers[-1].mean()), "realisations": float(realisations)}
    return Verdict(NAME, trouble=trouble, checks=checks, figures=figures)


def _solved(finer: int, realisations: int) -> DissipationResult:
    """Return contacts on so many times the coarsest points along and across."""
    mean = shipped_scenario(_BASE).friction.coefficient
    marginal = {"distribution": "maxent", "support": [0, "inf"], "mean": mean}
    field = {
        "distribution": "gaussian-field",
        "correlation_length": _LENGTH,
        "marginal": {**marginal, "std": _SCATTER * mean},
    }
    changes = {"contact.mx": _POINTS * finer, "contact.my": _STRIPS * finer}
    scenario = shipped_scenario(_BASE, {"friction.coefficient": field, **changes})
    return dissipation(scenario, realisations)
