"""Tables of measurements for the terminal and for Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from wearsim.report.text import NOTHING, brief, shown
from wearsim_bench.measure.machine import Machine
from wearsim_bench.measure.measurement import Effort, Measurement, Topic

FRONT, DEFAULT = "*", "default"
MARKS = f"{FRONT} Pareto front of time and error; {DEFAULT}: default of a scenario"
NAMED = 2  # columns of words before the numbers
FEW = 12  # groups of up to this many measurements are shown in full
_ROUNDING = 1e-10


@dataclass(frozen=True)
class TableRow:
    """One row of a table.

    Parameters
    ----------
    cells : tuple of str
        One text for each of `column_heads`.
    front, default : bool
        Whether it is on the Pareto front, and whether it is the default of a scenario.
    failed : bool
        Whether the last cell holds the reason of a failure.
    """

    cells: tuple[str, ...]
    front: bool
    default: bool
    failed: bool = False


def has_front(topic: Topic) -> bool:
    """Return whether a topic compares methods, rather than sizes or alternatives of one method."""
    return not {"times", "peak_bytes", "covered"} & set(topic.counts)


def shown_groups(topic: Topic, *, whole: bool = False) -> list[str]:
    """Return the groups of a topic that tables show; all of them if `whole`."""
    return [group for group in topic.groups if whole or group not in topic.details]


def column_heads(topic: Topic) -> list[str]:
    """Return the column heads of a topic."""
    costs = [topic.seconds, "in yardsticks"]
    return ["method", "setting", *costs, *topic.errors.values(), *topic.counts.values(), ""]


def table_rows(
    topic: Topic, group: str, yardstick: float, *, whole: bool = False
) -> list[TableRow]:
    """Return the rows of one group of problems.

    Parameters
    ----------
    topic : Topic
        The topic.
    group : str
        The group.
    yardstick : float
        Reference time of the machine [s].
    whole : bool
        Return all measurements; otherwise the Pareto front, the default, those with a remark, and
        the most accurate setting of every other method.
    """
    front = {id(item) for item in topic.front(group)} if has_front(topic) else set()
    items = topic.of(group) if whole else selected(topic, group)
    return [_row(topic, item, yardstick, id(item) in front) for item in items]


def selected(topic: Topic, group: str) -> list[Measurement]:
    """Return the Pareto front, the default, remarks, and the best setting of other methods."""
    items, kept = topic.of(group), {id(item) for item in topic.front(group)}
    if len(items) <= FEW or not has_front(topic):
        return items
    for method in dict.fromkeys(item.method for item in items):
        of_method = [item for item in items if item.method == method]
        if not any(id(item) in kept for item in of_method):
            kept.add(
                id(min(of_method, key=lambda item: item.errors.get(topic.error, float("inf"))))
            )
    return [item for item in items if id(item) in kept or item.default or item.remark]


def _row(topic: Topic, item: Measurement, yardstick: float, front: bool) -> TableRow:
    marks = " ".join([FRONT] * front + [DEFAULT] * item.default + [item.remark] * bool(item.remark))
    if item.failed:
        empty = (NOTHING,) * (1 + len(topic.errors) + len(topic.counts))
        cells = (item.method, item.setting, NOTHING, *empty, item.failed)
        return TableRow(cells, front, item.default, failed=True)
    time = NOTHING if item.seconds is None else brief(item.seconds)
    ratio = NOTHING if item.seconds is None else f"{item.seconds / yardstick:.3g}"
    errors = [percent(item.errors.get(name)) for name in topic.errors]
    counts = [count_text(name, item.counts.get(name)) for name in topic.counts]
    return TableRow(
        (item.method, item.setting, time, ratio, *errors, *counts, marks), front, item.default
    )


def filled_columns(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[int]:
    """Return the columns to show: method and setting, and others in which a row has a value."""
    return [
        column
        for column in range(len(heads))
        if column < NAMED or any(row[column] not in (NOTHING, "") for row in rows)
    ]


def percent(value: float | None) -> str:
    """Return a relative error as a percentage with two digits, "0.035 %"."""
    if value is not None and value < _ROUNDING:
        return "rounding"
    return shown(value, "%", 2)


def count_text(name: str, value: float | None) -> str:
    """Return a count; with a unit if its name ends in seconds or bytes."""
    if value is None:
        return NOTHING
    if name.endswith("seconds"):
        return brief(value)
    if name.endswith("bytes"):
        return f"{value / 1e6:.4g} MB"
    return f"{value:,.0f}" if float(value).is_integer() else f"{value:.3g}"


def markdown(topic: Topic, machine: Machine, effort: Effort, *, whole: bool = False) -> str:
    """Return the tables of a topic as Markdown, one for each group.

    Parameters
    ----------
    topic : Topic
        The topic.
    machine : Machine
        The machine of the measurements.
    effort : Effort
        Number of cases and repetitions.
    whole : bool
        Return all measurements, see `table_rows`.
    """
    parts = [f"## {topic.title}", topic.about, measured_on(machine, effort, topic.timing)]
    parts += [f"{MARKS}."] if has_front(topic) else []
    for group in shown_groups(topic, whole=whole):
        rows = [row.cells for row in table_rows(topic, group, machine.yardstick, whole=whole)]
        heads = column_heads(topic)
        kept = filled_columns(heads, rows)
        table = markdown_table([heads[k] for k in kept], ([row[k] for k in kept] for row in rows))
        parts += [f"### {group[:1].upper()}{group[1:]}", table]
        parts += [topic.conclusions[group]] if group in topic.conclusions else []
    return "\n\n".join(parts) + "\n"


def measured_on(machine: Machine, effort: Effort, timing: str = "") -> str:
    """Return a sentence on the machine, its yardstick, and the extent of the benchmark."""
    best = "timed once" if effort.repetitions == 1 else f"best of {effort.repetitions}"
    times = timing or best
    texts = [
        f"Measured on {machine.date} on {machine}; one yardstick is {brief(machine.yardstick)}",
        times,
    ]
    texts += ["quick: few cases and short tests, for a trial run"] * effort.quick
    texts += [f"contact model {effort.plugin}"] * (effort.plugin is not None)
    return "; ".join(texts) + "."


def markdown_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    every = [columns, ["---"] * len(columns), *rows]
    return "\n".join(f"| {' | '.join(map(_escaped, cells))} |" for cells in every)


def _escaped(cell: str) -> str:
    return cell.replace("|", r"\|").replace("\n", " ")
