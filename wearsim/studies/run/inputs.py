"""Inputs of contacts: values of a scenario, and drawn values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from wearsim.errors import ScenarioError, mistake_in
from wearsim.models.loads import FollowerLoad
from wearsim.quantities import InputFile
from wearsim.scenario import RandomInput, Scenario
from wearsim.scenario.parse.fields import CONTACT_FIELDS
from wearsim.studies.cam.turn import turn_of
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


def load_range(scenario: Scenario, stop: float) -> tuple[float, float]:
    """Return the least and greatest load up to `stop` [s], before any feedback [N].

    Raises
    ------
    ScenarioError
        If the load is not defined for the whole time, or is not positive outside of pauses.
    """
    load = scenario.load.built
    if load.span is not None and (load.span[0] > 0.0 or load.span[1] < stop * (1.0 - 1e-9)):
        got = f"{load.span[0] / 60.0:.6g} to {load.span[1] / 60.0:.6g} min"
        expected = f"0 to {stop / 60.0:.6g} min: a longer log or a shorter operation.duration"
        raise _load_mistake(scenario, "the log does not cover the test", got, expected)
    low, high = load.extremes(0.0, stop)
    if isinstance(load, FollowerLoad):
        low, high = turn_of(scenario).normal_range
        return (low if low > 0.0 else high), high  # where N changes sign, the flank changes
    if scenario.load.terms:
        return low, high
    if high <= 0.0:
        when = f"never above zero up to {stop / 60.0:.6g} min" if stop else "zero at the start"
        what = f"the load is {when}, and there is no contact"
        raise _load_mistake(scenario, what, f"{high:.6g} N", "a load above zero")
    if low < 0.0 or (low == 0.0 and not len(load.pauses)):
        before, after = 0.0, stop
        for _ in range(60):  # the first time of the least load, of any kind of load
            middle = 0.5 * (before + after)
            reached = load.extremes(0.0, middle)[0] <= low
            before, after = (before, middle) if reached else (middle, after)
        what = "the load falls to zero or below, and contact is lost"
        got = f"{low:.6g} N at {after / 60.0:.6g} min"
        expected = "a load above zero at all times, or zero for a pause in a log"
        raise _load_mistake(scenario, what, got, expected)
    return low, high


def load_file(scenario: Scenario) -> tuple[str, str] | None:
    """Return the key and the name of the file that the load reads, if any."""
    options = scenario.load.options
    return next(((key, item.path) for key, item in options if isinstance(item, InputFile)), None)


def _load_mistake(scenario: Scenario, what: str, got: str, expected: str) -> ScenarioError:
    """Return the error of a load, which names the file that the load reads."""
    key, file = load_file(scenario) or ("kind", scenario.load.kind)
    return mistake_in(scenario.file, f"{file}: {what}", got, expected, table="load", key=key)
