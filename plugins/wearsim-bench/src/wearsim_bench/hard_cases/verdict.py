"""What is held of a hard case: measured numbers, the bounds they keep, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

LEAST_ORDER = 0.4  # a path of a random process lets errors fall no faster than the root of a step

#: what is measured, in the order of columns, and what it is
CHECKS: Mapping[str, str] = {
    "volume": "worn volume less K/H times dissipated energy",
    "energy": "energy less the sum of P_l dy over strips and half steps",
    "work": "power less that of the forces on the creepages",
    "load": "sum of q dy less the load",
    "oscillation": "second difference of q on the finest strips, over its peak",
    "drift": "centre of a symmetric groove, over its width",
    "tolerance": "change of depth and volume with a tenth of the tolerance",
    "steps": "change of the profile from halving forced steps",
    "strips": "change of the profile from doubling strips",
    "mirror": "profile less that of the mirrored test",
}


@dataclass(frozen=True)
class Check:
    """A relative number that may not be above a bound.

    Parameters
    ----------
    name : str
        A key of `CHECKS`.
    value, bound : float
        What was found, and the most that holds.
    order : float, optional
        Of convergence, where the value is a change from one refinement to the next.
    floor : float
        Change below which the order is noise: the edge of a contact falls anywhere in a strip.
    """

    name: str
    value: float
    bound: float
    order: float | None = None
    floor: float = 0.0

    @property
    def falls(self) -> bool:
        """Whether the change falls with refinement, or is too small to tell."""
        return self.order is None or self.value <= self.floor or self.order >= LEAST_ORDER

    @property
    def holds(self) -> bool:
        """Whether the bound is kept; never by a value that is not a number."""
        return self.value <= self.bound and self.falls

    @property
    def failure(self) -> str:
        """What does not hold, or nothing."""
        if self.holds:
            return ""
        if self.value <= self.bound:
            return f"{self.name} {self.value:.1e} does not fall (order {self.order:.1f})"
        return f"{self.name} {self.value:.1e} > {self.bound:.0e}"


@dataclass(frozen=True)
class Verdict:
    """What became of a hard case.

    Parameters
    ----------
    case : str
        Its name.
    said : str
        Text of the error it ended with; empty where it ran to its end.
    trouble : str
        What went wrong that no number tells: an error where none was expected, or the reverse.
    checks : tuple of Check
    figures : mapping of str to float
        The end of the test in SI, for those who want to see that it is one.
    """

    case: str
    said: str = ""
    trouble: str = ""
    checks: tuple[Check, ...] = ()
    figures: Mapping[str, float] = field(default_factory=dict)

    @property
    def failures(self) -> tuple[str, ...]:
        """Everything that does not hold."""
        told = (self.trouble, *(check.failure for check in self.checks))
        return tuple(text for text in told if text)

    @property
    def holds(self) -> bool:
        """Whether the case is as it should be."""
        return not self.failures

    def check(self, name: str) -> Check | None:
        """Return a check by name, or None where it does not apply."""
        return next((check for check in self.checks if check.name == name), None)

    def as_json(self) -> dict[str, Any]:
        """Return everything as what JSON can hold."""
        checks = [{**asdict(check), "holds": check.holds} for check in self.checks]
        words = {"case": self.case, "holds": self.holds, "failures": list(self.failures)}
        return {**words, "said": self.said, "checks": checks, "figures": dict(self.figures)}
