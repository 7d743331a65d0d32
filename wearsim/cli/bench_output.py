"""Tables of a benchmark on stdout, and its files, each written as soon as it can be."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.cli.output import console, note, plain, write_json

if TYPE_CHECKING:
    from wearsim.bench.hard_verdict import Verdict
    from wearsim.bench.machine import Machine
    from wearsim.bench.measured import Effort, Topic
    from wearsim.report.bench_table import Line

_WORDS = ("setting",)
_LEADING = ("what", "setting", "time", "yardsticks")
_NAMES = 24  # letters that names have room for before all else
_NUMBER = 10  # letters of a column of numbers, at most
_MOST = 9  # columns of a table, its marks left aside
_WIDE = 132  # columns of text, for tables that go into a file or a pipe
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
        from wearsim.report.bench_table import measured_on

        self.folder.mkdir(parents=True, exist_ok=True)
        if not self.as_json:
            console().print(measured_on(self.machine))

    def topic(self, topic: Topic) -> None:
        """Write what was measured of a topic."""
        from wearsim.report.bench import bench_figure
        from wearsim.report.bench_table import markdown
        from wearsim.report.saving import save_figure

        self._keep(topic.name, topic.as_json())
        self._text(f"{topic.name}.md", markdown(topic, self.machine, whole=self.whole))
        figure = self.folder / f"{topic.name}.png"
        save_figure(bench_figure(topic, self.machine), figure)
        self._files.append(figure)
        if not self.as_json:
            self._show(topic)

    def hard(self, verdicts: tuple[Verdict, ...]) -> None:
        """Write what became of the hard cases."""
        from wearsim.bench.hard import hard_markdown

        holding = sum(verdict.holds for verdict in verdicts)
        cases = [verdict.as_json() for verdict in verdicts]
        self._keep("hard", {"holding": holding, "cases": cases})
        self._text("hard.md", hard_markdown(verdicts))
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
        from wearsim.report.saving import save_text

        path = self.folder / name
        save_text(text, path)
        self._files.append(path)

    def _show(self, topic: Topic) -> None:
        """Print a table for each group of scenes."""
        from wearsim.report.bench_table import heads, lines

        screen, columns = console(), heads(topic)
        # what does not fit beside the errors is in the files
        kept = [place for place in range(len(columns)) if place not in _left_out(topic)]
        screen.print(f"\n{topic.title}\n{topic.about}")
        for group in topic.groups:
            rows = lines(topic, group, self.machine.yardstick, whole=self.whole)
            told = ([row.cells[place] for place in kept] for row in rows)
            _print_table(group, [columns[place] for place in kept], told, [*map(_style, rows)])


def _left_out(topic: Topic) -> range:
    """Return the places of counts, where there are more columns than fit."""
    first = len(_LEADING) + len(topic.errors)
    return range(first, first + len(topic.counts) if first + len(topic.counts) > _MOST else first)


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
            table.add_column(head, overflow="fold")
        else:
            table.add_column(head, justify="right", max_width=_NUMBER)
    for number, row in enumerate(rows):
        table.add_row(*row, style=styles[number] if styles else "")
    screen = console()
    if not screen.is_terminal:
        screen.width = _WIDE
    screen.print(table)
