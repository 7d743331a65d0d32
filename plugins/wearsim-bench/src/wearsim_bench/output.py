"""Tables of a benchmark on stdout, and its files, each written as soon as it can be."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.cli.output import console, note, plain, write_json

if TYPE_CHECKING:
    from rich.console import Console

    from wearsim_bench.figures.table import Line
    from wearsim_bench.hard_cases.verdict import Verdict
    from wearsim_bench.measure.machine import Machine
    from wearsim_bench.measure.measurement import Effort, Topic

_WORDS = ("setting",)
_NAMED = 2  # columns of words before the numbers
_NAMES = 24  # letters that names have room for before all else
_NUMBER = 12  # letters of a column of numbers, with what parts it from the next
_FIXED = _NAMES + 2 + 19 + 17  # letters of names, settings and marks
_WIDE = 150  # columns of text, for tables that go into a file or a pipe
_SHOWN = ("volume", "load", "oscillation", "steps", "strips", "mirror")  # checks of a hard case


class Output:
    """Where what was measured goes.

    Parameters
    ----------
    folder : Path
        Gets a JSON file, a table in Markdown and a figure for each topic.
    machine : Machine
    effort : Effort
        What was spent.
    whole : bool
        Show all that was measured.
    as_json : bool
        Write one JSON object to stdout, at the end, instead of tables.
    """

    def __init__(
        self, folder: Path, machine: Machine, effort: Effort, whole: bool, as_json: bool
    ) -> None:
        self.folder, self.machine, self.effort = folder, machine, effort
        self.whole, self.as_json = whole, as_json
        self._found: dict[str, Any] = {"machine": asdict(machine), "effort": asdict(effort)}
        self._files: list[Path] = []

    def begin(self) -> None:
        """Make the folder, and say what it runs on."""
        from wearsim_bench.figures.table import measured_on

        self.folder.mkdir(parents=True, exist_ok=True)
        if not self.as_json:
            console().print(measured_on(self.machine, self.effort))

    def topic(self, topic: Topic) -> None:
        """Write what was measured of a topic."""
        from wearsim.report.parts.saving import save_figure
        from wearsim_bench.figures.table import markdown
        from wearsim_bench.figures.topic import bench_figure

        self._keep(topic.name, topic.as_json())
        self._text(f"{topic.name}.md", markdown(topic, self.machine, self.effort, whole=self.whole))
        figure = self.folder / f"{topic.name}.png"
        save_figure(bench_figure(topic, self.machine, self.effort), figure)
        self._files.append(figure)
        if not self.as_json:
            self._show(topic)

    def hard(self, verdicts: tuple[Verdict, ...]) -> None:
        """Write what became of the hard cases."""
        from wearsim_bench.figures.hard_cases import hard_markdown
        from wearsim_bench.figures.table import measured_on

        holding = sum(verdict.holds for verdict in verdicts)
        cases = [verdict.as_json() for verdict in verdicts]
        self._keep("hard", {"holding": holding, "cases": cases})
        about = measured_on(self.machine, self.effort)
        self._text("hard.md", f"{about}\n\n{hard_markdown(verdicts)}")
        if not self.as_json:
            title = f"Hard cases: {holding} of {len(verdicts)} hold; numbers are the largest found"
            told = [_told(verdict) for verdict in verdicts]
            _print_table(title, ["case", *_SHOWN, "verdict"], told)

    def end(self) -> None:
        """Write the JSON object if it was asked for, and name the files."""
        if self.as_json:
            write_json({**self._found, "files": self._files})
        for path in self._files:
            note(f"written: {path}")

    def _keep(self, name: str, found: dict[str, Any]) -> None:
        """Write what was found to a file of its own, with the machine it was found on."""
        self._found[name] = found
        about = {key: self._found[key] for key in ("machine", "effort")}
        text = json.dumps(plain({**about, **found}), indent=1, ensure_ascii=False, allow_nan=False)
        self._text(f"{name}.json", text + "\n")

    def _text(self, name: str, text: str) -> None:
        from wearsim.report.parts.saving import save_text

        path = self.folder / name
        save_text(text, path)
        self._files.append(path)

    def _show(self, topic: Topic) -> None:
        """Print a table for each group of problems, and what has no answer below it."""
        from wearsim_bench.figures.table import MARKS, has_front, heads, lines

        screen, columns = _screen(), heads(topic)
        screen.print(f"\n{topic.title}\n{topic.about}")
        screen.print(MARKS if has_front(topic) else "")
        for group in topic.groups:
            rows = lines(topic, group, self.machine.yardstick, whole=self.whole)
            answered = [row for row in rows if not row.failed]
            if answered:
                _print_measured(group, columns, answered)
            for row in rows:
                if row.failed:
                    screen.print(f"{group}: {row.cells[0]}, {row.cells[1]}: {row.cells[-1]}")


def _print_measured(title: str, columns: Sequence[str], rows: Sequence[Line]) -> None:
    """Print as many columns as there is room for, the marks always."""
    numbers = range(_NAMED, len(columns) - 1)
    room = _screen().width - _FIXED
    kept = [0, 1, *list(numbers)[: max(3, room // _NUMBER)], len(columns) - 1]
    # a column that is empty all the way down tells nothing
    kept = [k for k in kept if k < _NAMED or any(row.cells[k] not in ("-", "") for row in rows)]
    told = ([row.cells[k] for k in kept] for row in rows)
    _print_table(title, [columns[k] for k in kept], told, [*map(_style, rows)])


def _told(verdict: Verdict) -> list[str]:
    """Return the cells of a hard case: some of its numbers, and the verdict."""
    checks = [verdict.check(name) for name in _SHOWN]
    numbers = ["-" if check is None else f"{check.value:.1e}" for check in checks]
    word = "; ".join(verdict.failures) or ("stops" if verdict.said else "holds")
    return [verdict.case, *numbers, f"{word}: {verdict.said}" if verdict.said else word]


def _style(line: Line) -> str:
    """Return how a line stands out: the front is bold, the default underlined."""
    return " ".join(["bold"] * line.front + ["underline"] * line.default)


def _print_table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    styles: Sequence[str] = (),
) -> None:
    """Print rows under heads, numbers to the right."""
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
    """Return where tables go; wider than text where it is no terminal."""
    screen = console()
    if not screen.is_terminal:
        screen.width = _WIDE
    return screen
