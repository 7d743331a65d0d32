"""Study of one contact: the first roller of a scenario on its cylinder."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

from wearsim.errors import ContactError, WearsimError
from wearsim.evolution.contacts import unworn_contacts
from wearsim.plugins import ContactModel
from wearsim.profiles import load_profile
from wearsim.results.viewed import Viewed
from wearsim.scenario import Scenario, as_scenario, described_model
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.contact.comparison import (
    ContactErrors,
    ContactReference,
    at_creepage,
    reference_spec,
    solve_reference,
)
from wearsim.studies.failures import explained
from wearsim.studies.plausibility import plausibility_warnings
from wearsim.studies.run.assemble import build_problem, prepared_model
from wearsim.studies.run.grid import contact_grid, wider_grid
from wearsim.studies.run.setup import Setup
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    OperatingPoint,
    Profile,
)

GRID_DEPENDENT = 0.1  # relative change of the peak pressure with half as many strips

_BEYOND = 0.15  # strips beyond either end of a model's strips that end with its contact
_FEWEST = 5  # minimum number of strips for an error estimate


@dataclass(frozen=True, eq=False)
class ContactStudy(Viewed):
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
        Relative change of the power with half as many strips, plus that with half as many elements
        along rolling in a reference model: an upper estimate of the error. None where it was not
        requested, or a coarse grid has no solution.
    pressure_error : float, optional
        The same of the peak pressure.
    seconds : float, optional
        Time of a solution without compilation [s]; None where it was not requested.
    notes : tuple of str
        Notes for the user.
    warnings : tuple of str
        Warnings of implausible inputs, and of a peak pressure that depends on the strips.
    widened : bool
        Whether the contact is wider than the profile, and strips were added.
    reference : ContactReference, optional
        The same contact by a reference model, if one was named.
    errors : ContactErrors, optional
        Differences of the solution from the reference.
    title : str
        Title of the scenario.

    Examples
    --------
    >>> study = wearsim.study_contact("rig.toml")
    >>> study.model, study.grid.strips == len(study.solution.y)
    ('slender', True)
    """

    solution: ContactSolution
    fields: ContactFields | None
    gap: FloatArray
    grid: Grid
    point: OperatingPoint
    model: str
    described_model: str
    grid_error: float | None
    pressure_error: float | None
    seconds: float | None
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    widened: bool = False
    reference: ContactReference | None = None
    errors: ContactErrors | None = None
    title: str = ""

    def __repr__(self) -> str:
        return f"<ContactStudy '{self.described_model}': {self.solution!r}>"


def study_contact(
    scenario: Scenario | str | Path,
    profile: Profile | str | Path | None = None,
    with_fields: bool = False,
    with_error: bool = False,
    against: str | None = None,
) -> ContactStudy:
    """Solve the contact of the scenario's first roller at the start of its load.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario of a run or of a single contact, or its file.
    profile : Profile or path, optional
        The cylinder's profile, or its file, instead of the scenario's.
    with_fields : bool
        Also return tractions and slip inside the contact.
    with_error : bool
        Also time a second solution, and solve with half as many strips.
    against : str, optional
        Contact model that also solves this contact on the same strips, as a reference: "halfspace".

    Returns
    -------
    ContactStudy

    Raises
    ------
    PluginError
        If the reference is not installed.
    ContactError
        If the contact has no solution.
    CapabilityError
        If the model does not support the scenario.

    Examples
    --------
    >>> study = wearsim.study_contact("rig.toml", with_fields=True, with_error=True)
    >>> print(f"{study.solution.power:.4f} W within {study.grid_error:.2%}")
    0.0772 W within 0.0...%
    >>> study.fields.pressure.shape[1] == study.grid.strips
    True
    """
    scenario = as_scenario(scenario)
    if against is not None:
        reference_spec(against)
    if isinstance(profile, str | Path):
        profile = load_profile(profile)
    if profile is not None:
        if not isinstance(profile, Profile):
            raise TypeError(
                f"profile must be a Profile or the path of a file, got a {type(profile).__name__}"
            )
        scenario = replace(scenario, cylinder=replace(scenario.cylinder, profile=profile))
    scenario = with_chosen_model(scenario, test=False)
    setup = Setup(scenario)
    force = setup.load_range(0.0)[0]
    grid, notes = contact_grid(setup, force), scenario.notes
    model, gap, curvature, point = _contact(scenario, grid)
    try:
        solution = model.solve_one(gap, curvature, point)
    except ContactError as error:
        wider = wider_grid(setup, grid, force)
        if wider is None:
            raise explained(error, scenario) from error.__cause__
        model, gap, curvature, point = _contact(scenario, wider)
        solution, grid = model.solve_one(gap, curvature, point), wider
        span = f"{1e3 * grid.edges[0]:.4g} to {1e3 * grid.edges[1]:.4g} mm"
        notes = (
            *notes,
            (
                f"the contact is wider than the profile: the strips span {span}, and it is level"
                " beyond the profile"
            ),
        )
    if scenario.cam is not None:
        theta = math.degrees(float(turn_of(scenario).stations.angle[0]))
        notes = (*notes, f"contact of the cam at {theta:.4g} deg; wearsim cam solves all stations")
    fields = model.fields(solution, gap, curvature, point) if with_fields else None
    power_error = pressure_error = seconds = None
    warnings = plausibility_warnings(setup)
    if with_error:
        power_error, pressure_error = _grid_errors(scenario, grid, solution)
        if pressure_error is not None and pressure_error > GRID_DEPENDENT:
            warnings.append(_grid_dependence(scenario, grid, solution, pressure_error))
        start = perf_counter()
        model.solve_one(gap, curvature, point)
        seconds = perf_counter() - start
    reference = None
    if against is not None:
        reference = _reference(scenario, against, grid, solution)
        if point.bearing_torque is not None:
            notes = (*notes, f"'{against}' has the longitudinal creepage of this solution")
    return ContactStudy(
        solution,
        fields,
        gap,
        grid,
        point,
        scenario.contact.model,
        described_model(scenario.contact.model, scenario.text),
        power_error,
        pressure_error,
        seconds,
        notes,
        tuple(warnings),
        any(note.startswith("the contact is wider") for note in notes),
        reference,
        None if reference is None else reference.errors_of(solution),
        scenario.title,
    )


