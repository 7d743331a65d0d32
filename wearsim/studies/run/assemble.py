"""Construction of a wear problem and its stepper from a scenario and drawn values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np

from wearsim.errors import CapabilityError, Mistake, ScenarioError, mistake_in
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import half_quadrature, volume_of
from wearsim.evolution.fatigue import Fatigue
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import ContactInputs, Kinematics
from wearsim.evolution.steppers.base import Stepper
from wearsim.evolution.steppers.forward_euler import ExplicitStepper
from wearsim.evolution.steppers.implicit import ImplicitStepper
from wearsim.evolution.steppers.per_pass import PerPassStepper
from wearsim.evolution.steppers.single_step import explicit_step
from wearsim.evolution.steppers.stabilised import StabilisedStepper
from wearsim.evolution.strip_errors import LOOSER, LOOSEST
from wearsim.evolution.strips import Surfaces
from wearsim.plugins import ContactModel
from wearsim.scenario import FatigueChoice, Scenario
from wearsim.studies.cam.stations import cam_stations
from wearsim.studies.run.grid import check_number_of_strips, growth_of, strips_of_run
from wearsim.studies.run.nodes import MAX_NODES, PassQuadrature, minimum_nodes, redrawing
from wearsim.studies.run.setup import CylinderTurn, Setup
from wearsim.studies.start.heights import roller_profile
from wearsim.types import FloatArray, Grid
from wearsim.units import in_engineers_unit

ITERATION_FRACTION = 1e-3  # convergence criterion of a step's iterations, over the tolerance
ITERATION_RANGE = 1e-8, 1e-5

#: Returns the contact model of a scenario for strips.
ModelBuilder: TypeAlias = Callable[[Scenario, Grid], ContactModel]

UNLOADED = 6.0  # depth at a constant load over N/k, with 5e-5 of the load left
ONE_PARABOLA = {"hertz", "hertz-fastsim"}  # models that fit a single one to the gap
PARABOLA = {"hertz", "hertz-fastsim", "semi-hertzian"}  # models that fit one to the gap


def chosen_stepper(scenario: Scenario, model: ContactModel, contacts: int) -> str:
    """Return the name of a scenario's stepper; "auto" depends on the contact model.

    Raises
    ------
    CapabilityError
        If the scenario requires implicit steps and the model does not support them.
    """
    compliant = model.capabilities.wear_compliance
    able = compliant and (contacts == 1 or model.capabilities.coupled)
    name = scenario.evolution.stepper
    if name == "auto":
        return "implicit" if able else "stabilised"
    if name == "implicit" and not able:
        several = " of several contacts that wear one body" if compliant else ""
        raise CapabilityError(
            f"{scenario.file}: contact model '{scenario.contact.model}' takes no wear compliance"
            f"{several}; set evolution.stepper = 'stabilised' or 'per-pass', or choose another"
            " contact.model"
        )
    return name


def _check_spring(setup: Setup) -> None:
    """Refuse a spring that unloads the roller with a model that fits one parabola to the gap.

    The fit jumps where a strip leaves the patch. A stiff spring turns that into a jump of the load,
    which steps of tens of passes resolve.

    Raises
    ------
    ScenarioError
        If the groove at a constant load would be many times as deep as the spring's travel N/k,
        after which the load has vanished: by then the load falls as exp(-(2/3) (d k/N)^(3/2)).
    """
    scenario = setup.scenario
    model, stiffness = scenario.contact.model, getattr(scenario.load.options, "stiffness", 0.0)
    load = getattr(scenario.load.options, "normal_force", 0.0)
    if model not in ONE_PARABOLA or not stiffness * load or scenario.creepage.drive == "free":
        return
    half = setup.half_width(load, full_slip=False)
    if half**2 / (2.0 * scenario.axial_gap.radius_at(half)) * stiffness / load > UNLOADED:
        raise mistake_in(
            scenario.file,
            f"unloads the roller, whose load cannot be followed by contact.model = '{model}'",
            in_engineers_unit(stiffness, "N/m"),
            "contact.model = 'slender', a softer spring or a shorter test",
            table="load",
            key="stiffness",
        )


def build_stepper(scenario: Scenario, name: str) -> Stepper:
    """Return the stepper called `name` with the scenario's tolerance and step."""
    evolution = scenario.evolution
    unused = {
        "step": name == "per-pass" and evolution.step is not None,
        "allow_unstable": name != "explicit" and evolution.allow_unstable,
    }
    mistakes = [
        Mistake("evolution", key, f'has no meaning with stepper = "{name}"')
        for key, is_set in unused.items()
        if is_set
    ]
    if mistakes:
        raise ScenarioError(scenario.file, mistakes)
    forced = float(evolution.step) if evolution.step is not None else None
    if name == "implicit":
        return ImplicitStepper(evolution.tolerance, forced, _by_doubling(scenario))
    if name == "stabilised":
        return StabilisedStepper(evolution.tolerance, forced)
    if name == "explicit":
        return ExplicitStepper(evolution.tolerance, forced, evolution.allow_unstable)
    return PerPassStepper()


