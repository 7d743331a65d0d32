"""What a problem does not need and is not computed: time saved, at what error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from wearsim_bench.measure.measurement import Effort, Measurement, Tell, Topic
from wearsim_bench.savings import contacts, runs
from wearsim_bench.savings.pairs import Pair

ERRORS, COUNTS = {"result": "result"}, {"times": "times as fast"}
ABOUT = (
    "The first of every group of ways is the one that a problem gets which has no need of more; the"
    " last does the same contact, test or draws without the saving, and `times as fast` is its time"
    " over that of the first. Errors are against the last way, but those of marches against one of"
    " 1000 steps. Full slip and strips outside have no long way to the same result: the time is"
    " beside that of a contact part of which adheres, and beside as many strips in contact. No"
    " setting turns a saving on. Contacts are solved 20 at once, but for fields."
)


def savings(effort: Effort, tell: Tell) -> Topic:
    """Measure every saving beside the way that does without it.

    Parameters
    ----------
    effort : Effort
    tell : callable
        Gets what is being measured, and which part is done.
    """
    kinds: tuple[Callable[[], Iterator[Pair]], ...] = (
        contacts.closed_forms,
        contacts.full_slip,
        contacts.uniform_friction,
        contacts.strips_outside,
        contacts.fields,
        partial(runs.records, effort.quick),
        partial(runs.alike_rollers, effort.quick),
        partial(runs.idle_inputs, effort.quick),
    )
    found: list[Measurement] = []
    for number, pairs in enumerate(kinds):
        for pair in pairs():
            tell(f"{pair.group}: {pair.method}", number / len(kinds))
            found += pair.measured(effort.repetitions)
    return Topic(
        name="savings",
        title="What is not computed where a problem has no need of it",
        about=ABOUT,
        seconds="one call",
        error="result",
        errors=ERRORS,
        counts=COUNTS,
        measurements=tuple(found),
    )