def _contact(
    scenario: Scenario, grid: Grid
) -> tuple[ContactModel, FloatArray, float, OperatingPoint]:
    """Return the model for strips, gap [m], curvature along rolling [1/m] and the point."""
    model = prepared_model(scenario, grid)
    batch = unworn_contacts(build_problem(Setup(scenario), model, grid, {}))
    return model, batch.gap[0], float(batch.longitudinal_curvature[0]), batch.point(0)


def _reference(
    scenario: Scenario, against: str, grid: Grid, solution: ContactSolution
) -> ContactReference:
    """Return the contact by a reference model; strips that it extends beyond are continued."""
    materials, failure = scenario.materials, None
    for beyond in (0, math.ceil(_BEYOND * grid.strips)):
        margin = beyond * grid.spacing
        edges = grid.edges[0] - margin, grid.edges[1] + margin
        wider = Grid.spanning(*edges, grid.strips + 2 * beyond) if beyond else grid
        _, gap, curvature, point = _contact(scenario, wider)
        try:
            return solve_reference(
                against,
                wider,
                materials,
                gap,
                curvature,
                at_creepage(point, solution),
                creep_factor=scenario.friction.creep_factor,
            )
        except ContactError as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _coarser(scenario: Scenario) -> Iterator[tuple[Scenario, int]]:
    """Yield the scenario with half as many strips, and with half as many elements along rolling.

    The latter of reference models only. Each comes with the divisor of the number of strips.
    """
    yield scenario, 2
    choice = scenario.contact
    if choice.spec.reference and (elements := getattr(choice.options, "mx", None)):
        options = choice.options.model_copy(update={"mx": (elements + 1) // 2})
        yield replace(scenario, contact=replace(choice, options=options)), 1


def _grid_errors(
    scenario: Scenario, grid: Grid, solution: ContactSolution
) -> tuple[float | None, float | None]:
    """Return the relative changes of power and peak pressure on coarser grids, added up."""
    if grid.strips < 2 * _FEWEST:
        return None, None
    power = pressure = 0.0
    try:
        for coarser, divisor in _coarser(scenario):
            model, gap, curvature, point = _contact(
                coarser, Grid.spanning(*grid.edges, (grid.strips + divisor - 1) // divisor)
            )
            other = model.solve_one(gap, curvature, point)
            power += abs(other.power / solution.power - 1.0) if solution.power else 0.0
            pressure += abs(other.peak_pressure / solution.peak_pressure - 1.0)
    except WearsimError:
        return None, None
    return power if solution.power else None, pressure


def _grid_dependence(
    scenario: Scenario, grid: Grid, solution: ContactSolution, change: float
) -> str:
    """Return the warning of a peak pressure that depends on the strips."""
    text = (
        f"peak pressure: {solution.peak_pressure / 1e6:.4g} MPa depends on the strips; with half of"
        f" the {grid.strips} strips it changes by {change:.0%}"
    )
    if scenario.cylinder.profile is None:
        return f"{text}; raise contact.strips"
    return (
        f'{text}; filter roughness that the strips do not resolve, profile_filter = "0.8 mm"'
        " (ISO 16610-21), or set contact.strips"
    )


def solve_contact(
    scenario: Scenario | str | Path, profile: Profile | str | Path | None = None
) -> ContactSolution:
    """Solve the contact of the scenario's first roller; errors as of `study_contact`.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario of a run or of a single contact, or its file.
    profile : Profile or path, optional
        The cylinder's profile, or its file, instead of the scenario's.

    Returns
    -------
    ContactSolution

    Examples
    --------
    >>> solution = wearsim.solve_contact("rig.toml")
    >>> print(f"{solution.peak_pressure / 1e6:.0f} MPa")
    680 MPa
    """
    return study_contact(scenario, profile).solution