def coarse_stepper(setup: Setup, problem: WearProblem) -> Stepper | None:
    """Return the stepper of the test on coarse strips, None where its error is not estimated.

    The test of single passes has inputs drawn at every pass, and no other test has the same.
    """
    evolution = setup.scenario.evolution
    if not evolution.strip_error or (setup.passes and evolution.stepper == "per-pass"):
        return None
    free = replace(setup.scenario, evolution=evolution.model_copy(update={"stepper": "auto"}))
    tolerance = min(LOOSER * evolution.tolerance, LOOSEST)
    if chosen_stepper(free, problem.model, problem.contacts_each) == "implicit":
        by_doubling = _by_doubling(setup.scenario)
        if by_doubling is None and problem.constant_load is not None:
            # single steps need a third of the contacts, and an error of a tenth is sufficient; at
            # jumps of a logged load, however, their error may not fall with their length
            by_doubling = False
        return ImplicitStepper(tolerance, by_doubling=by_doubling)
    return StabilisedStepper(tolerance)


def _by_doubling(scenario: Scenario) -> bool | None:
    """Return whether step doubling estimates the errors of implicit steps, as `ImplicitStepper`.

    FASTSIM slips in whole elements: in partial slip the power of a strip changes by jumps, and the
    errors of many steps add up unseen by differences.
    """
    return getattr(scenario.contact.options, "tangential", None) == "fastsim" or None


def merged_rollers(setup: Setup) -> tuple[list[int], FloatArray]:
    """Return the first roller of each group of identical ones, and the sizes of the groups."""
    count, rows = setup.scenario.operation.rollers, setup.kinds
    if setup.rollers or any(len(item.rollers) < count for item in setup.varying):
        return list(range(count)), np.ones(count)
    kinds = list(dict.fromkeys(rows))
    return [rows.index(kind) for kind in kinds], np.array([float(rows.count(k)) for k in kinds])


def assemble_problem(
    setup: Setup, grid: Grid | None = None, models: ModelBuilder | None = None
) -> tuple[WearProblem, Stepper, str]:
    """Return the problem of a run, its stepper and the stepper's name.

    Parameters
    ----------
    setup : Setup
        The scenario, with the values of its random inputs.
    grid : Grid, optional
        Strips of an earlier part of the run, or those that realisations share, instead of the
        scenario's choice.
    models : callable, optional
        Returns the contact model of a scenario for strips, by default `prepared_model`.

    Raises
    ------
    ScenarioError
        If a setting has no meaning for the run, or the contact does not fit on the strips.
    CapabilityError
        If the contact model does not support the scenario.
    """
    scenario = setup.scenario
    grid = grid if grid is not None else strips_of_run(setup)
    build = models or prepared_model
    first, multiplicity = merged_rollers(setup)
    drawn = {name: values[first][:, None] for name, values in setup.rollers.items()}
    offsets = setup.inputs_of(first, drawn)["offset"]
    growth = growth_of(
        setup, grid, partial(build, scenario), partial(surfaces, scenario, first, offsets)
    )
    chosen = build(scenario, grid)
    several = len(first) > 1 or setup.passes or scenario.cam
    name = chosen_stepper(scenario, chosen, 2 if several else 1)
    _check_spring(setup)
    if name == "per-pass" and getattr(scenario.load.options, "feedback", "") == "inertia":
        raise mistake_in(
            scenario.file,
            'follows single turns, without feedback = "inertia"',
            "per-pass",
            'feedback = "static", or another stepper',
            table="evolution",
            key="stepper",
        )
    place = {number: k for k, number in enumerate(first)}
    problem = replace(
        build_problem(
            setup,
            chosen,
            grid,
            drawn,
            rollers=first,
            multiplicity=multiplicity,
        ),
        laws=(scenario.wear.built,) if scenario.wear is not None else (),
        fatigue=_fatigue(scenario, scenario.fatigue) if scenario.fatigue else None,
        varying=tuple(
            replace(item, rollers=tuple(place[r] for r in item.rollers if r in place))
            for item in setup.varying
        ),
        growth=growth,
    )
    stepper = build_stepper(scenario, name)
    if scenario.evolution.nodes is not None and (stepper.pass_by_pass or not setup.passes):
        raise mistake_in(
            scenario.file,
            "has no meaning without an expectation over passes",
            table="evolution",
            key="nodes",
        )
    if setup.passes and stepper.pass_by_pass and scenario.fatigue is not None:
        raise mistake_in(
            scenario.file,
            "cannot follow damage by inputs drawn at every pass, which no contact represents",
            "per-pass",
            "another stepper",
            table="evolution",
            key="stepper",
        )
    if setup.passes and stepper.pass_by_pass:
        nodes = PassQuadrature(problem, setup).with_nodes(minimum_nodes(setup.passes))
        stepper = PerPassStepper(redrawing(scenario, setup.passes), nodes)
    elif setup.passes:
        problem = with_converged_nodes(problem, setup)
    return problem, stepper, name


