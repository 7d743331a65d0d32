"""The strips a scenario runs on: how wide, how many, centred where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wearsim.errors import Mistake, ScenarioError
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import HertzContact, hertz
from wearsim.plugins import WearLaw
from wearsim.scenario import Scenario
from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE
from wearsim.types import ContactSolution, FloatArray, Grid, Profile

STRIPS_PER_HALF_WIDTH = 12  # of the fresh patch; a run's error in y is then below 1e-3
FEWEST_PER_HALF_WIDTH = 5  # it is below 1e-2 then, and grows as the square of their width
MOST_STRIPS = 801
PROFILE_STRIPS_PER_HALF_WIDTH = 24  # where one contact is solved on a profile's whole width
FEWEST_PROFILE_STRIPS = 161


@dataclass(frozen=True)
class Drawn:
    """What random inputs add to what a scenario gives.

    Parameters
    ----------
    yaw, tilt : float
        Greatest size that the angles of a roller take while it runs [rad].
    friction, longitudinal : float, optional
        Greatest friction coefficient and creepage that a roller has over the whole test.
    """

    yaw: float = 0.0
    tilt: float = 0.0
    friction: float = 0.0
    longitudinal: float = 0.0


NOTHING_DRAWN = Drawn()


def contact_centres(scenario: Scenario) -> tuple[float, ...]:
    """Return where each roller first touches the cylinder [m]."""
    offsets = np.array(scenario.per_roller(scenario.roller.offset))
    tilts = np.array(scenario.per_roller(scenario.creepage.tilt))
    return tuple(touched_at(scenario, offsets, tilts).tolist())


def touched_at(scenario: Scenario, offset: FloatArray, tilt: FloatArray) -> FloatArray:
    """Return where rollers of these offsets [m] and tilts [rad] touch an unworn cylinder [m]."""
    if not scenario.creepage.tilt_shifts_contact:
        return offset
    return np.asarray(offset - scenario.roller.crown_radius * tilt)


def profile_grid(profile: Profile, half_width: float, strips: int | None) -> Grid:
    """Return strips over a profile's whole width.

    Parameters
    ----------
    profile : Profile
    half_width : float
        That of the fresh patch [m].
    strips : int, optional
        How many; by default as many as resolve the patch, at most `MOST_STRIPS`.
    """
    start, stop = float(profile.y[0]), float(profile.y[-1])
    resolving = np.ceil(PROFILE_STRIPS_PER_HALF_WIDTH * (stop - start) / half_width)
    chosen = strips or int(np.clip(resolving, FEWEST_PROFILE_STRIPS, MOST_STRIPS))
    return Grid.spanning(start, stop, chosen)


def fresh_patch(scenario: Scenario, load: float) -> HertzContact:
    """Return the Hertzian patch of the unworn bodies under `load` [N]."""
    modulus = combine(scenario.cylinder.material, scenario.roller.material).contact_modulus
    along = 0.5 * (1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius)
    return hertz(along, 0.5 / scenario.roller.crown_radius, load, modulus)


def foreseen_half_width(scenario: Scenario, load: float, drawn: Drawn) -> float:
    """Return half the width of the groove that full slip would leave at the end [m].

    Rigid bodies in full slip wear d = [(3/4) c N n / sqrt(2 R)]^(2/3) deep and 2 sqrt(2 R d) wide,
    c being depth per pass and load; wear of the roller counts like that of the cylinder. Of a law
    that is not linear c is the greater of those in the fresh contact and in the final groove.
    """
    if scenario.wear is None:
        return 0.0
    law, patch = scenario.wear.build(), fresh_patch(scenario, load)
    friction = max(scenario.friction.coefficient, drawn.friction)
    crown = 2.0 * scenario.roller.crown_radius
    start = 0.0
    if scenario.cylinder.profile is not None:
        start = float(np.ptp(scenario.cylinder.profile.height))
    half = patch.b
    for _ in range(20):  # the slip at the groove's sides depends on its width, weakly
        slip = greatest_slip(scenario, half, drawn)
        line_loads = 0.75 * load / np.array([patch.b, max(half, patch.b)])
        per_load = wear_per_load(scenario, law, line_loads, friction * slip)
        depth = (0.75 * per_load * load * scenario.total_passes / np.sqrt(crown)) ** (2.0 / 3.0)
        before, half = half, float(np.sqrt(crown * (depth + start)))
        if half == before:
            break
    return half


def wear_per_load(
    scenario: Scenario, law: WearLaw, line_load: FloatArray, friction_slip: float
) -> float:
    """Return depth per pass and line load of strips in full slip, on both bodies [m/(N/m)].

    Parameters
    ----------
    scenario : Scenario
    law : WearLaw
    line_load : ndarray, shape (strips,)
        Line loads to look at; the greatest answer counts [N/m].
    friction_slip : float
        Friction coefficient times slip.
    """
    modulus = combine(scenario.cylinder.material, scenario.roller.material).contact_modulus
    curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
    half_length = np.sqrt(4.0 * line_load / (np.pi * modulus * curvature))
    speed = scenario.rolling_speed
    dissipation = friction_slip * line_load * speed
    sliding = ContactSolution(
        y=np.zeros_like(line_load),
        half_length=half_length,
        line_load=line_load,
        dissipation=dissipation,
        force_x=0.0,
        force_y=0.0,
        spin_moment=0.0,
        approach=0.0,
        peak_pressure=float((2.0 * line_load / (np.pi * half_length)).max()),
        adhesion_fraction=0.0,
        power=float(dissipation.sum()),
        longitudinal_creepage=0.0,
        iterations=0,
    )
    share = scenario.cylinder.radius / scenario.roller.radius / scenario.operation.rollers
    depth = law.depth_per_pass("cylinder", sliding, speed)
    depth = depth + share * law.depth_per_pass("roller", sliding, speed)
    return float((depth / line_load).max())


def strips_per_half_width(tolerance: float) -> float:
    """Return into how many strips half the fresh patch is cut for a relative error of the test."""
    needed = STRIPS_PER_HALF_WIDTH * np.sqrt(DEFAULT_TOLERANCE / tolerance)
    return float(np.clip(needed, FEWEST_PER_HALF_WIDTH, STRIPS_PER_HALF_WIDTH))


def strips_over(width: float, half_width: float, tolerance: float) -> int:
    """Return into how many strips a run cuts a track, an odd number.

    Parameters
    ----------
    width, half_width : float
        Of the track, and of the fresh patch [m].
    tolerance : float
        Relative error of the test.
    """
    strips = int(np.ceil(width / half_width * strips_per_half_width(tolerance)))
    return min(strips + (strips + 1) % 2, MOST_STRIPS)


def greatest_slip(scenario: Scenario, half_width: float, drawn: Drawn) -> float:
    """Return the greatest rigid slip within `half_width` [m] of a contact's middle."""
    creepage, roller = scenario.creepage, scenario.roller
    longitudinal = max(abs(creepage.longitudinal or 0.0), drawn.longitudinal)
    tilt = max(drawn.tilt, *(abs(angle) for angle in scenario.per_roller(creepage.tilt)))
    longitudinal += tilt / roller.radius * half_width
    if creepage.drive == "free" or creepage.differential_slip:
        curvature = 1.0 / roller.radius + 1.0 / scenario.cylinder.radius
        longitudinal += half_width**2 / (2.0 * roller.crown_radius) * curvature
    yaw = max(drawn.yaw, *(abs(angle) for angle in scenario.per_roller(creepage.yaw)))
    return float(np.hypot(longitudinal, yaw))


