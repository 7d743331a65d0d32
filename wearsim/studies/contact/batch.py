"""Realisations of one contact: gaps and operating points, local friction, and solutions."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import (
    CapabilityError,
    ContactError,
    SolverError,
    WearsimError,
    mistake_in,
)
from wearsim.evolution.contacts import unworn_contacts
from wearsim.evolution.problem import WearProblem
from wearsim.plugins import ContactModel, ContactModelSpec, FrictionField, registry
from wearsim.report.text import with_unit
from wearsim.scenario import RandomInput, Scenario, realise
from wearsim.scenario.parse.fields import is_axial
from wearsim.studies.contact.single import study_contact
from wearsim.studies.failures import explained
from wearsim.studies.run.assemble import build_problem, prepared_model, surfaces
from wearsim.studies.run.draws import Drawer, units_of
from wearsim.studies.run.grid import realisation_grid, wider_grid
from wearsim.studies.run.inputs import (
    FIELDS,
    contact_values,
)
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray
from wearsim.uq.sampling.sobol import Stream

_MAX_POINTS = 2**20  # upper limit of the search for a sufficient number
# probabilities between the extremes at which a random option of the load is tried
_BETWEEN = np.array([0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99])


class LocalFriction:
    """The friction field of a scenario.

    Parameters
    ----------
    scenario : Scenario
    model : ContactModel
    item : RandomInput
        The field.

    Raises
    ------
    CapabilityError
        If the model supports no friction field, or the creepage is not prescribed.
    """

    def __init__(self, scenario: Scenario, model: ContactModel, item: RandomInput) -> None:
        if not isinstance(item.distribution, FrictionField):
            raise TypeError(f"{item.name} is no field")
        self._scenario, self._item, self._field = scenario, item, item.distribution
        self._stream = Stream(scenario.seed, item.name, "field")
        if not model.capabilities.friction_field:
            specs = (
                registry().get(ContactModelSpec, name)
                for name in registry().names(ContactModelSpec)
            )
            able = [spec for spec in specs if spec.capabilities.friction_field]
            names = [f"'{spec.name}'" for spec in sorted(able, key=lambda spec: spec.reference)]
            models = f"contact.model = {' or '.join(names)}" if names else "another distribution"
            raise CapabilityError(
                f"{scenario.file}: contact model '{scenario.contact.model}' does not support"
                f" friction that varies within the contact, {item.name} with distribution ="
                f" '{item.kind}'; choose {models}"
            )
        if scenario.creepage.drive != "creepage":
            raise CapabilityError(
                f"{scenario.file}: a friction field, {item.name}, requires prescribed creepage; set"
                " creepage.drive = 'creepage', or give the friction a distribution"
            )

    def check(self, x: FloatArray, spacing: float) -> None:
        """Check that points resolve the field.

        Parameters
        ----------
        x : ndarray, shape (points, strips)
            Positions along rolling in the longest contact [m].
        spacing : float
            Width of a strip [m].

        Raises
        ------
        ScenarioError
            If the points are too far apart.
        """
        # the first point is one spacing behind the leading edge, the last at the trailing edge
        along = float(2.0 * np.abs(x).max() / len(x))
        mistake = self._field.unresolved(along, spacing)
        if mistake is not None:
            table, key = self._item.name.split(".", 1)
            remedy = finer_grid(self._scenario, self._field, len(x), along, spacing)
            raise mistake_in(
                self._scenario.file, mistake, self._item.describe(), remedy, table=table, key=key
            )

    def put(self, batch: ContactBatch, x: FloatArray, y: FloatArray, first: int) -> ContactBatch:
        """Return the contacts of consecutive realisations with their local friction.

        Parameters
        ----------
        batch : ContactBatch
        x : ndarray, shape (contacts, points, strips)
            Positions along rolling, from the leading edge [m].
        y : ndarray, shape (strips,)
            Axial position [m].
        first : int
            The first realisation.
        """
        friction = np.empty_like(x)
        for row in range(len(x)):
            friction[row] = self._field.values(
                x[row], y, partial(self._stream.uniforms, realisation=first + row)
            )
        return replace(batch, friction=friction, friction_carried=self._field.frame != "contact")


def finer_grid(
    scenario: Scenario, friction: FrictionField, points: int, along: float, across: float
) -> str:
    """Return the settings for which a grid resolves a friction field.

    Parameters
    ----------
    scenario : Scenario
    friction : FrictionField
    points : int
        Points along rolling in each strip.
    along, across : float
        Their spacing, and the width of a strip [m].

    Returns
    -------
    str
        "contact.my = 124": key and least value for either direction that is too coarse.
    """
    choice, settings = scenario.contact, []
    if friction.unresolved(along, 0.0) is not None:
        needed = _least(points, lambda count: friction.unresolved(along * points / count, 0.0))
        by_key, in_words = f"contact.mx = {needed}", f"{needed} points along rolling"
        settings.append(by_key if hasattr(choice.options, "mx") else in_words)
    if friction.unresolved(0.0, across) is not None:
        strips = choice.strips or getattr(choice.options, "my", None)
        if strips is None:
            settings.append("more contact.strips")
        else:
            needed = _least(strips, lambda count: friction.unresolved(0.0, across * strips / count))
            settings.append(f"contact.{'strips' if choice.strips else 'my'} = {needed}")
    return " and ".join(settings)


def _least(count: int, unresolved: Callable[[int], str | None]) -> int:
    """Return the least resolving count above one that does not resolve."""
    counts = range(count + 1, _MAX_POINTS)
    return count + 1 + bisect_left(counts, True, key=lambda points: unresolved(points) is None)


def _is_wider_than_profile(scenario: Scenario) -> bool:
    """Return whether the contact with every input at its mean is wider than the profile."""
    try:
        return study_contact(scenario).widened
    except WearsimError:
        return False


class Realisations:
    """One contact of a scenario for every realisation of its random inputs.

    The contact belongs to the first roller on the cylinder at the start of the load. A realisation
    does not depend on others of its batch, except that all share the strips.

    Parameters
    ----------
    scenario : Scenario
    count : int
        Number of realisations.

    Raises
    ------
    ScenarioError
        If the strips or the points within a contact are unsuitable for the random inputs.
    CapabilityError
        If the contact model does not support the scenario.
    """

    def __init__(self, scenario: Scenario, count: int) -> None:
        self.scenario, self.count = scenario, count
        if scenario.cam is not None:
            raise mistake_in(
                scenario.file,
                "has many contacts, and this study solves one",
                expected="wearsim cam for its contacts, or wearsim ensemble",
                table="cam",
            )
        self._setup = setup = Setup(scenario)
        mean_load = setup.load_range(0.0)[0]
        self._once, field, self.notes = acting_inputs(scenario)
        drawer = Drawer(self._once, scenario.sampling.plan, count)
        self.values, self.units = drawer.columns(0, count), units_of(self._once)
        drawn = self._drawn(slice(None))
        self.loads = np.full(count, mean_load) + drawn.get("normal_force_offset", 0.0)
        centres = setup.positions_of(setup.inputs_of([0], drawn))
        self.grid = realisation_grid(setup, mean_load, self.loads, centres)
        if scenario.cylinder.profile is not None and _is_wider_than_profile(scenario):
            shift = float(np.ptp(centres))
            self.grid = wider_grid(setup, self.grid, float(self.loads.max()), shift) or self.grid
        self.model = prepared_model(scenario, self.grid)
        self._field = LocalFriction(scenario, self.model, field) if field is not None else None
        self.friction_points = 0 if self._field is None else self._checked_points(self._field)

    def solve(self, first: int, count: int) -> ContactBatchSolution:
        """Solve consecutive realisations.

        Parameters
        ----------
        first, count : int
            The first realisation, counted from 0, and their number.

        Raises
        ------
        ContactError
            If one of them has no solution, with its number and its random inputs.
        """
        try:
            return self._solve(slice(first, first + count))
        except SolverError:
            for number in range(first, first + count):
                try:
                    self._solve(slice(number, number + 1))
                except SolverError as error:
                    raise self._failure(number, error) from error
            raise  # no single realisation fails

    def solve_mean_problem(self) -> ContactBatchSolution:
        """Solve the contact with every input at its mean."""
        return self.model.solve(
            unworn_contacts(build_problem(self._setup, self.model, self.grid, {}))
        )

    def _drawn(self, part: slice) -> dict[str, FloatArray]:
        """Return the drawn inputs of some realisations by the names of `contact_values`."""
        return contact_values(
            self._once.random,
            {key: column[part] for key, column in self.values.items() if not is_axial(key)},
        )

    def _contacts(self, part: slice) -> ContactBatch:
        """Return the contacts of some realisations."""
        drawn, count = self._drawn(part), part.stop - part.start
        drawn = {name: values[None] for name, values in drawn.items()}
        problem = build_problem(self._setup, self.model, self.grid, drawn, realisations=count)
        forms = {key: column[part] for key, column in self.values.items() if is_axial(key)}
        return unworn_contacts(self._with_forms(problem, drawn, forms) if forms else problem)

    def _with_forms(
        self, problem: WearProblem, drawn: dict[str, FloatArray], forms: dict[str, FloatArray]
    ) -> WearProblem:
        """Return the problem with the drawn forms of the bodies along the axis."""
        count = problem.shape[2]
        offsets = np.broadcast_to(self._setup.inputs_of([0], drawn)["offset"], (1, count))
        drawn_forms = (
            {key: float(column[number]) for key, column in forms.items()} for number in range(count)
        )
        parts = [
            surfaces(realise(self._once, values), [0], offsets[:, number : number + 1], self.grid)
            for number, values in enumerate(drawn_forms)
        ]

        def joined(name: str, axis: int) -> FloatArray | None:
            """Return an array of all realisations, None if there is none."""
            arrays = [getattr(part, name) for part in parts]
            return None if arrays[0] is None else np.concatenate(arrays, axis=axis)

        return replace(
            problem,
            flat_gap=np.concatenate([part.gap for part in parts], axis=2),
            roller_drop=joined("roller_drop", 1),
            slip_profile=joined("slip_profile", 2),
        )

    def _solve(self, part: slice) -> ContactBatchSolution:
        batch = self._contacts(part)
        if self._field is not None and batch.bearing_torque is None:
            batch = self._field.put(batch, *self.model.friction_points(batch), part.start)
        return self.model.solve(batch)

    def _checked_points(self, field: LocalFriction) -> int:
        """Check that the points of a strip resolve the friction field; return their number."""
        heaviest = int(np.argmax(self.loads))
        try:
            x, _ = self.model.friction_points(self._contacts(slice(heaviest, heaviest + 1)))
        except SolverError as error:
            raise self._failure(heaviest, error) from error
        field.check(x[0], self.grid.spacing)
        return int(x.shape[1])

    def _failure(self, number: int, error: SolverError) -> ContactError:
        """Return the error of one realisation, with its random inputs."""
        drawn = ", ".join(
            f"{key} {with_unit(f'{values[number]:.6g}', unit)}"
            for (key, values), unit in zip(self.values.items(), self.units.values(), strict=True)
        )
        return ContactError(
            f"realisation {number} of seed {self.scenario.seed} has no solution:"
            f" {explained(error, self.scenario)}"
            f"\nits inputs: {drawn or 'none except the friction field'}",
            error.state,
        )


def acting_inputs(
    scenario: Scenario,
) -> tuple[Scenario, RandomInput | None, tuple[str, ...]]:
    """Return the random inputs that change one contact at the start of its load.

    Returns
    -------
    once : Scenario
        The scenario with those inputs only, each drawn once per realisation; a process is
        represented by its marginal distribution.
    field : RandomInput or None
        The friction field.
    notes : tuple of str
        Names of the inputs without effect.

    Raises
    ------
    ScenarioError
        If an option of the load other than its force is random and changes the force.
    """
    acting = [item for item in scenario.random if _acts(scenario, item)]
    idle = [item.name for item in scenario.random if item not in acting]
    have = f"{', '.join(idle)} {'have' if len(idle) > 1 else 'has'}"
    drawn = tuple(
        replace(item, persistence="per-test", distribution=item.scalar)
        if item.role == "process"
        else replace(item, persistence="per-test")
        for item in acting
        if item.role != "field"
    )
    return (
        replace(scenario, random=drawn),
        next((item for item in acting if item.role == "field"), None),
        (f"{have} no effect on the dissipation of a contact: not drawn",) if idle else (),
    )


def _acts(scenario: Scenario, item: RandomInput) -> bool:
    """Return whether a random input changes one contact at the start of its load."""
    if set(item.keys) <= FIELDS.keys() or is_axial(item.name):
        return True
    if not item.name.startswith("load."):
        return False
    values = {*item.extremes, *item.scalar.quantile(_BETWEEN).tolist()}
    loads = (realise(scenario, {item.name: value}).load.built for value in values)
    if len({float(load.force(np.zeros(1))[0]) for load in loads}) == 1:
        return False
    table, key = item.name.split(".", 1)
    mean = item.mean[0]
    raise mistake_in(
        scenario.file,
        "changes the load of the contact, and only load.normal_force can be random here",
        item.kind,
        f"one value, such as {item.quantity.write(mean) if item.quantity else f'{mean:g}'}",
        table=table,
        key=key,
    )
