"""What an ensemble costs, in time and memory, and how exact its members are.

``python -m tests.benchmarks.ensembles [truth|cost|memory ...] [--quick] [-o FILE.md]``
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
from tests.benchmarks.table import Row, markdown, part
from wearsim.scenario import Scenario
from wearsim_bench.measure.machine import this_machine
from wearsim_bench.measure.timing import timed

MEMBERS = 5
SHORT = 6000  # passes of a shortened test
CPUS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def scenario(quick: bool, more: Mapping[str, object] | None = None) -> Scenario:
    """Return the rig with all that scatters, shortened where little effort is asked for."""
    changes: dict[str, object] = {"operation.passes": SHORT} if quick else {}
    return wearsim.load_scenario(ALL, {**changes, **(more or {})})


def truth(quick: bool) -> list[Row]:
    """Hold implicit members against tests in which every pass is solved by itself."""
    rows = []
    for number in range(2 if quick else MEMBERS):
        chosen = {"sampling.realisation": number}
        result = wearsim.run(scenario(quick, chosen))
        exact = {**chosen, "evolution.stepper": "per-pass"}
        true = wearsim.run(scenario(quick, exact))
        depth, volume = (
            float(getattr(result, name)[-1] / getattr(true, name)[-1]) - 1.0
            for name in ("depth", "worn_volume")
        )
        stated = float(result.depth_error[-1] / result.depth[-1])
        rows.append(
            Row(
                f"member {number}, {float(true.depth[-1]) * 1e6:.2f} um by single passes",
                result.raw.wall_seconds,
                f"single passes: {true.raw.wall_seconds:.3g} s",
                f"depth {part(depth)}, volume {part(volume)} (stated {part(stated)})",
            )
        )
    return rows


def cost(quick: bool) -> list[Row]:
    """Measure the time that tests take against their number, their strips and the workers."""
    few, many = (2, 4) if quick else (100, 1000)
    alike = drawn("per-test", Size(passes=SHORT if quick else None))
    tight, records = {"evolution.tolerance": 1e-3}, {"outputs.records": 20}
    strips = {count: {"contact.strips": count} for count in (61, 121, 241)}
    cases: list[tuple[str, Scenario, int, int, str]] = [
        ("", scenario(quick), few, CPUS, ""),
        ("", scenario(quick), few, 1, ""),
        (", 61 strips", scenario(quick, strips[61]), few, CPUS, ""),
        (", 121 strips", scenario(quick, strips[121]), few, CPUS, ""),
        (", 241 strips", scenario(quick, strips[241]), few, CPUS, ""),
        (", tolerance 1e-3", scenario(quick, tight), few, CPUS, ""),
        (", 20 records", scenario(quick, records), few, CPUS, ""),
        ("", scenario(quick), many, CPUS, "60 s, aim 15 s"),
        (", rollers alike, one contact", alike, many, CPUS, "60 s, aim 15 s"),
    ]
    rows = []
    for words, made, count, workers, asked in cases:

        def run(made: Scenario = made, count: int = count, workers: int = workers) -> None:
            end_values(made, count, workers=workers)

        seconds = timed(run)
        each = f"{1e3 * seconds * workers / count:.3g} ms of a processor for each"
        rows.append(Row(f"{count} tests, {_workers(workers)}{words}", seconds, asked, each))
    return rows


def _workers(count: int) -> str:
    return "1 process" if count == 1 else f"{count} processes"


def memory(quick: bool) -> list[Row]:
    """Measure how much memory ensembles take, by processes of their own."""
    rows = []
    for count in (300, 3000) if quick else (1000, 1_000_000):
        found = json.loads(
            subprocess.run(
                [sys.executable, "-m", "tests.benchmarks.million", str(count)],
                check=True,
                capture_output=True,
                text=True,
            ).stdout
        )
        rows.append(
            Row(
                f"{count:,} realisations, closed-form tests, to the file and its statistics",
                found["seconds"],
                "500 MB",
                f"{found['megabytes']:.0f} MB at most, {found['file_megabytes']:.0f} MB on disk",
            )
        )
    return rows


PARTS: Mapping[str, tuple[str, Callable[[bool], list[Row]]]] = {
    "truth": ("RealisationRunner of rig-ensemble beside single passes", truth),
    "cost": ("What ensembles of rig-ensemble cost", cost),
    "memory": ("Memory against realisations", memory),
}


def main(arguments: list[str] | None = None) -> None:
    """Print the tables, and write them where asked."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.ensembles", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help="truth, cost or memory; or all")
    parser.add_argument("--quick", action="store_true", help="shorten everything")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.md", help="write them here too")
    asked = parser.parse_args(arguments)
    text = f"Measured on {this_machine()}.\n"
    sys.stdout.write(text)
    for name in asked.parts or PARTS:
        title, rows = PARTS[name]
        table = "\n" + markdown(title, rows(asked.quick))
        sys.stdout.write(table)
        sys.stdout.flush()
        text += table
    if asked.output is not None:
        asked.output.parent.mkdir(parents=True, exist_ok=True)
        asked.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
