"""At how many realisations an ensemble that may end early is looked at."""

from __future__ import annotations

from wearsim.studies.ensemble_plan import EnsemblePlan

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
