"""Contacts with known solutions, on the same elements as in CONTACT."""

import json
from functools import cache
from pathlib import Path

import numpy as np

from wearsim.types import Material
from wearsim_halfspace.grids import Problem, Solution, solve
from wearsim_halfspace.normal import solve_normal

STEEL = Material(youngs_modulus=200e9, poisson_ratio=0.3)
SHEAR = STEEL.youngs_modulus / (2.0 * (1.0 + STEEL.poisson_ratio))
SPARE = 2  # elements around the ellipse


@cache
def rows(name: str) -> list[dict]:
    """Return the rows of a file of reference data."""
    return json.loads((Path(__file__).parent / f"{name}.json").read_text())["rows"]


RANDOM = [row for row in rows("contact") if row["kind"] == "partial"]
HARD = [row for row in rows("contact") if row["kind"] != "partial"]


def middles(count: int) -> np.ndarray:
    """Return the middles of elements of unit size, symmetric about 0."""
    return np.arange(count) - 0.5 * (count - 1)


def problem_of(case: dict, n: int, order: int = 1) -> Problem:
    """Return the contact of a case on n x n elements across its ellipse, by default CONTACT's."""
    dx, dy = 2.0 * case["a_m"] / n, 2.0 * case["b_m"] / n
    x, y = middles(n + 2 * SPARE) * dx, middles(n + 2 * SPARE) * dy
    slip = np.empty((2, len(y), len(x)))
    slip[0] = case["xi"] - case["phi_per_m"] * y[:, None]
    slip[1] = case["eta"] + case["phi_per_m"] * x
    return Problem(
        dx=dx,
        dy=dy,
        shear_modulus=SHEAR,
        poisson_ratio=STEEL.poisson_ratio,
        gap=case["A_per_m"] * x**2 + case["B_per_m"] * y[:, None] ** 2,
        force=case["N_N"],
        compliance=np.zeros(len(y)),
        friction=np.full(slip.shape[1:], case["mu"]),
        rigid_slip=slip,
        spin=case["phi_per_m"],
        x=x,
        y=y,
        order=order,
    )


def normal_of(problem: Problem, case: dict, tolerance: float = 1e-7):
    """Return the normal solution of a case, started from the pressure of Hertz."""
    square = (problem.x / case["a_m"]) ** 2 + (problem.y[:, None] / case["b_m"]) ** 2
    start = np.sqrt(np.maximum(1.0 - square, 0.0))
    return solve_normal(problem.elements, problem.gap, problem.force, start, tolerance)


def solved(case: dict, n: int, tolerance: float = 1e-6, order: int = 1) -> Solution:
    """Return the solution of a case on n x n elements."""
    problem = problem_of(case, n, order)
    return solve(problem, normal_of(problem, case), tolerance)
