"""Numbers of a maximum-entropy distribution, with rounding errors set to 0."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.uq.distributions.base import MaxentDistribution

_ROUNDING = 1e-12  # in standard deviations


def value(law: MaxentDistribution, number: float) -> float:
    """Return a value, or 0 if it is a rounding error near 0 inside the support."""
    low, high = law.support
    return 0.0 if low < 0.0 < high and abs(number) < _ROUNDING * law.std else number


def multipliers(law: MaxentDistribution) -> tuple[float, float, float]:
    """Return the multipliers l0, l1 and l2, with 0 for rounding errors of l1 and l2."""
    l0, l1, l2 = law.multipliers
    scale = law.std**2 if law.third == "x^2" else 1.0
    return (
        l0,
        0.0 if abs(l1) * law.std < _ROUNDING else l1,
        0.0 if abs(l2) * scale < _ROUNDING else l2,
    )


def parent(law: MaxentDistribution) -> tuple[float, float] | None:
    """Return mean and standard deviation of the parent normal distribution, if there is one."""
    return law.parent and (value(law, law.parent[0]), law.parent[1])
