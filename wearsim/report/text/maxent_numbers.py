"""Numbers of a law of maximum entropy as they are told: what is mere rounding is 0."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearsim.uq.distributions.base import MaxentDistribution

ROUNDING = 1e-12
"""Part of the standard deviation below which a value is rounding."""


def value(law: MaxentDistribution, number: float) -> float:
    """Return a value, or 0 where it is rounding: near 0 within a support on both sides of it."""
    low, high = law.support
    return 0.0 if low < 0.0 < high and abs(number) < ROUNDING * law.std else number


def multipliers(law: MaxentDistribution) -> tuple[float, float, float]:
    """Return l0, l1 and l2, each 0 where it changes the density by rounding alone."""
    l0, l1, l2 = law.multipliers
    of_third = law.std**2 if law.third == "x^2" else 1.0
    return (
        l0,
        0.0 if abs(l1) * law.std < ROUNDING else l1,
        0.0 if abs(l2) * of_third < ROUNDING else l2,
    )


def parent(law: MaxentDistribution) -> tuple[float, float] | None:
    """Return mean and standard deviation of the parent normal law, if there is one."""
    found = law.parent
    return None if found is None else (value(law, found[0]), found[1])
