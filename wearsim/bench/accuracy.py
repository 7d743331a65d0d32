"""How near contact models come to the exact theory: the errors that tests and tables hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from wearsim.bench.exact import CREEPAGES, STEEL, rows, strips_of, worn_profile
from wearsim.errors import ContactError
from wearsim.plugins import ContactModel, ContactModelSpec, registry
from wearsim.types import ContactSolution, Creepage, FloatArray, Grid, OperatingPoint

MATERIALS = (STEEL, STEEL)
WORN_GRID = Grid.spanning(-4e-3, 4e-3, 321)
WORN_CURVATURE, WORN_B = 45.0, 0.5  # 1/m, twice the data's A, and its B


@dataclass(frozen=True)
class PowerErrors:
    """Errors over many draws: of the power, rms and worst, and L2 of P_l(y), median."""

    rms: float
    worst: float
    strips: float


@dataclass(frozen=True)
class WornErrors:
    """Errors on a worn profile, relative to the exact theory.

    L1 of the line load, mean of the half-length's error over its mean, errors of approach and peak
    pressure, and for every creepage the L2 error of P_l(y) and that of the power.
    """

    line_load: float
    half_length: float
    approach: float
    peak_pressure: float
    dissipation: dict[str, float]
    power: dict[str, float]


def built(name: str, **options: Any) -> ContactModel:
    """Return a contact model by its registered name, not yet prepared."""
    spec = registry().get(ContactModelSpec, name)
    return spec.factory(spec.options(**options))


def solved(model: ContactModel, row: dict[str, Any]) -> ContactSolution:
    """Solve an elliptic case of the reference data at V = 1 m/s on strips of the model's choice."""
    curvatures = 2.0 * row["B_per_m"], 2.0 * row["A_per_m"]
    grid = model.suggest_grid(*curvatures, row["N_N"], MATERIALS)
    if grid is None:
        raise ContactError("the model suggests no strips for an elliptic contact", {})
    model.prepare(grid, MATERIALS)
    creepage = Creepage(row["xi"], row["eta"], row["phi_per_m"])
    point = OperatingPoint(row["N_N"], 1.0, creepage, row["mu"])
    return model.solve(row["B_per_m"] * grid.y**2, curvatures[1], point)


def l2(found: FloatArray, exact: FloatArray) -> float:
    """Return the L2 norm of the error over that of the exact values."""
    return float(np.sqrt(((found - exact) ** 2).sum() / (exact**2).sum()))


def drawn_errors(model: ContactModel, kind: str) -> PowerErrors:
    """Return the errors over the 40 draws of `rig_random` of a kind, `paper` or `partial`."""
    y_over_b, dissipation = strips_of(kind)
    powers, strips = [], []
    for row, exact in zip(rows("rig_random", kind=kind), dissipation, strict=True):
        solution = solved(model, row)
        powers.append(solution.power / row["P_over_V_N"] - 1.0)
        strips.append(l2(solution.dissipation, np.interp(solution.y, y_over_b * row["b_m"], exact)))
    return _summed(powers, strips)


def hard_errors(model: ContactModel, least_ratio: float) -> PowerErrors:
    """Return the errors over the hard cases whose b/a is at least so much; no strips are known."""
    chosen = [row for row in rows("hard_cases") if row["b_m"] >= least_ratio * row["a_m"]]
    powers = [solved(model, row).power / row["P_over_V_N"] - 1.0 for row in chosen]
    return _summed(powers, [np.nan])


def _summed(powers: list[float], strips: list[float]) -> PowerErrors:
    rms = float(np.sqrt(np.mean(np.square(powers))))
    return PowerErrors(rms, float(np.abs(powers).max()), float(np.median(strips)))


def worn_errors(model: ContactModel, name: str) -> WornErrors:
    """Return the errors on a worn profile of the reference data.

    Raises
    ------
    ContactError
        If the model has no answer on it.
    """
    exact = worn_profile(name)
    model.prepare(WORN_GRID, MATERIALS)
    gap = np.interp(WORN_GRID.y, exact["y"], exact["w"])
    # beyond the data, where there is no contact, all profiles go on as the crown does
    beyond = np.maximum(np.abs(WORN_GRID.y), exact["y"][-1])
    gap += WORN_B * (beyond**2 - exact["y"][-1] ** 2)
    found = {}
    for case, creepage in CREEPAGES.items():
        point = OperatingPoint(300.0, 1.0, Creepage(*creepage), 0.1)
        found[case] = model.solve(gap, WORN_CURVATURE, point)
    solution = found["mean"]

    def at_strips(key: str) -> FloatArray:
        found: FloatArray = np.interp(WORN_GRID.y, exact["y"], exact[key], left=0.0, right=0.0)
        return found

    q, a = at_strips("q"), at_strips("a")
    return WornErrors(
        line_load=float(np.abs(solution.line_load - q).sum() / q.sum()),
        half_length=float(np.abs(solution.half_length - a).sum() / a.sum()),
        approach=solution.approach / exact["approach"] - 1.0,
        peak_pressure=solution.peak_pressure / exact["peak_pressure"] - 1.0,
        dissipation={c: l2(s.dissipation, at_strips(f"P_l_over_V_{c}")) for c, s in found.items()},
        power={c: s.power / exact[f"P_over_V_{c}"] - 1.0 for c, s in found.items()},
    )
