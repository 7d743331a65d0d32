"""Execution of an ensemble: distribution of realisations, storage of outcomes, stopping rule."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np

from wearsim.errors import Interrupted, WorkerError
from wearsim.studies.ensemble.batch_sizes import BatchSizes
from wearsim.studies.ensemble.designs import interim_sizes
from wearsim.studies.ensemble.file.data import EnsembleData, Outcome
from wearsim.studies.ensemble.file.schema import DONE, FAILED, PENDING
from wearsim.studies.ensemble.file.writer import EnsembleFile
from wearsim.studies.ensemble.realisation import RealisationRunner
from wearsim.studies.ensemble.result import EnsembleResult
from wearsim.studies.execution.processes import Executor
from wearsim.studies.plausibility import plausibility_warnings
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray
from wearsim.uq.estimation.estimates import Target
from wearsim.uq.estimation.intervals import UNKNOWN, Interval

AHEAD = 3  # batches for each worker that may be beyond the next interim analysis
BETWEEN_ESTIMATES = 0.5  # s
DEFAULT_TARGET, DEFAULT_OF_LIVES = Target.parse("depth.mean 1%"), Target.parse("b10 3%")


@dataclass(frozen=True)
class EnsembleProgress:
    """Progress of an ensemble.

    Parameters
    ----------
    done, failed, requested : int
        Numbers of realisations: successful, failed, and maximum.
    rate : float
        Realisations per second in this process.
    left : float
        Estimated time until the maximum number is reached [s]; nan in the first batches.
    what : str
        Name of the estimate, "depth.mean".
    estimate : Interval
        Its current value.
    workers : str
        Description of the workers, "2 processes".
    """

    done: int
    failed: int
    requested: int
    rate: float
    left: float
    what: str
    estimate: Interval
    workers: str


def ensemble_warnings(result: EnsembleResult, target: Target | None, reached: bool) -> list[str]:
    """Return warnings about a finished ensemble.

    Parameters
    ----------
    result : EnsembleResult
    target : Target, optional
    reached : bool
        Whether the target was reached.

    Returns
    -------
    list of str
    """
    beyond, worst = 0, 0.0
    if result.count:
        deepest = np.maximum(result.at_end("depth"), result.at_end("roller_depth"))
        error = result.values("depth_error")
        beyond = int((error > result.raw.tolerance * deepest).sum())
        worst = float(np.divide(error, deepest, out=np.zeros_like(error), where=deepest > 0).max())
    processes = [item["name"] for item in result.raw.groups if item["role"] == "process"]
    warnings = (
        (
            beyond > 0,
            (
                f"the estimated error of depth exceeds the tolerance in {beyond} of {result.count}"
                f" realisations, and is {100.0 * worst:.2g} % of the depth at most; a lower"
                " evolution.tolerance or more contact.strips decrease it"
            ),
        ),
        (
            result.count > 0 and result.numbers[-1] >= result.kept,
            (
                f"only the profiles of the first {result.kept} realisations are stored; the mean"
                " profile and its band are computed from them"
            ),
        ),
        (
            bool(result.scenario.sampling.correlation),
            (
                "some inputs are correlated: the sensitivity to one of them includes the effect of"
                " the inputs correlated with it, so that the parts may add up to more than 1"
            ),
        ),
        (
            result.plan == "control-variate" and result.failed > 0,
            (
                f"{result.failed} realisations failed, and the mean of the control variate includes"
                " them: estimates are those of plain Monte Carlo"
            ),
        ),
        (
            bool(processes) and result.plan in {"sobol", "latin-hypercube"},
            (
                f"{' and '.join(processes)} follow random processes, whose paths are sampled by"
                f" plain Monte Carlo: {result.plan} applies to the other inputs only"
            ),
        ),
        (
            target is not None and not reached,
            f"{target} was not reached by {result.requested} realisations",
        ),
    )
    texts = [text for applies, text in warnings if applies]
    return [*plausibility_warnings(Setup(result.scenario)), *texts]


class EnsembleWork:
    """Execution of the pending realisations of an ensemble's file.

    The final set of realisations depends on their outcomes only: an estimate is compared with its
    target at predefined sample sizes, and outcomes beyond the next size are written after it.

    Parameters
    ----------
    file : EnsembleFile
        Open for writing.
    runner : RealisationRunner
    target : Target, optional
        Target that ends the ensemble early.
    pool : Executor
    on_progress : callable, optional
        Called with the progress after every batch.
    stop_requested : callable, optional
        Called after every batch; True stops the work.
    """

    def __init__(
        self,
        file: EnsembleFile,
        runner: RealisationRunner,
        target: Target | None,
        pool: Executor,
        on_progress: Callable[[EnsembleProgress], None] | None,
        stop_requested: Callable[[], bool] | None,
    ) -> None:
        self.file, self.runner, self.target, self.pool = file, runner, target, pool
        self.on_progress = on_progress or (lambda progress: None)
        self.stop_requested = stop_requested or (lambda: False)
        self.total = len(file.status)
        self.started, self.before = time.monotonic(), file.data.wall_seconds
        # the warnings of a finished ensemble are derived again when it finishes
        self.warnings = [] if file.data.finished else list(file.data.warnings)
        self._sizes = interim_sizes(runner.plan, self.total) if target else []
        self._deferred: dict[int, Outcome] = {}
        self._stopping = self._reached = False
        self._ahead = AHEAD * max(pool.workers, 1)
        self._batch_sizes = BatchSizes()
        self._next_estimate, self._estimate = -math.inf, UNKNOWN

    def warn(self, texts: Iterable[str]) -> None:
        """Store warnings with the results, each once."""
        self.warnings = list(dict.fromkeys([*self.warnings, *texts]))

    def finish(self) -> None:
        """Run all pending realisations and those that follow from them, and finish the file.

        Raises
        ------
        Interrupted
            If the work was stopped before the end.
        """
        self._run()
        while further := self.runner.further(self._result()):
            self.file.grow(further.total, **self._state(), **further.state)
            self.runner, self.total = further, further.total
            self._run()
        self.file.finish(self._complete)

    def _run(self) -> None:
        """Run all pending realisations; raises as `finish`."""
        self._analyse()
        while not (self._is_complete() or self._stopping):
            self._run_batches(self._pending())
        if not self._is_complete():
            self.file.put_state(**self._state())
            raise self._interrupted()

    def run_failed_again(self) -> None:
        """Run the failed realisations again; raises as `finish`.

        A finished ensemble is finished again. In an unfinished one pending realisations remain
        pending.
        """
        numbers = np.flatnonzero(self.file.status == FAILED).tolist()
        finished = self.file.data.finished
        self.file.clear(numbers)  # from now on a kill leaves an ensemble to be resumed
        if finished:
            self._run()
            self.file.finish(self._complete)
            return
        self._sizes = []
        self._run_batches(numbers)
        self.file.put_state(**self._state())
        if (self.file.status[numbers] == PENDING).any():
            raise self._interrupted()

    @property
    def _limit(self) -> int:
        """Sample size of the next interim analysis, or the maximum after the last one."""
        return self._sizes[0] if self._sizes else self.total

    def _run_batches(self, numbers: Iterable[int]) -> None:
        """Run realisations in batches until all are done or a stop is requested."""
        try:
            with closing(self.pool.results(self.runner, self._batches(numbers))) as results:
                for _, outcomes in results:
                    self._take(outcomes)
                    if self._stopping or self._reached:
                        return  # unfinished batches are abandoned, and run again if needed
        except WorkerError as error:
            self._run_singly(error)
        except KeyboardInterrupt:
            self._stopping = True

    def _run_singly(self, error: WorkerError) -> None:
        """Run the realisations of a lost batch individually, and fail those that fail again."""
        suspects = [n for n in error.realisations if self.file.status[n] == PENDING]
        if not suspects:
            raise error
        for number in suspects:
            if self._stopping:
                return
            try:
                results = self.pool.results(self.runner, iter([[number]]))
                outcomes = [outcome for _, some in results for outcome in some]
            except WorkerError as failure:
                outcomes = [Outcome(number=number, error=str(failure))]
            self._take(outcomes)

    def _pending(self) -> Iterator[int]:
        """Yield pending realisations, as far beyond the next analysis as keeps workers busy."""
        for number in np.flatnonzero(self.file.status == PENDING):
            if self._reached or number >= self._limit + self._ahead:
                return
            if number not in self._deferred:
                yield int(number)

    def _batches(self, numbers: Iterable[int]) -> Iterator[list[int]]:
        """Yield batches of numbers; results do not depend on their composition."""
        remaining = iter(numbers)
        self._batch_sizes.abandoned()
        while True:
            workers = max(self.pool.workers, 1)
            left = self.total - int((self.file.status != PENDING).sum())
            size = self._batch_sizes.next(left, workers)
            self._ahead = AHEAD * workers * size
            batch = list(islice(remaining, size))
            if not batch:
                return
            self._batch_sizes.started(len(batch))
            yield batch

    def _take(self, outcomes: Sequence[Outcome]) -> None:
        """Write outcomes, or defer those beyond the next analysis; report the progress."""
        now = [item for item in outcomes if item.number < self._limit]
        self._deferred |= {item.number: item for item in outcomes if item.number >= self._limit}
        self._batch_sizes.finished(len(outcomes))
        if now and not self._reached:
            self.file.put(now)
        self._analyse()
        self._stopping = self._stopping or self.stop_requested()
        self._report_progress()

    def _analyse(self) -> None:
        """Compare the estimate with the target at every interim size that is complete."""
        while self.target and self._sizes and not self._reached:
            if (self.file.status[: self._limit] == PENDING).any():
                return
            if self.target.reached(self._result().estimate_for(self.target)):
                self._reached = True
                return
            self._sizes = self._sizes[1:]
            if due := sorted(number for number in self._deferred if number < self._limit):
                self.file.put([self._deferred.pop(number) for number in due])

    def _is_complete(self) -> bool:
        return self._reached or not (self.file.status == PENDING).any()

    def _result(self) -> Any:
        """Return the present content of the file."""
        return self.runner.result(
            replace(self.file.data, status=self.file.status.copy()), self.file.path
        )

    def _state(self) -> dict[str, object]:
        """Return the fields of the results that have changed."""
        return {
            "warnings": self.warnings,
            "wall_seconds": self.before + time.monotonic() - self.started,
        }

    def _complete(self, data: EnsembleData) -> tuple[dict[str, object], dict[str, FloatArray]]:
        """Return the final fields of a complete ensemble, and its statistics."""
        result = self.runner.result(data, self.file.path)
        self.warn(ensemble_warnings(result, self.target, self._reached))
        final = {"finished": True, "statistics": result.final_estimates()}
        return self._state() | final, result.statistics() if result.count else {}

    def _interrupted(self) -> Interrupted:
        done = int((self.file.status != PENDING).sum())
        return Interrupted(
            f"stopped after {done} of {self.total} realisations",
            python=f'continue with wearsim.resume_ensemble("{self.file.path}")',
            shell=f"continue with: wearsim resume {self.file.path}",
        )

    def _report_progress(self) -> None:
        default = DEFAULT_OF_LIVES if self.file.data.life else DEFAULT_TARGET
        status, target, now = self.file.status, self.target or default, time.monotonic()
        done, failed = int((status == DONE).sum()), int((status == FAILED).sum())
        if done and (now > self._next_estimate or self._is_complete()):
            self._estimate = target.interval(self._result().estimate_for(target))
            # at most 5 % of the time
            self._next_estimate = now + max(BETWEEN_ESTIMATES, 20.0 * (time.monotonic() - now))
        self.on_progress(
            EnsembleProgress(
                done=done,
                failed=failed,
                requested=self.total,
                rate=self._batch_sizes.rate,
                left=self._batch_sizes.time_left(self.total - done - failed),
                what=target.what,
                estimate=self._estimate,
                workers=self.pool.describe,
            )
        )
