"""Strips of a run: centre, total width and number."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from wearsim.errors import Mistake, ScenarioError, mistake_in
from wearsim.evolution.strips import JOINED, LEAST_LOADED, Growth, Surfaces, same_strips
from wearsim.plugins import BODIES, ContactModel
from wearsim.scenario import Scenario
from wearsim.scenario.parse.fields import CONTACT_FIELDS
from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE, LEAST_TOLERANCE
from wearsim.studies.plausibility import greatest_load
from wearsim.studies.preparation import MOST_BYTES
from wearsim.studies.roller_ends import (
    STRIPS_BEYOND,
    roller_grid,
    strips_of_roller,
)
from wearsim.studies.run.inputs import OFFSET, TILT
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray, Grid

STRIPS_PER_HALF_WIDTH = 12  # of the initial patch; the discretisation error is then below 1e-3
FEWEST_PER_HALF_WIDTH = 5  # error below 1e-2, proportional to the square of the strip width
STRIPS_PER_GROOVE = 30  # of half a groove: at its end, a coarse start has been worn away
MOST_STRIPS = 801
STRIPS_AT_START = 241  # at most, unless the contacts of the unworn bodies require more
STRIPS_BEFORE_JOINING = 401  # of a growing groove
STRIPS_OF_MANY_CONTACTS = 141  # the same where the contacts of a turn are solved together
COARSER = 1.3  # width of strips that realisations share over the strips of one
LEAST_CHOSEN = 2.5  # strips per half-width of a patch; with fewer chosen ones, strips grow
PROFILE_STRIPS_PER_HALF_WIDTH = 24  # for one contact on the whole width of a profile
FEWEST_PROFILE_STRIPS = 161
STRIPS_OF_FORM = 121  # of a run on the width of a roller that is not crowned, at least
PART_OF_FORM = 0.5  # of the patch of such bodies, which is resolved as the patch of a crown
STRIPS_OF_CONTACT = 121
STRIPS_OF_CONTACT_OF_FORM = 485  # where its ends are steep, for a peak pressure within 1 %
DRAWN = {"scalar", "joint"}  # roles of random inputs with a range
_MARGIN = 1e-9  # of a patch, against rounding at the outer edges
_ROUNDING = 1e-12


def ends_roller(scenario: Scenario, low: float, high: float) -> bool:
    """Return whether strips from `low` to `high` [m] contain an end of a roller."""
    if scenario.roller.width is None:
        return False
    offsets = np.array(scenario.per_roller(scenario.roller.offset))
    half = 0.5 * scenario.roller.width
    return bool(low < offsets.min() - half or high > offsets.max() + half)


def contact_grid(setup: Setup, load: float) -> Grid:
    """Return the strips of the first roller's contact under `load` [N].

    The scenario gives them, the whole width of the profile, or the choice of the model.
    """
    scenario, profile = setup.scenario, setup.start_extent
    choice, centre, half_width = scenario.contact, setup.first_centre, setup.widest_patch(load).b
    if choice.width is None and profile is not None:
        return profile_grid(profile.low, profile.high, half_width, choice.strips)
    half = 1.2 * half_width
    default = STRIPS_OF_CONTACT if scenario.axial_gap.is_crowned else STRIPS_OF_CONTACT_OF_FORM
    if choice.width is None and ends_roller(scenario, centre - half, centre + half):
        return roller_grid(scenario, choice.strips or strips_of_roller(scenario, default, load))
    if choice.width is None and choice.strips is None and (grid := suggested_grid(setup, load)):
        return Grid(grid.y + centre, grid.spacing)
    width = choice.width if choice.width is not None else 2.4 * half_width
    return Grid.spanning(centre - 0.5 * width, centre + 0.5 * width, choice.strips or default)


def suggested_grid(setup: Setup, load: float) -> Grid | None:
    """Return the strips that the contact model suggests under `load` [N], if any."""
    scenario, choice = setup.scenario, setup.scenario.contact
    if choice.spec.suggest_grid is None:
        return None
    curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
    gap = scenario.axial_gap
    across = 1.0 / gap.radius_at(0.0 if gap.is_crowned else setup.fresh_patch(load).b)
    if across == 0.0:
        return None
    return choice.spec.suggest_grid(choice.options, across, curvature, load, scenario.materials)


def profile_grid(start: float, stop: float, half_width: float, strips: int | None) -> Grid:
    """Return strips over the whole width of start profiles.

    Parameters
    ----------
    start, stop : float
        Outer positions of the profiles [m].
    half_width : float
        Half-width of the initial patch [m].
    strips : int, optional
        Number of strips; by default sufficient to resolve the patch, at most `MOST_STRIPS`.
    """
    resolving = np.ceil(PROFILE_STRIPS_PER_HALF_WIDTH * (stop - start) / half_width)
    return Grid.spanning(
        start, stop, strips or int(np.clip(resolving, FEWEST_PROFILE_STRIPS, MOST_STRIPS))
    )


def wider_grid(setup: Setup, grid: Grid, load: float, shift: float = 0.0) -> Grid | None:
    """Return the strips of a profile and further ones for a groove as wide as the profile is deep.

    Parameters
    ----------
    setup : Setup
    grid : Grid
        Strips of the profile.
    load : float
        Normal force [N].
    shift : float
        Distance by which contacts may be away from the middle [m].

    Returns
    -------
    Grid or None
        None if the scenario sets a width, has no profile, or the groove is not wider than it.
    """
    scenario, profile = setup.scenario, setup.start_extent
    if scenario.contact.width is not None or profile is None:
        return None
    groove = float(scenario.axial_gap.half_width(profile.relief))  # of a conformal roller
    half = 1.1 * groove + 1.3 * setup.fresh_patch(load).b + shift
    centre = setup.first_centre
    lacking = max(grid.edges[0] - centre + half, centre + half - grid.edges[1])
    added = math.ceil(lacking / grid.spacing)
    if added <= 0:
        return None
    margin = added * grid.spacing
    low, high = grid.edges
    return Grid.spanning(low - margin, high + margin, grid.strips + 2 * added)


def strips_over(width: float, half_width: float, tolerance: float, groove: float = 0.0) -> int:
    """Return the number of strips of a run across a track, an odd number.

    Parameters
    ----------
    width, half_width : float
        Width of the track, and half-width of the initial patch [m].
    tolerance : float
        Relative error of the test.
    groove : float
        Half-width of the final groove, where the patch at the start need not be resolved [m].
    """
    strips = int(np.ceil(width / half_width * strips_per_half_width(half_width, tolerance, groove)))
    return min(strips + (strips + 1) % 2, MOST_STRIPS)


def strips_per_half_width(half_width: float, tolerance: float, groove: float = 0.0) -> float:
    """Return the number of strips of the half-width of a patch; parameters as of `strips_over`."""
    per_half_width = float(STRIPS_PER_HALF_WIDTH)
    if groove > 0.0:
        per_half_width = min(per_half_width, STRIPS_PER_GROOVE * half_width / groove)
    per_half_width *= np.sqrt(DEFAULT_TOLERANCE / tolerance)
    return float(np.clip(per_half_width, FEWEST_PER_HALF_WIDTH, STRIPS_PER_HALF_WIDTH))


def check_number_of_strips(scenario: Scenario, grid: Grid) -> None:
    """Raise an error if a scenario has more strips than lower its error, or than memory holds.

    The error due to the strips is proportional to the square of their width, and contacts are not
    solved accurately enough for one below `LEAST_TOLERANCE`. With wear compliance a contact has a
    coefficient for every two strips.

    Raises
    ------
    ScenarioError
        With the greatest number of strips.
    """
    chosen = scenario.contact.strips or 0
    if chosen <= MOST_STRIPS:
        return
    half_width = Setup(scenario).widest_patch(greatest_load(scenario)).b
    if not scenario.axial_gap.is_crowned:
        half_width *= PART_OF_FORM
    useful = STRIPS_PER_HALF_WIDTH * math.sqrt(DEFAULT_TOLERANCE / LEAST_TOLERANCE)
    finest, size = half_width / useful, 8.0 * grid.strips**2
    if grid.spacing < finest:
        what = f"more than {useful:.0f} strips per half-width of a contact do not lower the error"
        most = chosen * grid.spacing / finest
    elif size > MOST_BYTES and scenario.contact.spec.capabilities.wear_compliance:
        what = f"the equations of a contact would take {size / 1e9:,.4g} GB of memory"
        most = chosen * math.sqrt(MOST_BYTES / size)
    else:
        return
    raise mistake_in(
        scenario.file,
        what,
        str(chosen),
        f"at most {math.floor(most)}",
        table="contact",
        key="strips",
    )


def strips_of_run(setup: Setup) -> Grid:
    """Return the strips with which a run starts, for its random inputs.

    They resolve the contact of the unworn bodies and cover it, and the final groove as far as it is
    predicted and takes no more than `STRIPS_AT_START`; see `growth_of`.

    Raises
    ------
    ScenarioError
        If the contact does not fit on the strips that the scenario defines.
    """
    scenario, choice = setup.scenario, setup.scenario.contact
    patch, centre, fresh, half = setup.patch, setup.centre, setup.fresh, setup.final
    tolerance, size = scenario.evolution.tolerance, patch.b
    if not scenario.axial_gap.is_crowned:  # loads fall to zero over the ends of the patch
        size *= PART_OF_FORM
    if choice.width is None and ends_roller(scenario, centre - half, centre + half):
        least = strips_over(scenario.roller.width or 0.0, patch.b, tolerance)
        if not scenario.axial_gap.is_crowned:
            least = max(least, STRIPS_OF_FORM)
        inside = not ends_roller(scenario, centre - fresh, centre + fresh)
        if choice.strips or not inside or least < STRIPS_AT_START:
            return roller_grid(
                scenario, choice.strips or strips_of_roller(scenario, least, setup.greatest_load)
            )
    width = choice.width if choice.width is not None else 2.0 * half
    many, resolved = setup.turn.varies, 0.0
    if many:
        resolved = setup.half_width(setup.greatest_load, full_slip=False)
        resolved = min(
            resolved, float(scenario.axial_gap.half_width(scenario.limit.depth or math.inf))
        )
    if choice.width is None:  # strips grow from here
        per_half_width = strips_per_half_width(size, tolerance, resolved)
        at_start = STRIPS_OF_MANY_CONTACTS if many else STRIPS_AT_START
        if choice.strips is not None:
            per_half_width, at_start = LEAST_CHOSEN, choice.strips
        width = min(width, max(2.0 * fresh, size / per_half_width * at_start))
    strips = choice.strips or strips_over(width, size, tolerance, resolved)
    if width < 2.0 * (setup.shift + patch.b):
        raise mistake_in(
            scenario.file,
            "the initial contact does not fit",
            f"{width * 1e3:.4g} mm",
            f"at least {2e3 * (setup.shift + patch.b):.4g} mm",
            table="contact",
            key="width",
        )
    return Grid.spanning(centre - 0.5 * width, centre + 0.5 * width, strips)


def shared_strips(scenario: Scenario, to_limits: bool = False) -> Grid:
    """Return the strips with which the realisations of a scenario start that fit on them.

    They are those with every input that is drawn for a test at its mean, wider by its scatter.

    Parameters
    ----------
    scenario : Scenario
    to_limits : bool
        Whether tests end at the limits of the scenario; strips then reach as far as the groove is
        predicted at them.
    """
    setup = Setup(scenario, passes=tuple(item for item in scenario.random if item.is_redrawn))
    grid = strips_of_run(setup)
    fixed = scenario.contact.width is not None or scenario.contact.strips is not None
    if fixed or not scenario.random or ends_roller(scenario, *grid.edges):
        return grid
    ranged = (item for item in scenario.random if item.role in DRAWN)
    tilting = tuple(item for item in ranged if CONTACT_FIELDS.keys() >= set(item.keys))
    drawn = Setup(scenario, passes=tilting)
    tilts = float(np.ptp(drawn.tilt_shift(drawn.range_of("tilt"))))
    half = 0.5 * 1.25 * grid.strips * grid.spacing
    if to_limits:
        half = min(half, setup.reach_of(half_width_at_limits(setup)))
    return lattice(grid, half + 0.5 * tilts)


def half_width_at_limits(setup: Setup) -> float:
    """Return half the greatest width of a groove before a limit of depth or width [m].

    The rollers are as deep as the cylinder times the ratio of the wear of both, or less on a cam
    that wears less at other angles. The value is infinite without such a limit.
    """
    scenario, limit, profile = setup.scenario, setup.scenario.limit, setup.start_extent
    half, speed = math.inf if limit.width is None else 0.5 * limit.width, scenario.rolling_speed
    law = None if scenario.wear is None else scenario.wear.built
    if law is None or limit.depth is None:
        return half
    of_cylinder, of_roller = (law.depth_per_dissipation(body, speed) for body in BODIES)
    if not of_cylinder or of_roller is None:
        return half
    depth = limit.depth * (1.0 + setup.overrollings * of_roller / of_cylinder)
    relief = 0.0 if profile is None else profile.relief
    return min(half, float(scenario.axial_gap.half_width(depth + relief)))


def lattice(grid: Grid, half: float) -> Grid:
    """Return strips in line with others that reach a distance `half` [m] from their middle.

    Strips are joined until there are at most `MOST_STRIPS`.
    """
    middle, spacing = 0.5 * (grid.edges[0] + grid.edges[1]), grid.spacing
    while 2.0 * half / spacing > MOST_STRIPS:
        spacing *= JOINED
    strips = math.ceil(2.0 * half / spacing - _MARGIN)
    strips += (strips - grid.strips) % 2
    return Grid.spanning(middle - 0.5 * strips * spacing, middle + 0.5 * strips * spacing, strips)


def start_of(setup: Setup, shared: Grid) -> Grid:
    """Return the strips with which a realisation starts: the shared ones if its contacts fit.

    They must cover the contacts of the unworn bodies, and resolve them nearly as well as its own.
    """
    scenario, strips = setup.scenario, strips_of_run(setup)
    if scenario.contact.width is not None or ends_roller(scenario, *strips.edges):
        return shared if same_strips(strips, shared) else strips
    reach = abs(setup.centre - 0.5 * (shared.edges[0] + shared.edges[1])) + setup.fresh
    covers = 2.0 * reach <= shared.strips * shared.spacing
    resolves = scenario.contact.strips or shared.spacing <= COARSER * strips.spacing
    return shared if covers and resolves else strips


def start_of_run(scenario: Scenario, setup: Setup) -> Grid:
    """Return the strips with which the run of a scenario starts, for its realisation."""
    return start_of(setup, shared_strips(scenario)) if scenario.random else strips_of_run(setup)


def growth_of(
    setup: Setup,
    grid: Grid,
    model: Callable[[Grid], ContactModel],
    surfaces: Callable[[Grid, FloatArray | None], Surfaces],
) -> tuple[Growth, ...]:
    """Return how the strips of a run grow; they do not where the scenario defines their width.

    Parameters
    ----------
    setup : Setup
    grid : Grid
        The present strips.
    model, surfaces : callable
        See `Growth`.

    Raises
    ------
    ScenarioError
        If the load is not defined for the whole test.
    """
    scenario, choice = setup.scenario, setup.scenario.contact
    start, width = scenario.cylinder.start_surface, scenario.roller.width
    by_angle = start is not None and start.varies
    greatest = setup.greatest_load  # raises beyond a log
    coarse = partial(coarse_grid, scenario)
    if choice.width is not None or (width is not None and ends_roller(scenario, *grid.edges)):
        return (Growth(model, surfaces, coarse, 0, by_angle=by_angle),)
    at_once = STRIPS_OF_MANY_CONTACTS if setup.turn.varies else STRIPS_BEFORE_JOINING
    most = choice.strips or at_once
    last, changes = None, setup.varying or setup.passes or not scenario.load.built.constant
    margin = (0.5 * setup.patch.b if changes else 0.0) + setup.drawn_shift
    if width is not None:
        last = roller_grid(scenario, strips_of_roller(scenario, STRIPS_AT_START, greatest))
    least = LEAST_LOADED if choice.strips is None else FEWEST_PER_HALF_WIDTH
    return (Growth(model, surfaces, coarse, most, margin, last, least, by_angle),)


def coarse_grid(scenario: Scenario, grid: Grid) -> Grid:
    """Return strips of twice the width about the same middle; ends of a roller are edges."""
    if ends_roller(scenario, *grid.edges) and scenario.contact.width is None:
        strips = math.ceil(0.5 * (scenario.roller.width or 0.0) / grid.spacing - _MARGIN)
        return roller_grid(scenario, strips + 2 * STRIPS_BEYOND)
    strips = math.ceil(0.5 * grid.strips) | grid.strips % 2  # with one in the middle if it had one
    middle, half = 0.5 * (grid.edges[0] + grid.edges[1]), strips * grid.spacing
    return Grid.spanning(middle - half, middle + half, strips)


def realisation_grid(setup: Setup, load: float, loads: FloatArray, centres: FloatArray) -> Grid:
    """Return strips that cover the contacts of all realisations.

    The strips of the contact with every input at its mean are those that the model suggests, and
    further strips of the same width cover the others.

    Parameters
    ----------
    setup : Setup
    load : float
        Load with every input at its mean [N].
    loads : ndarray, shape (realisations,)
        Loads [N].
    centres : ndarray, shape (realisations,)
        Contact positions on an unworn cylinder [m].

    Returns
    -------
    Grid

    Raises
    ------
    ScenarioError
        If the strips that the scenario defines do not cover all contacts, or too many are needed.
    """
    scenario, mean_b = setup.scenario, setup.fresh_patch(load).b
    choice = scenario.contact
    half_widths = mean_b * np.cbrt(np.maximum(loads, 0.0) / load)
    centre = setup.first_centre
    away = np.abs(centres - centre)
    if choice.width is not None:
        needed = 2.0 * float((away + half_widths).max())
        if choice.width < needed * (1.0 - _MARGIN):
            raise mistake_in(
                scenario.file,
                "the contacts of all realisations do not fit",
                f"{choice.width * 1e3:.4g} mm",
                f"at least {needed * 1e3:.4g} mm",
                table="contact",
                key="width",
            )
    if choice.width is not None or setup.start_extent is not None:
        return contact_grid(setup, load)
    half = 1.2 * float((away + half_widths).max())
    if ends_roller(scenario, centre - half, centre + half):
        strips = choice.strips or strips_of_roller(scenario, 121, load)
        shifted = any(OFFSET in item.keys for item in scenario.random)
        return roller_grid(scenario, strips, float(away.max()) if shifted else 0.0)
    grid = suggested_grid(setup, load) or Grid.spanning(-1.2 * mean_b, 1.2 * mean_b, 121)
    margin = 0.5 * grid.spacing * grid.strips / mean_b  # 1 where the strips end with the patch
    half = float((away + margin * half_widths).max())
    if choice.strips is not None:
        half *= 1.0 + _MARGIN
        return Grid.spanning(centre - half, centre + half, choice.strips)
    beyond = half / grid.spacing - 0.5 * grid.strips
    strips = grid.strips + 2 * max(math.ceil(beyond - _ROUNDING * grid.strips), 0)
    if strips > MOST_STRIPS:
        raise _too_many_strips(scenario, strips, half, float(away.max()))
    half = 0.5 * strips * grid.spacing
    return Grid.spanning(centre - half, centre + half, strips)


def _too_many_strips(scenario: Scenario, strips: int, half: float, away: float) -> ScenarioError:
    """Return the error of too many strips, with the inputs that move the contacts apart."""
    takes = (
        f"the contacts of all realisations span {2e3 * half:.4g} mm, which takes {strips} strips of"
        f" the width that suits one contact; the maximum is {MOST_STRIPS}"
    )
    coarser = f"a number of strips, such as contact.strips = {MOST_STRIPS}"
    keys = {OFFSET, TILT} if scenario.creepage.tilt_shifts_contact else {OFFSET}
    shifting = [item for item in scenario.random if keys & set(item.keys)]
    mistakes = []
    for item in shifting:
        table, key = item.name.split(".", 1)
        shift = f"moves contacts by up to {away * 1e3:.4g} mm"
        less = f"a smaller {'radius' if 'radius' in item.options else 'spread'}"
        if TILT in item.keys:
            less += ", creepage.tilt_shifts_contact = false"
            crown, known = scenario.roller.crown_radius, scenario.axial_gap.is_crowned
            if len(shifting) == 1 and scenario.contact.centre is None and known:
                angle = f"{away / crown * 1e3:.4g} mrad"
                shift += f", crown radius x tilt = {crown * 1e3:.4g} mm x {angle}"
        mistakes.append(
            Mistake(table, key, f"{shift}: {takes}", item.describe(), f"{less}, or {coarser}")
        )
    if not mistakes:
        mistakes.append(
            Mistake("contact", "strips", takes, None, f"{coarser}, or inputs that vary less")
        )
    return ScenarioError(scenario.file, mistakes)
