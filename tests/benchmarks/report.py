"""Speed and error as Markdown tables: ``python -m tests.benchmarks.report``.

Rows are added by a function of an `Effort` that returns `Row`s and is listed in `TABLES`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from tests.benchmarks import choices, contacts, starts, studies, wear_tests
from tests.benchmarks.table import Effort, Row, markdown, save_tables
from wearsim_bench.measure.machine import this_machine

TABLES: dict[str, list[Callable[[Effort], list[Row]]]] = {
    "Which model and stepper": [choices.choice_rows],
    "One contact": [
        contacts.hertz_rows,
        contacts.mean_rows,
        contacts.tangential_rows,
        contacts.slender_rows,
    ],
    "Many contacts at once": [contacts.batch_rows],
    "Random inputs": [studies.draw_rows, studies.dissipation_rows, studies.cheapest_rows],
    "Whole tests, in-process, once compiled": [
        wear_tests.wear_test_rows,
        wear_tests.scatter_rows,
        wear_tests.file_rows,
    ],
    "At the shell": [starts.import_rows, starts.run_rows],
}
QUICK = Effort(repetitions=1, part=0.005)


def report(
    effort: Effort, on_progress: Callable[[str], object], titles: Iterable[str] = TABLES
) -> dict[str, str]:
    """Measure some tables and return them; call `on_progress` with each finished table."""
    on_progress(f"Measured on {this_machine()}; best of {effort.repetitions}.\n")
    if effort.quick:
        on_progress("\nShortened tests: these numbers only show that the report works.\n")
    tables = {}
    for title in titles:
        rows = [row for function in TABLES[title] for row in function(effort)]
        tables[title] = markdown(title, rows)
        on_progress("\n" + tables[title])
    return tables


def main(arguments: list[str] | None = None) -> None:
    """Print the report, and write it to a file if one is named."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.report", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shorten everything")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE.json", help="also write it to this file"
    )
    parser.add_argument(
        "--table", action="append", choices=list(TABLES), help="only this table; may be repeated"
    )
    options = parser.parse_args(arguments)

    def on_progress(text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()

    effort = QUICK if options.quick else Effort()
    tables = report(effort, on_progress, options.table or TABLES)
    if options.output is not None:
        save_tables(options.output, "python -m tests.benchmarks.report", tables)


if __name__ == "__main__":
    main()
