"""Maximum-entropy distributions for given moments (Shannon 1948, Jaynes 1957)."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from wearsim.errors import WearsimError
from wearsim.types import FloatArray
from wearsim.uq.distributions import maxent_solver
from wearsim.uq.distributions.base import (
    Exponential,
    MaxentDistribution,
    Mirrored,
    Uniform,
)
from wearsim.uq.distributions.truncated_normal import (
    InverseTable,
    Piece,
    QuadraticExponent,
    TruncatedNormal,
    has_parent,
)

_LARGE = 50.0  # shape above which digamma and logarithm cancel
_ROUNDING = 1e-12
_RAREST = 1e-12  # least probability of a peak at the far end of the support
_SMALLEST, _LARGEST = 1e-150, 1e150  # range in which squares and their inverses are finite
_OTHER_UNIT = "choose a unit in which it is between 1e-150 and 1e150"


class Gamma(MaxentDistribution):
    """The gamma distribution of given mean and mean logarithm.

    Parameters
    ----------
    mean, mean_log : float
        E{x} and E{log x}, less than the logarithm of the mean.
    """

    family = "gamma"
    third = "log x"

    def __init__(self, mean: float, mean_log: float) -> None:
        self.support, self.mean = (0.0, math.inf), mean
        self._shape = shape = gamma_shape(math.log(mean) - mean_log)
        self.std = mean / math.sqrt(shape)
        rate = shape / mean
        self.multipliers = (math.lgamma(shape) - shape * math.log(rate), rate, 1.0 - shape)

    @cached_property
    def _table(self) -> InverseTable:
        """Quantiles of log(x/mean)."""
        k = self._shape

        def log_density(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            return k * (y - np.expm1(y)), -k * np.expm1(y), -k * np.exp(y)

        ends = (-math.inf, math.inf)
        return InverseTable(
            [Piece(0.0, 1.0, log_density, end, lambda y: 0.5 + 0.1 * abs(y)) for end in ends]
        )

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        return self.mean * np.exp(self._table.values(below, above))

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the logarithm of the density at `x`, which must be within the support."""
        y = np.log(np.maximum(x, 1e-300) / self.mean)
        logs = self._shape * (y - np.expm1(y)) - y
        return np.asarray(logs - self._table.log_total - math.log(self.mean))


def gamma_shape(gap: float) -> float:
    """Return the shape k of the gamma distribution with ``log k - digamma(k) = gap`` > 0."""
    from scipy.special import digamma, zeta  # noqa: PLC0415  (slow to import, rarely needed)

    # within 1.5 %: Minka, Estimating a Gamma, 2002
    shape = (3.0 - gap + math.sqrt((gap - 3.0) ** 2 + 24.0 * gap)) / (12.0 * gap)
    for _ in range(5):  # Newton's method for 1/k, in which the function is nearly linear
        if shape > _LARGE:  # asymptotic series, without cancellation
            series = 1.0 / 12.0 - 1.0 / (120.0 * shape**2) + 1.0 / (252.0 * shape**4)
            excess = 0.5 / shape - gap + series / shape**2
            slope = 0.5 + 1.0 / (6.0 * shape)
        else:
            excess = math.log(shape) - float(digamma(shape)) - gap
            slope = shape**2 * float(zeta(2.0, shape)) - shape
        shape = 1.0 / (1.0 / shape - excess / slope)
    return shape


class Infeasible(WearsimError, ValueError):  # noqa: N818  (established term)
    """No maximum-entropy distribution exists for the given support and moments."""

    exit_code = 2


def maximum_entropy(
    support: tuple[float, float],
    mean: float | None = None,
    std: float | None = None,
    mean_log: float | None = None,
) -> MaxentDistribution:
    """Return the distribution of maximum entropy for a given support and moments.

    Parameters
    ----------
    support : tuple of float
        Least and greatest possible value; either may be infinite.
    mean : float, optional
        Mean.
    std : float, optional
        Standard deviation; needs the mean.
    mean_log : float, optional
        Mean of the natural logarithm, instead of the standard deviation; needs the support
        [0, inf) and the mean.

    Returns
    -------
    MaxentDistribution
        Uniform, exponential, normal, truncated normal, exponential of a quadratic, or gamma.

    Raises
    ------
    Infeasible
        A ValueError that states the violated limit.
    """
    low, high = (float(end) for end in support)
    _check(low, high, mean, std, mean_log)
    if mean is None:
        return Uniform(low, high)
    if mean_log is not None:
        return Gamma(mean, mean_log)
    if high - mean < mean - low:
        return Mirrored(_towards_lower(-high, -low, -mean, std))
    return _towards_lower(low, high, mean, std)


