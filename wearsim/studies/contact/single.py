"""One contact by itself: the first roller of a scenario on its cylinder, as it stands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from wearsim.errors import WearsimError
from wearsim.evolution.operating_points import operating_point
from wearsim.plugins import ContactModel
from wearsim.scenario import Scenario, described_model
from wearsim.studies.run.assemble import bare_problem, load_range
from wearsim.studies.run.choose_stepper import check_model
from wearsim.studies.run.grid import contact_centres, fresh_patch, profile_grid
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    OperatingPoint,
    Profile,
)

_FEWEST = 5  # strips that tell an error


@dataclass(frozen=True)
class ContactStudy:
    """A solved contact and what was solved.

    Parameters
    ----------
    solution : ContactSolution
    fields : ContactFields, optional
        The inside of the contact, where asked for.
    gap : ndarray, shape (strips,)
        Gap of the undeformed bodies [m].
    grid : Grid
    point : OperatingPoint
    model : str
        Name of the contact model.
    described_model : str
        The same with its options.
    grid_error : float, optional
        What half as many strips change of the power, as a part of it: more than these are off.
        None where that was not asked for, or the model has no answer on those.
    seconds : float, optional
        What the contact took, once compiled [s]; None where that was not asked for.
    notes : tuple of str
        What a user should know.
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


def _grid(scenario: Scenario, model: ContactModel, load: float, profile: Profile | None) -> Grid:
    """Return strips that suit the contact: the model's choice, or the profile's whole width."""
    choice, centre = scenario.contact, contact_centres(scenario)[0]
    if choice.centre is not None:
        centre = choice.centre
    patch = fresh_patch(scenario, load)
    if choice.width is None and profile is not None:
        return profile_grid(profile, patch.b, choice.strips)
    if choice.width is None and choice.strips is None:
        curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
        materials = scenario.cylinder.material, scenario.roller.material
        grid = model.suggest_grid(1.0 / scenario.roller.crown_radius, curvature, load, materials)
        if grid is not None:
            return Grid(grid.y + centre, grid.spacing)
    width = choice.width if choice.width is not None else 2.4 * patch.b
    return Grid.spanning(centre - 0.5 * width, centre + 0.5 * width, choice.strips or 121)


def study_contact(
    scenario: Scenario,
    profile: Profile | None = None,
    with_fields: bool = False,
    with_error: bool = False,
) -> ContactStudy:
    """Solve the contact of the scenario's first roller at the start of its load.

    Parameters
    ----------
    scenario : Scenario
        A run's or a single contact's.
    profile : Profile, optional
        The cylinder's profile, in place of the scenario's.
    with_fields : bool
        Also return tractions and slip inside the contact.
    with_error : bool
        Also solve it again, to time it, and on half as many strips.

    Returns
    -------
    ContactStudy

    Raises
    ------
    ContactError
        If the contact has no solution.
    CapabilityError
        If the model cannot do what is asked.
    """
    model = scenario.contact.build()
    check_model(scenario, model)
    force = load_range(scenario, scenario.load.build(), 0.0)[0]
    profile = profile if profile is not None else scenario.cylinder.profile
    grid = _grid(scenario, model, force, profile)
    gap, curvature, point = _problem(scenario, model, grid, force, profile)
    solution = model.solve(gap, curvature, point)
    fields = model.fields(solution, gap, curvature, point) if with_fields else None
    name = scenario.contact.model
    return ContactStudy(
        solution,
        fields,
        gap,
        grid,
        point,
        name,
        described_model(name, scenario.text),
        _grid_error(scenario, grid, force, profile, solution.power) if with_error else None,
        _seconds(lambda: model.solve(gap, curvature, point)) if with_error else None,
        scenario.notes,
    )


def _problem(
    scenario: Scenario, model: ContactModel, grid: Grid, force: float, profile: Profile | None
) -> tuple[FloatArray, float, OperatingPoint]:
    """Prepare a model for strips; return gap [m], curvature along rolling [1/m] and the point."""
    model.prepare(grid, (scenario.cylinder.material, scenario.roller.material))
    load = scenario.load.build()
    problem = bare_problem(scenario, model, load, grid, [0], np.ones(1), profile)
    unworn = np.zeros(grid.strips)
    point = operating_point(problem, (0, 0), force, unworn, unworn)
    return problem.nominal_gap[0, 0, 0], problem.kinematics.longitudinal_curvature, point


def _grid_error(
    scenario: Scenario, grid: Grid, force: float, profile: Profile | None, power: float
) -> float | None:
    """Return what half as many strips change of the power, as a part of it."""
    ends = grid.y[0] - 0.5 * grid.spacing, grid.y[-1] + 0.5 * grid.spacing
    if grid.strips < 2 * _FEWEST or power == 0.0:
        return None
    coarse, model = Grid.spanning(*ends, (grid.strips + 1) // 2), scenario.contact.build()
    try:
        solution = model.solve(*_problem(scenario, model, coarse, force, profile))
    except WearsimError:
        return None
    return abs(solution.power / power - 1.0)


def _seconds(function: Callable[[], object]) -> float:
    start = perf_counter()
    function()
    return perf_counter() - start


def solve_contact(scenario: Scenario, profile: Profile | None = None) -> ContactSolution:
    """Solve the contact of the scenario's first roller; see `study_contact`."""
    return study_contact(scenario, profile).solution
