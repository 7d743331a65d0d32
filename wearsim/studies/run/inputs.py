"""Inputs of contacts: values of a scenario, and drawn values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from wearsim.errors import ScenarioError, mistake_in
from wearsim.quantities import InputFile
from wearsim.scenario import RandomInput, Scenario
from wearsim.scenario.parse.fields import CONTACT_FIELDS
from wearsim.types import FloatArray

LOAD, FRICTION, LONGITUDINAL = "load.normal_force", "friction.coefficient", "creepage.longitudinal"
YAW, TILT, OFFSET = "creepage.yaw", "creepage.tilt", "roller.offset"
#: Inputs of one contact: name in `Setup.inputs`, by scenario key.
FIELDS = {**CONTACT_FIELDS, OFFSET: "offset"}


def origin(key: str, mean: float) -> float:
    """Return the origin of the values of a key: the mean for a load, which is an offset."""
    return mean if key == LOAD else 0.0


def contact_values(
    items: Iterable[RandomInput], values: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return the drawn inputs of contacts by the names of `Setup.inputs`.

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


def load_file(scenario: Scenario) -> tuple[str, str] | None:
    """Return the key and the name of the file that the load reads, if any."""
    files = ((key, item) for key, item in scenario.load.options if isinstance(item, InputFile))
    return next(((key, item.path) for key, item in files), None)


def load_mistake(scenario: Scenario, what: str, got: str, expected: str) -> ScenarioError:
    """Return the error of a load, which names the file that the load reads."""
    key, file = load_file(scenario) or ("kind", scenario.load.kind)
    return mistake_in(scenario.file, f"{file}: {what}", got, expected, table="load", key=key)
