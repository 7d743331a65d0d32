"""How precisely an ensemble is to know something before it may stop."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

from wearsim.uq.estimation.estimates import Estimate
from wearsim.uq.estimation.intervals import Interval

_FEWEST = 32  # realisations, before which an interval may be narrow by luck
_FORM = re.compile(
    r"(?P<observable>[a-z][a-z_]*)\.(?P<what>mean|std|median|q(?P<percent>\d+(\.\d+)?))"
    r"\s+(?P<width>\d+(\.\d*)?|\.\d+)\s*%"
)


@dataclass(frozen=True)
class Target:
    """A half-width that an interval is to have, in parts of its estimate.

    Parameters
    ----------
    observable : str
        What is observed: "depth".
    statistic : {"mean", "std"} or float
        What of its law is estimated; a number is the probability of a quantile.
    width : float
        Half-width of the 95 % interval in parts of the estimate.
    """

    observable: str
    statistic: Literal["mean", "std"] | float
    width: float

    @classmethod
    def parse(cls, text: str) -> Target:
        """Read a target as the user writes it: "depth.mean 1%", "width.q97.5 5 %".

        Raises
        ------
        ValueError
            If the text is no target.
        """
        found = _FORM.fullmatch(text.strip())
        if found is None:
            raise ValueError(
                f'cannot read the target "{text}": expected observable.statistic and a half-width,'
                ' as in "depth.mean 1%"; the statistic is mean, std, median, or a quantile in'
                " percent, q95"
            )
        what, width = found["what"], float(found["width"]) / 100.0
        if not width > 0.0:
            raise ValueError(f'the target "{text}" has no width; give one above 0 %')
        if what == "mean":
            return cls(found["observable"], "mean", width)
        if what == "std":
            return cls(found["observable"], "std", width)
        probability = 0.5 if what == "median" else float(found["percent"]) / 100.0
        if not 0.0 < probability < 1.0:
            raise ValueError(
                f'the quantile of the target "{text}" must lie above q0 and below q100'
            )
        return cls(found["observable"], probability, width)

    @property
    def what(self) -> str:
        """What is estimated, "depth.mean"."""
        name = self.statistic
        return f"{self.observable}.{name if isinstance(name, str) else f'q{100.0 * name:.12g}'}"

    def __str__(self) -> str:
        """Return the target as `parse` reads it."""
        return f"{self.what} {100.0 * self.width:.12g}%"

    @property
    def probabilities(self) -> tuple[float, ...]:
        """The quantiles that its estimate must have."""
        return () if isinstance(self.statistic, str) else (self.statistic,)

    def interval(self, estimate: Estimate) -> Interval:
        """Return the interval it is about, of an estimate of its observable."""
        if self.statistic == "mean":
            return estimate.mean
        return (
            estimate.std if isinstance(self.statistic, str) else estimate.quantile(self.statistic)
        )

    def achieved(self, estimate: Estimate) -> float:
        """Return the half-width so far in parts of the estimate, infinite where it is unknown."""
        interval = self.interval(estimate)
        if math.isnan(interval.value) or not math.isfinite(interval.half_width):
            return math.inf
        if interval.half_width == 0.0:
            return 0.0
        return interval.half_width / abs(interval.value) if interval.value else math.inf

    def reached(self, estimate: Estimate) -> bool:
        """Tell whether it is reached, by 32 realisations or more: fewer may agree by luck.

        An ensemble that stops at once has a narrow interval a little too often by luck alone: it
        holds the truth in 92 to 95 % of ensembles that stop between 80 and 700 realisations.
        """
        return estimate.count >= _FEWEST and self.achieved(estimate) <= self.width
