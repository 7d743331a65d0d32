"""Progress on stderr, and the signals that stop a run."""

from __future__ import annotations

import gc
import math
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar

from wearsim.cli.shared import console, note
from wearsim.report.text import OBSERVABLES, count, lapse, shown, simulated, with_interval
from wearsim.studies.kernels import compilation_counted, kernels_of
from wearsim.studies.run.recorder import Event, Finished, Started, Stepped, Warned

if TYPE_CHECKING:
    from wearsim.studies.ensemble.driver import EnsembleProgress


BETWEEN_LINES = 1.0  # s
_REPORTS = 3  # reports of progress from which the time left is shown
_BAR, _COLUMNS_FOR_BAR = 24, 115
CHECKPOINT = "stopping at a checkpoint; repeat to stop at once"
_SIGNALS = (signal.SIGINT, signal.SIGTERM)
BATCHES = "stopping after the next batch; repeat to stop at once"  # at a signal to an ensemble
PARTS = "stopping after the parts in progress; repeat to stop at once"  # to a study of a plugin


class Display:
    """One line that is updated on a terminal or in a notebook, at most once a second.

    Elsewhere it is written again.

    Parameters
    ----------
    quiet : bool
        Whether to show nothing.
    now : callable
        Returns a monotonic time [s].
    kernels : callable
        Returns the names of the kernels of the study; called if a kernel has to be compiled.
    transient : bool
        Whether the line is removed from the terminal at the end.

    Attributes
    ----------
    live : rich.progress.Progress
        Display on a terminal, disabled elsewhere.
    columns : float
        Greatest length of the text.
    warnings : list of str
        Warnings of the result that were shown.
    """

    def __init__(
        self,
        quiet: bool,
        now: Callable[[], float] = time.monotonic,
        *,
        kernels: Callable[[], Iterable[str]] = tuple,
        transient: bool = False,
    ) -> None:
        from rich.progress import BarColumn, Progress, TextColumn

        screen = console(err=True)
        bar = [BarColumn(_BAR)] if screen.width >= _COLUMNS_FOR_BAR else []
        self.live = Progress(
            *bar,
            TextColumn("{task.percentage:3.0f} %  {task.description}", markup=False),
            console=screen,
            speed_estimate_period=3600.0,
            get_time=now,
            transient=transient,
            disable=quiet or not screen.is_terminal,
        )
        left = screen.width - len("100 %  ") - len(bar) * (_BAR + 1)
        self.columns = math.inf if self.live.disable else left
        self.live.add_task("starting")
        (self._task,) = self.live.tasks
        self._quiet, self._now, self._written = quiet, now, now()
        self._notebook: Any = None  # output of a notebook
        self._kernels, self._reports, self._compiling, self._open = kernels, 0, False, ExitStack()
        self.stop_requested: Callable[[], bool] | None = None
        self.warnings: list[str] = []

    @property
    def callbacks(self) -> dict[str, Any]:
        """Arguments with which a study reports to this display, and asks whether to stop."""
        return {"on_progress": self, "stop_requested": self.stop_requested}

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            self.live.start()
            stack.callback(self.live.stop)
            stack.enter_context(compilation_counted(self._show_compilation, self._kernels))
            self._open = stack.pop_all()
        return self

    def __exit__(self, *failure: object) -> None:
        self._open.close()
        if self._notebook is not None:
            self._show_in_notebook(self._task.description)

    def _show_compilation(self, number: int, total: int) -> None:
        """Show that a kernel is being compiled; without a terminal the first one at once."""
        self.show(
            f"compiling kernels, once after installation: {number} of {total}",
            always=not self._compiling,
        )
        self._compiling = True

    def advance(self, done: float, total: float) -> str:
        """Set how much is done, and return the time left in the form ", 12 s left".

        The first reports, from which it would be unreliable, return an empty text.
        """
        self._reports += done > self._task.completed
        self.live.update(self._task.id, completed=done, total=total)
        left = self._task.time_remaining if self._reports >= _REPORTS else None
        return f", {lapse(left)} left" if left else ""

    def show(self, text: str, *, always: bool = False) -> None:
        """Show a text on the line, or write it if a second has passed since the last one.

        The collector of garbage is enabled, without the objects of the imports; see `app.main`.
        """
        if not gc.isenabled():
            gc.freeze()
            gc.enable()
        self.live.update(self._task.id, description=text)
        now = self._now()
        if not self.live.disable or not (always or now - self._written >= BETWEEN_LINES):
            return
        self._written = now
        if self.live.console.is_jupyter and not self._quiet:
            self._show_in_notebook(text)
        else:
            self.write(text)

    def _show_in_notebook(self, text: str) -> None:
        """Show a text in place of the last one, below the cell."""
        from IPython.display import display

        content = {"text/plain": text}
        if self._notebook is None:
            self._notebook = display(content, raw=True, display_id=True)
        else:
            self._notebook.update(content, raw=True)

    def write(self, text: str, *, also_quiet: bool = False) -> None:
        """Write a line, on a terminal above the live one."""
        if not self.live.disable:
            self.live.console.print(text)
        elif also_quiet or not self._quiet:
            note(text)


class Counter(Display):
    """Display of a number of realisations."""

    def __call__(self, done: int, total: int) -> None:
        """Show how many of them are done."""
        self.show(f"{count(done)} of {count(total)} realisations{self.advance(done, total)}")


class _Noticing(Display):
    """Display of a study that also reports notices, which are shown even if nothing else is."""

    @property
    def callbacks(self) -> dict[str, Any]:
        """Arguments with which a study reports to this display, and asks whether to stop."""
        return {**super().callbacks, "on_notice": partial(self.write, also_quiet=True)}


