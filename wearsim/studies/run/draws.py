"""Random inputs of tests and contacts: values by realisation, and processes in time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from wearsim.errors import CapabilityError, mistake_in
from wearsim.evolution.quantities import Varying
from wearsim.mechanics.numerics.piecewise_linear import Paths
from wearsim.plugins import Process
from wearsim.scenario import RandomInput, Scenario, realise, require_run
from wearsim.scenario.parse.fields import CONTACT_FIELDS
from wearsim.studies.run.inputs import OFFSET, TILT, YAW, contact_values, origin
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray
from wearsim.uq.sampling.sampler import BELOW_ONE, REPLICATES, PlanName, Sampler
from wearsim.uq.sampling.sobol import Stream

LISTED = {OFFSET, YAW, TILT}  # a scenario may give one per roller
LONGEST_PATH = 5_000_000  # samples of a process
BLOCK = 4096  # realisations that are drawn at once
AHEAD = 64  # realisations drawn with one after the first; they are usually the next ones


def draw(scenario: Scenario) -> Setup:
    """Draw the random inputs of the realisation that is selected in a scenario.

    Parameters
    ----------
    scenario : Scenario

    Returns
    -------
    Setup

    Raises
    ------
    ScenarioError
        If the scenario lacks values that a run requires, if the plan does not define single
        realisations, or if the path of a process would be too long.
    CapabilityError
        If there is a friction field, which requires the study of one contact.
    """
    require_run(scenario)
    if not scenario.random:
        return Setup(scenario)
    if scenario.sampling.plan == "latin-hypercube":
        raise mistake_in(
            scenario.file,
            "a Latin hypercube requires a study of many realisations, and a run is one",
            '"latin-hypercube"',
            '"monte-carlo" or "sobol"',
            table="sampling",
            key="plan",
        )
    return Drawer(scenario, scenario.sampling.plan).draw(scenario.sampling.realisation)


class Drawer:
    """Sampler of the random inputs of a scenario by realisation.

    Parameters
    ----------
    scenario : Scenario
    plan : str
        Name of a plan of `wearsim.uq.sampling.sampler`.
    total : int, optional
        Realisations of the whole plan, where it depends on their number.
    replicates : int
        Number of independent, alternating sequences of the plan "sobol".
    fixed : mapping of str to float, optional
        Values with which tests are run instead of those drawn, by key [SI].
    shift : mapping of str to float, optional
        Added to the normal scores of the uniform numbers, by name of the input.
    changes : mapping of int to (int, float), optional
        Realisations whose normal scores are changes of those of others: number of the other, and
        scale. They are sqrt(1 - scale^2) times its scores, plus scale times their own.

    Raises
    ------
    CapabilityError
        If there is a friction field, which requires the study of one contact.
    """

    def __init__(
        self,
        scenario: Scenario,
        plan: PlanName,
        total: int | None = None,
        replicates: int = REPLICATES,
        fixed: Mapping[str, float] | None = None,
        shift: Mapping[str, float] | None = None,
        changes: Mapping[int, tuple[int, float]] | None = None,
    ) -> None:
        self._fixed, self._shift = dict(fixed or {}), dict(shift or {})
        self._changes = dict(changes or {})
        for item in scenario.random:
            if item.role == "field":
                raise CapabilityError(
                    f"{scenario.file}: {item.name} is a field, {item.kind}, which is resolved"
                    " within one contact by `wearsim dissipation`; a run takes a distribution with"
                    " a persistence, such as its marginal"
                )
        self.scenario = scenario
        self.items = [
            item
            for item in scenario.random
            if item.role in {"scalar", "joint"} and not item.is_redrawn
        ]
        self._processes = [item for item in scenario.random if item.role == "process"]
        self._names = {
            item.name: [item.name]
            if item.persistence == "per-test"
            else [f"{item.name}@{number}" for number in range(scenario.operation.rollers)]
            for item in self.items
        }
        self._sampler = Sampler(
            scenario.seed,
            [(name, item.dimension) for item in self.items for name in self._names[item.name]],
            plan,
            total,
            correlations=[
                (first_name, other, rank)
                for first, second, rank in scenario.sampling.correlation
                if first in self._names and second in self._names
                for first_name, other in zip(self._names[first], self._names[second], strict=True)
            ],
            replicates=replicates,
        )
        self._total = total or math.inf
        self._drawn: dict[int, dict[str, FloatArray]] = {}

    @property
    def groups(self) -> list[str]:
        """Names of the inputs that differ between realisations; without per-pass inputs."""
        return [
            item.name
            for item in self.scenario.random
            if item.role == "process" or not item.is_redrawn
        ]

    def draw(
        self,
        realisation: int,
        sources: Mapping[str, int] | None = None,
        passes: int | None = None,
    ) -> Setup:
        """Return the draws of one realisation.

        Parameters
        ----------
        realisation : int
        sources : mapping of str to int, optional
            Number of the realisation from which an input is drawn, where it is another.
        passes : int, optional
            Number of the realisation from which per-pass inputs are drawn, where it is another.

        Returns
        -------
        Setup

        Raises
        ------
        ScenarioError
            If a value is out of its bounds, or the path of a process would be too long.
        """
        number = realisation if passes is None else passes
        scenario, table = self.scenario, self.scenario.sampling
        if number != table.realisation:
            scenario = replace(scenario, sampling=table.model_copy(update={"realisation": number}))
        numbers = {**{item.name: realisation for item in scenario.random}, **(sources or {})}
        drawn = {n: self._values(n) for n in sorted({numbers[item.name] for item in self.items})}
        values = {key: drawn[numbers[item.name]][key] for item in self.items for key in item.keys}
        listed = {
            key: tuple(float(value) for value in array) if array.ndim else float(array)
            for key, array in values.items()
            if array.ndim == 0 or key in LISTED
        }
        listed.update(self._fixed)
        unlisted = {key: array for key, array in values.items() if key not in listed}
        paths = {item: _paths(scenario, item, numbers[item.name]) for item in self._processes}
        return Setup(
            scenario=realise(scenario, listed) if listed else scenario,
            rollers=contact_values(self.items, unlisted),
            varying=tuple(path for of_input in paths.values() for path in of_input),
            passes=tuple(item for item in scenario.random if item.is_redrawn),
            values=values,
            time_means={
                item.name: _means(scenario, item, of_input) for item, of_input in paths.items()
            },
        )

    def _values(self, realisation: int) -> dict[str, FloatArray]:
        """Return the values of one realisation, as `columns`, drawn with those after it."""
        if realisation not in self._drawn:
            count = int(min(AHEAD if self._drawn else 1, max(self._total - realisation, 1)))
            columns = self.columns(realisation, count)
            if len(self._drawn) > BLOCK:
                self._drawn = {}
            self._drawn |= {
                realisation + place: {key: np.asarray(of[place]) for key, of in columns.items()}
                for place in range(count)
            }
        return self._drawn[realisation]

    def uniforms(self, first: int, count: int) -> dict[str, FloatArray]:
        """Return the uniform numbers of consecutive realisations by name, (count, dimension)."""
        uniforms = self._sampler.uniforms(first, count)
        for place in [k for k in range(count) if first + k in self._changes]:
            for name, numbers in self._changed(first + place).items():
                uniforms[name][place] = numbers
        for name, shift in self._shift.items():
            uniforms[name] = _uniform(scipy.special.ndtri(uniforms[name]) + shift)
        return uniforms

    def _changed(self, realisation: int) -> dict[str, FloatArray]:
        """Return the uniform numbers of a realisation that is a change of others, (dimension,)."""
        line = [realisation]
        while line[-1] in self._changes:
            line.append(self._changes[line[-1]][0])
        scores: dict[str, FloatArray] = {}
        for number in reversed(line):
            fresh = {
                name: scipy.special.ndtri(u[0])
                for name, u in self._sampler.uniforms(number, 1).items()
            }
            _, scale = self._changes.get(number, (number, 1.0))
            part = math.sqrt(1.0 - scale**2)
            scores = {n: part * scores[n] + scale * z if scores else z for n, z in fresh.items()}
        return {name: _uniform(z) for name, z in scores.items()}

    def columns(self, first: int, count: int) -> dict[str, FloatArray]:
        """Return the values drawn for whole tests and rollers in consecutive realisations.

        Parameters
        ----------
        first, count : int
            The first realisation, and their number.

        Returns
        -------
        dict of str to ndarray, shape (count,) or (count, rollers)
            By the scenario's key, in SI.
        """
        columns = {
            key: np.empty(
                count if item.persistence == "per-test" else (count, len(self._names[item.name]))
            )
            for item in self.items
            for key in item.keys
        }
        for start in range(0, count, BLOCK):
            stop = min(start + BLOCK, count)
            uniforms = self.uniforms(first + start, stop - start)
            for item in self.items:
                for roller, name in enumerate(self._names[item.name]):
                    values = item.values(uniforms[name])
                    for number, key in enumerate(item.keys):
                        columns[key].reshape(count, -1)[start:stop, roller] = values[:, number]
        return columns


def _uniform(score: FloatArray) -> FloatArray:
    """Return the uniform numbers of normal scores."""
    return np.clip(scipy.special.ndtr(score), 1.0 - BELOW_ONE, BELOW_ONE)


def units_of(scenario: Scenario) -> dict[str, str]:
    """Return the SI unit of every value that random inputs set, by the scenario's key."""
    return {
        key: item.quantity.kind.unit if item.quantity else "1"
        for item in scenario.random
        for key in item.keys
    }


