"""Criteria of a hard case with their bounds, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

MIN_ORDER = 0.4  # with a random process, errors decrease as the square root of the step

#: criteria in the order of columns, with their definitions
CRITERIA: Mapping[str, str] = {
    "volume": "worn volume minus K/H times dissipated energy",
    "energy": "energy minus the integral of P_l over strips and time, by the trapezoidal rule",
    "work": "power minus that of the forces and creepages",
    "load": "sum of q dy minus the load",
    "oscillation": "second difference of q on the finest strips, relative to its peak",
    "drift": "centre of a symmetric groove, relative to its width",
    "truth": "greatest depth minus that of rigid bodies in full slip, where it is known",
    "tolerance": "change of depth and volume with a tenth of the tolerance",
    "steps": "change of the profile from halving fixed steps",
    "strips": "change of the profile from doubling strips",
    "mirror": "profile minus that of the mirrored test",
}


@dataclass(frozen=True)
class Criterion:
    """A relative error with an upper bound.

    Parameters
    ----------
    name : str
        A key of `CRITERIA`.
    value, bound : float
        The error and its upper bound.
    order : float, optional
        Order of convergence, if the value is a change from one refinement to the next.
    floor : float
        Change below which no order is required: the position of a contact edge within a strip is
        arbitrary.
    """

    name: str
    value: float
    bound: float
    order: float | None = None
    floor: float = 0.0

    @property
    def converges(self) -> bool:
        """Whether the change decreases with refinement or is below the floor."""
        return self.order is None or self.value <= self.floor or self.order >= MIN_ORDER

    @property
    def holds(self) -> bool:
        """Whether the criterion is met; False for NaN."""
        return self.value <= self.bound and self.converges

    @property
    def failure(self) -> str:
        """Description of a failure; empty if the criterion is met."""
        if self.holds:
            return ""
        if self.value <= self.bound:
            return f"{self.name} {self.value:.1e} does not decrease (order {self.order:.1f})"
        return f"{self.name} {self.value:.1e} > {self.bound:.0e}"


@dataclass(frozen=True)
class Verdict:
    """Outcome of a hard case.

    Parameters
    ----------
    case : str
        Name of the case.
    error : str
        Message of the error that ended it; empty if it completed.
    unexpected : str
        Unexpected outcome: an error where none is expected, or the reverse.
    criteria : tuple of Criterion
        Measured criteria.
    figures : mapping of str to float
        Final results in SI units.
    """

    case: str
    error: str = ""
    unexpected: str = ""
    criteria: tuple[Criterion, ...] = ()
    figures: Mapping[str, float] = field(default_factory=dict)

    @property
    def failures(self) -> tuple[str, ...]:
        """Descriptions of all failures."""
        texts = (self.unexpected, *(item.failure for item in self.criteria))
        return tuple(filter(None, texts))

    @property
    def holds(self) -> bool:
        """Whether the case passed."""
        return not self.failures

    def criterion(self, name: str) -> Criterion | None:
        """Return a criterion by name, or None if it does not apply."""
        return next((item for item in self.criteria if item.name == name), None)

    def as_json(self) -> dict[str, Any]:
        """Return the verdict for JSON."""
        checks = [{**asdict(item), "holds": item.holds} for item in self.criteria]
        words = {"case": self.case, "holds": self.holds, "failures": list(self.failures)}
        words |= {"unexpected": self.unexpected, "said": self.error}
        return {**words, "checks": checks, "figures": dict(self.figures)}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Verdict:
        """Return the verdict of an object that `as_json` returned."""
        criteria = tuple(
            Criterion(**{key: value for key, value in item.items() if key != "holds"})
            for item in data["checks"]
        )
        return cls(data["case"], data["said"], data["unexpected"], criteria, data["figures"])
