"""Realisations of an ensemble: strips, runs, and the control variate."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.errors import SolverError, WearsimError, failure_text
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import Evolution
from wearsim.evolution.strips import averaged, same_strips
from wearsim.mechanics.numerics.jit import not_cached, only_compiled
from wearsim.plugins import BODIES, ContactModel
from wearsim.scenario import Scenario, parse_scenario
from wearsim.studies.ensemble.batch import RealisationRun, RunObservations, batch_groups, observe
from wearsim.studies.ensemble.designs import BASE_PLANS, EnsemblePlan, parse_plan, sources
from wearsim.studies.ensemble.file.data import EnsembleData, Outcome
from wearsim.studies.failures import explained
from wearsim.studies.kernels import kernels_of
from wearsim.studies.run.assemble import assemble_problem, prepared_model
from wearsim.studies.run.draws import Drawer
from wearsim.studies.run.grid import (
    check_number_of_strips,
    ends_roller,
    lattice,
    shared_strips,
    start_of,
    strips_of_run,
)
from wearsim.types import FloatArray, Grid

if TYPE_CHECKING:
    from wearsim.studies.ensemble.result import EnsembleResult


DRAWS = 1_000_000  # draws from which the mean of the control variate is computed
_BLOCK = 65536
_FIRST_DRAW = 2**31  # number of the first of these draws, beyond any realisation
_NEWTON_TOLERANCE = 1e-14
AXIS_REALISATIONS = 64  # realisations that determine the axis, whatever the ensemble's size
WIDTH_MARGIN = 1.05  # width of the axis over the widest of these realisations


def control_of(drawer: Drawer, draws: int = DRAWS) -> dict[str, float] | None:
    """Return the moments of the closed-form depth, or None where it is not defined.

    They are "mean" and "std" [m], from the number "draws" of draws, which follow those of all
    realisations and are independent of them.

    Parameters
    ----------
    drawer : Drawer
    draws : int
    """
    depths = np.concatenate(
        [
            closed_form_depths(drawer.scenario, drawer.columns(_FIRST_DRAW + start, count), count)
            for start in range(0, draws, _BLOCK)
            for count in (min(_BLOCK, draws - start),)
        ]
    )
    if not np.isfinite(depths).all():
        return None
    return {"mean": float(depths.mean()), "std": float(depths.std(ddof=1)), "draws": draws}


def closed_form_depths(
    scenario: Scenario, columns: Mapping[str, FloatArray], count: int
) -> FloatArray:
    """Return the worn depth of the cylinder in full slip of rigid bodies, shape (count,) [m].

    Roller and cylinder wear to conforming profiles: with the worn area C per load and pass the
    total depth is d = [(3/4) C N n / sqrt(2 R_crown)]^(2/3), divided between the bodies as their
    wear. A mounting spring reduces the load by k_s d:
    artanh x - x = n C k_s^(3/2) / (4 sqrt(2 R_crown N_0)), x^2 = k_s d / N_0.

    Parameters
    ----------
    scenario : Scenario
    columns : mapping of str to ndarray, shape (count,) or (count, rollers)
        Drawn values by the scenario's key; the others are at their mean.
    count : int
        Realisations.

    Returns
    -------
    ndarray
        nan where the wear law is not linear in the dissipation.
    """
    rollers, speed = scenario.operation.rollers, scenario.rolling_speed

    def value(key: str, mean: float | tuple[float, ...]) -> FloatArray:
        drawn = columns.get(
            key, np.broadcast_to(np.array(scenario.per_roller(mean)), (count, rollers))
        )
        return drawn[:, None] if drawn.ndim == 1 else drawn

    creepage, load = scenario.creepage, scenario.load.built
    law = None if scenario.wear is None else scenario.wear.built
    factors = {
        body: factor * speed
        for body in BODIES
        if law is not None and (factor := law.depth_per_dissipation(body, speed)) is not None
    }
    if len(factors) < len(BODIES):
        return np.full(count, np.nan)
    slip = np.hypot(
        value("creepage.longitudinal", creepage.longitudinal or 0.0),
        value("creepage.yaw", creepage.yaw),
    )
    sliding = value("friction.coefficient", scenario.friction.coefficient) * slip
    force = np.maximum(value("load.normal_force", load.mean(0.0, scenario.total_time)), 0.0)
    mean_force = force.mean(axis=1) if force.shape[1] > 1 else force[:, 0]
    cylinder, roller = (
        value(f"wear.{body}.k_over_h", factors[body])[:, 0] for body in ("cylinder", "roller")
    )
    opening = cylinder + scenario.cylinder.radius / scenario.roller.radius / rollers * roller
    worn = np.broadcast_to((sliding * force).mean(axis=1) * opening, (count,))
    stiffness = value("load.stiffness", load.stiffness)[:, 0]
    depth = _total_depth(scenario, worn, np.broadcast_to(mean_force, (count,)), stiffness)
    part = np.where(opening > 0.0, cylinder / np.where(opening > 0.0, opening, 1.0), 0.0)
    return np.asarray(depth * part)


def _total_depth(
    scenario: Scenario, worn: FloatArray, force: FloatArray, stiffness: FloatArray
) -> FloatArray:
    """Return the total worn depth of cylinder and roller [m].

    Parameters
    ----------
    scenario : Scenario
    worn, force : ndarray, shape (count,)
        Worn area per pass at the initial load [m^2], and that load [N].
    stiffness : ndarray, shape (count,) or (1,)
        Loss of load per depth [N/m].
    """
    gap, passes = scenario.axial_gap, scenario.total_passes
    # of other forms, the crown of which a groove of the same cross-section is as deep
    mean = float(gap.depth_of(float(np.mean(worn)) * passes))
    crown = 2.0 * gap.radius_at(0.0 if gap.is_crowned else float(gap.half_width(mean)))
    free = (0.75 * worn * passes / np.sqrt(crown)) ** (2.0 / 3.0)
    held = np.where((stiffness > 0.0) & (force > 0.0), stiffness, 0.0)
    safe_force = np.where(force > 0.0, force, 1.0)
    # t of artanh x - x = t, which for a soft spring is x^3/3
    x = _inverse(passes * worn * held**1.5 / (4.0 * np.sqrt(crown) * safe_force**1.5))
    reached = safe_force * x**2 / np.where(held > 0.0, held, 1.0)
    # for a soft spring the difference of artanh x and x is dominated by rounding
    return np.asarray(np.where(x > 1e-4, reached, free))


def _inverse(t: FloatArray) -> FloatArray:
    """Return x of artanh x - x = t by Newton's method from below, for t >= 0."""
    x = np.minimum(np.minimum(np.cbrt(3.0 * t), np.tanh(t + 1.0)), 1.0 - 1e-15)
    for _ in range(60):
        slope = np.where(x > 0.0, x**2 / (1.0 - x**2), 1.0)
        new = np.clip(x - (np.arctanh(x) - x - t) / slope, 0.5 * x, 0.5 * (1.0 + x))
        if (np.abs(new - x) <= _NEWTON_TOLERANCE * x).all():
            break
        x = new
    return np.asarray(x)


