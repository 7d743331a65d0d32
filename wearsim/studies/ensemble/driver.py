"""The work on an ensemble: batches go out, outcomes come in, and each goes into the file."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import islice

import numpy as np

from wearsim.errors import Interrupted, WorkerError
from wearsim.results import EnsembleFile, EnsembleResult, Outcome
from wearsim.results.ensemble.schema import DONE, FAILED, PENDING
from wearsim.studies.ensemble.interim_analyses import checkpoints, judged
from wearsim.studies.ensemble.progress import EnsembleProgress
from wearsim.studies.ensemble.realisation import RealisationRunner
from wearsim.studies.execution.base import Executor
from wearsim.uq.estimation.intervals import UNKNOWN
from wearsim.uq.estimation.stopping_rule import Target

SECONDS = 4.0  # that a batch should take; of twenty tests each costs a third more than of forty
MOST_IN_BATCH = 256
AHEAD = 3  # batches for each worker that may be beyond the next mark
BETWEEN_ESTIMATES = 0.5  # s
DEFAULT_TARGET = Target.parse("depth.mean 1%")


class EnsembleWork:
    """Runs what is pending in an ensemble's file.

    Which realisations an ensemble ends with depends on their outcomes alone: an estimate is held
    against its target at numbers of realisations that are fixed beforehand, and what lies beyond
    them is not written before they are passed.

    Parameters
    ----------
    file : EnsembleFile
        Open for writing.
    members : RealisationRunner
    target : Target, optional
        What ends the ensemble early.
    pool : Executor
    on_progress : callable, optional
        Told how far it has come.
    stop_requested : callable, optional
        Asked after every batch.
    """

    def __init__(
        self,
        file: EnsembleFile,
        members: RealisationRunner,
        target: Target | None,
        pool: Executor,
        on_progress: Callable[[EnsembleProgress], None] | None,
        stop_requested: Callable[[], bool] | None,
    ) -> None:
        self.file, self.members, self.target, self.pool = file, members, target, pool
        self.tell = on_progress or (lambda progress: None)
        self.stop_requested = stop_requested or (lambda: False)
        self.asked = len(file.status)
        self.begun, self.before = time.monotonic(), file.data.wall_seconds
        # what was judged of a finished ensemble is judged anew
        self.warnings = [] if file.data.finished else list(file.data.warnings)
        self._marks = checkpoints(members.plan, self.asked) if target else []
        self._limit = self._marks[0] if self._marks else self.asked
        self._held: dict[int, Outcome] = {}
        self._stopping = self._reached = False
        self._ahead = AHEAD * max(pool.workers, 1)
        self._run, self._rate = 0, 0.0
        self._shown, self._estimate = -math.inf, UNKNOWN

    def warn(self, text: str) -> None:
        """Keep a warning with the results."""
        if text not in self.warnings:
            self.warnings.append(text)

    def finish(self) -> None:
        """Run all that is pending.

        Raises
        ------
        Interrupted
            If it was stopped before the end.
        """
        self._pass_marks()
        while not (self._is_complete() or self._stopping):
            self._run_through(self._pending())
        if not self._is_complete():
            self._write_state(finished=False)
            raise self._interrupted()
        self._close()

    def run_again(self) -> None:
        """Run the realisations that failed once more; raises as `finish`.

        A finished ensemble is finished anew. Of one that is not, what is pending stays so.
        """
        numbers = np.flatnonzero(self.file.status == FAILED).tolist()
        finished = self.file.data.finished
        self._write_state(finished=False)  # before anything is cleared, or a kill would lose it
        self.file.clear(numbers)
        if finished:
            self.finish()
            return
        self._limit, self._marks = self.asked, []
        self._run_through(numbers)
        self._write_state(finished=False)
        if (self.file.status[numbers] == PENDING).any():
            raise self._interrupted()

    def _run_through(self, numbers: Iterable[int]) -> None:
        """Send numbers out in batches until there are no more, or a stop is asked for."""
        try:
            with closing(self.pool.results(self.members, self._batches(numbers))) as found:
                for _, outcomes in found:
                    self._take(outcomes)
                    self._stopping = self._stopping or self.stop_requested()
                    self._tell_progress()
                    if self._stopping or self._reached:
                        return  # what is out is left; it will be run again if it is needed
        except WorkerError as error:
            self._run_singly(error)
        except KeyboardInterrupt:
            self._stopping = True

    def _run_singly(self, error: WorkerError) -> None:
        """Find which of the realisations that workers died of is at fault, and let it fail."""
        suspects = [n for n in error.realisations if self.file.status[n] == PENDING]
        if not suspects:
            raise error
        for number in suspects:
            if self._stopping:
                return
            try:
                found = self.pool.results(self.members, iter([[number]]))
                outcomes = [outcome for _, some in found for outcome in some]
            except WorkerError:
                text = "the worker that ran it died each time: out of memory, or killed"
                outcomes = [Outcome(number=number, error=text)]
            self._take(outcomes)
            self._stopping = self.stop_requested()
            self._tell_progress()

    def _pending(self) -> Iterator[int]:
        """Yield pending realisations, no further beyond the next mark than keeps workers busy."""
        for number in np.flatnonzero(self.file.status == PENDING):
            if self._reached or number >= self._limit + self._ahead:
                return
            if number not in self._held:
                yield int(number)

    def _batches(self, numbers: Iterable[int]) -> Iterator[list[int]]:
        """Yield batches of numbers; which of them share one changes nothing."""
        remaining = iter(numbers)
        while batch := list(islice(remaining, self._batch_size())):
            yield batch

    def _batch_size(self) -> int:
        """Return as many as take `SECONDS`, and no more than let all workers end together."""
        workers = max(self.pool.workers, 1)
        left = self.asked - int((self.file.status != PENDING).sum())
        fair = -(-left // (2 * workers))
        most = max(min(fair, MOST_IN_BATCH), 1)
        size = int(np.clip(SECONDS * self._rate / workers, 1, most))
        self._ahead = AHEAD * workers * size
        return size

    def _take(self, outcomes: Sequence[Outcome]) -> None:
        """Write outcomes, those beyond the next mark later."""
        now = [item for item in outcomes if item.number < self._limit]
        self._held.update({item.number: item for item in outcomes if item.number >= self._limit})
        self._run += len(outcomes)
        self._rate = self._run / max(time.monotonic() - self.begun, 1e-9)
        if now and not self._reached:
            self.file.put(now)
        self._pass_marks()

    def _pass_marks(self) -> None:
        """Go on to the next mark for as long as all realisations before this one are there."""
        while self._marks and not self._reached:
            if (self.file.status[: self._limit] == PENDING).any():
                return
            if self.target and self.target.reached(self._result().estimate_for(self.target)):
                self._reached = True
                return
            self._marks = self._marks[1:]
            self._limit = self._marks[0] if self._marks else self.asked
            due = sorted(number for number in self._held if number < self._limit)
            if due:
                self.file.put([self._held.pop(number) for number in due])

    def _is_complete(self) -> bool:
        return self._reached or not (self.file.status == PENDING).any()

    def _result(self) -> EnsembleResult:
        """Return what is in the file by now."""
        data = replace(self.file.data, status=self.file.status.copy())
        return EnsembleResult(data, self.file.path)

    def _close(self) -> None:
        """Write what is only known at the end."""
        result = self._result()
        if result.count:
            self.file.put_statistics(result.statistics())
        for text in judged(result, self.target, self._reached):
            self.warn(text)
        self._write_state(finished=True, statistics=result.told_estimates())

    def _write_state(self, finished: bool, statistics: object = None) -> None:
        self.file.put_state(
            {
                "finished": finished,
                "warnings": self.warnings,
                "wall_seconds": self.before + time.monotonic() - self.begun,
                "statistics": statistics or {},
            }
        )

    def _interrupted(self) -> Interrupted:
        done = int((self.file.status != PENDING).sum())
        return Interrupted(
            f"stopped after {done} of {self.asked} realisations; go on with: wearsim resume"
            f" {self.file.path}"
        )

    def _tell_progress(self) -> None:
        status = self.file.status
        done, failed = int((status == DONE).sum()), int((status == FAILED).sum())
        target = self.target or DEFAULT_TARGET
        now = time.monotonic()
        if done and now - self._shown > BETWEEN_ESTIMATES:
            self._shown = now
            self._estimate = target.interval(self._result().estimate_for(target))
        left = self.asked - done - failed
        self.tell(
            EnsembleProgress(
                done=done,
                failed=failed,
                asked=self.asked,
                rate=self._rate,
                left=left / self._rate if self._rate else math.nan,
                what=target.what,
                estimate=self._estimate,
                workers=self.pool.describe,
            )
        )
