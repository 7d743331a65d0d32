"""Measured times and errors, and the Pareto front."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

#: called with a description of the current measurement and the completed fraction of the topic
OnProgress = Callable[[str, float], object]


@dataclass(frozen=True)
class Effort:
    """Extent of a benchmark.

    Parameters
    ----------
    quick : bool
        Few cases and short tests, for a trial run.
    repetitions : int
        Repetitions of each timing; the smallest time is used.
    plugin : str, optional
        Contact model to measure in addition to the default; None for all.
    against : str, optional
        Contact model whose solutions are the exact ones of the topic "contact"; None for the
        stored solutions.
    """

    quick: bool = False
    repetitions: int = 5
    plugin: str | None = None
    against: str | None = None


@dataclass(frozen=True)
class Measurement:
    """Time and errors of one method with one setting on one group of problems.

    Parameters
    ----------
    group : str
        Group of problems: "partial slip with spin".
    method : str
        Method: "slender, strip"; a line in a figure.
    setting : str
        Resolution or tolerance: "81 strips"; a point on a line.
    seconds : float, optional
        Smallest time [s]; None if it was not timed.
    errors : mapping of str to float
        Relative errors by name, not negative; unknown errors are omitted.
    counts : mapping of str to float
        Other numbers by name: solves, bytes.
    default : bool
        Whether this is the default method and setting of a scenario.
    failed : str
        Reason of a failure; empty if there is none.
    remark : str
        Text for the last column of a table.

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
    remark: str = ""

    def __post_init__(self) -> None:
        time = {} if self.seconds is None else {"time": self.seconds}
        errors = {f"error '{name}'": value for name, value in self.errors.items()}
        counts = {f"count '{name}'": value for name, value in self.counts.items()}
        for name, value in {**time, **errors, **counts}.items():
            if not math.isfinite(value):
                raise ValueError(f"the {name} is {value}, not finite")
            if value < 0.0 and name not in counts:
                raise ValueError(f"the {name} is {value:g}, negative")

    def with_results(
        self,
        seconds: float | None,
        errors: Mapping[str, float],
        counts: Mapping[str, float] | None = None,
    ) -> Measurement:
        """Return the measurement with results, or as failed if one of them is invalid."""
        try:
            return replace(self, seconds=seconds, errors=errors, counts=counts or {})
        except ValueError as error:
            return replace(self, failed=str(error))


@dataclass(frozen=True)
class Topic:
    """Measurements of one topic, with titles and column heads.

    Parameters
    ----------
    name : str
        Name on the command line: "contact".
    title : str
        Title of figure and tables.
    about : str
        Definition of the time and of the errors.
    seconds : str
        The timed operation: "one contact".
    error : str
        Name of the error that is plotted against time.
    errors, counts : mapping of str to str
        Column heads of errors and counts by name, in the order of columns.
    measurements : tuple of Measurement
        The measurements, group by group.
    floor : float
        Relative error of the reference; smaller errors cannot be distinguished.
    details : tuple of str
        Groups that tables show only if all measurements are requested.
    conclusions : mapping of str to str
        Sentence on the measurements of a group, by group.
    timing : str
        How times were obtained, if not as the smallest of all repetitions.
    files : mapping of str to str
        Content of further files by name, written to a folder with the name of the topic.
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
    details: tuple[str, ...] = ()
    conclusions: Mapping[str, str] = field(default_factory=dict)
    timing: str = ""
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def groups(self) -> list[str]:
        """Groups of problems in the order of measurement."""
        return list(dict.fromkeys(item.group for item in self.measurements))

    def of(self, group: str) -> list[Measurement]:
        """Return the measurements of a group of problems."""
        return [item for item in self.measurements if item.group == group]

    def front(self, group: str) -> list[Measurement]:
        """Return the Pareto front of time and error of a group, the fastest first."""
        return pareto(self.of(group), self.error, self.floor)

    def as_json(self) -> dict[str, Any]:
        """Return the topic for JSON, in SI units; `front` marks the Pareto front."""
        in_front = {id(item) for group in self.groups for item in self.front(group)}
        rows = [{**asdict(item), "front": id(item) in in_front} for item in self.measurements]
        words = {"name": self.name, "title": self.title, "about": self.about}
        words |= {"seconds": self.seconds}
        words |= {"timing": self.timing} if self.timing else {}
        against = {"error": self.error, "floor": self.floor}
        heads = {"errors": dict(self.errors), "counts": dict(self.counts)}
        concluded = {"details": list(self.details), "conclusions": dict(self.conclusions)}
        return {**words, **against, **heads, **concluded, "measurements": rows}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Topic:
        """Return the topic of an object that `as_json` returned."""
        rows = tuple(
            Measurement(**{key: value for key, value in row.items() if key != "front"})
            for row in data["measurements"]
        )
        known = {item.name: data[item.name] for item in fields(cls) if item.name in data}
        return cls(**{**known, "measurements": rows, "details": tuple(data["details"])})


def pareto(items: Iterable[Measurement], error: str, floor: float = 0.0) -> list[Measurement]:
    """Return the Pareto front of time and error, the fastest first.

    Parameters
    ----------
    items : iterable of Measurement
        Items without a time or without this error are ignored.
    error : str
        Name of the error.
    floor : float
        Smaller errors are treated as equal to it.
    """

    def error_of(item: Measurement) -> float:
        return max(item.errors[error], floor)

    known = [item for item in items if item.seconds is not None and error in item.errors]
    front: list[Measurement] = []
    for item in sorted(known, key=lambda item: (item.seconds, error_of(item))):
        if not front or error_of(item) < error_of(front[-1]):
            front.append(item)
    return front
