"""Turns a scenario into a scene that can be stepped."""

from __future__ import annotations

import numpy as np

from wearsim.errors import CapabilityError, Problem, ScenarioError
from wearsim.evolution.control import StepControl
from wearsim.evolution.explicit import ExplicitStepper
from wearsim.evolution.implicit import ImplicitStepper
from wearsim.evolution.per_pass import PerPassStepper
from wearsim.evolution.scene import Kinematics, Scene
from wearsim.evolution.stepper import Stepper
from wearsim.plugins import ContactModel, Load
from wearsim.scenario import Scenario, require_run
from wearsim.studies.tracks import run_grid
from wearsim.types import Creepage, FloatArray, Grid, Profile


def merged_rollers(scenario: Scenario) -> tuple[list[int], FloatArray]:
    """Return the first of each kind of roller, and how many are alike."""
    creepage = scenario.creepage
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


def start_height(scenario: Scenario, grid: Grid) -> FloatArray:
    """Return the cylinder's height above nominal before the run, shape (strips,) [m]."""
    profile = scenario.cylinder.profile
    if profile is None:
        return np.zeros_like(grid.y)
    return np.interp(grid.y, profile.y, profile.height)


def nominal_gap(scenario: Scenario, grid: Grid, roller: int, profile: Profile | None) -> FloatArray:
    """Return the gap of one roller before wear, shape (strips,) [m].

    A tilted roller keeps its crown and turns about its apex: tilt adds a linear term, which moves
    the contact by R_crown times tilt.
    """
    s = grid.y - scenario.per_roller(scenario.roller.offset)[roller]
    gap = s * s / (2.0 * scenario.roller.crown_radius)
    if scenario.creepage.tilt_shifts_contact:
        gap = gap + scenario.per_roller(scenario.creepage.tilt)[roller] * s
    if profile is not None:
        gap = gap - np.interp(grid.y, profile.y, profile.height)
    return gap


def creepage_of(scenario: Scenario, roller: int) -> Creepage:
    """Return the creepage of one roller: yaw gives the lateral part, tilt the spin."""
    tilt = scenario.per_roller(scenario.creepage.tilt)[roller]
    return Creepage(
        longitudinal=scenario.creepage.longitudinal or 0.0,
        lateral=scenario.per_roller(scenario.creepage.yaw)[roller],
        spin=tilt / scenario.roller.radius,
    )


def rolling_radius(scenario: Scenario, grid: Grid, roller: int) -> FloatArray:
    """Return the unworn roller's radius at every strip, shape (strips,) [m]."""
    s = grid.y - scenario.per_roller(scenario.roller.offset)[roller]
    return scenario.roller.radius - s * s / (2.0 * scenario.roller.crown_radius)


def slip_profile(
    scenario: Scenario, grid: Grid, roller: int, profile: Profile | None
) -> FloatArray:
    """Return the differential slip before wear, shape (strips,).

    s^2/(2 R_crown R_roller), s from the roller's apex, and the start profile's height over
    R_cylinder. The tilt counts once: as the shift of the
    contact away from the apex, or, where it shifts nothing, as the spin's -phi y.
    """
    s = grid.y - scenario.per_roller(scenario.roller.offset)[roller]
    slip = s * s / (2.0 * scenario.roller.crown_radius * scenario.roller.radius)
    if not scenario.creepage.tilt_shifts_contact:
        slip = slip - creepage_of(scenario, roller).spin * s
    if profile is not None:
        slip = slip + np.interp(grid.y, profile.y, profile.height) / scenario.cylinder.radius
    return slip


def check_model(scenario: Scenario, model: ContactModel) -> None:
    """Raise CapabilityError if the contact model cannot take what the scenario asks of it."""
    needs = {
        "bearing_torque": ("creepage.drive = 'free'", scenario.creepage.drive == "free"),
        "creepage_variation": (
            "creepage.differential_slip = true",
            scenario.creepage.differential_slip,
        ),
    }
    for capability, (asked, needed) in needs.items():
        if needed and not getattr(model.capabilities, capability):
            raise CapabilityError(
                f"{scenario.file}: contact model '{scenario.contact.model}' cannot take {asked};"
                " choose another contact.model"
            )