def _check(
    low: float, high: float, mean: float | None, std: float | None, mean_log: float | None
) -> None:
    """Raise unless the maximum-entropy distribution exists."""
    _require(low < high, f"the support must increase, got {low:g} to {high:g}")
    support = _interval(low, high)
    finite = math.isfinite(low) and math.isfinite(high)
    _require(
        not finite or math.isfinite(high - low),
        f"the support {support} is too wide: its width overflows",
    )
    for name, value in {"mean": mean, "std": std, "mean_log": mean_log}.items():
        _require(value is None or math.isfinite(value), f"{name} must be finite, got {value}")
    _check_sizes(low, high, mean, std)
    if mean_log is not None:
        _check_logarithm(low, high, mean, std, mean_log)
    elif mean is None:
        if std is not None:
            raise Infeasible(
                f"a std alone determines no distribution, got std {std:g}; give the mean too"
            )
        _require(
            finite,
            f"the support {support} alone determines no distribution, since it is unbounded; give a"
            " mean, or finite limits",
        )
    else:
        _require(low < mean < high, f"mean {mean:g} is not inside the support {support}")
        _require(
            std is not None or math.isfinite(low) or math.isfinite(high),
            f"mean {mean:g} alone determines no distribution on (-inf, inf); give the std too, or a"
            " limit",
        )
        if std is not None:
            _check_spread(low, high, mean, std)


def _require(condition: bool, text: str) -> None:
    if not condition:
        raise Infeasible(text)


def _check_sizes(low: float, high: float, mean: float | None, std: float | None) -> None:
    """Raise if a square or its inverse would overflow."""
    nearer = None if mean is None else min(mean - low, high - mean)
    for name, size in {
        "std": std,
        "the width of the support": high - low,
        "the distance from the mean to the nearer end": nearer,
    }.items():
        if size is not None and 0.0 < size < _SMALLEST:
            raise Infeasible(f"{name} {size:g} is too small to be squared; {_OTHER_UNIT}")
    for name, place in {"low": low, "high": high, "mean": mean, "std": std}.items():
        if place is not None and _LARGEST < abs(place) < math.inf:
            raise Infeasible(f"{name} {place:g} is too large to be squared; {_OTHER_UNIT}")


def _check_spread(low: float, high: float, mean: float, std: float) -> None:
    """Raise unless a distribution on the support can have this mean and standard deviation."""
    _require(std > 0.0, f"std {std:g} is not above zero")
    below, above = mean - low, high - mean
    least = min(below, above)
    if math.isinf(least):
        return
    more = (
        f"std {std:g} is more than {'mean - low' if below < above else 'high - mean'} = {least:g}"
    )
    support = _interval(low, high)
    if math.isinf(max(below, above)):
        _require(
            std <= least * (1.0 + _ROUNDING),
            f"{more}, the limit of a maximum-entropy distribution on {support}",
        )
        return
    limit = math.sqrt(below) * math.sqrt(above)
    _require(
        std < limit * (1.0 - _ROUNDING),
        f"std {std:g} is not less than sqrt((mean - low) (high - mean)) = {limit:g}, the limit of"
        f" any distribution on {support} with mean {mean:g}",
    )
    weight = _far_peak(least / (high - low), std / (high - low))[1]
    _require(
        std <= least * (1.0 + _ROUNDING) or least >= 0.02 * (high - low) or weight >= _RAREST,
        f"{more}, which requires a probability of {weight:.0e} at the far end of {support}, too"
        " small to occur in any sample; lower the std",
    )


def _check_logarithm(
    low: float, high: float, mean: float | None, std: float | None, mean_log: float
) -> None:
    name = f"mean_log {mean_log:g}"
    if mean is None:
        raise Infeasible(f"{name} needs the mean too")
    if std is not None:
        raise Infeasible(f"{name} replaces the std, got std {std:g}; leave one out")
    _require(
        (low, high) == (0.0, math.inf),
        f"mean_log needs the support [0, inf), got {_interval(low, high)}",
    )
    _require(mean > 0.0, f"mean {mean:g} is not inside the support [0, inf)")
    _require(mean_log < math.log(mean), f"{name} is not less than log(mean) = {math.log(mean):g}")


