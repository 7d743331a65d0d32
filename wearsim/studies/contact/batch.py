"""Realisations of one contact: from drawn inputs to gaps and operating points, and solved."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from wearsim.contact_batch import BatchSolution, OperatingPoints
from wearsim.errors import ContactError, SolverError
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
from wearsim.studies.contact.grid import realisation_grid
from wearsim.studies.run.assemble import flat_gap, load_range, slip_profile, start_height
from wearsim.studies.run.choose_stepper import check_model
from wearsim.studies.run.grid import touched_at
from wearsim.types import Creepage, FloatArray, OperatingPoint

Columns = Mapping[str, FloatArray]
"""What the contacts depend on, by the scenario's key: each (contacts,)."""


class Realisations:
    """One contact of a scenario, in every realisation of its random inputs.

    The contact is that of the first roller on the cylinder at the start of the load. A realisation
    is the same whatever others are solved with it, but for the strips, which hold them all.

    Parameters
    ----------
    scenario : Scenario
    count : int
        Realisations.

    Raises
    ------
    ScenarioError
        If the strips or the points within a contact do not suit the draws.
    CapabilityError
        If the contact model cannot do what is asked.
    """

    def __init__(self, scenario: Scenario, count: int) -> None:
        self.scenario, self.count = scenario, count
        self.model = scenario.contact.build()
        check_model(scenario, self.model)
        self._load = load_range(scenario, scenario.load.build(), 0.0)[0]
        self.draws = draw_contacts(scenario, count)
        item = self.draws.field
        self._field = LocalFriction(scenario, self.model, item) if item is not None else None
        everything = self._columns(slice(0, count))
        self.grid = realisation_grid(
            scenario,
            self.model,
            self._load,
            everything[LOAD],
            touched_at(scenario, everything[OFFSET], everything[TILT]),
        )
        self.model.prepare(self.grid, (scenario.cylinder.material, scenario.roller.material))
        self._curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
        self._height = start_height(scenario.cylinder.profile, self.grid)
        self.friction_points = 0
        if self._field is not None:
            self.friction_points = self._checked_points(self._field, everything)

    def loads(self, first: int, count: int) -> FloatArray:
        """Return the loads of some realisations on end, shape (count,) [N]."""
        return self._columns(slice(first, first + count))[LOAD]

    def solve(self, first: int, count: int) -> BatchSolution:
        """Return some realisations on end, solved; leading axes (1, 1, count).

        Parameters
        ----------
        first, count : int
            The first realisation, counted from 0, and how many.

        Raises
        ------
        ContactError
            If one of them has no solution, naming it and what was drawn for it.
        """
        try:
            return self._solve(slice(first, first + count))
        except SolverError:
            for number in range(first, first + count):
                try:
                    self._solve(slice(number, number + 1))
                except SolverError as error:
                    raise self._failure(number, error) from error
            raise  # it takes more than one to fail

    def solve_mean_problem(self) -> BatchSolution:
        """Return the contact with every input at its mean, solved; leading axes (1, 1, 1)."""
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
        """Return what some realisations depend on."""
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

        The tilt counts once: as the shift of the contact away from the apex, or, where it shifts
        nothing, as the spin's -phi y.
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
        points = OperatingPoints(
            normal_force=columns[LOAD],
            longitudinal=columns[LONGITUDINAL],
            lateral=columns[YAW],
            spin=columns[TILT] / self.scenario.roller.radius,
            friction=columns[FRICTION],
            rolling_speed=self.scenario.rolling_speed,
            variation=self._variation(columns),
        )
        return points if self.scenario.creepage.drive == "creepage" else self._free(points, columns)

    def _free(self, points: OperatingPoints, columns: Columns) -> list[OperatingPoint]:
        """Return the points of a roller that finds its creepage from the bearing torque."""
        roller, s = self.scenario.roller, self._from_apex(columns)
        radius = roller.radius - s * s / (2.0 * roller.crown_radius)
        arms = np.broadcast_to(radius, (len(points), self.grid.strips))
        return [
            OperatingPoint(
                normal_force=point.normal_force,
                rolling_speed=point.rolling_speed,
                creepage=Creepage(0.0, point.creepage.lateral, point.creepage.spin, varying),
                friction=point.friction,
                bearing_torque=float(torque),
                rolling_radius=arm,
            )
            for point, torque, arm in zip(points, columns[TORQUE], arms, strict=True)
            for varying in (point.creepage.variation,)
        ]

    def _solve(self, part: slice) -> BatchSolution:
        columns = self._columns(part)
        gap, points = self._gap(columns), self._points(columns)
        if self._field is not None and isinstance(points, OperatingPoints):
            x, y = self.model.friction_points_batch(gap, self._curvature, points)
            points = self._field.put(points, x, y, part.start)
        return self.model.solve_batch(gap, self._curvature, points)

    def _checked_points(self, field: LocalFriction, everything: Columns) -> int:
        """Return how many points a strip has where friction is taken, once they resolve it."""
        heaviest = int(np.argmax(everything[LOAD]))
        columns = {key: values[heaviest : heaviest + 1] for key, values in everything.items()}
        try:
            x, _ = self.model.friction_points_batch(
                self._gap(columns), self._curvature, self._points(columns)
            )
        except SolverError as error:
            raise self._failure(heaviest, error) from error
        field.check(x[0], self.grid.spacing)
        return int(x.shape[1])

    def _failure(self, number: int, error: SolverError) -> ContactError:
        """Return the error of one realisation, with what was drawn for it."""
        units = self.draws.units
        drawn = ", ".join(
            f"{key} {values[number]:.6g}" + (f" {units[key]}" if units[key] != "1" else "")
            for key, values in self.draws.values.items()
        )
        return ContactError(
            f"realisation {number} of seed {self.scenario.seed} has no solution: {error}"
            f"\nits inputs: {drawn or 'none but the friction field'}",
            error.state,
        )
