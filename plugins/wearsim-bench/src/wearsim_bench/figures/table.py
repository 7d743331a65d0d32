"""What a benchmark measured, as rows of text: for the shell and for Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from wearsim.report.text.units import NOTHING, brief, shown
from wearsim_bench.measure.machine import Machine
from wearsim_bench.measure.measurement import Effort, Measurement, Topic

FRONT, DEFAULT = "*", "default"
MARKS = f"{FRONT} none is better in time and error both; {DEFAULT}: what a scenario gets"
FEW = 12  # measurements of a group that are all shown
_ROUNDING = 1e-10


@dataclass(frozen=True)
class Line:
    """One line of a table.

    Parameters
    ----------
    cells : tuple of str
        A text for each of `heads`.
    front, default : bool
        Whether none beats it, and whether it is what a scenario gets that asks for nothing.
    failed : bool
        Whether the last cell tells why there is no answer.
    """

    cells: tuple[str, ...]
    front: bool
    default: bool
    failed: bool = False


def has_front(topic: Topic) -> bool:
    """Return whether a topic sets methods against each other, not sizes or ways of one."""
    return not {"times", "peak_bytes"} & set(topic.counts)


def heads(topic: Topic) -> list[str]:
    """Return the heads of a topic's columns."""
    costs = [topic.seconds, "in yardsticks"]
    return ["what", "setting", *costs, *topic.errors.values(), *topic.counts.values(), ""]


def lines(topic: Topic, group: str, yardstick: float, *, whole: bool = False) -> list[Line]:
    """Return the lines of one group of problems.

    Parameters
    ----------
    topic : Topic
    group : str
    yardstick : float
        The machine's [s].
    whole : bool
        All that was measured; otherwise those that none beats, the default, and of every other
        method the setting that comes nearest.
    """
    front = {id(item) for item in topic.front(group)} if has_front(topic) else set()
    items = topic.of(group) if whole else chosen(topic, group)
    return [_line(topic, item, yardstick, id(item) in front) for item in items]


def chosen(topic: Topic, group: str) -> list[Measurement]:
    """Return what is worth a line: front, default, and the nearest setting of every method."""
    items, kept = topic.of(group), {id(item) for item in topic.front(group)}
    if len(items) <= FEW or not has_front(topic):
        return items
    for method in dict.fromkeys(item.method for item in items):
        own = [item for item in items if item.method == method]
        if not any(id(item) in kept for item in own):
            kept.add(id(min(own, key=lambda item: item.errors.get(topic.error, float("inf")))))
    return [item for item in items if id(item) in kept or item.default]


def _line(topic: Topic, item: Measurement, yardstick: float, front: bool) -> Line:
    marks = " ".join([FRONT] * front + [DEFAULT] * item.default)
    if item.failed:
        empty = (NOTHING,) * (1 + len(topic.errors) + len(topic.counts))
        cells = (item.method, item.setting, NOTHING, *empty, item.failed)
        return Line(cells, front, item.default, failed=True)
    time = NOTHING if item.seconds is None else brief(item.seconds)
    lengths = NOTHING if item.seconds is None else f"{item.seconds / yardstick:.3g}"
    errors = [percent(item.errors.get(name)) for name in topic.errors]
    counts = [counted(name, item.counts.get(name)) for name in topic.counts]
    told = (item.method, item.setting, time, lengths, *errors, *counts, marks)
    return Line(told, front, item.default)


def percent(value: float | None) -> str:
    """Return a relative error as a percentage with two digits, "0.035 %"."""
    if value is not None and value < _ROUNDING:
        return "rounding"
    return shown(value, "%", 2)


def counted(name: str, value: float | None) -> str:
    """Return a count; where its name ends in seconds or bytes, with a unit."""
    if value is None:
        return NOTHING
    if name.endswith("seconds"):
        return brief(value)
    if name.endswith("bytes"):
        return f"{value / 1e6:.4g} MB"
    return f"{value:,.0f}" if float(value).is_integer() else f"{value:.3g}"


def markdown(topic: Topic, machine: Machine, effort: Effort, *, whole: bool = False) -> str:
    """Return a topic's tables as Markdown, one for each group.

    Parameters
    ----------
    topic : Topic
    machine : Machine
    effort : Effort
        What was spent.
    whole : bool
        As of `lines`.
    """
    parts = [f"## {topic.title}", topic.about, measured_on(machine, effort)]
    parts += [f"{MARKS}."] if has_front(topic) else []
    for group in topic.groups:
        rows = (line.cells for line in lines(topic, group, machine.yardstick, whole=whole))
        parts += [f"### {group[:1].upper()}{group[1:]}", markdown_table(heads(topic), rows)]
    return "\n\n".join(parts) + "\n"


def measured_on(machine: Machine, effort: Effort) -> str:
    """Return a sentence on the machine, its yardstick, and what was spent."""
    times = "timed once" if effort.repetitions == 1 else f"best of {effort.repetitions}"
    texts = [f"Measured on {machine}; one yardstick is {brief(machine.yardstick)}; {times}"]
    texts += ["quick: few cases and short tests, which only show what there is"] * effort.quick
    texts += [f"contact model {effort.plugin}"] * (effort.plugin is not None)
    return "; ".join(texts) + "."


def markdown_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    told = [columns, ["---"] * len(columns), *rows]
    return "\n".join(f"| {' | '.join(map(_escaped, cells))} |" for cells in told)


def _escaped(cell: str) -> str:
    return cell.replace("|", r"\|").replace("\n", " ")
