"""True and stated errors of the quadrature over passes, of random tests.

Run as a script with the name of a JSON file, it writes the table of docs/random-inputs.md there.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tests.studies.random_examples import end_of, scenario_of
from wearsim.evolution.error_estimates import greatest_depth, volume_of

SEEDS, NUMBER = (12, 13), 45
EXACT = 256  # nodes of the reference
SMALL = 1e-6  # true errors below it are covered, and have no ratio
KINDS = (
    "creepage",
    "creepage",
    "friction",
    "load",
    "all",
    "all and slack",
    "creepage and load",
    "creepage and friction",
)


def per_pass(**distribution: object) -> dict[str, object]:
    """Return an input that is drawn at every pass."""
    return {**distribution, "persistence": "per-pass"}


def random_inputs(rng: np.random.Generator) -> tuple[int, dict[str, object]]:
    """Return a number of nodes, and the scenario of a test in full or partial slip."""
    kind = str(rng.choice(KINDS))
    creepage = float(np.exp(rng.uniform(np.log(1e-4), np.log(3e-3))))
    factor = float(np.exp(rng.uniform(np.log(1.05), np.log(2.0))))
    found: dict[str, object] = {
        "creepage__longitudinal": creepage,
        "operation__rollers": 1,
        "contact__strips": 61,
        "seed": int(rng.integers(1, 10**6)),
    }
    if rng.random() < 0.25:
        found["creepage__yaw"] = f"{float(rng.uniform(0.1, 2.0) * creepage * 1e3)} mrad"
    if "creepage" in kind or "all" in kind:
        family = rng.choice(["lognormal", "maxent", "uniform"])
        if family == "lognormal":
            values = per_pass(distribution="lognormal", median=creepage, factor=factor)
        elif family == "maxent":
            std = creepage * rng.uniform(0.1, 0.6)
            values = per_pass(distribution="maxent", support=[0, 1], mean=creepage, std=std)
        else:
            ends = {"low": 0.3 * creepage, "high": 1.7 * creepage}
            values = per_pass(distribution="uniform", **ends)
        found["creepage__longitudinal"] = values
    if "friction" in kind or "all" in kind:
        factor = float(rng.uniform(1.05, 1.6))
        found["friction__coefficient"] = per_pass(
            distribution="lognormal", median=0.1, factor=factor
        )
    if "load" in kind or "all" in kind:
        std = f"{307 * rng.uniform(0.05, 0.4)} N"
        support = ["0 N", "inf"]
        found["load__normal_force"] = per_pass(
            distribution="maxent", support=support, mean="307 N", std=std
        )
    if "slack" in kind:
        radius = f"{rng.uniform(0.2, 2):.3f} mrad"
        found["creepage__misalignment"] = per_pass(distribution="disc", radius=radius)
        found.pop("creepage__yaw", None)
    nodes = int(rng.choice([8, 16, 32, 64]))
    return nodes, found | {"passes": int(rng.choice([300, 2000, 6000]))}


def errors(seed: int, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return true and stated relative errors of depth and volume, each shape (tests, 2)."""
    rng, true, stated = np.random.default_rng(seed), [], []
    for _ in range(number):
        nodes, inputs = random_inputs(rng)
        sizes = []
        for count in (nodes, EXACT):
            problem, state = end_of(scenario_of(evolution__nodes=count, **inputs))
            size = greatest_depth(state.depths)[0], volume_of(problem, state.depths)[0]
            sizes.append((np.array(size), state.quadrature[:2, 0]))
        (worn, own), (exact, _) = sizes
        true.append(np.abs(worn / exact - 1.0))
        stated.append(own / worn)
    return np.array(true), np.array(stated)


def statistics(true: np.ndarray, stated: np.ndarray) -> tuple[float, float]:
    """Return the part of the tests whose stated error covers the true one, and the median ratio."""
    seen = true > SMALL
    covered = float(((stated >= true) | ~seen).mean())
    return covered, float(np.median(stated[seen] / true[seen]))


if __name__ == "__main__":
    from tests.benchmarks.table import save_tables

    lines = [
        "| seed | tests | error of | covered | stated over true, median |",
        "|---|---|---|---|---|",
    ]
    for seed in SEEDS:
        pairs = errors(seed, NUMBER)
        for place, name in enumerate(("depth", "volume")):
            part, ratio = statistics(*(values[:, place] for values in pairs))
            lines.append(f"| {seed} | {NUMBER} | {name} | {part:.1%} | {ratio:.1f} |")
    command = "python -m tests.studies.run.quadrature_study"
    save_tables(Path(sys.argv[1]), command, {"quadrature": "\n".join(lines)})
