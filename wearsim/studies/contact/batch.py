"""Realisations of one contact: gaps and operating points from random inputs, and solutions."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from wearsim.contact_batch import BatchSolution, OperatingPoints
from wearsim.errors import ContactError, Mistake, ScenarioError, SolverError
from wearsim.plugins import ContactModel
from wearsim.scenario import Scenario
from wearsim.studies.contact.draws import (
    FRICTION,
    LOAD,
    LONGITUDINAL,
    OFFSET,
    TILT,
    TORQUE,
    YAW,
    draw_contacts,
)
from wearsim.studies.contact.friction_field import LocalFriction
from wearsim.studies.run.assemble import (
    check_model,
    flat_gap,
    load_range,
    slip_profile,
    start_height,
)
from wearsim.studies.run.grid import (
    MOST_STRIPS,
    contact_centres,
    fresh_patch,
    initial_contact_positions,
    profile_grid,
    suggested_grid,
)
from wearsim.types import Creepage, FloatArray, Grid, OperatingPoint

Columns = Mapping[str, FloatArray]
"""Inputs of the contacts by the scenario's key, each of shape (contacts,)."""

_MARGIN = 1e-9  # of a patch, against rounding at the outer edges
_ROUNDING = 1e-12


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
        self.model = scenario.contact.build()
        check_model(scenario, self.model)
        self._load = load_range(scenario, scenario.load.build(), 0.0)[0]
        self.draws = draw_contacts(scenario, count)
        item = self.draws.field
        self._field = LocalFriction(scenario, self.model, item) if item is not None else None
        columns = self._columns(slice(0, count))
        centres = initial_contact_positions(scenario, columns[OFFSET], columns[TILT])
        self.grid = realisation_grid(scenario, self.model, self._load, columns[LOAD], centres)
        self.model.prepare(self.grid, (scenario.cylinder.material, scenario.roller.material))
        self._curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
        self._height = start_height(scenario.cylinder.profile, self.grid)
        self.friction_points = (
            0 if self._field is None else self._checked_points(self._field, columns)
        )

    def loads(self, first: int, count: int) -> FloatArray:
        """Return the loads of consecutive realisations, shape (count,) [N]."""
        return self._columns(slice(first, first + count))[LOAD]

    def solve(self, first: int, count: int) -> BatchSolution:
        """Solve consecutive realisations; leading axes (1, 1, count).

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

    def solve_mean_problem(self) -> BatchSolution:
        """Solve the contact with every input at its mean; leading axes (1, 1, 1)."""
        columns = self._mean_columns()
        return self.model.solve_batch(self._gap(columns), self._curvature, self._points(columns))

    def _mean_columns(self) -> dict[str, FloatArray]:
        scenario, creepage = self.scenario, self.scenario.creepage
        means = {
            LOAD: self._load,
            FRICTION: scenario.friction.coefficient,
            LONGITUDINAL: creepage.longitudinal or 0.0,
            TORQUE: creepage.bearing_torque or 0.0,
            YAW: scenario.per_roller(creepage.yaw)[0],
            TILT: scenario.per_roller(creepage.tilt)[0],
            OFFSET: scenario.per_roller(scenario.roller.offset)[0],
        }
        return {key: np.array([value]) for key, value in means.items()}

    def _columns(self, part: slice) -> dict[str, FloatArray]:
        """Return the inputs of some realisations."""
        drawn, count = self.draws.values, part.stop - part.start
        columns = {key: np.repeat(value, count) for key, value in self._mean_columns().items()}
        columns |= {key: values[part] for key, values in drawn.items()}
        if LOAD in drawn:
            mean = next(item.mean[0] for item in self.scenario.random if item.name == LOAD)
            columns[LOAD] = self._load + (drawn[LOAD][part] - mean)
        return columns

    def _from_apex(self, columns: Columns) -> FloatArray:
        """Return the distance from the roller's apex, (contacts, strips), or (1, strips) [m]."""
        offset = columns[OFFSET] if OFFSET in self.draws.values else columns[OFFSET][:1]
        return np.asarray(self.grid.y - offset[:, None])

    def _gap(self, columns: Columns) -> FloatArray:
        """Return the gaps, (1, 1, contacts, strips) [m]; of stride 0 where all are the same."""
        s, tilt = self._from_apex(columns), columns[TILT]
        gap = flat_gap(self.scenario, s, self._height)
        if self.scenario.creepage.tilt_shifts_contact and tilt.any():
            gap = gap + tilt[:, None] * s
        return np.broadcast_to(gap, (len(tilt), self.grid.strips))[None, None]

    def _variation(self, columns: Columns) -> FloatArray | None:
        """Return the creepage's variation where there is differential slip, (contacts, strips).

        The tilt acts either as the shift of the contact from the apex or, if it does not shift the
        contact, as the spin's -phi y.
        """
        scenario, creepage = self.scenario, self.scenario.creepage
        if not creepage.differential_slip:
            return None
        s = self._from_apex(columns)
        slip = slip_profile(scenario, s, self._height)
        if not creepage.tilt_shifts_contact:
            slip = slip - columns[TILT][:, None] / scenario.roller.radius * s
        return np.array(np.broadcast_to(slip, (len(columns[TILT]), self.grid.strips)))

    def _points(self, columns: Columns) -> OperatingPoints | list[OperatingPoint]:
        roller = self.scenario.roller
        points = OperatingPoints(
            normal_force=columns[LOAD],
            longitudinal=columns[LONGITUDINAL],
            lateral=columns[YAW],
            spin=columns[TILT] / roller.radius,
            friction=columns[FRICTION],
            rolling_speed=self.scenario.rolling_speed,
            variation=self._variation(columns),
        )
        if self.scenario.creepage.drive == "creepage":
            return points
        # a free roller, whose creepage follows from the bearing torque
        s = self._from_apex(columns)
        radius = roller.radius - s * s / (2.0 * roller.crown_radius)
        arms = np.broadcast_to(radius, (len(points), self.grid.strips))
        return [
            OperatingPoint(
                normal_force=point.normal_force,
                rolling_speed=point.rolling_speed,
                creepage=Creepage(
                    0.0, point.creepage.lateral, point.creepage.spin, point.creepage.variation
                ),
                friction=point.friction,
                bearing_torque=float(torque),
                rolling_radius=arm,
            )
            for point, torque, arm in zip(points, columns[TORQUE], arms, strict=True)
        ]

    def _solve(self, part: slice) -> BatchSolution:
        columns = self._columns(part)
        gap, points = self._gap(columns), self._points(columns)
        if self._field is not None and isinstance(points, OperatingPoints):
            x, y = self.model.friction_points_batch(gap, self._curvature, points)
            points = self._field.put(points, x, y, part.start)
        return self.model.solve_batch(gap, self._curvature, points)

    def _checked_points(self, field: LocalFriction, columns: Columns) -> int:
        """Check that the points of a strip resolve the friction field; return their number."""
        heaviest = int(np.argmax(columns[LOAD]))
        single = {key: values[heaviest : heaviest + 1] for key, values in columns.items()}
        try:
            x, _ = self.model.friction_points_batch(
                self._gap(single), self._curvature, self._points(single)
            )
        except SolverError as error:
            raise self._failure(heaviest, error) from error
        field.check(x[0], self.grid.spacing)
        return int(x.shape[1])

    def _failure(self, number: int, error: SolverError) -> ContactError:
        """Return the error of one realisation, with its random inputs."""
        units = self.draws.units
        drawn = ", ".join(
            f"{key} {values[number]:.6g}" + (f" {units[key]}" if units[key] != "1" else "")
            for key, values in self.draws.values.items()
        )
        return ContactError(
            f"realisation {number} of seed {self.scenario.seed} has no solution: {error}"
            f"\nits inputs: {drawn or 'none except the friction field'}",
            error.state,
        )


