"""Hard case of a single contact: a friction field with 50 % scatter."""

from __future__ import annotations

import numpy as np

from wearsim.errors import WearsimError
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.dissipation.monte_carlo import dissipation
from wearsim.studies.dissipation.result import DissipationResult
from wearsim_bench.hard_cases.measures import changes_of, order
from wearsim_bench.hard_cases.verdict import Criterion, Verdict

NAME = "friction field, 50 % scatter"
_BASE = "mean-contact"
_LENGTH, _SCATTER = "200 um", 0.5
_POINTS, _STRIPS = 12, 36  # smallest numbers that resolve the field along and across rolling
_NEAR, _ROUND_OFF = 0.02, 1e-9


def friction_field(doublings: int, realisations: int) -> Verdict:
    """Return the verdict on a friction field in one contact.

    The power must equal the work of the forces, and the power of each realisation must converge
    with the grid.

    Parameters
    ----------
    doublings : int
        Number of grid refinements.
    realisations : int
        Number of realisations.
    """
    try:
        results = [_solve(1 << k, realisations) for k in range(doublings + 1)]
    except WearsimError as error:
        return Verdict(NAME, str(error), f"stopped: {str(error).splitlines()[0]}")
    scenario = shipped_scenario(_BASE)
    powers = [np.asarray(result.values("power")) for result in results]
    slip = scenario.rolling_speed * abs(scenario.creepage.longitudinal or 0.0)
    work = slip * np.abs(np.asarray(results[-1].values("force_x")))
    changes = changes_of(powers)
    criteria = (
        Criterion("work", float(np.abs(powers[-1] / work - 1.0).max()), _ROUND_OFF),
        Criterion("strips", changes[-1], _NEAR, order(changes)),
    )
    unexpected = "" if all(np.isfinite(power).all() for power in powers) else "not finite"
    figures = {"power_W": float(powers[-1].mean()), "realisations": float(realisations)}
    return Verdict(NAME, unexpected=unexpected, criteria=criteria, figures=figures)


def _solve(finer: int, realisations: int) -> DissipationResult:
    """Return the contacts on a grid refined by `finer` along and across rolling."""
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
