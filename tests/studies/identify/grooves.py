"""Synthetic grooves of the rig with known truth."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from tests.rig_text import BODIES, RUBBING
from wearsim.scenario import Scenario
from wearsim.studies.cam.cam_wear import Wanted
from wearsim.studies.identify.likelihood import TraceLikelihood
from wearsim.studies.identify.trajectories import Grower, Grown
from wearsim.uq.hierarchy.noise import Noise

NOISE = Noise(1e-6, 0.2e-3, 0.1e-6)
K = 1.1e-11
TEXT = f"""
title = "test of one roller"
{BODIES}
[operation]
speed = "1000 rpm"
duration = "450 min"
rollers = 3

[load]
normal_force = "300 N"

{RUBBING}
[wear]
law = "archard-dissipation"

[wear.cylinder]
k_over_h = "1.1e-11 1/Pa"

[wear.roller]
k_over_h = "0 1/Pa"

[evolution]
tolerance = 1e-2
"""
RANDOM = {
    "friction.coefficient": {"distribution": "lognormal", "median": 0.1, "factor": 1.2},
    "creepage.longitudinal": {"distribution": "lognormal", "median": 1e-3, "factor": 1.3},
}
PASSES = 1_350_000.0


def rig(random: bool = False) -> Scenario:
    """Return the scenario of the rig, with random inputs or without."""
    return Scenario.from_toml(TEXT, RANDOM if random else None, name="rig.toml")


@cache
def grown() -> Grown:
    """Return the worn profiles of the rig for all wear factors."""
    return Grower(rig()).grow([Wanted("cylinder", PASSES, 28e-6, 62e-6)]).by_passes[PASSES]


def groove(
    rng: np.random.Generator,
    k: float = K,
    shift: float = 0.2e-3,
    half: float = 11e-3,
    noise: Noise = NOISE,
    inclination: float = 2e-4,
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and heights of a noisy groove with offset and inclination [m]."""
    y = np.arange(-half, half, 40e-6)
    clean = TraceLikelihood(y, np.zeros_like(y), NOISE, grown())
    worn = clean.worn(np.array([0]), np.array([np.log(k)]), np.array([shift]))[:, 0]
    return y, 3e-6 + inclination * y - worn + noise.sample(y, rng.standard_normal((2, len(y))))


def write(path: Path, y: np.ndarray, height: np.ndarray, names: str = "y [mm],height [um]") -> Path:
    """Write a profile as CSV."""
    table = np.column_stack([1e3 * y, 1e6 * height])
    np.savetxt(path, table, delimiter=",", header=names, comments="", fmt="%.6f")
    return path
