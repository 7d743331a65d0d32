"""Inputs of random tests that vary in time: recorded loads and processes."""

from __future__ import annotations

import numpy as np

from wearsim_bench.stated_errors.random_tests import Draws, rounded


def set_recorded_load(draws: Draws, force: float, duration: float) -> None:
    """Set a recorded load: ramps between random levels, steps between them, or a pause.

    Parameters
    ----------
    draws : Draws
        Random numbers and changes of the test.
    force : float
        Median of the levels [N].
    duration : float
        Duration of the test [s].
    """
    kind = draws.choice({"ramps": 0.5, "steps": 0.3, "pause": 0.2})
    count = 4 if kind == "pause" else int(draws.log_uniform(4.0, 60.0))
    levels = [force * float(np.exp(0.3 * value)) for value in draws.normal(count)]
    if kind == "pause":
        levels[2] = 0.0
    times = np.linspace(0.0, duration, count + (kind != "ramps"))
    rows = list(zip(times.tolist(), levels, strict=False))
    if kind != "ramps":  # a level lasts until shortly before the next one
        ends = [*(times[1:-1] - 1e-3 * duration / count).tolist(), duration]
        rows = sorted([*rows, *zip(ends, levels, strict=True)])
    lines = [f"{time!r}, {rounded(level)!r}" for time, level in rows]
    draws.files["log.csv"] = "\n".join(["time [s], load [N]", *lines])
    del draws.changes["load.normal_force"]
    draws.changes["load"] = {"kind": "recorded", "file": "log.csv"}


def process(draws: Draws, mean: str, std: str, duration: float) -> dict[str, object]:
    """Return an Ornstein-Uhlenbeck process of a positive value with a unit of force."""
    time = draws.log_uniform(0.02, 0.5) * duration
    marginal = {"distribution": "maxent", "support": ["0 N", "inf"], "mean": mean, "std": std}
    return {
        "distribution": "ornstein-uhlenbeck",
        "correlation_time": f"{time:.4g} s",
        "marginal": marginal,
    }
