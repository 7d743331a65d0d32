"""Calls of functions by a step of a test, before its first step, and to the first kernel.

Run as ``python -m tests.benchmarks.calls`` in the root of the repository; calls of functions in
Python and in C are counted together by `sys.setprofile`, and do not depend on the machine.
"""

from __future__ import annotations

import sys
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from statistics import median
from types import FrameType
from typing import Any

import wearsim
from wearsim.evolution.steppers.base import Stepper

ROOT = Path(__file__).parents[2]
PACKAGE = str(Path(wearsim.__file__).parent)
SCENARIOS = ROOT / "scenarios"
RIG, CAM = "rig-450min", "cam-cycloidal"
#: facts of a test that a run needs before its first step, by files and the functions in them
FACTS = {
    "pair of materials": ("mechanics/hertz/elasticity.py", {"combine"}),
    "turn of the cam": ("studies/cam/turn.py", {"__init__"}),
    "patch after Hertz": ("mechanics/hertz/ellipse.py", {"hertz"}),
    "groove": ("studies/run/setup.py", {"half_width"}),
}


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


class _Started(BaseException):
    """A run has come to its first step."""


def _to_first_step(run: Callable[[], object]) -> None:
    """Start a run, and stop it before its first step."""

    def refuse(*_: object, **__: object) -> object:
        raise _Started

    attempts = {cls: cls.__dict__["attempt"] for cls in _classes(Stepper) if "attempt" in vars(cls)}
    for cls in attempts:
        cls.attempt = refuse
    try:
        run()
    except _Started:
        pass
    finally:
        for cls, attempt in attempts.items():
            cls.attempt = attempt


def _classes(cls: Any) -> set[Any]:
    return {cls, *(c for below in cls.__subclasses__() for c in _classes(below))}


def start_of(run: Callable[[], object]) -> dict[str, int]:
    """Return how often functions of wearsim are called before the first step, and all calls.

    Parameters
    ----------
    run : callable
        Runs a test.

    Returns
    -------
    dict of str to int
        Calls of the functions of `FACTS` by the names there, and "calls", those in C among them.
    """
    found: Counter[str] = Counter()

    def observe(frame: FrameType, event: str, _: Any) -> None:
        if event not in {"call", "c_call"}:
            return
        found["calls"] += 1
        file, name = _file(frame) if event == "call" else "", frame.f_code.co_name
        for fact, (place, names) in FACTS.items():
            found[fact] += file == place and (not names or name in names)

    with _profiled(observe):
        _to_first_step(run)
    return dict(found)


def seconds_to_first_step(scenario: Callable[[], wearsim.Scenario], times: int = 15) -> float:
    """Return the median processor time from a read scenario to the first step [s].

    Parameters
    ----------
    scenario : callable
        Reads the scenario, so that nothing is known of it.
    times : int
        Number of starts, the first of which is not counted.
    """
    found = []
    for _ in range(times + 1):
        fresh = scenario()
        start = time.process_time()
        _to_first_step(lambda one=fresh: wearsim.run(one))  # type: ignore[misc]
        found.append(time.process_time() - start)
    return median(found[1:])


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
    for name in (RIG, CAM):
        file = SCENARIOS / f"{name}.toml"
        every, own = calls_per_step(lambda f=file: wearsim.run(f))  # type: ignore[misc]
        fresh = wearsim.load_scenario(file)
        files, ways_up, calls = way_to_first_kernel(lambda s=fresh: wearsim.run(s))  # type: ignore[misc]
        fresh = wearsim.load_scenario(file)
        facts = start_of(lambda s=fresh: wearsim.run(s))  # type: ignore[misc]
        seconds = seconds_to_first_step(lambda f=file: wearsim.load_scenario(f))  # type: ignore[misc]
        counts = ", ".join(f"{fact} {count}" for fact, count in facts.items())
        sys.stdout.write(
            f"{name}\n"
            f"  calls per step: {every:.0f}, of them {own:.0f} of wearsim\n"
            f"  way to the first kernel: {files} files, {ways_up} ways back up, {calls} calls\n"
            f"  to the first step: {1e3 * seconds:.2f} ms; {counts}\n"
        )


if __name__ == "__main__":
    main()
