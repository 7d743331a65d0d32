"""Random inputs that vary within a contact or in time: friction fields and a process."""

from __future__ import annotations

import math
from typing import Self

import numpy as np
from pydantic import Field, model_validator

from wearsim.mechanics.numerics.gaussian_processes import REACH, filter_noise, smooth
from wearsim.plugins import (
    Distribution,
    Frame,
    FrictionField,
    Options,
    Process,
    RandomInputSpec,
    Uniforms,
)
from wearsim.quantities import PositiveDuration, PositiveLength
from wearsim.types import FloatArray
from wearsim.units import QuantityError

_CELLS = 2  # lattice spacings per correlation length
# cells are drawn in tiles that are long across the track, as contacts are, for fewer draws
_TILE_ROWS, _TILE_COLUMNS = 64, 16
_TILES = 2**26  # to either side of the origin; two tile numbers and a cell number make 64 bits
_STEPS = 20  # per correlation time, unless a spacing is given
_FEWEST_STEPS = 4
_LEVEL_AT = 1 << 40  # index of the uniform number of the level, beyond that of any path


class WhiteOptions(Options):
    """Options of the friction field `white`."""

    frame: Frame = Field("contact", description="frame of the field: contact, cylinder or roller")


class GaussianFieldOptions(WhiteOptions):
    """Options of the friction field `gaussian-field`."""

    correlation_length: PositiveLength = Field(
        description="distance at which the correlation is 1/e, e.g. '50 um'"
    )


class White(FrictionField):
    """Independent friction at each point of the grid, as in the paper.

    Point p of strip s has the uniform number of index p x strips + s, so that another grid is
    another realisation. The traction follows the lower envelope of the noise: it decreases as the
    grid is refined.
    """

    def __init__(self, options: WhiteOptions, marginal: Distribution) -> None:
        self.frame, self.marginal = options.frame, marginal

    def values(self, x: FloatArray, y: FloatArray, uniforms: Uniforms) -> FloatArray:
        """Return one realisation at the points of a grid, shape (points, strips)."""
        return self.marginal.quantile(uniforms(0, x.size).reshape(x.shape))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the validity, for the user."""
        return (
            *self.marginal.warnings,
            (
                "white friction has no continuum limit: the dissipation depends on the grid, and"
                " decreases as it is refined; use gaussian-field"
            ),
        )


class GaussianField(FrictionField):
    """Field with the correlation exp(-r^2/l^2) in normal scores and any marginal distribution.

    Smoothed white noise on an infinite square lattice of spacing l/2 (process convolution: Higdon
    2002, DOI 10.1007/978-1-4471-0657-9_2). The uniform number of a cell depends on its indices
    only, so that the field depends neither on the grid nor on the extent of the contact.
    """

    def __init__(self, options: GaussianFieldOptions, marginal: Distribution) -> None:
        self.frame, self.marginal = options.frame, marginal
        self.correlation_length = options.correlation_length

    def values(self, x: FloatArray, y: FloatArray, uniforms: Uniforms) -> FloatArray:
        """Return one realisation at given points, shape (points, strips)."""
        from scipy.special import ndtr  # noqa: PLC0415  (slow to import)

        spacing = self.correlation_length / _CELLS
        rows, columns = _cells(y, spacing), _cells(x, spacing)
        scores = smooth(
            np.ascontiguousarray(x),
            np.ascontiguousarray(y),
            _noise(rows, columns, uniforms),
            rows.start,
            columns.start,
            spacing,
        )
        return self.marginal.quantile(ndtr(scores))

    def unresolved(self, along: float, across: float) -> str | None:
        """Return why a grid of these spacings [m] does not resolve the field, or None."""
        greatest = self.correlation_length / 2.0
        too_large = [
            f"{spacing * 1e6:.3g} um {direction} (take at least {spacing / greatest:.3g} times as"
            f" many {divisions})"
            for spacing, direction, divisions in (
                (along, "along rolling", "points"),
                (across, "across the track", "strips"),
            )
            if spacing > greatest * (1.0 + 1e-9)  # round-off of just that spacing is accepted
        ]
        if not too_large:
            return None
        return (
            f"the grid does not resolve a correlation length of {self.correlation_length * 1e6:.3g}"
            f" um, which needs spacings of half of it: they are {' and '.join(too_large)}"
        )


def _cells(position: FloatArray, spacing: float) -> range:
    """Return the indices of the lattice that contribute to points at these positions."""
    low, high = float(position.min()), float(position.max())
    return range(math.floor(low / spacing) - REACH + 1, math.floor(high / spacing) + REACH + 1)


def _noise(rows: range, columns: range, uniforms: Uniforms) -> FloatArray:
    """Return the normal scores of the lattice in a rectangle of cells."""
    from scipy.special import ndtri  # noqa: PLC0415  (slow to import)

    across = range(rows.start // _TILE_ROWS, (rows.stop - 1) // _TILE_ROWS + 1)
    along = range(columns.start // _TILE_COLUMNS, (columns.stop - 1) // _TILE_COLUMNS + 1)
    cells = _TILE_ROWS * _TILE_COLUMNS
    drawn = np.block(
        [
            [
                uniforms(((row + _TILES) * 2 * _TILES + column + _TILES) * cells, cells).reshape(
                    _TILE_ROWS, _TILE_COLUMNS
                )
                for column in along
            ]
            for row in across
        ]
    )
    top, left = rows.start % _TILE_ROWS, columns.start % _TILE_COLUMNS
    return np.asarray(ndtri(drawn[top : top + len(rows), left : left + len(columns)]))


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
        self.marginal, self.level = marginal, options.level
        self.correlation_time = options.correlation_time
        self.spacing = options.spacing or options.correlation_time / _STEPS

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
        name="white",
        factory=White,
        options=WhiteOptions,
        role="field",
        summary="independent friction at each point of the grid: depends on the grid",
        references=("Chevalier, Cloupet, Soize, Wear 258 (2005), DOI 10.1016/j.wear.2004.11.012",),
        protocol=2,
    ),
    RandomInputSpec(
        name="gaussian-field",
        factory=GaussianField,
        options=GaussianFieldOptions,
        role="field",
        summary="friction with a correlation length, independent of the grid",
        references=("Higdon, process convolutions (2002), DOI 10.1007/978-1-4471-0657-9_2",),
        protocol=2,
    ),
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
