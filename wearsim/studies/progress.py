"""Progress of a study called from Python, shown as at the shell."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any, Literal

from wearsim.scenario import Scenario
from wearsim.studies.kernels import kernels_of


@contextmanager
def shown_progress(
    progress: bool,
    display: Literal["RunWatcher", "EnsembleWatcher", "Counter", "PartWatcher"],
    watcher: Callable[..., object] | None,
    scenario: Scenario,
) -> Iterator[Any]:
    """Return a watcher that also shows the progress, while the context is open.

    Parameters
    ----------
    progress : bool
        Whether to show it, on a terminal or in a notebook.
    display : str
        Class of `wearsim.cli.progress`.
    watcher : callable, optional
        The caller's own watcher.
    scenario : Scenario
        The scenario of the study, whose kernels may have to be compiled.
    """
    if not progress:
        yield watcher
        return
    kind: Literal["contacts", "test"] = "contacts" if display == "Counter" else "test"
    # by name, since the displays, which need rich, belong to a layer above
    shown = getattr(import_module("wearsim.cli.progress"), display)(
        quiet=False, kernels=lambda: kernels_of(scenario, kind)
    )
    with shown:
        if watcher is None:
            yield shown
            return
        callers = watcher

        def both(*event: object) -> None:
            shown(*event)
            callers(*event)

        yield both
