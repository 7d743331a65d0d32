"""What an ensemble tells while it runs."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.uq.estimation.intervals import Interval


@dataclass(frozen=True)
class EnsembleProgress:
    """How far an ensemble has come.

    Parameters
    ----------
    done, failed, asked : int
        Realisations that ended well, that failed, and that were asked for at most.
    rate : float
        Realisations per second since this process began on it.
    left : float
        Time it still takes if all that were asked for are needed [s]; nan where unknown.
    what : str
        What is estimated, "depth.mean".
    estimate : Interval
        Its estimate so far.
    workers : str
        Who works, "2 processes".
    """

    done: int
    failed: int
    asked: int
    rate: float
    left: float
    what: str
    estimate: Interval
    workers: str