def run_grid(scenario: Scenario, load: float, drawn: Drawn = NOTHING_DRAWN) -> Grid:
    """Return the strips of a run whose greatest load is `load` [N].

    Parameters
    ----------
    scenario : Scenario
    load : float
    drawn : Drawn, optional
        What random inputs add.

    Raises
    ------
    ScenarioError
        If the strips that were asked for cannot hold the contact.
    """
    patch, centres = fresh_patch(scenario, load), contact_centres(scenario)
    choice = scenario.contact
    centre = choice.centre if choice.centre is not None else 0.5 * (min(centres) + max(centres))
    reach = max(abs(y - centre) for y in centres)
    if scenario.creepage.tilt_shifts_contact:
        reach += scenario.roller.crown_radius * drawn.tilt
    half = reach + 1.1 * foreseen_half_width(scenario, load, drawn) + 1.3 * patch.b
    width = choice.width if choice.width is not None else 2.0 * half
    strips = choice.strips
    if strips is None:
        strips = strips_over(width, patch.b, scenario.evolution.tolerance)
    if width < 2.0 * (reach + patch.b):
        needed = f"at least {2e3 * (reach + patch.b):.4g} mm"
        problem = Mistake(
            "contact", "width", "the fresh contact does not fit", f"{width * 1e3:.4g} mm", needed
        )
        raise ScenarioError(scenario.file, [problem])
    return Grid.spanning(centre - 0.5 * width, centre + 0.5 * width, strips)
