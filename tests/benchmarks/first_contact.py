"""The way from an empty folder to a first figure: ``python -m tests.benchmarks.first_contact``.

A wheel is installed into a new environment in an empty folder, and the commands of the README are
typed there. ``-o FILE.json`` keeps the times; ``--readme`` writes the sentence of the README.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from wearsim_bench.measure.machine import this_machine

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
MEASURED = ROOT / "docs" / "measurements" / "first-contact.json"
_SENTENCE = re.compile(r"^From an empty folder .*$", re.MULTILINE)


def steps(wheel: Path) -> list[list[str]]:
    """Return the commands from an empty folder to a figure."""
    return [
        [sys.executable, "-m", "venv", ".venv"],
        [".venv/bin/pip", "install", "--quiet", str(wheel)],
        [".venv/bin/wearsim", "new", "scenario", "rig.toml"],
        [".venv/bin/wearsim", "run", "rig.toml"],
        [".venv/bin/wearsim", "plot", "rig.h5"],
    ]


def build(folder: Path) -> Path:
    """Return a wheel of this checkout."""
    options = ("--quiet", "--no-deps", "--no-build-isolation", "-w", str(folder))
    subprocess.run([sys.executable, "-m", "pip", "wheel", *options, str(ROOT)], check=True)
    (wheel,) = folder.glob("wearsim-*.whl")
    return wheel


def measured(wheel: Path) -> dict[str, Any]:
    """Return processor time and wall time of every step [s], and the size of the figure [bytes].

    The process that compiles kernels meanwhile, and continues after `run`, is not counted.
    """
    hidden = {"PYTHONPATH", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME"}
    rows = []
    # another process still writes compiled kernels at the end
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder, home = Path(name) / "empty", Path(name) / "home"
        kept = {key: value for key, value in os.environ.items() if key not in hidden}
        folder.mkdir()
        home.mkdir()  # without caches of numba and matplotlib
        for command in steps(wheel):
            before, start = os.times(), time.perf_counter()
            environment = {**kept, "HOME": str(home), "PIP_NO_CACHE_DIR": "1"}
            subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
            after = os.times()
            used = after.children_user + after.children_system
            used -= before.children_user + before.children_system
            text = " ".join(Path(part).name if "/" in part else part for part in command)
            rows.append({"command": text, "processor_s": used,
                         "wall_s": time.perf_counter() - start})  # fmt: skip
        size = (folder / "rig.png").stat().st_size
    return {
        "machine": asdict(this_machine()),
        "command": "python -m tests.benchmarks.first_contact",
        "steps": rows,
        "figure_bytes": size,
    }


def sentence(found: dict[str, Any]) -> str:
    """Return the sentence of the README."""
    times = [row["processor_s"] for row in found["steps"]]
    install, first = sum(times[:2]), sum(times[2:])
    return (
        f"From an empty folder to the first figure takes {len(times)} commands and"
        f" {install + first:.0f} s of one core, and downloads: {install:.0f} s to make an"
        f" environment and to install the wheel, {first:.0f} s for `new scenario`, `run` and"
        " `plot`, while another process compiles the kernels (`python -m"
        " tests.benchmarks.first_contact`)."
    )


def main() -> None:
    """Measure, and print the times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wheel", type=Path, help="by default one of this checkout")
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--readme", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = measured((options.wheel or build(Path(folder))).resolve())
    for row in found["steps"]:
        sys.stdout.write(f"{row['processor_s']:6.1f} s  {row['command']}\n")
    sys.stdout.write(sentence(found) + "\n")
    if options.output:
        options.output.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    if options.readme:
        README.write_text(_SENTENCE.sub(sentence(found), README.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
