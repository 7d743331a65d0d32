"""Cost of ensembles in time and memory, and accuracy of their realisations.

``python -m tests.benchmarks.ensembles [accuracy|cost|memory ...] [--quick] [-o FILE.md]``
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import wearsim
from tests.benchmarks.ensemble_cases import ALL, Size, drawn, end_values
from tests.benchmarks.table import Row, markdown, part, save_tables
from wearsim.scenario import Scenario
from wearsim_bench.measure.machine import this_machine
from wearsim_bench.measure.timing import timed

REALISATIONS = 5
SHORT = 6000  # passes of a shortened test
CPUS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def scenario(quick: bool, more: Mapping[str, object] | None = None) -> Scenario:
    """Return the rig with all random inputs, optionally shortened."""
    changes: dict[str, object] = {"operation.passes": SHORT} if quick else {}
    return wearsim.load_scenario(ALL, {**changes, **(more or {})})


def accuracy(quick: bool) -> list[Row]:
    """Compare realisations with the implicit stepper to solving every roller pass."""
    rows = []
    for number in range(2 if quick else REALISATIONS):
        chosen = {"sampling.realisation": number}
        result = wearsim.run(scenario(quick, chosen))
        exact = {**chosen, "evolution.stepper": "per-pass"}
        reference = wearsim.run(scenario(quick, exact))
        depth, volume = (
            float(getattr(result, name)[-1] / getattr(reference, name)[-1]) - 1.0
            for name in ("depth", "worn_volume")
        )
        stated = float(result.depth_error[-1] / result.depth[-1])
        rows.append(
            Row(
                f"realisation {number}, {float(reference.depth[-1]) * 1e6:.2f} um by single passes",
                result.raw.wall_seconds,
                f"single passes: {reference.raw.wall_seconds:.3g} s",
                f"depth {part(depth)}, volume {part(volume)} (stated {part(stated)})",
            )
        )
    return rows


def cost(quick: bool) -> list[Row]:
    """Measure the time of ensembles for numbers of tests, strips and workers."""
    small, large = (2, 4) if quick else (100, 1000)
    identical = drawn("per-test", Size(passes=SHORT if quick else None))
    tight, records = {"evolution.tolerance": 1e-3}, {"outputs.records": 20}
    strips = {count: {"contact.strips": count} for count in (61, 121, 241)}
    cases: list[tuple[str, Scenario, int, int, str]] = [
        ("", scenario(quick), small, CPUS, ""),
        ("", scenario(quick), small, 1, ""),
        (", 61 strips", scenario(quick, strips[61]), small, CPUS, ""),
        (", 121 strips", scenario(quick, strips[121]), small, CPUS, ""),
        (", 241 strips", scenario(quick, strips[241]), small, CPUS, ""),
        (", tolerance 1e-3", scenario(quick, tight), small, CPUS, ""),
        (", 20 records", scenario(quick, records), small, CPUS, ""),
        ("", scenario(quick), large, CPUS, "60 s, aim 15 s"),
        (", identical rollers, one contact", identical, large, CPUS, "60 s, aim 15 s"),
    ]
    rows = []
    for words, case, count, workers, target in cases:

        def run(case: Scenario = case, count: int = count, workers: int = workers) -> None:
            end_values(case, count, workers=workers)

        seconds = timed(run)
        per_test = f"{1e3 * seconds * workers / count:.3g} ms of processor time per test"
        rows.append(Row(f"{count} tests, {_workers(workers)}{words}", seconds, target, per_test))
    return rows


def _workers(count: int) -> str:
    return "1 process" if count == 1 else f"{count} processes"


def memory(quick: bool) -> list[Row]:
    """Measure the memory of ensembles in separate processes."""
    rows = []
    for count in (300, 3000) if quick else (1000, 1_000_000):
        found = json.loads(
            subprocess.run(
                [sys.executable, "-m", "tests.benchmarks.ensemble_memory", str(count)],
                check=True,
                capture_output=True,
                text=True,
            ).stdout
        )
        rows.append(
            Row(
                f"{count:,} realisations, closed-form tests, file and statistics",
                found["seconds"],
                "500 MB",
                f"{found['megabytes']:.0f} MB at most, {found['file_megabytes']:.0f} MB on disk",
            )
        )
    return rows


PARTS: Mapping[str, tuple[str, Callable[[bool], list[Row]]]] = {
    "accuracy": ("Realisations of rig-ensemble against single passes", accuracy),
    "cost": ("Cost of ensembles of rig-ensemble", cost),
    "memory": ("Memory against the number of realisations", memory),
}


def main(arguments: list[str] | None = None) -> None:
    """Print the tables, and write them to a file if one is named."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.ensembles", description=__doc__)
    parser.add_argument(
        "parts", nargs="*", metavar="PART", help="accuracy, cost or memory; by default all"
    )
    parser.add_argument("--quick", action="store_true", help="shorten everything")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE.json", help="also write them to this file"
    )
    options = parser.parse_args(arguments)
    sys.stdout.write(f"Measured on {this_machine()}.\n")
    tables = {}
    for name in options.parts or PARTS:
        title, rows = PARTS[name]
        tables[title] = markdown(title, rows(options.quick))
        sys.stdout.write("\n" + tables[title])
        sys.stdout.flush()
    if options.output is not None:
        save_tables(options.output, "python -m tests.benchmarks.ensembles", tables)


if __name__ == "__main__":
    main()