def profile_axis(scenario: Scenario) -> Grid:
    """Return the strips on which the final profiles of an ensemble are stored.

    They are in line with those that realisations share, and cover the grooves predicted for the
    first realisations. The strips of the tests are other ones, see `shared_strips`.

    Parameters
    ----------
    scenario : Scenario
        A scenario with random inputs; without any, the one groove counts.

    Raises
    ------
    WearsimError
        If no strips fit any of the first realisations, with the error of the first one.
    """
    drawer, reach, error = Drawer(scenario, "monte-carlo"), [], None
    for number in range(AXIS_REALISATIONS if scenario.random else 1):
        try:
            setup = drawer.draw(number)
            check_number_of_strips(setup.scenario, strips_of_run(setup))
            reach.append(abs(setup.centre) + setup.final)
        except WearsimError as failure:
            error = error or failure
    if not reach:
        raise error or AssertionError
    grid = shared_strips(scenario)
    fixed = scenario.contact.width is not None or ends_roller(scenario, *grid.edges)
    half = max(WIDTH_MARGIN * max(reach), 0.5 * grid.strips * grid.spacing)
    return grid if fixed else lattice(grid, half)


class RealisationRunner:
    """Runs of realisations of a scenario by number; can be sent to another process.

    Parameters
    ----------
    scenario : Scenario
    plan : str
        Name of the ensemble's plan.
    total : int
        Realisations of the whole ensemble.
    grid : Grid
        Strips of the profiles that are kept.
    """

    def __init__(self, scenario: Scenario, plan: EnsemblePlan, total: int, grid: Grid) -> None:
        self.text, self.file, self.files = scenario.text, scenario.file, dict(scenario.files)
        self.plan, self.total, self.grid = plan, total, grid
        self._prepared: dict[object, ContactModel] = {}

    @classmethod
    def continuing(cls, result: EnsembleResult, total: int | None) -> RealisationRunner:
        """Return the runner of the realisations in a file.

        Parameters
        ----------
        result : EnsembleResult
            Content of the file.
        total : int, optional
            New number of realisations; by default that of the file.
        """
        data = result.raw
        return cls(
            result.scenario,
            parse_plan(data.plan),
            total or data.requested,
            Grid(data.variables["y"], data.strip_width),
        )

    @property
    def state(self) -> dict[str, object]:
        """Fields of the file that depend on the number of realisations."""
        return {}

    def further(self, result: EnsembleResult) -> RealisationRunner | None:
        """Return the runner of realisations that follow from earlier ones, None without any."""
        return None

    def result(self, data: EnsembleData, path: Path | None) -> EnsembleResult:
        """Return the result of the realisations in a file."""
        from wearsim.studies.ensemble.result import EnsembleResult  # noqa: PLC0415  (not of workers)

        return EnsembleResult(data, path)

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes to be sent, without those that each process derives from them."""
        derived = {"scenario", "drawer", "start", "_prepared"}
        kept = {name: value for name, value in self.__dict__.items() if name not in derived}
        return {**kept, "_prepared": {}}

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario, read from its text."""
        return parse_scenario(self.text, self.file, self.files.__getitem__)

    @cached_property
    def drawer(self) -> Drawer:
        """Sampler of the random inputs."""
        return Drawer(self.scenario, BASE_PLANS[self.plan], self.total)

    @cached_property
    def start(self) -> Grid:
        """Strips with which all realisations start that fit on them."""
        return shared_strips(self.scenario)

    def __call__(self, numbers: Sequence[int]) -> list[Outcome]:
        """Run realisations; the outcome of one that fails holds its error.

        Parameters
        ----------
        numbers : sequence of int

        Returns
        -------
        list of Outcome
            In the same order.
        """
        outcomes: dict[int, Outcome] = {}
        for group in batch_groups(self.prepared(numbers, outcomes)):
            for run, observations in zip(group, observe(group), strict=True):
                outcomes[run.number] = self.outcome(run, observations)
        return [outcomes[number] for number in numbers]

    def prepared(
        self, numbers: Iterable[int], outcomes: dict[int, Outcome]
    ) -> list[RealisationRun]:
        """Return the runs of realisations, and add the outcomes of those with an error."""
        runs = []
        for number in numbers:
            drawn: dict[str, float | FloatArray] = {}
            try:
                runs.append(self.prepare(number, drawn))
            except Exception as error:  # an error fails this realisation only
                outcomes[number] = Outcome(number=number, values=drawn, error=failure_text(error))
        return runs

    def prepare(self, number: int, drawn: dict[str, float | FloatArray]) -> RealisationRun:
        """Return the run of a realisation, and add the values of its random inputs to `drawn`."""
        setup = self.drawer.draw(number, *sources(self.plan, self.drawer.groups, number))
        drawn.update({**setup.values, **setup.time_means})
        problem, stepper, _ = assemble_problem(setup, start_of(setup, self.start), self._model)
        return RealisationRun(number, drawn, setup, problem, stepper)

    def compile_kernels(self) -> None:
        """Compile the kernels in this process if the cache lacks any, by one step of a test.

        Workers, each of which would otherwise compile them, then read them from the cache if they
        share it.
        """
        if not not_cached(kernels_of(self.scenario)):
            return
        # an error of the realisation is reported when it is run
        with only_compiled(), suppress(Exception):
            run = self.prepare(0, {})
            state, steps = fresh_state(run.problem), run.scenario.evolution.max_steps
            test = run.problem, state, run.stepper, run.stop, steps, run.schedule.next_record
            next(iter(Evolution(*test)), None)

    def _model(self, scenario: Scenario, grid: Grid) -> ContactModel:
        """Return the contact model prepared for strips, shared by realisations if possible."""
        if grid is not self.start:
            return prepared_model(scenario, grid)
        key = scenario.contact, scenario.materials
        if key not in self._prepared:
            self._prepared = {key: prepared_model(scenario, grid)}
        return self._prepared[key]

    def outcome(self, run: RealisationRun, observations: RunObservations | Exception) -> Outcome:
        """Return the outcome of a realisation with its observations, or the error of its test."""
        drawn = dict(run.drawn)
        if isinstance(observations, SolverError):
            observations = explained(observations, run.scenario)
        if isinstance(observations, Exception):
            return Outcome(number=run.number, values=drawn, error=failure_text(observations))
        rows, scalars = observations.rows, dict(observations.scalars)
        courses = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        if observations.failure is not None:
            error = failure_text(observations.failure)
            return Outcome(number=run.number, values={**drawn, **courses}, error=error)
        unusable = [
            f"{name} is not finite at record {number}"
            for number, row in enumerate(rows)
            for name, value in row.items()
            if not math.isfinite(value)
        ]
        if unusable:
            return Outcome(number=run.number, values=drawn, error=unusable[0])
        if self.plan == "control-variate":
            columns = {key: value[None] for key, value in run.setup.values.items()}
            scalars["control"] = float(closed_form_depths(self.scenario, columns, 1)[0])
        curves, grids = observations.curves, (observations.grid, self.grid)
        if not same_strips(*grids):
            profiles = {name: curve for name, curve in curves.items() if name.endswith("_profile")}
            curves = curves | {name: averaged(curve, *grids) for name, curve in profiles.items()}
        return Outcome(number=run.number, values={**drawn, **courses, **scalars, **curves})
