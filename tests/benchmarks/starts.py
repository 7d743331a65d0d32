"""Start-up time of the commands, in separate processes."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.benchmarks.table import Effort, Row
from tests.benchmarks.wear_tests import SCENARIOS
from wearsim_bench.measure.timing import best, timed

WEARSIM = [sys.executable, "-m", "wearsim"]


def call(*command: str, **environment: str) -> None:
    """Run a command without showing its output."""
    subprocess.run(command, env=os.environ | environment, capture_output=True, check=True)


def import_rows(effort: Effort) -> list[Row]:
    """Time `wearsim --help` and `import wearsim`, including the start of Python."""
    python = best(lambda: call(sys.executable, "-c", "pass"), effort.repetitions)
    plain = best(lambda: call(sys.executable, "-c", "import wearsim"), effort.repetitions)
    usage = best(lambda: call(*WEARSIM, "--help"), effort.repetitions)
    python_only = f"Python alone {python * 1e3:.0f} ms of it"
    return [
        Row("`wearsim --help`", usage, "0.4 s", python_only),
        Row("`import wearsim`", plain, "0.3 s", python_only),
    ]


def run_command(folder: str) -> list[str]:
    """Return the command that runs the test of the rig."""
    scenario = str(SCENARIOS / "rig-450min.toml")
    return [*WEARSIM, "run", scenario, "-o", str(Path(folder) / "rig.h5"), "--force"]


def first_output(folder: str, cache: str) -> float:
    """Return the time until a run prints its first output [s]."""
    start = time.perf_counter()
    with subprocess.Popen(
        run_command(folder),
        env=os.environ | {"NUMBA_CACHE_DIR": cache},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        bufsize=0,
    ) as process:
        assert process.stdout is not None
        process.stdout.read(1)
        seconds = time.perf_counter() - start
        process.stdout.read()
    return seconds


def run_rows(effort: Effort) -> list[Row]:
    """Time the first run after installation, which compiles, later runs, and their dry run."""
    with TemporaryDirectory() as folder:
        command = run_command(folder)
        cache = str(Path(folder) / "cache")
        first = timed(lambda: call(*command, NUMBA_CACHE_DIR=cache))
        until_output = min(first_output(folder, cache) for _ in range(effort.repetitions))
        later = best(lambda: call(*command, NUMBA_CACHE_DIR=cache), effort.repetitions)
        checked = [*WEARSIM, "check", str(SCENARIOS / "rig-450min.toml")]
        check = best(lambda: call(*checked, NUMBA_CACHE_DIR=cache), effort.repetitions)
    return [
        Row("first `wearsim run` after install, compiling", first, "10 s, aim 6 s"),
        Row("later `wearsim run`, to its first output", until_output, "1.0 s"),
        Row("later `wearsim run`, to its end", later, "1.0 s, aim 0.6 s"),
        Row("later `wearsim check`", check, "0.6 s", "with the contacts of its forecast"),
    ]
