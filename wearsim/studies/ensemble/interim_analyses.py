"""What a user should know before trusting an ensemble."""

from __future__ import annotations

import numpy as np

from wearsim.results import EnsembleResult
from wearsim.studies.ensemble.designs import EnsemblePlan
from wearsim.uq.estimation.stopping_rule import Target


def judged(result: EnsembleResult, target: Target | None, reached: bool) -> list[str]:
    """Return warnings about a finished ensemble.

    Parameters
    ----------
    result : EnsembleResult
    target : Target, optional
        What was to be reached.
    reached : bool
        Whether it was.

    Returns
    -------
    list of str
    """
    found = [
        _errors(result),
        _kept(result),
        _correlated(result),
        _control(result),
        _uneven(result),
    ]
    if target is not None and not reached:
        found.append(f"{target} was not reached by {result.asked} realisations")
    return [text for text in found if text]


def _errors(result: EnsembleResult) -> str:
    if not result.count:
        return ""
    errors = result.values("depth_error")
    deepest = np.maximum(result.at_end("depth"), result.at_end("roller_depth"))
    beyond = int((errors > result.raw.tolerance * deepest).sum())
    if not beyond:
        return ""
    return (
        f"the estimated error of depth is more than the tolerance in {beyond} of {result.count}"
        " realisations; lower evolution.tolerance"
    )


def _kept(result: EnsembleResult) -> str:
    if not result.count or result.numbers[-1] < result.kept:
        return ""
    return (
        f"the profiles of the first {result.kept} realisations are kept, and mean profile and band"
        " are theirs"
    )


def _correlated(result: EnsembleResult) -> str:
    if not result.scenario.sampling.correlation:
        return ""
    return (
        "some inputs are correlated: what one of them moves includes what it shares with others, so"
        " that the parts may add up to more than all"
    )


def _uneven(result: EnsembleResult) -> str:
    if result.plan not in {"sobol", "latin-hypercube"}:
        return ""
    processes = [item["name"] for item in result.raw.groups if item["role"] == "process"]
    if not processes:
        return ""
    return (
        f"{' and '.join(processes)} follow processes, whose paths are drawn at random whatever the"
        f" plan: {result.plan} spreads the other inputs alone"
    )


def _control(result: EnsembleResult) -> str:
    if result.plan != "control-variate" or not result.failed:
        return ""
    return (
        f"{result.failed} realisations failed, and the control's mean is that of others than those"
        " left: estimates are those of plain Monte Carlo"
    )


FEWEST = 64  # before which no interval is to be trusted; a power of two for each Sobol sequence

GROWTH = 1.1  # the fewer looks, the less the chance that one of them is taken in


def checkpoints(plan: EnsemblePlan, most: int) -> list[int]:
    """Return numbers of realisations at which an estimate is held against its target.

    They do not depend on when realisations finish, so that the ensemble ends with the same ones
    whoever runs it. Sobol's sequences are at their best where each has a power of two.

    Parameters
    ----------
    plan : str
    most : int
        Realisations at most, which is the last number.

    Returns
    -------
    list of int
        Rising.
    """
    found = [FEWEST]
    while found[-1] < most:
        if plan == "sobol":
            found.append(2 * found[-1])
        else:
            found.append(max(int(GROWTH * found[-1]), found[-1] + 1))
    return [number for number in found if number < most] + [most]
