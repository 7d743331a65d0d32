"""The random inputs of one run: what holds for the test and its rollers, and paths in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from wearsim.errors import CapabilityError, Problem, ScenarioError
from wearsim.evolution.inputs import Varying
from wearsim.mechanics.piecewise import PiecewiseLinear
from wearsim.plugins import JointDistribution, Process, Uniforms
from wearsim.randomness.sampler import Sampler
from wearsim.randomness.streams import Stream
from wearsim.scenario import RandomInput, Scenario, realise
from wearsim.scenario.random_inputs import CONTACT_FIELDS
from wearsim.types import FloatArray

LISTED = {"roller.offset", "creepage.yaw", "creepage.tilt"}  # may stand as one value per roller
LONGEST_PATH = 5_000_000  # samples of a process
RARE = 1e-7  # part of the passes that may lie beyond what the strips are laid out for


@dataclass(frozen=True)
class Draws:
    """One realisation of a scenario's random inputs.

    Parameters
    ----------
    scenario : Scenario
        With what is drawn for a test as a whole in place; the rest at its mean.
    rollers : mapping of str to ndarray, shape (rollers,)
        What is drawn for each roller and has no place in the scenario, by field of `ContactInputs`.
    varying : tuple of Varying
        Processes; their rollers are the scenario's.
    passes : tuple of RandomInput
        What is drawn anew at every pass.
    """

    scenario: Scenario
    rollers: Mapping[str, FloatArray] = field(default_factory=dict)
    varying: tuple[Varying, ...] = ()
    passes: tuple[RandomInput, ...] = ()

    @property
    def tells_rollers_apart(self) -> bool:
        """Whether rollers that the scenario calls alike have inputs of their own."""
        count = self.scenario.operation.rollers
        return bool(self.rollers) or any(len(v.rollers) < count for v in self.varying)

    def lasting(self, name: str, mean: float) -> float:
        """Return the greatest size that an input of a contact has over the whole test.

        Parameters
        ----------
        name : str
            Field of `ContactInputs`.
        mean : float
            The value where nothing is drawn, which is also the mean of what every pass draws.
        """
        time = self.scenario.total_time
        means = [item.path.mean(0.0, time) for item in self.varying if item.name == name]
        values = [mean, *self.rollers.get(name, ()), *means]
        return max(abs(float(value)) for value in values)

    def range_of(self, name: str, mean: float) -> tuple[float, float]:
        """Return about the least and greatest value that an input of a contact takes.

        Parameters
        ----------
        name : str
            Field of `ContactInputs`.
        mean : float
            The value where nothing is drawn.
        """
        values = [mean, *self.rollers.get(name, ())]
        for item in self.varying:
            if item.name == name:
                values += [float(item.path.value.min()), float(item.path.value.max())]
        for random in self.passes:
            for key, spread in zip(random.keys, _spreads(random), strict=True):
                if CONTACT_FIELDS[key] == name:
                    values += spread
        return min(values), max(values)


def _spreads(item: RandomInput) -> list[list[float]]:
    """Return the range of each value that an input sets; a load's is counted from its mean."""
    if isinstance(item.distribution, JointDistribution):
        return [[-reach, reach] for reach in item.distribution.reach]
    low, high = item.scalar.quantile(np.array([RARE, 1.0 - RARE]))
    mean = origin(item.name, item.mean[0])
    return [[float(low) - mean, float(high) - mean]]


def origin(key: str, mean: float) -> float:
    """Return what values of a key are counted from: a load adds to the scene's own, at its mean."""
    return mean if key == "load.normal_force" else 0.0


def draw(scenario: Scenario) -> Draws:
    """Draw the random inputs of the realisation that a scenario asks for.

    Parameters
    ----------
    scenario : Scenario

    Returns
    -------
    Draws

    Raises
    ------
    ScenarioError
        If the plan has no single realisation, or a process is far too fast.
    CapabilityError
        If there is a friction field, which is a matter of one contact.
    """
    if not scenario.random:
        return Draws(scenario)
    _refuse(scenario)
    lasting = _lasting(scenario)
    values = _lasting_values(scenario, lasting)
    listed = {
        key: tuple(float(number) for number in array) if array.ndim else float(array)
        for key, array in values.items()
        if array.ndim == 0 or key in LISTED
    }
    means = {item.name: item.mean[0] for item in lasting}
    rollers = {
        CONTACT_FIELDS[key]: array - origin(key, means[key])
        for key, array in values.items()
        if key not in listed
    }
    return Draws(
        scenario=realise(scenario, listed) if listed else scenario,
        rollers=rollers,
        varying=_varying(scenario),
        passes=tuple(item for item in scenario.random if item.persistence == "per-pass"),
    )