def chosen_stepper(scenario: Scenario, model: ContactModel, contacts: int) -> str:
    """Return the stepper a scenario asks for, or for "auto" the one that fits the contact model.

    Raises
    ------
    CapabilityError
        If implicit steps are asked of a model that cannot take them.
    """
    able = model.capabilities.wear_compliance and (contacts == 1 or model.capabilities.coupled)
    asked = scenario.evolution.stepper
    if asked == "auto":
        return "implicit" if able else "explicit"
    if asked == "implicit" and not able:
        raise CapabilityError(
            f"{scenario.file}: contact model '{scenario.contact.model}' takes no wear compliance"
            + (" of several rollers that differ" if model.capabilities.wear_compliance else "")
            + "; set evolution.stepper = 'explicit' or 'per-pass', or choose another contact.model"
        )
    return asked


def build_stepper(scenario: Scenario, name: str) -> Stepper:
    """Return the stepper called `name` with the scenario's tolerance and step."""
    evolution = scenario.evolution
    idle = {
        "step": name == "per-pass" and evolution.step is not None,
        "allow_unstable": name != "explicit" and evolution.allow_unstable,
    }
    problems = [
        Problem("evolution", key, f'has no meaning with stepper = "{name}"')
        for key, told in idle.items()
        if told
    ]
    if problems:
        raise ScenarioError(scenario.file, problems)
    control = StepControl(evolution.tolerance)
    forced = float(evolution.step) if evolution.step is not None else None
    if name == "implicit":
        return ImplicitStepper(control, forced)
    if name == "explicit":
        return ExplicitStepper(control, forced, evolution.allow_unstable)
    return PerPassStepper()


def load_range(scenario: Scenario, load: Load, stop: float) -> tuple[float, float]:
    """Return the least and greatest load up to `stop` [s], before any feedback [N].

    Raises
    ------
    ScenarioError
        If the load is not known for the whole time, or falls to nothing.
    """
    if load.span is not None and (load.span[0] > 0.0 or load.span[1] < stop * (1.0 - 1e-9)):
        problem = Problem(
            "load",
            scenario.load.kind,
            "the log does not cover the test",
            f"{load.span[0] / 60.0:.6g} to {load.span[1] / 60.0:.6g} min",
            f"0 to {stop / 60.0:.6g} min; log longer or shorten operation.duration",
        )
        raise ScenarioError(scenario.file, [problem])
    low, high = load.extremes(0.0, stop)
    if low <= 0.0 and not scenario.load.terms:
        problem = Problem(
            "load",
            scenario.load.kind,
            "the load falls to nothing, and contact with it",
            f"{low:.6g} N",
            "a load above zero at all times",
        )
        raise ScenarioError(scenario.file, [problem])
    return low, high


def build_scene(scenario: Scenario, grid: Grid | None = None) -> tuple[Scene, Stepper, str]:
    """Return the scene of a run, its stepper and the stepper's name.

    Parameters
    ----------
    scenario : Scenario
    grid : Grid, optional
        Strips of an earlier part of the run, in place of the scenario's choice.

    Raises
    ------
    ScenarioError
        If the scenario lacks what a run needs.
    CapabilityError
        If the contact model cannot do what is asked.
    """
    require_run(scenario)
    if scenario.wear is None:
        raise ValueError("require_run lets no scenario without wear pass")
    load, model = scenario.load.build(), scenario.contact.build()
    check_model(scenario, model)
    first, multiplicity = merged_rollers(scenario)
    name = chosen_stepper(scenario, model, len(first))
    greatest = load_range(scenario, load, scenario.total_time)[1]
    grid = grid if grid is not None else run_grid(scenario, greatest)
    model.prepare(grid, (scenario.cylinder.material, scenario.roller.material))
    gaps = [nominal_gap(scenario, grid, r, scenario.cylinder.profile) for r in first]
    creepage, free = scenario.creepage, scenario.creepage.drive == "free"
    slips = [slip_profile(scenario, grid, r, scenario.cylinder.profile) for r in first]
    radii = [rolling_radius(scenario, grid, r) for r in first]
    scene = Scene(
        grid=grid,
        model=model,
        law=scenario.wear.build(),
        load=load,
        terms={term.name: term.build() for term in scenario.load.terms},
        kinematics=kinematics(scenario, multiplicity),
        nominal_gap=np.array(gaps)[None, :, None, :],
        creepages=tuple(creepage_of(scenario, r) for r in first),
        friction=scenario.friction.coefficient,
        bearing_torque=creepage.bearing_torque if free else None,
        rolling_radius=np.array(radii) if free else None,
        slip_profile=np.array(slips) if creepage.differential_slip else None,
    )
    return scene, build_stepper(scenario, name), name
