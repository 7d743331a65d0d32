"""Forecast of what a run takes: steps, contact solves, time, memory and size of its file.

The numbers of steps and solves, and the time of a step over that of a groove of the forecast, are
fits to measured runs, which they meet within a factor of three.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.errors import ContactError, ResultsFileError, SolverError
from wearsim.evolution.limits import OF_FATIGUE, Limit
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.relocation import FALLEN, SMALL, preload_of
from wearsim.report.text import lapse
from wearsim.scenario import Scenario
from wearsim.scenario.tables.plain import DEFAULT_TOLERANCE
from wearsim.studies.failures import explained, length_key, too_deep
from wearsim.studies.forecast import WearForecast
from wearsim.studies.schedule import RecordSchedule
from wearsim.units import in_engineers_unit

DEEP = 1e-3  # m, a depth of which `check` warns
FEWEST_LOADED = 5  # strips in contact, with which the error is about 2 %
LONG = 600.0  # s, a time of which it warns
_STEPS, _STEPS_POWER = 20.0, 0.42  # at the default tolerance, of 1 + depth over elastic rise
_TOLERANCE_POWER = -0.33
_STEPS_OF_STABILISED = 0.67  # over the number of implicit steps
_STEPS_OF_SPRING = 1.5  # over the number at a constant load
_STAGES, _SOLVES_OF_SPRING = 9.0, 4.0  # of a stabilised step, and solves of each with a spring
_STAGE = 0.35  # time of such a solve, over a solve of a groove
_STEP = 1.3  # time of an implicit step
# time of a step with several contacts at a station: of each contact, over the square of its strips;
# of a station of a cam with rollers that wear, over the cube of the strips of all rollers [s]
_OF_CONTACT, _OF_ROLLERS = 6e-9, 3e-11
_EXPLICIT = 0.7  # time of an explicit step
_WHOLE = 0.95  # of the width of a roller
_CERTAIN = 0.8  # of the passes: a later failure may be an error of the forecast
_HALVINGS = 20  # for the passes at which a limit is reached
_BISECTIONS = 5  # for the pass of a failure
_OF_REFERENCE = 6.0  # time of a step by exact theory, over a solve of its unworn contacts
_RECORD = 2.7  # time of a record between two steps, over a solve of the unworn contacts
_PASS = 0.06  # time of a pass in compiled code, over a solve
_STABLE = 0.03  # wear of the longest stable step, over the line load through pi E*
_STEPS_OF_RESTART = 2.0  # of the stepper, where skids of a cam's roller have moved
_SOLVES_OF_RESTART = 6.0
_STATIONS = 0.08  # to choose the stations again [s]
_START = 1.0  # of the process: imports and kernels read from the disk [s]
_SYSTEM = 4.0  # bytes of a coefficient between two strips, few of which are in contact
_MEMORY = 210e6  # of a process with its kernels [bytes]
_CHECKPOINT, _ROW, _FILE = 25, 40, 60e3  # arrays, numbers of a row, bytes besides
_OF_FILE = 5.0  # memory over the size of the results file
LARGE = 1e9  # bytes, size of the records of which `check` and `run` warn


def forecast_data(
    scenario: Scenario, problem: WearProblem, stepper: str
) -> tuple[dict[str, Any], list[str]]:
    """Return the forecast of a run in SI units, and warnings.

    Parameters
    ----------
    scenario : Scenario
        With the values of its random inputs.
    problem : WearProblem
    stepper : str
        Name of the stepper.

    Raises
    ------
    SolverError
        If the contacts of the unworn bodies or of the predicted groove have no solution.
    """
    passes = float(scenario.total_passes)
    try:
        forecast = WearForecast(scenario, problem)
    except SolverError as error:
        raise explained(error, scenario) from error.__cause__
    wear = forecast.at(passes)
    failure = forecast.failure
    if failure and failure.cause == "skid" and forecast.passes_solved < _CERTAIN * passes:
        raise explained(failure, scenario, forecast.passes_solved, forecast=True)
    if scenario.contact.width is not None:
        _check_strips(forecast, _CERTAIN * passes)
    effort = effort_of(scenario, forecast, stepper)
    data: dict[str, Any] = {
        "limits": _limits(scenario, forecast, wear),
        "depth_m": wear["depth"],
        "roller_depth_m": wear["roller_depth"],
        "width_m": wear["width"],
        "peak_pressure_Pa": wear["peak_pressure"],
        "worn_volume_m3": wear["volume"],
        "dissipated_energy_J": wear["energy"],
        "lift_error_m": wear.get("lift_error"),
        **{key: wear[key] for key in OF_FATIGUE if key in wear},
        **effort,
    }
    return data, list(_warnings(scenario, forecast, wear, effort["wall_time_s"]))


def _limits(
    scenario: Scenario, forecast: WearForecast, wear: Mapping[str, float]
) -> list[dict[str, Any]]:
    """Return the limits of [limit] with the values at the end, and when they are reached."""
    total, limits = float(scenario.total_passes), []
    for key, value in scenario.limit.given.items():
        item = {"quantity": key, "unit": Limit(key.replace("_", " "), value, key).unit}
        reached = None
        if forecast.at(1.0)[key] >= value:
            reached = 0.0
        elif wear[key] >= value:
            low, high = 0.0, 1.0  # parts of the test
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                worn = forecast.at(middle * total)[key] >= value
                low, high = (low, middle) if worn else (middle, high)
            reached = high * total
        limits.append({**item, "limit": value, "at_end": wear[key], "reached_at_passes": reached})
    return limits


def _check_strips(forecast: WearForecast, passes: float) -> None:
    """Raise an error if the groove predicted after some passes does not fit on the strips."""
    early, late, error = 0.0, passes, forecast.failure_on_strips(passes)
    if error is None or error.cause != "edge":
        return
    for _ in range(_BISECTIONS):
        middle = 0.5 * (early + late)
        if failure := forecast.failure_on_strips(middle):
            late, error = middle, failure
        else:
            early = middle
    raise explained(error, forecast.scenario, late, forecast=True)


def _warnings(
    scenario: Scenario, forecast: WearForecast, wear: dict[str, float], seconds: float
) -> Iterator[str]:
    """Return warnings of deep or wide grooves, of contacts that fail, and of a long run."""
    roller, depth = scenario.roller, max(wear["depth"], wear["roller_depth"])
    if scenario.contact.strips is not None and forecast.loaded_strips < FEWEST_LOADED:
        yield (
            f"contact.strips: {forecast.loaded_strips} of {scenario.contact.strips} strips are in"
            f" contact before wear, which needs {FEWEST_LOADED}; raise contact.strips or leave it"
            " out"
        )
    if text := too_deep(scenario, depth):
        yield f"forecast: {text}; the run ends there"
    elif depth > DEEP:
        yield (
            f"forecast: a depth of {depth * 1e3:.3g} mm at the end; are the wear factors and"
            f" {length_key(scenario)} right?"
        )
    if roller.width is not None and wear["width"] > _WHOLE * roller.width:
        yield (
            f"forecast of the width: the groove grows as wide as the roller (roller.width ="
            f" {roller.width * 1e3:.6g} mm)"
        )
    elif wear["width"] > roller.crown_radius:
        yield (
            f"forecast of the width: a groove {wear['width'] * 1e3:.4g} mm wide exceeds"
            f" roller.crown_radius = {roller.crown_radius * 1e3:.6g} mm, and half-spaces are not"
            " valid; set roller.width"
        )
    solved = forecast.passes_solved
    # the load of a spring tends to zero, and a step without load is no failure of the run
    if isinstance(forecast.failure, ContactError) and solved < scenario.total_passes:
        yield (
            f"forecast of the contacts: after about {solved:.2g} passes {forecast.failure.message}"
        )
    if text := large_records(scenario, forecast.problem):
        yield text
    if seconds > LONG:
        less = f"a higher evolution.tolerance than {scenario.evolution.tolerance:g}"
        if scenario.contact.model != "slender":
            less += " or contact.model = 'slender'"
        time = lapse(float(f"{seconds:.2g}"))
        yield f"forecast of the time: about {time}; {less} takes less"


def records_of(scenario: Scenario, problem: WearProblem) -> tuple[float, float]:
    """Return the number of records of a run, and the size of one on its first strips [bytes]."""
    passes = float(scenario.total_passes)
    schedule = RecordSchedule.of(scenario, passes)
    count = (passes / schedule.interval if schedule.interval else schedule.count) + 1.0
    stations, rollers = problem.shape[0], problem.rollers
    return count, 8.0 * (3.0 * stations * rollers + stations + rollers) * problem.grid.strips


def large_records(scenario: Scenario, problem: WearProblem, file: Path | None = None) -> str:
    """Return a warning of records that exceed `LARGE`, or an empty text.

    Raises
    ------
    ResultsFileError
        If the disk of the results file has no place for them.
    """
    count, size = records_of(scenario, problem)
    times, outputs = count * size / LARGE, scenario.outputs
    if times <= 1.0:
        return ""
    if outputs.every_passes is not None:
        given = f"every_passes = {outputs.every_passes}"
        fewer = f"at least {math.ceil(outputs.every_passes * times)}"
    elif outputs.every is not None:
        given = f"every = {in_engineers_unit(outputs.every, 's')}"
        fewer = f"at least {in_engineers_unit(outputs.every * times, 's', 3)}"
    else:
        given, fewer = f"records = {count - 1.0:.0f}", f"at most {math.floor(count / times)}"
    text = (
        f"outputs.{given}: {count:,.0f} records make a results file of"
        f" {size * count / 1e9:,.2g} GB and take {_OF_FILE * size * count / 1e9:,.2g} GB of memory;"
        f" {fewer} makes one below {LARGE / 1e9:g} GB"
    )
    free = math.inf if file is None else shutil.disk_usage(file.absolute().parent).free
    if count * size > free:
        raise ResultsFileError(f"{file}: {text}, and the disk has {free / 1e9:.3g} GB left")
    return text


def restarts_of(problem: WearProblem, depth: float) -> float:
    """Return how often the stepper restarts because skids of a cam's roller have moved.

    Parameters
    ----------
    problem : WearProblem
    depth : float
        Worn depth of both bodies at the end [m].
    """
    cam = problem.kinematics.track
    if cam.relocated is None:
        return 0.0
    force = np.abs(problem.at_stations(preload_of(problem)).ravel())
    force = np.maximum(force, SMALL * force.max())
    return float((cam.stiffness.ravel() * depth / force).max()) / FALLEN


def effort_of(scenario: Scenario, forecast: WearForecast, stepper: str) -> dict[str, float]:
    """Return a forecast of steps, contacts, time, memory and size of the results file of a run.

    The computing time is accurate to a factor of about three.

    Parameters
    ----------
    scenario : Scenario
    forecast : WearForecast
    stepper : str
        Name of the stepper.
    """
    problem, passes = forecast.problem, float(scenario.total_passes)
    wear = forecast.at(passes)
    steps = _STEPS * (1.0 + wear["clearance"] / forecast.elastic) ** _STEPS_POWER
    steps *= (scenario.evolution.tolerance / DEFAULT_TOLERANCE) ** _TOLERANCE_POWER
    records, record = records_of(scenario, problem)
    steps *= _STEPS_OF_STABILISED if stepper == "stabilised" else 1.0
    steps *= _STEPS_OF_SPRING if problem.has_spring else 1.0
    if stepper == "explicit":
        steps = forecast.stable_steps(passes, _STABLE)
    if scenario.evolution.step is not None:
        steps = passes / scenario.evolution.step
    if stepper == "per-pass":
        steps = passes
    restarts = restarts_of(problem, wear["clearance"])
    steps = max(min(steps + _STEPS_OF_RESTART * restarts, passes), 1.0)
    groove, solve = forecast.seconds_of_groove, forecast.seconds
    stages = _STAGES if stepper == "stabilised" else 1.0
    stations, contacts, _ = problem.shape
    strips, rollers = problem.grid.strips, problem.rollers
    if stepper == "stabilised":
        stages *= _SOLVES_OF_SPRING if problem.has_spring else 1.0
        per_step = stages * max(_STAGE * groove, solve)
    elif stepper == "explicit":
        per_step = _EXPLICIT * groove + solve
    elif stepper == "per-pass":
        compiled = problem.model.capabilities.pass_loop
        per_step = (_PASS * solve if compiled else groove) / problem.contacts_each
    else:
        solves = _OF_REFERENCE if scenario.contact.spec.reference else 2.0
        per_step = _STEP * groove + solves * solve
        if contacts > 1:
            per_step += _OF_CONTACT * stations * contacts * strips**2
        if stations > 1 and rollers > 1 and wear["roller_depth"] > 0.0:
            per_step += _OF_ROLLERS * stations * float(rollers * strips) ** 3
    row = _ROW + 25.0 * stations * contacts * (stations > 1)
    rows = row * (records if stepper == "per-pass" else steps)
    size = _FILE + records * record + 8.0 * (_CHECKPOINT * stations * contacts * strips + rows)
    system = contacts * rollers * strips**2 if stepper == "implicit" else 0.0
    return {
        "steps": math.ceil(steps),
        "contact_solves": math.ceil(steps * stages) * problem.contacts_each,
        "wall_time_s": _START
        + steps * per_step
        + restarts * (_STATIONS + _SOLVES_OF_RESTART * groove)
        + _RECORD * max(records - steps, 0.0) * solve,
        "memory_bytes": _MEMORY + _OF_FILE * size + _SYSTEM * system,
        "file_bytes": size,
    }
