"""Effects of the random inputs on the life."""

from __future__ import annotations

import numpy as np

from wearsim.studies.life.values import LifeValues
from wearsim.uq.sensitivity.effects import (
    TAIL,
    SignedEffect,
    effects,
    exact_effect,
    normal_scores,
)

_QUANTILES = np.array([TAIL, 0.5, 1.0 - TAIL])


def effects_on_life(result: LifeValues) -> dict[str, SignedEffect]:
    """Return the effect of each input on the logarithm of life, by its name, greatest first.

    That of a wear factor which is integrated exactly has no sampling error, and adds none to the
    others. None where too many lives are censored or zero, see `LifeValues.effects_obstacle`.
    """
    if result.effects_obstacle:
        return {}
    drawn = result.drawn_numbers([item["name"] for item in result.raw.groups])
    factor, logs, by_input = result.settings.factor, result.log_lives, dict[str, SignedEffect]()
    if factor in drawn and result.is_known_throughout and not result.at_once:
        # life is kappa/K: kappa holds all that the other inputs change
        logs = np.log(result.values("life") * result.values(factor))
        low, middle, high = np.log(result.factor_law.quantile(_QUANTILES)).tolist()
        by_input[factor] = exact_effect(middle - low, middle - high)
        del drawn[factor]
    laws = {
        random_input.name: random_input.scalar
        for random_input in result.scenario.random
        if random_input.role == "scalar"
    }
    by_input |= effects(
        logs, {name: normal_scores(numbers, laws.get(name)) for name, numbers in drawn.items()}
    )
    return dict(sorted(by_input.items(), key=lambda item: -item[1].size))
