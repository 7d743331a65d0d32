"""Errors of contact models relative to exact solutions, as used by tests and tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearsim.errors import ContactError
from wearsim.plugins import ContactModelSpec, registry
from wearsim.scenario.tables.plugin import ContactChoice
from wearsim.types import ContactSolution, FloatArray, Grid
from wearsim_bench.contact.cases import MATERIALS, Case, contact_width, elliptic_cases, worn_cases
from wearsim_bench.exact_solutions import worn_profile

WORN_STRIPS = 321


@dataclass(frozen=True)
class CaseErrors:
    """Relative errors of one contact; all except that of P_l(y) are signed.

    Power, P_l(y) (L2 over the strips), width and peak pressure.
    """

    power: float
    dissipation: float
    width: float
    peak_pressure: float


@dataclass(frozen=True)
class PowerErrors:
    """Relative errors over a set of contacts: rms and largest of power, median L2 of P_l(y)."""

    rms: float
    worst: float
    strips: float


@dataclass(frozen=True)
class WornErrors:
    """Relative errors on a worn profile.

    L1 errors of line load and half-length, errors of approach and peak pressure, and for each
    creepage the L2 error of P_l(y) and the error of the power.
    """

    line_load: float
    half_length: float
    approach: float
    peak_pressure: float
    dissipation: dict[str, float]
    power: dict[str, float]


def choose_model(name: str, **options: Any) -> ContactChoice:
    """Return a contact model by its registered name, with options."""
    return ContactChoice(name, registry().get(ContactModelSpec, name).options(**options))


def solved(
    choice: ContactChoice, case: Case, strips: int | None = None
) -> tuple[ContactSolution, Grid]:
    """Build a model and solve a case, by default on the strips suggested by the model."""
    grid = case.grid(choice, strips)
    model = choice.build(grid, MATERIALS)
    return model.solve_one(case.gap_at(grid.y), case.longitudinal_curvature, case.point), grid


def errors_of(solution: ContactSolution, grid: Grid, case: Case) -> CaseErrors:
    """Return the errors of a solution.

    Raises
    ------
    ContactError
        If one is not finite.
    """
    exact = case.exact
    errors = CaseErrors(
        power=solution.power / exact.power - 1.0,
        dissipation=l2(
            solution.dissipation,
            np.interp(solution.y, exact.y, exact.dissipation, left=0.0, right=0.0),
        ),
        width=contact_width(solution.line_load, grid.spacing) / exact.width - 1.0,
        peak_pressure=solution.peak_pressure / exact.peak_pressure - 1.0,
    )
    invalid = [name for name, error in vars(errors).items() if not np.isfinite(error)]
    if invalid:
        raise ContactError(f"{', '.join(invalid)}: not finite", vars(errors))
    return errors


def l2(computed: FloatArray, exact: FloatArray) -> float:
    """Return the L2 norm of the error over that of the exact values."""
    return float(np.sqrt(((computed - exact) ** 2).sum() / (exact**2).sum()))


def rms(errors: Iterable[float]) -> float:
    """Return the root mean square of errors."""
    return float(np.sqrt(np.mean(np.square(list(errors)))))


def random_case_errors(choice: ContactChoice, kind: str) -> PowerErrors:
    """Return the errors over the 40 draws of `rig_random` of a kind, "paper" or "partial"."""
    return _errors_over(choice, elliptic_cases(kind))


def hard_case_errors(choice: ContactChoice, least_ratio: float) -> PowerErrors:
    """Return the errors over the hard cases with b/a of at least `least_ratio`."""
    cases = elliptic_cases("hard")
    return _errors_over(choice, [c for c in cases if c.patch.b >= least_ratio * c.patch.a])


def _errors_over(choice: ContactChoice, cases: Iterable[Case]) -> PowerErrors:
    return summed([errors_of(*solved(choice, case), case) for case in cases])


def summed(cases: Sequence[CaseErrors]) -> PowerErrors:
    """Combine the errors of single contacts."""
    powers = [errors.power for errors in cases]
    strips = float(np.median([errors.dissipation for errors in cases]))
    return PowerErrors(rms(powers), float(np.abs(powers).max()), strips)


def worn_errors(choice: ContactChoice, name: str) -> WornErrors:
    """Return the errors on a worn profile of the reference data.

    Raises
    ------
    ContactError
        If the model has no solution.
    """
    exact, cases = worn_profile(name), worn_cases(name)
    solutions = {slip: solved(choice, case, WORN_STRIPS) for slip, case in cases.items()}
    errors = {slip: errors_of(*solutions[slip], case) for slip, case in cases.items()}
    solution, grid = solutions["mean"]

    def l1(values: FloatArray, key: str) -> float:
        reference = np.interp(grid.y, exact["y"], exact[key], left=0.0, right=0.0)
        return float(np.abs(values - reference).sum() / reference.sum())

    return WornErrors(
        line_load=l1(solution.line_load, "q"),
        half_length=l1(solution.half_length, "a"),
        approach=solution.approach / exact["approach"] - 1.0,
        peak_pressure=errors["mean"].peak_pressure,
        dissipation={slip: error.dissipation for slip, error in errors.items()},
        power={slip: error.power for slip, error in errors.items()},
    )
