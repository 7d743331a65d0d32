"""Turns a scenario into a problem that can be stepped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.errors import Mistake, ScenarioError
from wearsim.evolution.contact_inputs import ContactInputs
from wearsim.evolution.error_control.error_estimates import half_quadrature_start, total_worn_volume
from wearsim.evolution.kinematics import Kinematics, NoWear
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import fresh_state
from wearsim.evolution.steppers.base import Stepper
from wearsim.evolution.steppers.single_step import explicit_step
from wearsim.plugins import ContactModel, Load
from wearsim.scenario import Scenario, require_run
from wearsim.studies.run.choose_stepper import build_stepper, check_model, chosen_stepper
from wearsim.studies.run.draws import Draws, draw
from wearsim.studies.run.grid import Drawn, run_grid
from wearsim.studies.run.pass_quadrature import MOST_NODES, fewest_nodes, redrawing, with_nodes
from wearsim.types import FloatArray, Grid, Profile

SETTLED = 1e-3  # of the tolerance: what the iterations of one step may leave
SETTLED_RANGE = 1e-8, 1e-5


def merged_rollers(draws: Draws) -> tuple[list[int], FloatArray]:
    """Return the first of each kind of roller, and how many are alike."""
    scenario = draws.scenario
    creepage, numbers = scenario.creepage, range(scenario.operation.rollers)
    if draws.tells_rollers_apart:
        return list(numbers), np.ones(len(numbers))
    rows = list(
        zip(
            scenario.per_roller(scenario.roller.offset),
            scenario.per_roller(creepage.yaw),
            scenario.per_roller(creepage.tilt),
            strict=True,
        )
    )
    kinds = list(dict.fromkeys(rows))
    counts = np.array([float(rows.count(kind)) for kind in kinds])
    return [rows.index(kind) for kind in kinds], counts


def kinematics(scenario: Scenario, multiplicity: FloatArray) -> Kinematics:
    """Return how the rollers run on the cylinder."""
    return Kinematics(
        cylinder_radius=scenario.cylinder.radius,
        roller_radius=scenario.roller.radius,
        crown_radius=scenario.roller.crown_radius,
        rolling_speed=scenario.rolling_speed,
        multiplicity=multiplicity,
    )


def start_height(profile: Profile | None, grid: Grid) -> FloatArray:
    """Return a cylinder's height above nominal before wear, shape (strips,) [m]."""
    if profile is None:
        return np.zeros_like(grid.y)
    return np.interp(grid.y, profile.y, profile.height)


def from_apex(scenario: Scenario, grid: Grid, roller: int) -> FloatArray:
    """Return the axial distance from one roller's apex, shape (strips,) [m]."""
    return np.asarray(grid.y - scenario.per_roller(scenario.roller.offset)[roller])


def flat_gap(scenario: Scenario, s: FloatArray, height: FloatArray) -> FloatArray:
    """Return the gap without tilt before wear [m].

    Parameters
    ----------
    scenario : Scenario
    s : ndarray, shape (..., strips)
        Distance from the roller's apex [m].
    height : ndarray, shape (strips,)
        As `start_height` returns it [m].
    """
    return s * s / (2.0 * scenario.roller.crown_radius) - height


def slip_profile(scenario: Scenario, s: FloatArray, height: FloatArray) -> FloatArray:
    """Return the differential slip without tilt before wear.

    s^2/(2 R_crown R_roller), s from the roller's apex, and the start profile's height over
    R_cylinder.

    Parameters
    ----------
    scenario, s, height
        As for `flat_gap`.
    """
    slip = s * s / (2.0 * scenario.roller.crown_radius * scenario.roller.radius)
    return slip + height / scenario.cylinder.radius


