"""Times of whole wear tests of cams: `python -m tests.benchmarks.cams [number of cams]`.

One cam with a prescribed creepage and one with a free roller, a batch of eight, and cams of
different geometries on two processes. All make 1.35 million turns; the kernels are loaded before.
"""

from __future__ import annotations

import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import wearsim
from wearsim.errors import ScenarioError
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.ensemble.realisation import RealisationRunner, profile_axis

SCENARIOS = Path(__file__).parents[2] / "scenarios"
LAWS = ("cycloidal", "modified-sine", "modified-trapezoid", "polynomial-345", "polynomial-4567")
PRESCRIBED = {"creepage": {"drive": "creepage", "longitudinal": 1e-3}}
BATCH = 8


def random_cam(number: int, tolerance: float = 1e-2) -> wearsim.Scenario:
    """Return a cam with random motion, radii, masses, load and speed, and a free roller."""
    random = np.random.default_rng([17, number])
    while True:
        rise = f"{random.uniform(4.0, 12.0)} mm"
        first, second = random.uniform(70.0, 110.0, 2)
        top = random.uniform(20.0, 90.0)
        bottom = 360.0 - first - second - top
        laws = random.choice(LAWS, 2)
        motion = [
            {"law": "dwell", "angle": f"{bottom} deg"},
            {"law": str(laws[0]), "angle": f"{first} deg", "rise": rise},
            {"law": "dwell", "angle": f"{top} deg"},
            {"law": str(laws[1]), "angle": f"{second} deg", "rise": f"-{rise}"},
        ]
        values = {
            "cam.motion": motion,
            "cam.base_radius": f"{random.uniform(22.0, 40.0)} mm",
            "follower.offset": f"{random.uniform(-4.0, 4.0)} mm",
            "follower.mass": f"{random.uniform(0.2, 0.6)} kg",
            "roller.radius": f"{random.uniform(10.0, 22.0)} mm",
            "roller.crown_radius": f"{random.uniform(300.0, 900.0)} mm",
            "operation.speed": f"{random.uniform(400.0, 1000.0)} rpm",
            "load.preload": f"{random.uniform(250.0, 500.0)} N",
            "friction.coefficient": random.uniform(0.08, 0.15),
            "creepage.yaw": f"{random.uniform(0.5, 2.0)} mrad",
            "evolution.tolerance": tolerance,
        }
        scenario = wearsim.load_scenario(SCENARIOS / "cam-cycloidal.toml", values)
        try:
            turn_of(scenario)
        except ScenarioError:  # undercut, or the follower jumps
            continue
        return scenario


def depth_of(number: int) -> tuple[float, float]:
    """Return the depth [m] of a cam of another geometry at the end, and processor time [s]."""
    warnings.simplefilter("ignore")
    start = time.process_time()
    depth = float(wearsim.run(random_cam(number)).depth[-1])
    return depth, time.process_time() - start


def single(changes: dict[str, object]) -> float:
    """Return the time of a run of the cycloidal cam, the second one [s]."""
    scenario = wearsim.load_scenario(SCENARIOS / "cam-cycloidal.toml", changes)
    wearsim.run(scenario)
    start = time.perf_counter()
    wearsim.run(scenario)
    return time.perf_counter() - start


def batched() -> float:
    """Return the time of a cam in a batch of cams with free rollers [s]."""
    scenario = wearsim.load_scenario(SCENARIOS / "cam-life.toml")
    run = RealisationRunner(scenario, "monte-carlo", BATCH, profile_axis(scenario))
    run([0])
    start = time.perf_counter()
    run(range(BATCH))
    return (time.perf_counter() - start) / BATCH


def write(text: str) -> None:
    """Write a line at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main(cams: int) -> None:
    """Print the times."""
    warnings.simplefilter("ignore")
    write(f"prescribed creepage: {single(dict(PRESCRIBED)):.2f} s")
    write(f"free roller: {single({}):.2f} s")
    write(f"free roller, in a batch of {BATCH}: {batched():.2f} s each")
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        start = time.perf_counter()
        depths, processor = zip(*pool.map(depth_of, range(cams)), strict=True)
        spent = time.perf_counter() - start
    low, high = 1e6 * min(depths), 1e6 * max(depths)
    write(
        f"{cams} geometries, two processes: {spent:.1f} s ({sum(processor):.1f} s of processor),"
        f" at a tolerance of 1e-2, depths {low:.1f} to {high:.1f} um"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