def drawn_values(scenario: Scenario) -> dict[str, dict[str, object]]:
    """Return what is drawn for the test and its rollers, as plain values for a results file.

    Parameters
    ----------
    scenario : Scenario

    Returns
    -------
    dict of str to dict
        By the scenario's key: `values`, one for the test or one per roller, and their SI `unit`.
    """
    lasting = _lasting(scenario)
    if not lasting:
        return {}
    units = {
        key: item.quantity.kind.unit if item.quantity else "1"
        for item in lasting
        for key in item.keys
    }
    return {
        key: {"values": np.atleast_1d(value).tolist(), "unit": units[key]}
        for key, value in _lasting_values(scenario, lasting).items()
    }


def _lasting(scenario: Scenario) -> list[RandomInput]:
    """Return the inputs that are drawn once for the test or once for each roller."""
    return [
        item
        for item in scenario.random
        if item.role in {"scalar", "joint"} and item.persistence != "per-pass"
    ]


def _refuse(scenario: Scenario) -> None:
    """Refuse what a run cannot draw."""
    if scenario.sampling.plan == "latin-hypercube":
        problem = Problem(
            "sampling",
            "plan",
            "a Latin hypercube belongs to a study of many realisations, and a run takes one",
            '"latin-hypercube"',
            '"monte-carlo" or "sobol"',
        )
        raise ScenarioError(scenario.file, [problem])
    for item in scenario.random:
        if item.role == "field":
            raise CapabilityError(
                f"{scenario.file}: {item.name} is a field, {item.kind}, which is resolved within"
                " one contact by `wearsim dissipation`; a run takes a distribution with a"
                " persistence, such as its marginal"
            )


def _lasting_values(scenario: Scenario, items: Sequence[RandomInput]) -> dict[str, FloatArray]:
    """Return the draws for the test, of no axis, and for its rollers, (rollers,), by key."""
    numbers = range(scenario.operation.rollers)
    names = {
        item: [item.name]
        if item.persistence == "per-test"
        else [f"{item.name}@{number}" for number in numbers]
        for item in items
    }
    kinds = {item.name: item for item in items}
    correlations = [
        (one, other, rank)
        for first, second, rank in scenario.sampling.correlation
        if first in kinds and second in kinds
        for one, other in zip(names[kinds[first]], names[kinds[second]], strict=True)
    ]
    inputs = [(name, item.dimension) for item in items for name in names[item]]
    sampler = Sampler(scenario.seed, inputs, scenario.sampling.plan, correlations=correlations)
    uniforms = sampler.uniforms(scenario.sampling.realisation, 1)
    values = {}
    for item in items:
        found = np.concatenate([item.values(uniforms[name]) for name in names[item]])
        for column, key in enumerate(item.keys):
            whole = item.persistence == "per-test"
            values[key] = found[0, column] if whole else found[:, column]
    return {key: np.asarray(value) for key, value in values.items()}


def _varying(scenario: Scenario) -> tuple[Varying, ...]:
    """Return the paths of the processes over the whole test."""
    everyone = tuple(range(scenario.operation.rollers))
    found = []
    for item in scenario.random:
        process = item.distribution
        if not isinstance(process, Process):
            continue
        points = int(np.ceil(scenario.total_time / process.spacing)) + 2
        if points > LONGEST_PATH:
            table, key = item.name.rsplit(".", 1)
            problem = Problem(
                table,
                key,
                f"the process would take {points:,} steps of {process.spacing:.3g} s over the test",
                None,
                'a longer correlation_time, or persistence = "per-pass" in place of a process',
            )
            raise ScenarioError(scenario.file, [problem])
        groups = [everyone] if item.persistence == "per-test" else [(r,) for r in everyone]
        for block, group in enumerate(groups):
            stream = Stream(scenario.seed, item.name, "process")
            path = process.path(points, _uniforms(stream, scenario.sampling.realisation, block))
            times = process.spacing * np.arange(points, dtype=np.float64)
            value = path - origin(item.name, item.mean[0])
            found.append(Varying(CONTACT_FIELDS[item.name], group, PiecewiseLinear(times, value)))
    return tuple(found)


def _uniforms(stream: Stream, realisation: int, block: int) -> Uniforms:
    return lambda first, count: stream.uniforms(first, count, realisation, block)
