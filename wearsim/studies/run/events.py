"""Events of a run, for the callback of `run` and `resume`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True)
class Started:
    """Start of a run, or its continuation from `from_passes`."""

    total_passes: float
    total_time: float
    from_passes: float
    stepper: str
    model: str


@dataclass(frozen=True)
class Stepped:
    """An accepted step; SI units, `depth` and `depth_error` of the cylinder."""

    passes: float
    total_passes: float
    time: float
    depth: float
    step_passes: float
    depth_error: float
    wall_seconds: float


@dataclass(frozen=True)
class Warned:
    """A warning for the user."""

    message: str


@dataclass(frozen=True)
class Checkpointed:
    """A checkpoint in the results file at `passes`."""

    path: str
    passes: float


@dataclass(frozen=True)
class Finished:
    """End of the run."""

    wall_seconds: float


Event: TypeAlias = Started | Stepped | Warned | Checkpointed | Finished
