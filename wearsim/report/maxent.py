"""Numbers of a maximum-entropy distribution without rounding errors."""

from __future__ import annotations

from wearsim.uq.distributions.base import MaxentDistribution

_ROUNDING = 1e-12  # in standard deviations


def without_rounding(distribution: MaxentDistribution, number: float) -> float:
    """Return a value, or 0 if it is a rounding error near 0 inside the support."""
    low, high = distribution.support
    return 0.0 if low < 0.0 < high and abs(number) < _ROUNDING * distribution.std else number


def multipliers(distribution: MaxentDistribution) -> tuple[float, float, float]:
    """Return the multipliers l0, l1 and l2, with 0 for rounding errors of l1 and l2."""
    l0, l1, l2 = distribution.multipliers
    scale = distribution.std**2 if distribution.third == "x^2" else 1.0
    return (
        l0,
        0.0 if abs(l1) * distribution.std < _ROUNDING else l1,
        0.0 if abs(l2) * scale < _ROUNDING else l2,
    )


def parent(distribution: MaxentDistribution) -> tuple[float, float] | None:
    """Return mean and standard deviation of the parent normal distribution, if there is one."""
    return distribution.parent and (
        without_rounding(distribution, distribution.parent[0]),
        distribution.parent[1],
    )
