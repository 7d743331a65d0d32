"""Inputs of contacts: those of a scenario, and drawn values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from wearsim.errors import Mistake, ScenarioError
from wearsim.plugins import Load
from wearsim.scenario import RandomInput, Scenario
from wearsim.scenario.parse.fields import CONTACT_FIELDS
from wearsim.types import FloatArray

LOAD, FRICTION, LONGITUDINAL = "load.normal_force", "friction.coefficient", "creepage.longitudinal"
YAW, TILT, OFFSET = "creepage.yaw", "creepage.tilt", "roller.offset"
FIELDS = {**CONTACT_FIELDS, OFFSET: "offset"}
"""Inputs of one contact: name in `contact_inputs`, by scenario key."""


def origin(key: str, mean: float) -> float:
    """Return the origin of the values of a key: the mean for a load, which is an offset."""
    return mean if key == LOAD else 0.0


def contact_values(
    items: Iterable[RandomInput], values: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return the drawn inputs of contacts by the names of `contact_inputs`.

    Parameters
    ----------
    items : iterable of RandomInput
        The inputs that were drawn.
    values : mapping of str to ndarray
        Their values by the scenario's key [SI]; keys that are missing are left out.
    """
    return {
        FIELDS[key]: values[key] - origin(key, mean)
        for item in items
        for key, mean in zip(item.keys, item.mean, strict=True)
        if key in values
    }


def contact_inputs(
    scenario: Scenario, rollers: Sequence[int], drawn: Mapping[str, FloatArray] | None = None
) -> dict[str, FloatArray]:
    """Return the inputs of the contacts of rollers: drawn values, or those of the scenario.

    Parameters
    ----------
    scenario : Scenario
    rollers : sequence of int
        Numbers of the rollers.
    drawn : mapping of str to ndarray, optional
        Drawn inputs from `contact_values`; they broadcast to (rollers, realisations).

    Returns
    -------
    dict of str to ndarray
        By field of `ContactInputs`, and "offset" of the roller [SI]; those that are not drawn have
        the shape (rollers, 1).
    """
    creepage = scenario.creepage
    values = {
        "offset": scenario.roller.offset,
        "yaw": creepage.yaw,
        "tilt": creepage.tilt,
        "friction": scenario.friction.coefficient,
        "longitudinal": creepage.longitudinal or 0.0,
        "bearing_torque": creepage.bearing_torque or 0.0,
    }
    columns = {
        name: np.array(scenario.per_roller(value))[list(rollers), None]
        for name, value in values.items()
    }
    return {**columns, **(drawn or {})}


def load_range(scenario: Scenario, load: Load, stop: float) -> tuple[float, float]:
    """Return the least and greatest load up to `stop` [s], before any feedback [N].

    Raises
    ------
    ScenarioError
        If the load is not defined for the whole time, or is not positive.
    """
    kind = scenario.load.kind
    if load.span is not None and (load.span[0] > 0.0 or load.span[1] < stop * (1.0 - 1e-9)):
        mistake = Mistake(
            "load",
            kind,
            "the log does not cover the test",
            f"{load.span[0] / 60.0:.6g} to {load.span[1] / 60.0:.6g} min",
            f"0 to {stop / 60.0:.6g} min; log longer or shorten operation.duration",
        )
        raise ScenarioError(scenario.file, [mistake])
    low, high = load.extremes(0.0, stop)
    if low <= 0.0 and not scenario.load.terms:
        mistake = Mistake(
            "load",
            kind,
            "the load falls to zero or below, and contact is lost",
            f"{low:.6g} N",
            "a load above zero at all times",
        )
        raise ScenarioError(scenario.file, [mistake])
    return low, high
