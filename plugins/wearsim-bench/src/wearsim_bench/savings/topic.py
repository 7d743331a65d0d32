"""Time saved by omitting computations that a problem does not require, and their errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from wearsim_bench.measure.measurement import Effort, Measurement, OnProgress, Topic
from wearsim_bench.savings import contacts, runs
from wearsim_bench.savings.saving import Saving

ERRORS, COUNTS = {"result": "result"}, {"times": "speed-up"}
ABOUT = (
    "The first alternative of a group is the automatic choice; the last solves the same contact,"
    " test or draws without the saving, and the speed-up is its time over that of the first. Errors"
    " are relative to the last alternative; those of theories with steps along rolling are relative"
    " to 1000 steps. For full slip and strips outside there is no slower method for the same"
    " result: the time is compared with that of a contact with partial adhesion, and of as many"
    " strips in contact. No setting enables a saving. Contacts are solved in batches of 20, except"
    " for fields."
)


def savings(effort: Effort, on_progress: OnProgress) -> Topic:
    """Measure all savings, compared with computations without them.

    Parameters
    ----------
    effort : Effort
        Number of cases and repetitions.
    on_progress : callable
        Called with a description and the completed fraction.
    """
    kinds: tuple[Callable[[], Iterator[Saving]], ...] = (
        contacts.closed_forms,
        contacts.full_slip,
        contacts.uniform_friction,
        contacts.strips_outside,
        contacts.fields,
        partial(runs.records, effort.quick),
        partial(runs.identical_rollers, effort.quick),
        partial(runs.idle_inputs, effort.quick),
    )
    measurements: list[Measurement] = []
    for number, savings_of_kind in enumerate(kinds):
        for saving in savings_of_kind():
            on_progress(f"{saving.group}: {saving.method}", number / len(kinds))
            measurements += saving.measured(effort.repetitions)
    return Topic(
        name="savings",
        title="Savings: computations omitted where a problem does not require them",
        about=ABOUT,
        seconds="one call",
        error="result",
        errors=ERRORS,
        counts=COUNTS,
        measurements=tuple(measurements),
    )