def _fatigue(scenario: Scenario, choice: FatigueChoice) -> Fatigue:
    """Return the fatigue of the bodies of a scenario."""
    return Fatigue(
        {body: law.build(scenario.pair.contact_modulus) for body, law in choice.laws.items()},
        choice.slope,
        choice.probability,
        choice.reference_area,
        choice.remove,
    )


def prepared_model(scenario: Scenario, grid: Grid) -> ContactModel:
    """Return the scenario's contact model for the strips.

    Raises
    ------
    CapabilityError
        If the model does not support the scenario's creepage or its creep factor.
    ScenarioError
        If there are too many strips.
    """
    check_number_of_strips(scenario, grid)
    creepage, factor = scenario.creepage, scenario.friction.creep_factor
    model = scenario.contact.build(grid, scenario.materials)
    needs = {
        "creep_factor": (f"friction.creep_factor = {factor:g}", factor != 1.0),
        "bearing_torque": ("creepage.drive = 'free'", creepage.drive == "free"),
        "creepage_variation": ("creepage.differential_slip = true", creepage.differential_slip),
    }
    form, parabola = scenario.roller.axial_profile.form, scenario.contact.model in PARABOLA
    refusals = {
        "approximates the gap by a parabola, and axial_profile makes it another"
        f" (form = '{form}' of the roller); use contact.model = 'slender'": (
            parabola and not scenario.axial_gap.is_crowned
        ),
        "approximates the gap by a parabola, which does not end with roller.width; use"
        " contact.model = 'slender'": parabola and scenario.roller.width is not None,
        **{
            f"does not support {setting}; choose another contact.model": (
                needed and not getattr(model.capabilities, capability)
            )
            for capability, (setting, needed) in needs.items()
        },
    }
    if text := next((text for text, applies in refusals.items() if applies), ""):
        raise CapabilityError(f"{scenario.file}: contact model '{scenario.contact.model}' {text}")
    return model if factor == 1.0 else model.with_creep_factor(factor)


def with_converged_nodes(problem: WearProblem, setup: Setup) -> WearProblem:
    """Return the problem with quadrature nodes for the inputs that are drawn at every pass.

    Unless the scenario gives their number, they are doubled until the initial wear has converged to
    half the tolerance, as has the known part of its error, or `MAX_NODES` are reached.
    """
    evolution = setup.scenario.evolution
    count, single_pass = evolution.nodes or minimum_nodes(setup.passes), np.ones(1)
    quadrature = PassQuadrature(problem, setup)
    while True:
        refined = quadrature.with_nodes(count)
        if evolution.nodes or 2 * count > MAX_NODES:
            return refined
        fresh = fresh_state(refined)
        full = volume_of(problem, explicit_step(refined, fresh, single_pass).depths)
        half = volume_of(
            problem, explicit_step(*half_quadrature(refined, fresh), single_pass).depths
        )
        error = np.maximum(np.abs(full - half), refined.quadrature_error * full)
        if (error <= 0.5 * evolution.tolerance * full).all():
            return refined
        count *= 2


