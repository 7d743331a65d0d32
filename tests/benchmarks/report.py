"""Speed beside error, as a Markdown table: ``python -m tests.benchmarks.report``.

A row is added by a function that takes an `Effort` and returns `Row`s, and its name in `TABLES`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from tests.benchmarks import contacts, replays, starts, studies
from tests.benchmarks.table import Effort, Row, markdown
from wearsim_bench.measure.machine import this_machine

TABLES: dict[str, list[Callable[[Effort], list[Row]]]] = {
    "One contact": [
        contacts.hertz_rows,
        contacts.mean_rows,
        contacts.tangential_rows,
        contacts.slender_rows,
    ],
    "Many contacts at once": [contacts.many_rows],
    "Random inputs": [studies.draw_rows, studies.dissipation_rows, studies.cheapest_rows],
    "Whole tests, in-process, once compiled": [
        replays.replay_rows,
        replays.scatter_rows,
        replays.file_rows,
    ],
    "At the shell": [starts.import_rows, starts.run_rows],
}
QUICK = Effort(repetitions=1, part=0.005)


def report(effort: Effort, tell: Callable[[str], object]) -> str:
    """Measure everything and return the report; `tell` gets each table as soon as it is done."""
    text = f"Measured on {this_machine()}; best of {effort.repetitions}.\n"
    if effort.quick:
        text += "\nShortened tests: these numbers only show that the report works.\n"
    tell(text)
    for title, functions in TABLES.items():
        rows = [row for function in functions for row in function(effort)]
        table = "\n" + markdown(title, rows)
        tell(table)
        text += table
    return text


def main(arguments: list[str] | None = None) -> None:
    """Print the report, and write it where asked."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.report", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shorten everything")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.md", help="write it here too")
    asked = parser.parse_args(arguments)

    def tell(text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()

    text = report(QUICK if asked.quick else Effort(), tell)
    if asked.output is not None:
        asked.output.parent.mkdir(parents=True, exist_ok=True)
        asked.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
