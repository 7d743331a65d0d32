"""The strips of a study of realisations: one set that holds the patch of every one of them."""

from __future__ import annotations

import math

import numpy as np

from wearsim.errors import Mistake, ScenarioError
from wearsim.plugins import ContactModel
from wearsim.scenario import RandomInput, Scenario
from wearsim.studies.contact.draws import OFFSET, TILT
from wearsim.studies.run.grid import MOST_STRIPS, contact_centres, fresh_patch, profile_grid
from wearsim.types import FloatArray, Grid

_MARGIN = 1e-9  # of a patch, so that rounding leaves it on its strips
_ROUNDING = 1e-12


def realisation_grid(
    scenario: Scenario, model: ContactModel, load: float, loads: FloatArray, centres: FloatArray
) -> Grid:
    """Return strips for every realisation: as wide as the model would have them for the mean.

    The patch with every input at its mean is cut just as the model suggests, and further strips
    of the same width hold the others.

    Parameters
    ----------
    scenario : Scenario
    model : ContactModel
    load : float
        Load with every input at its mean [N].
    loads : ndarray, shape (realisations,)
        Loads [N].
    centres : ndarray, shape (realisations,)
        Where each contact lies on an unworn cylinder [m].

    Returns
    -------
    Grid

    Raises
    ------
    ScenarioError
        If the strips that were asked for cannot hold every contact, or too many are needed.
    """
    choice, profile = scenario.contact, scenario.cylinder.profile
    mean_b = fresh_patch(scenario, load).b
    half_widths = mean_b * np.cbrt(np.maximum(loads, 0.0) / load)
    centre = choice.centre if choice.centre is not None else contact_centres(scenario)[0]
    away = np.abs(centres - centre)
    if profile is not None and choice.width is None:
        return profile_grid(profile, mean_b, choice.strips)
    suggested = _suggested(scenario, model, load, mean_b)
    room = 0.5 * suggested.spacing * suggested.strips / mean_b  # of a patch, 1 for no margin
    if choice.width is not None:
        _check_width(scenario, choice.width, 2.0 * float((away + half_widths).max()))
        half = 0.5 * choice.width
        return Grid.spanning(centre - half, centre + half, choice.strips or 121)
    reach = float((away + room * half_widths).max())
    if choice.strips is not None:
        reach *= 1.0 + _MARGIN
        return Grid.spanning(centre - reach, centre + reach, choice.strips)
    beyond = reach / suggested.spacing - 0.5 * suggested.strips
    strips = suggested.strips + 2 * max(math.ceil(beyond - _ROUNDING * suggested.strips), 0)
    if strips > MOST_STRIPS:
        _refuse_many(scenario, strips, reach, float(away.max()))
    half = 0.5 * strips * suggested.spacing
    return Grid.spanning(centre - half, centre + half, strips)


def _suggested(scenario: Scenario, model: ContactModel, load: float, mean_b: float) -> Grid:
    curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
    materials = scenario.cylinder.material, scenario.roller.material
    grid = model.suggest_grid(1.0 / scenario.roller.crown_radius, curvature, load, materials)
    return grid if grid is not None else Grid.spanning(-1.2 * mean_b, 1.2 * mean_b, 121)


def _check_width(scenario: Scenario, width: float, needed: float) -> None:
    if width < needed * (1.0 - _MARGIN):
        problem = Mistake(
            "contact",
            "width",
            "the contacts of all realisations do not fit",
            f"{width * 1e3:.4g} mm",
            f"at least {needed * 1e3:.4g} mm",
        )
        raise ScenarioError(scenario.file, [problem])


def _refuse_many(scenario: Scenario, strips: int, reach: float, away: float) -> None:
    """Refuse more strips than there may be, naming what sets the contacts so far apart."""
    takes = (
        f"the contacts of all realisations lie within {2e3 * reach:.4g} mm, which takes {strips}"
        f" strips of the width that suits one, and there may be {MOST_STRIPS}"
    )
    coarser = f"a number of strips, such as contact.strips = {MOST_STRIPS}"
    shifting = _shifting(scenario)
    if not shifting:
        expected = f"{coarser}, or inputs that vary less"
        raise ScenarioError(scenario.file, [Mistake("contact", "strips", takes, None, expected)])
    alone = len(shifting) == 1 and scenario.contact.centre is None
    crown = scenario.roller.crown_radius if alone else None
    problems = [_shifts_far(item, takes, coarser, away, crown) for item in shifting]
    raise ScenarioError(scenario.file, problems)


def _shifting(scenario: Scenario) -> list[RandomInput]:
    """Return the random inputs that move the contact along the track."""
    keys = {OFFSET, TILT} if scenario.creepage.tilt_shifts_contact else {OFFSET}
    return [item for item in scenario.random if keys & set(item.keys)]


def _shifts_far(
    item: RandomInput, takes: str, coarser: str, away: float, crown: float | None
) -> Mistake:
    """Return what is told of one input; `crown` is given where it alone moves the contact."""
    table, key = item.name.split(".", 1)
    shift = f"moves contacts by up to {away * 1e3:.4g} mm"
    less = f"a smaller {'radius' if 'radius' in item.options else 'spread'}"
    if TILT in item.keys and crown is not None:
        shift += f", crown radius x tilt = {crown * 1e3:.4g} mm x {away / crown * 1e3:.4g} mrad"
    if TILT in item.keys:
        less += ", creepage.tilt_shifts_contact = false"
    return Mistake(table, key, f"{shift}: {takes}", item.describe(), f"{less}, or {coarser}")