def realisation_grid(
    scenario: Scenario, model: ContactModel, load: float, loads: FloatArray, centres: FloatArray
) -> Grid:
    """Return strips that cover the contacts of all realisations.

    The strips of the contact with every input at its mean are those that the model suggests, and
    further strips of the same width cover the others.

    Parameters
    ----------
    scenario : Scenario
    model : ContactModel
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
    choice, profile = scenario.contact, scenario.cylinder.profile
    mean_b = fresh_patch(scenario, load).b
    half_widths = mean_b * np.cbrt(np.maximum(loads, 0.0) / load)
    centre = choice.centre if choice.centre is not None else contact_centres(scenario)[0]
    away = np.abs(centres - centre)
    if profile is not None and choice.width is None:
        return profile_grid(profile, mean_b, choice.strips)
    if choice.width is not None:
        needed = 2.0 * float((away + half_widths).max())
        if choice.width < needed * (1.0 - _MARGIN):
            what = "the contacts of all realisations do not fit"
            got, expected = f"{choice.width * 1e3:.4g} mm", f"at least {needed * 1e3:.4g} mm"
            mistake = Mistake("contact", "width", what, got, expected)
            raise ScenarioError(scenario.file, [mistake])
        half = 0.5 * choice.width
        return Grid.spanning(centre - half, centre + half, choice.strips or 121)
    grid = suggested_grid(scenario, model, load)
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
    if not shifting:
        expected = f"{coarser}, or inputs that vary less"
        mistake = Mistake("contact", "strips", takes, None, expected)
        return ScenarioError(scenario.file, [mistake])
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
    return ScenarioError(scenario.file, mistakes)