def mean_inputs(scenario: Scenario, rollers: list[int]) -> ContactInputs:
    """Return the inputs of some rollers as the scenario gives them."""
    creepage = scenario.creepage
    alike = ContactInputs.uniform(
        len(rollers),
        friction=scenario.friction.coefficient,
        longitudinal=creepage.longitudinal or 0.0,
        bearing_torque=creepage.bearing_torque or 0.0,
    )
    angles = {
        name: np.array(scenario.per_roller(value))[rollers][:, None]
        for name, value in (("yaw", creepage.yaw), ("tilt", creepage.tilt))
    }
    return alike.with_values(angles)


def load_range(scenario: Scenario, load: Load, stop: float) -> tuple[float, float]:
    """Return the least and greatest load up to `stop` [s], before any feedback [N].

    Raises
    ------
    ScenarioError
        If the load is not known for the whole time, or falls to nothing.
    """
    if load.span is not None and (load.span[0] > 0.0 or load.span[1] < stop * (1.0 - 1e-9)):
        problem = Mistake(
            "load",
            scenario.load.kind,
            "the log does not cover the test",
            f"{load.span[0] / 60.0:.6g} to {load.span[1] / 60.0:.6g} min",
            f"0 to {stop / 60.0:.6g} min; log longer or shorten operation.duration",
        )
        raise ScenarioError(scenario.file, [problem])
    low, high = load.extremes(0.0, stop)
    if low <= 0.0 and not scenario.load.terms:
        problem = Mistake(
            "load",
            scenario.load.kind,
            "the load falls to nothing, and contact with it",
            f"{low:.6g} N",
            "a load above zero at all times",
        )
        raise ScenarioError(scenario.file, [problem])
    return low, high


def assemble_problem(
    scenario: Scenario,
    grid: Grid | None = None,
    draws: Draws | None = None,
    model: ContactModel | None = None,
) -> tuple[WearProblem, Stepper, str]:
    """Return the problem of a run, its stepper and the stepper's name.

    Parameters
    ----------
    scenario : Scenario
    grid : Grid, optional
        Strips of an earlier part of the run, in place of the scenario's choice.
    draws : Draws, optional
        Of the scenario's random inputs, where they are drawn already.
    model : ContactModel, optional
        From `prepared_model`, where it is there already; with a grid alone.

    Raises
    ------
    ScenarioError
        If the scenario lacks what a run needs.
    CapabilityError
        If the contact model cannot do what is asked.
    """
    require_run(scenario)
    draws = draws if draws is not None else draw(scenario)
    scenario = draws.scenario
    load, chosen = scenario.load.build(), model or scenario.contact.build()
    check_model(scenario, chosen)
    first, multiplicity = merged_rollers(draws)
    name = chosen_stepper(scenario, chosen, 2 if draws.passes else len(first))
    stepper = build_stepper(scenario, name)
    if scenario.evolution.nodes is not None and (stepper.pass_by_pass or not draws.passes):
        what = "has no meaning where no expectation over passes is taken"
        raise ScenarioError(scenario.file, [Mistake("evolution", "nodes", what)])
    grid = grid if grid is not None else strips_of_run(draws)
    if model is None:
        chosen.prepare(grid, (scenario.cylinder.material, scenario.roller.material))
    problem = bare_problem(
        scenario, chosen, load, grid, first, multiplicity, scenario.cylinder.profile
    )
    problem = with_draws(problem, draws, first)
    if draws.passes and stepper.pass_by_pass:
        nodes = with_nodes(problem, scenario, draws.passes, fewest_nodes(draws.passes))
        problem = replace(problem, redraw=redrawing(scenario, draws.passes), expectation=nodes)
    elif draws.passes:
        problem = with_enough_nodes(problem, draws)
    return problem, stepper, name


def prepared_model(scenario: Scenario, grid: Grid) -> ContactModel:
    """Return the scenario's contact model, prepared for the strips."""
    model = scenario.contact.build()
    model.prepare(grid, (scenario.cylinder.material, scenario.roller.material))
    return model


