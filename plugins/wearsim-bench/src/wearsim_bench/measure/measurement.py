"""What a benchmark has measured: costs beside errors, and who is beaten by nobody."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

#: gets what is being measured, and which part of the topic is done, 0 to 1
Tell = Callable[[str, float], object]


@dataclass(frozen=True)
class Effort:
    """How much to spend.

    Parameters
    ----------
    quick : bool
        Few cases, short tests: numbers that only show what there is.
    repetitions : int
        Of each timing; the least counts.
    plugin : str, optional
        The one contact model to be measured, beside the default.
    """

    quick: bool = False
    repetitions: int = 5
    plugin: str | None = None


@dataclass(frozen=True)
class Measurement:
    """One method with one setting, on one group of problems.

    Parameters
    ----------
    group : str
        The problems: "partial slip with spin".
    method : str
        What was measured: "slender, strip". Methods are lines in a figure.
    setting : str
        How finely: "81 strips"; settings are points on a line.
    seconds : float, optional
        Least time [s]; None where nothing could be timed.
    errors : mapping of str to float
        Relative errors by name, not negative; one that is not known is left out.
    counts : mapping of str to float
        What else was counted, by name: solves, bytes.
    default : bool
        Whether this is what a scenario gets that asks for nothing.
    failed : str
        Why there is no answer, if there is none.

    Raises
    ------
    ValueError
        If a number is not finite, or an error or the time is negative.
    """

    group: str
    method: str
    setting: str
    seconds: float | None = None
    errors: Mapping[str, float] = field(default_factory=dict)
    counts: Mapping[str, float] = field(default_factory=dict)
    default: bool = False
    failed: str = ""

    def __post_init__(self) -> None:
        """Refuse what would beat all others by being no number, and what JSON cannot hold."""
        time = {} if self.seconds is None else {"time": self.seconds}
        errors = {f"error '{name}'": value for name, value in self.errors.items()}
        counts = {f"count '{name}'": value for name, value in self.counts.items()}
        for name, value in {**time, **errors, **counts}.items():
            if not math.isfinite(value):
                raise ValueError(f"its {name} is {value}, not finite")
            if value < 0.0 and name not in counts:
                raise ValueError(f"its {name} is {value:g}, negative")

    def found(
        self,
        seconds: float | None,
        errors: Mapping[str, float],
        counts: Mapping[str, float] | None = None,
    ) -> Measurement:
        """Return it with what was found, or failed where that is not what it should be."""
        try:
            return replace(self, seconds=seconds, errors=errors, counts=counts or {})
        except ValueError as error:
            return replace(self, failed=str(error))


@dataclass(frozen=True)
class Topic:
    """What was measured of one thing, and how it is to be read.

    Parameters
    ----------
    name : str
        As at the shell: "contact".
    title : str
        What stands above it.
    about : str
        A sentence or two: what is timed, and what errors are against.
    seconds : str
        What the time is of: "one contact".
    error : str
        The error against which time is set.
    errors, counts : mapping of str to str
        Column heads of errors and counts by name, in the order of columns.
    measurements : tuple of Measurement
    floor : float
        Error of that which `error` is against: who is nearer than it cannot be told to be.
    """

    name: str
    title: str
    about: str
    seconds: str
    error: str
    errors: Mapping[str, str]
    counts: Mapping[str, str]
    measurements: tuple[Measurement, ...]
    floor: float = 0.0

    @property
    def groups(self) -> list[str]:
        """The groups of problems, in the order they were measured."""
        return list(dict.fromkeys(item.group for item in self.measurements))

    def of(self, group: str) -> list[Measurement]:
        """Return what was measured on a group of problems."""
        return [item for item in self.measurements if item.group == group]

    def front(self, group: str) -> list[Measurement]:
        """Return those that none beats in time and error both, the quickest first."""
        return pareto(self.of(group), self.error, self.floor)

    def as_json(self) -> dict[str, Any]:
        """Return everything as what JSON can hold, SI; `front` marks those that none beats."""
        best = {id(item) for group in self.groups for item in self.front(group)}
        rows = [{**asdict(item), "front": id(item) in best} for item in self.measurements]
        words = {"title": self.title, "about": self.about, "seconds": self.seconds}
        against = {"error": self.error, "floor": self.floor}
        heads = {"errors": dict(self.errors), "counts": dict(self.counts)}
        return {**words, **against, **heads, "measurements": rows}


def pareto(items: Iterable[Measurement], error: str, floor: float = 0.0) -> list[Measurement]:
    """Return those that none beats in time and error both, the quickest first.

    Parameters
    ----------
    items : iterable of Measurement
        Those without a time, or without that error, are left out.
    error : str
        Name of the error.
    floor : float
        Errors below it count as equal to it, so that the quicker of them wins.
    """

    def apart(item: Measurement) -> float:
        return max(item.errors[error], floor)

    known = [item for item in items if item.seconds is not None and error in item.errors]
    front: list[Measurement] = []
    for item in sorted(known, key=lambda item: (item.seconds, apart(item))):
        if not front or apart(item) < apart(front[-1]):
            front.append(item)
    return front
