"""Exact contact solutions; `data/README.md` states their sources and errors."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.types import FloatArray, Material

DATA = Path(__file__).parent / "data"

STEEL = Material(youngs_modulus=200e9, poisson_ratio=0.3)
WORN = ("hertz", "flat", "bump_1um", "bump_10um", "parabola")
CREEPAGES = {
    "mean": (1e-3, 0.0, 0.0),
    "partial": (4e-4, 0.0, 0.0),
    "combined": (4e-4, 5e-4, 0.05),
}

#: relative errors of the data from `data/README.md`: of P_l(y) and of the power
STRIPS_ERROR = 3e-3
POWER_ERRORS = (1e-3, 4e-3)
PURE_SPIN_ERROR = 8e-3  # upper bound for the hard cases


@cache
def table(name: str) -> dict[str, Any]:
    """Return a JSON file of the data, such as "hertz"; its cases are in `rows`."""
    data: dict[str, Any] = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))
    return data


def rows(name: str, **where: Any) -> list[dict[str, Any]]:
    """Return the rows of a JSON file with the values in `where`."""
    return [r for r in table(name)["rows"] if all(r[key] == value for key, value in where.items())]


@cache
def strips_of(kind: str) -> tuple[FloatArray, FloatArray]:
    """Return y/b, shape (124,), and P_l/V [N/m], shape (cases, 124), of elliptic contacts.

    Parameters
    ----------
    kind : str
        "paper" or "partial" for the draws of `rig_random`, or "hard" for `hard_cases`.
    """
    name = "hard_cases" if kind == "hard" else "rig_random"
    with np.load(DATA / f"{name}_rows.npz") as file:
        return np.array(file["y_over_b"]), np.array(file[kind], dtype=np.float64)


@cache
def worn_profile(name: str) -> dict[str, Any]:
    """Return a worn profile by its name in `WORN`.

    The keys are y, w, q, a, approach, peak_pressure, and for each
    creepage P_l_over_V_* and P_over_V_*.
    """
    with np.load(DATA / f"worn_{name}.npz") as file:
        data = {key: np.array(file[key], dtype=np.float64) for key in file.files}
    return {key: float(value) if value.ndim == 0 else value for key, value in data.items()}