def _interval(low: float, high: float) -> str:
    start = f"[{low:g}" if math.isfinite(low) else f"({low:g}"
    return f"{start}, {high:g}]" if math.isfinite(high) else f"{start}, {high:g})"


def _towards_lower(low: float, high: float, mean: float, std: float | None) -> MaxentDistribution:
    """Return the distribution for a mean nearer the lower end, or in the middle."""
    if math.isinf(low):
        assert std is not None
        return TruncatedNormal(low, high, mean, std)
    width, reach = high - low, mean - low
    fall, widest = width / reach, reach  # of an exponential distribution without upper end
    if fall < 50.0:  # otherwise the effect of the upper end is below rounding
        fall = _exponential_fall(reach / width)
        reach, widest = width / (fall or 1.0), width * _exponential_moments(fall)[1]
    if std is None or abs(std - widest) <= _ROUNDING * widest:
        if fall == 0.0:
            return Uniform(low, high)
        return Exponential(low, high, 1.0 / reach, mean, widest)
    if std < widest:
        return _one_peak(low, high, mean, std)
    return _two_ends(low, high, mean, std, fall)


def _exponential_moments(fall: float) -> tuple[float, float]:
    """Return mean and standard deviation of the density exp(-fall t) truncated to [0, 1]."""
    from scipy.special import hyp1f1  # noqa: PLC0415  (slow to import, and rarely needed)

    mass, first, second = (float(hyp1f1(k, k + 1, -fall)) / k for k in (1, 2, 3))
    mean = first / mass
    return mean, math.sqrt(second / mass - mean * mean)


def _exponential_fall(mean: float) -> float:
    """Return `fall` for a mean between 0.02 and 0.5."""
    fall = 12.0 * (0.5 - mean)  # exact to rounding near the uniform distribution
    for _ in range(12 if fall > 1e-7 else 0):
        current, std = _exponential_moments(fall)
        fall += (current - mean) / std**2
    return fall


def _one_peak(low: float, high: float, mean: float, std: float) -> MaxentDistribution:
    """Return the distribution for a std below the exponential one's: a truncated normal."""
    start = (low - mean) / std
    z, weights = maxent_solver.even_quadrature(
        max(start, -maxent_solver.FAR), min((high - mean) / std, maxent_solver.FAR)
    )
    basis = maxent_solver.Basis(np.stack([z, z * z]), np.array([0.0, 1.0]), np.eye(2))
    slope, bend = maxent_solver.multipliers(weights, [basis], [(0.0, 0.5)])
    if bend <= 0.0:  # only by rounding
        return Exponential(low, high, slope / std, mean, std)
    parent = mean - 0.5 * std * slope / bend, std / math.sqrt(2.0 * bend)
    if has_parent(low, high, *parent):
        return TruncatedNormal(low, high, *parent)
    return QuadraticExponent(low, high, std, slope + 2.0 * bend * start, bend)


def _two_ends(low: float, high: float, mean: float, std: float, fall: float) -> MaxentDistribution:
    """Return the distribution for a std above the exponential one's: l2 < 0, with an antimode.

    The exponent is a combination of ``t (1 - t)`` and t, with t from 0 to 1 over the support, which
    is exact at both ends.
    """
    width = high - low
    part, spread = (mean - low) / width, std / width
    dent = part * ((high - mean) / width) - spread * spread
    guess, _ = _far_peak(part, spread)
    t, rest, weights = maxent_solver.graded_quadrature(min(part, dent))
    bases = [
        maxent_solver.Basis(np.stack([t * rest, t]), np.array([dent, part]), np.eye(2)),
        maxent_solver.Basis(
            np.stack([t * t, t]),
            np.array([spread * spread + part * part, part]),
            np.array([[-1.0, 1.0], [0.0, 1.0]]),
        ),
    ]
    bend, top = maxent_solver.multipliers(weights, bases, [(0.0, fall), guess])
    return QuadraticExponent(low, high, width, bend + top, -bend, bend - top, top)


def _far_peak(part: float, spread: float) -> tuple[tuple[float, float], float]:
    """Return starting multipliers for a density with a peak at the far end, and its probability.

    The density is approximated by an exponential one and a point mass with the prescribed mean and
    standard deviation.
    """
    weight = 0.5 * part
    for _ in range(30):
        point = spread**2 + part**2 - 2.0 * (part - weight) ** 2 / (1.0 - weight)
        weight = min(max(point, 1e-300), 0.999 * part)
    top = math.log((1.0 - weight) / weight)
    return ((1.0 - weight) / (part - weight) - top, top), weight
