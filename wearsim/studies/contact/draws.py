"""The random inputs of one contact: which of a scenario's act on it, and their values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wearsim.errors import Mistake, ScenarioError
from wearsim.scenario import RandomInput, Scenario, realise
from wearsim.scenario.random.model import CONTACT_FIELDS
from wearsim.types import FloatArray
from wearsim.uq.sampling.sampler import Sampler

LOAD, FRICTION, LONGITUDINAL = "load.normal_force", "friction.coefficient", "creepage.longitudinal"
TORQUE, YAW, TILT = "creepage.bearing_torque", "creepage.yaw", "creepage.tilt"
OFFSET = "roller.offset"
KEYS = (*CONTACT_FIELDS, OFFSET)
"""The values that one contact depends on and that may be random, by the scenario's keys."""

BLOCK = 4096  # realisations that are drawn at once
# between the extremes of a random option of the load, where it is asked whether the load feels it
_BETWEEN = np.array([0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99])


@dataclass(frozen=True)
class ContactDraws:
    """The random inputs of one contact in every realisation.

    Parameters
    ----------
    values : mapping of str to ndarray, shape (realisations,)
        Drawn values by the scenario's key, in SI.
    units : mapping of str to str
        The SI unit of each; "1" for a plain number.
    field : RandomInput, optional
        The friction field, where there is one.
    notes : tuple of str
        What is not drawn, and why.
    """

    values: Mapping[str, FloatArray]
    units: Mapping[str, str]
    field: RandomInput | None
    notes: tuple[str, ...]


def draw_contacts(scenario: Scenario, realisations: int) -> ContactDraws:
    """Draw what one contact depends on, once per realisation, whatever the persistence.

    A process is drawn from its marginal distribution.

    Parameters
    ----------
    scenario : Scenario
    realisations : int
        How many.

    Returns
    -------
    ContactDraws

    Raises
    ------
    ScenarioError
        If a random option of the load acts on the contact in a way that is not known.
    """
    acting = [item for item in scenario.random if _acts(scenario, item)]
    idle = [item.name for item in scenario.random if item not in acting]
    drawn = [item for item in acting if item.role != "field"]
    field = next((item for item in acting if item.role == "field"), None)
    verb = "have" if len(idle) > 1 else "has"
    note = f"{', '.join(idle)} {verb} no effect on the dissipation of a contact: not drawn"
    quantities = {key: item.quantity for item in drawn for key in item.keys}
    return ContactDraws(
        values=_values(scenario, drawn, realisations),
        units={key: given.kind.unit if given else "1" for key, given in quantities.items()},
        field=field,
        notes=(note,) if idle else (),
    )


def _acts(scenario: Scenario, item: RandomInput) -> bool:
    """Tell whether a random input changes one contact at the start of its load."""
    if set(item.keys) <= set(KEYS):
        return True
    if not item.name.startswith("load."):
        return False
    tried = {*item.extremes, *item.scalar.quantile(_BETWEEN).tolist()}
    start = np.zeros(1)
    forces = {
        float(realise(scenario, {item.name: value}).load.build().force(start)[0]) for value in tried
    }
    if len(forces) == 1:
        return False
    table, key = item.name.split(".", 1)
    what = "changes the load of the contact, and only load.normal_force can be random here"
    expected = f"one value, such as {_mean_of(item)}"
    raise ScenarioError(scenario.file, [Mistake(table, key, what, item.kind, expected)])


def _mean_of(item: RandomInput) -> str:
    """Return the mean of a random input as a scenario would hold it."""
    mean = item.mean[0]
    return str(item.quantity.write(mean)) if item.quantity else f"{mean:g}"


def _values(
    scenario: Scenario, drawn: Sequence[RandomInput], realisations: int
) -> dict[str, FloatArray]:
    """Return the values of every key, having drawn them in blocks that no batch changes."""
    names = {item.name for item in drawn}
    sampler = Sampler(
        scenario.seed,
        [(item.name, max(item.dimension, 1)) for item in drawn],
        scenario.sampling.plan,
        total=realisations,
        correlations=[
            row for row in scenario.sampling.correlation if row[0] in names and row[1] in names
        ],
    )
    values = {key: np.empty(realisations) for item in drawn for key in item.keys}
    for first in range(0, realisations, BLOCK):
        count = min(BLOCK, realisations - first)
        uniforms = sampler.uniforms(first, count)
        for item in drawn:
            found = _quantiles(item, uniforms[item.name])
            for column, key in enumerate(item.keys):
                values[key][first : first + count] = found[:, column]
    return values


def _quantiles(item: RandomInput, uniform: FloatArray) -> FloatArray:
    if item.role == "process":
        return item.scalar.quantile(uniform[:, 0])[:, None]
    return item.values(uniform)
