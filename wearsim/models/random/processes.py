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
_FEWEST_STEPS = 4
_LEVEL_AT = 1 << 40  # index of the uniform number of the level, beyond that of any path


class OrnsteinUhlenbeckOptions(Options):
    """Options of the process `ornstein-uhlenbeck`."""

    correlation_time: PositiveDuration = Field(
        description="time at which the correlation is 1/e, e.g. '5 min'"
    )
    spacing: PositiveDuration | None = Field(
        None, description="spacing of the time grid; by default 1/20 of the correlation time"
    )
    level: float = Field(
        0.0,
        ge=0.0,
        lt=1.0,
        description="fraction of the variance that is constant over a test",
    )

    @model_validator(mode="after")
    def _resolves(self) -> Self:
        greatest = self.correlation_time / _FEWEST_STEPS
        if self.spacing is not None and self.spacing > greatest:
            raise QuantityError(
                "spacing does not resolve the process",
                f'"{self.spacing:g} s" with a correlation time of {self.correlation_time:g} s',
                f'at most a quarter of that, "{greatest:g} s"',
            )
        return self


class OrnsteinUhlenbeck(Process):
    """Stationary process with the correlation exp(-t/tau) and any marginal distribution.

    Normal scores follow z_k+1 = r z_k + sqrt(1 - r^2) w_k with r = exp(-spacing/tau), which is
    exact at the points of the time grid (Gillespie 1996, DOI 10.1103/PhysRevE.54.2084), and are
    mapped to the marginal. The correlation is that of the scores; that of the values is slightly
    smaller if the marginal is not normal. The value is linear between the points of the grid, so
    that its variance over all times is (2 + r)/3 of that of the marginal: 1.6 % less for a spacing
    of tau/20.

    With a level l the scores are sqrt(l) z_0 + sqrt(1 - l) z_k, where z_0 is constant over a test:
    the marginal over many tests is unchanged, and the mean differs from test to test.
    """

    def __init__(self, options: OrnsteinUhlenbeckOptions, marginal: Distribution) -> None:
        self.marginal = marginal
        self.correlation_time = options.correlation_time
        self.spacing = options.spacing or options.correlation_time / _STEPS
        self.level = options.level

    def path(self, points: int, uniforms: Uniforms) -> FloatArray:
        """Return one realisation at the times 0, spacing, 2 spacing, ..., shape (points,)."""
        from scipy.special import ndtr, ndtri  # noqa: PLC0415  (slow to import)

        correlation = math.exp(-self.spacing / self.correlation_time)
        scores = filter_noise(ndtri(uniforms(0, points)), correlation)
        if self.level > 0.0:
            constant = float(ndtri(uniforms(_LEVEL_AT, 1))[0])
            scores = math.sqrt(self.level) * constant + math.sqrt(1.0 - self.level) * scores
        return self.marginal.quantile(ndtr(scores))


SPECS = (
    RandomInputSpec(
        name="ornstein-uhlenbeck",
        factory=OrnsteinUhlenbeck,
        options=OrnsteinUhlenbeckOptions,
        role="process",
        summary="stationary process with an exponential correlation in time",
        references=("Gillespie, Phys. Rev. E 54 (1996), DOI 10.1103/PhysRevE.54.2084",),
        protocol=2,
    ),
)
