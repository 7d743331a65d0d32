"""The built-in random process `ornstein-uhlenbeck`."""

from __future__ import annotations

import math
from typing import Self

from pydantic import Field, model_validator

from wearsim.mechanics.numerics.gaussian_processes import filter_noise
from wearsim.plugins import Distribution, Options, Process, RandomInputSpec, Uniforms
from wearsim.quantities import PositiveDuration
from wearsim.types import FloatArray
from wearsim.units import QuantityError

_STEPS = 20  # per correlation time, unless a spacing is given
_FEWEST = 4
_LEVEL_AT = 1 << 40  # position of the level's number, beyond any path


class OrnsteinUhlenbeckOptions(Options):
    """Options of the process `ornstein-uhlenbeck`."""

    correlation_time: PositiveDuration = Field(
        description="time over which it forgets itself to 1/e, e.g. '5 min'"
    )
    spacing: PositiveDuration | None = Field(
        None, description="step of its time grid; a twentieth of the correlation time by default"
    )

    level: float = Field(
        0.0,
        ge=0.0,
        lt=1.0,
        description="part of its variance that never changes: a level of the whole test",
    )

    @model_validator(mode="after")
    def _resolves(self) -> Self:
        greatest = self.correlation_time / _FEWEST
        if self.spacing is not None and self.spacing > greatest:
            raise QuantityError(
                "spacing does not resolve the process",
                f'"{self.spacing:g} s" with a correlation time of {self.correlation_time:g} s',
                f'a quarter of that at most, "{greatest:g} s"',
            )
        return self


class OrnsteinUhlenbeck(Process):
    """A stationary process with the correlation exp(-t/tau) and any marginal distribution.

    Normal scores follow z_k+1 = r z_k + sqrt(1 - r^2) w_k with r = exp(-spacing/tau), which is
    exact at the points of the time grid (Gillespie 1996, DOI 10.1103/PhysRevE.54.2084), and are
    mapped to the marginal. The correlation holds for the scores; where the marginal is not
    normal that of the values is a little less. Between the points of the grid the value is linear,
    and its variance over all times (2 + r)/3 of the marginal's: 1.6 % less at a twentieth.

    With a level l the scores are sqrt(l) z_0 + sqrt(1 - l) z_k, z_0 drawn once: the marginal over
    many tests stays, and each test keeps to a level of its own.
    """

    def __init__(self, options: OrnsteinUhlenbeckOptions, marginal: Distribution) -> None:
        self.marginal = marginal
        self.correlation_time = options.correlation_time
        self.spacing = options.spacing or options.correlation_time / _STEPS
        self.level = options.level

    def path(self, points: int, uniforms: Uniforms) -> FloatArray:
        """Return one realisation at the times 0, spacing, 2 spacing, ..., shape (points,)."""
        from scipy.special import ndtr, ndtri  # noqa: PLC0415  (slow to import)

        memory = math.exp(-self.spacing / self.correlation_time)
        scores = filter_noise(ndtri(uniforms(0, points)), memory)
        if self.level > 0.0:
            lasting = float(ndtri(uniforms(_LEVEL_AT, 1))[0])
            scores = math.sqrt(self.level) * lasting + math.sqrt(1.0 - self.level) * scores
        return self.marginal.quantile(ndtr(scores))


SPECS = (
    RandomInputSpec(
        name="ornstein-uhlenbeck",
        factory=OrnsteinUhlenbeck,
        options=OrnsteinUhlenbeckOptions,
        role="process",
        summary="a value that wanders within its distribution and forgets itself exponentially",
        references=("Gillespie, Phys. Rev. E 54 (1996), DOI 10.1103/PhysRevE.54.2084",),
    ),
)
