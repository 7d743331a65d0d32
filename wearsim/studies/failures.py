"""Failures of contacts in terms of a scenario: the pass, what it sets, and what to change."""

from __future__ import annotations

import math

from wearsim.errors import SolverError, StepError
from wearsim.mechanics.slender.influence import HIGHEST
from wearsim.scenario import Scenario
from wearsim.studies.plausibility import greatest_load
from wearsim.studies.run.setup import Setup
from wearsim.units import in_engineers_unit


def explained(
    error: SolverError, scenario: Scenario, passes: float = 0.0, forecast: bool = False
) -> SolverError:
    """Return the failure of a contact with the pass, and the remedy for what a scenario sets.

    Parameters
    ----------
    error : SolverError
        Those without a cause are returned as they are.
    scenario : Scenario
    passes : float
        Passes done before the failure.
    forecast : bool
        Whether they are forecast.
    """
    remedies = {"edge": _edge, "too fine": _too_fine, "skid": _skid, "lost": _lost}
    if error.cause not in remedies:
        return error
    when = f"after pass {passes:.0f}: " if passes and error.cause != "lost" else ""
    if forecast:
        when = f"forecast after about {passes:.2g} of {scenario.total_passes:.3g} passes: "
    message, remedy = remedies[error.cause](error, scenario)
    return type(error)(f"{when}{message}", error.state, remedy=remedy, cause=error.cause)


def too_deep(scenario: Scenario, depth: float) -> str:
    """Return that a worn depth [m] is beyond the validity of the models, or an empty text."""
    if depth <= scenario.greatest_valid_depth:
        return ""
    return (
        f"the worn depth of {depth * 1e3:.4g} mm exceeds a tenth of roller.radius ="
        f" {scenario.roller.radius * 1e3:.6g} mm, up to which the contact models hold"
    )


def too_deep_failure(
    scenario: Scenario, depth: float, passes: float, less: str = "", also: str = ""
) -> StepError | None:
    """Return the failure of a test that is worn beyond the validity of the models, if it is.

    Parameters
    ----------
    scenario : Scenario
    depth : float
        Greatest worn depth of either body [m].
    passes : float
        Passes done.
    less : str
        What to lower, by default the length of the test.
    also : str
        A further remedy.
    """
    if text := too_deep(scenario, depth):
        remedy = f"lower {less or length_key(scenario)}, or set evolution.allow_deep = true{also}"
        return StepError(f"after pass {passes:.0f} {text}", remedy=remedy)
    return None


def length_key(scenario: Scenario) -> str:
    """Return the key that sets the length of the test, with its table."""
    given = (key for key in ("duration", "passes", "turns") if getattr(scenario.operation, key))
    return f"operation.{next(given, 'duration')}"


def _edge(error: SolverError, scenario: Scenario) -> tuple[str, str]:
    choice, roller = scenario.contact, scenario.roller
    if choice.width is not None:
        given, centre = f"contact.width = {choice.width * 1e3:.6g} mm", choice.centre
        where = "" if centre is None else f", move contact.centre = {centre * 1e3:.6g} mm"
        remedy = f"raise {given}{where}, or leave it out, and the strips follow the groove"
        return error.message, remedy
    if choice.centre is not None:
        return error.message, f"move contact.centre = {choice.centre * 1e3:.6g} mm or leave it out"
    if scenario.cylinder.profile is not None:
        file = scenario.cylinder.profile_file
        return error.message, f"set contact.width, since {file or 'the profile'} is narrower"
    if roller.width is not None:
        return (
            (
                f"{error.message}, beyond the ends of the roller (roller.width ="
                f" {roller.width * 1e3:.6g} mm): it is as deep as the roller"
            ),
            f"check the wear factors and {length_key(scenario)}",
        )
    if choice.strips is not None:
        return error.message, f"raise contact.strips = {choice.strips} or leave it out"
    return (
        f"{error.message}, chosen automatically",
        "set contact.width to a greater value",
    )


def _too_fine(error: SolverError, scenario: Scenario) -> tuple[str, str]:
    choice = scenario.contact
    patch = Setup(scenario).widest_patch(greatest_load(scenario))
    size = f"{2e3 * patch.a:.4g} x {2e3 * patch.b:.4g} mm"
    if patch.a > patch.b:
        what = (
            f"{error.message}: the contact, {size} along and across rolling, is longer than wide,"
            f" and '{choice.model}' assumes the opposite"
        )
        return what, "use contact.model = 'halfspace', or 'hertz-fastsim' for a single contact"
    if choice.strips is None:
        return error.message, "set a lower number contact.strips than the automatic one"
    most = math.floor(math.exp(HIGHEST) * (choice.width or 2.4 * patch.b) / patch.a)
    return error.message, f"lower contact.strips = {choice.strips} to at most {most}"


def _lost(error: SolverError, scenario: Scenario) -> tuple[str, str]:
    stiffness = getattr(scenario.load.options, "stiffness", 0.0)
    if hasattr(scenario.load.options, "preload"):
        return error.message, f"raise load.preload, or lower {length_key(scenario)}"
    if stiffness:
        spring = f"load.stiffness = {in_engineers_unit(stiffness, 'N/m')}"
        what = f"{error.message}, as the spring ({spring}) has run out of travel"
        return what, f"lower load.stiffness or {length_key(scenario)}"
    if scenario.load.kind == "recorded":
        return error.message, "raise the recorded load, or lower what load terms take from it"
    return error.message, "raise the load or lower its scatter"


def _skid(error: SolverError, scenario: Scenario) -> tuple[str, str]:
    creepage, friction = scenario.creepage, scenario.friction.coefficient
    load, carried = error.state["normal_force"], error.state["carried"]
    reason, most, of_inertia = "", "", ["lower roller.inertia"]
    if scenario.cam is None:
        most, of_inertia, start = f" to below {1e3 * carried:.4g} N mm", [], greatest_load(scenario)
        reason = f"; the load has fallen from {start:.4g} N" if load < 0.99 * start else ""
    if any(scenario.per_roller(creepage.yaw)):
        reason += "; creepage.yaw takes a part of the friction"
    torque, bearing = 1e3 * (creepage.bearing_torque or 0.0), creepage.bearing_friction
    remedies = [
        *([f"lower creepage.bearing_torque = {torque:.6g} N mm{most}"] if torque else []),
        *of_inertia,
        *([f"lower creepage.bearing_friction = {bearing:.4g}"] if bearing else []),
        f"raise friction.coefficient = {friction:.4g} or the load",
    ]
    return f"{error.message}{reason}", ", or ".join(remedies)
