"""What a run tells whoever watches it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True)
class Started:
    """A run has begun, or goes on from `from_passes`."""

    total_passes: float
    total_time: float
    from_passes: float
    stepper: str
    model: str


@dataclass(frozen=True)
class Stepped:
    """A step stands; SI units, `depth` and `depth_error` of the cylinder."""

    passes: float
    total_passes: float
    time: float
    depth: float
    step_passes: float
    depth_error: float
    wall_seconds: float


@dataclass(frozen=True)
class Warned:
    """Something the user should know."""

    message: str


@dataclass(frozen=True)
class Checkpointed:
    """The results file is up to date at `passes`."""

    path: str
    passes: float


@dataclass(frozen=True)
class Finished:
    """The run is done."""

    wall_seconds: float


Event: TypeAlias = Started | Stepped | Warned | Checkpointed | Finished