def strips_of_run(draws: Draws) -> Grid:
    """Return the strips that a run's draws and the end of its test call for."""
    scenario = draws.scenario
    greatest = load_range(scenario, scenario.load.build(), scenario.total_time)[1]
    greatest += draws.range_of("normal_force_offset", 0.0)[1]
    drawn = Drawn(
        yaw=_reach(draws, "yaw"),
        tilt=_reach(draws, "tilt"),
        friction=draws.lasting("friction", scenario.friction.coefficient),
        longitudinal=draws.lasting("longitudinal", scenario.creepage.longitudinal or 0.0),
    )
    return run_grid(scenario, greatest, drawn)


def _reach(draws: Draws, name: str) -> float:
    """Return the greatest size of an angle that is drawn [rad]."""
    return max(abs(angle) for angle in draws.range_of(name, 0.0))


def with_draws(problem: WearProblem, draws: Draws, rollers: list[int]) -> WearProblem:
    """Return the problem with what is drawn for its rollers, and with the paths of processes."""
    values = {name: array[rollers][:, None] for name, array in draws.rollers.items()}
    place = {number: k for k, number in enumerate(rollers)}
    varying = tuple(
        replace(item, rollers=tuple(place[r] for r in item.rollers if r in place))
        for item in draws.varying
    )
    return replace(problem, inputs=problem.inputs.with_values(values), varying=varying)


def with_enough_nodes(problem: WearProblem, draws: Draws) -> WearProblem:
    """Return the problem with nodes for what is drawn at every pass.

    Unless the scenario gives their number they are doubled until the wear of the fresh contacts
    has settled to a part of the tolerance, or there are `MOST_NODES`.
    """
    scenario = draws.scenario
    asked, tolerance = scenario.evolution.nodes, scenario.evolution.tolerance
    count = asked or fewest_nodes(draws.passes)
    while True:
        found = with_nodes(problem, scenario, draws.passes, count)
        if asked or 2 * count > MOST_NODES:
            return found
        fresh = fresh_state(found)
        one, other = (
            total_worn_volume(problem, explicit_step(found, fresh, 1.0)),
            total_worn_volume(
                problem, explicit_step(found.halved, half_quadrature_start(found, fresh), 1.0)
            ),
        )
        if (np.abs(one - other) <= 0.5 * tolerance * one).all():
            return found
        count *= 2


def bare_problem(
    scenario: Scenario,
    model: ContactModel,
    load: Load,
    grid: Grid,
    rollers: list[int],
    multiplicity: FloatArray,
    profile: Profile | None,
) -> WearProblem:
    """Return the problem of some rollers on strips, every input as the scenario gives it.

    Parameters
    ----------
    scenario : Scenario
    model : ContactModel
        Prepared for the grid.
    load : Load
    grid : Grid
    rollers : list of int
        Numbers of the rollers.
    multiplicity : ndarray, shape (rollers,)
        Physical rollers behind each.
    profile : Profile, optional
        The cylinder's profile at the start.
    """
    s = np.array([from_apex(scenario, grid, r) for r in rollers])
    height = start_height(profile, grid)
    creepage, count = scenario.creepage, len(rollers)
    return WearProblem(
        grid=grid,
        model=model,
        law=scenario.wear.build() if scenario.wear is not None else NoWear(),
        load=load,
        terms={term.name: term.build() for term in scenario.load.terms},
        kinematics=kinematics(scenario, multiplicity),
        flat_gap=flat_gap(scenario, s, height)[None, :, None, :],
        from_apex=s,
        inputs=mean_inputs(scenario, rollers),
        roller=np.arange(count, dtype=np.int64),
        weight=np.ones(count),
        half=np.zeros(count, dtype=np.int64),
        tilt_shifts=creepage.tilt_shifts_contact,
        free=creepage.drive == "free",
        slip_profile=slip_profile(scenario, s, height) if creepage.differential_slip else None,
        iteration_tolerance=float(np.clip(SETTLED * scenario.evolution.tolerance, *SETTLED_RANGE)),
    )
