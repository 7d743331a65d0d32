"""Realisations of one contact: gaps and operating points from random inputs, and solutions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import ContactError, Mistake, ScenarioError, SolverError
from wearsim.evolution.state import unworn_contacts
from wearsim.scenario import RandomInput, Scenario, realise
from wearsim.studies.contact.friction_field import LocalFriction
from wearsim.studies.run.assemble import build_problem, check_model, prepared_model
from wearsim.studies.run.draws import Drawer, units_of
from wearsim.studies.run.grid import (
    MOST_STRIPS,
    contact_centre,
    contact_grid,
    contact_positions,
    fresh_patch,
    suggested_grid,
)
from wearsim.studies.run.inputs import (
    FIELDS,
    OFFSET,
    TILT,
    contact_inputs,
    contact_values,
    load_range,
)
from wearsim.types import FloatArray, Grid

_MARGIN = 1e-9  # of a patch, against rounding at the outer edges
_ROUNDING = 1e-12
# probabilities between the extremes at which a random option of the load is tried
_BETWEEN = np.array([0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99])


class Realisations:
    """One contact of a scenario for every realisation of its random inputs.

    The contact is that of the first roller on the cylinder at the start of the load. A realisation
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
        mean_load = load_range(scenario, scenario.load.build(), 0.0)[0]
        self._once, field, self.notes = acting_inputs(scenario)
        drawer = Drawer(self._once, scenario.sampling.plan, count, replicates=1)
        self.values, self.units = drawer.columns(0, count), units_of(self._once)
        drawn = self._drawn(slice(None))
        self.loads = np.full(count, mean_load) + drawn.get("normal_force_offset", 0.0)
        centres = contact_positions(scenario, contact_inputs(scenario, [0], drawn))
        self.grid = realisation_grid(scenario, mean_load, self.loads, centres)
        self.model = prepared_model(scenario, self.grid)
        check_model(scenario, self.model)
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
        problem = build_problem(self.scenario, self.model, self.grid, {})
        return self.model.solve(unworn_contacts(problem))

    def _drawn(self, part: slice) -> dict[str, FloatArray]:
        """Return the drawn inputs of some realisations by the names of `contact_values`."""
        values = {key: column[part] for key, column in self.values.items()}
        return contact_values(self._once.random, values)

    def _contacts(self, part: slice) -> ContactBatch:
        """Return the contacts of some realisations."""
        drawn = {name: values[None] for name, values in self._drawn(part).items()}
        count = part.stop - part.start
        problem = build_problem(self.scenario, self.model, self.grid, drawn, realisations=count)
        return unworn_contacts(problem)

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
            f"{key} {values[number]:.6g}" + (f" {unit}" if unit != "1" else "")
            for (key, values), unit in zip(self.values.items(), self.units.values(), strict=True)
        )
        return ContactError(
            f"realisation {number} of seed {self.scenario.seed} has no solution: {error}"
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
    verb = "have" if len(idle) > 1 else "has"
    note = f"{', '.join(idle)} {verb} no effect on the dissipation of a contact: not drawn"
    drawn = tuple(
        replace(item, persistence="per-test", distribution=item.scalar)
        if item.role == "process"
        else replace(item, persistence="per-test")
        for item in acting
        if item.role != "field"
    )
    field = next((item for item in acting if item.role == "field"), None)
    return replace(scenario, random=drawn), field, (note,) if idle else ()


def _acts(scenario: Scenario, item: RandomInput) -> bool:
    """Return whether a random input changes one contact at the start of its load."""
    if set(item.keys) <= FIELDS.keys():
        return True
    if not item.name.startswith("load."):
        return False
    values = {*item.extremes, *item.scalar.quantile(_BETWEEN).tolist()}
    start = np.zeros(1)
    forces = {
        float(realise(scenario, {item.name: value}).load.build().force(start)[0])
        for value in values
    }
    if len(forces) == 1:
        return False
    table, key = item.name.split(".", 1)
    mean = item.mean[0]
    written = str(item.quantity.write(mean)) if item.quantity else f"{mean:g}"
    what = "changes the load of the contact, and only load.normal_force can be random here"
    expected = f"one value, such as {written}"
    raise ScenarioError(scenario.file, [Mistake(table, key, what, item.kind, expected)])


def realisation_grid(
    scenario: Scenario, load: float, loads: FloatArray, centres: FloatArray
) -> Grid:
    """Return strips that cover the contacts of all realisations.

    The strips of the contact with every input at its mean are those that the model suggests, and
    further strips of the same width cover the others.

    Parameters
    ----------
    scenario : Scenario
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
    choice, mean_b = scenario.contact, fresh_patch(scenario, load).b
    half_widths = mean_b * np.cbrt(np.maximum(loads, 0.0) / load)
    centre = contact_centre(scenario, [0])
    away = np.abs(centres - centre)
    if choice.width is not None:
        needed = 2.0 * float((away + half_widths).max())
        if choice.width < needed * (1.0 - _MARGIN):
            mistake = Mistake(
                "contact",
                "width",
                "the contacts of all realisations do not fit",
                f"{choice.width * 1e3:.4g} mm",
                f"at least {needed * 1e3:.4g} mm",
            )
            raise ScenarioError(scenario.file, [mistake])
    if choice.width is not None or scenario.cylinder.profile is not None:
        return contact_grid(scenario, load)
    grid = suggested_grid(scenario, load)
    if grid is None:
        grid = Grid.spanning(-1.2 * mean_b, 1.2 * mean_b, 121)
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
            if len(shifting) == 1 and scenario.contact.centre is None:
                crown = scenario.roller.crown_radius
                angle = f"{away / crown * 1e3:.4g} mrad"
                shift += f", crown radius x tilt = {crown * 1e3:.4g} mm x {angle}"
        expected = f"{less}, or {coarser}"
        mistakes.append(Mistake(table, key, f"{shift}: {takes}", item.describe(), expected))
    if not mistakes:
        expected = f"{coarser}, or inputs that vary less"
        mistakes.append(Mistake("contact", "strips", takes, None, expected))
    return ScenarioError(scenario.file, mistakes)
