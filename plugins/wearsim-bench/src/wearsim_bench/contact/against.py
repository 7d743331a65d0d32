"""Benchmark contacts with the solution of a reference model as the exact one."""

from __future__ import annotations

from dataclasses import replace

from wearsim.studies.contact.comparison import solve_reference
from wearsim_bench.contact.cases import MATERIALS, Case, Exact, contact_width
from wearsim_bench.contact.methods import DEFAULT_MODEL, Method


def solved_by(case: Case, reference: str) -> tuple[Case, float]:
    """Return a case with the solution of a reference on the default strips, and its own error.

    Parameters
    ----------
    case : Case
    reference : str
        Registered name of the reference model.

    Returns
    -------
    case : Case
    error : float
        Estimated error of the reference's P_l(y), L2 over the strips.

    Raises
    ------
    ContactError
        If the reference does not solve the contact.
    """
    grid = case.grid(Method(DEFAULT_MODEL).choice())
    solution = solve_reference(
        *(reference, grid, MATERIALS, case.gap_at(grid.y)), case.longitudinal_curvature, case.point
    )
    width = contact_width(solution.line_load, grid.spacing)
    exact = Exact(solution.power, grid.y, solution.dissipation, width, solution.peak_pressure)
    return replace(case, exact=exact), solution.own.dissipation
