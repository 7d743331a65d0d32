"""Tables of a benchmark on stdout, and its files, written topic by topic."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.cli.shared import console, note, write_json
from wearsim.report.text import plain

if TYPE_CHECKING:
    from rich.console import Console

    from wearsim_bench.figures.table import TableRow
    from wearsim_bench.hard_cases.verdict import Verdict
    from wearsim_bench.measure.machine import Machine
    from wearsim_bench.measure.measurement import Effort, Topic

_WORDS = ("setting",)
_NAMES = 24  # minimum width of the column of names
_NUMBER = 12  # width of a column of numbers with its separator
_FIXED = _NAMES + 2 + 19 + 17  # width of the columns of names, settings and marks
_WIDE = 150  # width of tables written to a file or a pipe
_SHOWN = ("volume", "load", "oscillation", "steps", "strips", "mirror")  # criteria of a hard case


class Output:
    """Writer of the results of a benchmark.

    Parameters
    ----------
    folder : Path
        Output folder: a JSON file, a Markdown table and a figure for each topic.
    machine : Machine
        The machine of the measurements.
    effort : Effort
        Number of cases and repetitions.
    whole : bool
        Show all measurements.
    as_json : bool
        Write one JSON object to stdout at the end, instead of tables.
    """

    def __init__(
        self, folder: Path, machine: Machine, effort: Effort, whole: bool, as_json: bool
    ) -> None:
        self.folder, self.machine, self.effort = folder, machine, effort
        self.whole, self.as_json = whole, as_json
        self._results: dict[str, Any] = {"machine": asdict(machine), "effort": asdict(effort)}
        self._files: list[Path] = []

    def begin(self) -> None:
        """Create the folder and print the description of the machine."""
        from wearsim_bench.figures.table import measured_on

        self.folder.mkdir(parents=True, exist_ok=True)
        if not self.as_json:
            console().print(measured_on(self.machine, self.effort))

    def topic(self, topic: Topic) -> None:
        """Write the measurements of a topic."""
        from wearsim.report.figures import save_figure
        from wearsim_bench.figures.table import markdown
        from wearsim_bench.figures.topic import bench_figure

        self._write_json(topic.name, topic.as_json())
        self._write_text(
            f"{topic.name}.md", markdown(topic, self.machine, self.effort, whole=self.whole)
        )
        figure = self.folder / f"{topic.name}.png"
        save_figure(bench_figure(topic, self.machine, self.effort), figure)
        self._files.append(figure)
        if topic.files:
            (self.folder / topic.name).mkdir(exist_ok=True)
        for name, text in topic.files.items():
            self._write_text(f"{topic.name}/{name}", text)
        if not self.as_json:
            self._show(topic)

    def hard(self, verdicts: tuple[Verdict, ...], effort: Effort) -> None:
        """Write the verdicts on the hard cases, which ran with an effort."""
        from wearsim_bench.figures.hard_cases import hard_markdown
        from wearsim_bench.figures.table import measured_on

        passed = sum(verdict.holds for verdict in verdicts)
        cases = [verdict.as_json() for verdict in verdicts]
        self._write_json("hard", {"holding": passed, "cases": cases})
        about = measured_on(self.machine, effort)
        self._write_text("hard.md", f"{about}\n\n{hard_markdown(verdicts)}")
        if not self.as_json:
            title = f"Hard cases: {passed} of {len(verdicts)} pass; numbers are the largest values"
            rows = [_verdict_row(verdict) for verdict in verdicts]
            _print_table(title, ["case", *_SHOWN, "verdict"], rows)

    def end(self) -> None:
        """Write the JSON object if requested, and list the files."""
        if self.as_json:
            write_json({**self._results, "files": self._files})
        for path in self._files:
            note(f"written: {path}")

    def _write_json(self, name: str, results: dict[str, Any]) -> None:
        """Write the results of a topic to a JSON file, with the description of the machine."""
        self._results[name] = results
        about = {key: self._results[key] for key in ("machine", "effort")}
        text = json.dumps(
            plain({**about, **results}), indent=1, ensure_ascii=False, allow_nan=False
        )
        self._write_text(f"{name}.json", text + "\n")

    def _write_text(self, name: str, text: str) -> None:
        from wearsim.atomic_write import save_text

        path = self.folder / name
        save_text(text, path)
        self._files.append(path)

    def _show(self, topic: Topic) -> None:
        """Print a table for each group of problems, followed by the failures."""
        from wearsim_bench.figures.table import (
            MARKS,
            column_heads,
            has_front,
            shown_groups,
            table_rows,
        )

        screen, columns = _screen(), column_heads(topic)
        screen.print(f"\n{topic.title}\n{topic.about}")
        screen.print(MARKS if has_front(topic) else "")
        for group in shown_groups(topic, whole=self.whole):
            rows = table_rows(topic, group, self.machine.yardstick, whole=self.whole)
            measured = [row for row in rows if not row.failed]
            if measured:
                _print_measured(group, columns, measured)
            for row in rows:
                if row.failed:
                    screen.print(f"{group}: {row.cells[0]}, {row.cells[1]}: {row.cells[-1]}")
            if group in topic.conclusions:
                screen.print(topic.conclusions[group])


def _print_measured(title: str, columns: Sequence[str], rows: Sequence[TableRow]) -> None:
    """Print as many columns as fit the width; the marks are always printed."""
    from wearsim_bench.figures.table import NAMED, filled_columns

    *named, last = filled_columns(columns, [(*row.cells[:-1], "marks") for row in rows])
    available = _screen().width - _FIXED
    numbers = [k for k in named if k >= NAMED][: max(3, available // _NUMBER)]
    kept = [*range(NAMED), *numbers, *[last] * any(row.cells[last] for row in rows)]
    cells = ([row.cells[k] for k in kept] for row in rows)
    _print_table(title, [columns[k] for k in kept], cells, [*map(_style, rows)])


def _verdict_row(verdict: Verdict) -> list[str]:
    """Return the cells of a hard case: some of its criteria, and the verdict."""
    criteria = [verdict.criterion(name) for name in _SHOWN]
    numbers = ["-" if item is None else f"{item.value:.1e}" for item in criteria]
    word = "; ".join(verdict.failures) or ("refused" if verdict.error else "passed")
    return [verdict.case, *numbers, f"{word}: {verdict.error}" if verdict.error else word]


def _style(line: TableRow) -> str:
    """Return the style of a row: the Pareto front is bold, the default underlined."""
    return " ".join(["bold"] * line.front + ["underline"] * line.default)


def _print_table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    styles: Sequence[str] = (),
) -> None:
    """Print a table with right-aligned numbers."""
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for number, head in enumerate(columns):
        if number == 0:
            table.add_column(head, min_width=_NAMES, overflow="fold")
        elif number == len(columns) - 1 or head in _WORDS:
            table.add_column(head, min_width=len(head), overflow="fold")
        else:
            table.add_column(head, justify="right", max_width=_NUMBER - 2, overflow="fold")
    for number, row in enumerate(rows):
        table.add_row(*row, style=styles[number] if styles else "")
    _screen().print(table)


def _screen() -> Console:
    """Return the console, with a fixed width if it is not a terminal."""
    screen = console()
    if not screen.is_terminal:
        screen.width = _WIDE
    return screen