class PartWatcher(_Noticing):
    """Display of a study that is computed in parts, with a text on its present state."""

    def __call__(self, done: int, total: int, text: str) -> None:
        """Show how many parts are done, and the text."""
        self.show(
            f"{count(done)} of {count(total)}, {text}{self.advance(done, total)}",
            always=done == total,
        )


class RunWatcher(Display):
    """Display of the events of a run; the first and the last step are always shown.

    A quiet one shows warnings only.
    """

    _is_first_step = True

    @property
    def callbacks(self) -> dict[str, Any]:
        """Arguments with which a run reports to this display, and asks whether to stop."""
        return {"on_event": self, "stop_requested": self.stop_requested}

    def __call__(self, event: Event) -> None:
        """Show an event."""
        match event:
            case Started():
                self.advance(event.from_passes, event.total_passes)
                done = f"continuing from pass {count(event.from_passes)} of"
                self.write(
                    f"{done if event.from_passes else 'running'} {count(event.total_passes)}"
                    f" passes, {simulated(event.total_time)}, with {event.model}, {event.stepper}"
                )
            case Stepped():
                self._show_step(event)
            case Warned():
                self.write(f"warning: {event.message}", also_quiet=True)
                self.warnings.append(event.message)
            case Finished():
                self.show(f"done in {lapse(event.wall_seconds)}", always=True)

    def _show_step(self, step: Stepped) -> None:
        left = self.advance(step.passes, step.total_passes)
        part = f" ({100.0 * step.passes / step.total_passes:.0f} %)"
        self.show(
            f"pass {count(step.passes)}{part if self.live.disable else ''},"
            f" {simulated(step.time)}, depth {shown(step.depth, 'um')},"
            f" step of {count(step.step_passes)} passes{left}",
            always=self._is_first_step or step.passes >= step.total_passes,
        )
        self._is_first_step = False


class EnsembleWatcher(_Noticing):
    """Display of the progress of an ensemble.

    Attributes
    ----------
    workers : str
        Description of the workers; empty before the first progress.
    """

    workers = ""

    def __call__(self, progress: EnsembleProgress) -> None:
        """Store the workers and show the progress, that of the last batch always."""
        self.workers, over = progress.workers, progress.done + progress.failed
        self.advance(over, progress.requested)
        self.show(progress_text(progress, self.columns), always=over == progress.requested)


def progress_text(progress: EnsembleProgress, columns: float = math.inf) -> str:
    """Return the progress of an ensemble on one line.

    Parameters
    ----------
    progress : EnsembleProgress
    columns : float
        Greatest length; parts that would exceed it are left out.
    """
    noun = " realisations" if columns == math.inf else ""
    text = f"{count(progress.done)} of {count(progress.requested)}{noun}"
    for part in (
        f"{count(progress.failed)} failed" if progress.failed else "",
        f"{lapse(progress.left)} left" if progress.left > 0.0 else "",
        _estimate(progress),
        f"{progress.rate:.3g}/s" if progress.rate < 1000.0 else f"{count(progress.rate)}/s",
    ):
        if part and len(text) + len(f", {part}") <= columns:
            text += f", {part}"
    return text


def _estimate(progress: EnsembleProgress) -> str:
    if progress.estimate is None or not math.isfinite(progress.estimate.value):
        return ""
    name = progress.what.split(".", maxsplit=1)[0]
    if name not in OBSERVABLES:  # a life, "b10"
        return f"{progress.what.upper()} {progress.estimate.value:,.0f}"
    return f"{progress.what} {with_interval(progress.estimate, OBSERVABLES[name].unit)}"


@contextmanager
def stop_on_signals(
    message: str = CHECKPOINT,
) -> Iterator[threading.Event]:
    """Catch SIGINT and SIGTERM while the context is open.

    The first signal sets the event and restores the default handlers, so that a second one ends the
    process even while compiled code runs; the results file remains readable.

    Parameters
    ----------
    message : str
        Written to stderr at the first signal.
    """
    stop = threading.Event()
    # a process of loky outlives a process that is ended by a signal, and would warn of it
    os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker:UserWarning")

    def handle(number: int, frame: Any) -> None:
        stop.set()
        for caught in _SIGNALS:
            signal.signal(caught, signal.SIG_DFL)
        note(message)

    before = {number: signal.signal(number, handle) for number in _SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


Shown = TypeVar("Shown", bound=Display)


@contextmanager
def watching(
    display: type[Shown],
    study: Any,
    quiet: bool = False,
    stopping: str = "",
    *,
    kind: Literal["test", "contacts", "contact"] = "test",
    fields: bool = False,
) -> Iterator[Shown]:
    """Give a display of a study, whose kernels may have to be compiled.

    Parameters
    ----------
    display : type of Display
    study : Scenario or StudyResult
        The scenario of the study, or an earlier result of it.
    quiet : bool
        Whether to show nothing.
    stopping : str
        Written to stderr at the first signal, which the study then obeys; without it, signals are
        not caught.
    kind, fields
        As of `kernels_of`.
    """
    with ExitStack() as stack:
        stop = stack.enter_context(stop_on_signals(stopping)) if stopping else None
        watch = display(
            quiet,
            kernels=lambda: kernels_of(getattr(study, "scenario", study), kind, fields),
            transient=display is Display,
        )
        stack.enter_context(watch)
        watch.stop_requested = stop.is_set if stop else None
        yield watch