def _paths(scenario: Scenario, item: RandomInput, realisation: int) -> list[Varying]:
    """Return the paths of a process over the whole test, one or one for each roller."""
    process = item.distribution
    if not isinstance(process, Process):
        raise TypeError(f"{item.name} is no process")
    points = int(np.ceil(scenario.total_time / process.spacing)) + 2
    if points > LONGEST_PATH:
        table, key = item.name.rsplit(".", 1)
        raise mistake_in(
            scenario.file,
            f"the process would take {points:,} steps of {process.spacing:.3g} s over the test",
            None,
            'a longer correlation_time, or persistence = "per-pass" instead of a process',
            table=table,
            key=key,
        )
    rollers = tuple(range(scenario.operation.rollers))
    groups = [rollers] if item.persistence == "per-test" else [(r,) for r in rollers]
    times = process.spacing * np.arange(points, dtype=np.float64)
    stream = Stream(scenario.seed, item.name, "process")
    blocks = [
        partial(stream.uniforms, realisation=realisation, block=k) for k in range(len(groups))
    ]
    start = origin(item.name, item.mean[0])
    paths = [Paths.through(times, process.path(points, block) - start) for block in blocks]
    field = CONTACT_FIELDS[item.name]
    return [Varying(field, group, path) for group, path in zip(groups, paths, strict=True)]


def _means(scenario: Scenario, item: RandomInput, paths: list[Varying]) -> FloatArray:
    """Return the mean of a process over the test, one or one for each roller [SI]."""
    start = origin(item.name, item.mean[0])
    whole = np.zeros(1), np.full(1, scenario.total_time)
    means = np.array([path.paths.mean(*whole)[0] + start for path in paths])
    return means if item.persistence == "per-roller" else means[0]
