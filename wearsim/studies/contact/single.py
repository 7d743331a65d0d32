"""Study of one contact: the first roller of a scenario on its cylinder."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

from wearsim.errors import WearsimError
from wearsim.evolution.state import unworn_contacts
from wearsim.plugins import ContactModel
from wearsim.scenario import Scenario, as_scenario, described_model
from wearsim.studies.run.assemble import build_problem, prepared_model
from wearsim.studies.run.grid import contact_grid
from wearsim.studies.run.inputs import load_range
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    OperatingPoint,
    Profile,
)

_FEWEST = 5  # minimum number of strips for an error estimate


@dataclass(frozen=True)
class ContactStudy:
    """A solved contact and its problem.

    Parameters
    ----------
    solution : ContactSolution
    fields : ContactFields, optional
        Tractions and slip inside the contact, if requested.
    gap : ndarray, shape (strips,)
        Gap of the undeformed bodies [m].
    grid : Grid
    point : OperatingPoint
    model : str
        Name of the contact model.
    described_model : str
        Name and options of the contact model.
    grid_error : float, optional
        Relative change of the power with half as many strips, an upper estimate of the error. None
        where it was not requested, or the coarse grid has no solution.
    seconds : float, optional
        Time of a solution without compilation [s]; None where it was not requested.
    notes : tuple of str
        Notes for the user.
    """

    solution: ContactSolution
    fields: ContactFields | None
    gap: FloatArray
    grid: Grid
    point: OperatingPoint
    model: str
    described_model: str
    grid_error: float | None
    seconds: float | None
    notes: tuple[str, ...]


def study_contact(
    scenario: Scenario | str | Path,
    profile: Profile | None = None,
    with_fields: bool = False,
    with_error: bool = False,
) -> ContactStudy:
    """Solve the contact of the scenario's first roller at the start of its load.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario of a run or of a single contact, or its file.
    profile : Profile, optional
        The cylinder's profile, instead of the scenario's.
    with_fields : bool
        Also return tractions and slip inside the contact.
    with_error : bool
        Also time a second solution, and solve with half as many strips.

    Returns
    -------
    ContactStudy

    Raises
    ------
    ContactError
        If the contact has no solution.
    CapabilityError
        If the model does not support the scenario.
    """
    scenario = as_scenario(scenario)
    if profile is not None:
        scenario = replace(scenario, cylinder=replace(scenario.cylinder, profile=profile))
    force = load_range(scenario, scenario.load.build(), 0.0)[0]
    grid = contact_grid(scenario, force)
    model, gap, curvature, point = _contact(scenario, grid)
    solution = model.solve_one(gap, curvature, point)
    fields = model.fields(solution, gap, curvature, point) if with_fields else None
    error, seconds = None, None
    if with_error:
        error = _grid_error(scenario, grid, solution.power)
        start = perf_counter()
        model.solve_one(gap, curvature, point)
        seconds = perf_counter() - start
    return ContactStudy(
        solution,
        fields,
        gap,
        grid,
        point,
        scenario.contact.model,
        described_model(scenario.contact.model, scenario.text),
        error,
        seconds,
        scenario.notes,
    )


def _contact(
    scenario: Scenario, grid: Grid
) -> tuple[ContactModel, FloatArray, float, OperatingPoint]:
    """Return the model for strips, gap [m], curvature along rolling [1/m] and the point."""
    model = prepared_model(scenario, grid)
    batch = unworn_contacts(build_problem(scenario, model, grid, {}))
    return model, batch.gap[0], float(batch.longitudinal_curvature[0]), batch.point(0)


def _grid_error(scenario: Scenario, grid: Grid, power: float) -> float | None:
    """Return the relative change of the power with half as many strips."""
    if grid.strips < 2 * _FEWEST or power == 0.0:
        return None
    try:
        coarse = Grid.spanning(*grid.edges, (grid.strips + 1) // 2)
        model, gap, curvature, point = _contact(scenario, coarse)
        solution = model.solve_one(gap, curvature, point)
    except WearsimError:
        return None
    return abs(solution.power / power - 1.0)


def solve_contact(
    scenario: Scenario | str | Path, profile: Profile | None = None
) -> ContactSolution:
    """Solve the contact of the scenario's first roller; see `study_contact`."""
    return study_contact(scenario, profile).solution
