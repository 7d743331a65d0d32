"""Settings and targets of a study of lives."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from wearsim.uq.estimation.estimates import LIFE, Target


def life_target(text: str) -> Target:
    """Return the target of a text such as "b10 3%".

    Raises
    ------
    ValueError
        If the text is not a target for a life.
    """
    with suppress(ValueError):
        target = Target.parse(text)
        if target.observable == LIFE:
            return target
    raise ValueError(
        f'cannot read the target "{text}": expected a life and the relative half-width of its'
        ' interval, as in "b10 3%"'
    )


@dataclass(frozen=True)
class DesignVariable:
    """Design variable of a sweep.

    Parameters
    ----------
    key : str
        Dotted key of the scenario.
    value : float
        In SI units.
    unit : str
        SI unit, "1" for plain numbers.
    text : str
        The value as given, "25 mm".
    """

    key: str
    value: float
    unit: str
    text: str


@dataclass(frozen=True)
class LifeSettings:
    """Settings of a study of lives, stored with its results.

    Parameters
    ----------
    most : float
        Roller passes at which lives are censored.
    unit : {"passes", "turns"}
    per_unit : float
        Roller passes of a unit.
    rate : float
        Units per second.
    target : float, optional
        Life of which the probability is estimated [passes].
    shares : tuple of float
        Percentages of failed specimens whose lives are estimated.
    factor : str
        Key of the wear factor that is integrated exactly; empty if none is.
    reason : str
        Why none is.
    reference : float
        Wear factor with which the tests are run, 0 for those drawn.
    spread : float
        Standard deviation of the normal score of the factor given the other drawn values.
    alone : bool
        Whether nothing else is random.
    plain : int
        Number of realisations that are drawn without weights, the first ones.
    rare : int
        Number of further tests for the probability of a life before the target.
    rare_method : {"auto", "importance", "subset"}
        Method that they serve; "auto" is subset simulation where importance sampling fails.
    stages : tuple of dict
        Of these tests: number of the first, and their count. For importance sampling also the shift
        of the normal scores of their draws by name of the input, and for the estimate with an
        integrated wear factor share and shift of each part of the draws; for subset simulation the
        numbers of the realisations from which they depart, and the scale of the change.
    variable : dict
        Fields of the `DesignVariable` in a sweep; empty otherwise.
    """

    most: float
    unit: str
    per_unit: float
    rate: float
    target: float | None
    shares: tuple[float, ...]
    factor: str
    reason: str
    reference: float
    spread: float
    alone: bool
    plain: int
    rare: int = 0
    rare_method: str = "auto"
    stages: tuple[dict[str, Any], ...] = ()
    variable: dict[str, Any] = field(default_factory=dict)
