"""Forecast of the wear of a test from a few contacts on grooves that fit the roller.

The contact is solved on the unworn bodies and on grooves of geometrically increasing depth D,
u = max(D - (g - min g), 0) with the gap g of the unworn bodies. Wear takes the area A off such a
groove per pass [m^2], over the width W in contact, and its depth grows by

    dD/dn = A/W (1 + e/(2 (D + e))),

where e is the rise of g over half the width of the unworn contact: this contact wears 1.5 times as
fast in its middle as on average, a deep groove evenly. The passes n(D) are the integral of dn/dD,
with a rate that is a power of D + e between two grooves. Loads and random processes have their mean
over the test; a spring has the force that it has at the depth of the groove.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from itertools import pairwise
from time import perf_counter, process_time
from typing import TypeAlias

import numpy as np

from wearsim.errors import SolverError
from wearsim.evolution.contacts import fresh_state, unworn_contacts
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import CamStations
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.loads import fresh_approach, with_feedback
from wearsim.evolution.steppers.single_step import solve_loaded, solve_present
from wearsim.evolution.strips import on_grid
from wearsim.plugins import ContactModelSpec, registry
from wearsim.scenario import Scenario
from wearsim.studies.fatigue.forecast import damage_after, places_across, rates_across
from wearsim.studies.run.assemble import PARABOLA, prepared_model
from wearsim.types import FloatArray, Grid

STRIPS = 61  # over the width in contact of one groove
MOST_STRIPS = 301  # where contacts lie apart
_MARGIN = 1.25  # width of the strips over the width in contact
_RATIO = 2.5  # of the depths of two grooves
MOST_GROOVES = 50
SLOW = 3.0  # s, for a contact by exact theory that is not solved again
_LOST = 8  # grooves on the way to the depth at which the contacts fail
_PARTS = 16  # of the depths between two grooves, over which rates are integrated
_POINTS = 2001  # across the strips, to measure a width

_AS_SOLVED = "pressure", "width", "damage", "length"  # rates that are no integrals
TINY = 1e-200  # for zero, which has no logarithm

#: Rates per roller pass, pressure and width by name, shape (stations,); damage of the places.
Rates: TypeAlias = dict[str, FloatArray]


class WearForecast:
    """Course of the wear of a test, as forecast.

    Parameters
    ----------
    scenario : Scenario
        With the values of its random inputs.
    problem : WearProblem
        The problem of the run, on its strips.

    Attributes
    ----------
    elastic : float
        Rise of the gap of the unworn bodies at the sides of their contact [m].
    loaded_strips : int
        Strips in contact before wear, the least number of all contacts.
    seconds, seconds_of_groove : float
        Measured time of one solution of all contacts on the strips of the run, and of a groove, as
        processor time, which other processes change little [s].
    failure : SolverError or None
        Failure of the contacts on a groove, with which the course ends.

    Raises
    ------
    SolverError
        If the contacts of the unworn bodies have no solution on the strips of the run.
    """

    def __init__(self, scenario: Scenario, problem: WearProblem) -> None:
        self.scenario = self._scout = scenario
        choice = self._scout.contact
        seconds = _seconds_of_all(problem) if choice.spec.reference else math.nan
        # a parabola does not approximate a groove that fits the roller; exact theory takes long
        if choice.model in PARABOLA or choice.spec.reference:
            options = registry().get(ContactModelSpec, "slender").options()
            self._scout = replace(
                self._scout, contact=replace(choice, model="slender", options=options, auto=None)
            )
        if choice.spec.reference:
            problem = replace(problem, model=prepared_model(self._scout, problem.grid))
        self.problem = problem
        fresh_state(problem)  # reads the kernels from the disk
        start = process_time()
        self._fresh = fresh_state(problem)
        self.seconds = seconds if choice.spec.reference else process_time() - start
        self.seconds_of_groove = np.inf
        self.failure: SolverError | None = None
        loaded = problem.values_of(self._fresh.contacts, "line_load") > 0.0
        rise = problem.nominal_gap - problem.nominal_least_gap[..., None]
        self.loaded_strips = int(loaded.sum(axis=-1).min())
        first, last = loaded.argmax(axis=-1), -1 - loaded[..., ::-1].argmax(axis=-1)
        middle = 0.5 * (problem.grid.y[first] + problem.grid.y[last])
        self._centres = np.array([middle.min(), middle.max()])
        # of the nominal surfaces: a start profile may fit the roller, without any rise
        half = 0.5 * problem.grid.spacing * max(int(loaded.sum(axis=-1).max()) - 1, 1)
        self.elastic = float(rise.max(initial=self._scout.axial_gap.depth_at(half), where=loaded))
        self._places = places_across(problem)
        self._depths: list[float] = []
        self._rates: list[Rates] = []
        self._add(0.0)

    def at(self, passes: float) -> dict[str, float]:
        """Return the wear after some roller passes.

        Returns
        -------
        dict of str to float
            "depth" of the cylinder, "roller_depth", "clearance" (of both bodies) and, of a cam,
            "lift_error" [m]; "volume" of the cylinder [m^3], "width" in contact [m],
            "peak_pressure" [Pa] where the load is spread evenly, and "energy" [J]; with fatigue the
            effective "damage" and the probability of "pitting".
        """
        self._extend(passes)
        course, problem = self._course(), self.problem

        def there(name: str) -> FloatArray:
            """Return a column of every station at the passes."""
            columns = zip(course["passes"].T, course[name].T, strict=True)
            return np.array([np.interp(passes, *column) for column in columns])

        depth, track = there("total"), problem.kinematics.track
        values = {
            "depth": there("cylinder").max(),
            "roller_depth": there("roller").max(),
            "volume": np.mean(math.tau * np.ravel(track.track_radius) * there("area")),
            "width": there("width").max(),
            "peak_pressure": there("pressure").max(),
            "energy": problem.mean_over_turn(there("energy")[:, None])[0, 0],
            "clearance": depth.max(),
        }
        if isinstance(track, CamStations):
            away = np.sign(np.ravel(track.load_factor)) * depth
            values["lift_error"] = np.ptp(away / np.cos(np.ravel(track.pressure_angle)))
        if problem.fatigue is not None:
            values |= damage_after(problem, self._places, course, passes)
        return {
            name: float(value) if value > math.sqrt(TINY) else 0.0 for name, value in values.items()
        }

    @property
    def passes_solved(self) -> float:
        """Roller passes up to the deepest groove whose contacts were solved."""
        return float(self._course()["passes"][-1].min())

    def failure_on_strips(self, passes: float) -> SolverError | None:
        """Return the failure of the contacts on the groove after some passes, on the run's strips.

        Parameters
        ----------
        passes : float
            Above zero.
        """
        depth = self.at(passes)["clearance"]
        try:
            self._rates_on(*self._grooves(depth, self.problem.grid), depth)
        except SolverError as error:
            return error
        return None

    def stable_steps(self, passes: float, part: float) -> float:
        """Return the number of explicit steps that each wear a part of q/(pi E*) at most."""
        load = float(self._fresh.contacts.line_load.max())
        rate = (self._rates[0]["cylinder"] + self._rates[0]["roller"]).max()
        return float(passes * rate / (part * load / (np.pi * self._scout.pair.contact_modulus)))

    def _extend(self, passes: float) -> None:
        """Solve further grooves until the course has some passes, or the contacts fail."""
        while (
            self.failure is None
            and len(self._depths) < MOST_GROOVES
            and (len(self._depths) == 1 or self._course()["passes"][-1].min() < passes)
        ):
            depth = max(self.elastic, _RATIO * self._depths[-1])
            try:
                self._add(depth)
            except SolverError as error:
                self._approach(depth, error)

    def _approach(self, depth: float, error: SolverError) -> None:
        """Add grooves up to the depth at which the contacts fail."""
        for _ in range(_LOST):
            middle = 0.5 * (self._depths[-1] + depth)
            try:
                self._add(middle)
            except SolverError as failure:
                depth, error = middle, failure
        self.failure = error

    def _course(self) -> dict[str, FloatArray]:
        """Return the columns of the course, shape (points, stations)."""
        sizes = np.array(self._depths) + self.elastic
        parts = [np.geomspace(*pair, _PARTS + 1)[1:] for pair in pairwise(sizes)]
        dense = np.concatenate([sizes[:1], *parts])
        columns = {
            name: _interpolated(dense, sizes, np.array([rates[name] for rates in self._rates]))
            for name in self._rates[0]
        }
        rate = columns["cylinder"] + columns["roller"]
        depth = (dense - self.elastic)[:, None]
        passes = _integral(1.0 / rate, depth)
        return {
            "passes": passes,
            "total": np.broadcast_to(depth, passes.shape),
            "cylinder": _integral(columns["cylinder"] / rate, depth),
            "roller": _integral(columns["roller"] / rate, depth),
            "area": _integral(columns["area"], passes),
            "energy": _integral(columns["power"], passes) / self.problem.kinematics.pass_rate,
            **{name: columns[name] for name in _AS_SOLVED if name in columns},
        }

    def _add(self, depth: float) -> None:
        """Solve the contacts on grooves of a depth."""
        start = process_time()
        problem, state = self._grooves(depth)
        self._rates.append(self._rates_on(problem, state, depth))
        self._depths.append(depth)
        if depth:
            self.seconds_of_groove = min(self.seconds_of_groove, process_time() - start)

    def _grooves(self, depth: float, grid: Grid | None = None) -> tuple[WearProblem, WearState]:
        """Return problem and state with grooves of a depth in both bodies.

        The strips are those given, or suit the groove.
        """
        if depth == 0.0:
            return self.problem, self._fresh
        scenario, last = self._scout, self._rates[-1]
        groove, width = depth + self.elastic, scenario.roller.width or np.inf
        half = min(float(scenario.axial_gap.half_width(groove)), 0.5 * width)
        low, high = self._centres + np.array([-_MARGIN, _MARGIN]) * half
        if scenario.roller.width is not None and not scenario.axial_gap.is_crowned:
            # the lowest point may be away from the middle of the groove
            offsets = np.array(scenario.per_roller(scenario.roller.offset))
            low = min(low, offsets.min() - 0.5 * _MARGIN * scenario.roller.width)
            high = max(high, offsets.max() + 0.5 * _MARGIN * scenario.roller.width)
        strips = int(min(STRIPS * (high - low) / (2.0 * _MARGIN * half), MOST_STRIPS))
        grid = grid or Grid.spanning(float(low), float(high), strips)
        problem = on_grid(self.problem, grid)
        if scenario is not self.scenario:
            problem = replace(problem, model=prepared_model(scenario, grid))
        worn = np.maximum(depth - problem.nominal_gap + problem.nominal_least_gap[..., None], 0.0)
        rollers = np.array(
            [[worn[:, problem.roller == k].max(axis=(0, 1)) for k in range(problem.rollers)]]
        )
        cylinder = np.repeat(worn.max(axis=(0, 1), keepdims=True), len(worn), axis=0)
        share = last["cylinder"] / np.maximum(last["cylinder"] + last["roller"], TINY)
        # a spring needs a first guess of the load on these strips
        state = fresh_state(problem) if problem.has_spring else self._fresh
        return problem, state.replaced(
            cylinder_depth=share[:, None, None, None] * cylinder,
            roller_depth=(1.0 - share.max()) * rollers,
            approach_factor=self._fresh.approach_factor,
        )

    def _rates_on(self, problem: WearProblem, state: WearState, depth: float) -> Rates:
        """Return rates per roller pass of the contacts on grooves of a depth, by station."""
        start, stop = np.zeros(1), np.array([self.scenario.total_time])
        here = problem.at_time(start, stop)
        force = here.mean_force(start, stop)

        def loads_at(displacement: FloatArray) -> FloatArray:
            return with_feedback(here, force, displacement, state.terms)

        fresh = fresh_approach(here, state, force)
        contacts, _, _ = solve_loaded(
            here, state, loads_at, fresh, None, partial(solve_present, cold=True)
        )
        spacing, rise = here.grid.spacing, here.nominal_gap - here.nominal_least_gap[..., None]
        parts = here.wear_parts(contacts, 1.0).sum(axis=-1) * spacing
        cylinder, roller = (values[..., 0].sum(axis=1) for values in parts)
        roller = np.broadcast_to(roller.sum(axis=0), cylinder.shape)
        width = _width_below(here.grid, rise.min(axis=(0, 1, 2)), depth + self.elastic)
        shape = (1.0 + 0.5 * self.elastic / (depth + self.elastic)) / width
        pressure = here.values_of(contacts, "peak_pressure")
        if depth > 0.0:  # without the ends of the groove, where it fits the roller too closely
            load, length = (
                _median(here.values_of(contacts, name)) for name in ("line_load", "half_length")
            )
            pressure = 2.0 * load / (np.pi * length)
        of_fatigue = {}
        if here.fatigue is not None:
            damage = rates_across(here, contacts, self._places, is_groove=depth > 0.0)
            lengths = _median(here.values_of(contacts, "half_length"))
            of_fatigue = {"damage": damage, "length": lengths.mean(axis=(1, 2))}
        power = here.values_of(contacts, "power") * here.cylinder_share[:, None]
        return {
            "cylinder": shape * cylinder,
            "roller": shape * roller / here.rollers,
            "area": cylinder,
            "power": power.sum(axis=(1, 2)) * here.kinematics.physical_rollers,
            "pressure": pressure.max(axis=(1, 2)),
            "width": np.full(len(cylinder), width),
            **of_fatigue,
        }


def _seconds_of_all(problem: WearProblem) -> float:
    """Return the time that all contacts of the unworn bodies take, from the time of one [s]."""
    batch = unworn_contacts(problem.at_time(np.zeros(1), np.zeros(1)))
    hardest, seconds = batch.at(np.array([batch.normal_force.argmax()])), 0.0
    for _ in range(2):  # the first reads kernels from the disk, unless it takes far longer anyway
        if seconds < SLOW:
            start = perf_counter()
            problem.model.solve(hardest)
            seconds = perf_counter() - start
    return seconds * len(batch)


def _integral(values: FloatArray, over: FloatArray) -> FloatArray:
    """Return the integral from the first point on, by the trapezoidal rule along axis 0."""
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(over, axis=0)
    return np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])


def _interpolated(x: FloatArray, points: FloatArray, values: FloatArray) -> FloatArray:
    """Return values, shape (points, ...), interpolated along axis 0 as powers of x."""
    logs = np.log(np.maximum(values, TINY))
    place = np.interp(np.log(x), np.log(points), np.arange(len(points)))
    first = np.minimum(place.astype(np.int64), len(points) - 2)
    part = (place - first).reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray(np.exp((1.0 - part) * logs[first] + part * logs[first + 1]))


def _median(values: FloatArray) -> FloatArray:
    """Return the median of the positive values along the last axis."""
    return np.asarray(np.nanmedian(np.where(values > 0.0, values, np.nan), axis=-1))


def _width_below(grid: Grid, rise: FloatArray, height: float) -> float:
    """Return the width over which a rise is below a height [m]."""
    fine = np.linspace(*grid.edges, _POINTS)
    return float(np.mean(np.interp(fine, grid.y, rise) < height) * (grid.edges[1] - grid.edges[0]))
