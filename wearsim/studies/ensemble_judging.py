"""What a user should know before trusting an ensemble."""

from __future__ import annotations

import numpy as np

from wearsim.randomness.targets import Target
from wearsim.results import EnsembleResult


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