def build_problem(
    setup: Setup,
    model: ContactModel,
    grid: Grid,
    drawn: Mapping[str, FloatArray],
    *,
    rollers: Sequence[int] = (0,),
    multiplicity: FloatArray | None = None,
    realisations: int = 1,
    angles: FloatArray | None = None,
) -> WearProblem:
    """Return the problem of some rollers without wear, for any number of realisations.

    Parameters
    ----------
    setup : Setup
    model : ContactModel
        Built for the grid.
    grid : Grid
    drawn : mapping of str to ndarray
        Drawn inputs by the names of `contact_values`; they broadcast to (rollers, realisations).
        Inputs that are not drawn have the value of the scenario.
    rollers : sequence of int, optional
        Numbers of the rollers, by default the first one.
    multiplicity : ndarray, shape (rollers,), optional
        Number of physical rollers that each represents, by default one.
    realisations : int
        Number of realisations.
    angles : ndarray, shape (stations,), optional
        Angles of a cam, instead of the stations of a run [rad].
    """
    scenario, creepage, turn = setup.scenario, setup.scenario.creepage, setup.turn
    count, inputs = len(rollers), setup.inputs_of(rollers, drawn)
    kinematics = Kinematics(
        cylinder_radius=scenario.cylinder.radius,
        roller_radius=scenario.roller.radius,
        rolling_speed=scenario.rolling_speed,
        multiplicity=np.ones(count) if multiplicity is None else multiplicity,
        track=turn.track if isinstance(turn, CylinderTurn) else cam_stations(turn, angles),
    )
    at = kinematics.track.angles
    unworn = surfaces(scenario, rollers, inputs.pop("offset"), grid, at)
    columns = {n: np.array(np.broadcast_to(a, (count, realisations))) for n, a in inputs.items()}
    return WearProblem(
        grid=grid,
        model=model,
        laws=(),
        loads=(scenario.load.built,),
        terms={term.name: term.built for term in scenario.load.terms},
        kinematics=kinematics,
        flat_gap=np.broadcast_to(
            unworn.gap, (1 if at is None else len(at), count, realisations, grid.strips)
        ),
        from_apex=unworn.from_apex,
        roller_drop=unworn.roller_drop,
        crowned=scenario.axial_gap.is_crowned,
        inputs=ContactInputs(**columns),
        roller=np.arange(count, dtype=np.int64),
        weight=np.ones(count),
        tilt_shifts=creepage.tilt_shifts_contact,
        free=creepage.drive == "free",
        slip_profile=unworn.slip_profile,
        iteration_tolerance=float(
            np.clip(ITERATION_FRACTION * scenario.evolution.tolerance, *ITERATION_RANGE)
        ),
    )


def surfaces(
    scenario: Scenario,
    rollers: Sequence[int],
    offset: FloatArray,
    grid: Grid,
    angles: FloatArray | None = None,
) -> Surfaces:
    """Return the surfaces of the unworn bodies on strips.

    Parameters
    ----------
    scenario : Scenario
    rollers : sequence of int
        Numbers of the rollers.
    offset : ndarray, shape (rollers, realisations or 1)
        Axial positions of the rollers [m].
    grid : Grid
    angles : ndarray, shape (stations,), optional
        Angles of the stations of a cam [rad].
    """
    roller, cylinder, form = scenario.roller, scenario.cylinder, scenario.axial_gap
    s = grid.y - offset[..., None]
    height = start_height(scenario, grid, angles) - form.cylinder_drop(grid.y)
    drop = form.roller_drop(s)
    if roller.profiles:
        drop = drop - roller_height(scenario, rollers, s)
    # leading axes: stations, rollers, realisations
    height = height if height.ndim == 1 else height[:, None, None]
    gap = drop - height
    gap = gap if gap.ndim == 4 else gap[None]
    if roller.width is not None:
        gap = gap + roller.edge_drop(s)
    rolling = drop if scenario.creepage.drive == "free" else None
    if not scenario.creepage.differential_slip:
        return Surfaces(gap, s, rolling, None)
    slip = drop / roller.radius + height / cylinder.radius
    return Surfaces(gap, s, rolling, slip if slip.ndim == 4 else slip[None])


def start_height(scenario: Scenario, grid: Grid, angles: FloatArray | None = None) -> FloatArray:
    """Return the height of the cylinder or the cam above nominal before wear.

    Parameters
    ----------
    scenario : Scenario
    grid : Grid
    angles : ndarray, shape (stations,), optional
        Angles of a cam [rad].

    Returns
    -------
    ndarray, shape (strips,), or (stations, strips) with angles
        [m].
    """
    profile, surface = scenario.cylinder.profile, scenario.cylinder.start_surface
    if surface is not None and angles is not None:
        return surface.at(angles, grid.y)
    height = (
        np.zeros_like(grid.y) if profile is None else np.interp(grid.y, profile.y, profile.height)
    )
    return height if angles is None else np.broadcast_to(height, (len(angles), len(height)))


def roller_height(scenario: Scenario, rollers: Sequence[int], s: FloatArray) -> FloatArray:
    """Return the height of rollers with start profiles above nominal before wear [m].

    Parameters
    ----------
    scenario : Scenario
    rollers : sequence of int
        Numbers of the rollers.
    s : ndarray, shape (rollers, realisations, strips)
        Axial distance from the apex [m].
    """
    height = np.empty_like(s)
    for place, number in enumerate(rollers):
        profile = roller_profile(scenario, number)
        assert profile is not None
        height[place] = np.interp(s[place], profile.y, profile.height)
    return height
