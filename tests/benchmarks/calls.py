"""Calls of functions by a step of a test, and on the way of a value to the first kernel.

Run as ``python -m tests.benchmarks.calls`` in the root of the repository; calls of functions in
Python and in C are counted together by `sys.setprofile`, and do not depend on the machine.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from types import FrameType
from typing import Any

import wearsim

ROOT = Path(__file__).parents[2]
PACKAGE = str(Path(wearsim.__file__).parent)
SCENARIO = ROOT / "scenarios" / "rig-450min.toml"


@contextmanager
def _profiled(observe: Callable[[FrameType, str, Any], None]) -> Iterator[None]:
    sys.setprofile(observe)
    try:
        yield
    finally:
        sys.setprofile(None)


def _file(frame: FrameType) -> str:
    """Return the file of a function of wearsim relative to the package; empty for others."""
    name = frame.f_code.co_filename
    return name[len(PACKAGE) + 1 :] if name.startswith(PACKAGE) else ""


def calls_per_step(run: Callable[[], object]) -> tuple[float, float]:
    """Return the calls of a run per trial step, and those of functions of wearsim.

    Steps of the test on coarse strips count as well. Calls before the first step do not.

    Parameters
    ----------
    run : callable
        Runs a test; called once before, so that kernels are loaded.
    """
    steps = calls = own = 0

    def observe(frame: FrameType, event: str, _: Any) -> None:
        nonlocal steps, calls, own
        if event == "call":
            file = _file(frame)
            steps += frame.f_code.co_name == "attempt" and "steppers" in file
            calls += steps > 0
            own += steps > 0 and bool(file)
        elif event == "c_call":
            calls += steps > 0

    run()
    with _profiled(observe):
        run()
    return calls / steps, own / steps


def way_to_first_kernel(run: Callable[[], object]) -> tuple[int, int, int]:
    """Return files entered, ways back up and calls of wearsim before the first kernel is called.

    Everything is imported before, and the scenario is read.

    A way back up is a call of a function in a higher layer than that of the call before, after a
    call into a lower one. The layers are those of the import contract.
    """
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    layers = [name.removeprefix("wearsim.") for name in contracts["contracts"][0]["layers"]]
    entered: list[str] = []
    done = False

    def observe(frame: FrameType, event: str, _: Any) -> None:
        nonlocal done
        if event != "call" or done:
            return
        if file := _file(frame):
            name = frame.f_code.co_name
            done = file == "mechanics/numerics/jit.py" and name == "__call__"
            if not name.startswith("<"):
                entered.append(file)

    with _profiled(observe):
        run()
    order = [layers.index(part) for f in entered if (part := _layer(f)) in layers]
    turns = [later - earlier for earlier, later in pairwise(order) if later != earlier]
    ways_up = sum(first > 0 > second for first, second in pairwise(turns))
    return len(set(entered)), ways_up, len(entered)


def _layer(file: str) -> str:
    return file.split("/", maxsplit=1)[0].removesuffix(".py")


def main() -> None:
    """Print the numbers."""
    scenario = wearsim.load_scenario(SCENARIO)
    every, own = calls_per_step(lambda: wearsim.run(scenario))
    files, ways_up, calls = way_to_first_kernel(lambda: wearsim.run(scenario))
    sys.stdout.write(
        f"calls per step: {every:.0f}, of them {own:.0f} of wearsim\n"
        f"way to the first kernel: {files} files, {ways_up} ways back up, {calls} calls\n"
    )


if __name__ == "__main__":
    main()
