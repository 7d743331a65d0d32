"""Settings and targets of a study of lives, and the comparison of two designs."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from wearsim.uq.estimation.intervals import Interval

_FORM = re.compile(r"[bB](?P<percent>[0-9]*\.?[0-9]+)\s+(?P<width>[0-9]*\.?[0-9]+)\s*%")


@dataclass(frozen=True)
class LifeTarget:
    """Target half-width of the interval of a life, relative to it.

    Parameters
    ----------
    share : float
        Share that fails before, 0.1 for B10.
    width : float
    """

    share: float
    width: float

    @classmethod
    def parse(cls, text: str) -> LifeTarget:
        """Return the target of a text such as "b10 3%".

        Raises
        ------
        ValueError
            If the text is not a target.
        """
        match = _FORM.fullmatch(text.strip())
        share, width = (
            (float(match[name]) / 100.0 for name in ("percent", "width"))
            if match
            else (
                0.0,
                0.0,
            )
        )
        if not (0.0 < share < 1.0 and width > 0.0):
            raise ValueError(
                f'cannot read the target "{text}": expected a life and the relative half-width of'
                ' its interval, as in "b10 3%"'
            )
        return cls(share, width)

    @property
    def what(self) -> str:
        """Name of the life, "b10"."""
        return f"b{100.0 * self.share:.12g}"

    def __str__(self) -> str:
        """Return the text that `parse` accepts."""
        return f"{self.what} {100.0 * self.width:.12g}%"

    def interval(self, estimate: Any) -> Interval:
        """Return the estimate, which is an interval."""
        found: Interval = estimate
        return found

    def achieved(self, estimate: Any) -> float:
        """Return the half-width relative to the estimate; infinite if it is unknown."""
        found: Interval = estimate
        return found.half_width / found.value if found.value > 0.0 else math.inf

    def reached(self, estimate: Any) -> bool:
        """Return whether the half-width is at most that of the target."""
        return self.achieved(estimate) <= self.width


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


@dataclass(frozen=True)
class LifeComparison:
    """Lives of two designs.

    Parameters
    ----------
    b10_ratio : Interval
        B10 of the first over that of the second.
    same_machine : Interval, optional
        Probability that the first outlives the second with the same drawn values; None without
        common draws.
    two_specimens : Interval
        Probability that a specimen of the first outlives one of the second, drawn separately.
    count : int
        Number of pairs.
    """

    b10_ratio: Interval
    same_machine: Interval | None
    two_specimens: Interval
    count: int


def swept_variable(results: Sequence[Any]) -> DesignVariable | None:
    """Return the design variable whose value differs between results of a sweep, if there is one.

    Parameters
    ----------
    results : sequence of LifeResult

    Returns
    -------
    DesignVariable or None
        That of the first; None unless all have the same variable with different values.
    """
    found = [one.variable for one in results if one.variable]
    keys, values = {(one.key, one.unit) for one in found}, {one.value for one in found}
    return found[0] if len(keys) == 1 and len(values) == len(results) > 1 else None
