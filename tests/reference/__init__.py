"""Exact contact solutions to hold the models against; see `data/README.md` for their source."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.types import Material

DATA = Path(__file__).parent / "data"

STEEL = Material(youngs_modulus=200e9, poisson_ratio=0.3)
WORN = ("hertz", "flat", "bump_1um", "bump_10um", "parabola")
CREEPAGES = {
    "mean": (1e-3, 0.0, 0.0),
    "partial": (4e-4, 0.0, 0.0),
    "combined": (4e-4, 5e-4, 0.05),
}


@cache
def table(name: str) -> dict[str, Any]:
    """Return a JSON file of the data by its name, such as "hertz"; its cases are in `rows`."""
    return json.loads((DATA / f"{name}.json").read_text())


def rows(name: str, **where: Any) -> list[dict[str, Any]]:
    """Return the rows of a JSON file whose values are those of `where`."""
    return [r for r in table(name)["rows"] if all(r[key] == value for key, value in where.items())]


@cache
def rig_random_rows() -> dict[str, np.ndarray]:
    """Return `y_over_b` (124,) and P_l over V of `paper` and `partial`, each (40, 124) [N/m]."""
    with np.load(DATA / "rig_random_rows.npz") as file:
        return {name: np.array(file[name], dtype=np.float64) for name in file.files}


@cache
def worn_profile(name: str) -> dict[str, Any]:
    """Return a worn profile by its name in `WORN`.

    Keys: y, w, q, a, approach, peak_pressure, and per creepage P_l_over_V_* and P_over_V_*.
    """
    with np.load(DATA / f"worn_{name}.npz") as file:
        found = {key: np.array(file[key], dtype=np.float64) for key in file.files}
    return {key: float(value) if value.ndim == 0 else value for key, value in found.items()}
