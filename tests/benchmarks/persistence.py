"""Scatter of wear tests with inputs drawn per test, per roller and per pass.

``python -m tests.benchmarks.persistence [--quick] [-o FILE.md]``
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tests.benchmarks.ensemble_cases import Size, Variation, drawn, end_values
from tests.benchmarks.table import save_tables
from wearsim.types import FloatArray

WHOLE = Size(tests=300)
QUICK = Size(tests=40, passes=6000)
SINGLE_PASSES, SINGLE_TESTS = 3000, 40  # of tests with inputs drawn at every pass
MEASURED = np.array([28.0, 48.0, 62.0])  # the paper's three tests [um]


def spreads(size: Size) -> dict[str, dict[str, FloatArray]]:
    """Return the final values of ensembles of tests by persistence of the inputs."""
    found = {
        "per-test": end_values(drawn("per-test", size), size.tests),
        "per-roller": end_values(drawn("per-roller", size), size.tests),
    }
    single = Size(size.tests, SINGLE_PASSES)
    solved = {"evolution.stepper": "per-pass", "contact.strips": 41}
    found["per-pass"] = end_values(drawn("per-pass", single, solved), SINGLE_TESTS)
    return found


def table(found: Mapping[str, dict[str, FloatArray]], whole_passes: float) -> str:
    """Return the coefficients of variation as a Markdown table."""
    rows = [
        "| persistence | mean power | worn volume | depth | depth / volume | in theory |",
        "|---|---|---|---|---|---|",
    ]
    tests = Variation.of(found["per-test"]["worn_volume"]).value
    for persistence in ("per-test", "per-roller"):
        power, volume, depth = (
            Variation.of(found[persistence][name])
            for name in ("mean_power", "worn_volume", "depth")
        )
        theory = "volume proportional to mean power, depth to its power 2/3"
        if persistence == "per-roller":
            theory = f"volume: per-test / sqrt(3), {tests / math.sqrt(3.0):.2%}"
        rows.append(
            f"| {persistence.replace('per-', 'a ')} | {power} | {volume} | {depth} |"
            f" {depth.value / volume.value:.3f} | {theory} |"
        )
    volume = Variation.of(found["per-pass"]["worn_volume"])
    shrunk = math.sqrt(SINGLE_PASSES / whole_passes)
    rows.append(
        f"| a pass, {SINGLE_PASSES:,} passes | | {volume} | | |"
        f" per-test / sqrt(passes): {tests / math.sqrt(SINGLE_PASSES):.2%} |"
    )
    rows.append(
        f"| a pass, {whole_passes:,.0f} passes | | {volume.value * shrunk:.3%},"
        " scaled by 1 / sqrt(passes) | | | |"
    )
    depth = Variation.of(found["per-test"]["depth"])
    rows.append(
        f"\nThe paper's three tests, {', '.join(f'{d:.0f}' for d in MEASURED)} um:"
        f" {MEASURED.std(ddof=1) / MEASURED.mean():.0%}; inputs drawn per test:"
        f" {depth.value:.0%}."
    )
    return "\n".join(rows) + "\n"


def main(arguments: list[str] | None = None) -> None:
    """Print the table, and write it to a file if one is named."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.persistence", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer and shortened tests")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE.json", help="also write it to this file"
    )
    options = parser.parse_args(arguments)
    size = QUICK if options.quick else WHOLE
    text = table(spreads(size), float(drawn("per-test", WHOLE).total_passes))
    sys.stdout.write(text)
    if options.output is not None:
        save_tables(options.output, "python -m tests.benchmarks.persistence", {"persistence": text})


if __name__ == "__main__":
    main()
